/*
 * What happens where a step has ended on zeros of values: actions of events, and kinks.
 *
 * In: what is due, and the result of event_terms. Out: the state at the beginning of the step, inputs and
 * parameters.
 *
 * An impact follows Newton's law: with g the value, dg/dt after it is -e dg/dt before, by an impulse along
 * dg/dq (impulse.c). The jump of the energy counts as work.
 *
 * kinks.c moves the state across kinks; sliding.c examines jumps that lead back to themselves.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Bound on the rounds of impacts at one time; one impact may cause others. */
enum { ROUNDS_MOST = 200 };
/* An impact is over when less than this part of the rate before it remains. */
static const double at_rest = 1e-12;
/* Rates that an event sets may violate a row by this part of its terms: sqrt(DBL_EPSILON). */
static const double against_rows = 0x1p-26;

/* What the actions at one time have changed. */
struct done {
    int has_rates, has_values; /* rates; inputs or parameters */
    int has_impacts;           /* in the last round of impacts */
};

/* ---- Actions ---- */

/* A value that moves towards zero by less than this part of its rate before all impacts has come to rest. */
static int meet_impact(struct refdyn_motion *motion, int i, struct done *done) {
    struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_step *step = &motion->step;
    const int n = step->n;
    const double *gradient = events->terms + events->count + i * n;
    const double rate = events->terms[i], restitution = events->terms[events->count * (1 + 2 * n) + i];
    double *qd = step->state + n, *jump = events->room;
    if (!(motion->work->model->events[i].direction * rate > at_rest * fabs(events->rates[i])))
        return REFDYN_OK; /* it leaves zero anyway */
    int status = refdyn_equations(motion->work, step->t_begin, step->state, qd);
    if (!status)
        status = refdyn_impulse(motion->work, gradient, -(1 + restitution) * rate, jump);
    for (int j = 0; j < n && !status; j++)
        qd[j] += jump[j];
    done->has_rates = done->has_impacts = 1;
    return status;
}

/* Do the rows of the programme contradict the rates by more than before? psi (m): residuals before. Rows of
 * contacts do not count, since contacts open or have an impact. */
static int contradicts_rows(struct refdyn_workspace *work, const double *qd, const double *psi) {
    const int n = work->n;
    for (int a = 0; a < refdyn_programme_rows(work->model); a++) {
        double size = 0;
        for (int j = 0; j < n; j++)
            size += fabs(work->u[a * n + j]) * fmax(fabs(qd[j]), 1);
        if (!(fabs(work->psi[a]) <= against_rows * size + 2 * fabs(psi[a]))) {
            work->fault = (struct refdyn_fault){.row = a, .coordinate = -1};
            return 1;
        }
    }
    return 0;
}

/* Sets rates, inputs and parameters to the values in the terms. */
static int set_values(struct refdyn_motion *motion, int i, struct done *done) {
    struct refdyn_workspace *work = motion->work;
    const struct refdyn_model *model = work->model;
    const struct refdyn_event *event = &model->events[i];
    int sets_parameters = 0;
    const double *values = motion->state_events.terms + refdyn_event_terms_changes(model);
    for (int k = event->first_change; k < event->first_change + event->change_count; k++) {
        const struct refdyn_change *change = &model->changes[k];
        if (!isfinite(values[k]))
            return REFDYN_EVENT_NOT_MET;
        if (change->what == REFDYN_CHANGED_RATE)
            motion->step.state[model->n + change->place] = values[k];
        else if (change->what == REFDYN_CHANGED_INPUT)
            work->x[change->place] = values[k];
        else if (change->place >= 0)
            refdyn_parameters_set(&motion->parameters, work, change->place, values[k]);
        done->has_rates |= change->what == REFDYN_CHANGED_RATE;
        done->has_values |= change->what != REFDYN_CHANGED_RATE;
        sets_parameters |= change->what == REFDYN_CHANGED_PARAMETER;
    }
    return sets_parameters ? refdyn_check_parameters(work) : REFDYN_OK;
}

