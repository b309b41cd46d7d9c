/*
 * Events of the state: see motion.h.
 *
 * Takes the emitted `event` and `event_terms` and a step that was taken; gives the time at which a shorter
 * one should end, or what is due at its end. Zeros on the interpolant are found by the Illinois form of
 * regula falsi (Dowell and Jarratt, BIT 11:168-174, 1971), those of steps that fell short by Newton.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

enum { SAMPLES = REFDYN_EVENT_SAMPLES };
enum {
    TRIES_MOST = 60,   /* steps to one zero; Newton squares the distance, halving it is the last resort */
    TRIES_FREE = 4,    /* from then on, a distance that does not fall is that of rounding */
    ZEROS_MOST = 60,   /* places of an interpolant where a zero is looked for */
    REPEATS_FREE = 16, /* events without time between; and four more for each two events of the model */
    REPEATS_PAIR = 4
};
static const double rounding = 8 * DBL_EPSILON;
static const double risen_least = 16;      /* times its rounding: a value that has left zero */
static const double zero_width = 1e-13;    /* of a zero on the interpolant, over the step */
static const double rounding_part = 1e-6;  /* of a step, at most: a distance that is rounding */
static const double far_short = 0.1;       /* a step that fell so short, over its length, leads nowhere yet */
static const double clear_of_kink = 1e-10; /* of the largest value: a kink is passed beyond */
static const double at_rest = 1e-6;        /* of the fastest passage of a kink at which rows turn */
static const double near_end = 0.99;       /* of a step that is too long: a zero after it explains little */
static const double early = 0.9;           /* a zero before the first sample lies within this part of it */

/* ---- Layout ---- */

static int count_terms(const struct refdyn_model *model) {
    return (model->event_count + model->kink_count) * (1 + 2 * model->n) + model->event_count +
           model->change_count + model->event_count;
}

void refdyn_state_events_lay_out(struct refdyn_state_events *events, const struct refdyn_model *model,
                                 struct layout *layout) {
    const int count = model->event_count + model->kink_count;
    events->count = count;
    events->named = model->event_count;
    events->side = layout_ints(layout, count);
    events->side_end = layout_ints(layout, count);
    events->towards = layout_ints(layout, count);
    events->due = layout_ints(layout, count);
    events->returns = layout_ints(layout, count);
    events->samples = layout_doubles(layout, (SAMPLES + 1) * count);
    events->sizes = layout_doubles(layout, count);
    events->zeros = layout_doubles(layout, count);
    events->turned = layout_doubles(layout, count);
    events->values = layout_doubles(layout, count);
    events->rates = layout_doubles(layout, count);
    events->risen = layout_doubles(layout, count);
    events->terms = layout_doubles(layout, count > 0 ? count_terms(model) : 0);
    events->room = layout_doubles(layout, count > 0 ? 2 * model->n + 1 : 0);
    refdyn_contacts_lay_out(&events->contacts, model, layout);
}

/* ---- Values ---- */

static int sign_of(double x) {
    return (x > 0) - (x < 0);
}

static const struct refdyn_model *model_of(const struct refdyn_step *step) {
    return step->evaluation.work->model;
}

/* Is a crossing to that side of zero one of event i? */
static int watches(const struct refdyn_step *step, int i, int side) {
    const struct refdyn_model *model = model_of(step);
    const int direction = i < model->event_count ? model->events[i].direction : 0;
    return direction == 0 || direction == side;
}

static int is_kink(const struct refdyn_state_events *events, int i) {
    return i >= events->named;
}

