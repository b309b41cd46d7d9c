/*
 * Detects whether a rate drives a term of the accelerations to its limit, as in friction.
 *
 * Input: the functions of a plan. It searches for operations of the accelerations that stay bounded or jump
 * when a rate passes a value or grows, regardless of the author's formula: tanh(r), r/sqrt(r^2 + w^2),
 * comparisons of r.
 */
#include "gen/base/base.h"
#include "gen/plan/plan.h"

#include <string.h>

/* Marks the nodes of the accelerations. It leaves out derivatives, which have quotients and comparisons of
 * their own. */
static bool *mark_accelerations(const struct plan *plan) {
    static const char *const quantities[] = {"Q", "f", "equations", "qdd_free", "constrained"};
    bool *needed = memory_get(plan->memory, plan->g->count * sizeof *needed);
    for (int f = 0; f < plan->function_count; f++)
        for (size_t i = 0; i < sizeof quantities / sizeof *quantities; i++)
            if (!strcmp(plan->functions[f].quantity, quantities[i]))
                plan_mark_results(&plan->functions[f], needed);
    rewrite_mark_operands(plan->g, needed, plan->g->count);
    return needed;
}

static bool symbol_is_rate(const struct graph *g, const bool *is_rate, expression e) {
    const struct slot *slot = graph_as_slot(g, e);
    if (slot)
        return is_rate[slot->initial] || is_rate[slot->next];
    return expr_as_symbol(g, e)->order > 0;
}

static bool node_is_rate(const struct graph *g, const bool *is_rate, expression e) {
    const struct node *node = &g->nodes[e];
    if (node->operation == OP_SYMBOL)
        return symbol_is_rate(g, is_rate, e);
    if (node->operation == OP_SPLINE)
        return is_rate[node->operand[0]];
    for (int i = 0; i < operation_arity(node->operation); i++)
        if (is_rate[node->operand[i]])
            return true;
    return false;
}

/* Marks, by handle, the nodes that depend on rates, also through loops. A node's `depends` is no use here:
 * it counts all that loops carry as a rate. */
static bool *mark_rates(const struct plan *plan) {
    const struct graph *g = plan->g;
    bool *is_rate = memory_get(plan->memory, g->count * sizeof *is_rate);
    for (bool again = true; again;) {
        again = false;
        for (expression e = 0; e < g->count; e++)
            if (!is_rate[e] && node_is_rate(g, is_rate, e))
                is_rate[e] = again = true;
    }
    return is_rate;
}

static bool is_negative(const struct graph *g, expression e) {
    double value;
    return expr_is_number(g, e, &value) && value < 0;
}

static bool node_saturates(const struct graph *g, const bool *is_rate, const struct node *node) {
    switch (node->operation) {
    case OP_DIV:
        return is_rate[node->operand[1]];
    case OP_POW:
        return is_rate[node->operand[0]] && is_negative(g, node->operand[1]);
    case OP_TANH:
    case OP_ATAN:
    case OP_SPLINE:
        return is_rate[node->operand[0]];
    case OP_ATAN2:
    case OP_MIN:
    case OP_MAX:
    case OP_LESS:
        return is_rate[node->operand[0]] || is_rate[node->operand[1]];
    default:
        return false;
    }
}

bool plan_saturates(const struct plan *plan) {
    const struct graph *g = plan->g;
    const bool *needed = mark_accelerations(plan), *is_rate = mark_rates(plan);
    for (expression e = 0; e < g->count; e++)
        if (needed[e] && node_saturates(g, is_rate, &g->nodes[e]))
            return true;
    return false;
}
