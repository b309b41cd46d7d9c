/* The nearest state on the programme from far away: see nearest_state.c. */
#ifndef REFDYN_NEAREST_STATE_H
#define REFDYN_NEAREST_STATE_H

#include "refdyn.h"

/* Is a correction (n) of positions so long that the rows are not nearly linear along it? */
int refdyn_is_far(const struct refdyn_workspace *work, const double *change);
/*
 * With the row terms of (q, qd) in the workspace and its metric factored: q := a state near the programme, at
 * the least distance that was found. Returns whether one was found; if not, q stays, and u and phi are those
 * of q. The factored metric remains that of the given q.
 */
int refdyn_nearest_state(struct refdyn_workspace *work, double t, double *q, const double *qd);

#endif
