/* `refdyn plot`: the figures of some motions over each other, as one SVG drawn by gnuplot. */
#include "commands.h"
#include "gnuplot.h"
#include "output.h"
#include "panels.h"
#include "target.h"

#include <math.h>
#include <stdlib.h>

/* Pixels. */
enum { PANEL_WIDTH = 486, PANEL_HEIGHT = 310, TOP = 40, LEFT = 94, RIGHT = 16, ABOVE = 62, BELOW = 52 };
enum { BOX_WIDTH = PANEL_WIDTH - LEFT - RIGHT, BOX_HEIGHT = PANEL_HEIGHT - ABOVE - BELOW };
enum { COLUMNS_MAX = 3, CROWD = 8 /* curves */ };

static const double crowded_width = 1.0; /* of lines in a panel of many curves */

/* The picture as a whole. */
struct page {
    int columns, rows, width, height;
};

static struct page make_page(int panels) {
    int columns = panels > 2 * COLUMNS_MAX ? COLUMNS_MAX : panels > 1 ? 2 : 1;
    int rows = (panels + columns - 1) / columns;
    return (struct page){columns, rows, columns * PANEL_WIDTH, TOP + rows * PANEL_HEIGHT};
}

static double part(int pixels, int whole) {
    return (double)pixels / whole;
}

/* The names of the runs, each with its own line, along the top. */
static void put_legend(struct gnuplot *gnuplot, const struct run *runs, int count, int height) {
    FILE *script = gnuplot->script;
    fprintf(script,
            "set lmargin at screen 0.02\nset rmargin at screen 0.98\nset bmargin at screen %.6f\nset tmargin "
            "at screen %.6f\n"
            "unset border\nunset tics\nunset grid\nset key center center horizontal samplen 6 width 2\n"
            "plot [0:1][0:1]",
            1 - part(TOP, height), 1 - part(4, height));
    for (int i = 0; i < count; i++) {
        fprintf(script, "%s NaN with lines linewidth 2 linecolor '%s' dashtype %s title ", i ? "," : "",
                plot_colours[i % COLOUR_COUNT], plot_dashes[i % DASH_COUNT]);
        gnuplot_text(gnuplot, runs[i].name);
    }
    fputs("\nset border 3\nset xtics nomirror\nset ytics nomirror\nset grid\n", script);
}

static bool has_one_run(const struct panel *panel) {
    for (int i = 1; i < panel->count; i++)
        if (panel->curves[i].run != panel->curves[0].run)
            return false;
    return true;
}

/* A named block of `x,y` lines for each curve of panel number `place`. */
static void put_data(FILE *script, const struct panels *panels, int place) {
    const struct panel *panel = &panels->list[place];
    for (int i = 0; i < panel->count; i++) {
        const struct curve *curve = &panel->curves[i];
        const struct run *run = &panels->runs[curve->run];
        fprintf(script, "$data_%d_%d << END\n", place, i);
        for (long k = 0; k < run->kept_count; k++) {
            const double *row = run->kept + k * run->column_count;
            print_number(script, row[curve->x]);
            fputc(',', script);
            print_number(script, row[curve->y]);
            fputc('\n', script);
        }
        fputs("END\n", script);
    }
}

/* Lines tell the runs apart by their dashes, where there is more than one. */
static void put_curve(struct gnuplot *gnuplot, const struct panels *panels, int place, int i) {
    FILE *script = gnuplot->script;
    const struct panel *panel = &panels->list[place];
    const struct curve *curve = &panel->curves[i];
    int colour = curve->colour < 0 ? curve->run : curve->colour;
    bool is_solid = curve->colour >= 0 && has_one_run(panel);
    double width = panel->count > CROWD && curve->width > crowded_width ? crowded_width : curve->width;
    fprintf(script, "$data_%d_%d using 1:%s with lines linewidth %.2f linecolor '%s' dashtype %s", place, i,
            panel->is_logarithmic ? "($2 != 0 ? abs($2) : NaN)" : "2", width,
            plot_colours[colour % COLOUR_COUNT],
            is_solid ? plot_dashes[0] : plot_dashes[curve->run % DASH_COUNT]);
    if (curve->title) {
        fputs(" title ", script);
        gnuplot_text(gnuplot, curve->title);
    } else
        fputs(" notitle", script);
}

/* The box of the axes; the title stands at its upper left, the key between them. */
static void put_place(FILE *script, const struct page *page, int place) {
    int left = place % page->columns * PANEL_WIDTH + LEFT,
        top = TOP + place / page->columns * PANEL_HEIGHT + ABOVE;
    fprintf(script,
            "set lmargin at screen %.6f\nset rmargin at screen %.6f\nset bmargin at screen %.6f\n"
            "set tmargin at screen %.6f\n",
            part(left, page->width), part(left + BOX_WIDTH, page->width),
            1 - part(top + BOX_HEIGHT, page->height), 1 - part(top, page->height));
    fprintf(script,
            "set key at screen %.6f,%.6f left bottom horizontal Left reverse samplen 1.4 width -1 font ',11' "
            "maxcols 4\n",
            part(left, page->width), 1 - part(top - 4, page->height));
    fprintf(script, "set label 1 at screen %.6f,%.6f left textcolor '#000000' ", part(left, page->width),
            1 - part(top - 50, page->height));
}

