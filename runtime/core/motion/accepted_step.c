/*
 * One accepted step of a motion: its attempts, and the judgement of their errors.
 *
 * In: the state at the end of the last step, and the time that the caller asks for. Out: the next accepted
 * state. step_control.c chooses the length of the step, automatic_method.c its method.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

/* ---- One step ---- */

/* The tangent at the beginning, which the steps of some methods need. If there is none, the automatic method
 * continues with another one. */
static int attempt_prepare(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    if (!step->method->kind->begins_by_tangent)
        return REFDYN_OK;
    const int status =
        refdyn_linear_at_begin(&motion->linear, motion->work, step->t_begin, step->state, step->rates);
    if (!status || refdyn_automatic_after_failure(motion))
        return REFDYN_OK;
    refdyn_motion_failed(motion, status, step->t_begin);
    return status;
}

/* The end of the last step becomes the beginning of the next one, on the right side of a time event. */
static void go_on_from_end(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    const double t = refdyn_time_events_right_of(&motion->time_events, step->t_end);
    if (t != step->t_end)
        refdyn_state_events_look_again(&motion->state_events, step, refdyn_step_inside(step, step->t_end),
                                       step->state_new);
    refdyn_step_next(step, t);
    refdyn_linear_leave_begin(&motion->linear);
}

/* What happens at the obstacle where the last step ended comes first. */
static int begin(struct refdyn_motion *motion, double t_out) {
    struct refdyn_step *step = &motion->step;
    refdyn_special_step_end(motion);
    if (step->t_begin != step->t_end)
        go_on_from_end(motion);
    int status = refdyn_obstacles_leave(motion);
    if (!status)
        status = refdyn_idle_check(motion, t_out);
    if (status) {
        refdyn_motion_failed(motion, status, step->t_begin);
        return status;
    }
    refdyn_automatic_take_up(motion);
    return REFDYN_OK;
}

/* ---- Fixed steps ---- */

/* To t_new, or to an obstacle that is seen in the step: then it is taken again to there. */
static int take_fixed(struct refdyn_motion *motion, double t_new, double h,
                      const struct refdyn_ahead *ahead) {
    double t = t_new;
    int status = REFDYN_OK;
    while (!status && isfinite(t) && t > motion->step.t_begin) {
        const double length = t == t_new ? h : t - motion->step.t_begin;
        status =
            refdyn_step_limit_reached(motion) ? REFDYN_TOO_MANY_STEPS : refdyn_motion_try(motion, t, length);
        if (!status)
            status = refdyn_motion_complete(motion);
        if (!status)
            status = refdyn_obstacles_seen(motion, ahead, &t);
        if (!status && !isfinite(t))
            status = refdyn_motion_accept(motion, length);
    }
    return status;
}

static int step_fixed(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    struct refdyn_step_control *control = &motion->control;
    double t_new;
    int status = refdyn_control_plan(control, motion->options.step, motion->step.t_begin, ahead->stop);
    if (status)
        return status;
    const double h = refdyn_control_fixed(control, &t_new);
    if (refdyn_obstacles_step(motion, h, ahead)) {
        refdyn_control_leave_interval(control);
        return REFDYN_OK;
    }
    if (ahead->remaining <= t_new + h / 2) {
        refdyn_motion_failed(motion, motion->failure.cause, ahead->remaining);
        return motion->failure.cause;
    }
    status = take_fixed(motion, t_new, h, ahead);
    if (!status && motion->step.t_end == t_new)
        refdyn_control_fixed_done(control);
    else
        refdyn_control_leave_interval(control);
    return status;
}

/* ---- Adaptive steps ---- */

/* Friction and kinks cut steps short, but an error of a velocity lasts: it counts over the longest step, not
 * over this one. */
static double lasting_share(const struct refdyn_motion *motion, double h) {
    const struct refdyn_model *model = motion->work->model;
    const int has_short_steps = model->saturates || model->kink_count > 0;
    return has_short_steps ? fmax(1, motion->statistics.step_largest / h) : 1;
}

