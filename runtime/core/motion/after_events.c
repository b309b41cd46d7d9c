/*
 * The right side of an instant at which events set inputs or parameters.
 *
 * In: an integrator at an output where these events are due; they act with the next step. Out: inputs,
 * parameters, accelerations and multipliers as these events leave them, at the state that the caller sees.
 * refdyn_integrator_see_before restores the earlier ones. A recorded input therefore holds from its row on.
 * If an event makes rates jump or ends the motion, the values before it are shown.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

static size_t count_values(const struct refdyn_model *model) {
    return (size_t)model->parameter_count + (size_t)model->derived_count;
}

void refdyn_after_lay_out(struct refdyn_after *after, const struct refdyn_model *model,
                          struct layout *layout) {
    const int has_changes = model->change_count > 0;
    after->p = layout_doubles(layout, has_changes ? (int)count_values(model) : 0);
    after->x = layout_doubles(layout, has_changes ? model->input_count : 0);
    after->qdd = layout_doubles(layout, has_changes ? model->n : 0);
    after->lambda = layout_doubles(layout, has_changes ? model->m : 0);
    after->terms = layout_doubles(layout, has_changes ? refdyn_event_terms_count(model) : 0);
}

/* Does the event set inputs or parameters, and nothing else? */
static int is_quiet(const struct refdyn_model *model, const struct refdyn_event *event) {
    int sets_rates = event->is_impact || event->ends || event->contact > 0;
    for (int k = event->first_change; k < event->first_change + event->change_count; k++)
        sets_rates |= model->changes[k].what == REFDYN_CHANGED_RATE;
    return !sets_rates;
}

/* Are events due at the state that the caller sees, and is each of them quiet? */
static int are_quiet(const struct refdyn_integrator *integrator) {
    const struct refdyn_motion *motion = integrator->motion;
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_model *model = motion->work->model;
    if (model->change_count == 0 ||
        !(motion->step.t_end - integrator->t <= refdyn_state_events_blur(integrator->t)))
        return 0;
    for (int k = 0; k < events->due_named; k++)
        if (!is_quiet(model, &model->events[events->due[k]]))
            return 0;
    return events->due_named > 0;
}

/* Copies the caller's values, with the gains of the step, as the integrator does after events. */
static void take(struct refdyn_motion *motion) {
    const double next = motion->control.next;
    refdyn_parameters_enter(&motion->parameters, motion->work);
    refdyn_parameters_take(&motion->parameters, motion->work);
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options,
                                next > 0 ? next : INFINITY);
    refdyn_parameters_leave(&motion->parameters, motion->work);
}

/* Sets the values of one event. Returns 0 if one of them is not finite. */
static int set(struct refdyn_integrator *integrator, const struct refdyn_event *event) {
    struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    const struct refdyn_after *after = &integrator->motion->after;
    const double *values = after->terms + refdyn_event_terms_changes(model);
    model->event_terms(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, after->terms);
    for (int k = event->first_change; k < event->first_change + event->change_count; k++) {
        const struct refdyn_change *change = &model->changes[k];
        if (!isfinite(values[k]))
            return 0;
        if (change->what == REFDYN_CHANGED_INPUT)
            work->x[change->place] = values[k];
        else if (change->place >= 0)
            work->p[change->place] = values[k];
    }
    refdyn_prepare(work);
    return 1;
}

/* The evaluations do not count, because the automatic choice of the method compares the cost of steps. */
static int find_accelerations(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    struct refdyn_step *step = &motion->step;
    const long evaluations = work->evaluations;
    refdyn_parameters_enter(&motion->parameters, work);
    int status = refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
    if (!status)
        status = refdyn_rates(&step->evaluation, integrator->t_right, integrator->q, step->side);
    refdyn_parameters_leave(&motion->parameters, work);
    work->evaluations = evaluations;
    memcpy(integrator->qdd, step->side + step->n, (size_t)step->n * sizeof *integrator->qdd);
    memcpy(integrator->lambda, step->side + 2 * step->n + 1, (size_t)work->m * sizeof *integrator->lambda);
    return status;
}

void refdyn_after_clear(struct refdyn_after *after) {
    after->is_seen = 0;
}

int refdyn_integrator_see_after(struct refdyn_integrator *integrator) {
    if (refdyn_integrator_status(integrator) || !are_quiet(integrator))
        return 0;
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    const struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_after *after = &motion->after;
    memcpy(after->p, work->p, count_values(model) * sizeof *after->p);
    memcpy(after->x, work->x, (size_t)model->input_count * sizeof *after->x);
    memcpy(after->qdd, integrator->qdd, (size_t)model->n * sizeof *after->qdd);
    memcpy(after->lambda, integrator->lambda, (size_t)model->m * sizeof *after->lambda);
    after->is_seen = 1;
    int is_good = 1;
    for (int k = 0; k < events->due_named && is_good; k++)
        is_good = set(integrator, &model->events[events->due[k]]);
    take(motion);
    if (is_good && !refdyn_check_parameters(work) && !find_accelerations(integrator))
        return 1;
    refdyn_integrator_see_before(integrator);
    return 0;
}

void refdyn_integrator_see_before(struct refdyn_integrator *integrator) {
    if (refdyn_integrator_status(integrator) || !integrator->motion->after.is_seen)
        return;
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    struct refdyn_after *after = &motion->after;
    after->is_seen = 0;
    memcpy(work->p, after->p, count_values(model) * sizeof *after->p);
    memcpy(work->x, after->x, (size_t)model->input_count * sizeof *after->x);
    memcpy(integrator->qdd, after->qdd, (size_t)model->n * sizeof *after->qdd);
    memcpy(integrator->lambda, after->lambda, (size_t)model->m * sizeof *after->lambda);
    take(motion);
    refdyn_parameters_enter(&motion->parameters, work);
    refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
    refdyn_parameters_leave(&motion->parameters, work);
}
