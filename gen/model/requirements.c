/*
 * Values of expressions in parameters, and rules for a model's numbers.
 *
 * Each rule is written once, as an expression in its numbers. The reader evaluates it with the values that
 * parameters have while the model is read. The emitted quantity `required` has it with the parameters as
 * symbols, for values that they receive later.
 */
#include "gen/model/model.h"
#include "gen/base/base.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- Values of expressions in parameters ---- */

static double parameter_value(void *context, const struct symbol *symbol) {
    const struct parameter *parameters = context;
    return symbol->kind == SYMBOL_PARAMETER ? parameters[symbol->index].value : 0;
}

double parameters_evaluate(struct graph *graph, const struct parameter *parameters, expression e) {
    struct parameter *context = (struct parameter *)(uintptr_t)parameters; /* only read */
    return rewrite_evaluate(graph, e, parameter_value, context);
}

/* ---- Truth values: 1 or 0 ---- */

static expression is_less(struct graph *g, expression a, expression b) {
    return expr_where(g, expr_apply2(g, OP_LESS, a, b), EXPR_ONE, EXPR_ZERO);
}

static expression is_not_less(struct graph *g, expression a, expression b) {
    return expr_where(g, expr_apply2(g, OP_LESS, a, b), EXPR_ZERO, EXPR_ONE);
}

/* A parameter is always finite. A value computed from parameters may not be. */
static expression is_finite(struct graph *g, expression value) {
    if (expr_as_symbol(g, value))
        return EXPR_ONE;
    return is_less(g, expr_apply1(g, OP_ABS, value), expr_number(g, DBL_MAX));
}

static expression is_in_range(struct graph *g, enum number_range range, expression value) {
    const expression zero = EXPR_ZERO;
    switch (range) {
    case RANGE_POSITIVE:
        return is_less(g, zero, value);
    case RANGE_NOT_NEGATIVE:
        return is_not_less(g, value, zero);
    case RANGE_POISSON:
        return expr_mul(g, is_less(g, expr_number(g, -1), value), is_not_less(g, expr_number(g, 0.5), value));
    case RANGE_SHARE:
        return expr_mul(g, is_not_less(g, value, zero), is_not_less(g, EXPR_ONE, value));
    default:
        return EXPR_ONE;
    }
}

/* ---- The rules ---- */

typedef expression rule(struct graph *g, const struct requirement *requirement, const expression *numbers);

static expression in_range(struct graph *g, const struct requirement *requirement,
                           const expression *numbers) {
    return expr_mul(g, is_finite(g, numbers[0]), is_in_range(g, requirement->range, numbers[0]));
}

static expression ascends(struct graph *g, const struct requirement *requirement, const expression *numbers) {
    (void)requirement;
    return is_less(g, numbers[0], numbers[1]);
}

/* With a margin for the rounding of a sum of lengths. */
static expression lies_within(struct graph *g, const struct requirement *requirement,
                              const expression *numbers) {
    (void)requirement;
    return is_not_less(g, expr_mul(g, numbers[1], expr_number(g, 1 + 1e-12)), numbers[0]);
}

static expression smallest(struct graph *g, const expression three[3]) {
    return expr_apply2(g, OP_MIN, three[0], expr_apply2(g, OP_MIN, three[1], three[2]));
}

static expression largest(struct graph *g, const expression three[3]) {
    return expr_apply2(g, OP_MAX, three[0], expr_apply2(g, OP_MAX, three[1], three[2]));
}

static expression half_sum(struct graph *g, const expression I[3]) {
    return expr_div(g, expr_add(g, expr_add(g, I[0], I[1]), I[2]), expr_number(g, 2));
}

/* An author may leave out the moment about an axis about which the link never turns. The others are not
 * compared then. */
static expression is_complete(struct graph *g, const expression I[3]) {
    return expr_apply2(g, OP_LESS, EXPR_ZERO, smallest(g, I));
}

static expression has_moments(struct graph *g, const struct requirement *requirement, const expression *I) {
    (void)requirement;
    const expression bound = expr_mul(g, half_sum(g, I), expr_number(g, 1 + 1e-9));
    return expr_where(g, is_complete(g, I), is_not_less(g, bound, largest(g, I)), EXPR_ONE);
}

