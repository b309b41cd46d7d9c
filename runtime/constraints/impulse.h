/* Jumps of rates by an impulse. */
#ifndef REFDYN_IMPULSE_H
#define REFDYN_IMPULSE_H

#include "refdyn.h"

/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse along `gradient` (n)
 * such that gradient . jump = change, while the rows of positions and velocities go on to hold. Errors:
 * NOT_FINITE, MASS_NOT_POSITIVE; EVENT_NOT_MET where the rows let nothing change along the gradient.
 */
int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump);
/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse of the rows, so that
 * u jump = change (m). Rows that depend on others take part in no impulse. Errors: NOT_FINITE,
 * MASS_NOT_POSITIVE.
 */
int refdyn_impulse_of_rows(struct refdyn_workspace *work, const double *change, double *jump);

#endif
