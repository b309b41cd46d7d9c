/*
 * Derivatives of expressions in symbols by the coordinates, for rows, forces and tangents; and the rows of
 * programme constraints (theory, sect. 6.1 to 6.3).
 *
 * Input: expressions and the model's rows (residuals) of time, coordinates, rates and points. Output: the n
 * derivatives by the coordinates' values, rates or accelerations; u, v, phi, psi, k. A point's symbol of
 * order o depends on the coordinates' symbols of order o through the columns of C, at every order. One rule
 * applies to all levels: d/dt of a symbol of order o is the symbol of order o + 1, at qdd = 0; the
 * coefficients u are derivatives by the coordinates.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

/* ---- Derivatives by the coordinates ---- */

static expression place_symbol(void *context, struct graph *g, expression e) {
    const struct kinematics *k = context;
    const struct symbol s = *expr_as_symbol(g, e);
    if (s.kind == SYMBOL_COORDINATE && s.order == 2)
        return EXPR_ZERO;
    if (s.kind != SYMBOL_POINT)
        return e;
    const struct point_motion *point = &k->points[s.index / 3];
    const struct vector by_order[3] = {point->r, point->rd, point->d};
    return by_order[s.order].at[s.index % 3];
}

bool coordinate_derivatives_rests(const struct kinematics *k, const struct symbol *symbol) {
    const struct tree *tree = k->tree;
    if (symbol->order == 0 || (symbol->kind != SYMBOL_COORDINATE && symbol->kind != SYMBOL_POINT))
        return false;
    return symbol->order == 2 || symbol->kind == SYMBOL_POINT ||
           !tree->frames[tree->frame_of[symbol->index]].is_state;
}

static expression rest_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *expr_as_symbol(g, e);
    if (coordinate_derivatives_rests(context, &s))
        return EXPR_ZERO;
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
        return EXPR_ONE;
    if (s.kind == SYMBOL_COORDINATE && s.order == 0)
        return expr_symbol(g, s.kind, s.index, 1);
    if (s.kind == SYMBOL_POINT && s.order < 2)
        return expr_symbol(g, s.kind, s.index, s.order + 1);
    return EXPR_ZERO;
}

expression coordinate_derivatives_rate(const struct kinematics *k, expression e) {
    return rewrite_derivative(k->g, e, rate_of_symbol, NULL);
}

expression *coordinate_derivatives_symbol_gradient(const struct kinematics *k, expression e, int order,
                                                   bool resting) {
    const int n = k->tree->count, count = n + 3 * k->model->marker_count;
    expression *by = memory_get(k->memory, ((size_t)count + 1) * sizeof *by);
    expression *result = memory_get(k->memory, ((size_t)count + 1) * sizeof *result);
    for (int i = 0; i < k->tree->count; i++)
        if (k->tree->frames[i].kind == FRAME_JOINT && k->tree->frames[i].run < 0)
            by[i] =
                kinematics_coordinate_of(k, i,
                                         resting && order == 0 && k->tree->frames[i].is_state
                                             ? 1
                                             : order); /* 0, not a symbol, in a run, which no formula names */
    for (int i = n; i < count; i++)
        by[i] = expr_symbol(k->g, SYMBOL_POINT, i - n, order);
    rewrite_gradient(k->g, e, by, result, count);
    return result;
}

static expression *coordinate_derivatives_placed_gradient(const struct kinematics *k, expression e,
                                                          int order) {
    expression *c = coordinate_derivatives_symbol_gradient(k, e, order, false);
    rewrite_substitute(k->g, place_symbol, (void *)k, c, c, k->tree->count + 3 * k->model->marker_count);
    return c;
}

/* c_j += (de/dr) . C_j for all points: theory, sect. 6.2. */
expression *coordinate_derivatives_coefficients(const struct kinematics *k, expression e, int order,
                                                bool resting) {
    const int n = k->tree->count, markers = k->model->marker_count;
    expression *c = coordinate_derivatives_symbol_gradient(
        k, e, order, resting); /* followed by three weights for each point */
    rewrite_substitute(k->g, resting ? rest_symbol : place_symbol, (void *)k, c, c, n + 3 * markers);
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);)
        for (int p = 0; p < markers; p++)
            c[j] = expr_add(k->g, c[j], vector_dot(k->g, vector_of(c + n + 3 * p), k->points[p].columns[j]));
    return c;
}

expression constraints_rate_gain(struct graph *g, const struct row *row) {
    return expr_apply1(g, OP_RATE_GAIN, expr_mul(g, expr_number(g, 2), row->alpha));
}

