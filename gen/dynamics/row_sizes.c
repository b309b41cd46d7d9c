/*
 * How large the coefficients of rows would be without cancellation (theory, sect. 6.7): this size
 * distinguishes a coefficient that is 0 except for rounding from one that its author makes small.
 *
 * Input: the rows as pulls on points and coefficients of their own coordinates. Output: by joint, the size of
 * the wrench that a row transmits; and how the pulled bodies would respond if they were free, with which
 * pivots of S are compared (theory, sect. 5.6).
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

/* ---- Values without cancellation ---- */

static expression absolute(struct graph *g, expression e) {
    return expr_apply1(g, OP_ABS, e);
}

/* The size of node e from those of its operands. A factor of time, inputs or parameters alone is one term:
 * its author may let it fade. */
static expression size_of_node(struct graph *g, expression e, const expression *sizes) {
    const struct node node = g->nodes[e];
    const expression a = node.operand[0], b = node.operand[1];
    if (!(node.depends & (ON_STATE | ON_RATE)))
        return absolute(g, e);
    switch (node.operation) {
    case OP_ADD:
    case OP_SUB:
        return expr_add(g, sizes[a], sizes[b]);
    case OP_MUL:
        return expr_mul(g, sizes[a], sizes[b]);
    case OP_DIV:
        return expr_div(g, sizes[a], absolute(g, b));
    case OP_NEG:
        return sizes[a];
    default:
        return absolute(g, e);
    }
}

/* The sum of the absolute values of the terms of e. */
static expression size_of(struct graph *g, expression e) {
    const struct memory_mark mark = memory_mark(g->memory);
    bool *needed = memory_scratch(g->memory, ((size_t)e + 1) * sizeof *needed);
    expression *sizes = memory_scratch(g->memory, ((size_t)e + 1) * sizeof *sizes);
    needed[e] = true;
    rewrite_mark_operands(g, needed, e + 1);
    for (expression at = 0; at <= e; at++)
        if (needed[at])
            sizes[at] = size_of_node(g, at, sizes);
    const expression size = sizes[e];
    memory_back(g->memory, mark);
    return size;
}

static expression length_of(struct graph *g, struct vector a) {
    int last = 0, count = 0;
    for (int i = 0; i < 3; i++)
        if (a.at[i]) {
            last = i;
            count++;
        }
    return count < 2 ? absolute(g, a.at[last]) : expr_sqrt(g, vector_dot(g, a, a));
}

/* The sizes of the row's coefficients of its own coordinates, by frame. */
static expression *own_sizes(const struct kinematics *k, int index) {
    const struct row *row = &k->model->rows[index];
    const int n = k->tree->count;
    expression *sizes = coordinate_derivatives_symbol_gradient(k, row->residual, (int)row->level, false);
    for (int j = 0; j < n; j++)
        sizes[j] = coordinate_derivatives_with_points(k, size_of(k->g, sizes[j]));
    return sizes;
}

/* ---- The wrench that a row transmits through a joint ---- */

/* The pulls on the points beyond a joint, as a force at the first of these points and a moment. */
struct transmitted {
    struct vector force, moment, at;
    bool has_point;
};

static void add_pull(const struct kinematics *k, int p, struct vector pull, struct transmitted *sum) {
    struct graph *g = k->g;
    const struct vector r = k->points[p].r;
    if (k->model->points[p].is_direction) {
        sum->moment = vector_add(g, sum->moment, vector_cross(g, r, pull));
        return;
    }
    if (!sum->has_point)
        sum->at = r;
    sum->has_point = true;
    sum->force = vector_add(g, sum->force, pull);
    sum->moment = vector_add(g, sum->moment, vector_cross(g, vector_sub(g, r, sum->at), pull));
}

/* |F| |c - o| + |M| at a revolute joint, |F| at a prismatic one. */
static expression size_at_joint(const struct kinematics *k, int j, const struct transmitted *sum) {
    struct graph *g = k->g;
    const expression force = length_of(g, sum->force);
    if (!k->tree->frames[j].joint.is_revolute)
        return force;
    const struct vector lever = vector_sub(g, sum->at, k->frames[j].position);
    return expr_add(g, force ? expr_mul(g, force, length_of(g, lever)) : EXPR_ZERO,
                    length_of(g, sum->moment));
}

