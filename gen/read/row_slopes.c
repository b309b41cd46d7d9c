/*
 * Rows that have no slope where they are zero: squares, absolute values and their sums. Such a row holds nothing,
 * since its force acts along its gradient. See reader.h.
 *
 * Bounds of each value follow from those of its operands (interval arithmetic: Moore, Kearfott and Cloud,
 * Introduction to Interval Analysis, 2009). Coordinates, points, inputs and time are unbounded; parameters have
 * their values. Bounds are never too narrow, so that what is refused is certain.
 */
#include "read/reader.h"

#include <math.h>

struct bounds {
    double least, most;
};

static const struct bounds unbounded = {-INFINITY, INFINITY};

static struct bounds between(double least, double most) {
    return isnan(least) || isnan(most) ? unbounded : (struct bounds){least, most};
}

/* 0 times infinity is 0: the bound is not a value. */
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

/* Of a function that rises with its operand. */
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

static struct bounds bounds_of_node(const struct reader *reader, expression e, const struct bounds *bounds) {
    const struct graph *g = reader->check.graph;
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

/* Of all values so far, in scratch. */
static struct bounds *bounds_of_values(const struct reader *reader) {
    struct graph *g = reader->check.graph;
    struct bounds *bounds = memory_scratch(reader->check.memory, g->count * sizeof *bounds);
    for (expression e = 0; e < g->count; e++) {
        double value;
        const struct symbol *symbol = expr_as_symbol(g, e);
        if (expr_is_number(g, e, &value) ||
            (symbol && symbol->kind == SYMBOL_PARAMETER &&
             parameters_are_known(reader->check.declarations, e, &value)))
            bounds[e] = between(value, value);
        else
            bounds[e] = symbol ? unbounded : bounds_of_node(reader, e, bounds);
    }
    return bounds;
}

/* What is multiplied with itself in e, e itself where nothing is; `power` counts how often. */
static expression base_of_power(const struct graph *g, expression e, int *power) {
    const struct node *node = &g->nodes[e];
    const bool is_product = node->operation == OP_MUL;
    *power = 1;
    if (node->operation == OP_NEG || (is_product && expr_is_number(g, node->operand[1], NULL)))
        return base_of_power(g, node->operand[0], power);
    if (is_product && expr_is_number(g, node->operand[0], NULL))
        return base_of_power(g, node->operand[1], power);
    if (!is_product)
        return e;
    int powers[2];
    const expression left = base_of_power(g, node->operand[0], &powers[0]),
                     right = base_of_power(g, node->operand[1], &powers[1]);
    if (left != right)
        return e;
    *power = powers[0] + powers[1];
    return left;
}

static void check_slope(const struct reader *reader, const struct row *row, struct bounds bounds) {
    const struct graph *g = reader->check.graph;
    struct messages *messages = reader->check.messages;
    int power;
    base_of_power(g, row->residual, &power);
    const bool hangs_on_values = (g->nodes[row->residual].depends & ON_PARAMETER) && power == 1;
    void (*const tell)(struct messages *, struct place, const char *, ...) =
        hangs_on_values ? message_warning : message_error;
    if (bounds.least > 0 || bounds.most < 0)
        message_warning(messages, row->place, "%s: its residual is %s %.6g, nowhere 0; subtract what it is to be",
                        row->path, bounds.least > 0 ? "at least" : "at most",
                        bounds.least > 0 ? bounds.least : bounds.most);
    else if (power > 1)
        tell(messages, row->place,
             "%s: its residual is a power and has no slope where it is 0; write its base alone", row->path);
    else if ((bounds.least == 0) != (bounds.most == 0))
        tell(messages, row->place,
             "%s: its residual is nowhere %s 0 and has no slope where it is 0; write what is to be 0 without "
             "squares, abs or less, a row for each term",
             row->path, bounds.least == 0 ? "below" : "above");
}

void read_check_slopes(const struct reader *reader) {
    const struct model *model = reader->model;
    const struct memory_mark mark = memory_mark(reader->check.memory);
    const struct bounds *bounds = bounds_of_values(reader);
    for (int i = 0; i < model->row_count; i++)
        if (!model->rows[i].is_closure && model->rows[i].level != ROW_ACCELERATION &&
            reader->check.graph->nodes[model->rows[i].residual].depends & (ON_STATE | ON_RATE))
            check_slope(reader, &model->rows[i], bounds[model->rows[i].residual]);
    memory_back(reader->check.memory, mark);
}
