/*
 * The expression graph alone: folding, sharing of equal expressions, substitution, and the derivatives of
 * each operator compared with differences of its values. An error in folding shows up here, and not as a
 * distant digit of an acceleration.
 */
#include "check.h"
#include "gen/graph/graph.h"
#include "expressions.h"

#include <string.h>

enum { VARIABLES = 8 };
static const double at[VARIABLES] = {0.43715629, 0.82613947, 0.29384751, 1.37261984,
                                     2.61803127, 0.17432906, 3.14871265, 0.58120437};

struct variables {
    struct expressions own;
    struct graph *g;
    expression x, y, z;
};

static void start(struct variables *v) {
    v->g = expressions_start(&v->own);
    v->x = variable(v->g, 0);
    v->y = variable(v->g, 1);
    v->z = variable(v->g, 2);
}

static void test_zeros_and_ones(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    const expression x = v.x, null = EXPR_ZERO, unit = EXPR_ONE;
    CHECK(expr_number(g, -0.0) == null && expr_number(g, 1.0) == unit);
    CHECK(expr_mul(g, x, null) == null && expr_mul(g, null, x) == null);
    CHECK(expr_sub(g, x, x) == null);
    CHECK(expr_add(g, x, null) == x && expr_add(g, null, x) == x && expr_sub(g, x, null) == x);
    CHECK(expr_sub(g, null, x) == expr_neg(g, x));
    CHECK(expr_mul(g, x, unit) == x && expr_mul(g, unit, x) == x && expr_div(g, x, unit) == x);
    CHECK(expr_mul(g, x, expr_number(g, -1)) == expr_neg(g, x) &&
          expr_div(g, x, expr_number(g, -1)) == expr_neg(g, x));
    CHECK(expr_div(g, x, x) == unit && expr_div(g, null, x) == null);
    CHECK(expr_div(g, x, null) != null);
    expressions_release(&v.own);
}

static void test_signs(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    const expression x = v.x, y = v.y, product = expr_mul(g, x, y), ratio = expr_div(g, x, y);
    CHECK(expr_neg(g, expr_neg(g, x)) == x && expr_neg(g, x) != x);
    CHECK(expr_mul(g, expr_neg(g, x), y) == expr_neg(g, product) &&
          expr_mul(g, x, expr_neg(g, y)) == expr_neg(g, product));
    CHECK(expr_mul(g, expr_neg(g, x), expr_neg(g, y)) == product);
    CHECK(expr_div(g, expr_neg(g, x), y) == expr_neg(g, ratio) &&
          expr_div(g, x, expr_neg(g, y)) == expr_neg(g, ratio));
    CHECK(expr_div(g, expr_neg(g, x), expr_neg(g, y)) == ratio);
    CHECK(expr_div(g, x, expr_neg(g, x)) == expr_number(g, -1));
    CHECK(expr_add(g, x, expr_neg(g, y)) == expr_sub(g, x, y) &&
          expr_add(g, expr_neg(g, x), y) == expr_sub(g, y, x));
    CHECK(expr_sub(g, x, expr_neg(g, y)) == expr_add(g, x, y) &&
          expr_sub(g, expr_neg(g, x), y) == expr_neg(g, expr_add(g, x, y)));
    CHECK(expr_neg(g, expr_sub(g, x, y)) == expr_sub(g, y, x) && expr_sub(g, x, y) != expr_sub(g, y, x));
    CHECK(expr_mul(g, x, expr_number(g, -2.71928)) == expr_neg(g, expr_mul(g, x, expr_number(g, 2.71928))));
    CHECK(expr_add(g, x, expr_number(g, -0.31416)) == expr_sub(g, x, expr_number(g, 0.31416)));
    expressions_release(&v.own);
}

