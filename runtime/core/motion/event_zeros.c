/*
 * Zeros of events and kinks in a step that was taken.
 *
 * In: the step, and the sides of zero on which the values were at its beginning. Out: where a shorter step
 * should end, or what is due at the end of this one. Each value is sampled in nine places of the method's
 * interpolant, or piece by piece in more if the frequency of the events requires it (model.pace). It has a
 * zero if its sign has changed. It may have one in between if a parabola through three samples passes zero.
 * The Illinois form of regula falsi locates the first zero (Dowell and Jarratt, BIT 11:168-174, 1971). The
 * step is taken again to there, and Newton's method corrects its length until its end is on the zero. So the
 * event is as accurate as a step.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = REFDYN_EVENT_SAMPLES };
enum {
    TRIES_MOST =
        60, /* bound on the steps to one zero. Newton squares the distance; the last resort halves it */
    TRIES_FREE = 4,    /* after these tries, a distance that does not fall is rounding */
    ZEROS_MOST = 100,  /* bound on the iterations for a zero of an interpolant */
    SAME_MOST = 3,     /* after so many iterations on one side, as at a pole, the next one halves */
    PLACES_MOST = 4000 /* bound on the places in a step that the frequency of events requires */
};
/* Rounding of a value, relative to its terms. */
static const double rounding = 8 * DBL_EPSILON;
/* Accuracy of a zero on the interpolant, relative to the step. */
static const double zero_width = 1e-13;
/* Zeros that are nearer to each other than this part of the step are the same. */
static const double same_zero = 1e-10;
/* The zero of a force that jumps at a kink differs from the kink's by at most this part of the step. */
static const double jump_width = 1e-9;
/* A distance from a zero can be rounding only below this part of a step. */
static const double rounding_part = 1e-6;
/* A zero farther ahead than this part of the step is left to ordinary steps. */
static const double far_short = 0.1;
/* A zero in the last hundredth of a refused step does not explain why it was too long. */
static const double near_end = 0.99;
/* A step that ends before a kink may have stages beyond it, if the value of the kink falls below this part of
 * its range in the step. */
static const double stages_reach = 0.25;
/* A zero before the first sample is within this part of the time to it. */
static const double early = 0.9;
/* Largest advance of a phase between two samples [rad], and the largest one that a change of the frequency
 * may cause. */
static const double phase_most = 0.4, phase_limit = 0.8;

/* ---- Zeros on the interpolant ---- */

/* Values at theta of the step; at a time event at its end, on the left side. */
static int evaluate_at(struct refdyn_state_events *events, struct refdyn_step *step, double theta,
                       double *values) {
    const double t = step->t_begin + theta * (step->t_end - step->t_begin);
    int status = REFDYN_OK;
    if (theta < 1)
        status = step->method->kind->interpolate(step, theta, events->room);
    if (!status)
        status =
            refdyn_state_events_values(events, step, refdyn_step_inside(step, theta < 1 ? t : step->t_end),
                                       theta < 1 ? events->room : step->state_new, values);
    return status;
}

static double sample(const struct refdyn_state_events *events, int k, int i) {
    return events->samples[k * events->count + i];
}

static int value_at(struct refdyn_state_events *events, struct refdyn_step *step, int i, double theta,
                    double *value) {
    const int status = evaluate_at(events, step, theta, events->values);
    *value = events->values[i] - events->offsets[i];
    return status;
}

/* Times that are nearer to each other are the same. */
static double same_time(const struct refdyn_step *step) {
    return fmax(2 * refdyn_time_resolution(step->t_end), rounding * (step->t_end - step->t_begin));
}

/* Where a value is sought: a, before the crossing, and b, after it, with the values there. */
struct bracket {
    double a, va, b, vb;
    int moved; /* how often in succession: a, if it is below 0, or b */
};

