/* clang-format off */
/*
 * Obstacles ahead of a motion: what an ordinary step may not pass.
 *
 * In: the state from which the next step begins, and the time that the caller asks for. Out: the farthest end of an ordinary
 * step, or a special step that was taken. The list `kinds` below has one entry for each kind of obstacle:
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
 *   seen    examines an ordinary step whose error is small: *t is where a shorter one has to end, to meet the obstacle;
 *           t_begin: no step may be taken; INFINITY: the step is accepted. An error refuses the step
 *   cause   after an ordinary step was refused, with this status if its end could not be completed, or else for its error: the
 *           time of an obstacle that may have caused this, where a shorter step should end; INFINITY: none
 *   leave   does what happens where the last step ended, before the next one begins
 *
 * Kinds without `step` are found first, so that special steps can respect `bound` and `time_event` of struct refdyn_ahead. What a
 * kind keeps between steps is a separate struct in struct refdyn_motion. One check is not in the list: attempt.c asks at
 * the end of each step whether fading rows were lost, before it evaluates the rates there.
 */
/* clang-format on */
#include "runtime/core/motion/motion.h"

#include <math.h>

struct kind {
    enum refdyn_obstacle obstacle; /* in reports of attempts */
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

static double find_output(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    return refdyn_steps_end_at_outputs(motion) ? ahead->t_out : INFINITY;
}

/* ---- The list ---- */

static const struct kind kinds[] = {
    {REFDYN_OBSTACLE_BOUND, .find = find_bound},
    {REFDYN_OBSTACLE_OUTPUT, .find = find_output},
    {REFDYN_OBSTACLE_FADING, .start = refdyn_fading_start, .find = refdyn_fading_find,
     .step = refdyn_fading_step},
    {REFDYN_OBSTACLE_SINGULAR, .start = refdyn_crossing_start, .find = refdyn_crossing_find,
     .step = refdyn_crossing_step, .seen = refdyn_crossing_seen},
    {REFDYN_OBSTACLE_TIME_EVENT, .start = refdyn_time_events_start, .find = refdyn_time_events_find,
     .leave = refdyn_rows_take_new},
    {REFDYN_OBSTACLE_STATE_EVENT, .seen = refdyn_state_events_seen, .cause = refdyn_state_events_cause,
     .leave = refdyn_event_actions_take},
};
static const struct kind *const kinds_end = kinds + sizeof kinds / sizeof *kinds;

void refdyn_obstacles_start(struct refdyn_motion *motion) {
    for (const struct kind *kind = kinds; kind < kinds_end; kind++)
        if (kind->start)
            kind->start(motion);
}

int refdyn_obstacles_leave(struct refdyn_motion *motion) {
    int status = REFDYN_OK;
    for (const struct kind *kind = kinds; kind < kinds_end && !status; kind++)
        if (kind->leave)
            status = kind->leave(motion);
    return status;
}

void refdyn_obstacles_find(struct refdyn_motion *motion, double t_out, struct refdyn_ahead *ahead) {
    *ahead = (struct refdyn_ahead){
        .t_out = t_out, .bound = INFINITY, .time_event = INFINITY, .seen = refdyn_obstacles_seen};
    ahead->h = motion->options.tol > 0 ? motion->control.next : motion->options.step;
    ahead->least = refdyn_control_least(motion->step.t_begin, t_out);
    ahead->stop = ahead->remaining = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end; kind++) {
        const double t = kind->find && !kind->step ? kind->find(motion, ahead) : INFINITY;
        if (t < ahead->stop - ahead->least) {
            ahead->stop = t;
            ahead->at_stop = kind->obstacle;
        }
    }
}

int refdyn_obstacles_step(struct refdyn_motion *motion, double h, struct refdyn_ahead *ahead) {
    const struct kind *kind = kinds;
    ahead->h = h;
    for (; kind < kinds_end && !isfinite(ahead->remaining); kind++) {
        double t = kind->step ? kind->find(motion, ahead) : INFINITY;
        if (isfinite(t) && kind->step(motion, ahead, &t))
            return 1;
        ahead->remaining = t;
    }
    const double halfway = motion->step.t_begin + refdyn_ahead_longest(motion, ahead);
    if (halfway < ahead->stop) {
        ahead->stop = halfway;
        ahead->at_stop = kind[-1].obstacle;
    }
    return 0;
}

/* Reports the obstacle that refuses a step, or the one where an accepted step ends. */
static void report(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, enum refdyn_obstacle met,
                   double t) {
    const struct refdyn_state_events *events = &motion->state_events;
    const int is_sought = events->due_count == 0 && events->tries > 0, value = events->due_count > 0
                                                                                   ? events->due[0]
                                                                               : is_sought ? events->target
                                                                                           : -1;
    if (met)
        motion->tried.verdict = t > motion->step.t_begin ? REFDYN_TRIED_PASSED : REFDYN_TRIED_AT_BEGIN;
    else if (events->due_count > 0)
        met = REFDYN_OBSTACLE_STATE_EVENT;
    else if (motion->step.t_end == ahead->stop)
        met = ahead->at_stop;
    refdyn_tried_meets(motion, met, value);
}

int refdyn_obstacles_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    enum refdyn_obstacle met = REFDYN_OBSTACLE_NONE;
    int status = REFDYN_OK;
    *t = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end && !met; kind++) {
        if (kind->seen)
            status = kind->seen(motion, ahead, t);
        met = status || isfinite(*t) ? kind->obstacle : REFDYN_OBSTACLE_NONE;
    }
    report(motion, ahead, met, *t);
    return status;
}

double refdyn_obstacles_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status) {
    double t = INFINITY;
    for (const struct kind *kind = kinds; kind < kinds_end && !isfinite(t); kind++) {
        if (kind->cause)
            t = kind->cause(motion, ahead, status);
        if (isfinite(t))
            refdyn_tried_meets(motion, kind->obstacle, motion->state_events.target);
    }
    return t;
}
