/* One drawing by gnuplot: see gnuplot.h. */
#define _POSIX_C_SOURCE 200809L /* strsignal */
#include "gnuplot.h"
#include "csv.h"
#include "output.h"
#include "process.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { BY_SIGNAL = 128 /* and its number, as the result of a process: see process.h */ };

const char *const plot_colours[COLOUR_COUNT] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                "#e69f00", "#56b4e9", "#444444", "#8c6d31"};
const char *const plot_dashes[DASH_COUNT] = {"1", "(9,4)", "(2,3)", "(9,3,2,3)", "(16,4)"};

bool gnuplot_is_there(void) {
    char *file = process_find("gnuplot");
    if (!file)
        fputs("refdyn: gnuplot draws the figures and is not installed (Debian: apt install gnuplot-nox)\n",
              stderr);
    free(file);
    return file != NULL;
}

static void release(struct gnuplot *gnuplot) {
    svg_texts_release(&gnuplot->texts);
    scratch_close(&gnuplot->scratch);
    free(gnuplot->log_path);
    free(gnuplot->svg_path);
    free(gnuplot->script_path);
}

bool gnuplot_open(struct gnuplot *gnuplot, int width, int height) {
    *gnuplot = (struct gnuplot){.script = NULL};
    if (!scratch_open(&gnuplot->scratch, scratch_parent(), "refdyn-plot-"))
        return false;
    gnuplot->script_path = text_format("%s/script", gnuplot->scratch.path);
    gnuplot->svg_path = text_format("%s/svg", gnuplot->scratch.path);
    gnuplot->log_path = text_format("%s/log", gnuplot->scratch.path);
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

/* gnuplot does not look whether its drawing could be written. */
static bool is_whole(const char *text) {
    static const char end[] = "</svg>";
    const char *last = strrchr(text, '<');
    return last && strncmp(last, end, sizeof end - 1) == 0;
}

static char *read_drawing(const char *path) {
    char *text = read_text(path, "gnuplot's drawing");
    if (!text || is_whole(text))
        return text;
    fprintf(stderr, "refdyn: gnuplot failed: %s: the drawing has no end, the disk may be full\n", path);
    free(text);
    return NULL;
}

/* -d: no files of settings, in which a user may have another terminal. */
static bool draw(struct gnuplot *gnuplot) {
    const char *argv[] = {"gnuplot", "-d", NULL};
    struct process process;
    const int error = process_start(&process, &gnuplot->scratch, argv, gnuplot->script_path,
                                    gnuplot->svg_path, gnuplot->log_path);
    if (error) {
        fprintf(stderr, "refdyn: gnuplot could not be started: %s\n", strerror(error));
        return false;
    }
    if (process_wait(&process, 1) == 0 && process.result == 0)
        return true;
    if (interrupt_is_new())
        return false;
    if (process.result > BY_SIGNAL)
        fprintf(stderr, "refdyn: gnuplot failed, by signal %d (%s):\n", process.result - BY_SIGNAL,
                strsignal(process.result - BY_SIGNAL));
    else
        fprintf(stderr, "refdyn: gnuplot failed:\n");
    show_log(gnuplot->log_path);
    return false;
}

bool gnuplot_draw(struct gnuplot *gnuplot, FILE *out) {
    bool is_written = !ferror(gnuplot->script);
    is_written = fclose(gnuplot->script) == 0 && is_written;
    if (!is_written)
        fprintf(stderr, "refdyn: %s: not all could be written\n", gnuplot->script_path);
    char *text = is_written && draw(gnuplot) ? read_drawing(gnuplot->svg_path) : NULL;
    if (text)
        svg_finish(text, &gnuplot->texts, out);
    free(text);
    release(gnuplot);
    return text != NULL;
}

void gnuplot_text(struct gnuplot *gnuplot, const char *text) {
    fputc('\'', gnuplot->script);
    svg_put_placeholders(gnuplot->script, &gnuplot->texts, text);
    fputc('\'', gnuplot->script);
}
