/* Jumps of rates by an impulse. */
#ifndef REFDYN_IMPULSE_H
#define REFDYN_IMPULSE_H

#include "refdyn.h"

/* With the rows and the factor of the metric in the workspace: the rows of the programme up to level `last`,
 * those of contacts left out, in the metric of the mass matrix, orthonormal, into work->basis; returns their
 * number. Dependent rows drop out. */
int refdyn_spread_programme(struct refdyn_workspace *work, enum refdyn_row_level last);
/* Takes the parts of x (n) along the first `count` vectors of the basis out of it. Returns the length that is
 * left, as a part of that before. */
double refdyn_leave_rest(const struct refdyn_workspace *work, int count, double *x);

/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse along `gradient` (n)
 * such that gradient . jump = change, while the rows of positions and velocities go on to hold. Errors:
 * NOT_FINITE, MASS_NOT_POSITIVE; EVENT_NOT_MET where the rows let nothing change along the gradient.
 */
int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump);

#endif
