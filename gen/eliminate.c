/*
 * The solution of M x = f in O(n): articulated inertias, eliminated joint by joint from the tips
 * (Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7; here the velocities stand in f, so that one
 * elimination serves any f).
 *
 * Takes kinematics, gives x for right sides f; declared in dynamics.h. For each frame the articulated inertia
 * maps (angular, linear) acceleration to (moment, force): [J H; H^T M], J and M symmetric.
 */
#include "dynamics.h"
#include "memory.h"

#include <string.h>

struct articulated {
    struct tensor J;
    struct matrix H;
    struct tensor M;
};

/* What stays of joint i: U = inertia times joint axis, U / D, 1 / D. */
struct pivot {
    struct wrench U, U_over_D;
    expression D_inverse;
};

struct elimination {
    struct pivot *pivots;
};

/* A rigid body: J, H = [mc]x, M = m 1. */
static struct articulated rigid(struct graph *g, const struct inertia *inertia) {
    struct articulated a = {.H = {{0}}};
    const expression *mc = inertia->moment;
    memcpy(a.J.at, inertia->tensor, sizeof a.J.at);
    a.H.at[1] = neg(g, mc[2]), a.H.at[2] = mc[1];
    a.H.at[3] = mc[2], a.H.at[5] = neg(g, mc[0]);
    a.H.at[6] = neg(g, mc[1]), a.H.at[7] = mc[0];
    for (int i = 0; i < 6; i++)
        a.M.at[i] = i < 3 ? inertia->mass : 0;
    return a;
}

static struct vector row_of(const struct matrix *m, int row) {
    return vector_of(m->at + 3 * row);
}

static struct vector column_of(const struct matrix *m, int column) {
    return (struct vector){{m->at[column], m->at[3 + column], m->at[6 + column]}};
}

static struct vector tensor_column(const struct tensor *t, int column) {
    struct vector c;
    for (int i = 0; i < 3; i++)
        c.at[i] = t->at[tensor_index(i, column)];
    return c;
}

static struct pivot pivot_of(struct graph *g, const struct joint *joint, const struct articulated *a) {
    struct pivot p;
    const int axis = joint->axis;
    expression D;
    if (joint->is_turn) {
        p.U = (struct wrench){tensor_column(&a->J, axis), row_of(&a->H, axis)};
        D = a->J.at[axis];
    } else {
        p.U = (struct wrench){column_of(&a->H, axis), tensor_column(&a->M, axis)};
        D = a->M.at[axis];
    }
    p.D_inverse = quotient(g, one(g), D);
    p.U_over_D.moment = vector_scale(g, p.D_inverse, p.U.moment);
    p.U_over_D.force = vector_scale(g, p.D_inverse, p.U.force);
    /* Along the joint's own axis U is D. */
    (joint->is_turn ? &p.U_over_D.moment : &p.U_over_D.force)->at[axis] = one(g);
    return p;
}

static void clear_tensor_row(struct tensor *t, int row) {
    for (int i = 0; i < 3; i++)
        t->at[tensor_index(row, i)] = 0;
}

/* What the joint lets go: after the elimination the inertia along its axis is zero, exactly and not by
 * subtraction. */
static void clear_axis(const struct joint *joint, struct articulated *a) {
    clear_tensor_row(joint->is_turn ? &a->J : &a->M, joint->axis);
    for (int i = 0; i < 3; i++)
        a->H.at[joint->is_turn ? 3 * joint->axis + i : 3 * i + joint->axis] = 0;
}

/* [J H; H^T M] - U U^T / D */
static void eliminate_joint(struct graph *g, const struct joint *joint, const struct pivot *p,
                            struct articulated *a) {
    const struct vector um = p->U.moment, uf = p->U.force, om = p->U_over_D.moment, of = p->U_over_D.force;
    clear_axis(joint, a);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int ij = tensor_index(i, j);
            const bool free_i = joint->is_turn && i == joint->axis,
                       free_j = joint->is_turn && j == joint->axis;
            const bool slide_i = !joint->is_turn && i == joint->axis,
                       slide_j = !joint->is_turn && j == joint->axis;
            if (j >= i && !free_i && !free_j)
                a->J.at[ij] = sub(g, a->J.at[ij], mul(g, um.at[i], om.at[j]));
            if (j >= i && !slide_i && !slide_j)
                a->M.at[ij] = sub(g, a->M.at[ij], mul(g, uf.at[i], of.at[j]));
            if (!free_i && !slide_j)
                a->H.at[3 * i + j] = sub(g, a->H.at[3 * i + j], mul(g, um.at[i], of.at[j]));
        }
}

static struct matrix matrix_to_parent(const struct kinematics *k, int i, struct matrix m) {
    struct matrix half, full;
    for (int column = 0; column < 3; column++) {
        const struct vector turned = to_parent(k, i, column_of(&m, column));
        for (int row = 0; row < 3; row++)
            half.at[3 * row + column] = turned.at[row];
    }
    for (int row = 0; row < 3; row++) {
        const struct vector turned = to_parent(k, i, row_of(&half, row));
        memcpy(full.at + 3 * row, turned.at, sizeof turned.at);
    }
    return full;
}

/* About the parent's origin, r from there to here: H' = H + r x M, J' = J - H r x + r x H'^T. */
static struct articulated shift_articulated(struct graph *g, struct vector r, struct articulated a) {
    struct articulated b = a;
    for (int column = 0; column < 3; column++) {
        const struct vector lever = vector_cross(g, r, tensor_column(&a.M, column));
        for (int row = 0; row < 3; row++)
            b.H.at[3 * row + column] = add(g, a.H.at[3 * row + column], lever.at[row]);
    }
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            const struct vector left = vector_cross(g, r, row_of(&a.H, i));
            const struct vector right = vector_cross(g, r, row_of(&b.H, j));
            expression *entry = &b.J.at[tensor_index(i, j)];
            *entry = add(g, add(g, *entry, left.at[j]), right.at[i]);
        }
    return b;
}