/* Moves one end to x. */
static void narrow(struct bracket *bracket, double x, double value) {
    const int is_before = value != 0 && (value > 0) == (bracket->va > 0), moved = bracket->moved;
    if (is_before) {
        bracket->vb = moved < 0 ? bracket->vb / 2 : bracket->vb;
        bracket->a = x, bracket->va = value, bracket->moved = moved < 0 ? moved - 1 : -1;
    } else {
        bracket->va = moved > 0 ? bracket->va / 2 : bracket->va;
        bracket->b = x, bracket->vb = value, bracket->moved = moved > 0 ? moved + 1 : 1;
    }
}

/* The zero between a and b. A step of regula falsi that hardly moves is at the zero if the sign changes next
 * to it. If it does not, as before a jump or a pole, or if steps remain at the same end, the next step
 * halves. */
static int find_zero(struct refdyn_state_events *events, struct refdyn_step *step, int i, double a, double va,
                     double b, double vb, double *theta) {
    struct bracket bracket = {a, va, b, vb, 0};
    double value, next;
    int status, is_at_end = 0;
    *theta = b;
    for (int k = 0; k < ZEROS_MOST && bracket.b - bracket.a > zero_width; k++) {
        const double width = bracket.b - bracket.a, last = *theta;
        const double x = bracket.a + width * (bracket.va / (bracket.va - bracket.vb));
        const int is_inside = x > bracket.a && x < bracket.b && abs(bracket.moved) < SAME_MOST && !is_at_end;
        *theta = is_inside ? x : bracket.a + width / 2;
        status = value_at(events, step, i, *theta, &value);
        if (status || value == 0)
            return status;
        narrow(&bracket, *theta, value);
        is_at_end = fabs(*theta - last) <= zero_width;
        if (!is_at_end)
            continue;
        const double beyond =
            bracket.a == *theta ? fmin(*theta + zero_width, bracket.b) : fmax(*theta - zero_width, bracket.a);
        status = value_at(events, step, i, beyond, &next);
        if (status || (next > 0) != (value > 0))
            return status;
        narrow(&bracket, beyond, next);
    }
    return REFDYN_OK;
}

/* Where the value leaves zero, between a, where it is zero, and b, where it is not. */
static int find_leave(struct refdyn_state_events *events, struct refdyn_step *step, int i, double a, double b,
                      double *theta) {
    double value;
    for (int k = 0; k < ZEROS_MOST && b - a > zero_width; k++) {
        const double x = a + (b - a) / 2;
        const int status = value_at(events, step, i, x, &value);
        if (status)
            return status;
        *(value != 0 ? &b : &a) = x;
    }
    *theta = b;
    return REFDYN_OK;
}

/* A value may leave zero at the beginning and return before the first sample. The parabola through the
 * beginning, with its rate, and the first sample shows where it returns; half of that is where it is
 * farthest. If the interpolant shows nothing there, the predicted return counts, unless the value is clear of
 * zero at the beginning, as before a pole. */
static int find_return(struct refdyn_state_events *events, struct refdyn_step *step, int i, int side,
                       const struct refdyn_assessed *found, double *theta) {
    const double part = events->thetas[1], begin = sample(events, 0, i), first = sample(events, 1, i);
    const double rise = found->rate * part * (step->t_end - step->t_begin);
    const double back = rise / (rise - (first - begin));
    double value;
    *theta = part * (back > 0 && back < early ? back : early);
    const int status = value_at(events, step, i, *theta / 2, &value);
    if (!status && side * value > 0)
        return find_zero(events, step, i, *theta / 2, value, part, first, theta);
    return !status && side * begin > found->noise
               ? find_zero(events, step, i, 0, begin, *theta / 2, value, theta)
               : status;
}

