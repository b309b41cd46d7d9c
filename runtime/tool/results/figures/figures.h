/* What this folder offers. */
#ifndef REFDYN_TOOL_FIGURES_H
#define REFDYN_TOOL_FIGURES_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/*
 * The one style of all figures: which colour, line and mark stands for what. A quantity and a method are told
 * by their colour, a run and a stabilisation by the line. Neighbours differ to the colour-blind and in grey
 * print, by lightness.
 */

/* How a curve is drawn. */
struct stroke {
    unsigned colour;  /* 0xRRGGBB */
    double width;     /* pixels */
    const char *dash; /* as in SVG: lengths of line and gap; "": none */
    const char *mark; /* a path of SVG about the point, NULL: none */
};

/* Quantity number `index` of `count` in a panel, in run number `run` of `runs`. */
struct stroke style_quantity(int index, int count, int run, int runs);
/* What stands for a run in the heading of a figure. */
struct stroke style_run(int run, int runs);
/* A method, by its number, 0 for the automatic choice; the same in every figure. line: 0, or that of another
 * stabilisation. */
struct stroke style_method(int method, int line);
/* A value on a map, 0 to 1 from the lowest to the highest; what has none. */
unsigned style_value(double part);
unsigned style_no_value(void);
/* Around the first quantity: band number `index`, 0 the widest, as a sample of it. */
struct stroke style_band(int index);
/* What is no result: limits, floors. */
struct stroke style_limit(void);

/*
 * Figures as SVG: charts of curves side by side. Takes numbers and texts, whatever is in them; gives the text
 * of one SVG file, which is the same for the same input.
 *
 * The key of a chart stands beside its curves: a sample and a name for each, of very many a scale of their
 * colours with as many names as there is room for.
 */

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

/*
 * A finished motion as `sim` wrote it: what its columns are, and so many of its rows as a figure can show.
 */

enum {
    RUN_ROWS_MOST = 4000 /* of those that are kept: more cannot be seen */,
    RUN_ROWS_LEAST = 100,
    RUN_NUMBERS_MOST = 1 << 22 /* in them, where there are many columns */
};

struct run {
    const char *path;
    const char *name;              /* without folders */
    struct csv csv;                /* of a CSV file */
    struct motion_reader *motion;  /* of a file of HDF5; NULL: it is CSV */
    char **columns;                /* names, of one of these */
    double *kept;                  /* (kept_count x column_count) rows at equal distances, and the last one */
    long kept_count, stride, room; /* every stride-th row is kept */
    double *largest;               /* absolute value in each column */
    int column_count;
    long rows;

    /* Columns, counted from 0; -1 or 0 where there are none. */
    int coordinates, coordinate_count; /* first one and how many */
    int *points;                       /* the x of each point; y z xd yd ... follow */
    int point_count;
    int energy;
    int forces, force_count;
    int inputs, input_count;
};

/* Whether a file's name says that it is one of HDF5. */
bool figures_run_is_hdf5(const char *path);
/* Complains on stderr with FILE:LINE and returns false when it is no such file. */
bool figures_run_read(struct run *run, const char *path);

/*
 * What the figure of some motions shows: a list of charts. What no run has makes none.
 */

enum { PANELS_MAX = 24 };

struct panels {
    struct run *runs; /* the curves lie in them */
    int run_count;
    json_t *units;              /* an object of units by column; NULL: known by the kind of column alone */
    bool is_wanted[PANELS_MAX]; /* by panels_choose */
    struct chart charts[PANELS_MAX];
    int count;
};

/* Panels by a list of their names, NULL: all. Gives the first name that is none, or NULL. */
const char *panels_choose(struct panels *panels, const char *names);
/* All names, "a, b, c". */
const char *panels_names(void);
/* The charts of those that were chosen, once the runs are there. */
void panels_make(struct panels *panels);