static struct articulated articulated_to_parent(const struct kinematics *k, int i, struct articulated a) {
    a.J = tensor_to_parent(k, i, a.J);
    a.H = matrix_to_parent(k, i, a.H);
    a.M = tensor_to_parent(k, i, a.M);
    return shift_articulated(k->g, k->frames[i].shift, a);
}

static struct articulated articulated_add(struct graph *g, struct articulated a,
                                          const struct articulated *b) {
    a.J = tensor_add(g, a.J, b->J);
    a.M = tensor_add(g, a.M, b->M);
    for (int i = 0; i < 9; i++)
        a.H.at[i] = add(g, a.H.at[i], b->H.at[i]);
    return a;
}

struct elimination *eliminate(const struct kinematics *k) {
    const int n = k->tree->count;
    struct elimination *e = memory_get(k->memory, sizeof *e);
    struct articulated *beyond = memory_get(k->memory, ((size_t)n + 1) * sizeof *beyond);
    e->pivots = memory_get(k->memory, ((size_t)n + 1) * sizeof *e->pivots);
    for (int i = n - 1; i >= 0; i--) {
        const struct frame *frame = &k->tree->frames[i];
        remark(k->g,
               memory_format(k->memory, "%s: articulated inertia, D = e.I e, I - I e (I e)^T / D, inward",
                             frame->name));
        struct articulated own = rigid(k->g, &frame->inertia);
        own = articulated_add(k->g, own, &beyond[i]);
        e->pivots[i] = pivot_of(k->g, &frame->joint, &own);
        name_scalar(k, i, "D_inverse", e->pivots[i].D_inverse);
        name_vector(k, i, "U_moment", e->pivots[i].U.moment);
        name_vector(k, i, "U_force", e->pivots[i].U.force);
        eliminate_joint(k->g, &frame->joint, &e->pivots[i], &own);
        if (frame->parent >= 0) {
            own = articulated_to_parent(k, i, own);
            beyond[frame->parent] = articulated_add(k->g, beyond[frame->parent], &own);
        }
    }
    return e;
}

static expression wrench_dot(struct graph *g, struct wrench a, struct vector angular, struct vector linear) {
    return add(g, vector_dot(g, a.moment, angular), vector_dot(g, a.force, linear));
}

/* Inward: what is left of f_i after all beyond, u_i = f_i - e.p, p += I e u_i / D. */
static expression *reduce_inward(const struct kinematics *k, const struct pivot *pivots,
                                 const expression *f) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    struct wrench *p = memory_get(k->memory, ((size_t)n + 1) * sizeof *p);
    expression *u = memory_get(k->memory, ((size_t)n + 1) * sizeof *u);
    for (int i = n - 1; i >= 0; i--) {
        const struct frame *frame = &k->tree->frames[i];
        const int axis = frame->joint.axis;
        const bool turn = frame->joint.is_turn;
        remark(g, memory_format(k->memory, "%s: force left for the joint, inward", frame->name));
        u[i] = sub(g, f[i], turn ? p[i].moment.at[axis] : p[i].force.at[axis]);
        if (frame->parent < 0)
            continue;
        struct wrench through = {vector_scale(g, u[i], pivots[i].U_over_D.moment),
                                 vector_scale(g, u[i], pivots[i].U_over_D.force)};
        through.moment = vector_add(g, p[i].moment, through.moment);
        through.force = vector_add(g, p[i].force, through.force);
        /* Along the joint's own axis all of f_i is passed on: e.p + (f_i - e.p) = f_i, exactly. */
        *(turn ? &through.moment.at[axis] : &through.force.at[axis]) = f[i];
        const struct vector force = to_parent(k, i, through.force);
        const struct vector moment = to_parent(k, i, through.moment);
        struct wrench *outer = &p[frame->parent];
        outer->force = vector_add(g, outer->force, force);
        outer->moment =
            vector_add(g, outer->moment, vector_add(g, moment, vector_cross(g, k->frames[i].shift, force)));
    }
    return u;
}

/* Outward: x_i = (u_i - U.a) / D with a the acceleration that the parent passes on. */
expression *solve_eliminated(const struct kinematics *k, const struct elimination *elimination,
                             const expression *f) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct pivot *pivots = elimination->pivots;
    const expression *u = reduce_inward(k, pivots, f);
    expression *x = memory_get(k->memory, ((size_t)n + 1) * sizeof *x);
    struct vector *angular = memory_get(k->memory, ((size_t)n + 1) * sizeof *angular);
    struct vector *linear = memory_get(k->memory, ((size_t)n + 1) * sizeof *linear);
    for (int i = 0; i < n; i++) {
        const struct frame *frame = &k->tree->frames[i];
        const int parent = frame->parent;
        remark(g, memory_format(k->memory, "%s: acceleration, outward", frame->name));
        if (parent >= 0) {
            const struct vector lever = vector_cross(g, angular[parent], k->frames[i].shift);
            angular[i] = to_child(k, i, angular[parent]);
            linear[i] = to_child(k, i, vector_add(g, linear[parent], lever));
        }
        const expression carried = wrench_dot(g, pivots[i].U_over_D, angular[i], linear[i]);
        x[i] = sub(g, mul(g, pivots[i].D_inverse, u[i]), carried);
        expression *along =
            frame->joint.is_turn ? &angular[i].at[frame->joint.axis] : &linear[i].at[frame->joint.axis];
        *along = add(g, *along, x[i]);
    }
    return x;
}