static void test_parity(void) {
    static const enum operation odd[] = {OP_SIN, OP_TAN, OP_ASIN, OP_ATAN, OP_SINH, OP_TANH, OP_HOLD};
    static const enum operation even[] = {OP_COS, OP_COSH, OP_ABS};
    struct variables v;
    start(&v);
    const expression less = expr_neg(v.g, v.x);
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++)
        CHECK(expr_apply1(v.g, odd[i], less) == expr_neg(v.g, expr_apply1(v.g, odd[i], v.x)));
    for (size_t i = 0; i < sizeof even / sizeof *even; i++)
        CHECK(expr_apply1(v.g, even[i], less) == expr_apply1(v.g, even[i], v.x));
    for (int i = OP_SPLINE + 1; i < OP_COUNT; i++) { /* and no other function changes its sign */
        const double found = value_at(v.g, expr_apply(v.g, (enum operation)i, less, v.y, v.z), at);
        const double expected = operation_value((enum operation)i, -at[0], at[1], at[2]);
        CHECK(found == expected || (isnan(found) && isnan(expected)));
    }
    expressions_release(&v.own);
}

static void test_powers(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    CHECK(expr_power(g, v.x, EXPR_ZERO) == EXPR_ONE && expr_power(g, v.x, EXPR_ONE) == v.x);
    CHECK(expr_power(g, v.x, expr_number(g, 2)) == expr_mul(g, v.x, v.x));
    CHECK(expr_power(g, v.x, expr_number(g, 0.5)) == expr_sqrt(g, v.x));
    CHECK(expr_power(g, v.x, expr_number(g, -3)) ==
          expr_div(g, EXPR_ONE, expr_power(g, v.x, expr_number(g, 3))));
    for (int exponent = -17; exponent <= 17; exponent++) {
        const expression p = expr_power(g, v.x, expr_number(g, exponent));
        CHECK((g->nodes[p].operation == OP_POW) == (abs(exponent) > 16));
        CHECK_NEAR(value_at(g, p, at) / pow(at[0], exponent), 1, 1e-14);
    }
    expressions_release(&v.own);
}

static expression rate_of_variable(void *context, struct graph *g, expression e) {
    return expr_as_symbol(g, e)->index == *(const int *)context ? EXPR_ONE : EXPR_ZERO;
}

static expression derivative(struct graph *g, expression e, int by) {
    return rewrite_derivative(g, e, rate_of_variable, &by);
}

static void test_choices(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    CHECK(expr_where(g, expr_number(g, 0.2718), v.x, v.y) == v.x &&
          expr_where(g, EXPR_ZERO, v.x, v.y) == v.y);
    CHECK(expr_where(g, v.z, v.x, v.x) == v.x);
    CHECK(expr_apply2(g, OP_MIN, v.x, v.x) == v.x && expr_apply2(g, OP_MAX, v.x, v.x) == v.x);
    CHECK(expr_apply2(g, OP_LESS, v.x, v.x) == EXPR_ZERO);
    const expression smaller = expr_where(g, expr_apply2(g, OP_LESS, v.x, v.y), v.x, v.y);
    CHECK(value_at(g, smaller, at) == at[0]);
    const expression product = expr_mul(g, v.x, v.z), branches[] = {product, expr_mul(g, product, v.y)};
    const expression second = expr_where(g, expr_apply2(g, OP_LESS, v.y, v.x), branches[0], branches[1]);
    CHECK(value_at(g, second, at) == value_at(g, branches[1], at));
    CHECK(value_at(g, derivative(g, second, 2), at) == value_at(g, derivative(g, branches[1], 2), at));
    expressions_release(&v.own);
}

/* Numbers are computed with the operator's function; only gains stay, since they may be replaced. */
static void test_numbers(void) {
    struct variables v;
    start(&v);
    for (int i = OP_SPLINE + 1; i < OP_COUNT; i++) {
        const enum operation operation = (enum operation)i;
        const expression e = expr_apply(v.g, operation, expr_number(v.g, at[0]), expr_number(v.g, at[1]),
                                        expr_number(v.g, at[2]));
        const expression of = expr_apply(v.g, operation, v.x, v.y, v.z);
        const double expected = operation_value(operation, at[0], at[1], at[2]);
        double value = NAN;
        if (expr_is_number(v.g, e, &value) != !operation_is_gain(operation) ||
            (!operation_is_gain(operation) && value != expected))
            printf("%s of numbers:\n", operation_name(operation));
        CHECK(expr_is_number(v.g, e, NULL) == !operation_is_gain(operation));
        CHECK(operation_is_gain(operation) || value == expected);
        CHECK(value_at(v.g, of, at) == expected);
    }
    expressions_release(&v.own);
}

