/*
 * Model Exchange: event indicators, time events and event mode.
 *
 * The importer ends its step after a crossing, at the state that it has located. The side of zero that the
 * core keeps for each value (motion.h) shows which events have happened; the core then executes their actions
 * as in its own motions. Time events are frozen: functions see the left side of a time event until event mode
 * passes it, then the right side.
 */
#include "runtime/bindings/fmi/fmi.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/motion/motion.h"

static const double value_digits = 64 * DBL_EPSILON; /* rounding of a value, over the sum of its |terms| */

/* Tolerance in time for an importer that reaches a time event with rounding. */
static double slack(double t) {
    return 1e-12 * fmax(1, fabs(t));
}

/* Distance before a time event at which functions see its left side. */
static double blur(double t) {
    return fmax(2 * DBL_EPSILON * fabs(t), DBL_MIN);
}

enum fmu_status fmu_set_time(struct fmu_instance *instance, double t) {
    if (!isfinite(t))
        return fmu_tell(instance, FMU_ERROR, "time: value %g; must be finite", t);
    instance->integrator.t = t;
    fmu_invalidate(instance);
    return FMU_OK;
}

enum fmu_status fmu_set_states(struct fmu_instance *instance, const double *state) {
    const struct refdyn_model *model = instance->work.model;
    const int joints = refdyn_joint_count(model);
    for (int i = 0; i < fmu_count_states(model); i++)
        if (!isfinite(state[i]))
            return fmu_tell(instance, FMU_DISCARD, "t = %.9g s: state %d is not finite",
                            instance->integrator.t, i + 1);
    memcpy(instance->integrator.q, state, (size_t)joints * sizeof *state);
    memcpy(instance->integrator.qd, state + joints, (size_t)model->n * sizeof *state);
    fmu_invalidate(instance);
    return FMU_OK;
}

enum fmu_status fmu_get_derivatives(struct fmu_instance *instance, double *derivatives) {
    const int joints = refdyn_joint_count(instance->work.model);
    const enum fmu_status status = fmu_evaluate(instance);
    memcpy(derivatives, instance->integrator.qd, (size_t)joints * sizeof *derivatives);
    memcpy(derivatives + joints, instance->integrator.qdd, (size_t)instance->work.n * sizeof *derivatives);
    return status;
}

void fmu_find_nominals(const struct refdyn_model *model, double *nominals) {
    const int joints = refdyn_joint_count(model);
    for (int j = 0; j < joints; j++)
        nominals[j] = nominals[joints + j] = 1;
    for (int j = joints; j < model->n; j++)
        nominals[joints + j] = refdyn_coordinate_unit(model, j, 0);
}

/* ---- Event indicators ---- */

enum fmu_status fmu_get_indicators(struct fmu_instance *instance, double *indicators) {
    const enum fmu_status status = fmu_evaluate(instance);
    if (status != FMU_OK)
        return status;
    fmu_find_indicators(instance, instance->integrator.q, indicators);
    for (int i = 0; i < fmu_count_indicators(instance->work.model); i++)
        indicators[i] -= instance->zeros[i];
    return FMU_OK;
}

/* Returns the rounding of the value of event i, from its terms; 0 for a contact that does not move. */
static double noise_of(const struct fmu_instance *instance, int i) {
    const struct refdyn_model *model = instance->work.model;
    const struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    const int contact = refdyn_contact_of(&events->contacts, i);
    const double *sizes =
        events->terms + events->count * (1 + 2 * model->n) + model->event_count + model->change_count;
    return contact < 0 || events->contacts.mode[contact] == REFDYN_CONTACT_FREE ? value_digits * sizes[i] : 0;
}

/* An event that has just happened may leave its value beyond zero. This value then counts as zero, so that
 * its return is no crossing. Importers lose indicators that begin at zero; those of events that have just
 * happened therefore begin beyond rounding. */
static void place_zeros(struct fmu_instance *instance) {
    const struct refdyn_motion *motion = instance->integrator.motion;
    const struct refdyn_state_events *events = &motion->state_events;
    double *values = instance->scratch;
    memset(instance->zeros, 0, (size_t)fmu_count_indicators(instance->work.model) * sizeof *values);
    fmu_find_indicators(instance, instance->integrator.q, values);
    for (int i = 0; i < events->named; i++) {
        const double noise = instance->left_at[i] == motion->step.t_begin ? noise_of(instance, i) : 0;
        if (events->side[i] * values[i] < noise)
            instance->zeros[i] = values[i] - events->side[i] * noise;
    }
}

/* ---- Time events ---- */

/* Finds the last time event passed and the next one. */
static void place_time(struct fmu_instance *instance) {
    const struct refdyn_time_events *known = &instance->integrator.motion->time_events;
    const double t = instance->integrator.t;
    instance->t_from = t;
    instance->t_next = INFINITY;
    for (int i = 0; i < known->count; i++) {
        const double event = known->times[i];
        if (event > t + slack(t))
            instance->t_next = fmin(instance->t_next, event);
        else if (event >= t - slack(t))
            instance->t_from = fmax(instance->t_from, event + blur(event));
    }
    instance->t_to = isfinite(instance->t_next) ? instance->t_next - blur(instance->t_next) : INFINITY;
}

