/*
 * State events: the quantities by which an integrator locates and handles them.
 *
 * Input: the events and kinks of the model. Results: `event`, their values e, and `event_terms`. With
 *     de/dt = rate + by_rate qdd
 * these are the rate at qdd = 0, the derivatives by coordinates and rates, the coefficients of restitution
 * and the values that events set, in this order.
 */
#include "gen/quantities/quantities.h"
#include "gen/dynamics/dynamics.h"

static expression placed(struct derivation *d, expression e) {
    return coordinate_derivatives_with_points(&d->kinematics, e);
}

/* Number of values: events, then kinks. */
static int count_values(const struct derivation *d) {
    return d->model->event_count + d->model->kink_count;
}

static expression value_of(const struct derivation *d, int i) {
    const int events = d->model->event_count;
    return i < events ? d->model->events[i].value : d->model->kinks[i - events];
}

void quantity_event(struct derivation *d, struct function *f) {
    const int count = count_values(d);
    const int array = derivation_add_array(
        d, f, "event", "(values) zero at the events of NAME_model.events, then at kinks", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, array, i, placed(d, value_of(d, i)));
}

/* Derivatives of all values by the coordinates (order 0) or their rates (order 1). */
static void add_gradients(struct derivation *d, struct function *f, const char *name, const char *about,
                          int order) {
    const int count = count_values(d);
    const int array = derivation_add_array(d, f, name, about, count * d->n, d->n);
    for (int i = 0; i < count; i++)
        derivation_spread(d, f, array, i * d->n, 1,
                          coordinate_derivatives_coefficients(&d->kinematics, value_of(d, i), order, false));
}

static void add_restitutions(struct derivation *d, struct function *f) {
    const int count = d->model->event_count;
    if (count == 0)
        return;
    const int array =
        derivation_add_array(d, f, "restitution", "(events) coefficient of each impact, else 0", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, array, i, d->model->events[i].restitution);
}

static void add_changes(struct derivation *d, struct function *f) {
    const int count = d->model->change_count;
    if (count == 0)
        return;
    const int array =
        derivation_add_array(d, f, "change", "values that events set, by NAME_model.changes", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, array, i, placed(d, d->model->changes[i].value));
}

enum { TERMS_MOST = 64 }; /* terms of one value; the remainder of a longer sum counts as one term */

static bool is_still(const struct graph *g, expression e) {
    return !(g->nodes[e].depends & (ON_TIME | ON_INPUT | ON_STATE | ON_RATE));
}

static expression absolute(struct graph *g, expression e) {
    return expr_apply1(g, OP_ABS, e);
}

/* The sum of |terms| of a value, which bounds its rounding error. Sums are divided into terms, also sums
 * with a constant factor. */
static expression size_of(struct graph *g, expression e, int *left) {
    const struct node node = g->nodes[e];
    const expression a = node.operand[0], b = node.operand[1];
    if (node.loop || (*left)-- <= 0)
        return absolute(g, e);
    switch (node.operation) {
    case OP_NEG:
        return size_of(g, a, left);
    case OP_ADD:
    case OP_SUB:
        return expr_add(g, size_of(g, a, left), size_of(g, b, left));
    case OP_MUL:
        return is_still(g, a)   ? expr_mul(g, absolute(g, a), size_of(g, b, left))
               : is_still(g, b) ? expr_mul(g, absolute(g, b), size_of(g, a, left))
                                : absolute(g, e);
    case OP_DIV:
        return is_still(g, b) ? expr_div(g, size_of(g, a, left), absolute(g, b)) : absolute(g, e);
    default:
        return absolute(g, e);
    }
}

static void add_sizes(struct derivation *d, struct function *f) {
    const int count = d->model->event_count;
    if (count == 0)
        return;
    const int array =
        derivation_add_array(d, f, "size", "(events) sum of |terms| of each value: its rounding", count, 0);
    for (int i = 0; i < count; i++) {
        int left = TERMS_MOST;
        plan_set_entry(d->memory, f, array, i, size_of(d->g, placed(d, value_of(d, i)), &left));
    }
}

void quantity_event_terms(struct derivation *d, struct function *f) {
    const int count = count_values(d);
    const int rate = derivation_add_array(d, f, "rate", "(values) d/dt of each value at qdd = 0", count, 0);
    for (int i = 0; i < count; i++)
        plan_set_entry(d->memory, f, rate, i,
                       placed(d, coordinate_derivatives_rate(&d->kinematics, value_of(d, i))));
    add_gradients(d, f, "by_coordinate",
                  "(values x n) derivatives by q, with velocities of points held constant", 0);
    add_gradients(d, f, "by_rate", "(values x n) derivatives by qd", 1);
    add_restitutions(d, f);
    add_changes(d, f);
    add_sizes(d, f);
}
