/* Times of kinks: see times_of_kinks.h. */
#include "quantities/times_of_kinks.h"

enum {
    MOST_BREAKS = 1000, /* kinks in time that are reported */
    DEEPEST_KINK = 4    /* kinks inside each other that are followed */
};

/* d/dt with all else constant, and the value at t = 0. */
static expression time_derivative(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? expr_one(g) : expr_zero(g);
}

static expression at_time_zero(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? expr_zero(g) : e;
}

static bool has_kink(const struct graph *g, expression e) {
    const uint8_t operation = g->nodes[e].operation;
    return operation == OP_LESS || operation == OP_MIN || operation == OP_MAX || operation == OP_ABS;
}

/* What changes sign at a kink: a of |a|, a - b of a < b, min and max. */
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

/* Lists e once; false: there is no room. */
static bool list_once(expression *list, int *count, expression e) {
    for (int i = 0; i < *count; i++)
        if (list[i] == e)
            return true;
    if (*count == MOST_BREAKS)
        return false;
    list[(*count)++] = e;
    return true;
}

/* Lists the zero of s; false: it is not linear in t. */
static bool add_zero(struct plan *plan, expression s) {
    struct graph *g = plan->g;
    expression start;
    const expression derivative = rewrite_derivative(g, s, time_derivative, NULL);
    if (derivative == expr_zero(g))
        return true;
    if (g->nodes[derivative].depends & ON_TIME)
        return false;
    rewrite_substitute(g, at_time_zero, NULL, &s, &start, 1);
    return list_once(plan->breaks, &plan->break_count, expr_neg(g, expr_div(g, start, derivative)));
}

/*
 * Lists the times at which s changes sign: where a kink stands inside, as in min(max(t, a), b), those of each
 * branch. A time too many costs a step that ends there; one in sight of another kink is found twice and kept
 * once. False: some are not known.
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
    const expression first = is_less ? expr_one(g) : node.operand[0];
    const expression second = is_less  ? expr_zero(g)
                              : is_abs ? expr_neg(g, node.operand[0])
                                       : node.operand[1];
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

void time_events_find(struct plan *plan) {
    struct graph *g = plan->g;
    const uint32_t count = g->count; /* what is built here is looked at no more */
    const bool *needed = plan_mark_nodes_of_functions(plan);
    plan->breaks = memory_get(plan->memory, MOST_BREAKS * sizeof *plan->breaks);
    plan->switches = memory_get(plan->memory, MOST_BREAKS * sizeof *plan->switches);
    for (expression e = 0; e < count; e++) {
        if (!needed[e] || !has_kink(g, e) || is_left_out(plan, e))
            continue;
        const expression s = switching_function(g, e);
        if (!(g->nodes[s].depends & ~(ON_TIME | ON_PARAMETER | ON_INPUT)) && !add_breaks(plan, s, 0))
            list_once(plan->switches, &plan->switch_count, s);
    }
}
