/*
 * Quantities that are exact derivatives, emitted on request: the tangent of the motion equations.
 *
 * Takes the held motion and the pulls of forces and rows (tangent.h), gives functions whose n^2 entries are
 * computed by loops (loops.h): products of vectors of two coordinates, and products of arrays where forces
 * depend on the state.
 */
#include "pairs.h"
#include "quantities.h"
#include "sensitivity.h"

#include <stddef.h>
#include <string.h>

/* What becomes of derivatives in one function: fields that they are added to, by number; NOTHING: left out.
 */
struct targets {
    int by_q, by_qd, mass;
    bool has_inertia;
    double sign; /* of the pulls: -1 where they stand on the other side */
};

struct builder {
    struct derivation *d;
    struct function *f;
    struct held *held;
    const struct pulls *pulls;
    struct pair_arrays arrays;
};

/* ---- Geometry: pulls that stay what they are while the columns of C turn ---- */

static struct vector placed(const struct builder *b, struct vector v) {
    for (int a = 0; a < 3; a++)
        v.at[a] = place_held(b->held, v.at[a]);
    return v;
}

/* C_i x F by coordinate, i beyond j: e_j . (C_i x F) = (e_j x C_i) . F, how joint j turns the column of i. */
static struct vector *turned_pulls(const struct builder *b, double sign) {
    const struct kinematics *k = &b->d->kinematics;
    struct graph *g = k->g;
    struct vector *turned = memory_get(k->memory, ((size_t)b->d->n + 1) * sizeof *turned);
    for (int p = 0; p < k->model->marker_count; p++) {
        const struct vector force = vector_scale(g, number(g, sign), placed(b, b->pulls->points[p]));
        for (int i = k->tree->points[p].frame; i >= 0; i = k->tree->frames[i].parent)
            turned[i] = vector_add(g, turned[i], vector_cross(g, k->points[p].columns[i], force));
    }
    return turned;
}

/* e_i x T: a torque's axis is turned by the nearer joints alone. */
static struct vector *turned_torques(const struct builder *b, double sign) {
    const struct kinematics *k = &b->d->kinematics;
    struct graph *g = k->g;
    struct vector *turned = memory_get(k->memory, ((size_t)b->d->n + 1) * sizeof *turned);
    for (int p = 0; p < k->model->marker_count; p++) {
        const struct vector torque = vector_scale(g, number(g, sign), placed(b, b->pulls->torques[p]));
        for (int i = k->tree->points[p].frame; i >= 0; i = k->tree->frames[i].parent)
            if (k->tree->frames[i].joint.is_turn)
                turned[i] = vector_add(g, turned[i], vector_cross(g, joint_axis(k, i), torque));
    }
    return turned;
}

/* ---- Pairs ---- */

/* One member of every coordinate's vectors. */
static const struct vector *gather(const struct builder *b, const struct pair_vectors *vectors,
                                   size_t offset) {
    struct vector *list = memory_get(b->d->memory, ((size_t)b->d->n + 1) * sizeof *list);
    for (int i = 0; i < b->d->n; i++)
        memcpy(&list[i], (const char *)&vectors[i] + offset, sizeof *list);
    return list;
}

static struct vector_arrays arrays_of(struct builder *b, const struct pair_vectors *vectors, size_t offset,
                                      const char *name) {
    return add_arrays(&b->arrays, name, gather(b, vectors, offset));
}

static struct vector_arrays axis_arrays(struct builder *b, const char *name, size_t offset) {
    struct vector *list = memory_get(b->d->memory, ((size_t)b->d->n + 1) * sizeof *list);
    for (int i = 0; i < b->d->n; i++)
        memcpy(&list[i], (const char *)&b->held->frames[i] + offset, sizeof *list);
    return add_arrays(&b->arrays, name, list);
}

static struct pair_move moved(struct builder *b, const struct vector *moments, struct vector_arrays force,
                              struct vector_arrays shift, const char *name) {
    struct pair_move move = {.force = force, .shift = shift};
    add_moved(&b->arrays, name, moments, &move);
    return move;
}

