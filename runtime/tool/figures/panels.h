/*
 * What the figure of some motions shows: a list of charts. What no run has makes none.
 */
#ifndef REFDYN_TOOL_PANELS_H
#define REFDYN_TOOL_PANELS_H

#include "figures/chart.h"
#include "figures/recorded_motion.h"

#include <jansson.h>

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

#endif
