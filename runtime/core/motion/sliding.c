/*
 * Motions that make no progress: jumps that lead back to themselves, and times at which nothing moves.
 *
 * In: the beginning of a step, and how far the values of kinks have been from zero since a step last began
 * there. Out: REFDYN_SLIDES, or another status for a motion that would never end.
 *
 * A jump of a force may lead back to itself from both sides: by its rate, as Coulomb's friction with a sign
 * does, or by its acceleration, as a force that pushes a body towards a place. The motion then slides along
 * the jump or rests at it. The formulas do not say how (Filippov, Differential Equations with Discontinuous
 * Righthand Sides, 1988, ch. 1), and steps go to and fro without end. A motion that moves away from the jump
 * by more than a part of the tolerance, such as the oscillation under a relay, continues.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Bound on the steps that begin at one kink and stay there. A step counts RETURN_LEADS_BACK times if the jump
 * leads back. */
enum { RETURNS_MOST = 1000, RETURN_LEADS_BACK = 20 };
/* A step stays at a kink if it is shorter than short_part of the longest step, or moves away by at most
 * calm_part of the tolerance. A contact counts as at rest below the same part. */
static const double short_part = 1e-4, calm_part = 0.01;
/* The sides of a kink are examined at this part of its largest value. That is much less than the layer of a
 * friction law, inside which motions continue. */
static const double beyond = 1e-14;
/* A jump exceeds jump_least of the derivative; at twice the distance it differs by at most jump_changes of
 * itself. */
static const double jump_least = 1e-6, jump_changes = 0.25;
/* Positions change by this part of their units where the curvature of a value is computed by a difference. */
static const double difference = 1e-6;
/* A motion that cannot continue has met a kink that this many of the shortest steps would reach. */
static const double reach = 16;
/* Bound on the steps without progress: IDLE_FREE, and IDLE_PAIR times the square of the number of values. It
 * exceeds the bound on events without time between them. Steps make no progress if they are on average
 * shorter than idle_part times the shortest step, or than idle_fixed_part of a fixed step. */
enum { IDLE_FREE = 200, IDLE_PAIR = 8 };
static const double idle_part = 16, idle_fixed_part = 1e-6;

/* ---- The sides of a kink ---- */

/* Kink i at the beginning of a step. */
struct kink {
    int i, is_of_rates; /* its value depends on rates */
    double value, rate; /* `rate` is without accelerations */
    double scale;       /* its change by the unit of each position, or of each rate */
    double distance;    /* at which its sides are examined */
};

static void find_terms(const struct refdyn_motion *motion, double t, const double *state) {
    const struct refdyn_workspace *work = motion->work;
    work->model->event_terms(work->p, work->x, t, state, state + work->n, motion->state_events.terms);
}

/* Describes kink i; `value` is that at the beginning of the step. */
static struct kink find_kink(struct refdyn_motion *motion, int i, double value) {
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_step *step = &motion->step;
    const double *by_qd = refdyn_state_events_by_qd(events, step->n, i),
                 *by_q = by_qd - events->count * step->n;
    find_terms(motion, step->t_begin, step->state);
    struct kink kink = {.i = i, .value = value, .rate = events->terms[i]};
    kink.is_of_rates = refdyn_largest(by_qd, step->n, NULL) > 0;
    for (int j = 0; j < step->n; j++)
        kink.scale += fabs(kink.is_of_rates ? by_qd[j] : by_q[j]) * step->units[j];
    const double noise =
        refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates).noise;
    kink.distance = fmax(4 * noise, beyond * fmax(events->sizes[i], events->contacts.tolerance * kink.scale));
    return kink;
}

/* The first derivative of the value to which forces contribute, at the distance `away` from zero; NAN: it
 * cannot be evaluated. */
static double derivative_at(struct refdyn_motion *motion, const struct kink *kink, double away) {
    struct refdyn_step *step = &motion->step;
    const struct refdyn_state_events *events = &motion->state_events;
    const int n = step->n;
    const double *by_qd = refdyn_state_events_by_qd(events, n, kink->i), *by_q = by_qd - events->count * n;
    double *state = step->stage, *rates = step->side, speed = 0;
    find_terms(motion, step->t_begin, step->state);
    memcpy(state, step->state, refdyn_state_bytes(step));
    if (!refdyn_kinks_move_along(kink->is_of_rates ? by_qd : by_q, n, away - kink->value,
                                 kink->is_of_rates ? state + n : state) ||
        refdyn_rates(&step->evaluation, step->t_begin, state, rates))
        return NAN;
    find_terms(motion, step->t_begin, state);
    const double rate = events->terms[kink->i];
    if (kink->is_of_rates)
        return rate + dense_dot(by_qd, rates + n, n);
    const double by_forces = dense_dot(by_q, rates + n, n);
    for (int j = 0; j < n; j++)
        speed = fmax(speed, fabs(state[n + j]) / step->units[j]);
    const double h = difference / (1 + speed);
    dense_add(state, h, state + n, n);
    find_terms(motion, step->t_begin + h, state);
    return by_forces + (events->terms[kink->i] - rate) / h;
}

