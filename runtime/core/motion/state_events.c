/*
 * State events: values, the side of zero of each, and what is due.
 *
 * In: the emitted `event` and `event_terms`, and the state at the beginning of a step. Out: which events are
 * due there, at a start, because values have jumped, or after the actions of others. event_zeros.c finds
 * those inside steps.
 *
 * The motion keeps on which side of zero each value is, so that rounding does not count. After an event it is
 * the side to which the crossing led. If an action has turned the value, it follows from the value's rate. A
 * value that is zero at the start is an event if it leaves zero in the event's direction.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
    REPEATS_FREE = 16, /* bound on the events without time between, */
    REPEATS_PAIR = 4   /* raised by this for each two events of the model */
};
/* Rounding of a value, relative to its terms. */
static const double rounding = 8 * DBL_EPSILON;
/* A value has left zero when it exceeds this multiple of its rounding. */
static const double risen_least = 16;

/* ---- Layout ---- */

int refdyn_event_terms_changes(const struct refdyn_model *model) {
    return (model->event_count + model->kink_count) * (1 + 2 * model->n) + model->event_count;
}

int refdyn_event_terms_count(const struct refdyn_model *model) {
    return refdyn_event_terms_changes(model) + model->change_count + model->event_count;
}

void refdyn_state_events_lay_out(struct refdyn_state_events *events, const struct refdyn_model *model,
                                 struct layout *layout) {
    const int count = model->event_count + model->kink_count;
    events->count = count;
    events->named = model->event_count;
    events->side = layout_ints(layout, count);
    events->side_from = layout_ints(layout, count);
    events->side_begin = layout_ints(layout, count);
    events->side_end = layout_ints(layout, count);
    events->towards = layout_ints(layout, count);
    events->due = layout_ints(layout, count);
    events->passed = layout_ints(layout, count);
    events->returns = layout_ints(layout, count);
    events->is_met = layout_ints(layout, count);
    events->begin = layout_doubles(layout, count);
    events->samples = layout_doubles(layout, (REFDYN_EVENT_SAMPLES + 1) * count);
    events->offsets = layout_doubles(layout, count);
    events->most = layout_doubles(layout, count);
    events->sizes = layout_doubles(layout, count);
    events->zeros = layout_doubles(layout, count);
    events->turned = layout_doubles(layout, count);
    events->values = layout_doubles(layout, count);
    events->rates = layout_doubles(layout, count);
    events->risen = layout_doubles(layout, count);
    events->visited = layout_doubles(layout, count);
    events->terms = layout_doubles(layout, count > 0 ? refdyn_event_terms_count(model) : 0);
    events->room = layout_doubles(layout, count > 0 ? 2 * model->n + 1 : 0);
    refdyn_contacts_lay_out(&events->contacts, model, layout);
}

/* ---- Values ---- */

static const struct refdyn_model *model_of(const struct refdyn_step *step) {
    return step->evaluation.work->model;
}

int refdyn_state_events_watches(const struct refdyn_step *step, int i, int side) {
    const struct refdyn_model *model = model_of(step);
    const int direction = i < model->event_count ? model->events[i].direction : 0;
    return direction == 0 || direction == side;
}

int refdyn_state_events_values(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                               const double *state, double *values) {
    const struct refdyn_workspace *work = step->evaluation.work;
    work->model->event(work->p, work->x, t, state, state + step->n, values);
    const int status = refdyn_contacts_values(&events->contacts, step, t, state, values);
    if (status)
        return status;
    for (int i = 0; i < events->named; i++)
        if (isnan(values[i]))
            return REFDYN_NOT_FINITE; /* an infinite value is a pole */
    return refdyn_is_finite(values + events->named, events->count - events->named) ? REFDYN_OK
                                                                                   : REFDYN_NOT_FINITE;
}