/* The zero before the first sample, which is beyond zero. */
static int find_near_begin(struct refdyn_state_events *events, struct refdyn_step *step, int i, int side,
                           double *theta) {
    const double part = events->thetas[1], begin = sample(events, 0, i);
    refdyn_state_events_evaluate_terms(events, step, step->t_begin, step->state);
    const struct refdyn_assessed found =
        refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
    if (side * found.rate > found.rate_noise)
        return find_return(events, step, i, side, &found, theta);
    *theta = 0;
    if (begin == 0 && fabs(found.rate) <= found.rate_noise)
        return find_leave(events, step, i, 0, part, theta);
    return side * begin > 0 ? find_zero(events, step, i, 0, begin, part, sample(events, 1, i), theta)
                            : REFDYN_OK;
}

/* May a value have been beyond zero between three samples on the same side? Then *theta is the first zero. */
static int find_dip(struct refdyn_state_events *events, struct refdyn_step *step, int i, int middle,
                    double *theta) {
    const int side = refdyn_sign_of(sample(events, middle, i));
    struct refdyn_dip dip;
    double x, v, value;
    for (int k = 0; k < 3; k++) {
        dip.x[k] = events->thetas[middle - 1 + k];
        dip.v[k] = side * sample(events, middle - 1 + k, i);
        if (!(dip.v[k] > 0) || !refdyn_state_events_watches(step, i, -side))
            return REFDYN_OK;
    }
    const double begin = dip.x[0], least = fmin(dip.v[0], fmin(dip.v[1], dip.v[2]));
    for (int tries = 0; tries < REFDYN_DIPS_MOST && refdyn_dip_bottom(&dip, &x, &v) && v < least / 2;
         tries++) {
        const int status = value_at(events, step, i, x, &value);
        if (status)
            return status;
        if (side * value < 0) {
            events->towards[i] = -side;
            return find_zero(events, step, i, begin, sample(events, middle - 1, i), x, value, theta);
        }
        refdyn_dip_narrow(&dip, x, side * value);
    }
    return REFDYN_OK;
}

/* The first of these zeros before sample `end`. */
static int find_dips(struct refdyn_state_events *events, struct refdyn_step *step, int i, int end,
                     double *theta) {
    int status = REFDYN_OK;
    for (int k = 1; k + 1 < end && !status && !isfinite(*theta); k++)
        status = find_dip(events, step, i, k, theta);
    return status;
}

/* The side of zero of a sample; that of a kink has to be clear of zero. */
static int side_at(const struct refdyn_state_events *events, int k, int i) {
    const double value = sample(events, k, i);
    return refdyn_state_events_is_kink(events, i) && fabs(value) <= refdyn_kinks_width(events, i)
               ? 0
               : refdyn_sign_of(value);
}

/* The sample of the piece after the first crossing in the event's direction, and the side before it. 0: there
 * is none; then side_end is the side at the end. */
static int find_crossing(struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                         int *side) {
    *side = events->side_from[i];
    for (int k = events->first; k <= events->last; k++) {
        const int now = side_at(events, k, i);
        if (now == 0 || now == *side)
            continue;
        if (refdyn_state_events_watches(step, i, now) &&
            (*side != 0 || !refdyn_state_events_is_kink(events, i))) {
            *side = -now;
            events->towards[i] = now;
            return k;
        }
        *side = now;
    }
    events->side_end[i] = *side;
    return 0;
}

/* Where event i first happens in the piece; INFINITY: it does not. */
static int find_first(struct refdyn_state_events *events, struct refdyn_step *step, int i, double *theta) {
    int side;
    const int k = find_crossing(events, step, i, &side), towards = events->towards[i];
    *theta = INFINITY;
    const int status = find_dips(events, step, i, k > 0 ? k : events->last + 1, theta);
    if (status || k == 0 || isfinite(*theta))
        return status;
    events->towards[i] = towards;
    if (k == 1 && events->thetas[0] == 0)
        return find_near_begin(events, step, i, side, theta);
    const double before = sample(events, k - 1, i);
    *theta = events->thetas[k - 1];
    if (before == 0)
        return find_leave(events, step, i, *theta, events->thetas[k], theta);
    return side * before > 0
               ? find_zero(events, step, i, *theta, before, events->thetas[k], sample(events, k, i), theta)
               : REFDYN_OK;
}

