/*
 * Sweeps over the graph: substitution, derivatives, values.
 *
 * All are plain loops over handles. Operands have smaller handles than results, so that ascending order
 * evaluates and descending order propagates derivatives backward. Nothing recurses.
 */
#include "gen/graph/graph.h"
#include "gen/base/base.h"

#include <assert.h>
#include <math.h>

/* The partial derivative of node r with respect to operand `which` (0, 1, 2). */
static expression operation_partial(struct graph *g, expression r, int which) {
    const struct node node = g->nodes[r];
    const expression a = node.operand[0], b = node.operand[1];
    switch (node.operation) {
#define OP(name, arity, text, cost, value, da, db, dc) \
    case OP_##name:                                    \
        return which == 0 ? da : which == 1 ? db : dc;
#include "gen/graph/ops.def"
#undef OP
    case OP_SPLINE:
        return expr_spline_derivative(g, r);
    default:
        return 0;
    }
    (void)b;
}

/* Marks the values that a slot takes. True if one has a handle above e, which a descending sweep has
 * already passed. */
static bool mark_slot(const struct graph *g, bool *needed, uint32_t limit, expression e) {
    const struct slot *slot = graph_as_slot(g, e);
    if (!slot)
        return false;
    needed[slot->initial] = true;
    if (slot->next >= limit || needed[slot->next])
        return false;
    needed[slot->next] = true;
    return slot->next > e;
}

static void mark_all(const struct graph *g, bool *needed, uint32_t limit, bool held_too) {
    for (bool again = true; again;) {
        again = false;
        for (expression e = limit; e-- > 0;) {
            if (!needed[e] || (g->nodes[e].operation == OP_HOLD && !held_too))
                continue;
            for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
                needed[g->nodes[e].operand[k]] = true;
            again |= mark_slot(g, needed, limit, e);
        }
    }
}

void rewrite_mark_operands(const struct graph *g, bool *needed, uint32_t limit) {
    mark_all(g, needed, limit, true);
}

/* Marks, by handle, all values that the `count` roots need. The result is scratch of `limit` entries,
 * where limit is the largest root + 1. */
static bool *mark_needed(struct graph *g, const expression *roots, int count, uint32_t *limit) {
    *limit = 0;
    for (int i = 0; i < count; i++)
        if (roots[i] >= *limit)
            *limit = roots[i] + 1;
    bool *marks = memory_scratch(g->memory, (*limit + 1) * sizeof *marks);
    for (int i = 0; i < count; i++)
        marks[roots[i]] = true;
    rewrite_mark_operands(g, marks, *limit);
    return marks;
}

/* The image of e, whose operands already have images. */
static expression image_of(struct graph *g, expression e, const expression *image) {
    expression operands[3] = {0, 0, 0};
    for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
        operands[k] = image[g->nodes[e].operand[k]];
    return g->nodes[e].operation == OP_NUMBER ? e : expr_rebuild(g, e, operands);
}

void rewrite_substitute(struct graph *g, leaf_rule *leaf, void *context, const expression *from,
                        expression *to, int count) {
    const struct memory_mark mark = memory_mark(g->memory);
    uint32_t limit;
    bool *needed = mark_needed(g, from, count, &limit);
    expression *image = memory_scratch(g->memory, (limit + 1) * sizeof *image);
    for (expression e = 0; e < limit; e++)
        if (needed[e])
            image[e] = expr_as_symbol(g, e) ? leaf(context, g, e) : image_of(g, e, image);
    for (int i = 0; i < count; i++)
        to[i] = image[from[i]];
    memory_back(g->memory, mark);
}

expression rewrite_replace(struct graph *g, expression in, expression node, expression by) {
    const struct memory_mark mark = memory_mark(g->memory);
    uint32_t limit;
    bool *needed = mark_needed(g, &in, 1, &limit);
    expression *image = memory_scratch(g->memory, (limit + 1) * sizeof *image);
    for (expression e = 0; e < limit; e++)
        if (needed[e])
            image[e] = e == node ? by : expr_as_symbol(g, e) ? e : image_of(g, e, image);
    const expression result = image[in];
    memory_back(g->memory, mark);
    return result;
}

/* ---- Derivatives in several directions ---- */

