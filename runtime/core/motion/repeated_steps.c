/*
 * Steps that copies of a motion repeat, so that differences of the copies are derivatives.
 *
 * In: a motion that chooses its steps, and the pattern made of them. Out: what the pattern needs of each
 * step; the same steps in a copy whose parameters, inputs or start differ slightly.
 *
 * Differences of motions that choose their own steps show the noise of these choices. A copy makes no choice:
 * number, methods and lengths of its steps are those of the recorded motion (internal numerical
 * differentiation: Bock, in Modelling of Chemical Reaction Systems, Springer 1981, 102-125). Waypoints are
 * the start, time events, state events, and steps that end at an output, a sample or the end. Steps
 * keep their fractions of the time between waypoints, because otherwise a step would see an event on its
 * wrong side. Each copy computes the times of its time events, and locates its state events.
 *
 * A stage may lie beyond a kink that its step does not pass, such as one just after its end. However short
 * the step is, derivatives would be wrong by the weight of this stage, above all by the width of a layer of
 * friction. So all stages of such a step keep the side on which it began: beyond the kink, rates continue
 * linearly. The recorded motion shows which steps these are, and copies take them alone, not in lanes.
 *
 * A copy that meets other events than its pattern ends with REFDYN_NO_DERIVATIVE when it is to take the next
 * step, so that outputs before these events are shown.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>

/* A step to a state event is longer than the recorded one by this part, so that it still contains the event.
 * The event is earlier on one side of the difference and later on the other, and in the motion itself as much
 * as stages have seen other sides of kinks. */
static const double beyond = 0.5;
/* An obstacle nearer to the planned end than this part of the step counts as that end. */
static const double same_part = 1e-9;
/* Tolerance at which the iterations of copies end: their errors are divided by small changes. */
static const double settled = 1e-11;

void refdyn_repetition_lay_out(struct refdyn_repetition *repetition, const struct refdyn_model *model,
                               struct layout *layout) {
    repetition->breaks = layout_doubles(layout, model->break_count);
}

void refdyn_repetition_clear(struct refdyn_motion *motion) {
    motion->repetition.pattern = NULL;
    motion->repetition.status = REFDYN_OK;
    motion->step.iterations = 0;
    refdyn_programme_hold(&motion->programme, 0);
}

void refdyn_repetition_start(struct refdyn_motion *motion, const struct refdyn_pattern *pattern,
                             double t_final) {
    struct refdyn_repetition *repetition = &motion->repetition;
    repetition->pattern = pattern;
    repetition->next = repetition->from = 0;
    repetition->to = -1;
    repetition->t_from = repetition->t_start = motion->step.t_begin;
    repetition->stretch = motion->t_final == t_final
                              ? 1
                              : (motion->t_final - repetition->t_start) / (t_final - repetition->t_start);
    repetition->is_additional = 0;
    motion->step.settled = settled;
    refdyn_automatic_leave(motion);
    if (motion->options.stabilise == REFDYN_PROJECT)
        refdyn_programme_hold(&motion->programme, 1);
    refdyn_programme_forget(&motion->programme);
}

/* ---- The recorded motion ---- */

int refdyn_pattern_breaks(const struct refdyn_motion *motion, double t, double *times, int *places) {
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    int count = 0;
    if (!work->model->breaks)
        return 0;
    work->model->breaks(work->p, work->x, t, step->state, step->state + step->n, times);
    for (int i = 0; i < work->model->break_count; i++)
        if (fabs(times[i] - t) <= refdyn_motion_resolution(motion, t))
            places[count++] = i;
    return count;
}

/* ---- Where a copy stands ---- */

static const struct refdyn_waypoint *waypoint_at(const struct refdyn_repetition *repetition, int i) {
    return &repetition->pattern->waypoints[i];
}

static const struct refdyn_repeated_step *next_of(const struct refdyn_repetition *repetition) {
    return &repetition->pattern->steps[repetition->next];
}

static int is_of_time(const struct refdyn_waypoint *waypoint) {
    return waypoint->is_fixed || waypoint->is_switch || waypoint->break_count > 0;
}

/* The copy's time for a time of the recorded motion in the next step. */
static double moved_time(const struct refdyn_repetition *repetition, double t) {
    const double from = waypoint_at(repetition, repetition->from)->t;
    if (repetition->to < 0)
        return repetition->t_from + (t - from);
    const double to = waypoint_at(repetition, repetition->to)->t;
    return repetition->t_from + (t - from) / (to - from) * (repetition->t_to - repetition->t_from);
}