/* Arrays of inertia by their names in tangent.h. */
struct inertia_arrays {
    struct vector_arrays rate, rate2, lever;
    struct vector_arrays mass_force, stiffness_force, damping_force;
    struct pair_move mass, spin, stiffness, damping;
};

static struct inertia_arrays add_inertia_arrays(struct builder *b, const struct vector *turned) {
    struct derivation *d = b->d;
    struct pair_vectors *v = derive_pair_vectors(b->held, composites(d), loads(d));
    struct inertia_arrays a;
    for (int i = 0; i < d->n; i++)
        v[i].stiffness.moment = vector_add(d->g, v[i].stiffness.moment, turned[i]);
    a.rate = axis_arrays(b, "axis_rate", offsetof(struct held_frame, axis_rate));
    a.rate2 = axis_arrays(b, "axis_rate2", offsetof(struct held_frame, axis_rate2));
    a.lever = arrays_of(b, v, offsetof(struct pair_vectors, falling_lever), "lever");
    const struct vector_arrays shift = arrays_of(b, v, offsetof(struct pair_vectors, shift), "shift");
    const struct vector_arrays shift_rate =
        arrays_of(b, v, offsetof(struct pair_vectors, shift_rate), "shift_rate");
    a.mass_force = arrays_of(b, v, offsetof(struct pair_vectors, mass.force), "mass_force");
    a.stiffness_force = arrays_of(b, v, offsetof(struct pair_vectors, stiffness.force), "stiffness_force");
    a.damping_force = arrays_of(b, v, offsetof(struct pair_vectors, damping.force), "damping_force");
    a.mass = moved(b, gather(b, v, offsetof(struct pair_vectors, mass.moment)), a.mass_force, shift,
                   "mass_moment");
    a.spin = moved(b, gather(b, v, offsetof(struct pair_vectors, spin)), a.mass_force, shift_rate, "spin");
    a.stiffness = moved(b, gather(b, v, offsetof(struct pair_vectors, stiffness.moment)), a.stiffness_force,
                        shift, "stiffness_moment");
    a.damping = moved(b, gather(b, v, offsetof(struct pair_vectors, damping.moment)), a.damping_force, shift,
                      "damping_moment");
    return a;
}

/* d/dq_j of row i = e'' . N + 2 e' . P + ((a - grav) x e) . A, d/dq_i of row j = e . (moment of i). */
static struct pair_product stiffness_product(const struct inertia_arrays *a, struct vector_arrays axis,
                                             int field) {
    struct pair_product product = {.field = field};
    add_term(&product.turn.rows, 1, a->rate2, a->mass.moment);
    add_term(&product.turn.rows, 2, a->rate, a->spin.moment);
    add_term(&product.turn.rows, 1, a->lever, a->mass_force);
    add_term(&product.turn.columns, 1, axis, a->stiffness.moment);
    add_term(&product.slide.rows, 1, a->rate2, a->mass_force);
    add_term(&product.slide.columns, 1, axis, a->stiffness_force);
    return product;
}

static struct pair_product damping_product(const struct inertia_arrays *a, struct vector_arrays axis,
                                           int field) {
    struct pair_product product = {.field = field};
    add_term(&product.turn.rows, 2, a->rate, a->mass.moment);
    add_term(&product.turn.rows, 2, axis, a->spin.moment);
    add_term(&product.turn.columns, 1, axis, a->damping.moment);
    add_term(&product.slide.rows, 2, a->rate, a->mass_force);
    add_term(&product.slide.columns, 1, axis, a->damping_force);
    return product;
}

static struct pair_product mass_product(const struct inertia_arrays *a, struct vector_arrays axis,
                                        int field) {
    struct pair_product product = {.field = field, .is_mirrored = true};
    add_term(&product.turn.rows, 1, axis, a->mass.moment);
    add_term(&product.slide.rows, 1, axis, a->mass_force);
    return product;
}