/* ---- State events ---- */

/* Returns the resting contact of event i, whose value is its force; -1: none. */
static int resting_contact(const struct refdyn_state_events *events, int i) {
    const int contact = refdyn_contact_of(&events->contacts, i);
    return contact >= 0 && events->contacts.mode[contact] == REFDYN_CONTACT_RESTING ? contact : -1;
}

/* Returns the rate of value i, from the terms. */
static double rate_of(const struct refdyn_state_events *events, const struct refdyn_step *step, int i) {
    const int contact = resting_contact(events, i);
    if (contact >= 0)
        return events->contacts.force_rates[contact];
    const double *by_qd = refdyn_state_events_by_qd(events, step->n, i);
    double rate = events->terms[i];
    for (int j = 0; j < step->n; j++)
        rate += by_qd[j] * step->rates[step->n + j];
    return rate;
}

/* Returns whether value i has crossed zero or is crossing it now. A value that an event left beyond zero does
 * not count while it returns. */
static int has_crossed(const struct fmu_instance *instance, int i) {
    const struct refdyn_motion *motion = instance->integrator.motion;
    const struct refdyn_state_events *events = &motion->state_events;
    const int direction = instance->work.model->events[i].direction, side = events->side[i];
    const double value = side * events->values[i], rate = side * rate_of(events, &motion->step, i);
    if (side == 0 || (direction != 0 && direction != -side))
        return 0;
    if (value >= 0)
        return rate < 0 && value <= -rate * slack(motion->step.t_begin);
    return !(rate > 0 && -value <= 2 * fabs(instance->zeros[i]));
}

/* Estimates how far value i has risen above zero since the event last happened: a quarter of the time since
 * then, times the rate after it, from its value then. Importers may hide the states between. */
static double risen_since(const struct fmu_instance *instance, int i, double t) {
    const double apart = t - instance->left_at[i];
    return isfinite(apart) ? fmax(instance->left_rate[i] * apart / 4 - fabs(instance->zeros[i]), 0)
                           : INFINITY;
}

/* Estimates for how long the gap of a waiting contact has been negative: at most the importer's last step,
 * unless it was negative before. A gap that closes from rest decreases by half its rate times the time. */
static double lateness(const struct fmu_instance *instance, int i) {
    const struct refdyn_motion *motion = instance->integrator.motion;
    const struct refdyn_state_events *events = &motion->state_events;
    const double value = events->values[i], rate = rate_of(events, &motion->step, i);
    const double most = instance->zeros[i] < 0 ? INFINITY : fmax(motion->step.t_begin - instance->t_seen, 0);
    if (refdyn_contact_of(&events->contacts, i) < 0 || resting_contact(events, i) >= 0 || !(value < 0))
        return 0;
    return rate < 0 ? fmin(2 * value / rate, most) : 0;
}

static void add_due(struct fmu_instance *instance, int i) {
    const double t = instance->integrator.motion->step.t_begin;
    struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    events->towards[i] = -events->side[i];
    events->risen[i] = risen_since(instance, i, t);
    events->contacts.late = fmax(events->contacts.late, lateness(instance, i));
    events->due[events->due_count++] = i;
    instance->left_at[i] = t;
}

/* Returns whether event i left its value beyond zero without return: its impacts then do not keep a body out.
 */
static int does_not_hold(const struct fmu_instance *instance, int i) {
    const struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    return events->risen[i] == 0 && refdyn_contact_of(&events->contacts, i) < 0 &&
           fabs(instance->zeros[i]) > 2 * noise_of(instance, i);
}

/* Returns whether all due events keep their bodies out. */
static int all_hold(const struct fmu_instance *instance) {
    const struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    for (int k = 0; k < events->due_named; k++)
        if (does_not_hold(instance, events->due[k]))
            return 0;
    return 1;
}

/* Records negative gaps that importers have left. */
static void note_inside(struct fmu_instance *instance) {
    struct refdyn_contacts *contacts = &instance->integrator.motion->state_events.contacts;
    for (int k = 0; k < contacts->count; k++)
        contacts->inside[k] =
            contacts->mode[k] == REFDYN_CONTACT_FREE ? fabs(instance->zeros[contacts->event[k]]) : 0;
}

/* Marks the events that have happened as due. Other events and kinks move to the side of their values; those
 * of contacts stay above zero. Forces of contacts are without stabilising gains, as in the indicators. Error:
 * EVENTS_ACCUMULATE. */