int refdyn_state_events_values(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                               const double *state, double *values) {
    const struct refdyn_workspace *work = step->evaluation.work;
    work->model->event(work->p, work->x, t, state, state + step->n, values);
    const int status = refdyn_contacts_values(&events->contacts, step, t, state, values);
    if (status)
        return status;
    return refdyn_is_finite(values, events->count) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Values at theta of the step, on the left side of a time event at its end. */
static int values_at(struct refdyn_state_events *events, struct refdyn_step *step, double theta,
                     double *values) {
    const double t = step->t_begin + theta * (step->t_end - step->t_begin);
    int status = REFDYN_OK;
    if (theta < 1)
        status = step->method->kind->interpolate(step, theta, events->room);
    if (!status)
        status =
            refdyn_state_events_values(events, step, refdyn_step_inside(step, theta < 1 ? t : step->t_end),
                                       theta < 1 ? events->room : step->state_new, values);
    for (int i = 0; i < events->count; i++)
        values[i] -= events->zeros[i];
    return status;
}

/* What the terms tell of one value: it, its rate, and what of both is rounding. */
struct assessed {
    double noise, rate, rate_noise;
};

static struct assessed assess(const struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                              double t, const double *state, const double *rates) {
    const struct refdyn_contacts *contacts = &events->contacts;
    const int contact = refdyn_contact_of(contacts, i);
    if (contact >= 0 && contacts->mode[contact] == REFDYN_CONTACT_RESTING)
        return (struct assessed){contacts->force_noise, contacts->force_rates[contact],
                                 contacts->force_rate_noise};
    const int n = step->n;
    const double *by_q = events->terms + events->count + i * n, *by_qd = by_q + events->count * n;
    double value_size = 0, rate_size = fabs(events->terms[i]), rate = events->terms[i];
    for (int j = 0; j < n; j++) {
        value_size += fabs(by_q[j] * state[j]) + fabs(by_qd[j] * state[n + j]);
        rate_size += fabs(by_q[j] * state[n + j]) + fabs(by_qd[j] * rates[n + j]);
        rate += by_qd[j] * rates[n + j];
    }
    if (i < events->named)
        value_size = fmax(value_size, events->terms[count_terms(model_of(step)) - events->named + i]);
    return (struct assessed){rounding * (value_size + fabs(rate * t)), rate, rounding * rate_size};
}

/* Terms of a state. */
static void evaluate_terms(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                           const double *state) {
    const struct refdyn_workspace *work = step->evaluation.work;
    work->model->event_terms(work->p, work->x, t, state, state + step->n, events->terms);
    refdyn_contacts_force_rates(&events->contacts, step, t, state);
}

void refdyn_state_events_evaluate(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t, const double *state) {
    refdyn_state_events_values(events, step, t, state, events->values);
    evaluate_terms(events, step, t, state);
}

void refdyn_state_events_note(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    memcpy(events->samples, events->values, (size_t)events->count * sizeof(double));
    for (int i = 0; i < events->count; i++)
        events->rates[i] = assess(events, step, i, step->t_begin, step->state, step->rates).rate;
}

/* ---- What is due ---- */

static void clear_due(struct refdyn_state_events *events) {
    events->due_count = events->due_named = 0;
    events->is_told = 0;
    events->tries = 0;
}

static void add_due(struct refdyn_state_events *events, int i) {
    events->due[events->due_count++] = i;
    events->due_named += !is_kink(events, i);
}

/* Has one of the due events left zero, beyond rounding, since it last happened? The values and their terms
 * are those of this state. */
static int one_has_risen(const struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                         const double *state, const double *rates) {
    for (int k = 0; k < events->due_named; k++) {
        const int i = events->due[k];
        if (events->risen[i] > risen_least * assess(events, step, i, t, state, rates).noise)
            return 1;
    }
    return 0;
}

/* Events are due at t; the state is that of the step's begin or of its end. Impacts that follow each other
 * within the rounding of a distance would never end. */
void refdyn_state_events_note_due(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t) {
    const int is_end = t == step->t_end;
    if (events->due_named == 0)
        return;
    const int goes_on = fabs(t - events->t_last) > 4 * refdyn_time_resolution(t) &&
                        one_has_risen(events, step, t, is_end ? step->state_new : step->state,
                                      is_end ? step->rates_new : step->rates);
    events->repeats = goes_on ? 0 : events->repeats + 1;
    events->t_last = t;
    for (int k = 0; k < events->due_named; k++)
        events->risen[events->due[k]] = 0;
}

int refdyn_state_events_is_due(const struct refdyn_state_events *events, int i) {
    for (int k = 0; k < events->due_named; k++)
        if (events->due[k] == i)
            return 1;
    return 0;
}

int refdyn_state_events_accumulate(const struct refdyn_state_events *events) {
    return events->due_named > 0 &&
           events->repeats > REPEATS_FREE + REPEATS_PAIR * events->count * events->count;
}

/* ---- The start ---- */

/* Zero at the start is left on the side that its rate tells, from the other one. */
static void start_on_zero(struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                          const struct assessed *found) {
    const int to = fabs(found->rate) > found->rate_noise ? sign_of(found->rate) : 0;
    events->side[i] = to;
    if (to == 0 || is_kink(events, i) || !watches(step, i, to))
        return;
    events->side[i] = -to;
    events->towards[i] = to;
    add_due(events, i);
}

/* Values of contacts lie above zero, and those that close at the start are due. */
static void start_contact(struct refdyn_state_events *events, int i) {
    events->side[i] = 1;
    events->towards[i] = -1;
    if (events->contacts.is_closed[refdyn_contact_of(&events->contacts, i)])
        add_due(events, i);
}

int refdyn_state_events_start(struct refdyn_state_events *events, const struct refdyn_step *step) {
    clear_due(events);
    events->t_last = -INFINITY;
    events->repeats = events->looks_again = 0;
    if (events->count == 0)
        return REFDYN_OK;
    memset(events->returns, 0, (size_t)events->count * sizeof *events->returns);
    for (int i = 0; i < events->count; i++)
        events->risen[i] = INFINITY;
    memset(events->turned, 0, (size_t)events->count * sizeof *events->turned);
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    if (!refdyn_is_finite(events->values, events->count))
        return REFDYN_NOT_FINITE;
    for (int i = 0; i < events->count; i++) {
        const struct assessed found = assess(events, step, i, step->t_begin, step->state, step->rates);
        events->sizes[i] = fabs(events->values[i]);
        if (refdyn_contact_of(&events->contacts, i) >= 0)
            start_contact(events, i);
        else if (fabs(events->values[i]) > found.noise)
            events->side[i] = sign_of(events->values[i]);
        else
            start_on_zero(events, step, i, &found);
    }
    refdyn_state_events_note_due(events, step, step->t_begin);
    return REFDYN_OK;
}

/* ---- The begin of a step ---- */

/* A value that lies clear of zero on the other side than it was, without a way there. */
static void jump(struct refdyn_state_events *events, const struct refdyn_step *step, int i, double value) {
    const int before = events->side[i], now = sign_of(value);
    events->side[i] = events->towards[i] = now;
    if (before == -now && !is_kink(events, i) && watches(step, i, now))
        add_due(events, i);
}

static void look_for_jumps(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->count; i++)
        if (fabs(events->values[i]) > assess(events, step, i, step->t_begin, step->state, step->rates).noise)
            jump(events, step, i, events->values[i]);
    refdyn_state_events_note_due(events, step, step->t_begin);
}

