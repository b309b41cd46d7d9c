/*
 * One accepted step of a motion: tried, brought onto the programme, judged.
 *
 * Takes the state at the end of the last step; gives the next one. How long it is, step_control.c tells, and
 * by which method, automatic_method.c; it ends at the next time event or event of the state, and leads
 * through singular states by singular_crossing.c.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

static const double crossing_reach = 8, crossing_reach_fixed = 4; /* steps ahead, in which a state where the
                                                                   rows lose rank is looked for */

void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t) {
    motion->failure = (struct refdyn_failure){cause, t};
}

/* ---- One step ---- */

int refdyn_attempt_prepare(struct refdyn_motion *motion) {
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

/* The end of the last step is the begin of the next one, on the right side of a time event. */
static void go_on_from_end(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    const double t = refdyn_events_right_of(&motion->events, step->t_end);
    motion->state_events.looks_again |= t != step->t_end;
    refdyn_step_next(step, t);
    refdyn_linear_leave_begin(&motion->linear);
}

/* Events of the state that are due happen first. */
static int begin(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    refdyn_crossing_leave(motion);
    refdyn_fading_leave(motion);
    if (step->t_begin != step->t_end)
        go_on_from_end(motion);
    int status = motion->rows_change ? refdyn_rows_take_new(motion) : REFDYN_OK;
    if (!status)
        status = refdyn_event_actions_take(motion);
    if (status) {
        refdyn_motion_failed(motion, status, step->t_begin);
        return status;
    }
    refdyn_automatic_take_up(motion);
    return REFDYN_OK;
}

/* Far off the programme: the fault is at a row, and at a coordinate or none. */
static int is_far_off(struct refdyn_motion *motion, int row, int coordinate) {
    motion->work->fault = (struct refdyn_fault){.row = row, .coordinate = coordinate};
    return REFDYN_NO_CONVERGENCE;
}

/* Does a projection from `before` say that the step went wrong: near a singular position the nearest state on
 * the programme may lie on another branch. */
static int judge_projection(struct refdyn_motion *motion, const double *before, int row) {
    const struct refdyn_step *step = &motion->step;
    const int is_adaptive = motion->options.tol > 0;
    const double most = is_adaptive ? refdyn_programme_moved_most(step) : INFINITY;
    const double longest = fmax(step->t_end - step->t_begin, motion->statistics.step_largest);
    for (int j = 0; j < step->n; j++)
        if (!(fabs(step->state_new[j] - before[j]) <= most * step->units[j]))
            return is_far_off(motion, row, j);
    if (is_adaptive && refdyn_programme_moves_velocities(step, before, step->state_new, longest))
        return is_far_off(motion, row, -1);
    return REFDYN_OK;
}

/* The new state onto the programme; step->side: the state before. */
static int meet_programme_nearby(struct refdyn_motion *motion, double t_new) {
    struct refdyn_step *step = &motion->step;
    const int row = refdyn_residuals(motion->work).phi_row;
    memcpy(step->side, step->state_new, (size_t)(2 * step->n) * sizeof(double));
    const int status = refdyn_programme_meet(&motion->programme, step, t_new, step->state_new);
    if (status)
        return status;
    if (motion->crossing.is_on)
        return refdyn_crossing_follow(motion, step->side, step->state_new);
    return judge_projection(motion, step->side, row);
}

/* Row terms, and projection where that is asked for; *is_known: rates_new are those of the state. */
static int meet_end(struct refdyn_motion *motion, double t, int *is_known) {
    struct refdyn_step *step = &motion->step;
    const int is_projected =
        motion->work->m > 0 && (motion->options.stabilise == REFDYN_PROJECT || motion->crossing.is_on);
    *is_known = step->is_met || (step->has_rates_new && step->t_end < step->t_limit);
    if (step->is_met)
        return is_projected ? judge_projection(motion, step->side, step->met_row) : REFDYN_OK;
    int status = refdyn_row_terms(motion->work, t, step->state_new, step->state_new + step->n);
    if (status || !is_projected)
        return status;
    status = meet_programme_nearby(motion, t);
    *is_known =
        *is_known && memcmp(step->side, step->state_new, (size_t)(2 * step->n) * sizeof *step->side) == 0;
    return status;
}

/* The end of a step on the programme, its partition, rates and work. */
static int complete(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    refdyn_state_events_end_before_kinks(&motion->state_events, step);
    refdyn_rows_look_at_end(motion);
    const double t = refdyn_rows_side_of(motion, step->t_end);
    int is_known, status = meet_end(motion, t, &is_known);
    work->partition.rank_most = work->m;
    if (!status)
        status = refdyn_partition_watch(work, t, step->state_new, step->state_new + step->n);
    work->partition.rank_most = work->partition.rank;
    if (!status && refdyn_fading_lost_rows(motion)) {
        status = REFDYN_ROWS_INCONSISTENT;
        refdyn_fading_refuse(motion);
    }
    if (!status && step->is_met)
        work->evaluations++; /* whoever took the step has evaluated them */
    if (!status && !is_known)
        status = refdyn_rates(&step->evaluation, t, step->state_new, step->rates_new);
    work->partition.rank_most = work->partition.rank;
    if (status) {
        refdyn_motion_failed(motion, status, step->t_end);
        motion->rows_change = 0;
    }
    return status;
}

/* Where an event of the state wants a step to end that was completed; see refdyn_state_events_look. */
static int look_for_events(struct refdyn_motion *motion, double t_out, double *t_event) {
    struct refdyn_step *step = &motion->step;
    const int status = refdyn_state_events_look(&motion->state_events, step,
                                                refdyn_control_least(step->t_begin, t_out), t_event);
    if (status)
        refdyn_motion_failed(motion, status, step->t_end);
    if (isfinite(*t_event))
        refdyn_statistics_rejected(&motion->statistics, 1);
    return status;
}

/* A step whose error is too large may have met a kink or an event: it better ends there, *t_event, than at a
 * part of its length. */
static void look_for_causes(struct refdyn_motion *motion, double t_out, double *t_event) {
    struct refdyn_step *step = &motion->step;
    int status = REFDYN_OK;
    if (motion->state_events.count == 0)
        return;
    if (!step->has_rates_new)
        status = refdyn_rates(&step->evaluation, refdyn_step_inside(step, step->t_end), step->state_new,
                              step->rates_new);
    if (!status)
        refdyn_state_events_look_early(&motion->state_events, step,
                                       refdyn_control_least(step->t_begin, t_out), t_event);
    if (isfinite(*t_event))
        refdyn_statistics_rejected(&motion->statistics, 1);
}

/* A step that could not be projected onto its rows may have met a kink at which they turn. It should then end
 * at the kink. */
static int look_for_kinks(struct refdyn_motion *motion, double t_out, int status, double *t_event) {
    struct refdyn_step *step = &motion->step;
    if (status != REFDYN_NO_CONVERGENCE || motion->work->model->kink_count == 0 ||
        motion->options.stabilise != REFDYN_PROJECT)
        return status;
    memcpy(step->state_new, step->side, (size_t)(2 * step->n) * sizeof(double));
    look_for_causes(motion, t_out, t_event);
    return isfinite(*t_event) ? REFDYN_OK : status;
}

/* The step is accepted. */
static int arrive(struct refdyn_motion *motion, double h) {
    struct refdyn_step *step = &motion->step;
    refdyn_statistics_step(&motion->statistics, motion->work, h);
    refdyn_statistics_method(&motion->statistics, step->number);
    refdyn_automatic_after_step(motion);
    return motion->options.balance && step->method->kind->leaves_out_work
               ? refdyn_find_work_done(step, 1, step->state_new + 2 * step->n)
               : REFDYN_OK;
}

static int take(struct refdyn_motion *motion, double t_new, double h) {
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options, h);
    return refdyn_step_take(&motion->step, t_new, h);
}