static int find_due(struct fmu_instance *instance) {
    const struct refdyn_motion *motion = instance->integrator.motion;
    struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    const struct refdyn_step *step = &motion->step;
    refdyn_state_events_forget(events);
    note_inside(instance);
    if (events->count == 0)
        return REFDYN_OK;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->count; i++) {
        const int now = (events->values[i] > 0) - (events->values[i] < 0);
        if (i < events->named && has_crossed(instance, i))
            add_due(instance, i);
        else if (now != 0 && refdyn_contact_of(&events->contacts, i) < 0 &&
                 (i >= events->named || instance->zeros[i] == 0 ||
                  fabs(events->values[i]) > 2 * fabs(instance->zeros[i])))
            events->side[i] = now;
    }
    events->due_named = events->due_count;
    return all_hold(instance) ? REFDYN_OK : REFDYN_EVENTS_ACCUMULATE;
}

/* Records the rates at which values of events that have just happened leave zero. */
static void note_rates(struct fmu_instance *instance) {
    const struct refdyn_motion *motion = instance->integrator.motion;
    struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    const struct refdyn_step *step = &motion->step;
    if (events->named == 0)
        return;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->named; i++)
        if (instance->left_at[i] == step->t_begin)
            instance->left_rate[i] = events->side[i] * rate_of(events, step, i);
}

static int one_ends(const struct refdyn_motion *motion) {
    const struct refdyn_state_events *events = &motion->state_events;
    for (int i = 0; i < events->due_named; i++)
        if (motion->work->model->events[events->due[i]].ends)
            return 1;
    return 0;
}

/* Executes the actions of due events, then of events that these actions make due. */
static int take_due(struct refdyn_motion *motion, int *ends) {
    int status = REFDYN_OK;
    do {
        *ends |= one_ends(motion);
        if (!*ends)
            status = refdyn_event_actions_take(motion);
    } while (!status && !*ends && motion->state_events.due_named > 0);
    return status;
}

/* Closes the gaps that the importer's errors leave where contacts come to rest. */
static int close_gaps(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    double *q = step->state, *qd = q + step->n;
    if (motion->state_events.contacts.resting == 0)
        return REFDYN_OK;
    const int status = refdyn_equations(motion->work, step->t_begin, q, qd);
    return status ? status : refdyn_project_evaluated(motion->work, step->t_begin, q, qd);
}

static enum fmu_status fail_at_events(struct fmu_instance *instance, int status) {
    const struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    instance->integrator.event = events->due;
    instance->integrator.event_count = events->due_named;
    return fmu_tell_failure(instance, status);
}

/* Places the integrator at the present state, on the right side of a time event. At the start it is there
 * already, unless a value was set. */
static int place_integrator(struct fmu_instance *instance) {
    struct refdyn_integrator *integrator = &instance->integrator;
    const double t = integrator->t;
    if (instance->has_events_due)
        return REFDYN_OK;
    integrator->t = instance->t_from;
    const int status = refdyn_integrator_refresh(integrator);
    integrator->t = t;
    return status;
}

enum fmu_status fmu_update_events(struct fmu_instance *instance, struct fmu_event_update *update) {
    struct refdyn_integrator *integrator = &instance->integrator;
    struct refdyn_motion *motion = integrator->motion;
    const size_t size = (size_t)(2 * instance->work.n) * sizeof(double);
    *update = (struct fmu_event_update){.t_next = INFINITY};
    place_time(instance);
    int status = place_integrator(instance);
    if (!status && !instance->has_events_due)
        status = find_due(instance);
    refdyn_parameters_enter(&motion->parameters, &instance->work);
    if (!status)
        status = take_due(motion, &update->ends);
    if (!status && !update->ends)
        status = close_gaps(motion);
    refdyn_parameters_leave(&motion->parameters, &instance->work);
    if (status)
        return fail_at_events(instance, status);
    motion->state_events.contacts.late = 0;
    note_rates(instance);
    update->changes_states = memcmp(integrator->q, motion->step.state, size) != 0;
    memcpy(integrator->q, motion->step.state, size);
    instance->has_events_due = instance->has_new_values = 0;
    place_time(instance);
    update->t_next = instance->t_next;
    integrator->t_right = fmax(integrator->t, instance->t_from);
    instance->t_seen = integrator->t;
    place_zeros(instance);
    fmu_tell_contacts(instance);
    fmu_invalidate(instance);
    return FMU_OK;
}

/* Returns whether event i has crossed zero unnoticed by the importer. */
static int has_been_passed(const struct fmu_instance *instance, const double *values, int i) {
    const int direction = instance->work.model->events[i].direction;
    const int side = instance->integrator.motion->state_events.side[i];
    return (direction == 0 || direction == -side) && side * (values[i] - instance->zeros[i]) < 0;
}

int fmu_complete_step(struct fmu_instance *instance) {
    int has_passed = 0;
    if (fmu_evaluate(instance) != FMU_OK)
        return 0;
    fmu_find_indicators(instance, instance->integrator.q, instance->scratch);
    for (int i = 0; i < instance->work.model->event_count; i++)
        has_passed |= has_been_passed(instance, instance->scratch, i);
    if (!has_passed)
        instance->t_seen = instance->integrator.t;
    return has_passed;
}