static void add_inertia_products(struct pairs *pairs, const struct inertia_arrays *a,
                                 struct vector_arrays axis, const struct targets *targets) {
    const struct pair_move moves[] = {a->mass, a->spin, a->stiffness, a->damping};
    pairs->products[pairs->product_count++] = stiffness_product(a, axis, targets->by_q);
    pairs->products[pairs->product_count++] = damping_product(a, axis, targets->by_qd);
    pairs->products[pairs->product_count++] = mass_product(a, axis, targets->mass);
    memcpy(pairs->moves, moves, sizeof moves);
    for (int i = 0; i < pairs->n; i++)
        if (pairs->moves_on[i])
            pairs->move_count = sizeof moves / sizeof *moves;
}

static void add_pair_loop(struct builder *b, const struct targets *targets) {
    const struct vector *turned = turned_pulls(b, targets->sign);
    const struct vector *torques = turned_torques(b, targets->sign);
    const struct vector_arrays axis = axis_arrays(b, "axis", offsetof(struct held_frame, axis));
    struct vector *rows = memory_get(b->d->memory, ((size_t)b->d->n + 1) * sizeof *rows);
    for (int i = 0; i < b->d->n; i++)
        rows[i] = vector_add(b->d->g, turned[i], torques[i]);
    const struct vector_arrays pull = add_arrays(&b->arrays, "pull_rows", rows);
    if (targets->has_inertia) {
        const struct inertia_arrays inertia = add_inertia_arrays(b, turned);
        struct pairs *pairs =
            add_pairs(&b->arrays, "pairs of coordinates: j, and i beyond it, from the tips");
        add_inertia_products(pairs, &inertia, axis, targets);
        add_term(&pairs->products[0].turn.rows, 1, axis, pull);
        return;
    }
    const struct vector_arrays columns = add_arrays(&b->arrays, "pull_columns", turned);
    struct pairs *pairs =
        add_pairs(&b->arrays, "pairs of coordinates: how j turns the columns of i beyond it");
    struct pair_product *product = &pairs->products[pairs->product_count++];
    *product = (struct pair_product){.field = targets->by_q};
    add_term(&product->turn.rows, 1, axis, pull);
    add_term(&product->turn.columns, 1, axis, columns);
}

/* ---- Pulls that depend on the state ---- */

static bool is_all_zero(const expression *values, int count) {
    for (int i = 0; i < count; i++)
        if (values[i])
            return false;
    return true;
}

/* A pull on one column of C, and its derivatives. */
struct slope {
    const expression *column, *by_q, *by_qd; /* n each */
};

struct slopes {
    struct slope *list;
    int count, capacity;
};

static void add_slope(struct builder *b, struct slopes *slopes, expression pull, const expression *column) {
    const int n = b->d->n;
    const struct slope slope = {column, held_slopes(b->held, pull, 0), held_slopes(b->held, pull, 1)};
    if (is_all_zero(slope.by_q, n) && is_all_zero(slope.by_qd, n))
        return;
    slopes->list = memory_room(b->d->memory, slopes->list, slopes->count, &slopes->capacity, sizeof slope);
    slopes->list[slopes->count++] = slope;
}

/* One axis of the columns of a point, or of a body's turns. */
static expression *column_axis(const struct builder *b, int point, bool is_torque, int axis) {
    const struct kinematics *k = &b->d->kinematics;
    expression *column = new_values(b->d, b->d->n);
    for (int i = k->tree->points[point].frame; i >= 0; i = k->tree->frames[i].parent)
        if (!is_torque)
            column[i] = k->points[point].columns[i].at[axis];
        else if (k->tree->frames[i].joint.is_turn)
            column[i] = joint_axis(k, i).at[axis];
    return column;
}

static struct slopes slopes_of_points(struct builder *b) {
    struct slopes slopes = {0};
    for (int p = 0; p < b->d->model->marker_count; p++)
        for (int axis = 0; axis < 3; axis++) {
            const expression force = b->pulls->points[p].at[axis], torque = b->pulls->torques[p].at[axis];
            if (force)
                add_slope(b, &slopes, force, column_axis(b, p, false, axis));
            if (torque)
                add_slope(b, &slopes, torque, column_axis(b, p, true, axis));
        }
    return slopes;
}

