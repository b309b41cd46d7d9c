/*
 * Events: the quantities by which an integrator locates and handles state events, and the times at which
 * formulas of time alone have kinks, with the values that change sign at the others.
 *
 * Input: the events and kinks of the model. Results: `event`, their values e, and `event_terms`. With
 *     de/dt = rate + by_rate qdd
 * these are the rate at qdd = 0, the derivatives by coordinates and rates, the coefficients of restitution
 * and the values that events set, in this order.
 */
#include "gen/quantities/quantities.h"
#include "gen/dynamics/dynamics.h"
#include "gen/graph/graph.h"

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

/* ---- Times of kinks ---- */

/*
 * Times at which formulas of time alone have kinks or jumps: an integrator ends a step there.
 *
 * Input: the functions of a plan. Their minima, maxima, absolute values, comparisons and events have values
 * that change sign. Those that depend on time, parameters and inputs alone are collected here. For values
 * that are piecewise linear in t, plan->breaks has the zeros, as expressions without t. The other values are
 * plan->switches, whose zeros are located during a motion; plan->pace is their largest frequency, and
 * plan->event_pace that of events which depend on the state, and of loads on contacts.
 */

enum {
    MOST_BREAKS = 1000, /* kinks in time that are reported */
    DEEPEST_KINK = 4    /* nested kinks that are examined */
};
static const double pi = 3.14159265358979323846;

/* d/dt with everything else constant, and the value at t = 0. */
static expression time_derivative(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? EXPR_ONE : EXPR_ZERO;
}

static expression at_time_zero(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? EXPR_ZERO : e;
}

static bool has_kink(const struct graph *g, expression e) {
    const uint8_t operation = g->nodes[e].operation;
    return operation == OP_LESS || operation == OP_MIN || operation == OP_MAX || operation == OP_ABS;
}

/* The value that changes sign at a kink: a of |a|, a - b of a < b, min and max. */
static expression switching_function(struct graph *g, expression e) {
    const struct node node = g->nodes[e];
    return node.operation == OP_ABS ? node.operand[0] : expr_sub(g, node.operand[0], node.operand[1]);
}

/* The first kink of time alone inside e, or 0. */
static expression inner_kink(struct plan *plan, expression e) {
    bool *inside = memory_get(plan->memory, (e + 1) * sizeof *inside);
    inside[e] = true;
    rewrite_mark_operands(plan->g, inside, e + 1);
    for (expression i = 0; i <= e; i++)
        if (inside[i] && has_kink(plan->g, i) && plan->g->nodes[i].depends & ON_TIME)
            return i;
    return 0;
}

/* Adds e to a list once; false: the list is full. */
static bool list_once(expression *list, int *count, expression e) {
    for (int i = 0; i < *count; i++)
        if (list[i] == e)
            return true;
    if (*count == MOST_BREAKS)
        return false;
    list[(*count)++] = e;
    return true;
}

/* Adds the zero of s to the list; false: s is not linear in t. */
static bool add_zero(struct plan *plan, expression s) {
    struct graph *g = plan->g;
    expression start;
    const expression derivative = rewrite_derivative(g, s, time_derivative, NULL);
    if (derivative == EXPR_ZERO)
        return true;
    if (g->nodes[derivative].depends & ON_TIME)
        return false;
    rewrite_substitute(g, at_time_zero, NULL, &s, &start, 1);
    return list_once(plan->breaks, &plan->break_count, expr_neg(g, expr_div(g, start, derivative)));
}

/*
 * Lists the times at which s changes sign. If s contains a kink, as in min(max(t, a), b), it lists the times
 * of each branch. A superfluous time costs a step that ends there. A time that two kinks share is listed
 * once. False: some times are unknown.
 */
static bool add_breaks(struct plan *plan, expression s, int depth) {
    struct graph *g = plan->g;
    if (!(g->nodes[s].depends & ON_TIME))
        return true;
    const expression kink = inner_kink(plan, s);
    if (!kink)
        return add_zero(plan, s);
    if (depth == DEEPEST_KINK)
        return false;
    const struct node node = g->nodes[kink];
    const bool is_less = node.operation == OP_LESS, is_abs = node.operation == OP_ABS;
    const expression first = is_less ? EXPR_ONE : node.operand[0];
    const expression second = is_less ? EXPR_ZERO : is_abs ? expr_neg(g, node.operand[0]) : node.operand[1];
    const bool known = add_breaks(plan, rewrite_replace(g, s, kink, first), depth + 1);
    return add_breaks(plan, rewrite_replace(g, s, kink, second), depth + 1) && known;
}

