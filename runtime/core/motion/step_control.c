/*
 * The lengths of steps: proposed from errors, or equal parts of an interval.
 *
 * In: the errors of accepted and refused steps, in tolerances. Out: the next step.
 *
 * Explicit methods use a PI controller, which keeps them from bouncing at their stability limit (Gustafsson,
 * ACM TOMS 17:533-554, 1991; constants of Hairer and Wanner, Solving ODEs II, IV.2). Rosenbrock methods
 * follow the change of the error, but never take a longer step than the error allows (Gustafsson, ACM TOMS
 * 20:496-517, 1994). The estimates of collocation are noisy, and use the filter H211b with b = 4 (Soderlind,
 * ACM TOMS 29:1-26, 2003). Fixed steps end at t = from + i h, so that the time gathers no error.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <limits.h>
#include <math.h>

/* Steps aim at this part of the tolerance, so that few are refused. It is the same for methods of all orders,
 * so that their errors are alike. */
static const double aim = 0.06;
/* Bounds of the next step over this one: an estimate that is near 0 by chance says nothing about the next
 * step. */
static const double growth_most = 5;
static const double growth_least = 0.2;
/* Factor after a step without an estimate: a guess. */
static const double shrink_failed = 0.4;
/* After a failed step the next ones are at most this part of it. This bound grows by a factor that squares
 * with every success, so that one failure does not slow the rest of the motion. */
static const double cap_failed = 0.6, cap_growth = 1.04;
/* The step and its factors are kept if the step would change by less than these factors. */
static const double kept_least = 0.95, kept_most = 1.1;
/* A collocation step whose error allows one longer by more than this factor was short for a reason and not by
 * noise. */
static const double far_below = 2;
/* Exponents of the PI controller times the order, for this error and for the last one. */
static const double error_share = 0.7, error_last_share = 0.4;
/* Smallest last error, so that a step with a small error by chance does not make the next one too long. */
static const double error_least = 1e-4;
/* Change in the first step, relative to the change tol^(1/order) that a step of that order may make. */
static const double first_share = 0.1;

double refdyn_time_resolution(double t) {
    return 4 * DBL_EPSILON * fabs(t);
}

double refdyn_control_least(double t_begin, double t_out) {
    return fmax(refdyn_time_resolution(t_begin), refdyn_time_resolution(t_out));
}

/* ---- Fixed steps ---- */

/* Cuts [t_begin, t_out] into equal steps. An excess of less than 1e-8 of a step does not make one more. */
int refdyn_control_plan(struct refdyn_step_control *control, double h, double t_begin, double t_out) {
    if (control->interval_done != control->interval_steps && control->to == t_out)
        return REFDYN_OK;
    const double count = ceil((t_out - t_begin) / h * (1 - sqrt(DBL_EPSILON)));
    if (!(count < (double)LONG_MAX) || h < refdyn_control_least(t_begin, t_out))
        return REFDYN_STEP_TOO_SMALL;
    control->from = t_begin;
    control->to = t_out;
    control->interval_steps = count > 1 ? (long)count : 1;
    control->interval_done = 0;
    return REFDYN_OK;
}

double refdyn_control_fixed(const struct refdyn_step_control *control, double *t_new) {
    const double h = (control->to - control->from) / (double)control->interval_steps;
    const long next = control->interval_done + 1;
    *t_new = next == control->interval_steps ? control->to : control->from + (double)next * h;
    return h;
}

void refdyn_control_fixed_done(struct refdyn_step_control *control) {
    control->interval_done++;
}

void refdyn_control_leave_interval(struct refdyn_step_control *control) {
    control->interval_done = control->interval_steps = 0;
}

/* ---- Adaptive steps ---- */

void refdyn_control_begin(struct refdyn_step_control *control, double h) {
    control->next = h;
    control->cap = INFINITY;
    control->cap_growth = 1;
    control->error_last = 1;
    control->last = control->refused = 0;
}

/* The error of a step goes with h to this power. */
static double order_of(const struct refdyn_method_definition *method) {
    return method->order_error + 1;
}

