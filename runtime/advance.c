/*
 * One accepted step of a drive: tried, brought onto the programme, judged.
 *
 * Takes the state at the end of the last step; gives the next one. Fixed step: t = from + i h, so that the
 * time gathers no error. Adaptive: step from the error of positions; explicit ones by a PI controller
 * (Gustafsson, ACM TOMS 17:533-554, 1991; constants of Hairer, Norsett and Wanner, Solving ODEs I, IV.2),
 * which keeps explicit methods from bouncing at their stability limit.
 */
#include "base/arithmetic.h"

#include "private/advance.h"
#include "private/choose.h"
#include "private/collocation.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "private/kinks.h"
#include "constraints/constraints.h"
#include "linear/dense.h"
#include "private/linearise.h"
#include "private/pass.h"
#include "private/slope.h"
#include "private/step.h"

/* Steps aim at this part of the tolerance, so that few are refused: the same for methods of all orders, whose
 * errors then are alike. */
static const double aim = 0.06;
/* an estimate that is near 0 by chance says nothing about the next step */
static const double growth_most = 5;
static const double growth_least = 0.2;
static const double shrink_failed = 0.4; /* no estimate, so a guess */
/* a step that failed is not soon tried again: no longer one than this part of it, then more by this factor,
 * which is squared after each step that succeeds: one failure must not rule the rest of a motion */
static const double cap_failed = 0.6, cap_growth = 1.04;
static const double kept_least = 0.95, kept_most = 1.1; /* within them a step is kept, with its factors */
/* a step of collocation that could be so many times longer is short for a reason, not by noise */
static const double far_below = 2;
static const double error_share = 0.7;      /* exponents times the order: of this error, */
static const double error_last_share = 0.4; /* and of the one before */
static const double error_least = 1e-4;     /* of the one before, lest a lucky step blows up the next */
static const double moved_most = 10;        /* tolerances, by a projection */
static const double moved_rates = 0.5;      /* of the largest rate, by a projection */
static const double first_share = 0.1; /* of the change tol^(1/order), which a step of that order may make */
static const double passage_reach = 8, passage_reach_fixed = 4; /* steps ahead, in which a state where the
                                                                   rows lose rank is looked for */
static const double turned_most =
    0.1; /* [rad, or length]: beyond, directions in the metric of M are found anew */

void refdyn_set_gains(struct refdyn_drive *drive, double h) {
    const struct refdyn_options *options = &drive->options;
    const struct refdyn_workspace *work = drive->work;
    const int *gains = work->model->gains;
    if (!gains || (options->stabilise == REFDYN_BAUMGARTE && options->gain_share == 0))
        return;
    const double gain = options->stabilise == REFDYN_BAUMGARTE ? options->gain_share / h : 0;
    for (int a = 0; a < work->m; a++) {
        if (gains[2 * a] >= 0)
            work->p[gains[2 * a]] = 2 * gain;
        if (gains[2 * a + 1] >= 0)
            work->p[gains[2 * a + 1]] = gain * gain;
    }
}

void refdyn_record_residuals(struct refdyn_drive *drive) {
    struct refdyn_statistics *statistics = &drive->statistics;
    const struct refdyn_residual now = refdyn_residuals(drive->work);
    if (now.phi_row >= 0 && (statistics->phi_row < 0 || now.phi > statistics->phi_max)) {
        statistics->phi_max = now.phi;
        statistics->phi_row = now.phi_row;
    }
    if (now.psi_row >= 0 && (statistics->psi_row < 0 || now.psi > statistics->psi_max)) {
        statistics->psi_max = now.psi;
        statistics->psi_row = now.psi_row;
    }
}

/* ---- The programme ---- */

/* Explicit methods: in the metric of a mass matrix that is not far away. */
static int align_with_mass(struct refdyn_drive *drive, double t, const double *state) {
    struct refdyn_workspace *work = drive->work;
    const int n = work->n;
    if (drive->is_aligned == work->partition.choices &&
        refdyn_largest_change(drive, state, drive->aligned) < turned_most)
        return REFDYN_OK;
    const int status = refdyn_linear_factor_mass(drive, t, state);
    if (status)
        return status;
    refdyn_linear_directions(&drive->linear);
    memcpy(drive->aligned, state, (size_t)n * sizeof *state);
    drive->is_aligned = work->partition.choices;
    return REFDYN_OK;
}

