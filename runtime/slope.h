/* Slopes of a motion: rates, accelerations and power at a state. */
#ifndef REFDYN_SLOPE_H
#define REFDYN_SLOPE_H

#include "refdyn.h"

/* qd, qdd and power at (t, state) into slope; state and slope (2 n + 1). Errors: those of refdyn_accelerate.
 */
int refdyn_slope(struct refdyn_drive *drive, double t, const double *state, double *slope);

#endif
