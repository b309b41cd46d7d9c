/* Writes a figure as SVG, PNG or PDF. The converter reads only the SVG, so no text of a user reaches another
 * language. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <string.h>

struct picture_format {
    const char *suffix;
    const char *const *argv; /* the command that converts SVG; NULL if none is needed */
};

static const char converter[] = "rsvg-convert";
/* A PNG has two pixels for each unit of the SVG. With a fixed date, equal figures are equal PDF files. */
static const char *const make_png[] = {converter, "--format=png", "--zoom=2", NULL};
static const char *const make_pdf[] = {"env", "SOURCE_DATE_EPOCH=0", converter, "--format=pdf", NULL};

static const struct picture_format formats[] = {{".svg", NULL}, {".png", make_png}, {".pdf", make_pdf}};

const struct picture_format *figures_picture_format_of(const char *path) {
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof formats / sizeof formats[0]; i++)
        if (strcmp(dot, formats[i].suffix) == 0)
            return &formats[i];
    return NULL;
}

bool figures_picture_can_write(const struct picture_format *format) {
    const bool is_good = !format->argv || system_process_find(converter);
    if (!is_good)
        fprintf(stderr,
                "refdyn: %s is not installed, which writes %s files (Debian: apt install librsvg2-bin)\n",
                converter, format->suffix);
    return is_good;
}

static bool run(const struct picture_format *format, const struct scratch *scratch, const char *svg,
                const char *made) {
    enum { BY_SIGNAL = 128 /* plus the signal's number is the result of a process that a signal ended */ };
    const char *log = system_scratch_file(scratch, "log");
    struct process process;
    const int error = system_process_start(&process, scratch, format->argv, svg, made, log);
    const bool has_ended = !error && system_process_wait(&process, 1, NULL) == 0;
    if (has_ended && process.result == 0)
        return true;
    if (system_interrupt_is_new())
        return false;
    fprintf(stderr, "refdyn: %s failed", converter);
    if (error)
        fprintf(stderr, ": %s", strerror(error));
    else if (process.result > BY_SIGNAL)
        fprintf(stderr, ", by signal %d (%s)", process.result - BY_SIGNAL,
                strsignal(process.result - BY_SIGNAL));
    fputs(":\n", stderr);
    system_copy_file(log, stderr);
    return false;
}

static bool convert(const struct picture_format *format, const struct scratch *scratch, const char *svg,
                    FILE *out) {
    const char *made = system_scratch_file(scratch, "made");
    if (!system_scratch_write(scratch, "svg", svg, strlen(svg)) ||
        !run(format, scratch, system_scratch_file(scratch, "svg"), made))
        return false;
    const bool is_good = system_copy_file(made, out);
    if (!is_good)
        fprintf(stderr, "refdyn: %s: %s\n", made, strerror(errno));
    return is_good;
}

bool figures_picture_write(const struct picture_format *format, const char *svg, FILE *out) {
    struct scratch scratch;
    if (!format->argv) {
        fputs(svg, out); /* write errors are checked when the file is closed */
        return true;
    }
    if (!system_scratch_open(&scratch, system_scratch_parent(), "refdyn-plot-"))
        return false;
    const bool is_good = convert(format, &scratch, svg, out);
    system_scratch_close(&scratch);
    return is_good;
}
