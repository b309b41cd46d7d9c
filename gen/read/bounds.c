/*
 * Bounds of values: see reader.h. Each follows from those of its operands (interval arithmetic: Moore,
 * Kearfott and Cloud, Introduction to Interval Analysis, 2009).
 */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <math.h>

static const struct bounds unbounded = {-INFINITY, INFINITY};

static struct bounds between(double least, double most) {
    return isnan(least) || isnan(most) ? unbounded : (struct bounds){least, most};
}

/* Here 0 times infinity is 0, since an infinite bound is not a value. */
static double times(double a, double b) {
    return a == 0 || b == 0 ? 0 : a * b;
}

static struct bounds product(struct bounds a, struct bounds b) {
    const double p = times(a.least, b.least), q = times(a.least, b.most), r = times(a.most, b.least),
                 s = times(a.most, b.most);
    return between(fmin(fmin(p, q), fmin(r, s)), fmax(fmax(p, q), fmax(r, s)));
}

static struct bounds size(struct bounds a) {
    const double least = fabs(a.least), most = fabs(a.most);
    return between(a.least <= 0 && a.most >= 0 ? 0 : fmin(least, most), fmax(least, most));
}

static struct bounds quotient(struct bounds a, struct bounds b) {
    if (b.least <= 0 && b.most >= 0)
        return a.least >= 0 && b.least >= 0 ? between(0, INFINITY) : unbounded;
    return product(a, between(1 / b.most, 1 / b.least));
}

static struct bounds hull(struct bounds a, struct bounds b) {
    return between(fmin(a.least, b.least), fmax(a.most, b.most));
}

/* Bounds of a function that rises with its operand. */
static struct bounds rising(double function(double), struct bounds a) {
    return between(function(a.least), function(a.most));
}

static struct bounds bounds_of_power(const struct graph *g, const struct node *node,
                                     const struct bounds *bounds) {
    double exponent;
    const bool is_even =
        expr_is_number(g, node->operand[1], &exponent) && fmod(exponent, 2) == 0 && exponent > 0;
    const struct bounds a = size(bounds[node->operand[0]]);
    if (is_even)
        return between(pow(a.least, exponent), pow(a.most, exponent));
    return bounds[node->operand[0]].least >= 0 ? between(0, INFINITY) : unbounded;
}

static struct bounds bounds_of_node(const struct graph *g, expression e, const struct bounds *bounds) {
    const struct node *node = &g->nodes[e];
    if (node->operation == OP_SPLINE)
        return unbounded;
    const struct bounds a = bounds[node->operand[0]], b = bounds[node->operand[1]];
    switch ((enum operation)node->operation) {
    case OP_ADD:
        return between(a.least + b.least, a.most + b.most);
    case OP_SUB:
        return between(a.least - b.most, a.most - b.least);
    case OP_NEG:
        return between(-a.most, -a.least);
    case OP_MUL:
        return node->operand[0] == node->operand[1] ? product(size(a), size(a)) : product(a, b);
    case OP_DIV:
        return quotient(a, b);
    case OP_HOLD:
        return a;
    case OP_SIN:
    case OP_COS:
        return between(-1, 1);
    case OP_TANH:
        return rising(tanh, a);
    case OP_ATAN:
        return rising(atan, a);
    case OP_EXP:
        return rising(exp, a);
    case OP_COSH:
        return rising(cosh, size(a));
    case OP_SQRT:
        return between(sqrt(fmax(a.least, 0)), sqrt(fmax(a.most, 0)));
    case OP_ABS:
        return size(a);
    case OP_MIN:
        return between(fmin(a.least, b.least), fmin(a.most, b.most));
    case OP_MAX:
        return between(fmax(a.least, b.least), fmax(a.most, b.most));
    case OP_LESS:
        return between(0, 1);
    case OP_WHERE:
        return hull(b, bounds[node->operand[2]]);
    case OP_POW:
        return bounds_of_power(g, node, bounds);
    default:
        return unbounded;
    }
}

/* A number, or a parameter that has a value before the motion starts? */
static bool is_known(const struct graph *g, const struct parameter *parameters, expression e, double *value) {
    const struct symbol *symbol = expr_as_symbol(g, e);
    if (!symbol || symbol->kind != SYMBOL_PARAMETER)
        return expr_is_number(g, e, value);
    const struct parameter *parameter = &parameters[symbol->index];
    *value = parameter->value;
    return parameter->is_given || !parameter->is_anchored;
}

struct bounds *bounds_of_values(const struct graph *g, const struct parameter *parameters) {
    struct bounds *bounds = memory_scratch(g->memory, g->count * sizeof *bounds);
    for (expression e = 0; e < g->count; e++) {
        double value;
        if (is_known(g, parameters, e, &value))
            bounds[e] = between(value, value);
        else
            bounds[e] = expr_as_symbol(g, e) ? unbounded : bounds_of_node(g, e, bounds);
    }
    return bounds;
}