/* Implicit methods: in the metric of the step's matrix, else a stiff deflection would take up the change. */
static int align(struct refdyn_drive *drive, double t, const double *state) {
    const struct refdyn_method_facts facts = refdyn_method_facts(drive->method);
    if (!facts.is_implicit || (facts.collocation && facts.collocation->lambda[1] != 0))
        return align_with_mass(drive, t, state);
    if (!drive->is_aligned)
        refdyn_linear_directions(&drive->linear);
    drive->is_aligned = 1;
    return REFDYN_OK;
}

int refdyn_meet_programme(struct refdyn_drive *drive, double t, double *state) {
    const struct refdyn_linear *linear = &drive->linear;
    const int n = drive->work->n, status = align(drive, t, state);
    const struct refdyn_directions along = refdyn_linear_found(linear);
    return status ? status : refdyn_project_along(drive->work, &along, t, state, state + n);
}

/* ---- Work of forces ---- */

/* Abscissae and weights of Lobatto's formula of order 6 behind its first point (Hairer and Wanner, Solving
 * ODEs II, IV.5). */
int refdyn_find_work(struct refdyn_drive *drive, double theta, double *work_done) {
    const double off = sqrt(0.05);
    const double places[3] = {0.5 - off, 0.5 + off, 1}, weights[3] = {5.0 / 12, 5.0 / 12, 1.0 / 12};
    const double h = drive->t_end - drive->t_begin;
    const int n = drive->work->n;
    double sum = drive->slope[2 * n] / 12;
    for (int k = 0; k < 3; k++) {
        const double at = theta * places[k], t = fmin(drive->t_begin + at * h, drive->t_limit);
        int status = REFDYN_OK;
        if (at == 1)
            memcpy(drive->stage, drive->state_new, (size_t)(2 * n) * sizeof(double));
        else
            status = refdyn_rosenbrock_interpolate(drive, at, drive->stage);
        if (!status && at == 1 && drive->t_end < drive->t_limit)
            memcpy(drive->side, drive->slope_new, (size_t)(2 * n + 1) * sizeof(double));
        else if (!status) /* at a break, on its left side */
            status = refdyn_slope(drive, t, drive->stage, drive->side);
        if (status)
            return status;
        sum += weights[k] * drive->side[2 * n];
    }
    *work_done = drive->state[2 * n] + theta * h * sum;
    return REFDYN_OK;
}

/* ---- One step ---- */

/* The end of the last step is the begin of the next one, on the right side of a break. */
static int begin(struct refdyn_drive *drive) {
    const size_t bytes = (size_t)(2 * drive->work->n + 1) * sizeof(double);
    refdyn_pass_leave(drive);
    if (drive->t_begin != drive->t_end) {
        memcpy(drive->state, drive->state_new, bytes);
        memcpy(drive->slope, drive->slope_new, refdyn_slope_bytes(drive));
        drive->t_begin = drive->t_end = refdyn_right_of(drive, drive->t_end);
        drive->has_tangent = 0;
    }
    refdyn_choose_take_up(drive);
    const int status =
        refdyn_method_facts(drive->method).rosenbrock ? refdyn_linear_at_begin(drive) : REFDYN_OK;
    if (!status || refdyn_choose_after_failure(drive))
        return REFDYN_OK;
    drive->failed_t = drive->t_begin;
    return status;
}

int refdyn_rates_are_moved(const struct refdyn_drive *drive, const double *before, const double *after,
                           double h) {
    const int n = drive->work->n;
    const double largest = refdyn_largest_change(drive, before + n, NULL);
    const double moved = refdyn_largest_change(drive, after + n, before + n);
    const double longest = fmax(h, drive->statistics.step_largest);
    return moved > moved_rates * largest && moved * longest > moved_most * drive->options.tol;
}

/* A new state that is far off the programme, for its tolerance, tells of a step that went wrong: near a
 * singular position the nearest state on the programme may lie on another branch. drive->side: the state
 * before. */