/* Does the copy have the due events and kinks of the waypoint; -1: none? */
static int has_due(const struct refdyn_motion *motion, int waypoint) {
    const struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_waypoint *there = waypoint < 0 ? NULL : waypoint_at(repetition, waypoint);
    const int count = there ? there->due_count : 0;
    if (count != events->due_count)
        return 0;
    for (int k = 0; k < count; k++)
        if (events->due[k] != repetition->pattern->places[there->first_due + k])
            return 0;
    return 1;
}

static int differs(struct refdyn_motion *motion, double t) {
    motion->repetition.status = REFDYN_NO_DERIVATIVE;
    motion->repetition.t_failed = t;
    refdyn_motion_failed(motion, REFDYN_NO_DERIVATIVE, t);
    return REFDYN_NO_DERIVATIVE;
}

void refdyn_repetition_fail(struct refdyn_motion *motion, int status) {
    motion->repetition.status = status;
    motion->repetition.t_failed = motion->failure.t;
    refdyn_motion_failed(motion, status, motion->failure.t);
}

int refdyn_repetition_begin_step(struct refdyn_motion *motion) {
    const struct refdyn_repetition *repetition = &motion->repetition;
    if (!repetition->pattern)
        return REFDYN_OK;
    if (repetition->status)
        return repetition->status;
    return repetition->next > 0 || has_due(motion, 0) ? REFDYN_OK : differs(motion, motion->step.t_end);
}

void refdyn_repetition_end_step(struct refdyn_motion *motion) {
    struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_step *step = &motion->step;
    if (!repetition->pattern)
        return;
    if (repetition->is_additional) {
        repetition->is_additional = 0;
        if (!has_due(motion, -1))
            differs(motion, step->t_end);
        return;
    }
    if (repetition->next >= repetition->pattern->step_count) {
        differs(motion, step->t_end);
        return;
    }
    const struct refdyn_repeated_step *done = next_of(repetition);
    if (!has_due(motion, done->waypoint) || (step->t_end == step->t_begin) != done->is_empty) {
        const int is_missing = motion->state_events.due_count == 0;
        differs(motion, is_missing ? fmin(step->t_end, moved_time(repetition, done->t)) : step->t_end);
        return;
    }
    repetition->next++;
    if (done->waypoint >= 0) {
        repetition->from = done->waypoint;
        repetition->t_from = step->t_end;
        repetition->to = repetition->to == done->waypoint ? -1 : repetition->to;
    }
}

/* ---- Waypoints of time ---- */

/* Outputs and the end keep their fractions of the motion. */
static double fixed_time(const struct refdyn_repetition *repetition, const struct refdyn_waypoint *waypoint) {
    return repetition->stretch == 1
               ? waypoint->t
               : repetition->t_start + (waypoint->t - repetition->t_start) * repetition->stretch;
}

/* When this copy reaches a later waypoint: the earliest of the waypoint's times. */
static double own_time(struct refdyn_motion *motion, const struct refdyn_waypoint *waypoint) {
    struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    double t = waypoint->is_fixed ? fixed_time(repetition, waypoint) : INFINITY;
    if (waypoint->break_count > 0)
        work->model->breaks(work->p, work->x, step->t_begin, step->state, step->state + step->n,
                            repetition->breaks);
    for (int k = 0; k < waypoint->break_count; k++)
        t = fmin(t, repetition->breaks[repetition->pattern->places[waypoint->first_break + k]]);
    if (waypoint->is_switch)
        t = fmin(t, refdyn_time_events_near(motion, waypoint->t));
    return t;
}

/* Finds the next waypoint of time. Steps keep their fractions of the way to it. */
static void look_ahead(struct refdyn_motion *motion) {
    struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_pattern *pattern = repetition->pattern;
    if (repetition->to >= 0)
        return;
    for (int i = repetition->from + 1; i < pattern->waypoint_count && repetition->to < 0; i++)
        repetition->to = is_of_time(&pattern->waypoints[i]) ? i : -1;
    repetition->t_to =
        repetition->to >= 0 ? own_time(motion, waypoint_at(repetition, repetition->to)) : INFINITY;
}

/* A waypoint may have several times, such as two events that coincide in the recorded motion. Additional
 * steps reach those that are still ahead in this copy. INFINITY: there are none. */