double refdyn_attempt_span(const struct refdyn_motion *motion, double h) {
    return h * lasting_share(motion, h);
}

void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error) {
    attempt->size = refdyn_repeats(motion)
                        ? 0
                        : error / refdyn_automatic_tolerance(motion) * lasting_share(motion, attempt->h);
    attempt->is_measured = 1;
}

/* The error of rates, accelerations and forces of a completed step, in tolerances, as far as it counts. */
static double error_of_rates(struct refdyn_motion *motion, double h, double error) {
    const double tolerance = motion->options.tol_rates;
    return tolerance > 0 ? refdyn_rate_errors_measure(motion, h, tolerance)
                         : refdyn_automatic_error_of_rates(motion, h, error);
}

/* *error: of the step, in tolerances; INFINITY if it could not be evaluated. The step is accepted if it is at
 * most 1 and *t is INFINITY; a finite *t is an obstacle where the step has to end. */
static int find_error(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int status, double *error,
                      double *t) {
    *error = *t = INFINITY;
    if (status) {
        refdyn_motion_failed(motion, status, motion->step.failed_t);
        return status;
    }
    if (!attempt->is_measured)
        refdyn_attempt_measured(
            motion, attempt,
            refdyn_step_largest_error(&motion->step, attempt->h, refdyn_attempt_span(motion, attempt->h)));
    *error = attempt->size;
    attempt->ahead.rank = motion->work->partition.rank;
    if (*error <= 1)
        status = refdyn_motion_complete(motion);
    if (status && refdyn_repeats(motion))
        return status;
    if (*error <= 1 && !status && !refdyn_repeats(motion))
        *error = fmax(*error, error_of_rates(motion, attempt->h, *error));
    if (!(*error <= 1) || status) {
        *t = refdyn_obstacles_cause(motion, &attempt->ahead, status);
        return isfinite(*t) ? REFDYN_OK : status;
    }
    status = refdyn_obstacles_seen(motion, &attempt->ahead, t);
    return status || isfinite(*t) ? status : refdyn_motion_accept(motion, attempt->h);
}

void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken) {
    double error, t;
    const int status = find_error(motion, attempt, taken, &error, &t);
    if (!status && isfinite(t)) { /* at t_begin no step is possible */
        attempt->ahead.stop = t;
        attempt->is_over = t == motion->step.t_begin;
        return;
    }
    attempt->is_over = !status && error <= 1;
    if (attempt->is_over) {
        refdyn_control_accepted(&motion->control, motion->step.method, attempt->h, error);
        refdyn_motion_failed(motion, REFDYN_OK, motion->failure.t);
        refdyn_resolve_work(motion, error);
        return;
    }
    refdyn_statistics_rejected(&motion->statistics, 1);
    if (refdyn_repeats(motion)) {
        refdyn_repetition_fail(motion, status);
        return;
    }
    if (status) {
        refdyn_motion_failed(motion, status, motion->failure.t);
        refdyn_control_failed(&motion->control, attempt->h);
        if (status == REFDYN_NOT_FINITE && refdyn_automatic_after_failure(motion))
            return;
    }
    refdyn_control_refused(&motion->control, motion->step.method, attempt->h, status ? INFINITY : error);
}

/* Returns whether the steps tried last cover so little of the time that the motion would need more than
 * step_limit of them. */
static int is_too_slow(struct refdyn_motion *motion, long tried) {
    enum { TRIED = 10000 }; /* steps between two estimates: a transient at this pace is shorter */
    struct refdyn_pace *pace = &motion->pace;
    const double t = motion->step.t_begin, covered = t - pace->t;
    if (tried > 0 && tried < pace->tried + TRIED)
        return 0;
    *pace = (struct refdyn_pace){.t = t, .tried = tried};
    return tried > 0 && isfinite(motion->t_final) &&
           (double)tried + TRIED * ((motion->t_final - t) / covered) > (double)motion->options.step_limit;
}

