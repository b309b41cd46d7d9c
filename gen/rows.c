/* Programme constraints and author's forces: see rows.h. */
#include "rows.h"
#include "memory.h"

static expression *new_values(const struct kinematics *k, size_t count) {
    return memory_get(k->memory, (count + 1) * sizeof(expression));
}

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

/* Points by their kinematics, accelerations at qdd = 0. */
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

expression with_points(const struct kinematics *k, expression e) {
    substitute(k->g, place_symbol, (void *)k, &e, &e, 1);
    return e;
}

static expression rest_symbol(void *context, struct graph *g, expression e) {
    (void)context;
    return as_symbol(g, e)->order > 0 ? zero(g) : e;
}

/* e at qd = 0: points rest as well. */
static expression at_rest(const struct kinematics *k, expression e) {
    substitute(k->g, rest_symbol, NULL, &e, &e, 1);
    return e;
}

/* Derivatives of e by the symbols of coordinates and points of one order. */
struct sensitivity {
    expression *coordinates; /* n */
    struct vector *points;
};

static struct sensitivity sensitivity_of(const struct kinematics *k, expression e, int order) {
    const int n = k->tree->count, points = k->model->point_count, count = n + 3 * points;
    expression *by = new_values(k, (size_t)count), *result = new_values(k, (size_t)count);
    struct sensitivity s = {result, memory_get(k->memory, ((size_t)points + 1) * sizeof *s.points)};
    for (int i = 0; i < count; i++)
        by[i] = i < n ? symbol(k->g, SYMBOL_COORDINATE, i, order) : symbol(k->g, SYMBOL_POINT, i - n, order);
    gradient(k->g, e, by, result, count);
    for (int i = 0; i < points; i++)
        s.points[i] = vector_of(result + n + 3 * i);
    return s;
}

/* The n coefficients behind a sensitivity; at rest where only statics asks. */
static void fill_coefficients(const struct kinematics *k, const struct sensitivity *s, bool resting,
                              expression *coefficients) {
    struct graph *g = k->g;
    for (int j = 0; j < k->tree->count; j++) {
        const expression own = resting ? at_rest(k, s->coordinates[j]) : s->coordinates[j];
        coefficients[j] = with_points(k, own);
    }
    for (int p = 0; p < k->model->point_count; p++) {
        struct vector weight = s->points[p];
        for (int a = 0; a < 3; a++)
            weight.at[a] = with_points(k, resting ? at_rest(k, weight.at[a]) : weight.at[a]);
        if (vector_is_zero(weight))
            continue;
        for (int j = 0; j < k->tree->count; j++)
            coefficients[j] = add(g, coefficients[j], vector_dot(g, weight, k->points[p].columns[j]));
    }
}

/* k = -v - 2 alpha psi - beta^2 phi; velocity rows have no phi, acceleration rows neither. */
static void stabilise(const struct kinematics *k, const struct row *row, struct row_terms *terms) {
    struct graph *g = k->g;
    const expression damping = mul(g, mul(g, number(g, 2), row->alpha), terms->psi);
    const expression stiffness = mul(g, mul(g, row->beta, row->beta), terms->phi);
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
    struct row_terms terms = {.u = new_values(k, (size_t)k->tree->count)};
    const struct sensitivity s = sensitivity_of(k, row->residual, (int)row->level);
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
    fill_coefficients(k, &s, false, terms.u);
    stabilise(k, row, &terms);
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

expression *derive_author_forces(const struct kinematics *k) {
    expression *forces = new_values(k, (size_t)k->tree->count);
    remark(k->g, "forces that the model names");
    for (int i = 0; i < k->model->force_count; i++) {
        const struct force *force = &k->model->forces[i];
        expression *into = &forces[force->coordinate];
        *into = add(k->g, *into, with_points(k, force->value));
    }
    return forces;
}

expression *derive_spring_forces(const struct kinematics *k) {
    struct graph *g = k->g;
    expression *forces = new_values(k, (size_t)k->tree->count);
    remark(g, "springs: -s (q - rest)");
    for (int i = 0; i < k->tree->count; i++) {
        const struct joint *joint = &k->tree->frames[i].joint;
        const expression stretch = sub(g, symbol(g, SYMBOL_COORDINATE, i, 0), joint->rest);
        forces[i] = neg(g, mul(g, joint->stiffness, stretch));
    }
    return forces;
}

expression *derive_damper_forces(const struct kinematics *k) {
    struct graph *g = k->g;
    expression *forces = new_values(k, (size_t)k->tree->count);
    remark(g, "dampers: -d qd");
    for (int i = 0; i < k->tree->count; i++)
        forces[i] = neg(g, mul(g, k->tree->frames[i].joint.damping, symbol(g, SYMBOL_COORDINATE, i, 1)));
    return forces;
}

expression *derive_author_tangent(const struct kinematics *k) {
    const int n = k->tree->count;
    expression *tangent = new_values(k, (size_t)n * (size_t)n), *row = new_values(k, (size_t)n);
    remark(k->g, "tangent of the forces that the model names, at rest");
    for (int i = 0; i < k->model->force_count; i++) {
        const struct force *force = &k->model->forces[i];
        const struct sensitivity s = sensitivity_of(k, force->value, 0);
        fill_coefficients(k, &s, true, row);
        for (int j = 0; j < n; j++) {
            expression *into = &tangent[force->coordinate * n + j];
            *into = add(k->g, *into, row[j]);
        }
    }
    return tangent;
}

expression *derive_printed_rates(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const expression *dampers = derive_damper_forces(k);
    expression *extra = new_values(k, (size_t)n), *row = new_values(k, (size_t)n);
    remark(g, "printed form: sum_j qd_j dQ_j/dqd_i");
    for (int i = 0; i < n; i++)
        extra[i] = dampers[i]; /* -d_i qd_i is linear in qd_i alone */
    for (int f = 0; f < k->model->force_count; f++) {
        const struct force *force = &k->model->forces[f];
        const struct sensitivity s = sensitivity_of(k, force->value, 1);
        const expression rate = symbol(g, SYMBOL_COORDINATE, force->coordinate, 1);
        fill_coefficients(k, &s, false, row);
        for (int i = 0; i < n; i++)
            extra[i] = add(g, extra[i], mul(g, rate, row[i]));
    }
    return extra;
}