static int meet_programme_nearby(struct refdyn_drive *drive, double t_new) {
    const struct refdyn_workspace *work = drive->work;
    const int is_judged =
        drive->options.tol > 0 && !drive->is_passing; /* otherwise: refdyn_pass_follow, or nothing */
    const double most = is_judged ? moved_most * drive->options.tol : INFINITY;
    const int row = refdyn_residuals(work).phi_row;
    int status = refdyn_meet_programme(drive, t_new, drive->state_new);
    for (int j = 0; j < work->n && !status; j++)
        if (!(fabs(drive->state_new[j] - drive->side[j]) <= most * drive->units[j])) {
            drive->work->fault = (struct refdyn_fault){.row = row, .coordinate = j};
            return REFDYN_NO_CONVERGENCE;
        }
    if (!status && is_judged &&
        refdyn_rates_are_moved(drive, drive->side, drive->state_new, t_new - drive->t_begin)) {
        drive->work->fault = (struct refdyn_fault){.row = row, .coordinate = -1};
        return REFDYN_NO_CONVERGENCE;
    }
    if (!status && drive->is_passing)
        status = refdyn_pass_follow(drive, drive->side, drive->state_new);
    return status;
}

/* Row terms, projection where that is asked for, partition, slope and work at the new state. */
static int complete(struct refdyn_drive *drive, double t_new) {
    struct refdyn_workspace *work = drive->work;
    const struct refdyn_method_facts facts = refdyn_method_facts(drive->method);
    const int n = work->n;
    const double t = refdyn_right_of(drive, t_new);
    double *q = drive->state_new, *qd = drive->state_new + n;
    int status = refdyn_row_terms(work, t, q, qd), is_known = facts.is_last_new && t_new < drive->t_limit;
    if (!status && work->m > 0 && (drive->options.stabilise == REFDYN_PROJECT || drive->is_passing)) {
        memcpy(drive->side, drive->state_new, (size_t)(2 * n) * sizeof *q);
        status = meet_programme_nearby(drive, t);
        is_known = is_known && memcmp(drive->side, drive->state_new, (size_t)(2 * n) * sizeof *q) == 0;
    }
    work->partition.rank_most = work->m;
    if (!status)
        status = refdyn_partition_watch(work, t, q, qd);
    work->partition.rank_most = work->partition.rank;
    if (!status && !is_known)
        status = refdyn_slope(drive, t, drive->state_new, drive->slope_new);
    work->partition.rank_most = work->partition.rank;
    if (status)
        drive->failed_t = t_new;
    return status;
}

void refdyn_accept_step(struct refdyn_drive *drive, double h) {
    struct refdyn_statistics *statistics = &drive->statistics;
    statistics->step_smallest = statistics->steps ? fmin(statistics->step_smallest, h) : h;
    statistics->step_largest = fmax(statistics->step_largest, h);
    statistics->steps++;
    refdyn_record_residuals(drive);
}

/* Takes the new state as the end of the step. */
static int arrive(struct refdyn_drive *drive, double t_new, double h) {
    drive->t_end = t_new;
    refdyn_accept_step(drive, h);
    refdyn_choose_after_step(drive);
    return drive->options.balance && refdyn_method_facts(drive->method).rosenbrock
               ? refdyn_find_work(drive, 1, drive->state_new + 2 * drive->work->n)
               : REFDYN_OK;
}

static int attempt(struct refdyn_drive *drive, double h) {
    const struct refdyn_method_facts facts = refdyn_method_facts(drive->method);
    refdyn_set_gains(drive, h);
    if (facts.collocation)
        return refdyn_collocation_step(drive, h);
    if (!facts.rosenbrock)
        return refdyn_runge_kutta_step(drive, h);
    drive->is_aligned = 0;
    return refdyn_rosenbrock_step(drive, h);
}

double refdyn_largest_error(const struct refdyn_drive *drive, double h) {
    const int n = drive->work->n;
    double largest = 0;
    for (int j = 0; j < n; j++) {
        const double position = fabs(drive->error[j]), velocity = h * fabs(drive->error[n + j]);
        if (isnan(position + velocity))
            return NAN;
        largest = fmax(largest, fmax(position, velocity) / drive->units[j]);
    }
    return largest;
}

