/* `refdyn plot`: the figures of some motions over each other, as one SVG drawn by gnuplot. */
#include "commands.h"
#include "gnuplot.h"
#include "output.h"
#include "panels.h"

#include <stdlib.h>
#include <string.h>

/* Pixels. */
enum { WIDTH = 1100, PANEL_HEIGHT = 300, TOP = 46, LEFT = 84, RIGHT = 18, ABOVE = 34, BELOW = 50 };
enum { COLUMNS = 2, POINTS_MAX = 2000 /* of a curve: more cannot be seen */ };

static double part(int pixels, int whole) {
    return (double)pixels / whole;
}

/* The names of the runs, each with its own line, along the top. */
static void put_legend(FILE *script, const struct run *runs, int count, int height) {
    fprintf(script,
            "set lmargin at screen 0.02\nset rmargin at screen 0.98\nset bmargin at screen %.6f\nset tmargin "
            "at screen %.6f\n"
            "unset border\nunset tics\nunset grid\nset key center center horizontal samplen 6 width 2\n"
            "plot [0:1][0:1]",
            1 - part(TOP, height), 1 - part(4, height));
    for (int i = 0; i < count; i++) {
        fprintf(script, "%s NaN with lines linewidth 2 linecolor '%s' dashtype %s title ", i ? "," : "",
                plot_colours[i % COLOUR_COUNT], plot_dashes[i % DASH_COUNT]);
        gnuplot_quote(script, runs[i].name);
    }
    fputs("\nset border 3\nset tics\nset grid\nset key inside top right vertical noopaque samplen 2.5 "
          "spacing 1.05\n",
          script);
}

static void put_curve(FILE *script, const struct panel *panel, const struct curve *curve,
                      const struct run *run) {
    long every = run->rows / POINTS_MAX + 1;
    int colour = curve->colour < 0 ? curve->run : curve->colour;
    gnuplot_quote_file(script, run->path);
    fprintf(script, " skip 1 every %ld using %d:", every, curve->x + 1);
    if (panel->is_logarithmic)
        fprintf(script, "($%d != 0 ? abs($%d) : NaN)", curve->y + 1, curve->y + 1);
    else
        fprintf(script, "%d", curve->y + 1);
    fprintf(script, " with lines linewidth %.2f linecolor '%s' dashtype %s", curve->width,
            plot_colours[colour % COLOUR_COUNT], plot_dashes[curve->run % DASH_COUNT]);
    if (curve->title) {
        fputs(" title ", script);
        gnuplot_quote(script, curve->title);
    } else
        fputs(" notitle", script);
}

static void put_place(FILE *script, int place, int height) {
    int column = place % COLUMNS, row = place / COLUMNS, width = WIDTH / COLUMNS;
    double left = part(column * width + LEFT, WIDTH), right = part((column + 1) * width - RIGHT, WIDTH);
    double top = 1 - part(TOP + row * PANEL_HEIGHT + ABOVE, height);
    double bottom = 1 - part(TOP + (row + 1) * PANEL_HEIGHT - BELOW, height);
    fprintf(script,
            "set lmargin at screen %.6f\nset rmargin at screen %.6f\nset bmargin at screen %.6f\n"
            "set tmargin at screen %.6f\n",
            left, right, bottom, top);
}

static void put_panel(FILE *script, const struct panels *panels, int place, int height) {
    const struct panel *panel = &panels->list[place];
    put_place(script, place, height);
    fprintf(
        script,
        "set title '%s' offset 0,-0.4 textcolor '#222222'\nset xlabel '%s' offset 0,0.3\nset ylabel '%s'\n",
        panel->title, panel->x_label, panel->y_label);
    fputs(panel->is_logarithmic ? "set logscale y\nset format y '1e%T'\n"
                                : "unset logscale y\nset format y '%g'\n",
          script);
    fputs(panel->is_square ? "set size ratio -1\n" : "set size noratio\n", script);
    fputs("plot ", script);
    for (int i = 0; i < panel->count; i++) {
        if (i)
            fputs(", \\\n  ", script);
        put_curve(script, panel, &panel->curves[i], &panels->runs[panel->curves[i].run]);
    }
    fputc('\n', script);
}

static bool draw(const struct panels *panels, const char *path) {
    struct gnuplot gnuplot;
    int height = TOP + (panels->count + COLUMNS - 1) / COLUMNS * PANEL_HEIGHT;
    if (!gnuplot_open(&gnuplot, WIDTH, height))
        return false;
    fputs("set multiplot\n", gnuplot.script);
    put_legend(gnuplot.script, panels->runs, panels->run_count, height);
    for (int i = 0; i < panels->count; i++)
        put_panel(gnuplot.script, panels, i, height);
    fputs("unset multiplot\n", gnuplot.script);
    return gnuplot_draw(&gnuplot, path);
}

enum status run_plot(const struct options *options) {
    int count = options->operand_count;
    struct run *runs = allocate((size_t)count, sizeof *runs);
    enum status status = STATUS_DONE;
    for (int i = 0; i < count && status == STATUS_DONE; i++)
        if (!run_read(&runs[i], options->operands[i]))
            status = STATUS_FAULT;
    if (status == STATUS_DONE) {
        struct panels panels;
        panels_make(&panels, runs, count);
        if (!draw(&panels, options->output))
            status = STATUS_FAULT;
        panels_release(&panels);
    }
    for (int i = 0; i < count; i++)
        run_release(&runs[i]);
    free(runs);
    return status;
}
