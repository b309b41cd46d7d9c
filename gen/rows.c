/* Programme constraints: see rows.h. */
#include "rows.h"
#include "memory.h"
#include "sensitivity.h"

/* d/dt of a symbol at qdd = 0. */
static expression rate_of_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *as_symbol(g, e);
    (void)context;
    if (s.kind == SYMBOL_TIME)
        return one(g);
    if (s.kind == SYMBOL_COORDINATE && s.order == 0)
        return symbol(g, s.kind, s.index, 1);
    if (s.kind == SYMBOL_POINT && s.order < 2)
        return symbol(g, s.kind, s.index, s.order + 1);
    return zero(g);
}

static expression time_derivative(const struct kinematics *k, expression e) {
    return differentiate(k->g, e, rate_of_symbol, NULL);
}

expression rate_gain(struct graph *g, const struct row *row) {
    return apply1(g, OP_RATE_GAIN, mul(g, number(g, 2), row->alpha));
}

expression position_gain(struct graph *g, const struct row *row) {
    return apply1(g, OP_POSITION_GAIN, mul(g, row->beta, row->beta));
}

/* k = -v - 2 alpha psi - beta^2 phi; velocity rows have no phi, acceleration rows neither. */
static void stabilise(const struct kinematics *k, int index, struct row_terms *terms) {
    struct graph *g = k->g;
    const struct row *row = &k->model->rows[index];
    const expression rate = rate_gain(g, row), position = position_gain(g, row);
    name_value(g, rate, memory_format(k->memory, "row_%d_rate_gain", index + 1));
    name_value(g, position, memory_format(k->memory, "row_%d_position_gain", index + 1));
    const expression damping = mul(g, rate, terms->psi), stiffness = mul(g, position, terms->phi);
    terms->k = neg(g, add(g, add(g, terms->v, damping), stiffness));
}

static void name_row(const struct kinematics *k, int index, const struct row_terms *terms) {
    const char *const names[] = {"v", "phi", "psi", "k"};
    const expression values[] = {terms->v, terms->phi, terms->psi, terms->k};
    for (int i = 0; i < 4; i++)
        name_value(k->g, values[i], memory_format(k->memory, "row_%d_%s", index + 1, names[i]));
}

static struct row_terms derive_row(const struct kinematics *k, int index) {
    static const char *const levels[] = {"position", "velocity", "acceleration"};
    const struct row *row = &k->model->rows[index];
    struct row_terms terms = {0};
    remark(k->g, memory_format(k->memory, "row %d (%s level): u qdd + v = 0", index + 1, levels[row->level]));
    if (row->level == ROW_POSITION) {
        const expression rate = time_derivative(k, row->residual);
        terms.phi = with_points(k, row->residual);
        terms.psi = with_points(k, rate);
        terms.v = with_points(k, time_derivative(k, rate));
    } else if (row->level == ROW_VELOCITY) {
        terms.psi = with_points(k, row->residual);
        terms.v = with_points(k, time_derivative(k, row->residual));
    } else {
        terms.v = with_points(k, row->residual);
    }
    terms.u = coefficients_of(k, row->residual, (int)row->level, false);
    terms.pull = placed_gradient(k, row->residual, (int)row->level);
    terms.pulls = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *terms.pulls);
    for (int p = 0; p < k->model->marker_count; p++)
        terms.pulls[p] = vector_of(terms.pull + k->tree->count + 3 * p);
    stabilise(k, index, &terms);
    name_row(k, index, &terms);
    for (int j = 0; j < k->tree->count; j++)
        name_value(k->g, terms.u[j],
                   memory_format(k->memory, "row_%d_u_%s", index + 1, k->tree->frames[j].name));
    return terms;
}

struct row_terms *derive_rows(const struct kinematics *k) {
    const int m = k->model->row_count;
    struct row_terms *rows = memory_get(k->memory, ((size_t)m + 1) * sizeof *rows);
    for (int i = 0; i < m; i++)
        rows[i] = derive_row(k, i);
    return rows;
}