/* Checks rows only if the event sets rates. */
static int set_within_rows(struct refdyn_motion *motion, int i, struct done *done) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const double *q = step->state, *qd = q + step->n;
    struct done own = {0, 0, 0};
    int status = work->m > 0 ? refdyn_row_terms(work, step->t_begin, q, qd) : REFDYN_OK;
    memcpy(step->side, work->psi, (size_t)work->m * sizeof(double));
    if (!status)
        status = set_values(motion, i, &own);
    if (!status && own.has_rates && work->m > 0) {
        status = refdyn_row_terms(work, step->t_begin, q, qd);
        if (!status && contradicts_rows(work, qd, step->side))
            status = REFDYN_EVENT_NOT_MET;
    }
    done->has_rates |= own.has_rates;
    done->has_values |= own.has_values;
    return status;
}

/* The action of one event, at the state that the previous ones have left. Contacts follow, all together. */
static int act(struct refdyn_motion *motion, int i, int is_first, struct done *done) {
    struct refdyn_workspace *work = motion->work;
    const struct refdyn_model *model = work->model;
    const struct refdyn_step *step = &motion->step;
    if (model->events[i].contact > 0)
        return REFDYN_OK;
    model->event_terms(work->p, work->x, step->t_begin, step->state, step->state + step->n,
                       motion->state_events.terms);
    int status = model->events[i].is_impact ? meet_impact(motion, i, done) : REFDYN_OK;
    if (!status && is_first && model->events[i].change_count > 0)
        status = set_within_rows(motion, i, done);
    return status;
}

/* ---- Continuing ---- */

/* Parameters or inputs have changed: gains and time events follow them. */
static void take_values(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const double next = motion->control.next;
    refdyn_parameters_take(&motion->parameters, motion->work);
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options,
                                next > 0 ? next : INFINITY);
    refdyn_time_events_take(&motion->time_events, motion->work, step->t_begin, step->state,
                            step->state + step->n);
}

/* Notes the residuals of the rows before due events happen, on the side before kinks. */
static int note_rows(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    double *state = step->stage;
    if (motion->work->m == 0)
        return REFDYN_OK;
    memcpy(state, step->state, refdyn_state_bytes(step));
    refdyn_kinks_leave(&motion->state_events, step, -1, state);
    const int status = refdyn_row_terms(motion->work, step->t_begin, state, state + step->n);
    refdyn_rows_note(motion, state);
    return status;
}

/* Brings the state onto the rows, as at the start of a motion, or by an impulse if they have jumped. */
static int meet_rows(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    double *q = step->state, *qd = q + step->n;
    int have_jumped, status = refdyn_rows_have_jumped(motion, &have_jumped);
    if (status || have_jumped)
        return status ? status : refdyn_rows_meet(motion);
    if (work->m == 0 || motion->options.stabilise != REFDYN_PROJECT)
        return REFDYN_OK;
    status = refdyn_equations(work, step->t_begin, q, qd);
    return status ? status : refdyn_project_evaluated(work, step->t_begin, q, qd);
}

void refdyn_motion_break_off(struct refdyn_motion *motion, int is_new) {
    refdyn_step_break_off(&motion->step, is_new);
    refdyn_linear_leave_begin(&motion->linear);
    refdyn_linear_drop_factors(&motion->linear);
    refdyn_programme_forget(&motion->programme);
    refdyn_control_leave_interval(&motion->control);
}

/* The motion continues from the beginning of the step, and forgets the steps before. */
static int go_on(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    refdyn_motion_break_off(motion, 1);
    refdyn_step_limit(step, INFINITY);
    int status = meet_rows(motion);
    if (!status)
        status = refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
    if (!status)
        refdyn_step_give_up(step);
    return status;
}