/* A value that has crossed zero before the step and is still beyond it, by rounding or by the error of the
 * step that led there, is zero at its begin. */
static void place_zeros(struct refdyn_state_events *events) {
    for (int i = 0; i < events->count; i++) {
        const double begin = events->samples[i];
        events->zeros[i] = !is_kink(events, i) && events->side[i] * begin < 0 ? begin : 0;
        events->samples[i] -= events->zeros[i];
    }
}

int refdyn_state_events_begin(struct refdyn_state_events *events, const struct refdyn_step *step) {
    events->tries = events->early_tries = 0;
    if (events->count == 0)
        return REFDYN_OK;
    if (events->looks_again && events->due_count == 0)
        look_for_jumps(events, step);
    events->looks_again = 0;
    const int status = refdyn_state_events_values(events, step, step->t_begin, step->state, events->samples);
    if (!status)
        refdyn_contacts_end_allowances(&events->contacts, step->t_begin, events->samples);
    for (int i = 0; i < events->count && !status;
         i++) /* of no step that is refused, which may lead anywhere */
        events->sizes[i] = fmax(events->sizes[i], fabs(events->samples[i]));
    place_zeros(events);
    return status;
}

/* Is the value that was due another one than before its action, and not by rounding? */
static int is_set(double value, double before, double noise) {
    return value != before && fabs(value) > noise && fabs(value - before) > noise;
}