static int add_slope_array(struct builder *b, const struct slopes *slopes, const char *name, size_t member) {
    const int n = b->d->n;
    int field;
    expression *values = add_local(b->d->memory, b->f, name, slopes->count * n, n, &field);
    for (int s = 0; s < slopes->count; s++) {
        const expression *row;
        memcpy(&row, (const char *)&slopes->list[s] + member, sizeof row);
        memcpy(values + s * n, row, (size_t)n * sizeof *row);
    }
    return field;
}

static void add_product(struct builder *b, int target, int left, int right, double factor,
                        const char *about) {
    add_loop(b->d->memory, b->f, LOOP_PRODUCT, about)->of.product =
        (struct product){target, left, right, factor};
}

/* Entries += sign C^T dF: as products of arrays, because a force at a point reaches n x n entries. */
static void add_slope_loops(struct builder *b, const struct targets *targets) {
    const struct slopes slopes = slopes_of_points(b);
    if (!slopes.count)
        return;
    const int left = add_slope_array(b, &slopes, "pulled", offsetof(struct slope, column));
    const int by_q = add_slope_array(b, &slopes, "pull_by_q", offsetof(struct slope, by_q));
    const int by_qd = add_slope_array(b, &slopes, "pull_by_qd", offsetof(struct slope, by_qd));
    add_product(b, targets->by_q, left, by_q, targets->sign, "forces at points that depend on q");
    add_product(b, targets->by_qd, left, by_qd, targets->sign, "forces at points that depend on qd");
}

/* Straight-line entries of pulls on coordinates: dF_i/dq_j in row i. */
static void fill_coordinate_slopes(struct builder *b, int order, double sign, expression *field) {
    const int n = b->d->n;
    for (int i = 0; i < n; i++) {
        const expression *row =
            b->pulls->coordinates[i] ? held_slopes(b->held, b->pulls->coordinates[i], order) : NULL;
        for (int j = 0; row && j < n; j++)
            field[i * n + j] = mul(b->d->g, number(b->d->g, sign), row[j]);
    }
}

/* ---- The tangent ---- */

static expression *field_values(const struct function *f, int field) {
    return f->out + f->fields[field].offset;
}

/* All loops and straight-line entries of one set of derivatives by q and qd. */
static void add_derivatives(struct builder *b, const struct targets *targets) {
    fill_coordinate_slopes(b, 0, targets->sign, field_values(b->f, targets->by_q));
    fill_coordinate_slopes(b, 1, targets->sign, field_values(b->f, targets->by_qd));
    b->arrays = open_pairs(&b->d->kinematics, b->f);
    add_pair_loop(b, targets);
    add_slope_loops(b, targets);
}

static expression slope_in_time(void *context, struct graph *g, expression e) {
    (void)context;
    return as_symbol(g, e)->kind == SYMBOL_TIME ? one(g) : zero(g);
}

/* Accelerations and multipliers as symbols, so that they stay while all else changes. */
static expression *symbols_of(struct derivation *d, enum symbol_kind kind, int count, int order) {
    expression *symbols = new_values(d, count);
    for (int i = 0; i < count; i++)
        symbols[i] = symbol(d->g, kind, i, order);
    return symbols;
}

/* M qdd - h - Q - u^T lambda, then u qdd - k: n + m values, qdd and lambda as symbols. */
static expression *balances(struct derivation *d, const struct pulls *pulls) {
    const expression *qdd = symbols_of(d, SYMBOL_COORDINATE, d->n, 2);
    struct held *held = hold(&d->kinematics, qdd, NULL);
    expression *balances = new_values(d, d->n + d->m);
    const expression *inertia = derive_inertia_forces(held, loads(d)), *Q = pulled(held, pulls);
    const expression *row = row_balances(&d->kinematics);
    for (int i = 0; i < d->n; i++)
        balances[i] = sub(d->g, inertia[i], Q[i]);
    for (int i = 0; i < d->m; i++)
        balances[d->n + i] = place_held(held, row[i]);
    return balances;
}