static expression sum_of_many(struct graph *g, int i) {
    const expression angle = expr_mul(g, expr_number(g, 0.001 * i + 0.2137), variable(g, i % VARIABLES));
    return expr_add(g, expr_apply1(g, OP_SIN, angle),
                    expr_mul(g, expr_apply1(g, OP_COS, angle), variable(g, (i + 3) % VARIABLES)));
}

/* Also after the table has grown, and for any order of summands and factors. */
static void test_equal_expressions_are_one(void) {
    enum { MANY = 3000 };
    struct variables v;
    start(&v);
    static expression made[MANY];
    for (int i = 0; i < MANY; i++)
        made[i] = sum_of_many(v.g, i);
    const uint32_t count = v.g->count;
    int again = 0;
    for (int i = 0; i < MANY; i++)
        again += made[i] == sum_of_many(v.g, i);
    CHECK(again == MANY && v.g->count == count);
    CHECK(expr_add(v.g, made[7], made[9]) == expr_add(v.g, made[9], made[7]));
    CHECK(expr_mul(v.g, made[7], made[9]) == expr_mul(v.g, made[9], made[7]));
    CHECK(expr_div(v.g, made[7], made[9]) != expr_div(v.g, made[9], made[7]));
    CHECK(!graph_violation(v.g));
    expressions_release(&v.own);
}

/* ---- Rewriting ---- */

static expression some_expression(struct graph *g, expression x, expression y, expression z) {
    const expression ratio =
        expr_div(g, expr_apply1(g, OP_SIN, expr_mul(g, x, y)), expr_add(g, y, expr_number(g, 1.61803)));
    return expr_sub(g, expr_mul(g, ratio, expr_apply1(g, OP_EXP, z)),
                    expr_power(g, expr_sub(g, x, z), expr_number(g, 3)));
}

static expression shift_first(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->index == 0 ? expr_add(g, variable(g, 1), expr_number(g, 0.37219)) : e;
}

static void test_substitution(void) {
    struct variables v;
    start(&v);
    const expression from = some_expression(v.g, v.x, v.y, v.z),
                     by = expr_add(v.g, v.y, expr_number(v.g, 0.37219));
    expression to;
    rewrite_substitute(v.g, shift_first, NULL, &from, &to, 1);
    CHECK(to == some_expression(v.g, by, v.y, v.z));
    const expression product = expr_mul(v.g, v.x, v.y);
    CHECK(rewrite_replace(v.g, expr_add(v.g, product, v.z), product, v.z) == expr_add(v.g, v.z, v.z));
    expressions_release(&v.own);
}

static double difference(struct graph *g, expression e, int by) {
    const double step = 2e-6;
    double before[VARIABLES], behind[VARIABLES];
    memcpy(before, at, sizeof before);
    memcpy(behind, at, sizeof behind);
    before[by] -= step;
    behind[by] += step;
    return (value_at(g, e, behind) - value_at(g, e, before)) / (2 * step);
}

/* By each operand; an operand that is held has no derivative. */
static void test_derivatives_of_operators(void) {
    struct variables v;
    start(&v);
    for (int i = OP_SPLINE + 1; i < OP_COUNT; i++) {
        const enum operation operation = (enum operation)i;
        const expression e = expr_apply(v.g, operation, v.x, v.y, v.z);
        for (int k = 0; k < operation_arity(operation); k++) {
            const double expected = operation == OP_HOLD ? 0 : difference(v.g, e, k);
            const double found = value_at(v.g, derivative(v.g, e, k), at);
            if (!(fabs(found - expected) <= 1e-8))
                printf("%s by operand %d:\n", operation_name(operation), k);
            CHECK_NEAR(found, expected, 1e-8);
        }
    }
    expressions_release(&v.own);
}

static void test_derivatives_of_splines(void) {
    static const double knots[] = {0.11, 0.29, 0.53, 0.71, 0.97}, values[] = {1.3, -0.4, 2.7, 0.6, 1.9};
    struct variables v;
    start(&v);
    expression e = expr_spline(v.g, graph_add_spline(v.g, knots, values, 5), v.x);
    for (int order = 1; order < SPLINE_ORDERS; order++) {
        const expression slope = derivative(v.g, e, 0);
        CHECK_NEAR(value_at(v.g, slope, at), difference(v.g, e, 0), 1e-4);
        e = slope;
    }
    CHECK(derivative(v.g, e, 0) == EXPR_ZERO);
    expressions_release(&v.own);
}