/* The two sides of a kink. */
struct sides {
    double above, below; /* derivatives */
    int is_jump;         /* they differ */
    int leads_back; /* from both sides, and the value does not leave the jump by more than the tolerance */
};

/* At twice the distance, a difference that is a jump stays, and one that is a change of slope doubles. */
static struct sides find_sides(struct refdyn_motion *motion, const struct kink *kink) {
    const double calm = calm_part * motion->state_events.contacts.tolerance * kink->scale;
    struct sides sides = {.above = derivative_at(motion, kink, kink->distance),
                          .below = derivative_at(motion, kink, -kink->distance)};
    const double jump = fabs(sides.above - sides.below), pull = fmin(-sides.above, sides.below);
    if (!(jump > jump_least * fmax(fabs(sides.above), fabs(sides.below))))
        return sides;
    sides.is_jump = fabs(derivative_at(motion, kink, 2 * kink->distance) - sides.above) +
                        fabs(derivative_at(motion, kink, -2 * kink->distance) - sides.below) <=
                    jump_changes * jump;
    sides.leads_back =
        sides.is_jump && pull > 0 && (kink->is_of_rates || kink->rate * kink->rate <= 2 * pull * calm);
    return sides;
}

/* ---- Starts on a jump ---- */

/* Returns the side of a jump to which the motion leads. Where both lead away, the formula's value on the jump
 * decides. */
static int side_ahead(struct refdyn_motion *motion, const struct kink *kink, const struct sides *sides) {
    const int side = motion->state_events.side[kink->i];
    if (side != 0 && !kink->is_of_rates)
        return side;
    if (sides->above > 0 && sides->below < 0)
        return derivative_at(motion, kink, kink->value) < 0 ? -1 : 1;
    return sides->above > 0 ? 1 : -1;
}

/* Moves the start to the side of kink i to which the motion leads. *has_moved: it was on a jump. */
static int start_beside(struct refdyn_motion *motion, int i, int *has_moved) {
    struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_step *step = &motion->step;
    const int n = step->n;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    const struct refdyn_assessed found =
        refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
    if (!(fabs(events->values[i]) <= found.noise))
        return REFDYN_OK;
    const struct kink kink = find_kink(motion, i, events->values[i]);
    const struct sides sides = find_sides(motion, &kink);
    if (!sides.is_jump || sides.leads_back)
        return REFDYN_OK;
    const int to = side_ahead(motion, &kink, &sides);
    find_terms(motion, step->t_begin, step->state);
    const double *by_qd = refdyn_state_events_by_qd(events, n, i);
    *has_moved |= refdyn_kinks_move_along(kink.is_of_rates ? by_qd : by_qd - events->count * n, n,
                                          to * kink.distance - kink.value,
                                          kink.is_of_rates ? step->state + n : step->state);
    events->side[i] = to;
    return refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
}

int refdyn_sliding_start(struct refdyn_motion *motion) {
    const struct refdyn_state_events *events = &motion->state_events;
    int status = REFDYN_OK, has_moved = 0;
    for (int i = events->named; i < events->count && !status; i++)
        status = start_beside(motion, i, &has_moved);
    if (has_moved)
        refdyn_step_give_up(&motion->step); /* both ends of the step are its beginning */
    return status;
}

/* ---- Steps that return to a kink ---- */

/* Has the motion stayed at the kink since a step last began there? The distance of a kink of rates is its
 * largest value times the time since then. */
static int is_calm(const struct refdyn_motion *motion, const struct kink *kink) {
    const struct refdyn_state_events *events = &motion->state_events;
    const double time = kink->is_of_rates ? motion->step.t_begin - events->visited[kink->i] : 1;
    return events->risen[kink->i] * time <= calm_part * events->contacts.tolerance * kink->scale;
}

/* Counts a step that begins at a kink. No step leads away from a jump where the value and its rate are zero,
 * unless forces are zero there as well, as with a sign that is 0 at 0. Jumps that do not lead back may do so
 * together, as on a spiral around the place where two of them meet. */
static int visit(struct refdyn_motion *motion, const struct kink *kink, int is_short) {
    struct refdyn_state_events *events = &motion->state_events;
    const int i = kink->i, stays = is_calm(motion, kink);
    const struct sides sides = stays || is_short ? find_sides(motion, kink) : (struct sides){0, 0, 0, 0};
    const int counts = sides.leads_back ? RETURN_LEADS_BACK : stays && sides.is_jump;
    events->returns[i] = counts > 0 ? events->returns[i] + counts : 0;
    events->risen[i] = 0;
    events->visited[i] = motion->step.t_begin;
    const int rests = sides.leads_back && events->side[i] == 0 &&
                      fabs(derivative_at(motion, kink, kink->value)) > jump_changes * sides.below;
    return rests || events->returns[i] >= RETURNS_MOST ? REFDYN_SLIDES : REFDYN_OK;
}

void refdyn_sliding_note_due(struct refdyn_state_events *events) {
    for (int k = events->due_named; k < events->due_count; k++)
        events->is_met[events->due[k]] = 1;
}

