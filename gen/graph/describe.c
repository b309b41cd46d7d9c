/*
 * Expressions as text for people who change the generator: in messages of checks and in `refdyn gen
 * --explain`.
 *
 * A value appears as its name and handle, "w_x#412", or as its handle alone, "#412". Numbers and symbols are
 * spelled out: p[2] is a parameter, x[0] an input, q[3], qd[3], qdd[3] a coordinate, e.q[7] the coordinate of
 * frame 7 in the current element, carried[5] and final[5] the value of slot 5 at the beginning of an
 * iteration and after the loop.
 */
#include "gen/graph/graph.h"

#include <string.h>

static const char *const operation_names[] = {
    [OP_NUMBER] = "NUMBER",
    [OP_SYMBOL] = "SYMBOL",
    [OP_SPLINE] = "SPLINE",
#define OP(name, arity, text, cost, value, da, db, dc) [OP_##name] = #name,
#include "gen/graph/ops.def"
#undef OP
};
_Static_assert(sizeof operation_names / sizeof *operation_names == OP_COUNT, "each operation has a name");

static const char *const symbol_names[] = {
    [SYMBOL_PARAMETER] = "p",     [SYMBOL_INPUT] = "x",     [SYMBOL_TIME] = "t",
    [SYMBOL_COORDINATE] = "q",    [SYMBOL_POINT] = "point", [SYMBOL_MULTIPLIER] = "lambda",
    [SYMBOL_START] = "start",     [SYMBOL_ELEMENT] = "e.q", [SYMBOL_LAST] = "is_last",
    [SYMBOL_CARRIED] = "carried", [SYMBOL_FINAL] = "final",
};
_Static_assert(sizeof symbol_names / sizeof *symbol_names == SYMBOL_FINAL + 1, "each kind has a name");

const char *operation_name(enum operation operation) {
    return operation_names[operation];
}

static void describe_symbol(struct text *text, const struct symbol *s) {
    text_add(text, "%s%.*s", symbol_names[s->kind], s->order, "ddd");
    if (s->kind != SYMBOL_TIME)
        text_add(text, "[%d]", s->index);
}

static bool is_infix(enum operation operation) {
    return operation_arity(operation) == 2 && strchr("+-*/<", *operation_text(operation));
}

static void describe_call(struct text *text, const struct graph *g, expression e, const bool *is_marked) {
    const struct node *node = &g->nodes[e];
    text_add(text, "%s(", operation_names[node->operation]);
    for (int k = 0; k < operation_arity(node->operation); k++) {
        text_add(text, "%s", k ? ", " : "");
        describe_value(text, g, node->operand[k], is_marked);
    }
    if (node->operation == OP_SPLINE)
        text_add(text, ", table %u, order %u", node->operand[1] / SPLINE_ORDERS,
                 node->operand[1] % SPLINE_ORDERS);
    text_add(text, ")");
}

static void describe_infix(struct text *text, const struct graph *g, expression e, const bool *is_marked) {
    const struct node *node = &g->nodes[e];
    describe_value(text, g, node->operand[0], is_marked);
    text_add(text, " %s ", operation_text(node->operation));
    describe_value(text, g, node->operand[1], is_marked);
}

void describe_definition(struct text *text, const struct graph *g, expression e, const bool *is_marked) {
    const enum operation operation = g->nodes[e].operation;
    char buffer[32];
    double value;
    if (expr_is_number(g, e, &value))
        text_add(text, "%s", text_of_number(value, buffer));
    else if (operation == OP_SYMBOL)
        describe_symbol(text, expr_as_symbol(g, e));
    else if (is_infix(operation))
        describe_infix(text, g, e, is_marked);
    else
        describe_call(text, g, e, is_marked);
}

void describe_value(struct text *text, const struct graph *g, expression e, const bool *is_marked) {
    const enum operation operation = g->nodes[e].operation;
    const bool is_leaf = operation == OP_NUMBER || operation == OP_SYMBOL;
    if (!is_leaf && (!is_marked || is_marked[e])) {
        text_add(text, "%s#%u", g->names[e] ? g->names[e] : "", e);
        return;
    }
    text_add(text, is_infix(operation) ? "(" : "");
    describe_definition(text, g, e, is_marked);
    text_add(text, is_infix(operation) ? ")" : "");
}