/* The backward sweep, the forward sweep and differences agree. */
static void test_gradient(void) {
    struct variables v;
    start(&v);
    const expression by[] = {v.x, v.y, v.z, variable(v.g, 5)};
    const expression e = some_expression(v.g, v.x, v.y, v.z);
    expression gradients[4];
    rewrite_gradient(v.g, e, by, gradients, 4);
    for (int i = 0; i < 3; i++) {
        CHECK_NEAR(value_at(v.g, gradients[i], at), difference(v.g, e, i), 1e-8);
        CHECK_NEAR(value_at(v.g, gradients[i], at), value_at(v.g, derivative(v.g, e, i), at), 1e-14);
    }
    CHECK(gradients[3] == EXPR_ZERO);
    expressions_release(&v.own);
}

/* A trial leaves nothing in the original graph. */
static void test_copy(void) {
    struct variables v;
    start(&v);
    const uint32_t count = v.g->count;
    struct graph trial = graph_copy(v.g);
    const expression e = some_expression(&trial, v.x, v.y, v.z);
    CHECK(v.g->count == count && !graph_violation(v.g) && !graph_violation(&trial));
    CHECK(some_expression(v.g, v.x, v.y, v.z) == e);
    CHECK(v.g->count == trial.count && !graph_violation(v.g));
    expressions_release(&v.own);
}

/* ---- Broken promises are reported ---- */

static bool tells(const struct graph *g, const char *promise) {
    const char *found = graph_violation(g);
    if (!found || !strstr(found, promise))
        printf("'%s' is not told, but: %s\n", promise, found ? found : "nothing");
    return found && strstr(found, promise);
}

static void test_broken_nodes(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    const expression sum = expr_add(g, v.x, v.y), product = expr_mul(g, sum, v.z);
    const struct node kept = g->nodes[product];
    graph_name_value(g, product, "area");
    CHECK(!graph_violation(g));
    g->nodes[product].operand[1] = product + 1;
    CHECK(tells(g, "operands have smaller handles"));
    g->nodes[product] = g->nodes[sum];
    CHECK(tells(g, "equal nodes have one handle"));
    g->nodes[product] = kept;
    g->nodes[product].depends = ON_TIME;
    CHECK(tells(g, "depends on what its operands"));
    g->nodes[product] = kept;
    g->nodes[product].loop = 1;
    CHECK(tells(g, "while it was open"));
    g->nodes[product] = kept;
    g->names[product] = "an area";
    CHECK(tells(g, "names are identifiers"));
    g->names[product] = NULL;
    g->symbols[0].order = 7;
    CHECK(tells(g, "symbols have a known kind"));
    expressions_release(&v.own);
}

static void test_broken_lists(void) {
    struct variables v;
    start(&v);
    struct graph *g = v.g;
    graph_open_loop(g, 0, false);
    const int slot = graph_new_slot(g, v.x);
    graph_set_next(g, slot, expr_add(g, g->slots[slot].carried, v.y));
    CHECK(tells(g, "no loop is open"));
    graph_close_loop(g);
    graph_remark(g, "first");
    graph_remark(g, "second");
    CHECK(!graph_violation(g));
    const struct slot kept = g->slots[slot];
    g->slots[slot].next = kept.final;
    CHECK(tells(g, "continues with a value of its loop"));
    g->slots[slot] = kept;
    g->slots[slot].initial = kept.carried;
    CHECK(tells(g, "begins with a value from before"));
    g->slots[slot] = kept;
    g->slots[slot].final = kept.carried;
    CHECK(tells(g, "a slot has a loop and its two symbols"));
    g->slots[slot] = kept;
    g->remarks[1].from = g->remarks[0].from - 1;
    CHECK(tells(g, "remarks ascend"));
    expressions_release(&v.own);
}

int main(void) {
    test_zeros_and_ones();
    test_signs();
    test_parity();
    test_powers();
    test_choices();
    test_numbers();
    test_equal_expressions_are_one();
    test_substitution();
    test_derivatives_of_operators();
    test_derivatives_of_splines();
    test_gradient();
    test_copy();
    test_broken_nodes();
    test_broken_lists();
    return check_summary();
}