/* ---- Through a state where the rows lose rank ---- */

/* One attempt, from t_begin to t_new. */
static int attempt_passage(struct refdyn_drive *drive, double t_new, double *error) {
    const double h = t_new - drive->t_begin;
    int status = refdyn_pass_enter(drive);
    if (!status)
        status = attempt(drive, h);
    if (status)
        return status;
    *error = refdyn_largest_error(drive, h);
    if (!(*error <= refdyn_pass_error_most(drive, h))) {
        drive->refused.why = REFDYN_LARGE_ERROR;
        return REFDYN_NO_CONVERGENCE;
    }
    refdyn_pass_look_back(drive, t_new);
    return complete(drive, t_new);
}

int refdyn_pass(struct refdyn_drive *drive, double h, double t_bound, double *t) {
    struct refdyn_partition *partition = &drive->work->partition;
    const int is_fixed = drive->options.tol == 0;
    const double reach = (is_fixed ? passage_reach_fixed : passage_reach) * h;
    double error = INFINITY;
    *t = INFINITY;
    if (drive->options.singular != REFDYN_PASS || !refdyn_pass_is_ahead(drive, reach, t))
        return 0;
    const int rank = partition->rank;
    const double step_max = is_fixed ? 0 : drive->options.step_max;
    if (refdyn_pass_is_vain(drive, *t))
        return 0;
    const double t_new = refdyn_pass_end(drive, *t, t_bound);
    if (step_max > 0 && isfinite(t_new) && t_new - drive->t_begin > step_max)
        return 0;
    int status = isfinite(t_new) ? attempt_passage(drive, t_new, &error) : REFDYN_NO_CONVERGENCE;
    if (!status)
        status = arrive(drive, t_new, t_new - drive->t_begin);
    if (!status) {
        refdyn_pass_record(drive, t_new, error);
        return 1;
    }
    drive->cause = status;
    refdyn_pass_refuse(drive, t_new);
    partition->rank_most = rank;
    drive->statistics.rejected++;
    return 0;
}

/* ---- Fixed steps ---- */

double refdyn_step_least(const struct refdyn_drive *drive, double t_out) {
    return fmax(refdyn_time_resolution(drive->t_begin), refdyn_time_resolution(t_out));
}

/* Cuts [t, t_out] into equal steps; a part of 1e-8 of a step more than asked for does not make one more. */
static int plan_interval(struct refdyn_drive *drive, double t_out) {
    const double count = ceil((t_out - drive->t_begin) / drive->options.step * (1 - sqrt(DBL_EPSILON)));
    if (!(count < (double)LONG_MAX) || drive->options.step < refdyn_step_least(drive, t_out))
        return REFDYN_STEP_TOO_SMALL;
    drive->from = drive->t_begin;
    drive->to = t_out;
    drive->interval_steps = count > 1 ? (long)count : 1;
    drive->interval_done = 0;
    return REFDYN_OK;
}

static int step_fixed(struct refdyn_drive *drive, double t_out, double t_bound) {
    int status = REFDYN_OK;
    double t_singular;
    if (drive->interval_done == drive->interval_steps || drive->to != t_out)
        status = plan_interval(drive, t_out);
    if (status)
        return status;
    const double h = (drive->to - drive->from) / (double)drive->interval_steps;
    if (refdyn_pass(drive, h, t_bound, &t_singular)) {
        drive->interval_done = drive->interval_steps;
        return REFDYN_OK;
    }
    const long next = drive->interval_done + 1;
    const double t_new = next == drive->interval_steps ? drive->to : drive->from + (double)next * h;
    if (t_singular <= t_new + h / 2) {
        drive->failed_t = t_singular;
        return drive->cause;
    }
    status = attempt(drive, h);
    if (!status)
        status = complete(drive, t_new);
    if (status)
        return status;
    status = arrive(drive, t_new, h);
    drive->interval_done += !status;
    return status;
}

/* ---- Adaptive steps ---- */

static double error_norm(const struct refdyn_drive *drive, double h) {
    return refdyn_largest_error(drive, h) / refdyn_choose_tolerance(drive);
}