int refdyn_sliding_check(struct refdyn_motion *motion) {
    struct refdyn_state_events *events = &motion->state_events;
    const int is_short = motion->control.last <= short_part * motion->statistics.step_largest;
    int status = REFDYN_OK;
    for (int i = events->named; i < events->count && !status; i++) {
        const int is_near = events->is_met[i] || fabs(events->begin[i]) <= refdyn_kinks_width(events, i);
        const int rests_at_zero = events->risen[i] == 0 && motion->step.t_begin > events->visited[i];
        events->is_met[i] = 0;
        if (rests_at_zero)
            events->returns[i] = 0;
        if (rests_at_zero || (!is_near && events->returns[i] == 0))
            continue;
        const struct kink kink = find_kink(motion, i, events->begin[i]);
        if (is_near)
            status = visit(motion, &kink, is_short);
        else if (!is_short && !is_calm(motion, &kink))
            events->returns[i] = 0;
    }
    return status;
}

/* ---- No progress ---- */

/* Is the kink so near that steps of the length `least` end at it? */
static int is_reached(const struct refdyn_motion *motion, const struct kink *kink, const struct sides *sides,
                      double least) {
    const struct refdyn_state_events *events = &motion->state_events;
    const double calm = calm_part * events->contacts.tolerance * kink->scale;
    const double rate = kink->is_of_rates ? fmax(fabs(sides->above), fabs(sides->below)) : fabs(kink->rate);
    const double near = sides->leads_back && !kink->is_of_rates ? calm : reach * least * rate;
    return sides->is_jump && fabs(kink->value) <= fmax(near, refdyn_kinks_width(events, kink->i));
}

/* Returns the side to which the motion crosses the jump; 0: it does not, or has crossed it. */
static int side_crossed_to(const struct kink *kink, const struct sides *sides) {
    const double rate = kink->is_of_rates ? sides->above : kink->rate;
    const int to = refdyn_sign_of(rate);
    return (kink->is_of_rates && to != refdyn_sign_of(sides->below)) || to * kink->value > 0 ? 0 : to;
}

/* No step reaches kink i and crosses it: makes it due where the step begins. */
static void cross(struct refdyn_motion *motion, int i, int to) {
    struct refdyn_state_events *events = &motion->state_events;
    refdyn_state_events_clear_due(events);
    events->side[i] = -to;
    events->towards[i] = to;
    refdyn_state_events_add_due(events, i);
    refdyn_step_give_up(&motion->step);
    refdyn_motion_failed(motion, REFDYN_OK, motion->step.t_begin);
    refdyn_tried_begin(motion, refdyn_tried_kind(motion), motion->step.number, 0);
    motion->tried.verdict = REFDYN_TRIED_JUMP;
    refdyn_tried_meets(motion, REFDYN_OBSTACLE_STATE_EVENT, i);
    refdyn_tried_end(motion, REFDYN_OK);
}

int refdyn_sliding_resolve(struct refdyn_motion *motion, int status, double t_out) {
    struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_step *step = &motion->step;
    const int may_be_jump = status == REFDYN_STEP_TOO_SMALL || status == REFDYN_NO_CONVERGENCE;
    const double least = refdyn_control_least(step->t_begin, t_out);
    int crossed = -1, to = 0;
    if (!may_be_jump || refdyn_repeats(motion) || events->due_count > 0 || events->named == events->count ||
        refdyn_state_events_values(events, step, step->t_begin, step->state, events->values))
        return status;
    for (int i = events->named; i < events->count; i++) {
        const struct kink kink = find_kink(motion, i, events->values[i]);
        const struct sides sides = find_sides(motion, &kink);
        if (!is_reached(motion, &kink, &sides, least))
            continue;
        if (sides.leads_back) {
            refdyn_motion_failed(motion, REFDYN_SLIDES, step->t_begin);
            return REFDYN_SLIDES;
        }
        if (side_crossed_to(&kink, &sides) != 0) {
            crossed = i;
            to = side_crossed_to(&kink, &sides);
        }
    }
    if (crossed < 0)
        return status;
    cross(motion, crossed, to);
    return REFDYN_OK;
}

void refdyn_idle_start(struct refdyn_motion *motion) {
    motion->idle = (struct refdyn_idle){.t = -INFINITY};
}

int refdyn_idle_check(struct refdyn_motion *motion, double t_out) {
    const struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_idle *idle = &motion->idle;
    const double t = motion->step.t_begin, fixed = motion->options.tol > 0 ? 0 : motion->options.step;
    const double least = fmax(idle_part * refdyn_control_least(t, t_out), idle_fixed_part * fixed);
    idle->count++;
    if (t - idle->t > idle->count * least)
        *idle = (struct refdyn_idle){t, 0};
    if (idle->count <= IDLE_FREE + IDLE_PAIR * events->count * events->count)
        return REFDYN_OK;
    return events->count > events->named ? REFDYN_SLIDES : REFDYN_STEP_TOO_SMALL;
}