static int attempt(struct refdyn_motion *motion, double t_new, double h) {
    const int status = take(motion, t_new, h);
    if (status)
        refdyn_motion_failed(motion, status, motion->step.failed_t);
    return status;
}

/* ---- Through a state where the rows lose rank ---- */

/* Such a step has no shorter one beside it: it may meet no event. */
static int leave_out_events(struct refdyn_motion *motion) {
    double t_event;
    const int status = look_for_events(motion, motion->step.t_end, &t_event);
    return status ? status : isfinite(t_event) ? REFDYN_NO_CONVERGENCE : REFDYN_OK;
}

/* One attempt, from t_begin to t_new. */
static int attempt_crossing(struct refdyn_motion *motion, double t_new) {
    const double h = t_new - motion->step.t_begin;
    double error;
    int status = refdyn_crossing_enter(motion);
    if (!status)
        status = attempt(motion, t_new, h);
    if (!status)
        status = refdyn_crossing_judge(motion, &error);
    if (status)
        return status;
    refdyn_crossing_look_back(motion);
    status = complete(motion);
    if (!status)
        status = leave_out_events(motion);
    if (!status)
        status = arrive(motion, h);
    if (!status)
        refdyn_crossing_record(motion, error);
    return status;
}

int refdyn_pass_singular(struct refdyn_motion *motion, double h, double t_bound, double *t) {
    struct refdyn_partition *partition = &motion->work->partition;
    const struct refdyn_options *options = &motion->options;
    const int is_fixed = options->tol == 0, rank = partition->rank;
    const double reach = (is_fixed ? crossing_reach_fixed : crossing_reach) * h;
    *t = INFINITY;
    if (options->singular != REFDYN_PASS || !refdyn_crossing_is_ahead(motion, reach, t))
        return 0;
    if (refdyn_crossing_is_vain(motion, *t))
        return 0;
    const double t_new = refdyn_crossing_end(motion, *t, t_bound);
    if (!is_fixed && options->step_max > 0 && isfinite(t_new) &&
        t_new - motion->step.t_begin > options->step_max)
        return 0;
    const int status = isfinite(t_new) ? attempt_crossing(motion, t_new) : REFDYN_NO_CONVERGENCE;
    if (!status)
        return 1;
    refdyn_motion_failed(motion, status, motion->failure.t);
    refdyn_crossing_refuse(motion, t_new);
    partition->rank_most = rank;
    refdyn_statistics_rejected(&motion->statistics, 1);
    return 0;
}

