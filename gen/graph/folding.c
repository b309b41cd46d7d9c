/*
 * Builds expressions. Folds them where the result is exact: 0 and 1, signs, numbers on both sides; x*0 -> 0
 * and x-x -> 0 assume a finite x.
 *
 * Input: operands. Result: the handle of the node in the graph.
 */
#include "gen/graph/graph.h"

#include <assert.h>
#include <math.h>

static expression raw(struct graph *g, enum operation operation, expression a, expression b, expression c) {
    assert(a < g->count && b < g->count && c < g->count);
    uint8_t depends = g->nodes[a].depends;
    if (operation_arity(operation) > 1)
        depends |= g->nodes[b].depends;
    if (operation_arity(operation) > 2)
        depends |= g->nodes[c].depends;
    if (operation_is_gain(operation))
        depends |= ON_GAIN;
    return graph_intern(
        g, (struct node){.operation = (uint8_t)operation, .depends = depends, .operand = {a, b, c}});
}

static bool is_negated(const struct graph *g, expression e) {
    return g->nodes[e].operation == OP_NEG;
}

/* The operand x of a node -x. */
static expression inside(const struct graph *g, expression e) {
    return g->nodes[e].operand[0];
}

/* Returns whether e is a node -x or a negative number, whose sign can move. */
static bool is_negative(const struct graph *g, expression e) {
    double x;
    return expr_is_number(g, e, &x) ? x < 0 : is_negated(g, e);
}

static bool both_numbers(const struct graph *g, expression a, expression b, double *x, double *y) {
    return expr_is_number(g, a, x) && expr_is_number(g, b, y);
}

expression expr_neg(struct graph *g, expression a) {
    double x;
    if (expr_is_number(g, a, &x))
        return expr_number(g, -x);
    if (is_negated(g, a))
        return inside(g, a);
    if (g->nodes[a].operation == OP_SUB)
        return expr_sub(g, g->nodes[a].operand[1], g->nodes[a].operand[0]);
    return raw(g, OP_NEG, a, 0, 0);
}

expression expr_add(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x + y);
    if (a == 0)
        return b;
    if (b == 0)
        return a;
    if (is_negative(g, b))
        return expr_sub(g, a, expr_neg(g, b));
    if (is_negative(g, a))
        return expr_sub(g, b, expr_neg(g, a));
    return a < b ? raw(g, OP_ADD, a, b, 0) : raw(g, OP_ADD, b, a, 0);
}

expression expr_sub(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x - y);
    if (a == b)
        return 0; /* assumes a finite value */
    if (b == 0)
        return a;
    if (a == 0)
        return expr_neg(g, b);
    if (is_negative(g, b))
        return expr_add(g, a, expr_neg(g, b));
    if (is_negative(g, a))
        return expr_neg(g, expr_add(g, expr_neg(g, a), b));
    return raw(g, OP_SUB, a, b, 0);
}

/* Moves the sign of a factor in front of the product: replaces a by |a| and returns whether it was
 * negative. */
static bool take_sign(struct graph *g, expression *a) {
    bool negative = is_negative(g, *a);
    if (negative)
        *a = expr_neg(g, *a);
    return negative;
}

expression expr_mul(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x * y);
    if (a == 0 || b == 0)
        return 0; /* assumes a finite value */
    bool negative = take_sign(g, &a);
    negative ^= take_sign(g, &b);
    expression product = a == 1 ? b : b == 1 ? a : a < b ? raw(g, OP_MUL, a, b, 0) : raw(g, OP_MUL, b, a, 0);
    return negative ? expr_neg(g, product) : product;
}

expression expr_div(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x / y);
    if (a == 0)
        return 0; /* assumes a nonzero divisor */
    bool negative = take_sign(g, &a);
    negative ^= take_sign(g, &b);
    expression result = b == 1 ? a : a == b ? 1 : raw(g, OP_DIV, a, b, 0);
    return negative ? expr_neg(g, result) : result;
}

static expression whole_power(struct graph *g, expression a, int exponent) {
    if (exponent == 0)
        return 1;
    if (exponent == 1)
        return a;
    expression half = whole_power(g, a, exponent / 2);
    expression square = expr_mul(g, half, half);
    return exponent % 2 ? expr_mul(g, square, a) : square;
}

