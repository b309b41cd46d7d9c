/* Slopes of a motion: rates, accelerations, power and multipliers at a state. */
#ifndef REFDYN_SLOPE_H
#define REFDYN_SLOPE_H

#include "../refdyn.h"

/* Entries of a slope. What leads, (2 n + 1), changes a state; lambda behind it is what tangents are taken at.
 */
static inline int refdyn_slope_size(const struct refdyn_model *model) {
    return 2 * model->n + 1 + model->m;
}

static inline size_t refdyn_slope_bytes(const struct refdyn_drive *drive) {
    return (size_t)refdyn_slope_size(drive->work->model) * sizeof(double);
}

/* qd, qdd, power and lambda at (t, state) into slope; state (2 n + 1). Errors: those of refdyn_accelerate. */
int refdyn_slope(struct refdyn_drive *drive, double t, const double *state, double *slope);

#endif