/* ---- To a time event where rows have faded out ---- */

/* One attempt, from t_begin to t. */
static int attempt_fading(struct refdyn_motion *motion, double t) {
    const double h = t - motion->step.t_begin;
    refdyn_fading_enter(motion);
    int status = attempt(motion, t, h);
    if (!status)
        status = refdyn_fading_judge(motion);
    if (!status)
        status = refdyn_row_terms(motion->work, refdyn_rows_side_of(motion, t), motion->step.state_new,
                                  motion->step.state_new + motion->step.n);
    if (status)
        return status;
    refdyn_statistics_step(&motion->statistics, motion->work, h);
    refdyn_statistics_method(&motion->statistics, motion->step.number);
    return REFDYN_OK;
}

/* Do rows fade out towards the time event at t_event, near enough for steps of h? 1: the step to there was
 * taken. Else *t is t_event where no other step should go more than half of the way, INFINITY where it may.
 */
static int meet_fading(struct refdyn_motion *motion, double h, double t_event, double *t) {
    *t = INFINITY;
    if (motion->work->m == 0 || !refdyn_fading_is_due(motion, h, t_event) ||
        !refdyn_fading_is_ahead(motion, t_event))
        return 0;
    const int status = attempt_fading(motion, t_event);
    if (!status)
        return 1;
    refdyn_motion_failed(motion, status, t_event);
    refdyn_statistics_rejected(&motion->statistics, 1);
    if (!refdyn_fading_refuse(motion))
        *t = motion->step.t_begin;
    else if (2 * h > t_event - motion->step.t_begin)
        *t = t_event;
    return 0;
}

