/*
 * One accepted step of a motion: the obstacles ahead of it, its attempts, and the judgement of their errors.
 *
 * In: the state at the end of the last step, and the time that the caller asks for. Out: the next accepted
 * state. step_control.c chooses the length of the step, automatic_method.c its method.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

/* clang-format off */
/*
 * Obstacles ahead: what an ordinary step may not pass.
 *
 * The list `kinds` below has one entry for each kind of obstacle:
 *
 *   kind            its time                           how a step meets it                   what happens there
 *   bound           end of the motion, caller's limit  an ordinary step ends there           the caller changes values
 *   output          what the caller asks for           an ordinary step ends there           the caller reads the state
 *   fading rows     the next time event, if rows fade  one step of gauss12 ends there        the former method continues
 *                   out towards it
 *   singular state  where the rows lose rank           one step of rk8 passes it             the former method continues
 *   time event      known, or where a formula of time  an ordinary step ends there, on its   rows come, go or jump
 *                   changes its sign                   left side
 *   state event     zero of a value in a step that     the step is taken again to there,     actions, impacts, contacts
 *                   was taken                          until its end lies on the zero
 *
 * The nearest obstacle wins. Of those that are nearer to each other than the shortest step, the first in the list wins. A special
 * step that fails leaves its obstacle ahead: an ordinary step then covers at most half of the way to it, and the special step is
 * tried again from there.
 *
 * A new kind of obstacle is one file with some of these functions, and one entry in the list:
 *
 *   start   a motion begins
 *   find    the time of the obstacle; INFINITY: an ordinary step of ahead->h meets none. With `step`, a special step is to be tried
 *   step    takes the special step. Returns 1 if that was done. Otherwise *t is the obstacle that remains ahead, or INFINITY if
 *           ordinary steps may continue after all
 *   seen    an ordinary step is good: *t is where a shorter one has to end, to meet the obstacle; t_begin: no step may be taken;
 *           INFINITY: nowhere. An error refuses the step
 *   cause   an ordinary step was refused, with this status if its end could not be completed, or else for its error: the time of an
 *           obstacle that may have caused this, where a shorter step should end; INFINITY: none
 *   leave   before the next step begins: what happens where the last one ended
 *
 * Kinds without `step` are found first, so that special steps can respect `bound` and `time_event` of struct refdyn_ahead. What a
 * kind keeps between steps is a struct of its own in struct refdyn_motion. One check is not in the list: attempt.c asks at
 * the end of each step whether fading rows were lost, before it evaluates the rates there.
 */
/* clang-format on */
struct kind {
    void (*start)(struct refdyn_motion *motion);
    double (*find)(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
    int (*step)(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
    int (*seen)(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
    double (*cause)(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);
    int (*leave)(struct refdyn_motion *motion);
};

/* ---- Bounds and outputs ---- */

double refdyn_motion_resolution(const struct refdyn_motion *motion, double t) {
    return fmax(refdyn_time_resolution(t),
                isfinite(motion->t_final) ? refdyn_time_resolution(motion->t_final) : 0);
}

/* INFINITY if the step begins at t within rounding, or later. */
static double if_ahead(const struct refdyn_motion *motion, double t) {
    return t > motion->step.t_begin + refdyn_motion_resolution(motion, t) ? t : INFINITY;
}

double refdyn_motion_bound(const struct refdyn_motion *motion) {
    return fmin(if_ahead(motion, motion->t_most), if_ahead(motion, motion->t_final));
}

static double find_bound(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    ahead->bound = refdyn_motion_bound(motion);
    return ahead->bound;
}

/* Adaptive steps of most methods reach beyond outputs, where their interpolants provide the state. */
static double find_output(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    const int is_met = motion->options.tol == 0 || motion->step.method->kind->ends_at_outputs;
    return is_met ? ahead->t_out : INFINITY;
}

/* ---- The list ---- */

static const struct kind kinds[] = {
    {.find = find_bound},
    {.find = find_output},
    {.start = refdyn_fading_start, .find = refdyn_fading_find, .step = refdyn_fading_step},
    {.start = refdyn_crossing_start,
     .find = refdyn_crossing_find,
     .step = refdyn_crossing_step,
     .seen = refdyn_crossing_seen},
    {.find = refdyn_time_events_find, .leave = refdyn_rows_take_new},
    {.seen = refdyn_state_events_seen,
     .cause = refdyn_state_events_cause,
     .leave = refdyn_event_actions_take},
};
static const struct kind *const kinds_end = kinds + sizeof kinds / sizeof *kinds;

void refdyn_obstacles_start(struct refdyn_motion *motion) {
    for (const struct kind *kind = kinds; kind < kinds_end; kind++)
        if (kind->start)
            kind->start(motion);
}

static int obstacles_leave(struct refdyn_motion *motion) {
    int status = REFDYN_OK;
    for (const struct kind *kind = kinds; kind < kinds_end && !status; kind++)
        if (kind->leave)
            status = kind->leave(motion);
    return status;
}

static void obstacles_find(struct refdyn_motion *motion, double t_out, struct refdyn_ahead *ahead) {
    *ahead = (struct refdyn_ahead){
        .t_out = t_out, .bound = INFINITY, .time_event = INFINITY, .seen = refdyn_obstacles_seen};
    ahead->h = motion->options.tol > 0 ? motion->control.next : motion->options.step;
    ahead->least = refdyn_control_least(motion->step.t_begin, t_out);
    ahead->stop = ahead->remaining = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end; kind++) {
        const double t = kind->find && !kind->step ? kind->find(motion, ahead) : INFINITY;
        ahead->stop = t < ahead->stop - ahead->least ? t : ahead->stop;
    }
}

static int obstacles_step(struct refdyn_motion *motion, double h, struct refdyn_ahead *ahead) {
    ahead->h = h;
    for (const struct kind *kind = kinds; kind < kinds_end && !isfinite(ahead->remaining); kind++) {
        double t = kind->step ? kind->find(motion, ahead) : INFINITY;
        if (isfinite(t) && kind->step(motion, ahead, &t))
            return 1;
        ahead->remaining = t;
    }
    ahead->stop = fmin(ahead->stop, motion->step.t_begin + refdyn_ahead_longest(motion, ahead));
    return 0;
}

int refdyn_obstacles_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    int status = REFDYN_OK;
    *t = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end && !status && !isfinite(*t); kind++)
        if (kind->seen)
            status = kind->seen(motion, ahead, t);
    refdyn_statistics_rejected(&motion->statistics, isfinite(*t));
    return status;
}