/* a b - c^2 */
static expression minor(struct graph *g, expression a, expression b, expression c) {
    return expr_sub(g, expr_mul(g, a, b), expr_mul(g, c, c));
}

static expression is_not_below(struct graph *g, expression value, expression scale) {
    return is_not_less(g, value, expr_mul(g, expr_number(g, -1e-9), scale));
}

/* No principal minor of the symmetric tensor xx yy zz xy xz yz is negative, except for rounding. */
static expression is_positive_semidefinite(struct graph *g, const expression J[6]) {
    expression sizes[3];
    for (int i = 0; i < 3; i++)
        sizes[i] = expr_apply1(g, OP_ABS, J[i]);
    const expression scale = largest(g, sizes), square = expr_mul(g, scale, scale);
    const expression yz = minor(g, J[1], J[2], J[5]);
    const expression minors[3] = {minor(g, J[0], J[1], J[3]), minor(g, J[0], J[2], J[4]), yz};
    const expression xy_part = expr_sub(g, expr_mul(g, J[3], J[2]), expr_mul(g, J[5], J[4]));
    const expression xz_part = expr_sub(g, expr_mul(g, J[3], J[5]), expr_mul(g, J[1], J[4]));
    const expression others = expr_sub(g, expr_mul(g, J[4], xz_part), expr_mul(g, J[3], xy_part));
    const expression all = expr_add(g, expr_mul(g, J[0], yz), others);
    return expr_mul(
        g, expr_mul(g, is_not_below(g, smallest(g, J), scale), is_not_below(g, smallest(g, minors), square)),
        is_not_below(g, all, expr_mul(g, square, scale)));
}

/* A body has int x^2 dm = (yy + zz - xx) / 2 and so on: this tensor of second moments must be positive
 * semidefinite. Numbers: xy xz yz, then xx yy zz. */
static expression has_products(struct graph *g, const struct requirement *requirement,
                               const expression *numbers) {
    const expression *moments = numbers + 3, half = half_sum(g, moments);
    expression I[6], second[6];
    (void)requirement;
    for (int i = 0; i < 6; i++) {
        I[i] = i < 3 ? moments[i] : numbers[i - 3];
        second[i] = expr_sub(g, i < 3 ? half : EXPR_ZERO, I[i]);
    }
    return expr_where(g, is_complete(g, moments), is_positive_semidefinite(g, second),
                      is_positive_semidefinite(g, I));
}

static expression largest_component(struct graph *g, const expression v[3]) {
    expression sizes[3];
    for (int i = 0; i < 3; i++)
        sizes[i] = expr_apply1(g, OP_ABS, v[i]);
    return largest(g, sizes);
}

static expression has_length(struct graph *g, const struct requirement *requirement, const expression *v) {
    (void)requirement;
    return is_less(g, EXPR_ZERO, largest_component(g, v));
}

/* The square of the length must be a finite number above 0. Length 0 is not a direction; another rule says
 * so. */
static expression has_square(struct graph *g, const struct requirement *requirement,
                             const expression *numbers) {
    const expression length = numbers[0];
    (void)requirement;
    return expr_mul(g,
                    expr_where(g, expr_apply2(g, OP_LESS, EXPR_ZERO, length),
                               is_not_less(g, length, expr_number(g, 1e-100)), EXPR_ONE),
                    is_not_less(g, expr_number(g, 1e100), length));
}

/* ---- Requirements ---- */

static struct requirement of_numbers(rule *holds, const char *fact, const expression *numbers, int count) {
    struct requirement requirement = {.holds = holds, .fact = fact, .count = count};
    memcpy(requirement.values, numbers, (size_t)count * sizeof *numbers);
    return requirement;
}

struct requirement requirement_field(enum number_range range, expression value) {
    static const char *const facts[] = {[RANGE_ANY] = "value %.6g; must be a number",
                                        [RANGE_POSITIVE] = "value %.6g; must be positive",
                                        [RANGE_NOT_NEGATIVE] = "value %.6g; must not be negative",
                                        [RANGE_POISSON] = "value %.6g; must be above -1 and at most 0.5",
                                        [RANGE_SHARE] = "value %.6g; must be from 0 to 1"};
    struct requirement requirement = of_numbers(in_range, facts[range], &value, 1);
    requirement.range = range;
    return requirement;
}