struct sweep {
    struct graph *g;
    leaf_rule *leaf;
    void *const *contexts;
    int directions;
    uint32_t limit;
    bool *needed;
    expression *rates; /* by handle, one for each direction */
    int *slots; /* by slot, one for each direction: the slot of its rate; -1: its rate does not change */
};

static expression *rates_of(const struct sweep *x, expression e) {
    return x->rates + (size_t)e * (size_t)x->directions;
}

static void differentiate_node(struct sweep *x, expression e) {
    struct graph *g = x->g;
    const struct node node = g->nodes[e];
    expression *rates = rates_of(x, e);
    for (int d = 0; d < x->directions; d++) {
        if (node.operation == OP_SYMBOL && !graph_as_slot(g, e))
            rates[d] = x->leaf(x->contexts[d], g, e);
        if (node.operation == OP_WHERE)
            rates[d] = expr_where(g, node.operand[0], rates_of(x, node.operand[1])[d],
                                  rates_of(x, node.operand[2])[d]);
        for (int k = 0; k < operation_arity(node.operation) && node.operation != OP_WHERE; k++) {
            const expression rate = rates_of(x, node.operand[k])[d];
            if (rate)
                rates[d] = expr_add(g, rates[d], expr_mul(g, operation_partial(g, e, k), rate));
        }
    }
}

static bool is_carried_of(const struct sweep *x, int slot, int loop) {
    const struct slot *s = &x->g->slots[slot];
    return s->loop == loop && (x->needed[s->carried] || x->needed[s->final]);
}

/* Sets the rates of a slot's value at the beginning of an iteration, or after the loop. */
static void begin_rates(struct sweep *x, int slot, bool after) {
    const struct slot s = x->g->slots[slot];
    for (int d = 0; d < x->directions; d++) {
        const int own = x->slots[slot * x->directions + d];
        const struct slot *rate = &x->g->slots[own < 0 ? 0 : own];
        rates_of(x, after ? s.final : s.carried)[d] = own < 0 ? rates_of(x, s.initial)[d]
                                                      : after ? rate->final
                                                              : rate->carried;
    }
}

/* True if a rate that was assumed constant is not. */
static bool end_rates(struct sweep *x, int slot) {
    const struct slot s = x->g->slots[slot];
    bool changed = false;
    for (int d = 0; d < x->directions; d++) {
        int *own = &x->slots[slot * x->directions + d];
        const expression initial = rates_of(x, s.initial)[d], next = rates_of(x, s.next)[d];
        assert(*own < x->g->slot_count);
        if (*own >= 0) {
            graph_set_next(x->g, *own, next);
        } else if (next != initial) {
            *own = graph_new_slot(x->g, initial);
            changed = true;
        }
    }
    return changed;
}

static void differentiate_body(struct sweep *x, int loop) {
    const struct element_loop body = x->g->loops[loop];
    for (expression e = body.begin; e < body.end; e++) {
        if (!x->needed[e] || x->g->nodes[e].loop != loop || graph_as_slot(x->g, e))
            continue;
        for (int d = 0; d < x->directions; d++)
            rates_of(x, e)[d] = 0;
        differentiate_node(x, e);
    }
}

static bool has_needed(const struct sweep *x, int loop) {
    for (expression e = x->g->loops[loop].begin; e < x->g->loops[loop].end; e++)
        if (x->needed[e] && x->g->nodes[e].loop == loop)
            return true;
    return false;
}

/* Makes one loop for the rates of all values of another loop. Trial finds which rates need slots, as in
 * recursions. */
static void differentiate_loop(struct sweep *x, int loop) {
    const int slots = x->g->slot_count;
    const struct element_loop of = x->g->loops[loop];
    if (!has_needed(x, loop))
        return;
    graph_open_loop(x->g, of.run, of.inward);
    for (bool again = true; again;) {
        again = false;
        for (int s = 0; s < slots; s++)
            if (is_carried_of(x, s, loop))
                begin_rates(x, s, false);
        differentiate_body(x, loop);
        for (int s = 0; s < slots; s++)
            if (is_carried_of(x, s, loop))
                again |= end_rates(x, s);
    }
    graph_close_loop(x->g);
    for (int s = 0; s < slots; s++)
        if (is_carried_of(x, s, loop))
            begin_rates(x, s, true);
}