static double obstacles_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status) {
    double t = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end && !isfinite(t); kind++)
        if (kind->cause)
            t = kind->cause(motion, ahead, status);
    refdyn_statistics_rejected(&motion->statistics, isfinite(t));
    return t;
}

/* ---- One step ---- */

/* The tangent at the begin, which the steps of some methods need. If there is none, the automatic method
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

/* The end of the last step becomes the begin of the next one, on the right side of a time event. */
static void go_on_from_end(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    const double t = refdyn_time_events_right_of(&motion->time_events, step->t_end);
    if (t != step->t_end)
        refdyn_state_events_look_again(&motion->state_events);
    refdyn_step_next(step, t);
    refdyn_linear_leave_begin(&motion->linear);
}

/* What happens at the obstacle where the last step ended comes first. */
static int begin(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    refdyn_special_step_end(motion);
    if (step->t_begin != step->t_end)
        go_on_from_end(motion);
    const int status = obstacles_leave(motion);
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
        status = refdyn_motion_try(motion, t, length);
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
    if (obstacles_step(motion, h, ahead)) {
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

void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error) {
    attempt->size = error / refdyn_automatic_tolerance(motion) * lasting_share(motion, attempt->h);
    attempt->is_measured = 1;
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
        refdyn_attempt_measured(motion, attempt, refdyn_step_largest_error(&motion->step, attempt->h));
    *error = attempt->size;
    attempt->ahead.rank = motion->work->partition.rank;
    const int is_good = *error <= 1;
    if (is_good)
        status = refdyn_motion_complete(motion);
    if (!is_good || status) {
        *t = obstacles_cause(motion, &attempt->ahead, status);
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
        return;
    }
    refdyn_statistics_rejected(&motion->statistics, 1);
    if (status) {
        refdyn_motion_failed(motion, status, motion->failure.t);
        refdyn_control_failed(&motion->control, attempt->h);
        if (status == REFDYN_NOT_FINITE && refdyn_automatic_after_failure(motion))
            return;
    }
    refdyn_control_refused(&motion->control, motion->step.method, attempt->h, status ? INFINITY : error);
}

int refdyn_step_limit_reached(const struct refdyn_motion *motion) {
    const struct refdyn_statistics *statistics = &motion->statistics;
    return motion->options.step_limit > 0 &&
           statistics->steps + statistics->rejected >= motion->options.step_limit;
}

/* Proposes the first attempt, or takes a special step. */
static void begin_adaptive(struct refdyn_motion *motion, struct refdyn_attempt *attempt) {
    struct refdyn_ahead *ahead = &attempt->ahead;
    struct refdyn_step_control *control = &motion->control;
    refdyn_control_find(control, &motion->step, ahead->stop, ahead->t_out - motion->step.t_begin);
    if (motion->options.step_max > 0)
        refdyn_control_bound(control, motion->options.step_max);
    attempt->is_over = obstacles_step(motion, control->next, ahead);
}

static int attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt) {
    const struct refdyn_step_control *control = &motion->control;
    const struct refdyn_ahead *ahead = &attempt->ahead;
    const double t_begin = motion->step.t_begin;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    if (!(fmin(control->next, refdyn_ahead_longest(motion, ahead)) >= ahead->least))
        return REFDYN_STEP_TOO_SMALL;
    attempt->is_measured = 0;
    attempt->h = refdyn_control_clip(control, t_begin, ahead->stop);
    attempt->t_new = attempt->h == ahead->stop - t_begin ? ahead->stop : t_begin + attempt->h;
    return REFDYN_OK;
}

/* The step is over already where events are due at its begin, and after fixed and special steps. */
static int attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt) {
    *attempt = (struct refdyn_attempt){.is_over = 0};
    const int status = begin(motion);
    if (status)
        return status;
    attempt->is_over = motion->state_events.due_named > 0;
    if (attempt->is_over)
        return REFDYN_OK;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    refdyn_control_drop(&motion->control, refdyn_control_least(motion->step.t_begin, t_out));
    obstacles_find(motion, t_out, &attempt->ahead);
    attempt->is_over = motion->options.tol == 0;
    if (attempt->is_over)
        return step_fixed(motion, &attempt->ahead);
    begin_adaptive(motion, attempt);
    return REFDYN_OK;
}

/* May a batch take the step, by the method alone, with the parameters as they are? */
static int may_be_taken_beside(const struct refdyn_motion *motion, const struct refdyn_attempt *attempt) {
    return !attempt->is_left && !motion->step.guide && !motion->options.balance &&
           motion->options.gain_share == 0 && motion->state_events.named == 0;
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
    return status;
}
