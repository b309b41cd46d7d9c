/*
 * Figures as SVG: charts of curves side by side. Takes numbers and texts, whatever is in them; gives the text
 * of one SVG file, which is the same for the same input.
 *
 * The key of a chart stands beside its curves: a sample and a name for each, of very many a scale of their
 * colours with as many names as there is room for.
 */
#ifndef REFDYN_TOOL_CHART_H
#define REFDYN_TOOL_CHART_H

#include "figures/style.h"

#include <stdbool.h>
#include <stdio.h>

/* A name and what stands for it. */
struct key {
    const char *name;
    struct stroke stroke;
};

/* Points x[i stride], y[i stride] for i < count. */
struct curve {
    const double *x, *y;
    long count, stride;
    struct stroke stroke;
    int key, run; /* of a quantity and a run, for those who make the stroke of them; not needed to draw */
};

/* Between two courses over x, below all curves. */
struct band {
    const double *x, *low, *high;
    long count;
    unsigned colour;
};

/* A rectangle in one colour, below all curves. */
struct cell {
    double left, right, low, high;
    unsigned colour;
};

struct chart {
    const char *title, *x_label, *y_label;
    bool is_x_logarithmic, is_y_logarithmic; /* of the absolute value */
    bool is_path;                            /* x is no time: it leaves room at its ends */
    bool is_equal;                           /* one scale for x and y */
    double floor;                            /* of a logarithmic y: what is less takes no part in the range */
    struct key *keys;
    int key_count, key_room;
    struct curve *curves;
    int curve_count, curve_room;
    struct band *bands;
    int band_count, band_room;
    struct cell *cells; /* a chart that has any is as large as these */
    int cell_count, cell_room;
};

struct figure {
    struct key *heads; /* along the top; a stroke of width 0 shows nothing */
    int head_count;
    const struct chart *charts;
    int count, columns;
    int width, height; /* of a chart [pixels] */
};

/* The place of the key whose name is the first letters of `name`, a copy; it is made when there is none. An
 * empty name is not shown. */
int chart_key(struct chart *chart, const char *name, size_t length);
void chart_add_curve(struct chart *chart, struct curve curve);
void chart_add_band(struct chart *chart, struct band band);
void chart_add_cell(struct chart *chart, struct cell cell);

void chart_draw_figure(FILE *out, const struct figure *figure);

#endif