/* Order of the step's error: what its size goes with. */
static double order_of_step(const struct refdyn_drive *drive) {
    return refdyn_method_facts(drive->method).order_error + 1;
}

/* First step: velocities and accelerations move no coordinate by more than a small part of tol^(1/order). It
 * does not depend on the outputs; where nothing moves it is `interval`. */
static double find_first_step(const struct refdyn_drive *drive, double t_stop, double interval) {
    const int n = drive->work->n;
    const double change = first_share * pow(drive->options.tol, 1 / order_of_step(drive));
    double h = t_stop - drive->t_begin;
    for (int j = 0; j < n; j++) {
        const double unit = drive->units[j];
        const double speed = fabs(drive->slope[j]) / unit, acceleration = fabs(drive->slope[n + j]) / unit;
        if (h * speed > change)
            h = change / speed;
        if (h * h / 2 * acceleration > change)
            h = sqrt(2 * change / acceleration);
    }
    return isfinite(h) ? h : interval;
}

/* The step to try: the proposed one, shortened so that it lands on t_stop or leaves more than half of itself.
 */
static double clip_step(const struct refdyn_drive *drive, double t_stop) {
    const double left = t_stop - drive->t_begin, h = drive->step_next;
    if (h >= left * (1 - sqrt(DBL_EPSILON)))
        return left;
    return 2 * h > left ? left / 2 : h;
}

static double bounded(double x, double least, double most) {
    return x < least ? least : x > most ? most : x;
}

/* What the error of a step of h allows: the step, over h, whose error is what is aimed at. */
static double factor_allowed(const struct refdyn_drive *drive, double error) {
    return pow(fmax(error, DBL_MIN) / aim, -1 / order_of_step(drive));
}

/* What the next step is over this one, before bounds. Before the first step nothing is known but its error.
 * Explicit methods meet stability limits, where the error jumps from step to step: PI. Rosenbrock methods
 * follow how the error changed, but never beyond what it allows (Gustafsson, ACM TOMS 20:496-517, 1994). The
 * estimates of collocation are noisy: the filter H211b, b = 4 (Soderlind, ACM TOMS 29:1-26, 2003). */
static double factor_after_accepted(const struct refdyn_drive *drive, double h, double error) {
    const struct refdyn_method_facts facts = refdyn_method_facts(drive->method);
    const double order = order_of_step(drive), now = fmax(error, DBL_MIN), last = drive->error_last;
    const double allowed = factor_allowed(drive, error), change = h / drive->step_last;
    if (drive->step_last == 0)
        return allowed;
    if (facts.rosenbrock || (facts.collocation && allowed > far_below))
        return allowed * fmin(1, change * pow(last / now, 1 / order));
    if (facts.collocation)
        return pow(now / aim * last / aim, -0.25 / order) * pow(change, -0.25);
    return pow(now / aim, -error_share / order) * pow(last / aim, error_last_share / order);
}

static void propose_after_accepted(struct refdyn_drive *drive, double h, double error) {
    const double proposed = h * bounded(factor_after_accepted(drive, h, error), growth_least, growth_most);
    if (refdyn_method_facts(drive->method).collocation && proposed > h * kept_least &&
        proposed < h * kept_most)
        drive->step_next = h;
    else /* a step that was cut short to land says nothing against the longer one, unless its error does */
        drive->step_next = h < drive->step_next
                               ? fmax(proposed, fmin(drive->step_next, h * factor_allowed(drive, error)))
                               : proposed;
    drive->step_next = fmin(drive->step_next, drive->step_cap);
    drive->step_cap *= drive->cap_growth;
    drive->cap_growth *= drive->cap_growth;
    drive->error_last = fmax(error, error_least);
    drive->step_last = h;
    drive->refused_h = 0;
}

/* Order by which the error has fallen from the last refused attempt to this one, at most that of the method:
 * beside a kink, or while a stiff transient lasts, it is lower. */
static double observed_order(const struct refdyn_drive *drive, double h, double error) {
    const double order = order_of_step(drive);
    if (!(drive->refused_h > h))
        return order;
    return bounded(log(drive->refused_error / error) / log(drive->refused_h / h), 1, order);
}