expression constraints_position_gain(struct graph *g, const struct row *row) {
    return expr_apply1(g, OP_POSITION_GAIN, expr_mul(g, row->beta, row->beta));
}

/* k = -v - 2 alpha psi - beta^2 phi (theory, sect. 6.3). phi is 0 in a velocity row; in an acceleration
 * row psi is 0, too. */
static void stabilise(const struct kinematics *k, int index, struct row_terms *terms) {
    struct graph *g = k->g;
    const struct row *row = &k->model->rows[index];
    const expression rate = constraints_rate_gain(g, row), position = constraints_position_gain(g, row);
    const char *name = memory_format(k->memory, "row_%d", index + 1);
    graph_name_shared(g, rate, name, "rate_gain");
    graph_name_shared(g, position, name, "position_gain");
    const expression damping = expr_mul(g, rate, terms->psi), stiffness = expr_mul(g, position, terms->phi);
    terms->k = expr_neg(g, expr_add(g, expr_add(g, terms->v, damping), stiffness));
}

static void name_row(const struct kinematics *k, int index, const struct row_terms *terms) {
    const char *const names[] = {"v", "phi", "psi", "k"};
    const expression values[] = {terms->v, terms->phi, terms->psi, terms->k};
    for (int i = 0; i < 4; i++)
        graph_name_value(k->g, values[i], memory_format(k->memory, "row_%d_%s", index + 1, names[i]));
}

/* A coefficient that equals an entry of a point's C is named after the point, because other rows may have
 * it, too. */
static const char *coefficient_name(const struct kinematics *k, int index, int j, expression e) {
    static const char axes[3] = "xyz";
    const char *frame = k->tree->frames[j].name;
    for (int p = 0; p < k->model->marker_count; p++)
        for (int a = 0; a < 3; a++)
            if (k->points[p].columns[j].at[a] == e)
                return memory_format(k->memory, "point_%s_C_%c_%s", k->model->points[p].name, axes[a], frame);
    return memory_format(k->memory, "row_%d_u_%s", index + 1, frame);
}

/* Position: psi = d(phi)/dt, v = d(psi)/dt at qdd = 0. Velocity: v = d(psi)/dt. Acceleration: v is the
 * residual at qdd = 0. u is the derivative by the symbols of the row's own order. Theory, sect. 6.1. */
static struct row_terms derive_row(const struct kinematics *k, int index) {
    static const char *const formulas[] = {
        "row %d, of positions: psi' = u qdd + v, k = -v - 2 alpha psi - beta^2 phi (6.1, 6.3)",
        "row %d, of velocities: psi' = u qdd + v, k = -v - 2 alpha psi (6.1, 6.3)",
        "row %d, of accelerations: u qdd + v = 0, k = -v (6.1)"};
    _Static_assert(sizeof formulas / sizeof *formulas == ROW_ACCELERATION + 1, "each level has a formula");
    const struct row *row = &k->model->rows[index];
    struct row_terms terms = {0};
    graph_remark(k->g, memory_format(k->memory, formulas[row->level], index + 1));
    if (row->level == ROW_POSITION) {
        const expression rate = coordinate_derivatives_rate(k, row->residual);
        terms.phi = coordinate_derivatives_with_points(k, row->residual);
        terms.psi = coordinate_derivatives_with_points(k, rate);
        terms.v = coordinate_derivatives_with_points(k, coordinate_derivatives_rate(k, rate));
    } else if (row->level == ROW_VELOCITY) {
        terms.psi = coordinate_derivatives_with_points(k, row->residual);
        terms.v = coordinate_derivatives_with_points(k, coordinate_derivatives_rate(k, row->residual));
    } else {
        terms.v = coordinate_derivatives_with_points(k, row->residual);
    }
    terms.u = coordinate_derivatives_coefficients(k, row->residual, (int)row->level, false);
    terms.pull = coordinate_derivatives_placed_gradient(k, row->residual, (int)row->level);
    terms.pulls = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *terms.pulls);
    for (int p = 0; p < k->model->marker_count; p++)
        terms.pulls[p] = vector_of(terms.pull + k->tree->count + 3 * p);
    stabilise(k, index, &terms);
    name_row(k, index, &terms);
    for (int j = 0; j < k->tree->count; j++)
        graph_name_value(k->g, terms.u[j], coefficient_name(k, index, j, terms.u[j]));
    return terms;
}

struct row_terms *constraints_derive(const struct kinematics *k) {
    const int m = k->model->row_count;
    struct row_terms *rows = memory_get(k->memory, ((size_t)m + 1) * sizeof *rows);
    for (int i = 0; i < m; i++)
        rows[i] = derive_row(k, i);
    return rows;
}