/* Do coordinates or rates move the value of event i? Those of a step function do not. */
static int is_moved_by_state(const struct refdyn_state_events *events, const struct refdyn_step *step,
                             int i) {
    const int n = step->n;
    const double *by_q = events->terms + events->count + i * n, *by_qd = by_q + events->count * n;
    for (int j = 0; j < n; j++)
        if (by_q[j] != 0 || by_qd[j] != 0)
            return 1;
    return 0;
}

/* Is event i an impact, or does it set rates? */
static int sets_rates(const struct refdyn_model *model, int i) {
    const struct refdyn_event *event = &model->events[i];
    int sets = event->is_impact;
    for (int k = event->first_change; k < event->first_change + event->change_count; k++)
        sets |= model->changes[k].what == REFDYN_CHANGED_RATE;
    return sets;
}

/* Does the crossing of a value that was due stand? One that has jumped is beyond zero already, and rates that
 * are set turn no step function. Another value that its event leaves alone goes on, unless the event of
 * another one has turned it; contacts have to turn theirs, however often. */
static int has_crossed_for_good(const struct refdyn_state_events *events, const struct refdyn_step *step,
                                int i, int rate_side) {
    if (is_kink(events, i))
        return 0;
    const int is_turned = rate_side != 0 && rate_side != sign_of(events->rates[i]);
    return events->side[i] == events->towards[i] ||
           (!is_turned &&
            (!sets_rates(model_of(step), i) || (rate_side == 0 && !is_moved_by_state(events, step, i))));
}

/* The side of a value that was due and that its action has not set. 0: its rate does not tell. */
static int side_behind(const struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                       const struct assessed *now) {
    const int has_rate = fabs(now->rate) > fmax(now->rate_noise, rounding * fabs(events->rates[i]));
    const int rate_side = has_rate ? sign_of(now->rate) : 0;
    return has_crossed_for_good(events, step, i, rate_side) ? events->towards[i] : rate_side;
}

void refdyn_state_events_settle(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const int due_count = events->due_count;
    const double *before = events->samples;
    clear_due(events);
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0, k = 0; i < events->count; i++) {
        const struct assessed now = assess(events, step, i, step->t_begin, step->state, step->rates);
        const double value = events->values[i];
        const int was_due = k < due_count && events->due[k] == i;
        k += was_due;
        if (refdyn_contact_of(&events->contacts, i) >= 0)
            events->side[i] = 1; /* in any mode */
        else if (was_due && !is_set(value, before[i], now.noise))
            events->side[i] = side_behind(events, step, i, &now);
        else if (was_due)
            events->side[i] = sign_of(value);
        else if (fabs(value) > now.noise)
            jump(events, step, i, value);
    }
    refdyn_state_events_note_due(events, step, step->t_begin);
}

/* At this distance from zero, rounding does not affect on which side of kink i a state lies. */
static double margin_of(const struct refdyn_state_events *events, int i, double noise) {
    return fmax(4 * noise, DBL_EPSILON * events->sizes[i]);
}

/* Moves the state along the derivatives `by` (n) of a value, so that it changes so much. */
static int move_along(const double *by, int n, double change, double *state) {
    const double square = dense_dot(by, by, n);
    if (square > 0)
        dense_add(state, change / square, by, n);
    return square > 0;
}

int refdyn_state_events_leave_kinks(struct refdyn_state_events *events, const struct refdyn_step *step,
                                    int side, double *state) {
    const int n = step->n;
    int has_moved = 0;
    for (int k = events->due_named; k < events->due_count; k++) {
        const int i = events->due[k];
        const int to = side * events->towards[i];
        refdyn_state_events_evaluate(events, step, step->t_begin, state);
        const struct assessed now = assess(events, step, i, step->t_begin, state, step->rates);
        const double change = to * margin_of(events, i, now.noise) - events->values[i];
        const double *by_qd = refdyn_state_events_by_qd(events, n, i);
        if (to * change > 0)
            has_moved |= move_along(by_qd, n, change, state + n) ||
                         move_along(by_qd - events->count * n, n, change, state);
    }
    return has_moved;
}