/* ---- Fixed steps ---- */

/* To t_new, or to an event of the state before. */
static int take_fixed(struct refdyn_motion *motion, double t_new, double h, double t_out) {
    double t_event = t_new;
    int status = REFDYN_OK;
    while (!status && isfinite(t_event) && t_event > motion->step.t_begin) {
        const double length = t_event == t_new ? h : t_event - motion->step.t_begin;
        status = attempt(motion, t_event, length);
        if (!status)
            status = complete(motion);
        if (!status)
            status = look_for_events(motion, t_out, &t_event);
        if (!status && !isfinite(t_event))
            status = arrive(motion, length);
    }
    return status;
}

static int step_fixed(struct refdyn_motion *motion, double t_out, double t_bound, double t_event) {
    struct refdyn_step_control *control = &motion->control;
    double t_singular, t_new;
    int status = refdyn_control_plan(control, motion->options.step, motion->step.t_begin, t_out);
    if (status)
        return status;
    const double h = refdyn_control_fixed(control, &t_new);
    if (meet_fading(motion, h, t_event, &t_singular) ||
        (!isfinite(t_singular) && refdyn_pass_singular(motion, h, t_bound, &t_singular))) {
        refdyn_control_leave_interval(control);
        return REFDYN_OK;
    }
    if (t_singular <= t_new + h / 2) {
        refdyn_motion_failed(motion, motion->failure.cause, t_singular);
        return motion->failure.cause;
    }
    status = take_fixed(motion, t_new, h, t_out);
    if (!status && motion->step.t_end == t_new)
        refdyn_control_fixed_done(control);
    else
        refdyn_control_leave_interval(control);
    return status;
}

/* ---- Adaptive steps ---- */

/* Friction and kinks cut steps short, but an error of a velocity lasts: it counts over the longest of the
 * steps, not over this one. */
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

/* What was attempted; *error: in tolerances, INFINITY where it could not be evaluated. The step is accepted
 * when it is at most 1, and no event wants it to end at *t_event, which then is finite. */
static int find_error(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int status, double *error,
                      double *t_event) {
    *error = *t_event = INFINITY;
    if (status) {
        refdyn_motion_failed(motion, status, motion->step.failed_t);
        return status;
    }
    if (!attempt->is_measured)
        refdyn_attempt_measured(motion, attempt, refdyn_step_largest_error(&motion->step, attempt->h));
    *error = attempt->size;
    if (!(*error <= 1)) {
        look_for_causes(motion, attempt->t_out, t_event);
        return REFDYN_OK;
    }
    const int rank = motion->work->partition.rank;
    status = complete(motion);
    if (status)
        return look_for_kinks(motion, attempt->t_out, status, t_event);
    /* where the rank has grown the step began in such a state */
    if (motion->options.singular == REFDYN_PASS && motion->work->partition.rank <= rank &&
        refdyn_crossing_was_missed(motion)) {
        refdyn_motion_failed(motion, REFDYN_NO_CONVERGENCE, motion->crossing.t);
        return REFDYN_NO_CONVERGENCE;
    }
    status = look_for_events(motion, attempt->t_out, t_event);
    return status || isfinite(*t_event) ? status : arrive(motion, attempt->h);
}