expression *constraints_sizes(const struct kinematics *k, int index, const struct row_terms *row) {
    expression *sizes = own_sizes(k, index);
    graph_remark(
        k->g, memory_format(k->memory, "row %d: |F| |c - o| + |M| + size of its own part (6.7)", index + 1));
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);) {
        struct transmitted sum = {.has_point = false};
        for (int p = 0; p < k->model->marker_count; p++)
            if (!vector_is_zero(row->pulls[p]) && kinematics_is_on_path(k, j, k->tree->points[p].frame))
                add_pull(k, p, row->pulls[p], &sum);
        sizes[j] = expr_add(k->g, size_at_joint(k, j, &sum), sizes[j]);
    }
    return sizes;
}

/* ---- The response of free bodies to a row ---- */

struct own_inertia {
    expression mass, turning; /* turning: the traces of the inertias about each frame's own origin */
};

/* By frame, the sums over all frames beyond it, except for those in runs. They are constants, because the
 * inertias are not moved to another origin. */
static struct own_inertia *inertias_beyond(const struct kinematics *k) {
    struct graph *g = k->g;
    struct own_inertia *beyond = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *beyond);
    for (int i = k->tree->count - 1; i >= 0; i--) {
        const struct frame *frame = &k->tree->frames[i];
        if (frame->kind == FRAME_JOINT && frame->run < 0) {
            beyond[i].mass = expr_add(g, beyond[i].mass, frame->inertia.mass);
            for (int a = 0; a < 3; a++)
                beyond[i].turning =
                    expr_add(g, beyond[i].turning, frame->inertia.tensor.at[tensor_index(a, a)]);
        }
        if (frame->parent >= 0) {
            struct own_inertia *parent = &beyond[frame->parent];
            parent->mass = expr_add(g, parent->mass, beyond[i].mass);
            parent->turning = expr_add(g, parent->turning, beyond[i].turning);
        }
    }
    return beyond;
}

/* square / inertia; 0 without inertia. */
static expression response(struct graph *g, expression square, expression inertia) {
    if (!square || !inertia)
        return EXPR_ZERO;
    return expr_where(g, expr_apply2(g, OP_LESS, EXPR_ZERO, inertia), expr_div(g, square, inertia),
                      EXPR_ZERO);
}

static bool is_same_up_to_sign(struct graph *g, struct vector a, struct vector b) {
    bool same = true, opposite = true;
    for (int i = 0; i < 3; i++) {
        same &= a.at[i] == b.at[i];
        opposite &= a.at[i] == expr_neg(g, b.at[i]);
    }
    return same || opposite;
}

/* The square of a vector; a constant where it is a direction that is fixed to a body. */
static expression square_of(const struct kinematics *k, struct vector a) {
    for (int p = 0; p < k->model->marker_count; p++)
        if (k->model->points[p].is_direction && is_same_up_to_sign(k->g, a, k->points[p].r)) {
            const struct vector rho = vector_of(k->tree->points[p].placement.position);
            return vector_dot(k->g, rho, rho);
        }
    return vector_dot(k->g, a, a);
}

/* The response of the body that carries point p. */
static expression response_of_point(const struct kinematics *k, int p, struct vector pull,
                                    const struct own_inertia *beyond) {
    struct graph *g = k->g;
    const int frame = k->tree->points[p].frame;
    if (frame < 0 || vector_is_zero(pull))
        return EXPR_ZERO;
    const expression square = square_of(k, pull);
    if (!k->model->points[p].is_direction)
        return response(g, square, beyond[frame].mass);
    return response(g, expr_mul(g, square, square_of(k, k->points[p].r)), beyond[frame].turning);
}

static expression response_to_row(const struct kinematics *k, int index, const struct row_terms *row,
                                  const struct own_inertia *beyond) {
    struct graph *g = k->g;
    const expression *sizes = own_sizes(k, index);
    expression sum = EXPR_ZERO;
    for (int p = 0; p < k->model->marker_count; p++)
        sum = expr_add(g, sum, response_of_point(k, p, row->pulls[p], beyond));
    for (int j = 0; j < k->tree->count; j++) {
        const struct own_inertia *inertia = &beyond[j];
        if (row->pull[j] && sizes[j] != absolute(g, row->pull[j])) /* a sum, which may cancel */
            sum = expr_add(g, sum,
                           response(g, expr_mul(g, sizes[j], sizes[j]),
                                    k->tree->frames[j].joint.is_revolute ? inertia->turning : inertia->mass));
    }
    return sum;
}

expression *constraints_free_responses(const struct kinematics *k, const struct row_terms *rows) {
    const int m = k->model->row_count;
    const struct own_inertia *beyond = inertias_beyond(k);
    expression *responses = memory_get(k->memory, ((size_t)m + 1) * sizeof *responses);
    for (int i = 0; i < m; i++)
        responses[i] = response_to_row(k, i, &rows[i], beyond);
    return responses;
}