/* ---- The pieces of a step that was taken ---- */

/* The next piece begins with the last two samples of this one, so that a dip between pieces is also seen. */
static void begin_next_piece(struct refdyn_state_events *events) {
    const size_t values = (size_t)events->count * sizeof(double);
    for (int k = 0; k < 2; k++) {
        const int from = events->last - 1 + k;
        memmove(events->samples + k * events->count, events->samples + from * events->count, values);
        events->thetas[k] = events->thetas[from];
    }
    memcpy(events->side_from, events->side_end, (size_t)events->count * sizeof *events->side);
    events->first = 2;
}

/* The largest angular frequency of events at theta, where values were evaluated last [rad/step]. */
static double pace_at(const struct refdyn_state_events *events, const struct refdyn_step *step,
                      double theta) {
    const struct refdyn_workspace *work = step->evaluation.work;
    const double h = step->t_end - step->t_begin;
    const double *state = theta == 0 ? step->state : theta < 1 ? events->room : step->state_new;
    double pace[2] = {0, 0};
    if (work->model->pace)
        work->model->pace(work->p, work->x, step->t_begin + theta * h, state, state + step->n, pace);
    return pace[1] * h;
}

static double distance_to_next(const struct refdyn_state_events *events, double pace) {
    const double most = 1.0 / (SAMPLES * events->looks);
    return pace * most > phase_most ? fmax(phase_most / pace, 1.0 / PLACES_MOST) : most;
}

static void begin_pieces(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const size_t sides = (size_t)events->count * sizeof *events->side,
                 values = (size_t)events->count * sizeof(double);
    events->first = 1;
    events->last = 0;
    events->thetas[0] = 0;
    events->apart = distance_to_next(events, pace_at(events, step, 0));
    memcpy(events->samples, events->begin, values);
    memcpy(events->offsets, events->zeros, values);
    memcpy(events->side_from, events->side, sides);
    memset(events->most, 0, values);
}

/* Accepts sample k: a value that has been on its side no longer counts as zero beyond it. */
static void accept_sample(struct refdyn_state_events *events, int k) {
    double *values = events->samples + k * events->count;
    events->last = k;
    for (int i = 0; i < events->count; i++) {
        if (events->side[i] * values[i] > 0)
            events->offsets[i] = 0;
        values[i] -= events->offsets[i];
        events->most[i] = fmax(events->most[i], fabs(values[i]));
    }
}

/* Samples the next piece. *reached: theta up to which it could be done, because events vary too fast in the
 * step for all of it. */
static int take_piece(struct refdyn_state_events *events, struct refdyn_step *step, double *reached) {
    int status = REFDYN_OK, k = events->first;
    *reached = 1;
    while (k <= SAMPLES && !status && events->thetas[k - 1] < 1) {
        const double from = events->thetas[k - 1], apart = events->apart;
        events->thetas[k] = from + apart < 1 - apart / 2 ? from + apart : 1;
        status = evaluate_at(events, step, events->thetas[k], events->samples + k * events->count);
        const double pace = pace_at(events, step, events->thetas[k]);
        events->apart = distance_to_next(events, pace);
        if (!status && pace * apart > phase_limit && !(events->apart < apart)) {
            *reached = from > 0 ? from : PLACES_MOST / 2 * phase_most / pace;
            return REFDYN_OK;
        }
        if (!status && !(pace * apart > phase_limit))
            accept_sample(events, k++);
    }
    return status;
}

/* Adds kink i to the ascending list of the step, at most once: a rejected attempt and the next one may pass
 * the same kinks. */
static void add_passed(struct refdyn_state_events *events, int i) {
    int k = events->passed_count;
    for (; k > 0 && events->passed[k - 1] >= i; k--)
        if (events->passed[k - 1] == i)
            return;
    memmove(events->passed + k + 1, events->passed + k,
            (size_t)(events->passed_count - k) * sizeof *events->passed);
    events->passed[k] = i;
    events->passed_count++;
}

