/*
 * Kinks: values without an action whose zeros are kinks or jumps of the model's formulas.
 *
 * In: a state at a kink, within rounding. Out: the state on one side of it, or REFDYN_SLIDES if the jump
 * there leads back to itself from both sides, as Coulomb's friction by a sign, or a relay on a rate. A motion
 * slides along such a jump, where the formulas say nothing (Filippov, Differential Equations with
 * Discontinuous Righthand Sides, 1988, ch. 1), and steps go to and fro without end.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

static const double width = 1e-10;  /* of the largest value so far */
static const double at_rest = 1e-6; /* of the fastest passage of a kink at which rows turn */
enum { STEPS_MOST = 50 };
static const double beyond =
    1e-14; /* of it: much less than a layer of friction, inside which motions continue */
static const double short_part = 1e-4; /* of the longest step */

/* ---- Sides ---- */

double refdyn_kinks_width(const struct refdyn_state_events *events, int i) {
    return width * events->sizes[i];
}

/* At this distance from zero, rounding does not affect on which side of kink i a state is. */
static double margin_of(const struct refdyn_state_events *events, int i, double noise) {
    return fmax(4 * noise, DBL_EPSILON * events->sizes[i]);
}

/* Changes the value by `change`: moves the state along the value's derivatives `by` (n). */
static int move_along(const double *by, int n, double change, double *state) {
    const double square = dense_dot(by, by, n);
    if (square > 0)
        dense_add(state, change / square, by, n);
    return square > 0;
}

int refdyn_kinks_leave(struct refdyn_state_events *events, const struct refdyn_step *step, int side,
                       double *state) {
    const int n = step->n;
    int has_moved = 0;
    for (int k = events->due_named; k < events->due_count; k++) {
        const int i = events->due[k];
        const int to = side * events->towards[i];
        refdyn_state_events_evaluate(events, step, step->t_begin, state);
        const struct refdyn_assessed now =
            refdyn_state_events_assess(events, step, i, step->t_begin, state, step->rates);
        const double change = to * margin_of(events, i, now.noise) - events->values[i];
        const double *by_qd = refdyn_state_events_by_qd(events, n, i);
        if (to * change > 0)
            has_moved |= move_along(by_qd, n, change, state + n) ||
                         move_along(by_qd - events->count * n, n, change, state);
    }
    return has_moved;
}

int refdyn_kinks_lead_back(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int k = events->due_named; k < events->due_count; k++) {
        const int i = events->due[k];
        const double rate =
            refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates).rate;
        events->turned[i] = fmax(events->turned[i], fabs(events->rates[i]));
        if (events->towards[i] * rate <= at_rest * events->turned[i])
            return 1;
    }
    return 0;
}

int refdyn_kinks_may_turn_rows(const struct refdyn_state_events *events, const struct refdyn_step *step,
                               int i) {
    const double *by_qd = refdyn_state_events_by_qd(events, step->n, i);
    return refdyn_state_events_is_kink(events, i) && step->evaluation.work->model->m > 0 &&
           refdyn_largest(by_qd, step->n, NULL) == 0;
}

/* Moves a state in the step that has passed a kink of positions by rounding only back before it. Returns the
 * kink; -1: there is none. */
static int move_before_kinks(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state) {
    int held = -1;
    if (events->named == events->count || step->evaluation.work->model->m == 0 ||
        refdyn_state_events_values(events, step, t, state, events->values))
        return -1;
    for (int i = events->named; i < events->count; i++) {
        const double value = events->values[i];
        if (events->side[i] == 0 || events->side[i] * value > 0 ||
            fabs(value) > refdyn_kinks_width(events, i))
            continue;
        refdyn_state_events_evaluate(events, step, t, state);
        const double *by_q = events->terms + events->count + i * step->n;
        const double before = fmax(
            fabs(value),
            margin_of(events, i, refdyn_state_events_assess(events, step, i, t, state, step->rates).noise));
        if (refdyn_kinks_may_turn_rows(events, step, i) &&
            move_along(by_q, step->n, events->side[i] * before - value, state))
            held = i;
    }
    return held;
}

void refdyn_kinks_end_before(struct refdyn_state_events *events, struct refdyn_step *step) {
    events->held = move_before_kinks(events, step, refdyn_step_inside(step, step->t_end), step->state_new);
}

void refdyn_kinks_see_before(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state) {
    move_before_kinks(events, step, refdyn_step_inside(step, t), state);
}

/* ---- Jumps that lead back to themselves ---- */

/* state := that at the begin of the step, with rates that change the value of kink i so much. Returns 0 if no
 * rate changes it. */
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

/* Does the value of kink i return to zero from this side? */
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

int refdyn_kinks_check_sliding(struct refdyn_motion *motion) {
    struct refdyn_state_events *events = &motion->state_events;
    const int is_short = motion->control.last < short_part * motion->statistics.step_largest;
    for (int i = events->named; i < events->count; i++) {
        const int is_near = fabs(events->samples[i]) <= refdyn_kinks_width(events, i);
        if (is_short && !is_near)
            continue;
        const int slides = is_short && leads_back(motion, i, 1) && leads_back(motion, i, -1);
        events->returns[i] = slides ? events->returns[i] + 1 : 0;
        if (events->returns[i] >= STEPS_MOST)
            return REFDYN_SLIDES;
    }
    return REFDYN_OK;
}