int refdyn_state_events_lead_back(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int k = events->due_named; k < events->due_count; k++) {
        const int i = events->due[k];
        const double rate = assess(events, step, i, step->t_begin, step->state, step->rates).rate;
        events->turned[i] = fmax(events->turned[i], fabs(events->rates[i]));
        if (events->towards[i] * rate <= at_rest * events->turned[i])
            return 1;
    }
    return 0;
}

/* ---- Zeros on the interpolant ---- */

static double sample(const struct refdyn_state_events *events, int k, int i) {
    return events->samples[k * events->count + i];
}

static int value_at(struct refdyn_state_events *events, struct refdyn_step *step, int i, double theta,
                    double *value) {
    const int status = values_at(events, step, theta, events->values);
    *value = events->values[i];
    return status;
}

/* Between a, before the crossing, and b, behind it, with the values there. */
static int find_zero(struct refdyn_state_events *events, struct refdyn_step *step, int i, double a, double va,
                     double b, double vb, double *theta) {
    double value, last = -1;
    int moved = 0;
    *theta = b;
    for (int k = 0; k < ZEROS_MOST && b - a > zero_width && fabs(*theta - last) > zero_width; k++) {
        double x = a + (b - a) * (va / (va - vb));
        x = x > a && x < b ? x : a + (b - a) / 2;
        const int status = value_at(events, step, i, x, &value);
        if (status)
            return status;
        last = *theta;
        *theta = x;
        if ((value > 0) == (va > 0) && value != 0) {
            vb = moved < 0 ? vb / 2 : vb;
            a = x, va = value, moved = -1;
        } else {
            va = moved > 0 ? va / 2 : va;
            b = x, vb = value, moved = 1;
        }
    }
    return REFDYN_OK;
}

/* Between a, where the value is zero, and b, where it no longer is: where it leaves zero. */
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

/* Behind a begin from which a value first leaves zero, in the first part of the step: the parabola through
 * the begin, with its rate, and the first sample tells where it is farthest, and, where that shows nothing on
 * the interpolant either, where it is back. */
static int find_return(struct refdyn_state_events *events, struct refdyn_step *step, int i, int side,
                       double rise, double *theta) {
    const double part = 1.0 / SAMPLES, first = sample(events, 1, i);
    const double back = rise / (rise - (first - sample(events, 0, i)));
    double value;
    *theta = part * (back > 0 && back < early ? back : early);
    const int status = value_at(events, step, i, *theta / 2, &value);
    if (status || !(side * value > 0))
        return status;
    return find_zero(events, step, i, *theta / 2, value, part, first, theta);
}

/* Before the first sample, which lies beyond zero. */
static int find_near_begin(struct refdyn_state_events *events, struct refdyn_step *step, int i, int side,
                           double *theta) {
    const double part = 1.0 / SAMPLES, begin = sample(events, 0, i);
    evaluate_terms(events, step, step->t_begin, step->state);
    const struct assessed found = assess(events, step, i, step->t_begin, step->state, step->rates);
    if (side * found.rate > found.rate_noise)
        return find_return(events, step, i, side, found.rate * part * (step->t_end - step->t_begin), theta);
    *theta = 0;
    if (begin == 0 && fabs(found.rate) <= found.rate_noise)
        return find_leave(events, step, i, 0, part, theta);
    return side * begin > 0 ? find_zero(events, step, i, 0, begin, part, sample(events, 1, i), theta)
                            : REFDYN_OK;
}

/* May a value that has kept its side have been beyond zero between three samples? *theta: the first zero
 * then. */
