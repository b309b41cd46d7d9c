/*
 * Sweeps over the graph: substitution, derivatives, values. Declared in graph.h.
 *
 * All are plain loops over handles: operands have smaller handles than results, so that ascending order
 * evaluates and descending order propagates derivatives backward. Nothing recurses.
 */
#include "graph.h"
#include "memory.h"

#include <math.h>

expression operation_partial(struct graph *g, expression r, int which) {
    const struct node node = g->nodes[r];
    const expression a = node.operand[0], b = node.operand[1];
    switch (node.operation) {
#define OP(name, arity, text, cost, value, da, db, dc) \
    case OP_##name:                                    \
        return which == 0 ? da : which == 1 ? db : dc;
#include "ops.def"
#undef OP
    case OP_SPLINE:
        return spline_slope(g, r);
    default:
        return 0;
    }
    (void)b;
}

/* The values that a slot takes: true when one stands above e, which a descending sweep has passed. */
static bool mark_slot(const struct graph *g, bool *needed, uint32_t limit, expression e) {
    const struct slot *slot = as_slot(g, e);
    if (!slot)
        return false;
    needed[slot->initial] = true;
    if (slot->next >= limit || needed[slot->next])
        return false;
    needed[slot->next] = true;
    return slot->next > e;
}

void mark_operands(const struct graph *g, bool *needed, uint32_t limit) {
    for (bool again = true; again;) {
        again = false;
        for (expression e = limit; e-- > 0;) {
            if (!needed[e])
                continue;
            for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
                needed[g->nodes[e].operand[k]] = true;
            again |= mark_slot(g, needed, limit, e);
        }
    }
}

/* marks[e] for all that the `count` roots need; the array has `limit` entries, limit the largest root + 1. */
static bool *mark_needed(struct graph *g, const expression *roots, int count, uint32_t *limit) {
    *limit = 0;
    for (int i = 0; i < count; i++)
        if (roots[i] >= *limit)
            *limit = roots[i] + 1;
    bool *marks = memory_get(g->memory, (*limit + 1) * sizeof *marks);
    for (int i = 0; i < count; i++)
        marks[roots[i]] = true;
    mark_operands(g, marks, *limit);
    return marks;
}

/* The image of e, whose operands have theirs. */
static expression image_of(struct graph *g, expression e, const expression *image) {
    expression operands[3] = {0, 0, 0};
    for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
        operands[k] = image[g->nodes[e].operand[k]];
    return g->nodes[e].operation == OP_NUMBER ? e : rebuild(g, e, operands);
}

void substitute(struct graph *g, leaf_rule *leaf, void *context, const expression *from, expression *to,
                int count) {
    uint32_t limit;
    bool *needed = mark_needed(g, from, count, &limit);
    expression *image = memory_get(g->memory, (limit + 1) * sizeof *image);
    for (expression e = 0; e < limit; e++)
        if (needed[e])
            image[e] = as_symbol(g, e) ? leaf(context, g, e) : image_of(g, e, image);
    for (int i = 0; i < count; i++)
        to[i] = image[from[i]];
}

expression replace(struct graph *g, expression in, expression node, expression by) {
    uint32_t limit;
    bool *needed = mark_needed(g, &in, 1, &limit);
    expression *image = memory_get(g->memory, (limit + 1) * sizeof *image);
    for (expression e = 0; e < limit; e++)
        if (needed[e])
            image[e] = e == node ? by : as_symbol(g, e) ? e : image_of(g, e, image);
    return image[in];
}

expression differentiate(struct graph *g, expression root_of, leaf_rule *leaf, void *context) {
    uint32_t limit;
    bool *needed = mark_needed(g, &root_of, 1, &limit);
    expression *rate = memory_get(g->memory, (limit + 1) * sizeof *rate);
    for (expression e = 0; e < limit; e++) {
        if (!needed[e])
            continue;
        const struct node node = g->nodes[e];
        if (node.operation == OP_SYMBOL)
            rate[e] = leaf(context, g, e);
        for (int k = 0; k < operation_arity(node.operation); k++)
            if (rate[node.operand[k]])
                rate[e] = add(g, rate[e], mul(g, operation_partial(g, e, k), rate[node.operand[k]]));
    }
    return rate[root_of];
}

void gradient(struct graph *g, expression root_of, const expression *by, expression *result, int count) {
    uint32_t limit;
    bool *needed = mark_needed(g, &root_of, 1, &limit);
    expression *weight = memory_get(g->memory, (limit + 1) * sizeof *weight);
    weight[root_of] = 1;
    for (expression e = limit; e-- > 0;) {
        if (!needed[e] || !weight[e])
            continue;
        const struct node node = g->nodes[e];
        for (int k = 0; k < operation_arity(node.operation); k++) {
            const expression into = node.operand[k];
            if (g->nodes[into].depends) /* numbers have no derivative */
                weight[into] = add(g, weight[into], mul(g, weight[e], operation_partial(g, e, k)));
        }
    }
    for (int i = 0; i < count; i++)
        result[i] = by[i] && by[i] < limit ? weight[by[i]] : 0; /* handle 0 is no symbol */
}

void visit_symbols(struct graph *g, expression e, void (*visit)(void *context, expression symbol),
                   void *context) {
    uint32_t limit;
    bool *needed = mark_needed(g, &e, 1, &limit);
    for (expression i = 0; i < limit; i++)
        if (needed[i] && as_symbol(g, i))
            visit(context, i);
}

double evaluate(struct graph *g, expression e, double (*value_of)(void *context, const struct symbol *s),
                void *context) {
    uint32_t limit;
    bool *needed = mark_needed(g, &e, 1, &limit);
    double *value = memory_get(g->memory, (limit + 1) * sizeof *value);
    for (expression i = 0; i < limit; i++) {
        if (!needed[i])
            continue;
        const struct symbol *leaf = as_symbol(g, i);
        value[i] = leaf ? value_of(context, leaf) : node_value(g, i, value);
    }
    return value[e];
}
