/*
 * Jumps of forces that lead back to themselves: see motion.h.
 *
 * Takes the begin of a step that follows a short one and lies at a kink of rates; gives whether the value
 * that is zero there goes back to zero from a little beyond, on both sides. A kink without a jump leads on.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

enum { STEPS_MOST = 50 };
static const double near_part = 1e-10; /* of the largest value so far: a kink is passed beyond */
static const double beyond = 1e-14;    /* of it: much less than a layer of friction, which leads on within */
static const double short_part = 1e-4; /* of the longest step */

/* Rates that give the value of kink i this change, from the begin of the step; 0: no rate changes it. */
static int move(const struct refdyn_motion *motion, int i, double change, double *state) {
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_step *step = &motion->step;
    const int n = step->n;
    const double *by_qd = refdyn_state_events_by_qd(events, n, i);
    const double square = dense_dot(by_qd, by_qd, n);
    memcpy(state, step->state, refdyn_state_bytes(step));
    if (square > 0)
        dense_add(state + n, change / square, by_qd, n);
    return square > 0;
}

/* The values' terms at the state. */
static void find_terms(const struct refdyn_motion *motion, const double *state) {
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    work->model->event_terms(work->p, work->x, step->t_begin, state, state + step->n,
                             motion->state_events.terms);
}

/* On this side of kink i, does its value go back to zero? */
static int leads_back(struct refdyn_motion *motion, int i, int side) {
    struct refdyn_step *step = &motion->step;
    const struct refdyn_state_events *events = &motion->state_events;
    const int n = step->n;
    double *state = step->stage, *rates = step->side;
    find_terms(motion, step->state);
    if (!move(motion, i, side * beyond * events->sizes[i] - events->samples[i], state) ||
        refdyn_rates(&step->evaluation, step->t_begin, state, rates))
        return 0;
    find_terms(motion, state);
    const double *by_qd = refdyn_state_events_by_qd(events, n, i);
    return side * (events->terms[i] + dense_dot(by_qd, rates + n, n)) < 0;
}

int refdyn_sliding_look(struct refdyn_motion *motion) {
    struct refdyn_state_events *events = &motion->state_events;
    const int is_short = motion->control.last < short_part * motion->statistics.step_largest;
    for (int i = events->named; i < events->count; i++) {
        const int is_near = fabs(events->samples[i]) <= near_part * events->sizes[i];
        if (is_short && !is_near)
            continue;
        const int slides = is_short && leads_back(motion, i, 1) && leads_back(motion, i, -1);
        events->returns[i] = slides ? events->returns[i] + 1 : 0;
        if (events->returns[i] >= STEPS_MOST)
            return REFDYN_SLIDES;
    }
    return REFDYN_OK;
}