static double find_additional(struct refdyn_motion *motion, double least) {
    struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_waypoint *there = waypoint_at(repetition, repetition->from);
    const double begin = motion->step.t_begin + least;
    double t = INFINITY;
    if (repetition->from == 0 || !is_of_time(there) || there->break_count + there->is_fixed < 2)
        return INFINITY;
    own_time(motion, there);
    for (int k = 0; k < there->break_count; k++) {
        const double moved = repetition->breaks[repetition->pattern->places[there->first_break + k]];
        t = moved > begin ? fmin(t, moved) : t;
    }
    const double fixed = fixed_time(repetition, there);
    return there->is_fixed && fixed > begin ? fmin(t, fixed) : t;
}

/* ---- The next step ---- */

/* The planned end of the next step. */
static double find_end(struct refdyn_motion *motion, const struct refdyn_repeated_step *next) {
    const struct refdyn_repetition *repetition = &motion->repetition;
    const int is_to_event = next->waypoint >= 0 && waypoint_at(repetition, next->waypoint)->due_count > 0;
    if (next->waypoint >= 0 && next->waypoint == repetition->to)
        return repetition->t_to;
    const double t = moved_time(repetition, next->t);
    return is_to_event ? t + beyond * (t - motion->step.t_begin) : t;
}

/* Is a time event, or the end of the motion, nearer than the planned end? A step to a state event may end
 * there, so that nothing is in its way. */
static int is_in_the_way(const struct refdyn_motion *motion, const struct refdyn_repeated_step *next,
                         const struct refdyn_ahead *ahead, double t) {
    const struct refdyn_repetition *repetition = &motion->repetition;
    const int is_to_event = next->waypoint >= 0 && waypoint_at(repetition, next->waypoint)->due_count > 0;
    return ahead->stop < t - same_part * (t - motion->step.t_begin) && !is_to_event;
}

static void use_method(struct refdyn_motion *motion, enum refdyn_method method) {
    if (motion->step.number != method)
        refdyn_automatic_change(motion, method);
}

/* The step to attempt. No step may lead away from an event that is due now, as an attempt shows. */
static const struct refdyn_repeated_step *find_attempt(const struct refdyn_repetition *repetition) {
    const struct refdyn_pattern *pattern = repetition->pattern;
    int next = repetition->next;
    while (pattern->steps[next].is_empty && next + 1 < pattern->step_count)
        next++;
    return &pattern->steps[next];
}

/* Finds what is ahead of a step of h. */
static void find_ahead(struct refdyn_motion *motion, double t_out, double h, struct refdyn_ahead *ahead) {
    refdyn_control_begin(&motion->control, h);
    refdyn_obstacles_find(motion, t_out, ahead);
}

int refdyn_repetition_plan(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt) {
    struct refdyn_repetition *repetition = &motion->repetition;
    struct refdyn_ahead *ahead = &attempt->ahead;
    const double t_begin = motion->step.t_begin;
    const double additional = find_additional(motion, refdyn_control_least(t_begin, t_out));
    motion->step.iterations = 0;
    if (isfinite(additional)) {
        repetition->is_additional = 1;
        repetition->t_from = additional;
        find_ahead(motion, t_out, additional - t_begin, ahead);
        ahead->stop = additional;
        return REFDYN_OK;
    }
    if (repetition->next >= repetition->pattern->step_count)
        return differs(motion, motion->step.t_end);
    look_ahead(motion);
    const struct refdyn_repeated_step *next = find_attempt(repetition);
    const double t = find_end(motion, next);
    if (next->is_empty || !(t - t_begin > refdyn_control_least(t_begin, t_out)))
        return differs(motion, motion->step.t_end);
    use_method(motion, next->method);
    motion->step.iterations = next->iterations;
    motion->step.keeps = next->keeps;
    const int leads_to_kink = next->waypoint >= 0 && waypoint_at(repetition, next->waypoint)->has_kinks;
    if ((leads_to_kink || next->sees_beyond) && !next->is_special)
        refdyn_kinks_guard(motion, 1);
    if (next->aligns)
        refdyn_programme_forget(&motion->programme);
    find_ahead(motion, t_out, (1 + beyond) * (t - t_begin), ahead);
    if (next->is_special) {
        attempt->is_over = refdyn_obstacles_step(motion, (1 + beyond) * (t - t_begin), ahead);
        return attempt->is_over ? REFDYN_OK : differs(motion, motion->step.t_end);
    }
    if (is_in_the_way(motion, next, ahead, t))
        return differs(motion, motion->step.t_end);
    if (!(fabs(ahead->stop - t) <= same_part * (t - t_begin)))
        ahead->stop = fmin(t, ahead->stop);
    return REFDYN_OK;
}
