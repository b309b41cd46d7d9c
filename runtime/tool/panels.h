/*
 * What the figure of some motions shows: a list of charts. What no run has makes none.
 */
#ifndef REFDYN_TOOL_PANELS_H
#define REFDYN_TOOL_PANELS_H

#include "chart.h"
#include "run.h"

#include <jansson.h>

enum { PANELS_MAX = 24 };

struct panels {
    const struct run *runs; /* the curves lie in them */
    int run_count;
    const json_t *units; /* an object of units by column; NULL: they are known by the kind of column alone */
    struct chart charts[PANELS_MAX];
    int count;
};

/* The panels whose names are in the list "a,b", of which all are known; NULL: all. runs and units are set. */
void panels_make(struct panels *panels, const char *names);
void panels_release(struct panels *panels);
/* The first item of the list that is no panel's name, in heap memory; NULL: there is none. */
char *panels_unknown(const char *names);
/* All names, "a, b, c", in heap memory. */
char *panels_names(void);

#endif
