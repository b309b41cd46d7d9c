/*
 * Values that depend on parameters alone: the emitted function `prepare` computes them once, when a parameter
 * is set.
 *
 * Input: the graph and the functions planned so far. This file decides which expressions leave their
 * function, collects those that some function needs, and makes them the results of `prepare`. Every function
 * reads them in `p`, after the parameters. The gains of rows are among them because the integrator sets them
 * in its own copy of the parameters. A sign stays where it is used, because it costs nothing there. A
 * function with keeps_parameters computes these values itself, unless another function already has them from
 * `prepare`.
 */
#include "gen/plan/plan.h"

bool plan_is_sign(const struct graph *g, expression e) {
    return g->nodes[e].operation == OP_NEG || g->nodes[e].operation == OP_HOLD;
}

static bool is_parameter_only(const struct graph *g, expression e) {
    return operation_is_gain(g->nodes[e].operation) ||
           (g->nodes[e].depends == ON_PARAMETER && operation_arity(g->nodes[e].operation) > 0 &&
            !plan_is_sign(g, e));
}

bool plan_is_moved(const struct plan *plan, const struct function *function, expression e) {
    if (function == &plan->prepare)
        return false;
    return function->keeps_parameters ? plan->is_derived[e] : is_parameter_only(plan->g, e);
}

void plan_collect_derived(struct plan *plan, const struct function *function) {
    for (expression e = 0; e < plan->g->count; e++)
        if (function->is_needed[e] && plan_is_moved(plan, function, e))
            plan->is_derived[e] = true;
}

void prepare_open(struct plan *plan) {
    struct function *prepare = &plan->prepare;
    expression *derived = memory_get(plan->memory, plan->g->count * sizeof *derived);
    int count = 0;
    for (expression e = 0; e < plan->g->count; e++)
        if (plan->is_derived[e])
            derived[count++] = e;
    prepare->quantity = "prepare";
    const int array = plan_open_result(plan->memory, prepare, "derived", "", count, 0);
    plan_set_entries(plan->memory, prepare, array, 0, derived, count);
}
