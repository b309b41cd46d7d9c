/* Derivatives by the coordinates: see sensitivity.h. */
#include "sensitivity.h"
#include "memory.h"
#include "recursion.h"

static expression place_symbol(void *context, struct graph *g, expression e) {
    const struct kinematics *k = context;
    const struct symbol s = *as_symbol(g, e);
    if (s.kind == SYMBOL_COORDINATE && s.order == 2)
        return zero(g);
    if (s.kind != SYMBOL_POINT)
        return e;
    const struct point_motion *point = &k->points[s.index / 3];
    const struct vector by_order[3] = {point->r, point->rd, point->d};
    return by_order[s.order].at[s.index % 3];
}

static expression rest_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *as_symbol(g, e);
    if (s.order > 0 && (s.kind == SYMBOL_COORDINATE || s.kind == SYMBOL_POINT))
        return zero(g);
    return place_symbol(context, g, e);
}

expression with_points(const struct kinematics *k, expression e) {
    substitute(k->g, place_symbol, (void *)k, &e, &e, 1);
    return e;
}

expression at_rest(const struct kinematics *k, expression e) {
    substitute(k->g, rest_symbol, (void *)k, &e, &e, 1);
    return e;
}

expression *symbol_gradient(const struct kinematics *k, expression e, int order) {
    const int n = k->tree->count, count = n + 3 * k->model->marker_count;
    expression *by = memory_get(k->memory, ((size_t)count + 1) * sizeof *by);
    expression *result = memory_get(k->memory, ((size_t)count + 1) * sizeof *result);
    for (int i = 0; i < k->tree->count; i++)
        if (k->tree->frames[i].kind == FRAME_JOINT && k->tree->frames[i].run < 0)
            by[i] = coordinate_of(k, i, order); /* in a run no formula names any, and 0 has no gradient */
    for (int i = n; i < count; i++)
        by[i] = symbol(k->g, SYMBOL_POINT, i - n, order);
    gradient(k->g, e, by, result, count);
    return result;
}

expression *placed_gradient(const struct kinematics *k, expression e, int order) {
    expression *c = symbol_gradient(k, e, order);
    substitute(k->g, place_symbol, (void *)k, c, c, k->tree->count + 3 * k->model->marker_count);
    return c;
}

/* Adds what a frame's coordinate moves by the points. */
struct coefficients {
    const struct kinematics *k;
    expression *c; /* by frame, then three weights a point */
};

static void add_columns(void *context, int j) {
    const struct coefficients *x = context;
    const struct kinematics *k = x->k;
    for (int p = 0; p < k->model->marker_count; p++) {
        const struct vector weight = vector_of(x->c + k->tree->count + 3 * p);
        x->c[j] = add(k->g, x->c[j], vector_dot(k->g, weight, k->points[p].columns[j]));
    }
}

expression *coefficients_of(const struct kinematics *k, expression e, int order, bool resting) {
    const int count = k->tree->count + 3 * k->model->marker_count;
    const struct coefficients x = {k, symbol_gradient(k, e, order)};
    substitute(k->g, resting ? rest_symbol : place_symbol, (void *)k, x.c, x.c, count);
    visit_joints(k->g, k->tree, add_columns, (void *)&x);
    return x.c;
}