/* A kink at the beginning of the step is passed. Nothing happens there unless rows turn. */
static int is_passed(struct refdyn_state_events *events, const struct refdyn_step *step, int i, double theta,
                     double least) {
    if (!refdyn_state_events_is_kink(events, i) || !(theta * (step->t_end - step->t_begin) < least))
        return 0;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    if (refdyn_kinks_may_turn_rows(events, step, i))
        return 0;
    events->side[i] = events->side_from[i] = -events->side[i];
    add_passed(events, i);
    return 1;
}

/* The value of event i at the end of the step, which was evaluated last. */
static double value_at_end(const struct refdyn_state_events *events, int i) {
    return events->values[i] - events->offsets[i];
}

/* The step is accepted: records how far from zero the values were in it. */
static void note_samples(struct refdyn_state_events *events) {
    for (int i = 0; i < events->count; i++)
        events->risen[i] = fmax(events->risen[i], events->most[i]);
}

/* Value i crosses zero at the same time as another if no more than this time is between them. A force that
 * jumps at a kink is zero where the kink is, and its zero is as accurate as one on the interpolant. */
static double together(const struct refdyn_state_events *events, int i, double t) {
    const double located = 8 * zero_width * events->contacts.longest;
    return refdyn_state_events_blur(t) + (refdyn_state_events_is_kink(events, i) ? located : 0);
}

/* The step is good. Values that have crossed zero in it are due, and those that are about to cross it at the
 * same time. Events wait until kinks have been passed, where their own values may turn. */
static void end_on_zero(struct refdyn_state_events *events, struct refdyn_step *step) {
    const double t = refdyn_step_inside(step, step->t_end);
    const int ends_on_kink = events->target >= events->named;
    refdyn_state_events_clear_due(events);
    note_samples(events);
    refdyn_state_events_evaluate(events, step, t, step->state_new);
    for (int i = 0; i < events->count; i++) {
        int side;
        const int has_crossed = find_crossing(events, step, i, &side) > 0;
        const struct refdyn_assessed end =
            refdyn_state_events_assess(events, step, i, t, step->state_new, step->rates_new);
        const int is_about_to =
            !(ends_on_kink && i < events->named) && side * end.rate < 0 &&
            refdyn_state_events_watches(step, i, -side) &&
            fabs(value_at_end(events, i)) <= fmax(end.noise, fabs(end.rate) * together(events, i, t));
        events->side[i] = side;
        if (is_about_to)
            events->towards[i] = -side;
        if (has_crossed || is_about_to || i == events->target)
            refdyn_state_events_add_due(events, i);
    }
}

/* No step leads away from zero. */
static void stay_on_zero(struct refdyn_state_events *events, struct refdyn_step *step, double *t_event) {
    const int target = events->target;
    refdyn_state_events_clear_due(events);
    events->side[target] = -events->towards[target];
    refdyn_state_events_add_due(events, target);
    refdyn_step_give_up(step);
    *t_event = step->t_begin;
}

/* Is the value of an event zero at the end of the step except for rounding, and do its last two samples show
 * that it is about to cross zero? */
static int ends_before_zero(const struct refdyn_state_events *events, const struct refdyn_step *step) {
    const int last = events->last;
    const double time = (events->thetas[last] - events->thetas[last - 1]) * (step->t_end - step->t_begin);
    const double near = refdyn_state_events_blur(step->t_end) / time;
    for (int i = 0; i < events->named; i++) {
        const double end = sample(events, last, i), change = end - sample(events, last - 1, i);
        if (events->side_end[i] * change < 0 && fabs(end) <= 2 * near * fabs(change))
            return 1;
    }
    return 0;
}

/* Returns a kink that counts as zero at the end of the step, to which its value has come in the step; -1:
 * there is none. */