struct requirement requirement_argument(struct memory *memory, enum number_range range, int argument,
                                        expression value) {
    struct requirement requirement = requirement_field(range, value);
    requirement.fact = memory_format(memory, "argument %d: %s", argument, requirement.fact);
    return requirement;
}

struct requirement requirement_order(expression below, expression above) {
    return of_numbers(ascends, "from %.6g to %.6g; the range must ascend", (expression[]){below, above}, 2);
}

struct requirement requirement_hole(expression inner, expression outer) {
    return of_numbers(ascends, "inner diameter %.6g; must be less than the outer diameter, %.6g",
                      (expression[]){inner, outer}, 2);
}

struct requirement requirement_along(expression along, expression length) {
    return of_numbers(lies_within, "value %.6g; must be at most the length of the beam, %.6g",
                      (expression[]){along, length}, 2);
}

struct requirement requirement_moments(const expression inertia[6]) {
    return of_numbers(has_moments,
                      "moments of inertia %.6g %.6g %.6g; each must be at most the sum of the other two",
                      inertia, 3);
}

struct requirement requirement_products(const expression I[6]) {
    const expression numbers[6] = {I[3], I[4], I[5], I[0], I[1], I[2]};
    return of_numbers(has_products,
                      "products of inertia %.6g %.6g %.6g; too large for the moments of any body", numbers,
                      6);
}

struct requirement requirement_direction(const expression components[3]) {
    return of_numbers(has_length, "length 0; must be a direction", components, 3);
}

/* Length of a vector whose components may have squares that overflow or underflow. */
static expression length_of(struct graph *g, const expression v[3]) {
    const expression size = expr_apply2(g, OP_MAX, largest_component(g, v), expr_number(g, DBL_MIN));
    expression sum = EXPR_ZERO;
    for (int i = 0; i < 3; i++) {
        const expression part = expr_div(g, v[i], size);
        sum = expr_add(g, sum, expr_mul(g, part, part));
    }
    return expr_mul(g, size, expr_sqrt(g, sum));
}

struct requirement requirement_length(struct graph *g, const expression components[3]) {
    return of_numbers(has_square, "length %.6g; must be from 1e-100 to 1e+100",
                      (expression[]){length_of(g, components)}, 1);
}

/* ---- Requirements that are not met ---- */

/* Evaluates the rule for these numbers in a graph that it releases at once, since a model may have thousands
 * of requirements. */
static bool has_broken(const struct memory *memory, const struct requirement *requirement,
                       const double *numbers) {
    struct memory own = {.allowance = -1, .fail = memory->fail, .context = memory->context};
    struct graph scratch;
    expression constants[6];
    double value = 0;
    graph_start(&scratch, &own);
    for (int i = 0; i < requirement->count; i++)
        constants[i] = expr_number(&scratch, numbers[i]);
    expr_is_number(&scratch, requirement->holds(&scratch, requirement, constants), &value);
    memory_release(&own);
    return value == 0;
}

/* The fact with these numbers in it. If one of them is not finite, the message says only that. */
static const char *fact_of(struct memory *memory, const struct requirement *requirement,
                           const double *numbers) {
    const double *x = numbers;
    for (int i = 0; i < requirement->count; i++)
        if (!isfinite(x[i]))
            return memory_format(memory, "%.*s%s; must be finite",
                                 strchr(requirement->fact, '%') ? (int)strcspn(requirement->fact, "%") : 0,
                                 requirement->fact, text_not_finite(x[i]));
    return memory_format(memory, requirement->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
}

const char *requirement_fault(struct memory *memory, enum number_range range, double value) {
    const struct requirement requirement = requirement_field(range, 0);
    const double numbers[6] = {value};
    return has_broken(memory, &requirement, numbers) ? fact_of(memory, &requirement, numbers) : NULL;
}

const char *requirement_broken(struct memory *memory, struct graph *graph, const struct parameter *parameters,
                               const struct requirement *requirement) {
    double numbers[6] = {0};
    for (int i = 0; i < requirement->count; i++)
        numbers[i] = parameters_evaluate(graph, parameters, requirement->values[i]);
    if (!has_broken(memory, requirement, numbers))
        return NULL;
    return memory_format(memory, "%s: %s", requirement->path, fact_of(memory, requirement, numbers));
}
