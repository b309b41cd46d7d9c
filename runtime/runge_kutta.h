/* Explicit Runge-Kutta methods as data, and the one function that steps with any of them. */
#ifndef REFDYN_RUNGE_KUTTA_H
#define REFDYN_RUNGE_KUTTA_H

#include "refdyn.h"

/* Butcher tableau: Y_s = y + h sum_j a_sj f(t + c_j h, Y_j), y_new = y + h sum_s b_s f_s. */
struct refdyn_tableau {
    const char *name;
    int stages;
    int order;
    int order_error; /* of the embedded formula; 0: none, the step is fixed */
    int is_last_new; /* the last stage is taken at the end of the step, with y_new (first same as last) */
    const double *a; /* (stages x stages) strictly lower triangle */
    const double *b; /* (stages) */
    const double *c; /* (stages) */
    const double *e; /* (stages) b minus the embedded formula's b */
};

const struct refdyn_tableau *refdyn_tableau_of(enum refdyn_method method);

/* Slope of a stage: qd, qdd and power at (t, state), state and slope (2 n + 1). Errors: those of
 * refdyn_accelerate. */
int refdyn_slope(const struct refdyn_drive *drive, double t, const double *state, double *slope);
/* The same with the equations of that state already in the workspace. */
int refdyn_slope_evaluated(const struct refdyn_drive *drive, double t, const double *state, double *slope);

/* One step of h from drive->state, whose slope is the first, into drive->state_new and drive->error. */
int refdyn_runge_kutta_step(struct refdyn_drive *drive, double h);

#endif