static int find_dip(struct refdyn_state_events *events, struct refdyn_step *step, int i, int middle, int side,
                    double *theta) {
    struct dip dip;
    double x, v, value;
    for (int k = 0; k < 3; k++) {
        dip.x[k] = (double)(middle - 1 + k) / SAMPLES;
        dip.v[k] = side * sample(events, middle - 1 + k, i);
    }
    const double begin = dip.x[0], least = fmin(dip.v[0], fmin(dip.v[1], dip.v[2]));
    for (int tries = 0; tries < DIPS_MOST && dip_bottom(&dip, &x, &v) && v < least / 2; tries++) {
        const int status = value_at(events, step, i, x, &value);
        if (status)
            return status;
        if (side * value < 0)
            return find_zero(events, step, i, begin, sample(events, middle - 1, i), x, value, theta);
        dip_narrow(&dip, x, side * value);
    }
    return REFDYN_OK;
}

static int find_dips(struct refdyn_state_events *events, struct refdyn_step *step, int i, double *theta) {
    const int side = events->side[i];
    int status = REFDYN_OK;
    if (side == 0 || !watches(step, i, -side))
        return REFDYN_OK;
    for (int k = 0; k <= SAMPLES; k++)
        if (!(side * sample(events, k, i) > 0))
            return REFDYN_OK;
    for (int k = 1; k < SAMPLES && !status && !isfinite(*theta); k++)
        status = find_dip(events, step, i, k, side, theta);
    if (isfinite(*theta))
        events->towards[i] = -side;
    return status;
}

/* On which side of zero a sample lies; that of a kink has to be clear of it. */
static int side_at(const struct refdyn_state_events *events, int k, int i) {
    const double value = sample(events, k, i);
    return is_kink(events, i) && fabs(value) <= clear_of_kink * events->sizes[i] ? 0 : sign_of(value);
}

/* The sample behind the first crossing in the event's direction, and the side that it was on before; 0: there
 * is none. side_end: where it is at the end. */
static int find_crossing(struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                         int *side) {
    *side = events->side[i];
    for (int k = 1; k <= SAMPLES; k++) {
        const int now = side_at(events, k, i);
        if (now == 0 || now == *side)
            continue;
        if (watches(step, i, now) && (*side != 0 || !is_kink(events, i))) {
            *side = -now;
            events->towards[i] = now;
            return k;
        }
        *side = now;
    }
    events->side_end[i] = *side;
    return 0;
}

/* Where event i first happens in the step; INFINITY: nowhere. */
static int find_first(struct refdyn_state_events *events, struct refdyn_step *step, int i, double *theta) {
    int side;
    const int k = find_crossing(events, step, i, &side);
    *theta = INFINITY;
    if (k == 0)
        return find_dips(events, step, i, theta);
    if (k == 1)
        return find_near_begin(events, step, i, side, theta);
    const double before = sample(events, k - 1, i);
    *theta = (double)(k - 1) / SAMPLES;
    if (before == 0)
        return find_leave(events, step, i, *theta, (double)k / SAMPLES, theta);
    return side * before > 0
               ? find_zero(events, step, i, *theta, before, (double)k / SAMPLES, sample(events, k, i), theta)
               : REFDYN_OK;
}

/* ---- A step that was taken ---- */

static int take_samples(struct refdyn_state_events *events, struct refdyn_step *step) {
    int status = REFDYN_OK;
    for (int k = 1; k <= SAMPLES && !status; k++)
        status = values_at(events, step, (double)k / SAMPLES, events->samples + k * events->count);
    return status;
}

/* May rows turn at value i? They may at kinks of positions. The terms are those of any state. */
static int may_turn_rows(const struct refdyn_state_events *events, const struct refdyn_step *step, int i) {
    const double *by_qd = refdyn_state_events_by_qd(events, step->n, i);
    return is_kink(events, i) && model_of(step)->m > 0 && refdyn_largest(by_qd, step->n, NULL) == 0;
}

/* A kink at the begin of the step is passed; nothing happens there, unless rows turn. */
static int is_passed(struct refdyn_state_events *events, const struct refdyn_step *step, int i, double theta,
                     double least) {
    if (!is_kink(events, i) || !(theta * (step->t_end - step->t_begin) < least))
        return 0;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    if (may_turn_rows(events, step, i))
        return 0;
    events->side[i] = -events->side[i];
    return 1;
}