/* Each event that is due acts once; impacts repeat until no impact causes another one. */
static int act_on_all(struct refdyn_motion *motion, struct done *done) {
    const struct refdyn_state_events *events = &motion->state_events;
    int status = REFDYN_OK;
    for (int round = 0; round < ROUNDS_MOST; round++) {
        done->has_impacts = 0;
        for (int k = 0; k < events->due_named && !status; k++)
            status = act(motion, events->due[k], round == 0, done);
        if (status || !done->has_impacts || events->due_named == 1)
            return status;
    }
    return REFDYN_EVENTS_ACCUMULATE;
}

/* Contacts that are due close or let go. Impulses of other events may move contacts that rest. */
static int act_on_contacts(struct refdyn_motion *motion, struct done *done) {
    const struct refdyn_state_events *events = &motion->state_events;
    int is_due = done->has_rates;
    for (int k = 0; k < events->due_named; k++)
        is_due |= motion->work->model->events[events->due[k]].contact > 0;
    if (!is_due || events->contacts.count == 0)
        return REFDYN_OK;
    done->has_values = 1;
    return refdyn_contact_transitions_take(motion, &done->has_rates);
}

/* Moves the state beyond the kinks that are due. */
static int pass_kinks(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    int have_jumped;
    refdyn_step_break_off(step, 1);
    refdyn_kinks_leave(&motion->state_events, step, 1, step->state);
    int status = refdyn_rows_have_jumped(motion, &have_jumped);
    if (!status && have_jumped) {
        status = go_on(motion);
        return !status && refdyn_kinks_lead_back(&motion->state_events, step) ? REFDYN_SLIDES : status;
    }
    return status ? status : refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
}

/* The actions of all that is due, and the state from which the motion continues. */
static int take_due(struct refdyn_motion *motion) {
    struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_step *step = &motion->step;
    struct done done = {0, 0, 0};
    const double energy = refdyn_energy_at_begin(motion);
    int status = note_rows(motion);
    refdyn_state_events_note(events, step);
    refdyn_sliding_note_due(events);
    if (!status && refdyn_state_events_accumulate(events))
        status = REFDYN_EVENTS_ACCUMULATE;
    if (!status)
        status = act_on_all(motion, &done);
    if (!status)
        status = act_on_contacts(motion, &done);
    if (!status && done.has_values)
        take_values(motion);
    if (!status && (done.has_rates || done.has_values)) {
        refdyn_energy_has_jumped(motion, energy);
        if (!done.has_rates) /* impacts may turn the state before the kinks that are due */
            refdyn_kinks_leave(events, step, 1, step->state);
        status = go_on(motion);
    } else if (!status && events->due_count > events->due_named)
        status = pass_kinks(motion);
    if (!status)
        refdyn_state_events_settle(events, step);
    return status;
}

/* Time events, kinks, other events and the caller may have changed the load. Contacts open if they would
 * pull. */
int refdyn_event_actions_open_contacts(struct refdyn_motion *motion) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_step *step = &motion->step;
    const double *multipliers = step->rates + 2 * step->n + 1;
    int has_rates = 0, pulls = 0;
    refdyn_contacts_note_forces(contacts, multipliers);
    for (int k = 0; k < contacts->count; k++)
        pulls |= refdyn_contacts_pulls(contacts, multipliers, k, 0);
    if (!pulls)
        return REFDYN_OK;
    const double energy = refdyn_energy_at_begin(motion);
    refdyn_state_events_look_again(&motion->state_events, step, step->t_begin, step->state);
    const int status = refdyn_contact_transitions_take(motion, &has_rates);
    refdyn_energy_has_jumped(motion, energy);
    return status ? status : go_on(motion);
}

int refdyn_event_actions_take(struct refdyn_motion *motion) {
    struct refdyn_state_events *events = &motion->state_events;
    int status = REFDYN_OK;
    if (events->due_count > 0)
        status = take_due(motion);
    if (!status)
        status = refdyn_event_actions_open_contacts(motion);
    if (!status)
        status = refdyn_state_events_begin(events, &motion->step);
    return status ? status : refdyn_sliding_check(motion);
}
