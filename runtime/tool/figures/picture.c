/* A figure as SVG, PNG or PDF: see picture.h. */
#include "figures/picture.h"
#include "text/csv.h"
#include "system/temporary_folder.h"
#include "text/output.h"
#include "system/process.h"

#include <errno.h>
#include <string.h>

struct picture_format {
    const char *suffix;
    const char *const *argv; /* what makes it from SVG; NULL: nothing */
};

static const char converter[] = "rsvg-convert";
/* Two pixels for one; a PDF says when it was made, which would make each another one. */
static const char *const make_png[] = {converter, "--format=png", "--zoom=2", NULL};
static const char *const make_pdf[] = {"env", "SOURCE_DATE_EPOCH=0", converter, "--format=pdf", NULL};

static const struct picture_format formats[] = {{".svg", NULL}, {".png", make_png}, {".pdf", make_pdf}};

const struct picture_format *picture_format_of(const char *path) {
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof formats / sizeof formats[0]; i++)
        if (strcmp(dot, formats[i].suffix) == 0)
            return &formats[i];
    return NULL;
}

bool picture_can_write(const struct picture_format *format) {
    const bool is_good = !format->argv || process_find(converter);
    if (!is_good)
        fprintf(stderr, "refdyn: %s makes %s files and is not installed (Debian: apt install librsvg2-bin)\n",
                converter, format->suffix);
    return is_good;
}

static bool copy_file(const char *path, FILE *out) {
    FILE *file = fopen(path, "rb");
    for (int c; file && (c = getc(file)) != EOF;)
        putc(c, out);
    const bool is_good = file && !ferror(file);
    if (file)
        fclose(file);
    return is_good;
}

/* The files in the folder: what goes in, what comes out, what is said. */
struct files {
    char *svg, *made, *log;
};

static bool run(const struct picture_format *format, const struct scratch *scratch,
                const struct files *files) {
    enum { BY_SIGNAL = 128 /* and its number, as the result of a process: see process.h */ };
    struct process process;
    const int error = process_start(&process, scratch, format->argv, files->svg, files->made, files->log);
    const bool has_ended = !error && process_wait(&process, 1) == 0;
    if (has_ended && process.result == 0)
        return true;
    if (interrupt_is_new())
        return false;
    fprintf(stderr, "refdyn: %s failed", converter);
    if (error)
        fprintf(stderr, ": %s", strerror(error));
    else if (process.result > BY_SIGNAL)
        fprintf(stderr, ", by signal %d (%s)", process.result - BY_SIGNAL,
                strsignal(process.result - BY_SIGNAL));
    fputs(":\n", stderr);
    const char *log = read_text(files->log, "messages");
    fputs(log ? log : "", stderr);
    return false;
}

static bool write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    const bool is_put = file && fputs(text, file) >= 0;
    return file && fclose(file) == 0 && is_put;
}

static bool convert(const struct picture_format *format, const struct scratch *scratch, const char *svg,
                    FILE *out) {
    struct files files = {text_format("%s/svg", scratch->path), text_format("%s/made", scratch->path),
                          text_format("%s/log", scratch->path)};
    const bool is_written = write_text(files.svg, svg);
    const bool is_made = is_written && run(format, scratch, &files);
    const bool is_good = is_made && copy_file(files.made, out);
    if (!is_written || (is_made && !is_good))
        fprintf(stderr, "refdyn: %s: %s\n", is_made ? files.made : files.svg, strerror(errno));
    return is_good;
}

bool picture_write(const struct picture_format *format, const char *svg, FILE *out) {
    struct scratch scratch;
    if (!format->argv)
        return fputs(svg, out) >= 0;
    if (!scratch_open(&scratch, scratch_parent(), "refdyn-plot-"))
        return false;
    const bool is_good = convert(format, &scratch, svg, out);
    scratch_close(&scratch);
    return is_good;
}
