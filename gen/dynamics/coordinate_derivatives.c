/* Derivatives of expressions by the coordinates. */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

static expression place_symbol(void *context, struct graph *g, expression e) {
    const struct kinematics *k = context;
    const struct symbol s = *expr_as_symbol(g, e);
    if (s.kind == SYMBOL_COORDINATE && s.order == 2)
        return expr_zero(g);
    if (s.kind != SYMBOL_POINT)
        return e;
    const struct point_motion *point = &k->points[s.index / 3];
    const struct vector by_order[3] = {point->r, point->rd, point->d};
    return by_order[s.order].at[s.index % 3];
}

static expression rest_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *expr_as_symbol(g, e);
    if (s.order > 0 && (s.kind == SYMBOL_COORDINATE || s.kind == SYMBOL_POINT))
        return expr_zero(g);
    return place_symbol(context, g, e);
}

expression coordinate_derivatives_with_points(const struct kinematics *k, expression e) {
    rewrite_substitute(k->g, place_symbol, (void *)k, &e, &e, 1);
    return e;
}

expression coordinate_derivatives_at_rest(const struct kinematics *k, expression e) {
    rewrite_substitute(k->g, rest_symbol, (void *)k, &e, &e, 1);
    return e;
}

static expression rate_of_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *expr_as_symbol(g, e);
    (void)context;
    if (s.kind == SYMBOL_TIME)
        return expr_one(g);
    if (s.kind == SYMBOL_COORDINATE && s.order == 0)
        return expr_symbol(g, s.kind, s.index, 1);
    if (s.kind == SYMBOL_POINT && s.order < 2)
        return expr_symbol(g, s.kind, s.index, s.order + 1);
    return expr_zero(g);
}

expression coordinate_derivatives_rate(const struct kinematics *k, expression e) {
    return rewrite_derivative(k->g, e, rate_of_symbol, NULL);
}

expression *coordinate_derivatives_symbol_gradient(const struct kinematics *k, expression e, int order) {
    const int n = k->tree->count, count = n + 3 * k->model->marker_count;
    expression *by = memory_get(k->memory, ((size_t)count + 1) * sizeof *by);
    expression *result = memory_get(k->memory, ((size_t)count + 1) * sizeof *result);
    for (int i = 0; i < k->tree->count; i++)
        if (k->tree->frames[i].kind == FRAME_JOINT && k->tree->frames[i].run < 0)
            by[i] =
                kinematics_coordinate_of(k, i, order); /* 0, not a symbol, in a run, which no formula names */
    for (int i = n; i < count; i++)
        by[i] = expr_symbol(k->g, SYMBOL_POINT, i - n, order);
    rewrite_gradient(k->g, e, by, result, count);
    return result;
}

expression *coordinate_derivatives_placed_gradient(const struct kinematics *k, expression e, int order) {
    expression *c = coordinate_derivatives_symbol_gradient(k, e, order);
    rewrite_substitute(k->g, place_symbol, (void *)k, c, c, k->tree->count + 3 * k->model->marker_count);
    return c;
}

/* c_j += (de/dr) . C_j for all points: theory, sect. 6.2. */
expression *coordinate_derivatives_coefficients(const struct kinematics *k, expression e, int order,
                                                bool resting) {
    const int n = k->tree->count, markers = k->model->marker_count;
    expression *c =
        coordinate_derivatives_symbol_gradient(k, e, order); /* followed by three weights for each point */
    rewrite_substitute(k->g, resting ? rest_symbol : place_symbol, (void *)k, c, c, n + 3 * markers);
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);)
        for (int p = 0; p < markers; p++)
            c[j] = expr_add(k->g, c[j], vector_dot(k->g, vector_of(c + n + 3 * p), k->points[p].columns[j]));
    return c;
}