/* Moves a state in the step that has passed such a kink by rounding only back before it. Returns the kink,
 * -1: there is none. */
static int move_before_kinks(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state) {
    int held = -1;
    if (events->named == events->count || model_of(step)->m == 0 ||
        refdyn_state_events_values(events, step, t, state, events->values))
        return -1;
    for (int i = events->named; i < events->count; i++) {
        const double value = events->values[i];
        if (events->side[i] == 0 || events->side[i] * value > 0 ||
            fabs(value) > clear_of_kink * events->sizes[i])
            continue;
        refdyn_state_events_evaluate(events, step, t, state);
        const double *by_q = events->terms + events->count + i * step->n;
        const double before =
            fmax(fabs(value), margin_of(events, i, assess(events, step, i, t, state, step->rates).noise));
        if (may_turn_rows(events, step, i) &&
            move_along(by_q, step->n, events->side[i] * before - value, state))
            held = i;
    }
    return held;
}

void refdyn_state_events_end_before_kinks(struct refdyn_state_events *events, struct refdyn_step *step) {
    events->held = move_before_kinks(events, step, refdyn_step_inside(step, step->t_end), step->state_new);
}

void refdyn_state_events_see_before_kinks(struct refdyn_state_events *events, const struct refdyn_step *step,
                                          double t, double *state) {
    move_before_kinks(events, step, refdyn_step_inside(step, t), state);
}

/* Times that are one. */
static double same_time(const struct refdyn_step *step) {
    return fmax(2 * refdyn_time_resolution(step->t_end), rounding * (step->t_end - step->t_begin));
}

double refdyn_state_events_blur(double t) {
    return 16 * refdyn_time_resolution(t);
}

/* The value of event i at the end of the step, where it was evaluated. */
static double value_at_end(const struct refdyn_state_events *events, int i) {
    return events->values[i] - events->zeros[i];
}

/* The step is accepted: notes how far from zero the values were in it. */
static void note_samples(struct refdyn_state_events *events) {
    for (int k = 1; k <= SAMPLES; k++)
        for (int i = 0; i < events->named; i++)
            events->risen[i] = fmax(events->risen[i], fabs(sample(events, k, i)));
}

/* The step is good. What has crossed zero in it is due, and what is about to at the same time. */
static void end_on_zero(struct refdyn_state_events *events, struct refdyn_step *step) {
    const double t = refdyn_step_inside(step, step->t_end);
    clear_due(events);
    note_samples(events);
    refdyn_state_events_evaluate(events, step, t, step->state_new);
    for (int i = 0; i < events->count; i++) {
        int side;
        const int has_crossed = find_crossing(events, step, i, &side) > 0;
        const struct assessed end = assess(events, step, i, t, step->state_new, step->rates_new);
        const int is_about_to =
            side * end.rate < 0 && watches(step, i, -side) &&
            fabs(value_at_end(events, i)) <= fmax(end.noise, fabs(end.rate) * refdyn_state_events_blur(t));
        events->side[i] = side;
        if (is_about_to)
            events->towards[i] = -side;
        if (has_crossed || is_about_to || i == events->target)
            add_due(events, i);
    }
    refdyn_state_events_note_due(events, step, step->t_end);
}

/* No step leads away from zero. */
static void stay_on_zero(struct refdyn_state_events *events, struct refdyn_step *step, double *t_event) {
    const int target = events->target;
    clear_due(events);
    events->side[target] = -events->towards[target];
    add_due(events, target);
    refdyn_step_give_up(step);
    refdyn_state_events_note_due(events, step, step->t_begin);
    *t_event = step->t_begin;
}

/* Do the last two samples of an event say that it is about to cross zero at the end of the step, where it is
 * zero but for rounding? */