/* After a step whose error is too large; INFINITY: that could not be evaluated. */
static void propose_after_refused(struct refdyn_drive *drive, double h, double error) {
    const double order = observed_order(drive, h, error);
    drive->refused_h = isfinite(error) ? h : 0;
    drive->refused_error = error;
    drive->step_next =
        h * (isfinite(error) ? bounded(pow(error / aim, -1 / order), growth_least, 1) : shrink_failed);
}

/* Tries one step; 1: accepted, 0: refused and step_next is smaller. */
static int try_adaptive(struct refdyn_drive *drive, double h, double t_new) {
    double error = INFINITY;
    int status = attempt(drive, h);
    if (!status) {
        error = error_norm(drive, h);
        if (error <= 1)
            status = complete(drive, t_new);
    }
    if (!status && error <= 1 && drive->options.singular == REFDYN_PASS &&
        refdyn_pass_was_crossed(drive, t_new))
        status = REFDYN_NO_CONVERGENCE;
    if (!status && error <= 1)
        status = arrive(drive, t_new, h);
    if (status) {
        drive->cause = status;
        drive->step_cap = cap_failed * h;
        drive->cap_growth = cap_growth;
        error = INFINITY;
    }
    if (error <= 1) {
        propose_after_accepted(drive, h, error);
        drive->cause = REFDYN_OK;
        return 1;
    }
    drive->statistics.rejected++;
    if (status == REFDYN_NOT_FINITE && refdyn_choose_after_failure(drive))
        return 0;
    propose_after_refused(drive, h, error);
    return 0;
}

int refdyn_step_limit_reached(const struct refdyn_drive *drive) {
    const struct refdyn_statistics *statistics = &drive->statistics;
    return drive->options.step_limit > 0 &&
           statistics->steps + statistics->rejected >= drive->options.step_limit;
}

static int step_adaptive(struct refdyn_drive *drive, double t_out, double t_stop, double t_bound) {
    double t_singular;
    if (drive->step_next <= 0)
        drive->step_next = find_first_step(drive, t_stop, t_out - drive->t_begin);
    if (drive->options.step_max > 0)
        drive->step_next = fmin(drive->step_next, drive->options.step_max);
    if (refdyn_pass(drive, drive->step_next, t_bound, &t_singular))
        return REFDYN_OK;
    /* no step but that one reaches beyond it */
    const double half_way = (t_singular - drive->t_begin) / 2,
                 t_near = fmin(t_stop, drive->t_begin + half_way);
    for (;;) {
        if (refdyn_step_limit_reached(drive))
            return REFDYN_TOO_MANY_STEPS;
        if (!(fmin(drive->step_next, half_way) >= refdyn_step_least(drive, t_out)))
            return REFDYN_STEP_TOO_SMALL;
        const double h = clip_step(drive, t_near);
        const double t_new = h == t_near - drive->t_begin ? t_near : drive->t_begin + h;
        if (try_adaptive(drive, h, t_new))
            return REFDYN_OK;
    }
}

/* A time that no step may pass, unless it has been passed. */
static double if_ahead(const struct refdyn_drive *drive, double t) {
    return t > drive->t_begin ? t : INFINITY;
}

int refdyn_advance(struct refdyn_drive *drive, double t_out) {
    int status = begin(drive);
    if (status)
        return status;
    if (refdyn_step_limit_reached(drive))
        return REFDYN_TOO_MANY_STEPS;
    const int is_fixed = drive->options.tol == 0;
    const double least = refdyn_step_least(drive, t_out),
                 ahead = refdyn_break_ahead(drive, is_fixed ? drive->options.step : drive->step_next, t_out);
    double bound = fmin(if_ahead(drive, drive->t_most), if_ahead(drive, drive->t_final));
    const double t_bound = fmin(bound, ahead);
    if (is_fixed || refdyn_method_facts(drive->method).collocation)
        bound = bound > t_out + least
                    ? t_out
                    : bound; /* between the ends of collocation's steps a state has a lower order */
    const double t_stop = ahead < bound - least ? ahead : bound;
    return is_fixed ? step_fixed(drive, t_stop, t_bound) : step_adaptive(drive, t_out, t_stop, t_bound);
}
