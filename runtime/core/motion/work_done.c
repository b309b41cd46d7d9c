/*
 * Work of forces on a motion whose method does not integrate it: see motion.h.
 *
 * Takes a step that was taken; gives the integral of power on its interpolant, by Lobatto's formula of order
 * 6 (Hairer and Wanner, Solving ODEs II, IV.5).
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

/* Rates into step->side, at theta of the step; at a time event those on its left side. */
static int rates_at(struct refdyn_step *step, double theta) {
    const double h = step->t_end - step->t_begin;
    const double t = refdyn_step_inside(step, step->t_begin + theta * h);
    int status = REFDYN_OK;
    if (theta == 1)
        memcpy(step->stage, step->state_new, (size_t)(2 * step->n) * sizeof(double));
    else
        status = step->method->kind->interpolate(step, theta, step->stage);
    if (!status && theta == 1 && step->t_end < step->t_limit)
        memcpy(step->side, step->rates_new, (size_t)(2 * step->n + 1) * sizeof(double));
    else if (!status)
        status = refdyn_rates(&step->evaluation, t, step->stage, step->side);
    return status;
}

int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done) {
    const double off = sqrt(0.05), h = step->t_end - step->t_begin;
    const double places[3] = {0.5 - off, 0.5 + off, 1}, weights[3] = {5.0 / 12, 5.0 / 12, 1.0 / 12};
    const int n = step->n;
    double sum = step->rates[2 * n] / 12;
    for (int k = 0; k < 3; k++) {
        const int status = rates_at(step, theta * places[k]);
        if (status)
            return status;
        sum += weights[k] * step->side[2 * n];
    }
    *work_done = step->state[2 * n] + theta * h * sum;
    return REFDYN_OK;
}
