/*
 * What every kind of integrator gives to a drive: facts, a step, and a look into it.
 *
 * A state is q, qd and work_done, its slope qd, qdd and power: 2 n + 1 values each. A step goes from
 * drive->state with drive->slope at drive->t_begin to drive->state_new; the drive then evaluates
 * drive->slope_new. Between them lies the state at t_begin + theta (t_end - t_begin).
 */
#ifndef REFDYN_STEP_H
#define REFDYN_STEP_H

#include "../refdyn.h"
#include "base/layout.h"

/* Of one method: its table, and what all kinds of tables have. */
struct refdyn_method_facts {
    const char *name;
    int order;
    int order_error; /* of the embedded formula that the step is chosen by; 0: none, steps are fixed */
    int is_implicit;
    int is_last_new;                                    /* the slope of its last stage is that of state_new */
    const struct refdyn_tableau *tableau;               /* explicit, or NULL: */
    const struct refdyn_rosenbrock_table *rosenbrock;   /* linearly implicit, or NULL: */
    const struct refdyn_collocation_table *collocation; /* implicit; all NULL: auto */
};

/* All 0 outside the range. */
struct refdyn_method_facts refdyn_method_facts(enum refdyn_method method);

/* Largest |x_j - y_j| (n each; y NULL: 0) in drive->units; NaN where one is. */
double refdyn_largest_change(const struct refdyn_drive *drive, const double *x, const double *y);

/* Doubles of drive->stages. */
int refdyn_rosenbrock_room(const struct refdyn_rosenbrock_table *table, int n);
/* One step of h; Rosenbrock: with the tangent at its begin in drive->linear, and without work_done. Errors:
 * those of refdyn_slope; MATRIX_SINGULAR. */
int refdyn_rosenbrock_step(struct refdyn_drive *drive, double h);
/* The state at theta. Errors: those of refdyn_slope, from stages that the interpolant alone needs. */
int refdyn_rosenbrock_interpolate(struct refdyn_drive *drive, double theta, double *state);
/* The cubic of Hermite: state (2 n) at theta of the step, with the slope at its end. */
void refdyn_hermite(const struct refdyn_drive *drive, const double *slope_end, double theta, double *state);

int refdyn_collocation_room(const struct refdyn_collocation_table *table, int n);
int refdyn_collocation_step(struct refdyn_drive *drive, double h);
int refdyn_collocation_interpolate(struct refdyn_drive *drive, double theta, double *state);

int refdyn_runge_kutta_room(const struct refdyn_tableau *tableau, const struct refdyn_model *model);
int refdyn_runge_kutta_step(struct refdyn_drive *drive, double h);
int refdyn_runge_kutta_interpolate(struct refdyn_drive *drive, double theta, double *state);
/* Derivative of qd (n) of the interpolant at theta, once refdyn_runge_kutta_interpolate was called. */
void refdyn_runge_kutta_accelerations(const struct refdyn_drive *drive, double theta, double *qdd);

#endif