struct refdyn_assessed refdyn_state_events_assess(const struct refdyn_state_events *events,
                                                  const struct refdyn_step *step, int i, double t,
                                                  const double *state, const double *rates) {
    const struct refdyn_contacts *contacts = &events->contacts;
    const int contact = refdyn_contact_of(contacts, i);
    if (contact >= 0 && contacts->mode[contact] == REFDYN_CONTACT_RESTING)
        return (struct refdyn_assessed){.noise = contacts->force_noise,
                                        .noise_at_time = contacts->force_noise,
                                        .rate = contacts->force_rates[contact],
                                        .rate_noise = contacts->force_rate_noise};
    const int n = step->n;
    const double *by_q = events->terms + events->count + i * n, *by_qd = by_q + events->count * n;
    double value_size = 0, rate_size = fabs(events->terms[i]), rate = events->terms[i];
    for (int j = 0; j < n; j++) {
        value_size += fabs(by_q[j] * state[j]) + fabs(by_qd[j] * state[n + j]);
        rate_size += fabs(by_q[j] * state[n + j]) + fabs(by_qd[j] * rates[n + j]);
        rate += by_qd[j] * rates[n + j];
    }
    if (i < events->named)
        value_size =
            fmax(value_size, events->terms[refdyn_event_terms_count(model_of(step)) - events->named + i]);
    return (struct refdyn_assessed){.noise = rounding * (value_size + fabs(rate * t)),
                                    .noise_at_time = rounding * value_size,
                                    .rate = rate,
                                    .rate_noise = rounding * rate_size};
}

void refdyn_state_events_evaluate_terms(struct refdyn_state_events *events, const struct refdyn_step *step,
                                        double t, const double *state) {
    const struct refdyn_workspace *work = step->evaluation.work;
    work->model->event_terms(work->p, work->x, t, state, state + step->n, events->terms);
    refdyn_contacts_force_rates(&events->contacts, step, t, state);
}

void refdyn_state_events_evaluate(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t, const double *state) {
    refdyn_state_events_values(events, step, t, state, events->values);
    refdyn_state_events_evaluate_terms(events, step, t, state);
}

double refdyn_state_events_blur(double t) {
    return 16 * refdyn_time_resolution(t);
}

/* ---- What is due ---- */

void refdyn_state_events_clear_due(struct refdyn_state_events *events) {
    events->due_count = events->due_named = 0;
    events->is_told = 0;
    events->tries = 0;
}

void refdyn_state_events_add_due(struct refdyn_state_events *events, int i) {
    events->due[events->due_count++] = i;
    events->due_named += !refdyn_state_events_is_kink(events, i);
}

void refdyn_state_events_forget(struct refdyn_state_events *events) {
    refdyn_state_events_clear_due(events);
    events->looks_again = 0;
}

void refdyn_state_events_look_again(struct refdyn_state_events *events, const struct refdyn_step *step,
                                    double t, const double *state) {
    if (events->looks_again || events->count == 0)
        return;
    events->looks_again = 1;
    if (refdyn_state_events_values(events, step, t, state, events->begin))
        for (int i = 0; i < events->count; i++)
            events->begin[i] = NAN; /* the values after it are compared with zero alone */
}

int refdyn_state_events_report(struct refdyn_state_events *events, int ends) {
    const int count = events->is_told && !ends ? 0 : events->due_named;
    events->is_told = !ends;
    return count;
}

/* Has one of the due events left zero, beyond rounding, since it last happened? The terms are those of the
 * beginning of the step. */
static int one_has_risen(const struct refdyn_state_events *events, const struct refdyn_step *step) {
    for (int k = 0; k < events->due_named; k++) {
        const int i = events->due[k];
        if (events->risen[i] >
            risen_least *
                refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates).noise)
            return 1;
    }
    return 0;
}

/* Impacts that follow each other within the rounding of a distance would never end: they count as repeats. */
static void note_due(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const double t = step->t_begin;
    if (events->due_named == 0)
        return;
    const int goes_on =
        fabs(t - events->t_last) > 4 * refdyn_time_resolution(t) && one_has_risen(events, step);
    events->repeats = goes_on ? 0 : events->repeats + 1;
    events->t_last = t;
    for (int k = 0; k < events->due_named; k++)
        events->risen[events->due[k]] = 0;
}

void refdyn_state_events_note(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    if (!events->looks_again)
        memcpy(events->begin, events->values, (size_t)events->count * sizeof(double));
    for (int i = 0; i < events->count; i++)
        events->rates[i] =
            refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates).rate;
    note_due(events, step);
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

/* ---- Jumps ---- */

/* Does the value of event i depend on coordinates or rates? That of a step function does not. */
static int is_moved_by_state(const struct refdyn_state_events *events, const struct refdyn_step *step,
                             int i) {
    const int n = step->n;
    const double *by_q = events->terms + events->count + i * n, *by_qd = by_q + events->count * n;
    for (int j = 0; j < n; j++)
        if (by_q[j] != 0 || by_qd[j] != 0)
            return 1;
    return 0;
}