void time_events_leave_out(struct plan *plan, expression e) {
    if (!plan->no_kinks)
        plan->no_kinks = memory_get(plan->memory, MOST_BREAKS * sizeof *plan->no_kinks);
    list_once(plan->no_kinks, &plan->no_kink_count, e);
}

static bool is_left_out(const struct plan *plan, expression e) {
    for (int i = 0; i < plan->no_kink_count; i++)
        if (plan->no_kinks[i] == e)
            return true;
    return false;
}

/* ---- Frequency of the sign changes ---- */

static expression larger(struct graph *g, expression a, expression b) {
    return a == b || b == EXPR_ZERO ? a : a == EXPR_ZERO ? b : expr_apply2(g, OP_MAX, a, b);
}

/* |d/dt| of e at qdd = 0, times a factor. */
static expression speed(struct derivation *d, expression e, double factor) {
    const bool moves = d->g->nodes[e].depends & (ON_STATE | ON_RATE);
    const expression rate = moves ? placed(d, coordinate_derivatives_rate(&d->kinematics, e))
                                  : rewrite_derivative(d->g, e, time_derivative, NULL);
    return expr_mul(d->g, expr_number(d->g, factor), absolute(d->g, rate));
}

/* The highest angular frequency of the pieces of a spline, relative to the rate of its operand. */
static double frequency_of_spline(const struct graph *g, const struct node *node) {
    const struct spline *spline = &g->splines[node->operand[1] / SPLINE_ORDERS];
    double least = 0;
    for (int i = 1; i < spline->count; i++) {
        const double apart = spline->pieces[i * PIECE_COLUMNS] - spline->pieces[(i - 1) * PIECE_COLUMNS];
        least = apart > 0 && (least == 0 || apart < least) ? apart : least;
    }
    return least > 0 ? pi / least : 0;
}

/* Of a point, the largest angular velocity of the frames that carry it, without the elements of beams. */
static expression pace_of_point(struct derivation *d, int point) {
    const struct tree *tree = d->kinematics.tree;
    expression most = EXPR_ZERO;
    for (int i = tree->points[point].frame; i >= 0; i = tree->frames[i].parent) {
        const struct vector w = d->kinematics.frames[i].angular;
        if (tree->frames[i].kind == FRAME_JOINT && tree->frames[i].run < 0 && !vector_is_zero(w))
            most = larger(d->g, most, expr_sqrt(d->g, vector_dot(d->g, w, w)));
    }
    return most;
}

/* The angular frequency of a node, from the frequencies of its operands in `pace`. Phases and knots have
 * the frequency at which they pass, products the sum of the frequencies of their factors. */
static expression pace_of_node(struct derivation *d, expression e, const expression *pace) {
    struct graph *g = d->g;
    const struct node node = g->nodes[e];
    const struct symbol *symbol = expr_as_symbol(g, e);
    const expression *operand = node.operand;
    double exponent;
    if (symbol && symbol->kind == SYMBOL_POINT)
        return pace_of_point(d, symbol->index / 3);
    if (symbol || !(node.depends & (ON_TIME | ON_STATE | ON_RATE)))
        return EXPR_ZERO;
    switch (node.operation) {
    case OP_SIN:
    case OP_COS:
    case OP_TAN:
        return expr_add(g, pace[operand[0]], speed(d, operand[0], 1));
    case OP_SPLINE:
        return expr_add(g, pace[operand[0]], speed(d, operand[0], frequency_of_spline(g, &node)));
    case OP_POW:
        if (expr_is_number(g, operand[1], &exponent))
            return expr_mul(g, expr_number(g, exponent < 0 ? -exponent : exponent), pace[operand[0]]);
        return expr_add(g, pace[operand[0]], pace[operand[1]]);
    case OP_MUL:
    case OP_DIV:
    case OP_ATAN2:
        return expr_add(g, pace[operand[0]], pace[operand[1]]);
    default: {
        expression most = EXPR_ZERO;
        for (int k = 0; k < operation_arity((enum operation)node.operation); k++)
            most = larger(g, most, pace[operand[k]]);
        return most;
    }
    }
}

/* The angular frequency of a value: an expression of t, parameters, inputs and the state. */
static expression pace_of(struct derivation *d, expression value) {
    bool *inside = memory_get(d->memory, (value + 1) * sizeof *inside);
    expression *pace = memory_get(d->memory, (value + 1) * sizeof *pace);
    inside[value] = true;
    rewrite_mark_operands(d->g, inside, value + 1);
    for (expression e = 0; e <= value; e++)
        if (inside[e])
            pace[e] = pace_of_node(d, e, pace);
    return pace[value];
}