static int find_kink_at_end(const struct refdyn_state_events *events) {
    for (int i = events->named; i < events->count; i++) {
        const double end = sample(events, events->last, i),
                     change = end - sample(events, events->last - 1, i);
        if (fabs(end) <= refdyn_kinks_width(events, i) && events->side_end[i] * change < 0)
            return i;
    }
    return -1;
}

static void keep_sides(struct refdyn_state_events *events) {
    events->tries = 0;
    note_samples(events);
    for (int i = 0; i < events->count; i++)
        events->side[i] = events->side_end[i];
}

/* The side of a value that was on `side` and is on side `now`, in a step without an event of this value. A
 * crossing in the event's direction is then rounding. */
static int side_after(const struct refdyn_step *step, int i, int side, int now) {
    return now != 0 && !refdyn_state_events_watches(step, i, now) ? now : side;
}

/* Adds event i to the ascending list of what is due, at most once. */
static void insert_due(struct refdyn_state_events *events, int i) {
    for (int k = 0; k < events->due_count; k++)
        if (events->due[k] == i)
            return;
    refdyn_state_events_add_due(events, i);
    for (int k = events->due_count - 1; k > 0 && events->due[k - 1] > i; k--) {
        events->due[k] = events->due[k - 1];
        events->due[k - 1] = i;
    }
}

/* What is due at the end of the step stays due if t is there, within rounding; contacts are found again. */
static void keep_due_at_end(struct refdyn_state_events *events, int is_at_end) {
    const int due_count = is_at_end ? events->due_count : 0;
    refdyn_state_events_clear_due(events);
    for (int k = 0; k < due_count; k++)
        if (refdyn_contact_of(&events->contacts, events->due[k]) < 0)
            refdyn_state_events_add_due(events, events->due[k]);
}

/* A value that is beyond zero at t has been carried there by rounding: its zero lies at t. */
void refdyn_state_events_stop(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                              const double *state) {
    refdyn_state_events_look_again(events, step, refdyn_step_inside(step, t), state);
    if (!refdyn_step_is_inside(step, t) ||
        refdyn_state_events_values(events, step, refdyn_step_inside(step, t), state, events->values))
        return;
    keep_due_at_end(events, step->t_end - t <= refdyn_state_events_blur(t));
    const int stays = events->due_count > 0;
    for (int i = 0; i < events->count; i++) {
        const int now = refdyn_sign_of(events->values[i] - events->offsets[i]);
        const int is_contact = refdyn_contact_of(&events->contacts, i) >= 0;
        if (!stays || is_contact)
            events->side[i] = side_after(step, i, events->side_begin[i], now);
        if (i >= events->named || is_contact || !(events->side[i] * now < 0) ||
            !refdyn_state_events_watches(step, i, now))
            continue;
        events->towards[i] = now;
        insert_due(events, i);
    }
}

/* Is the end as near to the zero as it can be? */
static int is_met(const struct refdyn_state_events *events, const struct refdyn_step *step, double distance,
                  int is_newton) {
    const int no_longer_falls = is_newton && events->tries >= TRIES_FREE && distance > events->missed / 4 &&
                                distance < rounding_part * (step->t_end - step->t_begin);
    return distance <= same_time(step) || no_longer_falls || events->tries >= TRIES_MOST;
}

/* The step is taken again, to t. */
static void try_again(struct refdyn_state_events *events, double distance, double t, double *t_event) {
    events->missed = distance;
    events->tries++;
    *t_event = t;
}

/* The value of the target has crossed zero at t. */
static void step_back(struct refdyn_state_events *events, struct refdyn_step *step, double t, double least,
                      double *t_event) {
    const double distance = step->t_end - t;
    if (t - step->t_begin < least)
        stay_on_zero(events, step, t_event);
    else if (is_met(events, step, distance, 1))
        end_on_zero(events, step);
    else {
        events->t_high = step->t_end;
        try_again(events, distance, t, t_event);
    }
}

