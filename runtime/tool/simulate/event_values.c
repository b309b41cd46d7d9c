/*
 * Parameters that an event is about to set: see event_values.h.
 *
 * Takes the state at which events stand, where the emitted `event_terms` tells what they set; writes that to
 * the model that was read, whose requirements tell what is wrong with it.
 */
#include "simulate/event_values.h"
#include "base/memory.h"
#include "base/text.h"

#include <stdlib.h>
#include <string.h>

/* The parameter of that name in the model that was read. */
static struct parameter *declared(struct model *model, const char *name) {
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0)
            return &model->parameters[i];
    return NULL;
}

static void declare_value(struct model *model, const char *name, double value) {
    struct parameter *parameter = declared(model, name);
    if (parameter)
        parameter->value = value;
}

/* Of all numbers that depend on parameters: the first one at fault. */
static const char *first_fault(struct generation *generation) {
    const struct model *model = &generation->model;
    bool *is_asked = allocate_large((size_t)model->requirement_count + 1, sizeof *is_asked);
    for (int i = 0; i < model->requirement_count; i++)
        is_asked[i] = true;
    const char *fault = gen_values_fault(generation, is_asked);
    free(is_asked);
    return fault;
}

/* What the changes of all events are at the state, behind the other terms: theirs and room for these. */
static const double *find_changes(const struct refdyn_integrator *integrator, double *terms) {
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    const int values = model->event_count + model->kink_count;
    model->event_terms(work->p, work->x, integrator->t, integrator->q, integrator->qd, terms);
    return terms + values * (1 + 2 * model->n) + model->event_count;
}

static const char *fault_of_event(struct scene *scene, const struct refdyn_event *event,
                                  const double *changes) {
    const struct refdyn_model *model = scene->model;
    bool sets_parameters = false;
    for (int k = event->first_change; k < event->first_change + event->change_count; k++) {
        const struct refdyn_change *change = &model->changes[k];
        if (change->what != REFDYN_CHANGED_PARAMETER || change->place < 0)
            continue;
        declare_value(&scene->generation.model, model->parameters[change->place].name, changes[k]);
        sets_parameters = true;
    }
    const char *fault = sets_parameters ? first_fault(&scene->generation) : NULL;
    return fault ? text_format("the event %s: %s", event->name, fault) : NULL;
}

const char *event_values_fault(struct scene *scene, const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = scene->model;
    const int values = model->event_count + model->kink_count;
    const char *fault = NULL;
    if (integrator->event_count == 0 || model->change_count == 0)
        return NULL;
    double *terms = allocate_large(
        (size_t)(values * (1 + 2 * model->n) + 2 * model->event_count + model->change_count), sizeof *terms);
    const double *changes = find_changes(integrator, terms);
    for (int i = 0; i < model->parameter_count; i++)
        declare_value(&scene->generation.model, model->parameters[i].name, integrator->work->p[i]);
    for (int k = 0; k < integrator->event_count && !fault; k++)
        fault = fault_of_event(scene, &model->events[integrator->event[k]], changes);
    free(terms);
    return fault;
}