void refdyn_control_drop(struct refdyn_step_control *control, double least) {
    if (control->next < least)
        control->next = 0;
}

void refdyn_control_find(struct refdyn_step_control *control, const struct refdyn_step *step, double t_stop,
                         double interval) {
    const int n = step->n;
    if (control->next > 0)
        return;
    const double change = first_share * pow(step->tolerance, 1 / order_of(step->method));
    double h = t_stop - step->t_begin;
    for (int j = 0; j < n; j++) {
        const int is_state = j >= step->joints; /* which changes by its rate, in place of an acceleration */
        const double rate = fabs(step->rates[j]) / step->units[j],
                     gain = fabs(step->rates[n + j]) / step->units[j];
        const double speed = is_state ? gain : rate, acceleration = is_state ? 0 : gain;
        if (h * speed > change)
            h = change / speed;
        if (h * h / 2 * acceleration > change)
            h = sqrt(2 * change / acceleration);
    }
    control->next = isfinite(h) ? h : interval;
}

void refdyn_control_bound(struct refdyn_step_control *control, double h) {
    control->next = fmin(control->next, h);
}

double refdyn_control_clip(const struct refdyn_step_control *control, double t_begin, double t_stop) {
    const double left = t_stop - t_begin, h = control->next;
    if (h >= left * (1 - sqrt(DBL_EPSILON)))
        return left;
    return 2 * h > left ? left / 2 : h;
}

static double bounded(double x, double least, double most) {
    return x < least ? least : x > most ? most : x;
}

/* The step, over h, whose error would be the one that is aimed at. */
static double factor_allowed(const struct refdyn_method_definition *method, double error) {
    return pow(fmax(error, DBL_MIN) / aim, -1 / order_of(method));
}

/* The next step over this one, before bounds. After the first step only its error is known. */
static double factor_after_accepted(const struct refdyn_step_control *control,
                                    const struct refdyn_method_definition *method, double h, double error) {
    const enum refdyn_controller controller = method->kind->controller;
    const double order = order_of(method), now = fmax(error, DBL_MIN), last = control->error_last;
    const double change = h / control->last;
    if (control->last > 0 && controller == REFDYN_PI)
        return pow(now / aim, -error_share / order) * pow(last / aim, error_last_share / order);
    const double allowed = factor_allowed(method, error);
    if (control->last == 0)
        return allowed;
    if (controller == REFDYN_PREDICTIVE || allowed > far_below)
        return allowed * fmin(1, change * pow(last / now, 1 / order));
    return pow(now / aim * last / aim, -0.25 / order) * pow(change, -0.25);
}

void refdyn_control_accepted(struct refdyn_step_control *control,
                             const struct refdyn_method_definition *method, double h, double error) {
    const double proposed =
        h * bounded(factor_after_accepted(control, method, h, error), growth_least, growth_most);
    if (method->kind->controller == REFDYN_FILTER && proposed > h * kept_least && proposed < h * kept_most)
        control->next = h;
    else /* a step that was shortened to end on an obstacle does not shorten the next one, unless its error
          * does
          */
        control->next = h < control->next
                            ? fmax(proposed, fmin(control->next, h * factor_allowed(method, error)))
                            : proposed;
    control->next = fmin(control->next, control->cap);
    control->cap *= control->cap_growth;
    control->cap_growth *= control->cap_growth;
    control->error_last = fmax(error, error_least);
    control->last = h;
    control->refused = 0;
}

double refdyn_control_order(const struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error) {
    const double order = order_of(method);
    if (!(control->refused > h))
        return order;
    return bounded(log(control->refused_error / error) / log(control->refused / h), 1, order);
}

void refdyn_control_refused(struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error) {
    const double order = refdyn_control_order(control, method, h, error);
    control->refused = isfinite(error) ? h : 0;
    control->refused_error = error;
    control->next =
        h * (isfinite(error) ? bounded(pow(error / aim, -1 / order), growth_least, 1) : shrink_failed);
}

void refdyn_control_failed(struct refdyn_step_control *control, double h) {
    control->cap = cap_failed * h;
    control->cap_growth = cap_growth;
}
