/* The drawing of error over run time: see diagram.h. */
#include "diagram.h"
#include "findings.h"
#include "gnuplot.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 900, HEIGHT = 620 };

static const double line_width = 1.6, band_width = 6;
static const char band_colour[] = "#c4c4c4";

/* No error is drawn below the floor. */
static double drawn_error(const struct study *study, const struct trial *trial) {
    return is_settled(study, trial) ? fmax(trial->error, study->floor) : 0;
}

static bool has_marks(const struct study *study, const struct series *series) {
    for (int i = 0; i < series->count; i++)
        if (drawn_error(study, &series->trials[i]) > 0)
            return true;
    return false;
}

/* A named block of `cpu_s,error` lines. */
static void put_block(FILE *script, const struct study *study, int i, int j) {
    const struct series *series = &study->series[j];
    fprintf(script, "$data_%d_%d << END\n", i, j);
    for (int k = 0; k < series->count; k++) {
        const double error = drawn_error(study, &series->trials[k]);
        if (error > 0)
            fprintf(script, "%.9g,%.9g\n", series->trials[k].cpu_s, error);
    }
    fputs("END\n", script);
}

static void put_style(struct gnuplot *gnuplot, const char *title, const struct study *study) {
    FILE *script = gnuplot->script;
    fputs("set logscale xy\nset format x '1e%T'\nset format y '1e%T'\nset key outside bottom center "
          "horizontal height 1\n"
          "set xlabel 'CPU time of the integration [s]'\nset lmargin 11\nset title ",
          script);
    gnuplot_text(gnuplot, title);
    fprintf(script, "\nset ylabel '%s'\n",
            study->stride == 3 ? "largest position error of the points [m]"
                               : "largest error of a coordinate [m, rad]");
}

/* Colours tell methods, dashes studies, marks stabilisations; the automatic choice is a band, on which the
 * method lies that it took. */
static void put_curve(struct gnuplot *gnuplot, const struct study *study, int i, int j, bool is_one_of_many) {
    FILE *script = gnuplot->script;
    const struct series *series = &study->series[j];
    char *name = series_name(study, series);
    const bool is_auto = series->method == REFDYN_AUTO;
    const char *colour = is_auto ? band_colour : plot_colours[((int)series->method - 1) % COLOUR_COUNT];
    char *title = text_format("%s%s%s", is_one_of_many ? study->name : "", is_one_of_many ? ", " : "", name);
    fprintf(script,
            "$data_%d_%d using 1:2 with linespoints linewidth %g linecolor '%s' dashtype %s pointtype %d "
            "pointsize 0.7 title ",
            i, j, is_auto ? band_width : line_width, colour, plot_dashes[i % DASH_COUNT],
            3 + 2 * (int)series->stabilise);
    gnuplot_text(gnuplot, title);
    fputs(", ", script);
    free(title);
    free(name);
}

bool diagram_draw(FILE *out, const char *title, const struct study *studies, int count) {
    struct gnuplot gnuplot;
    if (!gnuplot_open(&gnuplot, WIDTH, HEIGHT))
        return false;
    FILE *script = gnuplot.script;
    put_style(&gnuplot, title, studies);
    for (int i = 0; i < count; i++)
        for (int j = 0; j < studies[i].series_count; j++)
            put_block(script, &studies[i], i, j);
    fputs("plot ", script);
    for (int i = 0; i < count; i++)
        for (int j = 0; j < studies[i].series_count; j++)
            if (has_marks(&studies[i], &studies[i].series[j]))
                put_curve(&gnuplot, &studies[i], i, j, count > 1);
    if (count == 1 && studies->floor > 0)
        fprintf(script, "%.9g with lines linewidth 1 linecolor '#888888' dashtype (2,3) title 'floor', ",
                studies->floor);
    fputs("NaN notitle\n", script);
    return gnuplot_draw(&gnuplot, out);
}
