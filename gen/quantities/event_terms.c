/* Events of the state: see event_terms.h. */
#include "quantities/event_terms.h"
#include "dynamics/coordinate_derivatives.h"

static expression placed(struct derivation *d, expression e) {
    return coordinate_derivatives_with_points(&d->kinematics, e);
}

static int add(struct derivation *d, struct function *f, const char *name, const char *about, int count,
               int columns) {
    return derivation_add_array(d, f, name, about, count, columns);
}

void event_terms_build_values(struct derivation *d, struct function *f) {
    const int events = d->model->event_count;
    const int array = add(d, f, "event", "values whose zeros are events, by NAME_model.events", events, 0);
    for (int i = 0; i < events; i++)
        plan_set_entry(d->memory, f, array, i, placed(d, d->model->events[i].value));
}

/* Derivatives of all values by the coordinates (order 0) or their rates (order 1). */
static void add_gradients(struct derivation *d, struct function *f, const char *name, const char *about,
                          int order) {
    const int events = d->model->event_count;
    const int array = add(d, f, name, about, events * d->n, d->n);
    for (int i = 0; i < events; i++)
        derivation_spread(
            d, f, array, i * d->n, 1,
            coordinate_derivatives_coefficients(&d->kinematics, d->model->events[i].value, order, false));
}

static void add_changes(struct derivation *d, struct function *f) {
    const int count = d->model->change_count;
    if (count == 0)
        return;
    const int array = add(d, f, "change", "values that events set, by NAME_model.changes", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, array, i, placed(d, d->model->changes[i].value));
}

void event_terms_build(struct derivation *d, struct function *f) {
    const struct event *events = d->model->events;
    const int count = d->model->event_count;
    const int rate = add(d, f, "rate", "(events) d/dt of each value at qdd = 0", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, rate, i,
                       placed(d, coordinate_derivatives_rate(&d->kinematics, events[i].value)));
    add_gradients(d, f, "by_coordinate",
                  "(events x n) derivatives by q; where a value depends on velocities "
                  "of points, with these held",
                  0);
    add_gradients(d, f, "by_rate", "(events x n) derivatives by qd", 1);
    const int restitution = add(d, f, "restitution", "(events) coefficient of each impact, else 0", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, restitution, i, events[i].restitution);
    add_changes(d, f);
}