static int add_result(struct derivation *d, struct function *f, const char *name, const char *about,
                      int count, int columns) {
    add_field(d, f, name, about, count, columns);
    return f->field_count - 1;
}

static void fill(const struct function *f, int field, const expression *values) {
    memcpy(field_values(f, field), values, (size_t)f->fields[field].count * sizeof *values);
}

/* d(u qdd - k) by q or qd, m x n. */
static void fill_row_slopes(struct builder *b, int order, int field) {
    const expression *row = row_balances(&b->d->kinematics);
    expression *values = field_values(b->f, field);
    for (int i = 0; i < b->d->m; i++)
        memcpy(values + i * b->d->n, held_slopes(b->held, row[i], order), (size_t)b->d->n * sizeof *values);
}

static void fill_u(const struct derivation *d, const struct function *f, int field) {
    for (int i = 0; i < d->m; i++)
        memcpy(field_values(f, field) + i * d->n, d->rows[i].u, (size_t)d->n * sizeof(expression));
}

static struct builder start(struct derivation *d, struct function *f) {
    struct pulls *pulls = no_pulls(&d->kinematics);
    struct builder b = {.d = d, .f = f, .pulls = pulls};
    add_applied_pulls(&d->kinematics, pulls);
    add_row_pulls(&d->kinematics, pulls);
    if (d->m)
        constrained_accelerations(d);
    b.held = hold(&d->kinematics, d->m ? d->qdd : free_accelerations(d), d->lambda);
    return b;
}

static void fill_time_slopes(struct builder *b, int f_t, int g_t) {
    struct derivation *d = b->d;
    const int count = d->n + d->m;
    expression *values = balances(d, b->pulls);
    differentiate_all(d->g, values, values, count, slope_in_time, NULL);
    for (int i = 0; i < count; i++)
        values[i] = place_held(b->held, values[i]);
    fill(b->f, f_t, values);
    if (d->m)
        fill(b->f, g_t, values + d->n);
}

void build_tangent(struct derivation *d, struct function *f) {
    const int n = d->n, m = d->m;
    int lambda = NOTHING, G_q = NOTHING, G_qd = NOTHING, g_t = NOTHING, u = NOTHING;
    struct builder b = start(d, f);
    const int qdd = add_result(d, f, "qdd", "(n) accelerations", n, 0);
    if (m)
        lambda = add_result(d, f, "lambda", "(m) multipliers, programme force u^T lambda", m, 0);
    const int K =
        add_result(d, f, "K", "(n x n) d(M qdd - h - Q - u^T lambda)/dq at held qdd, lambda", n * n, n);
    const int D = add_result(d, f, "D", "(n x n) the same by qd", n * n, n);
    if (m) {
        G_q = add_result(d, f, "G_q", "(m x n) d(u qdd - k)/dq at held qdd", m * n, n);
        G_qd = add_result(d, f, "G_qd", "(m x n) the same by qd", m * n, n);
    }
    const int f_t = add_result(d, f, "f_t", "(n) d(M qdd - h - Q - u^T lambda)/dt at held qdd, lambda", n, 0);
    if (m)
        g_t = add_result(d, f, "g_t", "(m) d(u qdd - k)/dt at held qdd", m, 0);
    const int M = add_result(d, f, "M", "(n x n) mass matrix", n * n, n);
    if (m)
        u = add_result(d, f, "u", "(m x n) row coefficients", m * n, n);
    fill(f, qdd, b.held->accelerations);
    fill_time_slopes(&b, f_t, g_t);
    if (m) {
        fill(f, lambda, d->lambda);
        fill_row_slopes(&b, 0, G_q);
        fill_row_slopes(&b, 1, G_qd);
        fill_u(d, f, u);
    }
    add_derivatives(&b, &(struct targets){K, D, M, true, -1});
    drop_unread(d->memory, f);
}