/* Steps to a zero have ended before it: its distance by Newton's method, or half of the distance to t_high,
 * which is after the zero, if Newton leads beyond that, as at a jump or a pole. A kink may be passed by less
 * than its width; Newton's distance is then negative, and counts unless it is long, as where a value turns.
 */
static double distance_ahead(struct refdyn_state_events *events, const struct refdyn_step *step,
                             int *is_newton) {
    const int i = events->target;
    const double t = refdyn_step_inside(step, step->t_end), left = events->t_high - step->t_end;
    refdyn_state_events_evaluate(events, step, t, step->state_new);
    const struct refdyn_assessed end =
        refdyn_state_events_assess(events, step, i, t, step->state_new, step->rates_new);
    const double value = value_at_end(events, i), ahead = -value / end.rate;
    *is_newton = 1;
    if (fabs(value) <= end.noise)
        return 0;
    if (events->side[i] * value < 0)
        return ahead < 0 && -ahead < far_short * (step->t_end - step->t_begin) ? ahead : 0;
    *is_newton = ahead > 0 && ahead < left;
    return *is_newton ? ahead : left / 2;
}

static void step_ahead(struct refdyn_state_events *events, struct refdyn_step *step, double *t_event) {
    int is_newton;
    const double distance = distance_ahead(events, step, &is_newton);
    if (distance > far_short * (step->t_end - step->t_begin) && events->tries < TRIES_MOST)
        keep_sides(events);
    else if (is_met(events, step, fabs(distance), is_newton))
        end_on_zero(events, step);
    else
        try_again(events, fabs(distance), step->t_end + distance, t_event);
}

/* Is the zero of value i at theta the one to end on, and not that of the target at `first`? A kink is smooth
 * and comes first where an event jumps or has a pole. The force of a contact that rests jumps at a kink,
 * which is then the reason for its zero. */
static int comes_first(const struct refdyn_state_events *events, int i, double theta, double first) {
    if (theta < first || !isfinite(theta) || !refdyn_state_events_is_kink(events, i))
        return theta < first;
    const int contact = refdyn_contact_of(&events->contacts, events->target);
    const int is_resting = contact >= 0 && events->contacts.mode[contact] == REFDYN_CONTACT_RESTING;
    return theta <= first + (is_resting ? jump_width : same_zero);
}

/* *first: theta of the first zero in the piece, of the value events->target; INFINITY: there is none. */
static int find_first_in_piece(struct refdyn_state_events *events, struct refdyn_step *step, double least,
                               double *first) {
    double theta;
    int status = REFDYN_OK;
    for (int i = 0; i < events->count && !status; i++) {
        status = find_first(events, step, i, &theta);
        if (!status && is_passed(events, step, i, theta, least))
            status = find_first(events, step, i, &theta);
        if (comes_first(events, i, theta, *first)) {
            *first = theta;
            events->target = i;
        }
    }
    return status;
}

/* The same in the step; *reached: as in take_piece. */
static int find_first_of_all(struct refdyn_state_events *events, struct refdyn_step *step, double least,
                             double *first, double *reached) {
    *first = INFINITY;
    begin_pieces(events, step);
    for (;;) {
        int status = take_piece(events, step, reached);
        if (!status && events->last >= events->first)
            status = find_first_in_piece(events, step, least, first);
        if (status || isfinite(*first) || *reached < 1 || events->thetas[events->last] == 1)
            return status;
        begin_next_piece(events);
    }
}

/* Has the value of a kink come so near to zero in the step that inexact stages may lie beyond? The step
 * begins clear of the kink, and does not hold its stages. */
