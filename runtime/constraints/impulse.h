/* Jumps of rates by an impulse. */
#ifndef REFDYN_IMPULSE_H
#define REFDYN_IMPULSE_H

#include "refdyn.h"

/* With the rows and the factor of the metric in the workspace: work->basis := the rows of the programme up to
 * level `last`, without those of contacts, made orthonormal in the metric of the mass matrix. Dependent rows
 * drop out. Returns the number of vectors. */
int refdyn_spread_programme(struct refdyn_workspace *work, enum refdyn_row_level last);
/* Removes from x (n) its parts along the first `count` vectors of the basis. Returns the ratio of its length
 * after to its length before. */
double refdyn_leave_rest(const struct refdyn_workspace *work, int count, double *x);

/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse along `gradient` (n)
 * such that gradient . jump = change, while the rows of positions and velocities go on to hold. Errors:
 * NOT_FINITE, MASS_NOT_POSITIVE; EVENT_NOT_MET where the rows let nothing change along the gradient.
 */
int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump);
/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse of the rows, so that
 * u jump = change (m). Rows that depend on others get no impulse. Errors: NOT_FINITE, MASS_NOT_POSITIVE.
 */
int refdyn_impulse_of_rows(struct refdyn_workspace *work, const double *change, double *jump);

#endif
