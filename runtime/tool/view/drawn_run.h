/*
 * The numbers of a run as the page draws them, as JSON: so many rows as one can see, in few digits.
 *
 *     "t": {"unit": 1e-5, "steps": [0, 5000, ...]}        value = unit times the sum of the steps so far
 *     "q": [{"unit": , "steps": }, ...]                   by frame; turns to 1e-5 rad or less, slides to five
 *                                                         digits of the largest
 *     "courses": [{"name": , "kind": , "unit": , "steps": }, ...]
 *                                                         residuals, energy, programme forces that are not 0,
 *                                                         inputs and courses, to four digits of the largest
 */
#ifndef REFDYN_TOOL_DRAWN_RUN_H
#define REFDYN_TOOL_DRAWN_RUN_H

#include "figures/recorded_motion.h"
#include "gen.h"

/* Rows at equal distances, and the last one. */
struct drawn_rows {
    double *values; /* (count x width), all columns of the run */
    long count, width;
};

/* `share`: how many runs are on the page. */
struct drawn_rows drawn_run_rows(const struct run *run, int share);
/* These members, without brackets around them, of a run that has the coordinates of that tree. */
void drawn_run_put(FILE *out, const struct run *run, const struct tree *tree, const struct drawn_rows *rows);

#endif