void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken) {
    double error, t_event;
    const int status = find_error(motion, attempt, taken, &error, &t_event);
    if (!status && isfinite(t_event)) { /* at the begin there is no step to take */
        attempt->t_near = t_event;
        attempt->is_over = t_event == motion->step.t_begin;
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

/* The first attempt, or a state where the rows lose rank is passed. */
static void begin_adaptive(struct refdyn_motion *motion, double t_stop, double t_bound, double t_event,
                           struct refdyn_attempt *attempt) {
    const double t_begin = motion->step.t_begin;
    struct refdyn_step_control *control = &motion->control;
    double t_singular;
    refdyn_control_find(control, &motion->step, t_stop, attempt->t_out - t_begin);
    if (motion->options.step_max > 0)
        refdyn_control_bound(control, motion->options.step_max);
    attempt->is_over =
        meet_fading(motion, control->next, t_event, &t_singular) ||
        (!isfinite(t_singular) && refdyn_pass_singular(motion, control->next, t_bound, &t_singular));
    /* no step but that one reaches beyond it */
    attempt->half_way = (t_singular - t_begin) / 2;
    attempt->t_near = fmin(t_stop, t_begin + attempt->half_way);
}

int refdyn_attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt) {
    const struct refdyn_step_control *control = &motion->control;
    const double t_begin = motion->step.t_begin;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    if (!(fmin(control->next, attempt->half_way) >= refdyn_control_least(t_begin, attempt->t_out)))
        return REFDYN_STEP_TOO_SMALL;
    attempt->is_measured = 0;
    attempt->h = refdyn_control_clip(control, t_begin, attempt->t_near);
    attempt->t_new = attempt->h == attempt->t_near - t_begin ? attempt->t_near : t_begin + attempt->h;
    return REFDYN_OK;
}

double refdyn_motion_resolution(const struct refdyn_motion *motion, double t) {
    return fmax(refdyn_time_resolution(t),
                isfinite(motion->t_final) ? refdyn_time_resolution(motion->t_final) : 0);
}

/* A time that no step may pass, unless it has been passed, or is that of its begin but for rounding. */
static double if_ahead(const struct refdyn_motion *motion, double t) {
    return t > motion->step.t_begin + refdyn_motion_resolution(motion, t) ? t : INFINITY;
}

double refdyn_motion_bound(const struct refdyn_motion *motion) {
    return fmin(if_ahead(motion, motion->t_most), if_ahead(motion, motion->t_final));
}

int refdyn_attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt) {
    *attempt = (struct refdyn_attempt){.t_out = t_out};
    const int status = begin(motion);
    if (status)
        return status;
    attempt->is_over = motion->state_events.due_named > 0;
    if (attempt->is_over)
        return REFDYN_OK;
    if (refdyn_step_limit_reached(motion))
        return REFDYN_TOO_MANY_STEPS;
    const int is_fixed = motion->options.tol == 0;
    const double least = refdyn_control_least(motion->step.t_begin, t_out);
    refdyn_control_drop(&motion->control, least);
    const struct refdyn_reach reach = {is_fixed ? motion->options.step : motion->control.next, t_out,
                                       motion->t_final, least};
    const double ahead = refdyn_events_ahead(&motion->events, &motion->step, &reach);
    double bound = refdyn_motion_bound(motion);
    const double t_bound = fmin(bound, ahead), t_event = ahead < bound ? ahead : INFINITY;
    if ((is_fixed || motion->step.method->kind->ends_at_outputs) && bound > t_out + least)
        bound = t_out;
    const double t_stop = ahead < bound - least ? ahead : bound;
    attempt->is_over = is_fixed;
    if (is_fixed)
        return step_fixed(motion, t_stop, t_bound, t_event);
    begin_adaptive(motion, t_stop, t_bound, t_event, attempt);
    return REFDYN_OK;
}

int refdyn_attempt_take(struct refdyn_motion *motion, const struct refdyn_attempt *attempt) {
    return take(motion, attempt->t_new, attempt->h);
}

int refdyn_accept_step(struct refdyn_motion *motion, double t_out) {
    struct refdyn_attempt attempt;
    int status = refdyn_attempt_begin(motion, t_out, &attempt);
    while (!status && !attempt.is_over) {
        status = refdyn_attempt_prepare(motion);
        if (!status)
            status = refdyn_attempt_plan(motion, &attempt);
        if (!status)
            refdyn_attempt_judge(motion, &attempt, refdyn_attempt_take(motion, &attempt));
    }
    return status;
}
