/*
 * Kinks: values without an action whose zeros are kinks or jumps of the model's formulas.
 *
 * In: the values of kinks and their derivatives. Out: states on one side of them, so that steps begin beyond
 * a kink, or end before one at which rows turn.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>

#include "runtime/core/linear/linear.h"

/* A kink counts as zero up to this part of its largest value so far. */
static const double width = 1e-10;
/* A kink at which rows turn counts as at rest if its rate is below this part of its largest one. */
static const double turn_at_rest = 1e-6;

double refdyn_kinks_width(const struct refdyn_state_events *events, int i) {
    return width * events->sizes[i];
}

/* At this distance from zero, rounding does not affect on which side of kink i a state is. */
static double margin_of(const struct refdyn_state_events *events, int i, double noise) {
    return fmax(4 * noise, DBL_EPSILON * events->sizes[i]);
}

int refdyn_kinks_move_along(const double *by, int n, double change, double *state) {
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
            has_moved |= refdyn_kinks_move_along(by_qd, n, change, state + n) ||
                         refdyn_kinks_move_along(by_qd - events->count * n, n, change, state);
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
        if (events->towards[i] * rate <= turn_at_rest * events->turned[i])
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

/* Moves a state in the step back before kinks that it has passed only by rounding: those at which rows may
 * turn, or all. Returns the last of them; -1: there is none. */
static int move_before_kinks(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state, int all_kinks) {
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
        const double *by_qd = refdyn_state_events_by_qd(events, step->n, i);
        const double before = fmax(
            fabs(value),
            margin_of(events, i, refdyn_state_events_assess(events, step, i, t, state, step->rates).noise));
        const double change = events->side[i] * before - value;
        if ((all_kinks || refdyn_kinks_may_turn_rows(events, step, i)) &&
            (refdyn_kinks_move_along(by_qd, step->n, change, state + step->n) ||
             refdyn_kinks_move_along(by_qd - events->count * step->n, step->n, change, state)))
            held = i;
    }
    return held;
}

/* Is a state in the step beyond kink i, or within rounding of it? A kink at the beginning of the step counts
 * as passed there. The values are those of this state. */
static int is_beyond(const struct refdyn_state_events *events, int i) {
    const double width_now = refdyn_kinks_width(events, i);
    return events->side[i] != 0 && fabs(events->begin[i]) > width_now &&
           events->side[i] * events->values[i] <= width_now;
}

/* ---- Stages ---- */

static int is_one_beyond(const struct refdyn_motion *motion, double t, const double *state) {
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_workspace *work = motion->work;
    int is_one = 0;
    work->model->event(work->p, work->x, t, state, state + work->n, events->values);
    for (int i = events->named; i < events->count; i++)
        is_one |= is_beyond(events, i);
    return is_one;
}

static int see(void *context, double t, double *state) {
    struct refdyn_motion *motion = context;
    motion->kink_guard.sees_beyond |= is_one_beyond(motion, t, state);
    return 0;
}

/* Moves a state that is beyond kinks back to the side where the step began. */
static int hold(void *context, double t, double *state) {
    struct refdyn_motion *motion = context;
    struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    const int n = step->n;
    int has_moved = 0;
    for (int i = events->named; i < events->count; i++) {
        work->model->event(work->p, work->x, t, state, state + n, events->values);
        if (!is_beyond(events, i))
            continue;
        work->model->event_terms(work->p, work->x, t, state, state + n, events->terms);
        const double noise = refdyn_state_events_assess(events, step, i, t, state, step->rates).noise;
        const double change = events->side[i] * margin_of(events, i, noise) - events->values[i];
        const double *by_qd = refdyn_state_events_by_qd(events, n, i);
        has_moved |= events->side[i] * change > 0 &&
                     (refdyn_kinks_move_along(by_qd, n, change, state + n) ||
                      refdyn_kinks_move_along(by_qd - events->count * n, n, change, state));
    }
    motion->kink_guard.sees_beyond |= has_moved;
    return has_moved;
}

void refdyn_kinks_lay_out(struct refdyn_kink_guard *guard, const struct refdyn_model *model,
                          struct layout *layout) {
    guard->side.state = layout_doubles(layout, 2 * model->n + 1);
    guard->side.inner = layout_doubles(layout, 2 * model->n + 1);
    guard->side.rates = layout_doubles(layout, refdyn_rates_size(model));
}

void refdyn_kinks_clear(struct refdyn_motion *motion) {
    motion->kink_guard.is_watched = motion->kink_guard.sees_beyond = 0;
    refdyn_kinks_guard(motion, 0);
}

void refdyn_kinks_guard(struct refdyn_motion *motion, int are_held) {
    struct refdyn_side_guard *side = &motion->kink_guard.side;
    side->hold = are_held ? hold : see;
    side->context = motion;
    side->only_watches = !are_held;
    motion->step.guard = are_held || motion->kink_guard.is_watched ? side : NULL;
}

void refdyn_kinks_watch(struct refdyn_motion *motion) {
    motion->kink_guard.is_watched = motion->state_events.count > motion->state_events.named;
    motion->kink_guard.sees_beyond = 0;
    refdyn_kinks_guard(motion, 0);
}

int refdyn_kinks_saw_beyond(struct refdyn_motion *motion) {
    const int saw = motion->kink_guard.sees_beyond;
    motion->kink_guard.sees_beyond = 0;
    return saw;
}

/* ---- Ends of steps ---- */

void refdyn_kinks_end_before(struct refdyn_state_events *events, struct refdyn_step *step) {
    events->held = move_before_kinks(events, step, refdyn_step_inside(step, step->t_end), step->state_new, 0);
}

void refdyn_kinks_see_before(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state, int all_kinks) {
    move_before_kinks(events, step, refdyn_step_inside(step, t), state, all_kinks);
}
