/* Programme constraints: see constraints.h. */
#include "dynamics/constraints.h"
#include "base/memory.h"
#include "dynamics/coordinate_derivatives.h"

/* d/dt of a symbol at qdd = 0. */
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

static expression time_derivative(const struct kinematics *k, expression e) {
    return rewrite_derivative(k->g, e, rate_of_symbol, NULL);
}

expression constraints_rate_gain(struct graph *g, const struct row *row) {
    return expr_apply1(g, OP_RATE_GAIN, expr_mul(g, expr_number(g, 2), row->alpha));
}

expression constraints_position_gain(struct graph *g, const struct row *row) {
    return expr_apply1(g, OP_POSITION_GAIN, expr_mul(g, row->beta, row->beta));
}

/* k = -v - 2 alpha psi - beta^2 phi; velocity rows have no phi, acceleration rows neither. */
static void stabilise(const struct kinematics *k, int index, struct row_terms *terms) {
    struct graph *g = k->g;
    const struct row *row = &k->model->rows[index];
    const expression rate = constraints_rate_gain(g, row), position = constraints_position_gain(g, row);
    graph_name_value(g, rate, memory_format(k->memory, "row_%d_rate_gain", index + 1));
    graph_name_value(g, position, memory_format(k->memory, "row_%d_position_gain", index + 1));
    const expression damping = expr_mul(g, rate, terms->psi), stiffness = expr_mul(g, position, terms->phi);
    terms->k = expr_neg(g, expr_add(g, expr_add(g, terms->v, damping), stiffness));
}

static void name_row(const struct kinematics *k, int index, const struct row_terms *terms) {
    const char *const names[] = {"v", "phi", "psi", "k"};
    const expression values[] = {terms->v, terms->phi, terms->psi, terms->k};
    for (int i = 0; i < 4; i++)
        graph_name_value(k->g, values[i], memory_format(k->memory, "row_%d_%s", index + 1, names[i]));
}

static struct row_terms derive_row(const struct kinematics *k, int index) {
    static const char *const levels[] = {"position", "velocity", "acceleration"};
    _Static_assert(sizeof levels / sizeof *levels == ROW_ACCELERATION + 1, "each level has a name");
    const struct row *row = &k->model->rows[index];
    struct row_terms terms = {0};
    graph_remark(k->g,
                 memory_format(k->memory, "row %d (%s level): u qdd + v = 0", index + 1, levels[row->level]));
    if (row->level == ROW_POSITION) {
        const expression rate = time_derivative(k, row->residual);
        terms.phi = coordinate_derivatives_with_points(k, row->residual);
        terms.psi = coordinate_derivatives_with_points(k, rate);
        terms.v = coordinate_derivatives_with_points(k, time_derivative(k, rate));
    } else if (row->level == ROW_VELOCITY) {
        terms.psi = coordinate_derivatives_with_points(k, row->residual);
        terms.v = coordinate_derivatives_with_points(k, time_derivative(k, row->residual));
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
        graph_name_value(k->g, terms.u[j],
                         memory_format(k->memory, "row_%d_u_%s", index + 1, k->tree->frames[j].name));
    return terms;
}

struct row_terms *constraints_derive(const struct kinematics *k) {
    const int m = k->model->row_count;
    struct row_terms *rows = memory_get(k->memory, ((size_t)m + 1) * sizeof *rows);
    for (int i = 0; i < m; i++)
        rows[i] = derive_row(k, i);
    return rows;
}