static int ends_before_zero(const struct refdyn_state_events *events, const struct refdyn_step *step) {
    const double per_time = SAMPLES / (step->t_end - step->t_begin);
    const double near = per_time * refdyn_state_events_blur(step->t_end);
    for (int i = 0; i < events->named; i++) {
        const double end = sample(events, SAMPLES, i), change = end - sample(events, SAMPLES - 1, i);
        if (events->side_end[i] * change < 0 && fabs(end) <= 2 * near * fabs(change))
            return 1;
    }
    return 0;
}

static void keep_sides(struct refdyn_state_events *events) {
    events->tries = 0;
    note_samples(events);
    for (int i = 0; i < events->count; i++)
        events->side[i] = events->side_end[i];
}

/* Does the end lie on zero as nearly as it can? */
static int is_met(const struct refdyn_state_events *events, const struct refdyn_step *step, double distance) {
    const int no_longer_falls = events->tries >= TRIES_FREE && distance > events->missed / 4 &&
                                distance < rounding_part * (step->t_end - step->t_begin);
    return distance <= same_time(step) || no_longer_falls || events->tries >= TRIES_MOST;
}

/* Another step, to t. */
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
    else if (is_met(events, step, distance))
        end_on_zero(events, step);
    else {
        events->t_high = step->t_end;
        try_again(events, distance, t, t_event);
    }
}

/* Steps to a zero have fallen short: how far it lies ahead, by Newton; half of what is left where that is not
 * before the end that lay behind it. */
static double distance_ahead(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const int i = events->target;
    const double t = refdyn_step_inside(step, step->t_end), left = events->t_high - step->t_end;
    refdyn_state_events_evaluate(events, step, t, step->state_new);
    const struct assessed end = assess(events, step, i, t, step->state_new, step->rates_new);
    const double value = value_at_end(events, i);
    if (fabs(value) <= end.noise)
        return 0;
    const double ahead = -value / end.rate;
    return ahead > 0 && ahead < left ? ahead : left / 2;
}

static void step_ahead(struct refdyn_state_events *events, struct refdyn_step *step, double *t_event) {
    const double distance = distance_ahead(events, step);
    if (distance > far_short * (step->t_end - step->t_begin) && events->tries < TRIES_MOST)
        keep_sides(events);
    else if (is_met(events, step, distance))
        end_on_zero(events, step);
    else
        try_again(events, distance, step->t_end + distance, t_event);
}

/* The first zero of all values in the step, as its theta, and of which; INFINITY: there is none. */
static int find_first_of_all(struct refdyn_state_events *events, struct refdyn_step *step, double least,
                             double *first) {
    double theta;
    int status = take_samples(events, step);
    *first = INFINITY;
    for (int i = 0; i < events->count && !status; i++) {
        status = find_first(events, step, i, &theta);
        if (!status && is_passed(events, step, i, theta, least))
            status = find_first(events, step, i, &theta);
        if (theta < *first) {
            *first = theta;
            events->target = i;
        }
    }
    return status;
}

/* The step is good: where should a shorter one end? */
static int look(struct refdyn_state_events *events, struct refdyn_step *step, double least, double *t_event) {
    const int target = events->target;
    double first;
    events->contacts.longest = fmax(events->contacts.longest, step->t_end - step->t_begin);
    const int status = find_first_of_all(events, step, least, &first);
    if (status)
        return status;
    if (isfinite(first))
        step_back(events, step, step->t_begin + first * (step->t_end - step->t_begin), least, t_event);
    else if (events->held >= 0) {
        events->target = events->held;
        events->towards[events->held] = -events->side[events->held];
        end_on_zero(events, step);
    } else if (events->tries > 0) {
        events->target = target;
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
    double first;
    events->tries = 0;
    if (events->early_tries++ >= TRIES_FREE || find_first_of_all(events, step, least, &first))
        return INFINITY;
    return first * h >= least && first < near_end ? step->t_begin + first * h : INFINITY;
}

/* ---- Their entry in the list of obstacles ---- */

int refdyn_state_events_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    *t = INFINITY;
    if (motion->state_events.count == 0)
        return REFDYN_OK;
    const int status = look(&motion->state_events, &motion->step, ahead->least, t);
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
    return look_early(&motion->state_events, step, ahead->least);
}
