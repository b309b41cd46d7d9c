/* One drawing by gnuplot: see gnuplot.h. */
#include "gnuplot.h"
#include "output.h"
#include "process.h"
#include "svg.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const plot_colours[COLOUR_COUNT] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                "#e69f00", "#56b4e9", "#444444", "#8c6d31"};
const char *const plot_dashes[DASH_COUNT] = {"1", "(9,4)", "(2,3)", "(9,3,2,3)", "(16,4)"};

static char *temporary_folder(void) {
    const char *parent = getenv("TMPDIR");
    char *folder = text_format("%s/refdyn-plot-XXXXXX", parent && *parent ? parent : "/tmp");
    if (mkdtemp(folder))
        return folder;
    fprintf(stderr, "refdyn: %s: cannot make a folder: %s\n", folder, strerror(errno));
    free(folder);
    return NULL;
}

static void release(struct gnuplot *gnuplot) {
    unlink(gnuplot->script_path);
    unlink(gnuplot->svg_path);
    unlink(gnuplot->log_path);
    rmdir(gnuplot->folder);
    free(gnuplot->log_path);
    free(gnuplot->svg_path);
    free(gnuplot->script_path);
    free(gnuplot->folder);
}

bool gnuplot_open(struct gnuplot *gnuplot, int width, int height) {
    gnuplot->folder = temporary_folder();
    if (!gnuplot->folder)
        return false;
    gnuplot->script_path = text_format("%s/script", gnuplot->folder);
    gnuplot->svg_path = text_format("%s/svg", gnuplot->folder);
    gnuplot->log_path = text_format("%s/log", gnuplot->folder);
    gnuplot->script = fopen(gnuplot->script_path, "w");
    if (!gnuplot->script) {
        fprintf(stderr, "refdyn: %s: cannot be written: %s\n", gnuplot->script_path, strerror(errno));
        release(gnuplot);
        return false;
    }
    fprintf(
        gnuplot->script,
        "set encoding utf8\n"
        "set terminal svg noenhanced size %d,%d dynamic rounded font 'Helvetica,13' background '#ffffff'\n"
        "set border 3 linecolor '#555555'\nset xtics nomirror\nset ytics nomirror\n"
        "set grid linecolor '#dddddd' linetype 1 linewidth 0.6\nset datafile separator ','\n",
        width, height);
    return true;
}

static void show_log(const char *path) {
    FILE *file = fopen(path, "r");
    for (int c; file && (c = getc(file)) != EOF;)
        fputc(c, stderr);
    if (file)
        fclose(file);
}

/* Gnuplot's file, smaller, under the final name. */
static bool publish(const char *from, const char *path) {
    struct output output;
    char *text = file_text(from);
    bool is_open = text && output_open(&output, path);
    if (is_open)
        svg_shrink(text, output.file);
    free(text);
    return is_open && output_close(&output);
}

static bool draw(struct gnuplot *gnuplot, const char *path) {
    const char *argv[] = {"gnuplot", NULL};
    struct process process;
    int error = process_start(&process, argv, gnuplot->script_path, gnuplot->svg_path, gnuplot->log_path);
    if (error) {
        fprintf(stderr,
                "refdyn: gnuplot draws the figures and could not be started: %s (Debian: apt install "
                "gnuplot-nox)\n",
                strerror(error));
        return false;
    }
    struct stat status;
    process_wait(&process, 1);
    if (process.result == 0 && stat(gnuplot->svg_path, &status) == 0 && status.st_size > 0)
        return publish(gnuplot->svg_path, path);
    fprintf(stderr, "refdyn: gnuplot failed:\n");
    show_log(gnuplot->log_path);
    return false;
}

bool gnuplot_draw(struct gnuplot *gnuplot, const char *path) {
    bool is_written = !ferror(gnuplot->script);
    is_written = fclose(gnuplot->script) == 0 && is_written;
    if (!is_written)
        fprintf(stderr, "refdyn: %s: not all could be written\n", gnuplot->script_path);
    bool is_drawn = is_written && draw(gnuplot, path);
    release(gnuplot);
    return is_drawn;
}

static void put_quoted(FILE *script, const char *text) {
    for (; *text; text++) {
        if (*text == '\'')
            fputc('\'', script); /* doubled */
        fputc(*text == '\n' ? ' ' : *text, script);
    }
}

void gnuplot_quote(FILE *script, const char *text) {
    fputc('\'', script);
    put_quoted(script, text);
    fputc('\'', script);
}

void gnuplot_quote_file(FILE *script, const char *path) {
    fputs(*path == '/' ? "'" : "'./", script);
    put_quoted(script, path);
    fputc('\'', script);
}
