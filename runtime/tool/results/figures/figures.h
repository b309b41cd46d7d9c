/* Figures: SVG, PNG and PDF from finished motions and files of runs. Parts: style; charts; recorded motions;
 * file formats; charts of a file of runs. */
#ifndef REFDYN_TOOL_FIGURES_H
#define REFDYN_TOOL_FIGURES_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/* Style: colour distinguishes quantities and methods; the line distinguishes runs and stabilisations.
 * Neighbours differ in lightness, for the colour-blind and for grey print. */

/* How a curve is drawn. */
struct stroke {
    unsigned colour;  /* 0xRRGGBB */
    double width;     /* pixels */
    const char *dash; /* as in SVG: lengths of line and gap; "" for a solid line */
    const char *mark; /* a path of SVG about the point, or NULL */
};

/* Quantity number `index` of `count` in a panel, in run number `run` of `runs`. */
struct stroke figures_style_quantity(int index, int count, int run, int runs);
/* The sample of a run in the heading of a figure. */
struct stroke figures_style_run(int run, int runs);
/* A method by its number, 0 for the automatic choice; the same in every figure. line: number of the
 * stabilisation, 0 for the first. */
struct stroke figures_style_method(int method, int line);
/* The colour of a value on a map, from 0 for the lowest to 1 for the highest, and of a cell without a value.
 */
unsigned figures_style_value(double part);
unsigned figures_style_no_value(void);
/* A band around the first quantity: band number `index`, 0 for the widest. */
struct stroke figures_style_band(int index);
/* Lines that are no results: limits and floors. */
struct stroke figures_style_limit(void);

/* Charts as SVG, the same for the same input. A key to the right of the curves has a sample and a name for
 * each of them. */

/* A name with its sample. */
struct key {
    const char *name;
    struct stroke stroke;
};

/* Points x[i stride], y[i stride] for i < count. */
struct curve {
    const double *x, *y;
    long count, stride;
    struct stroke stroke;
    int key, run; /* numbers of the quantity and the run, from which the caller makes the stroke; not used for
                     drawing */
};

/* The area between two curves over x, drawn below all curves. */
struct band {
    const double *x, *low, *high;
    long count;
    unsigned colour;
};

/* A rectangle in one colour, drawn below all curves. */
struct cell {
    double left, right, low, high;
    unsigned colour;
};

struct chart {
    const char *title, *x_label, *y_label;
    bool is_x_logarithmic, is_y_logarithmic; /* a logarithmic axis shows absolute values */
    bool is_path;                            /* x is not time; its axis has margins */
    bool is_equal;                           /* x and y have the same scale */
    double floor;                            /* smaller values do not affect the range of a logarithmic y */
    struct key *keys;
    int key_count, key_room;
    struct curve *curves;
    int curve_count, curve_room;
    struct band *bands;
    int band_count, band_room;
    struct cell *cells; /* if there are any, they fill the chart */
    int cell_count, cell_room;
};

struct figure {
    struct key *heads; /* lines along the top; a stroke of width 0 has no sample */
    int head_count;
    const struct chart *charts;
    int count, columns;
    int width, height; /* of a chart [pixels] */
};

/* The index of the key with the first `length` letters of `name`, which is added if it is missing. An empty
 * name is not shown. */
int figures_chart_key(struct chart *chart, const char *name, size_t length);
void figures_chart_add_curve(struct chart *chart, struct curve curve);
void figures_chart_add_band(struct chart *chart, struct band band);
void figures_chart_add_cell(struct chart *chart, struct cell cell);

void figures_draw(FILE *out, const struct figure *figure);

/* Recorded motion: the columns of a file of `sim`, and as many of its rows as a figure can show. */

enum { RUN_ROWS_LEAST = 100 }; /* rows that are kept even of many columns */

struct run {
    const char *path;
    const char *name;              /* without folders */
    struct csv csv;                /* for a CSV file */
    struct motion_reader *motion;  /* for an HDF5 file; NULL for CSV */
    char **columns;                /* names of the columns */
    double *kept;                  /* (kept_count x column_count) rows at equal distances, and the last row */
    long kept_count, stride, room; /* every stride-th row is kept */
    double *largest;               /* (column_count) largest absolute values */
    bool *is_open;                 /* (column_count) whether a value is NaN, because it is not unique */
    int column_count;
    long rows;

    /* columns, counted from 0; -1 or 0 if there are none */
    int coordinates, coordinate_count; /* the first one, and how many there are */
    int *points;                       /* columns of x of each point; y z xd yd ... follow */
    int point_count;
    int energy;
    int forces, force_count;
    int inputs, input_count;
};

/* Returns whether the name of a file has an ending of HDF5. */
bool figures_run_is_hdf5(const char *path);
/* Returns false and reports the error as FILE:LINE if the file is no motion. */
bool figures_run_read(struct run *run, const char *path);

/* Pictures: SVG unchanged, PNG and PDF by rsvg-convert. */

/* The format by the ending of the name, NULL if it is unknown. */
const struct picture_format *figures_picture_format_of(const char *path);
/* Returns whether the format can be written; reports on stderr if its program is missing. */
bool figures_picture_can_write(const struct picture_format *format);
/* Returns false and prints the output of the program if it fails. */
bool figures_picture_write(const struct picture_format *format, const char *svg, FILE *out);

/* Runs: the charts of a file of runs, and how their numbers are read. */

enum { RUNS_CHARTS_MOST = 12 };

struct runs_charts {
    struct runs_reader *reader;
    const char *path;
    struct memory memory; /* of the numbers in the charts */
    struct chart charts[RUNS_CHARTS_MOST];
    int chart_count;
    struct key *heads; /* lines of text along the top */
    int head_count, head_room;
};

/* `lead` and "E_x [m]", in heap memory. */
char *figures_label(const char *lead, const char *name, const char *unit);
/* Returns whether a number can be drawn: it must be finite, and so small that sums of such numbers are
 * finite. */
bool figures_can_draw(double value);
/* Reads `count` numbers of an item from `place` on, for all cases: (cases x count), in the figure's memory.
 * Returns NULL and reports the error if it cannot. */
double *figures_read_item(struct runs_charts *figure, const struct kept_item *item, int place, int count);

/* Draws how results depend on what varied, how histories spread over time, and which cases are the worst.
 * `panels` is a list of names such as "history/E_x", or NULL. Returns false and reports the error if the file
 * cannot be read or lacks a name. */
bool figures_draw_runs(const char *path, const char *panels, FILE *out);

/* Draws the data, the model and the residuals of a FIT.json. Returns false and reports the error if the file
 * is none. */
bool figures_draw_fit(const char *path, FILE *out);

/* Whether a file of JSON has the motion of a plan. */
bool figures_is_plan(const char *path);
/* Draws the limits of a PLAN.json over its motion. Returns false and reports the error if it has none. */
bool figures_draw_plan(const char *path, FILE *out);

/* The parts of a figure of runs return false and report the error if the file cannot be read. */

/* Adds percentiles of a history over time. Cases without a number at a time do not count there. */
bool figures_bands_add(struct runs_charts *figure, const struct kept_item *item);
/* Adds lines at the top: how many cases failed and why, and which cases have the largest extremes. */
bool figures_worst_add(struct runs_charts *figure);

extern const struct command plot_command;

#endif