static void put_title(struct gnuplot *gnuplot, const struct panels *panels, const struct panel *panel) {
    bool is_of_one = panels->run_count > 1 && has_one_run(panel);
    const char *run = panels->runs[panel->curves[0].run].name;
    char *title = is_of_one ? text_format("%s (%s)", panel->title, run) : text_format("%s", panel->title);
    gnuplot_text(gnuplot, title);
    free(title);
    fputs("\nset xlabel ", gnuplot->script);
    gnuplot_text(gnuplot, panel->x_label);
    fputs(" offset 0,0.3\nset ylabel ", gnuplot->script);
    gnuplot_text(gnuplot, panel->y_label);
    fputc('\n', gnuplot->script);
}

struct range {
    double low, high;
};

/* Of columns x (or y) of all curves. */
static struct range range_of(const struct panels *panels, const struct panel *panel, bool is_x) {
    struct range range = {INFINITY, -INFINITY};
    for (int i = 0; i < panel->count; i++) {
        const struct run *run = &panels->runs[panel->curves[i].run];
        int column = is_x ? panel->curves[i].x : panel->curves[i].y;
        range.low = fmin(range.low, run->lowest[column]);
        range.high = fmax(range.high, run->highest[column]);
    }
    return range;
}

/* A change below this part of the value is rounding. */
static const double noise = 1e-9;

static double size_of(struct range range) {
    return fmax(fabs(range.low), fabs(range.high));
}

/* What does not change gets an axis, too: a twentieth of the value, or 1, to both sides. */
static void put_narrow(FILE *script, const char *axis, struct range range) {
    const double sides = 0.05;
    double size = size_of(range), more = size > 0 ? sides * size : 1;
    if (range.high - range.low <= noise * size)
        fprintf(script, "set %srange [%.9g:%.9g]\n", axis, range.low - more, range.high + more);
}

/* Equal scales: the narrower direction shows more than it needs. */
static void put_equal_scales(FILE *script, const struct panels *panels, const struct panel *panel) {
    const double room = 1.08; /* a little more than the curves */
    struct range x = range_of(panels, panel, true), y = range_of(panels, panel, false);
    double span = fmax(x.high - x.low, y.high - y.low);
    double pixel = room * fmax((x.high - x.low) / BOX_WIDTH, (y.high - y.low) / BOX_HEIGHT);
    if (span <= noise * fmax(size_of(x), size_of(y)))
        return;
    double x_middle = 0.5 * (x.low + x.high), y_middle = 0.5 * (y.low + y.high);
    fprintf(script, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", x_middle - 0.5 * pixel * BOX_WIDTH,
            x_middle + 0.5 * pixel * BOX_WIDTH, y_middle - 0.5 * pixel * BOX_HEIGHT,
            y_middle + 0.5 * pixel * BOX_HEIGHT);
}

static void put_ranges(FILE *script, const struct panels *panels, const struct panel *panel) {
    fputs("set autoscale\n", script);
    put_narrow(script, "x", range_of(panels, panel, true));
    if (!panel->is_logarithmic)
        put_narrow(script, "y", range_of(panels, panel, false));
    if (panel->is_square)
        put_equal_scales(script, panels, panel);
}

static void put_panel(struct gnuplot *gnuplot, const struct panels *panels, int place,
                      const struct page *page) {
    FILE *script = gnuplot->script;
    const struct panel *panel = &panels->list[place];
    put_place(script, page, place);
    put_title(gnuplot, panels, panel);
    fputs(panel->is_logarithmic ? "set logscale y\nset format y '1e%T'\nset mytics 1\n"
                                : "unset logscale y\nset format y '%g'\n",
          script);
    put_ranges(script, panels, panel);
    fputs("plot ", script);
    for (int i = 0; i < panel->count; i++) {
        if (i)
            fputs(", \\\n  ", script);
        put_curve(gnuplot, panels, place, i);
    }
    fputc('\n', script);
}

static bool draw(const struct panels *panels, FILE *out) {
    struct gnuplot gnuplot;
    struct page page = make_page(panels->count);
    if (!gnuplot_open(&gnuplot, page.width, page.height))
        return false;
    for (int i = 0; i < panels->count; i++)
        put_data(gnuplot.script, panels, i);
    fputs("set multiplot\n", gnuplot.script);
    put_legend(&gnuplot, panels->runs, panels->run_count, page.height);
    for (int i = 0; i < panels->count; i++)
        put_panel(&gnuplot, panels, i, &page);
    fputs("unset multiplot\n", gnuplot.script);
    return gnuplot_draw(&gnuplot, out);
}

static enum status plot(const struct run *runs, int count, struct target *target) {
    struct panels panels;
    panels_make(&panels, runs, count);
    bool is_good = panels.count > 0;
    if (!is_good)
        complain_line(runs[0].path, 1, "run: no column that plot draws, a CSV file of refdyn sim is needed");
    is_good = is_good && draw(&panels, target->file) && target_finish(target);
    panels_release(&panels);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

enum status run_plot(const struct options *options) {
    const int count = options->operand_count;
    struct run *runs = allocate((size_t)count, sizeof *runs);
    struct targets targets = {.first = NULL};
    for (int i = 0; i < count; i++)
        targets_spare(&targets, options->operands[i]);
    struct target *target = gnuplot_is_there() ? target_open(&targets, options->output) : NULL;
    bool is_good = target != NULL;
    for (int i = 0; i < count && is_good; i++)
        is_good = run_read(&runs[i], options->operands[i]);
    const enum status status = is_good ? plot(runs, count, target) : STATUS_FAULT;
    targets_release(&targets);
    for (int i = 0; i < count; i++)
        run_release(&runs[i]);
    free(runs);
    return status;
}