/* Value i has changed from `before` without a step. It may now be clear of zero, perhaps on another side. If
 * an error had carried it beyond zero, it counted as zero, and only the change since then counts. */
static void jump(struct refdyn_state_events *events, const struct refdyn_step *step, int i, double before,
                 double noise) {
    const int side = events->side[i], is_kink = refdyn_state_events_is_kink(events, i);
    const double value = events->values[i], clear = !is_kink && side * before < 0 ? value - before : value;
    const int now = refdyn_sign_of(clear);
    if (!(fabs(clear) > noise))
        return;
    events->side[i] = events->towards[i] = now;
    if (side != now && !is_kink && refdyn_state_events_watches(step, i, now))
        refdyn_state_events_add_due(events, i);
}

/* The values and terms are those of the beginning of the step. */
static void look_for_jump(struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                          double before) {
    const struct refdyn_assessed now =
        refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
    jump(events, step, i, before, is_moved_by_state(events, step, i) ? now.noise : now.noise_at_time);
}

/* ---- The start ---- */

/* A value that is zero at the start leaves zero as if it came from the other side. A time event there may
 * have carried it to a side; otherwise its rate decides. The values and terms are those right of the start.
 */
static void start_on_zero(struct refdyn_state_events *events, const struct refdyn_step *step, int i) {
    const double value = events->values[i];
    const struct refdyn_assessed found =
        refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
    const int to = fabs(value) > found.noise             ? refdyn_sign_of(value)
                   : fabs(found.rate) > found.rate_noise ? refdyn_sign_of(found.rate)
                                                         : 0;
    events->side[i] = to;
    if (to == 0 || refdyn_state_events_is_kink(events, i) || !refdyn_state_events_watches(step, i, to))
        return;
    events->side[i] = -to;
    events->towards[i] = to;
    refdyn_state_events_add_due(events, i);
}

/* Values of contacts lie above zero, and those that close at the start are due. */
static void start_contact(struct refdyn_state_events *events, int i) {
    events->side[i] = 1;
    events->towards[i] = -1;
    if (events->contacts.is_closed[refdyn_contact_of(&events->contacts, i)])
        refdyn_state_events_add_due(events, i);
}

/* Clears what the previous motion has left. */
static void clear(struct refdyn_state_events *events) {
    refdyn_state_events_forget(events);
    events->t_last = -INFINITY;
    events->repeats = 0;
    if (events->count == 0)
        return;
    memset(events->is_met, 0, (size_t)events->count * sizeof *events->is_met);
    memset(events->returns, 0, (size_t)events->count * sizeof *events->returns);
    memset(events->turned, 0, (size_t)events->count * sizeof *events->turned);
    for (int i = 0; i < events->count; i++)
        events->risen[i] = INFINITY;
}

/* Sets the side of each value at t; 0: it is zero there. Error: NOT_FINITE. */
static int find_sides(struct refdyn_state_events *events, const struct refdyn_step *step, double t) {
    const int status = refdyn_state_events_values(events, step, t, step->state, events->values);
    refdyn_state_events_evaluate_terms(events, step, t, step->state);
    for (int i = 0; i < events->count && !status; i++) {
        const double value = events->values[i];
        const double noise = refdyn_state_events_assess(events, step, i, t, step->state, step->rates).noise;
        events->sizes[i] = fabs(value);
        events->side[i] = fabs(value) > noise ? refdyn_sign_of(value) : 0;
    }
    return status;
}

int refdyn_state_events_start(struct refdyn_state_events *events, const struct refdyn_step *step, double t) {
    clear(events);
    if (events->count == 0)
        return REFDYN_OK;
    const int status = find_sides(events, step, t);
    if (status)
        return status;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->count; i++)
        if (refdyn_contact_of(&events->contacts, i) >= 0)
            start_contact(events, i);
        else if (events->side[i] == 0)
            start_on_zero(events, step, i);
        else
            look_for_jump(events, step, i, 0);
    return REFDYN_OK;
}

/* ---- The beginning of a step ---- */

static void look_for_jumps(struct refdyn_state_events *events, const struct refdyn_step *step) {
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->count; i++)
        look_for_jump(events, step, i, events->begin[i]);
}

/* A value that crossed zero before the step may still be beyond it, by rounding or by the error of the step
 * that led there. Then its value at the beginning counts as zero. */