expression expr_power(struct graph *g, expression a, expression b) {
    enum { LARGEST = 16 };
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, pow(x, y));
    if (expr_is_number(g, b, &y) && y == floor(y) && fabs(y) <= LARGEST) {
        expression p = whole_power(g, a, (int)fabs(y));
        return y < 0 ? expr_div(g, 1, p) : p;
    }
    if (expr_is_number(g, b, &y) && y == 0.5)
        return expr_sqrt(g, a);
    return raw(g, OP_POW, a, b, 0);
}

expression expr_sqrt(struct graph *g, expression a) {
    return expr_apply1(g, OP_SQRT, a);
}

expression expr_where(struct graph *g, expression condition, expression then, expression otherwise) {
    double x;
    if (expr_is_number(g, condition, &x))
        return x != 0 ? then : otherwise;
    return then == otherwise ? then : raw(g, OP_WHERE, condition, then, otherwise);
}

/* Drops the sign of the operand of an even function, and moves it in front of an odd one. */
static bool fold_parity(struct graph *g, enum operation operation, expression a, expression *result) {
    if (!is_negated(g, a))
        return false;
    switch (operation) {
    case OP_SIN:
    case OP_TAN:
    case OP_ASIN:
    case OP_ATAN:
    case OP_SINH:
    case OP_TANH:
    case OP_HOLD:
        *result = expr_neg(g, expr_apply1(g, operation, inside(g, a)));
        return true;
    case OP_COS:
    case OP_COSH:
    case OP_ABS:
        *result = expr_apply1(g, operation, inside(g, a));
        return true;
    default:
        return false;
    }
}

/* Any other function: numbers are computed; min, max and < of equal operands are folded. */
static expression apply_function(struct graph *g, enum operation operation, expression a, expression b) {
    int arity = operation_arity(operation);
    double x = 0, y = 0;
    expression result;
    if (operation_is_gain(operation))
        return raw(g, operation, a, 0, 0);
    if (expr_is_number(g, a, &x) && (arity < 2 || expr_is_number(g, b, &y)))
        return expr_number(g, operation_value(operation, x, y, 0));
    if (a == b && (operation == OP_MIN || operation == OP_MAX))
        return a;
    if (a == b && operation == OP_LESS)
        return 0;
    if (fold_parity(g, operation, a, &result))
        return result;
    return raw(g, operation, a, arity > 1 ? b : 0, 0);
}

expression expr_apply(struct graph *g, enum operation operation, expression a, expression b, expression c) {
    switch (operation) {
    case OP_ADD:
        return expr_add(g, a, b);
    case OP_SUB:
        return expr_sub(g, a, b);
    case OP_MUL:
        return expr_mul(g, a, b);
    case OP_DIV:
        return expr_div(g, a, b);
    case OP_NEG:
        return expr_neg(g, a);
    case OP_POW:
        return expr_power(g, a, b);
    case OP_WHERE:
        return expr_where(g, a, b, c);
    default:
        return apply_function(g, operation, a, b);
    }
}

expression expr_apply1(struct graph *g, enum operation operation, expression a) {
    return expr_apply(g, operation, a, 0, 0);
}

expression expr_apply2(struct graph *g, enum operation operation, expression a, expression b) {
    return expr_apply(g, operation, a, b, 0);
}

static expression spline_node(struct graph *g, uint32_t code, expression at) {
    double x;
    if (expr_is_number(g, at, &x))
        return expr_number(g,
                           spline_value(&g->splines[code / SPLINE_ORDERS], x, (int)(code % SPLINE_ORDERS)));
    return graph_intern(
        g, (struct node){.operation = OP_SPLINE, .depends = g->nodes[at].depends, .operand = {at, code}});
}

expression expr_spline(struct graph *g, int table, expression at) {
    return spline_node(g, SPLINE_ORDERS * (uint32_t)table, at);
}

expression expr_spline_derivative(struct graph *g, expression e) {
    const struct node node = g->nodes[e];
    const uint32_t code = node.operand[1];
    return code % SPLINE_ORDERS == SPLINE_ORDERS - 1 ? EXPR_ZERO : spline_node(g, code + 1, node.operand[0]);
}

expression expr_rebuild(struct graph *g, expression e, const expression operands[3]) {
    const struct node node = g->nodes[e];
    if (node.operation == OP_SPLINE)
        return spline_node(g, node.operand[1], operands[0]);
    return expr_apply(g, node.operation, operands[0], operands[1], operands[2]);
}