static int may_have_seen_beyond(const struct refdyn_state_events *events, const struct refdyn_step *step) {
    if (step->guard && !step->guard->only_watches)
        return 0;
    for (int i = events->named; i < events->count; i++) {
        const double begin = fabs(events->begin[i]);
        double near = begin, far = begin;
        for (int k = events->first; k <= events->last; k++) {
            near = fmin(near, fabs(sample(events, k, i)));
            far = fmax(far, fabs(sample(events, k, i)));
        }
        if (begin > refdyn_kinks_width(events, i) && near < begin && near < stages_reach * (far - near))
            return 1;
    }
    return 0;
}

/* The step is good: where should a shorter one end? */
static int look(struct refdyn_state_events *events, struct refdyn_step *step, double least, double *t_event) {
    const int target = events->target;
    const double h = step->t_end - step->t_begin;
    double first, reached;
    events->contacts.longest = fmax(events->contacts.longest, h);
    const int status = find_first_of_all(events, step, least, &first, &reached);
    if (status)
        return status;
    if (isfinite(first))
        step_back(events, step, step->t_begin + first * h, least, t_event);
    else if (reached < 1 && reached * h > least)
        *t_event = step->t_begin + reached * h;
    else if (may_have_seen_beyond(events, step)) {
        events->target = target;
        *t_event = step->t_end;
    } else if (events->held >= 0) {
        events->target = events->held;
        events->towards[events->held] = -events->side[events->held];
        end_on_zero(events, step);
    } else if (events->tries > 0) {
        events->target = target;
        step_ahead(events, step, t_event);
    } else if (find_kink_at_end(events) >= 0) {
        events->target = find_kink_at_end(events);
        events->towards[events->target] = -events->side_end[events->target];
        events->t_high = INFINITY;
        step_ahead(events, step, t_event);
    } else if (ends_before_zero(events, step)) {
        events->target = -1;
        end_on_zero(events, step);
    } else
        keep_sides(events);
    return REFDYN_OK;
}

/* The first zero in a step that was refused; INFINITY: none explains it. */
static double look_early(struct refdyn_state_events *events, struct refdyn_step *step, double least) {
    const double h = step->t_end - step->t_begin;
    double first, reached;
    events->tries = 0;
    if (events->early_tries++ >= TRIES_FREE || find_first_of_all(events, step, least, &first, &reached))
        return INFINITY;
    const double t = step->t_begin + first * h;
    return first * h >= least && first < near_end ? t : INFINITY;
}

/* ---- Their entry in the list of obstacles ---- */

/* The step is taken again to t, where a kink or another event may be. Its stages see the formulas before
 * kinks, although inexact ones may lie beyond. */
static void guard_kinks(struct refdyn_motion *motion, double t) {
    const struct refdyn_state_events *events = &motion->state_events;
    if (isfinite(t) && events->count > events->named)
        refdyn_kinks_guard(motion, 1);
}

int refdyn_state_events_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    *t = INFINITY;
    if (motion->state_events.count == 0)
        return REFDYN_OK;
    const int status = look(&motion->state_events, &motion->step, ahead->least, t);
    guard_kinks(motion, *t);
    if (status)
        refdyn_motion_failed(motion, status, motion->step.t_end);
    return status;
}

/* A step whose error is too large may have passed an event or a kink, and one whose end could not be
 * projected onto its rows a kink at which they turn. It should end there, not at some part of its length. */
double refdyn_state_events_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status) {
    struct refdyn_step *step = &motion->step;
    if (motion->state_events.count == 0)
        return INFINITY;
    if (status && (status != REFDYN_NO_CONVERGENCE || motion->work->model->kink_count == 0 ||
                   motion->options.stabilise != REFDYN_PROJECT))
        return INFINITY;
    if (status) /* back to where the method led */
        memcpy(step->state_new, step->side, (size_t)(2 * step->n) * sizeof(double));
    if (!step->has_rates_new && refdyn_rates(&step->evaluation, refdyn_step_inside(step, step->t_end),
                                             step->state_new, step->rates_new))
        return INFINITY;
    const double t = look_early(&motion->state_events, step, ahead->least);
    guard_kinks(motion, t);
    return t;
}