/* Differentiates values outside loops in order of handles, and each loop where it ends. */
static void differentiate_needed(struct sweep *x) {
    const int loops = x->g->loop_count;
    int loop = 1;
    for (expression e = 0; e < x->limit; e++) {
        for (; loop < loops && x->g->loops[loop].end <= e; loop++)
            differentiate_loop(x, loop);
        const uint16_t home = x->g->nodes[e].loop;
        if (x->needed[e] && (!home || home == ANY_LOOP))
            differentiate_node(x, e);
    }
    for (; loop < loops; loop++)
        differentiate_loop(x, loop);
}

void rewrite_derivatives(struct graph *g, const expression *from, expression *to, int count, leaf_rule *leaf,
                         void *const *contexts, int directions) {
    assert(!g->open);
    const struct memory_mark mark = memory_mark(g->memory);
    struct sweep x = {g, leaf, contexts, directions, g->count, NULL, NULL, NULL};
    const size_t width = (size_t)directions;
    x.needed = memory_scratch(g->memory, (x.limit + 1) * sizeof *x.needed);
    x.rates = memory_scratch(g->memory, (x.limit + 1) * width * sizeof *x.rates);
    x.slots = memory_scratch(g->memory, ((size_t)g->slot_count * width + 1) * sizeof *x.slots);
    for (int s = 0; s < g->slot_count * directions; s++)
        x.slots[s] = -1;
    for (int i = 0; i < count; i++)
        x.needed[from[i]] = true;
    mark_all(g, x.needed, x.limit, false);
    differentiate_needed(&x);
    for (int d = 0; d < directions; d++)
        for (int i = 0; i < count; i++)
            to[d * count + i] = rates_of(&x, from[i])[d];
    memory_back(g->memory, mark);
}

expression rewrite_derivative(struct graph *g, expression e, leaf_rule *leaf, void *context) {
    rewrite_derivatives(g, &e, &e, 1, leaf, &context, 1);
    return e;
}

void rewrite_gradient(struct graph *g, expression root_of, const expression *by, expression *result,
                      int count) {
    const struct memory_mark mark = memory_mark(g->memory);
    uint32_t limit;
    bool *needed = mark_needed(g, &root_of, 1, &limit);
    expression *weight = memory_scratch(g->memory, (limit + 1) * sizeof *weight);
    weight[root_of] = 1;
    for (expression e = limit; e-- > 0;) {
        if (!needed[e] || !weight[e])
            continue;
        const struct node node = g->nodes[e];
        for (int k = 0; k < operation_arity(node.operation); k++) {
            const expression into = node.operand[k];
            assert(into < e);
            if (g->nodes[into].depends) /* numbers have no derivative */
                weight[into] = expr_add(g, weight[into], expr_mul(g, weight[e], operation_partial(g, e, k)));
        }
    }
    for (int i = 0; i < count; i++)
        result[i] = by[i] && by[i] < limit ? weight[by[i]] : 0; /* handle 0 is not a symbol */
    memory_back(g->memory, mark);
}

expression *rewrite_list_symbols(struct graph *g, expression e, int *count) {
    const struct memory_mark mark = memory_mark(g->memory);
    uint32_t limit;
    bool *needed = mark_needed(g, &e, 1, &limit);
    *count = 0;
    for (expression i = 0; i < limit; i++)
        *count += needed[i] && expr_as_symbol(g, i);
    expression *symbols = memory_get(g->memory, ((size_t)*count + 1) * sizeof *symbols), *next = symbols;
    for (expression i = 0; i < limit; i++)
        if (needed[i] && expr_as_symbol(g, i))
            *next++ = i;
    memory_back(g->memory, mark);
    return symbols;
}

double rewrite_evaluate(struct graph *g, expression e,
                        double (*value_of)(void *context, const struct symbol *s), void *context) {
    double result;
    if (expr_is_number(g, e, &result))
        return result;
    const struct memory_mark mark = memory_mark(g->memory);
    uint32_t limit;
    bool *needed = mark_needed(g, &e, 1, &limit);
    double *value = memory_scratch(g->memory, (limit + 1) * sizeof *value);
    for (expression i = 0; i < limit; i++) {
        if (!needed[i])
            continue;
        const struct symbol *leaf = expr_as_symbol(g, i);
        value[i] = leaf ? value_of(context, leaf) : graph_node_value(g, i, value);
    }
    result = value[e];
    memory_back(g->memory, mark);
    return result;
}