static bool is_of_time_alone(const struct graph *g, expression e) {
    return g->nodes[e].depends & ON_TIME && !(g->nodes[e].depends & (ON_STATE | ON_RATE));
}

/* The largest frequency of the functions of time in the nodes of the plan's functions: steps do not follow
 * the loads of contacts at rest, and the forces of these contacts vary with the loads. */
static expression pace_of_loads(struct derivation *d, const bool *needed, uint32_t count) {
    struct graph *g = d->g;
    bool *is_part = memory_get(d->memory, count * sizeof *is_part);
    expression most = EXPR_ZERO;
    for (expression e = 0; e < count; e++)
        for (int k = 0; needed[e] && k < operation_arity((enum operation)g->nodes[e].operation); k++)
            is_part[g->nodes[e].operand[k]] |= is_of_time_alone(g, e);
    for (expression e = 0; e < count; e++)
        if (needed[e] && !is_part[e] && is_of_time_alone(g, e))
            most = larger(g, most, pace_of(d, e));
    return most;
}

static bool has_contacts(const struct model *model) {
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact >= 0)
            return true;
    return false;
}

/* Contacts that are open are left to the steps, which end at impacts. */
static void find_paces(struct derivation *d, const bool *needed, uint32_t count) {
    struct plan *plan = d->plan;
    plan->pace = plan->event_pace = EXPR_ZERO;
    for (int i = 0; i < plan->switch_count; i++)
        plan->pace = larger(d->g, plan->pace, pace_of(d, plan->switches[i]));
    for (int i = 0; i < d->model->event_count; i++) {
        const struct event *event = &d->model->events[i];
        if (event->contact < 0 && d->g->nodes[event->value].depends & (ON_STATE | ON_RATE))
            plan->event_pace = larger(d->g, plan->event_pace, pace_of(d, event->value));
    }
    if (has_contacts(d->model))
        plan->event_pace = larger(d->g, plan->event_pace, pace_of_loads(d, needed, count));
}

/* ---- All times of kinks ---- */

/* Lists the times at which s, a value of time, parameters and inputs alone, changes its sign. */
static void list_signs(struct plan *plan, expression s) {
    if (!(plan->g->nodes[s].depends & ~(ON_TIME | ON_PARAMETER | ON_INPUT)) && !add_breaks(plan, s, 0))
        list_once(plan->switches, &plan->switch_count, s);
}

/* A pulse of time may lift a resting body between two samples, however short it is. Steps end at its peak,
 * which a pulse of exp(u) or 1/u has where u turns, and one of tanh(u) where u is zero. */
static void list_peak(struct plan *plan, expression e) {
    struct graph *g = plan->g;
    const struct node node = g->nodes[e];
    double exponent = -1;
    const bool is_quotient = node.operation == OP_DIV;
    const bool is_power =
        node.operation == OP_POW && (!expr_is_number(g, node.operand[1], &exponent) || exponent < 0);
    const expression u = node.operand[is_quotient];
    if (!is_of_time_alone(g, e) || !is_of_time_alone(g, u))
        return;
    if (node.operation == OP_EXP || is_quotient || is_power)
        list_signs(plan, rewrite_derivative(g, u, time_derivative, NULL));
    else if (node.operation == OP_TANH)
        list_signs(plan, u);
}

void time_events_find(struct derivation *d) {
    struct plan *plan = d->plan;
    struct graph *g = plan->g;
    const uint32_t count = g->count; /* nodes that this loop adds are not examined */
    bool *needed = plan_mark_nodes_of_functions(plan);
    for (int i = 0; i < plan->model->event_count; i++)
        needed[plan->model->events[i].value] = true;
    rewrite_mark_operands(g, needed, count);
    plan->breaks = memory_get(plan->memory, MOST_BREAKS * sizeof *plan->breaks);
    plan->switches = memory_get(plan->memory, MOST_BREAKS * sizeof *plan->switches);
    for (expression e = 0; e < count; e++) {
        if (needed[e] && has_contacts(d->model))
            list_peak(plan, e);
        if (!needed[e] || !has_kink(g, e) || is_left_out(plan, e))
            continue;
        list_signs(plan, switching_function(g, e));
    }
    for (int i = 0; i < plan->model->event_count; i++)
        list_signs(plan, plan->model->events[i].value);
    find_paces(d, needed, count);
}
