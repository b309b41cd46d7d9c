/*
 * What the figure of some motions shows: a list of panels, each a list of curves. Columns that no run has
 * make no panel.
 */
#ifndef REFDYN_TOOL_PANELS_H
#define REFDYN_TOOL_PANELS_H

#include "run.h"

/* Column y over column x of a run. */
struct curve {
    int run, x, y;
    int colour;        /* of gnuplot.h; -1: the run's own */
    double width;      /* of the line */
    const char *title; /* in the key of the panel; NULL: not there */
};

enum { KEYS_MAX = 6 /* named curves in a panel: more drown it */ };

struct panel {
    const char *title, *x_label, *y_label;
    bool is_logarithmic; /* |y| on a logarithmic axis */
    bool is_square;      /* equal scales */
    struct curve *curves;
    int count, capacity;
    const char *names[KEYS_MAX]; /* in the key; a name has the same colour in every run */
    int name_count;
};

enum { PANELS_MAX = 24 };

struct panels {
    const struct run *runs;
    int run_count;
    struct panel list[PANELS_MAX];
    int count;
    char **texts; /* titles that were made */
    int text_count, text_room;
};

void panels_make(struct panels *panels, const struct run *runs, int run_count);
void panels_release(struct panels *panels);

#endif