/*
 * A figure in the form that a file's name asks for: SVG as it is, PNG and PDF by rsvg-convert, which takes
 * the SVG alone, so that no text of a user reaches another language.
 */

struct picture_format;

/* By the suffix of the name; NULL: another one. */
const struct picture_format *picture_format_of(const char *path);
/* Whether it can be written; complains on stderr when a program for it is missing. */
bool picture_can_write(const struct picture_format *format);
/* Complains on stderr, with what the program said, when it fails. */
bool picture_write(const struct picture_format *format, const char *svg, FILE *out);

/*
 * The charts of a file of runs in the making, and how the numbers for them are read.
 */

enum { RUNS_CHARTS_MOST = 12 };

struct runs_charts {
    struct runs_reader *reader;
    const char *path;
    struct memory memory; /* of the numbers that the charts show */
    struct chart charts[RUNS_CHARTS_MOST];
    int chart_count;
    struct key *heads; /* along the top: texts */
    int head_count, head_room;
};

/* One more head, in heap memory, which belongs to the figure. */
void runs_charts_add_head(struct runs_charts *figure, char *text);
/* "E_x [m]", in heap memory; `lead` stands before. */
char *runs_charts_label(const char *lead, const char *name, const char *unit);
/* Whether a number can be drawn: one so large that sums of such numbers have no value is as good as none. */
bool runs_charts_can_draw(double value);
/* `count` numbers from `place` of an item on, of all cases: (cases x count), in the figure's memory. NULL,
 * with a complaint. */
double *runs_charts_read(struct runs_charts *figure, const struct kept_item *item, int place, int count);

/*
 * The figure of a file of runs: how results depend on what varied, how histories spread over time, and which
 * cases are the worst.
 */

/* Draws what `panels`, a list of names as "history/E_x", or NULL, names. Complains on stderr when the file
 * cannot be read or has none of a name. */
bool runs_figure_draw(const char *path, const char *panels, FILE *out);

/*
 * The parts of a figure of runs. All of them are false, with a complaint, when the file cannot be read.
 */

/* How a number of each case depends on what varied: over two quantities a map of the means of the cases
 * there, over one a curve. Of extremes the one at `place` of the axis. */
bool figures_response_add(struct runs_charts *figure, const struct kept_item *item, int place);
/* Percentiles of a history over time; cases that have no number there take no part. */
bool figures_bands_add(struct runs_charts *figure, const struct kept_item *item);
/* Heads: how many cases failed and why, and which have the largest extremes. */
bool figures_worst_add(struct runs_charts *figure);

/*
 * An axis of a chart: what it shows of the numbers, where its ticks stand, and what is written there.
 *
 * Numbers beside ticks are short: a power of ten, or a value that all of them have in common, stands once, as
 * a note at the end of the axis.
 */

struct scale {
    bool is_logarithmic;
    double low, high;   /* shown; of a logarithmic axis the decimal logarithms, as all that follows */
    double first, step; /* ticks */
    int count;
    double base;  /* the numbers are (value - base)/10^exponent */
    int exponent; /* a multiple of 3 */
    int decimals;
};

enum { SCALE_TEXT = 48 };

/* Linear, with at most `most` ticks. */
struct scale scale_linear(double low, double high, int most);
/* Whole decades that have `low` to `high`, which are positive. */
struct scale scale_logarithmic(double low, double high, int most);
/* The range with `part` of its width added at both ends; with ends where all values are the same. */
void scale_widen(double *low, double *high, double part);

/* Where the value lies between the ends, 0 to 1. */
double scale_place(const struct scale *scale, double value);
/* The same of a tick, counted from 0. */
double scale_tick(const struct scale *scale, int tick);
/* The number beside a tick, and the note, which may be empty. */
void scale_label(const struct scale *scale, int tick, char text[static SCALE_TEXT]);
void scale_note(const struct scale *scale, char text[static SCALE_TEXT]);

extern const struct command plot_command;

#endif