int refdyn_step_limit_reached(struct refdyn_motion *motion) {
    const long tried = motion->statistics.steps + motion->statistics.rejected;
    return motion->options.step_limit > 0 &&
           (tried >= motion->options.step_limit || is_too_slow(motion, tried));
}

/* Proposes the first attempt, or takes a special step. */
static void begin_adaptive(struct refdyn_motion *motion, struct refdyn_attempt *attempt) {
    struct refdyn_ahead *ahead = &attempt->ahead;
    struct refdyn_step_control *control = &motion->control;
    refdyn_control_find(control, &motion->step, ahead->stop, ahead->t_out - motion->step.t_begin);
    if (motion->options.step_max > 0)
        refdyn_control_bound(control, motion->options.step_max);
    attempt->is_over = refdyn_obstacles_step(motion, control->next, ahead);
}

static int attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt) {
    const struct refdyn_step_control *control = &motion->control;
    const struct refdyn_ahead *ahead = &attempt->ahead;
    const double t_begin = motion->step.t_begin;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    if (motion->repetition.status)
        return motion->repetition.status;
    if (!refdyn_repeats(motion) &&
        !(fmin(control->next, refdyn_ahead_longest(motion, ahead)) >= ahead->least))
        return REFDYN_STEP_TOO_SMALL;
    attempt->is_measured = 0;
    attempt->h =
        refdyn_repeats(motion) ? ahead->stop - t_begin : refdyn_control_clip(control, t_begin, ahead->stop);
    attempt->t_new = attempt->h == ahead->stop - t_begin ? ahead->stop : t_begin + attempt->h;
    return REFDYN_OK;
}

/* The step is over already where events are due at its beginning, and after fixed and special steps. */
static int attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt) {
    *attempt = (struct refdyn_attempt){.is_over = 0};
    refdyn_kinks_guard(motion, 0);
    int status = refdyn_repetition_begin_step(motion);
    if (!status)
        status = begin(motion, t_out);
    if (status)
        return status;
    attempt->is_over = motion->state_events.due_named > 0;
    if (attempt->is_over)
        return REFDYN_OK;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    if (refdyn_repeats(motion))
        return refdyn_repetition_plan(motion, t_out, attempt);
    refdyn_control_drop(&motion->control, refdyn_control_least(motion->step.t_begin, t_out));
    refdyn_obstacles_find(motion, t_out, &attempt->ahead);
    attempt->is_over = motion->options.tol == 0;
    if (attempt->is_over)
        return step_fixed(motion, &attempt->ahead);
    begin_adaptive(motion, attempt);
    return REFDYN_OK;
}

/* May a batch take the step, by the method alone, with the parameters as they are? */
static int may_be_taken_beside(const struct refdyn_motion *motion, const struct refdyn_attempt *attempt) {
    return !attempt->is_left && !motion->step.guide && !motion->step.guard && !motion->options.balance &&
           motion->options.gain_share == 0 && motion->state_events.named == 0;
}

void refdyn_step_over(struct refdyn_motion *motion, const struct refdyn_attempt *attempt) {
    if (motion->watch)
        motion->watch->note(motion->watch->context, motion, &attempt->ahead);
    refdyn_repetition_end_step(motion);
}

int refdyn_accept_step(struct refdyn_motion *motion, double t_out, int may_halt,
                       struct refdyn_attempt *attempt) {
    int status = attempt->is_over ? attempt_begin(motion, t_out, attempt) : REFDYN_OK;
    while (!status && !attempt->is_over) {
        const int is_beside = may_halt && may_be_taken_beside(motion, attempt);
        if (!is_beside)
            status = attempt_prepare(motion);
        if (!status)
            status = attempt_plan(motion, attempt);
        if (!status && is_beside)
            return REFDYN_HALTED;
        if (!status)
            refdyn_attempt_judge(motion, attempt, refdyn_motion_take(motion, attempt->t_new, attempt->h));
        attempt->is_left = 0;
    }
    if (status) {
        attempt->is_over = 1;
        status = refdyn_sliding_resolve(motion, status, t_out);
    }
    if (!status)
        refdyn_step_over(motion, attempt);
    return status;
}
