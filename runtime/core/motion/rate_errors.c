/*
 * Errors of rates, accelerations and forces in one step.
 *
 * In: an accepted end with its rates, and the error estimate e of its coordinates and rates. Out: the largest
 * error of each kind, relative to the largest value of this kind in the motion so far.
 *
 * A tolerance of positions says little about accelerations: an error e of a mode of w rad/s is an error w^2 e
 * of its acceleration. The accelerations a and multipliers lambda of y - e show it,
 *     e_a = a(y) - a(y - e),   e_force = u^T (lambda(y) - lambda(y - e)).
 * At a jump one of y - e and y + e is beyond it, so that the smaller of both differences counts. Errors of e
 * below the rounding of the state are left out, since no shorter step reduces them.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

/* An error of a coordinate below this multiple of its size is rounding of the step. */
static const double rounding = 256 * DBL_EPSILON;

enum { RATES, ACCELERATIONS, FORCES };

/* largest (REFDYN_RATE_KINDS) := at least the size of each kind in these rates (2 n + 1 + m), with the row
 * terms of the workspace. */
static void raise_sizes(const struct refdyn_motion *motion, const double *rates, double *largest) {
    const struct refdyn_step *step = &motion->step;
    const int n = step->n;
    const double *accelerations = rates + n;
    double *force = step->stage;
    refdyn_programme_force(motion->work, rates + 2 * n + 1, force);
    for (int j = 0; j < step->joints; j++) {
        largest[RATES] = fmax(largest[RATES], fabs(rates[j]) / step->units[j]);
        largest[ACCELERATIONS] = fmax(largest[ACCELERATIONS], fabs(accelerations[j]) / step->units[j]);
        largest[FORCES] = fmax(largest[FORCES], fabs(force[j]) * step->units[j]);
    }
}

void refdyn_rate_errors_start(struct refdyn_motion *motion) {
    motion->rate_errors = (struct refdyn_rate_errors){.largest = {0}};
    raise_sizes(motion, motion->step.rates, motion->rate_errors.largest);
}

void refdyn_rate_errors_note(struct refdyn_motion *motion) {
    raise_sizes(motion, motion->step.rates_new, motion->rate_errors.largest);
}

static double beyond_rounding(double error, double size) {
    return copysign(fmax(fabs(error) - rounding * size, 0), error);
}

/* Errors of coordinate j and of its rate in a step of h. The estimate of collocation has positions alone. */
static double error_of(const struct refdyn_step *step, int j) {
    return beyond_rounding(step->error[j], fmax(fabs(step->state_new[j]), step->units[j]));
}

static double error_of_rate(const struct refdyn_step *step, int j, double h) {
    const double size = fmax(fabs(step->state_new[j]), step->units[j]) / h;
    return step->method->kind == &refdyn_collocation ? error_of(step, j) / h
                                                     : beyond_rounding(step->error[step->n + j], size);
}

/* step->stage := the end of the step, moved by the error of the state times `sign`. */
static void move_end(const struct refdyn_step *step, double h, double sign) {
    memcpy(step->stage, step->state_new, refdyn_state_bytes(step));
    for (int j = 0; j < step->n; j++) {
        step->stage[j] += sign * error_of(step, j);
        step->stage[step->n + j] += sign * error_of_rate(step, j, h);
    }
}

/* errors (REFDYN_RATE_KINDS) := those of the end, from the rates of a state moved by the error. Returns the
 * status of these rates. The workspace has the row terms of the end again. */
static int find_errors(struct refdyn_motion *motion, double h, double sign, double *errors) {
    struct refdyn_step *step = &motion->step;
    const int n = step->n, size = refdyn_rates_size(motion->work->model);
    const double t = refdyn_rows_side_of(motion, step->t_end);
    double *rates = step->side;
    move_end(step, h, sign);
    int status = refdyn_rates(&step->evaluation, t, step->stage, rates);
    if (!status)
        status = refdyn_row_terms(motion->work, t, step->state_new, step->state_new + n);
    for (int j = 0; j < n; j++)
        rates[j] = fmax(fabs(error_of_rate(step, j, h)), fabs(error_of(step, j)) / h);
    for (int i = n; i < size; i++)
        rates[i] -= step->rates_new[i];
    memset(errors, 0, REFDYN_RATE_KINDS * sizeof *errors);
    raise_sizes(motion, rates, errors);
    return status;
}

/* The largest error relative to the largest value so far, or at the end of the step. */
static double size_of(const struct refdyn_motion *motion, const double *errors) {
    double largest[REFDYN_RATE_KINDS], size = 0;
    memcpy(largest, motion->rate_errors.largest, sizeof largest);
    raise_sizes(motion, motion->step.rates_new, largest);
    for (int kind = 0; kind < REFDYN_RATE_KINDS; kind++)
        if (errors[kind] > 0)
            size = fmax(size, errors[kind] / largest[kind]);
    return size;
}

double refdyn_rate_errors_measure(struct refdyn_motion *motion, double h, double tolerance) {
    double errors[REFDYN_RATE_KINDS], size = INFINITY;
    struct refdyn_step *step = &motion->step;
    for (double sign = -1; sign <= 1 && size > 1; sign += 2)
        if (!find_errors(motion, h, sign, errors))
            size = fmin(size, size_of(motion, errors) / tolerance);
    if (!isnan(step->t_complete))
        refdyn_step_complete(step, step->t_complete);
    return size;
}
