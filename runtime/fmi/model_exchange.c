/*
 * Model Exchange: see model_exchange.h.
 *
 * The importer ends its step behind a crossing, at the state that it has found there. Which events have
 * happened follows from the side of zero that the core keeps for each value (motion/state_events.h); the core
 * then takes their actions as in a motion of its own. Time events are frozen: until event mode passes one,
 * functions see its left side, and from then on its right side.
 */
#include "fmi/model_exchange.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "fmi/values.h"
#include "motion/event_actions.h"
#include "motion/motion.h"

/* An importer comes to a time event with rounding of its own. */
static double slack(double t) {
    return 1e-12 * fmax(1, fabs(t));
}

/* Functions see a time event's left side this far before it. */
static double blur(double t) {
    return fmax(2 * DBL_EPSILON * fabs(t), DBL_MIN);
}

enum fmu_status fmu_set_time(struct fmu_instance *instance, double t) {
    if (!isfinite(t))
        return fmu_tell(instance, FMU_ERROR, "%g is no time", t);
    instance->integrator.t = t;
    fmu_invalidate(instance);
    return FMU_OK;
}

enum fmu_status fmu_set_states(struct fmu_instance *instance, const double *state) {
    for (int i = 0; i < 2 * instance->work.n; i++)
        if (!isfinite(state[i]))
            return fmu_tell(instance, FMU_DISCARD, "t = %.9g s: state %d is no finite number",
                            instance->integrator.t, i + 1);
    memcpy(instance->integrator.q, state, (size_t)(2 * instance->work.n) * sizeof *state);
    fmu_invalidate(instance);
    return FMU_OK;
}

enum fmu_status fmu_get_derivatives(struct fmu_instance *instance, double *derivatives) {
    const size_t size = (size_t)instance->work.n * sizeof *derivatives;
    const enum fmu_status status = fmu_evaluate(instance);
    memcpy(derivatives, instance->integrator.qd, size);
    memcpy(derivatives + instance->work.n, instance->integrator.qdd, size);
    return status;
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

/* What an event has left of its value beyond zero, on the side that it has come back from, counts as zero:
 * its value leaves zero there and does not cross it. */
static void place_zeros(struct fmu_instance *instance) {
    const struct refdyn_state_events *events = &instance->integrator.motion->state_events;
    double *values = instance->scratch;
    memset(instance->zeros, 0, (size_t)fmu_count_indicators(instance->work.model) * sizeof *values);
    fmu_find_indicators(instance, instance->integrator.q, values);
    for (int i = 0; i < events->named; i++)
        if (events->side[i] * values[i] < 0)
            instance->zeros[i] = values[i];
}

/* ---- Time events ---- */

/* From the present time on: where the last one was passed, and where the next one is. */
static void place_time(struct fmu_instance *instance) {
    const struct refdyn_time_events *known = &instance->integrator.motion->events;
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

/* ---- Events of the state ---- */

/* The rate of value i, from the terms. */
static double rate_of(const struct refdyn_state_events *events, const struct refdyn_step *step, int i) {
    const double *by_qd = refdyn_state_events_by_qd(events, step->n, i);
    double rate = events->terms[i];
    for (int j = 0; j < step->n; j++)
        rate += by_qd[j] * step->rates[step->n + j];
    return rate;
}

/* Has value i crossed zero, or does it at this moment? What an event has left of it beyond zero is no
 * crossing while it goes back. */
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

/* The events that have happened are due; kinks and the others are on the side where their values are. */
static void find_due(struct fmu_instance *instance) {
    struct refdyn_motion *motion = instance->integrator.motion;
    struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_step *step = &motion->step;
    events->due_count = events->due_named = events->is_told = events->looks_again = 0;
    if (events->count == 0)
        return;
    refdyn_state_events_evaluate(events, step, step->t_begin, step->state);
    for (int i = 0; i < events->count; i++) {
        const int now = (events->values[i] > 0) - (events->values[i] < 0);
        if (i < events->named && has_crossed(instance, i)) {
            events->towards[i] = -events->side[i];
            events->due[events->due_count++] = i;
        } else if (now != 0 && (i >= events->named || instance->zeros[i] == 0 ||
                                fabs(events->values[i]) > 2 * fabs(instance->zeros[i])))
            events->side[i] = now;
    }
    events->due_named = events->due_count;
    if (events->due_named > 0) {
        const double apart = fabs(step->t_begin - events->t_last);
        events->repeats = apart <= slack(step->t_begin) ? events->repeats + 1 : 0;
        events->t_last = step->t_begin;
    }
}

static int one_ends(const struct refdyn_motion *motion) {
    const struct refdyn_state_events *events = &motion->state_events;
    for (int i = 0; i < events->due_named; i++)
        if (motion->work->model->events[events->due[i]].ends)
            return 1;
    return 0;
}

/* Actions of what is due, then of what these have made due. */
static int take_due(struct refdyn_motion *motion, int *ends) {
    int status = REFDYN_OK;
    do {
        *ends |= one_ends(motion);
        if (!*ends)
            status = refdyn_event_actions_take(motion);
    } while (!status && !*ends && motion->state_events.due_named > 0);
    return status;
}

/* The integrator stands at the present state, right of a time event. At the start it does so already, until
 * a value is set. */
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
    refdyn_parameters_enter(&motion->parameters, &instance->work);
    if (!status && !instance->has_events_due)
        find_due(instance);
    if (!status)
        status = take_due(motion, &update->ends);
    refdyn_parameters_leave(&motion->parameters, &instance->work);
    if (status)
        return fmu_tell_failure(instance, status);
    update->changes_states = memcmp(integrator->q, motion->step.state, size) != 0;
    memcpy(integrator->q, motion->step.state, size);
    instance->has_events_due = instance->has_new_values = 0;
    place_time(instance);
    update->t_next = instance->t_next;
    integrator->t_right = fmax(integrator->t, instance->t_from);
    place_zeros(instance);
    fmu_invalidate(instance);
    return FMU_OK;
}