static void place_zeros(struct refdyn_state_events *events) {
    for (int i = 0; i < events->count; i++) {
        const double begin = events->begin[i];
        events->zeros[i] = !refdyn_state_events_is_kink(events, i) && events->side[i] * begin < 0 ? begin : 0;
        events->begin[i] -= events->zeros[i];
    }
}

int refdyn_state_events_begin(struct refdyn_state_events *events, const struct refdyn_step *step) {
    events->tries = events->early_tries = events->passed_count = 0;
    if (events->count == 0)
        return REFDYN_OK;
    if (events->looks_again)
        look_for_jumps(events, step);
    events->looks_again = 0;
    memcpy(events->side_begin, events->side, (size_t)events->count * sizeof *events->side);
    const int status = refdyn_state_events_values(events, step, step->t_begin, step->state, events->begin);
    if (!status)
        refdyn_contacts_end_allowances(&events->contacts, step->t_begin, events->begin);
    for (int i = 0; i < events->count && !status; i++) /* not of refused steps, which may lead anywhere */
        events->sizes[i] = fmax(events->sizes[i], fabs(events->begin[i]));
    place_zeros(events);
    return status;
}

void refdyn_state_events_go_on(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const int due_count = events->due_count, is_told = events->is_told;
    if (due_count == 0)
        return;
    refdyn_state_events_clear_due(events);
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int k = 0; k < due_count; k++) {
        const int i = events->due[k];
        const struct refdyn_assessed now =
            refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
        const double blur = fabs(now.rate) * refdyn_state_events_blur(step->t_begin);
        if (!(-events->towards[i] * (events->values[i] - events->begin[i]) > fmax(now.noise, blur)))
            refdyn_state_events_add_due(events, i);
    }
    events->is_told = is_told && events->due_named > 0;
}

/* Has its action changed the value that was due, by more than rounding? */
static int is_set(double value, double before, double noise) {
    return value != before && fabs(value) > noise && fabs(value - before) > noise;
}

/* Is event i an impact, or does it set rates? */
static int sets_rates(const struct refdyn_model *model, int i) {
    const struct refdyn_event *event = &model->events[i];
    int sets = event->is_impact;
    for (int k = event->first_change; k < event->first_change + event->change_count; k++)
        sets |= model->changes[k].what == REFDYN_CHANGED_RATE;
    return sets;
}

/* Does a value that was due stay on the side to which it has crossed? A value that has jumped is beyond zero
 * already. Rates that are set do not turn a step function. A value that its event leaves alone continues,
 * unless another event has turned it. Contacts have to turn theirs, however often. */
static int has_crossed_for_good(const struct refdyn_state_events *events, const struct refdyn_step *step,
                                int i, int rate_side) {
    if (refdyn_state_events_is_kink(events, i))
        return 0;
    const int is_turned = rate_side != 0 && rate_side != refdyn_sign_of(events->rates[i]);
    return events->side[i] == events->towards[i] ||
           (!is_turned &&
            (!sets_rates(model_of(step), i) || (rate_side == 0 && !is_moved_by_state(events, step, i))));
}

/* The side of a value that was due and that its action has not set; 0: its rate does not determine it. */
static int side_behind(const struct refdyn_state_events *events, const struct refdyn_step *step, int i,
                       const struct refdyn_assessed *now) {
    const int has_rate = fabs(now->rate) > fmax(now->rate_noise, rounding * fabs(events->rates[i]));
    const int rate_side = has_rate ? refdyn_sign_of(now->rate) : 0;
    return has_crossed_for_good(events, step, i, rate_side) ? events->towards[i] : rate_side;
}

void refdyn_state_events_settle(struct refdyn_state_events *events, const struct refdyn_step *step) {
    const int due_count = events->due_count;
    const double *before = events->begin;
    refdyn_state_events_clear_due(events);
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0, k = 0; i < events->count; i++) {
        const struct refdyn_assessed now =
            refdyn_state_events_assess(events, step, i, step->t_begin, step->state, step->rates);
        const double value = events->values[i];
        const int was_due = k < due_count && events->due[k] == i;
        k += was_due;
        if (refdyn_contact_of(&events->contacts, i) >= 0)
            events->side[i] = 1; /* in any mode */
        else if (was_due && !is_set(value, before[i], now.noise))
            events->side[i] = side_behind(events, step, i, &now);
        else if (was_due)
            events->side[i] = refdyn_sign_of(value);
        else
            jump(events, step, i, before[i], now.noise);
    }
    events->looks_again = 0;
}
