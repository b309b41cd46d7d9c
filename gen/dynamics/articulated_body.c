/*
 * The solution of M x = f in O(n): articulated inertias, eliminated joint by joint from the tips (theory,
 * sect. 5.1 to 5.4; Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7). The velocities are in f, so
 * that one elimination serves every right side.
 *
 * Input: kinematics and right sides f. Result: x. For each frame the articulated inertia IA = [J H; H^T M], J
 * and M symmetric, maps (angular, linear) acceleration to (moment, force). Three turns at one point, as in a
 * spring-damping element, are eliminated together, as a ball joint: its moment m follows from the forces on
 * its coordinates alone, and only M - H^T J^-1 H is passed on. The vanishing entries are exact zeros, not
 * differences.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

/* IA of a rigid body: J, H = [mc]x, M = m 1. Theory, sect. 5.1. */
static struct articulated rigid(struct graph *g, const struct inertia *inertia) {
    struct articulated a = {.H = {{0}}};
    const expression *mc = inertia->moment.at;
    a.J = inertia->tensor;
    a.H.at[1] = expr_neg(g, mc[2]), a.H.at[2] = mc[1];
    a.H.at[3] = mc[2], a.H.at[5] = expr_neg(g, mc[0]);
    a.H.at[6] = expr_neg(g, mc[1]), a.H.at[7] = mc[0];
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

/* 1 / e. If e chooses one of two constants for the last element of a run, the result is the same choice of
 * their reciprocals, so that no iteration divides. */
static expression reciprocal(struct graph *g, expression e) {
    const struct node node = g->nodes[e];
    const struct symbol *s = node.operation == OP_WHERE ? expr_as_symbol(g, node.operand[0]) : NULL;
    if (s && s->kind == SYMBOL_LAST)
        return expr_where(g, node.operand[0], expr_div(g, EXPR_ONE, node.operand[1]),
                          expr_div(g, EXPR_ONE, node.operand[2]));
    return expr_div(g, EXPR_ONE, e);
}

/* U = IA e is column `axis` of [J; H^T] for a revolute joint, of [H; M] for a prismatic one. */
static struct pivot pivot_of(struct graph *g, const struct joint *joint, const struct articulated *a) {
    struct pivot p;
    const int axis = joint->axis;
    expression D;
    if (joint->is_revolute) {
        p.U = (struct wrench){tensor_column(&a->J, axis), row_of(&a->H, axis)};
        D = a->J.at[axis];
    } else {
        p.U = (struct wrench){column_of(&a->H, axis), tensor_column(&a->M, axis)};
        D = a->M.at[axis];
    }
    p.D_inverse = reciprocal(g, expr_add(g, D, joint->rotor));
    p.U_over_D.moment = vector_scale(g, p.D_inverse, p.U.moment);
    p.U_over_D.force = vector_scale(g, p.D_inverse, p.U.force);
    p.kept = EXPR_ZERO;
    if (joint->rotor)
        p.kept = expr_mul(g, joint->rotor, p.D_inverse);
    else /* along the joint's own axis U is D */
        (joint->is_revolute ? &p.U_over_D.moment : &p.U_over_D.force)->at[axis] = EXPR_ONE;
    return p;
}

/* IA e - U U.e / D = U rotor / D: the row and column of the joint's own axis are set to this value, which
 * is zero without a rotor; they are not subtracted. */
static void keep_along_axis(struct graph *g, const struct joint *joint, const struct pivot *p,
                            struct articulated *a) {
    struct tensor *own = joint->is_revolute ? &a->J : &a->M;
    const struct vector along = joint->is_revolute ? p->U.moment : p->U.force,
                        across = joint->is_revolute ? p->U.force : p->U.moment;
    for (int i = 0; i < 3; i++) {
        own->at[tensor_index(joint->axis, i)] = expr_mul(g, p->kept, along.at[i]);
        a->H.at[joint->is_revolute ? 3 * joint->axis + i : 3 * i + joint->axis] =
            expr_mul(g, p->kept, across.at[i]);
    }
}

/* IA - U U^T / D: theory, sect. 5.2. */
static void eliminate_joint(struct graph *g, const struct joint *joint, const struct pivot *p,
                            struct articulated *a) {
    const struct vector um = p->U.moment, uf = p->U.force, om = p->U_over_D.moment, of = p->U_over_D.force;
    keep_along_axis(g, joint, p, a);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int ij = tensor_index(i, j);
            const bool free_i = joint->is_revolute && i == joint->axis,
                       free_j = joint->is_revolute && j == joint->axis;
            const bool slide_i = !joint->is_revolute && i == joint->axis,
                       slide_j = !joint->is_revolute && j == joint->axis;
            if (j >= i && !free_i && !free_j)
                a->J.at[ij] = expr_sub(g, a->J.at[ij], expr_mul(g, um.at[i], om.at[j]));
            if (j >= i && !slide_i && !slide_j)
                a->M.at[ij] = expr_sub(g, a->M.at[ij], expr_mul(g, uf.at[i], of.at[j]));
            if (!free_i && !slide_j)
                a->H.at[3 * i + j] = expr_sub(g, a->H.at[3 * i + j], expr_mul(g, um.at[i], of.at[j]));
        }
}

struct matrix articulated_body_matrix_to_parent(const struct kinematics *k, int i, struct matrix m) {
    struct matrix half, full;
    for (int column = 0; column < 3; column++) {
        const struct vector turned = kinematics_to_parent(k, i, column_of(&m, column));
        for (int row = 0; row < 3; row++)
            half.at[3 * row + column] = turned.at[row];
    }
    for (int row = 0; row < 3; row++) {
        const struct vector turned = kinematics_to_parent(k, i, row_of(&half, row));
        memcpy(full.at + 3 * row, turned.at, sizeof turned.at);
    }
    return full;
}

/* The axis to which r is parallel; -1: none. */
static int axis_along(struct vector r) {
    for (int a = 0; a < 3; a++)
        if (r.at[a] && !r.at[(a + 1) % 3] && !r.at[(a + 2) % 3])
            return a;
    return -1;
}

/* [r]x M [r]x^T for r of length l along an axis, by l^2, so that J' can be computed before H'. */
static struct tensor lever_square(struct graph *g, int axis, expression l, struct tensor M) {
    struct tensor square = {{0}};
    const int b = (axis + 1) % 3, c = (axis + 2) % 3, bc = tensor_index(b, c);
    const expression ll = expr_mul(g, l, l);
    square.at[b] = expr_mul(g, ll, M.at[c]);
    square.at[c] = expr_mul(g, ll, M.at[b]);
    square.at[bc] = expr_neg(g, expr_mul(g, ll, M.at[bc]));
    return square;
}

/* About the parent's origin, r away: H' = H + [r]x M, J' = J - H [r]x + [r]x H'^T. Theory, sect. 5.1. */
struct articulated articulated_body_shift(struct graph *g, struct vector r, struct articulated a) {
    const int axis = axis_along(r);
    struct articulated b = a;
    if (axis >= 0)
        b.J = tensor_add(g, b.J, lever_square(g, axis, r.at[axis], a.M));
    for (int column = 0; column < 3; column++) {
        const struct vector lever = vector_cross(g, r, tensor_column(&a.M, column));
        for (int row = 0; row < 3; row++)
            b.H.at[3 * row + column] = expr_add(g, a.H.at[3 * row + column], lever.at[row]);
    }
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            const struct vector left = vector_cross(g, r, row_of(&a.H, i));
            const struct vector right = vector_cross(g, r, row_of(axis < 0 ? &b.H : &a.H, j));
            expression *entry = &b.J.at[tensor_index(i, j)];
            *entry = expr_add(g, expr_add(g, *entry, left.at[j]), right.at[i]);
        }
    return b;
}

static struct articulated articulated_to_parent(const struct kinematics *k, int i, struct articulated a) {
    a.J = kinematics_tensor_to_parent(k, i, a.J);
    a.H = articulated_body_matrix_to_parent(k, i, a.H);
    a.M = kinematics_tensor_to_parent_quickly(k, i, a.M);
    return articulated_body_shift(k->g, k->joints[i].shift, a);
}

static struct articulated articulated_add(struct graph *g, struct articulated a,
                                          const struct articulated *b) {
    a.J = tensor_add(g, a.J, b->J);
    a.M = tensor_add(g, a.M, b->M);
    for (int i = 0; i < 9; i++)
        a.H.at[i] = expr_add(g, a.H.at[i], b->H.at[i]);
    return a;
}

/* ---- Ball joints ---- */

static bool is_identity(const struct placement *placement) {
    const struct placement identity = placement_identity();
    return !memcmp(placement, &identity, sizeof identity);
}

static int count_children(const struct tree *tree, int i) {
    int children = 0;
    for (int k = i + 1; k < tree->count; k++)
        children += tree->frames[k].parent == i;
    return children;
}

/* Returns whether frame i is a turn that carries only the turn of frame `next`, at the same point and
 * about another axis. */
static bool leads_to(const struct tree *tree, int i, int next) {
    const struct frame *frame = &tree->frames[i], *child = &tree->frames[next];
    return child->parent == i && child->kind == FRAME_JOINT && frame->joint.is_revolute &&
           child->joint.is_revolute && frame->joint.axis != child->joint.axis &&
           inertia_is_zero(&frame->inertia) && is_identity(&child->placement) && count_children(tree, i) == 1;
}

/* Rotors act on coordinates, not on the body after the three turns. */
static bool has_rotor(const struct tree *tree, int first) {
    return tree->frames[first].joint.rotor || tree->frames[first + 1].joint.rotor ||
           tree->frames[first + 2].joint.rotor;
}

static bool is_ball(const struct tree *tree, int first) {
    return first + 2 < tree->count && tree->frames[first].kind == FRAME_JOINT &&
           leads_to(tree, first, first + 1) && leads_to(tree, first + 1, first + 2) &&
           tree->frames[first].joint.axis != tree->frames[first + 2].joint.axis && !has_rotor(tree, first);
}

/* y = L^-1 v */
static struct vector forward_ball(struct graph *g, const struct ball *ball, struct vector v) {
    const expression *L = ball->L;
    v.at[1] = expr_sub(g, v.at[1], expr_mul(g, L[0], v.at[0]));
    v.at[2] = expr_sub(g, expr_sub(g, v.at[2], expr_mul(g, L[1], v.at[0])), expr_mul(g, L[2], v.at[1]));
    return v;
}

/* D^-1 y */
static struct vector scale_ball(struct graph *g, const struct ball *ball, struct vector y) {
    for (int i = 0; i < 3; i++)
        y.at[i] = expr_mul(g, ball->D_inverse[i], y.at[i]);
    return y;
}

/* L^-T z */
static struct vector backward_ball(struct graph *g, const struct ball *ball, struct vector z) {
    const expression *L = ball->L;
    z.at[1] = expr_sub(g, z.at[1], expr_mul(g, L[2], z.at[2]));
    z.at[0] = expr_sub(g, expr_sub(g, z.at[0], expr_mul(g, L[0], z.at[1])), expr_mul(g, L[1], z.at[2]));
    return z;
}

/* J^-1 v */
struct vector articulated_body_solve_ball(struct graph *g, const struct ball *ball, struct vector v) {
    return backward_ball(g, ball, scale_ball(g, ball, forward_ball(g, ball, v)));
}

/*
 * The inverse of the last pivot, zz - yz^2 / yy, as yy / (yy zz - yz^2): rounding is as small, and the
 * division need not wait for the division of the previous pivot.
 */
static expression last_pivot_inverse(struct graph *g, expression yy, expression zz, expression yz) {
    if (!yz)
        return reciprocal(g, zz);
    const expression determinant = expr_sub(g, expr_mul(g, yy, zz), expr_mul(g, yz, yz));
    return expr_mul(g, yy, expr_div(g, EXPR_ONE, determinant));
}

/* J = L D L^T */
static void factor_ball(struct graph *g, const struct tensor *J, struct ball *ball) {
    const expression xx = J->at[0], zz = J->at[2], xy = J->at[3], xz = J->at[4];
    expression yy = J->at[1], yz = J->at[5];
    ball->D_inverse[0] = reciprocal(g, xx);
    ball->L[0] = expr_mul(g, ball->D_inverse[0], xy);
    ball->L[1] = expr_mul(g, ball->D_inverse[0], xz);
    yy = expr_sub(g, yy, expr_mul(g, ball->L[0], xy));
    yz = expr_sub(g, yz, expr_mul(g, ball->L[0], xz));
    ball->D_inverse[1] = reciprocal(g, yy);
    ball->L[2] = expr_mul(g, ball->D_inverse[1], yz);
    ball->D_inverse[2] = last_pivot_inverse(g, yy, expr_sub(g, zz, expr_mul(g, ball->L[1], xz)), yz);
}

/* cos and tilt of theory, sect. 5.3: the first axis in the middle frame. */
static void tilt_ball(const struct kinematics *k, const struct stage *stage, struct ball *ball) {
    const struct tree *tree = k->tree;
    const int first = tree->frames[stage->first].joint.axis, last = tree->frames[stage->last].joint.axis;
    const struct vector axis = kinematics_to_child(k, stage->first + 1, vector_unit(first));
    ball->tilt = axis.at[last];
    ball->cos_inverse = expr_div(k->g, EXPR_ONE, axis.at[first]);
    kinematics_name_scalar(k, stage->first + 1, "cos_inverse", ball->cos_inverse);
}

/*
 * The rotation of all three turns as one matrix, so that a vector needs one product instead of three
 * consecutive ones. Not in loops over elements: there other operations fill the time, and the matrix would
 * have to be stored.
 */
static bool has_turn(const struct kinematics *k, const struct stage *stage) {
    return k->tree->frames[stage->last].run < 0;
}

/* Turns a free vector out of the last frame's axes, turn by turn. */
static struct vector turn_by_turn(const struct kinematics *k, const struct stage *stage, struct vector v) {
    for (int i = stage->last; i >= stage->first; i--)
        v = kinematics_to_parent(k, i, v);
    return v;
}

static void turn_ball(const struct kinematics *k, const struct stage *stage, struct ball *ball) {
    for (int column = 0; column < 3; column++) {
        const struct vector v = turn_by_turn(k, stage, vector_unit(column));
        for (int row = 0; row < 3; row++)
            ball->turn.at[3 * row + column] = v.at[row];
    }
    kinematics_name_matrix(k, stage->last, "turn", &ball->turn);
}

/* A free vector from the last frame's axes to those of the ball joint's carrier, and back. */
static struct vector out_of_ball(const struct kinematics *k, const struct stage *stage, struct vector v) {
    if (has_turn(k, stage))
        return matrix_times(k->g, stage->ball.turn.at, v);
    return turn_by_turn(k, stage, v);
}

static struct vector into_ball(const struct kinematics *k, const struct stage *stage, struct vector v) {
    if (has_turn(k, stage))
        return matrix_transpose_times(k->g, stage->ball.turn.at, v);
    for (int i = stage->first; i <= stage->last; i++)
        v = kinematics_to_child(k, i, v);
    return v;
}

/* A ball joint passes on only M - H^T J^-1 H, from y = L^-1 H and z = D^-1 y: theory, sect. 5.3. */
static struct articulated eliminate_ball(const struct kinematics *k, struct stage *stage,
                                         const struct articulated *beyond) {
    struct graph *g = k->g;
    struct ball *ball = &stage->ball;
    struct articulated rest = {.M = beyond->M};
    factor_ball(g, &beyond->J, ball);
    tilt_ball(k, stage, ball);
    if (has_turn(k, stage))
        turn_ball(k, stage, ball);
    ball->H = beyond->H;
    struct vector y[3], z[3]; /* columns of L^-1 H and D^-1 L^-1 H */
    for (int column = 0; column < 3; column++) {
        y[column] = forward_ball(g, ball, column_of(&beyond->H, column));
        z[column] = scale_ball(g, ball, y[column]);
        const struct vector solved = backward_ball(g, ball, z[column]);
        for (int row = 0; row < 3; row++)
            ball->J_inverse_H.at[3 * row + column] = solved.at[row];
    }
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            expression *entry = &rest.M.at[tensor_index(i, j)];
            for (int row = 0; row < 3; row++)
                *entry = expr_sub(g, *entry, expr_mul(g, y[i].at[row], z[j].at[row]));
        }
    return rest;
}

/* The moment in the joint, in the middle frame: m_last = f_last, m_middle = f_middle, m_first = (f_first -
 * tilt f_last) / cos, since each force is the moment's component along its axis. Theory, sect. 5.3. */
static struct vector ball_moment(const struct kinematics *k, const struct stage *stage, const expression *f) {
    struct graph *g = k->g;
    const struct frame *frames = k->tree->frames;
    const int first = stage->first, middle = first + 1, last = stage->last;
    struct vector moment;
    moment.at[frames[last].joint.axis] = f[last];
    moment.at[frames[middle].joint.axis] = f[middle];
    const expression along = expr_sub(g, f[first], expr_mul(g, stage->ball.tilt, f[last]));
    moment.at[frames[first].joint.axis] = expr_mul(g, along, stage->ball.cos_inverse);
    return moment;
}

/* dw/dt after turn i while its coordinate's acceleration is zero; without references this includes w x e
 * qd. */
static struct vector carry_turn(const struct kinematics *k, int i, bool moves, struct vector wd) {
    const struct vector turned = kinematics_to_child(k, i, wd);
    return moves ? kinematics_gyroscopic(k, i, turned) : turned;
}

/* x_first = delta_first / cos, x_middle = delta_middle, x_last = delta_last - tilt x_first, where delta is
 * the relative angular acceleration in the middle frame: of dw/dt, or of its difference from references on
 * both sides. Theory, sect. 5.3 and 5.5. */
static void ball_coordinates(const struct kinematics *k, const struct stage *stage, bool moves,
                             struct vector inside, struct vector outside, expression *x) {
    struct graph *g = k->g;
    const struct frame *frames = k->tree->frames;
    const int first = stage->first, middle = first + 1, last = stage->last;
    const struct vector none = {{0, 0, 0}}, rate = carry_turn(k, last, moves, none);
    const struct vector carried = carry_turn(k, middle, moves, carry_turn(k, first, moves, inside));
    const struct vector relative =
        vector_sub(g, kinematics_to_parent(k, last, vector_sub(g, outside, rate)), carried);
    x[first] = expr_mul(g, relative.at[frames[first].joint.axis], stage->ball.cos_inverse);
    x[middle] = relative.at[frames[middle].joint.axis];
    x[last] = expr_sub(g, relative.at[frames[last].joint.axis], expr_mul(g, stage->ball.tilt, x[first]));
}

/* ---- The elimination, from the tips ---- */

static void list_stages(const struct kinematics *k, struct elimination *e) {
    const size_t n = (size_t)k->tree->count + 1;
    e->stages = memory_get(k->memory, n * sizeof *e->stages);
    e->ends_stage = memory_get(k->memory, n * sizeof *e->ends_stage);
    for (int i = 0; i < k->tree->count; i++) {
        const int first = i;
        if (k->tree->frames[i].kind != FRAME_JOINT)
            continue;
        i += is_ball(k->tree, i) ? 2 : 0;
        e->stages[i] = (struct stage){.first = first, .last = i};
        e->ends_stage[i] = true;
    }
}

static struct articulated eliminate_stage(const struct kinematics *k, struct stage *stage,
                                          struct articulated own) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[stage->last];
    if (stage->last > stage->first)
        return eliminate_ball(k, stage, &own);
    stage->pivot = pivot_of(g, &frame->joint, &own);
    kinematics_name_scalar(k, stage->last, "D_inverse", stage->pivot.D_inverse);
    kinematics_name_vector(k, stage->last, "U_moment", stage->pivot.U.moment);
    kinematics_name_vector(k, stage->last, "U_force", stage->pivot.U.force);
    eliminate_joint(g, &frame->joint, &stage->pivot, &own);
    return own;
}

static void remark_stage(const struct kinematics *k, const struct stage *stage) {
    const char *name = k->tree->frames[stage->last].name;
    if (stage->last == stage->first)
        kinematics_remark(k, stage->last, "U = IA e, D = e.U, IA - U U^T/D is passed on (5.2)");
    else
        graph_remark(
            k->g, memory_format(k->memory,
                                "%s and the two turns before: J = L D L^T, M - H^T J^-1 H is passed on (5.3)",
                                name));
}

/* IA_i = I_i + the contributions of the children (theory, sect. 5.1). A stage is eliminated at its last
 * frame. Its other frames, and frames without a joint, pass on their sums unchanged. */
static void eliminate_inward(struct elimination *e, int i) {
    const struct kinematics *k = e->k;
    const struct frame *frame = &k->tree->frames[i];
    struct articulated own = e->beyond[i];
    if (e->ends_stage[i]) {
        remark_stage(k, &e->stages[i]);
        const struct inertia inertia = dynamics_own_inertia(k, i);
        const struct articulated rigid_part = rigid(k->g, &inertia);
        own = e->whole[i] = articulated_add(k->g, rigid_part, &e->beyond[i]);
        own = eliminate_stage(k, &e->stages[i], own);
    }
    e->passed[i] = own;
    if (frame->parent < 0)
        return;
    own = articulated_to_parent(k, i, own);
    e->beyond[frame->parent] = articulated_add(k->g, e->beyond[frame->parent], &own);
}

struct elimination *articulated_body_eliminate(const struct kinematics *k) {
    struct elimination *e = memory_get(k->memory, sizeof *e);
    e->k = k;
    e->beyond = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *e->beyond);
    e->whole = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *e->whole);
    e->passed = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *e->passed);
    list_stages(k, e);
    struct recursion recursion = kinematics_recursion(k, e->beyond, sizeof *e->beyond);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);)
        eliminate_inward(e, i);
    return e;
}

static expression wrench_dot(struct graph *g, struct wrench a, struct vector angular, struct vector linear) {
    return expr_add(g, vector_dot(g, a.moment, angular), vector_dot(g, a.force, linear));
}

/* The solution for one right side: wrenches inward, then accelerations outward. Theory, sect. 5.4. */
struct solution {
    const struct kinematics *k;
    const struct elimination *elimination;
    struct right_side side;
    struct wrench *p;                   /* by frame: the sum that everything beyond passes on */
    expression *u;                      /* the remaining force of a joint */
    struct vector *angular_at_rest;     /* J^-1 (m - n_p) of a ball joint, by its last frame */
    struct acceleration *accelerations; /* of each frame */
    expression *x;
};

/* The joint has the remaining force u_i = f_i - e . p and passes on p + U u_i / D: theory, sect. 5.4. */
static struct wrench reduce_joint(const struct kinematics *k, const struct stage *stage, struct wrench p,
                                  struct solution *solution) {
    struct graph *g = k->g;
    const int i = stage->first;
    const struct joint *joint = &k->tree->frames[i].joint;
    const expression felt = joint->is_revolute ? p.moment.at[joint->axis] : p.force.at[joint->axis];
    const expression u = solution->u[i] = expr_sub(g, solution->side.f[i], felt);
    struct wrench through = {vector_scale(g, u, stage->pivot.U_over_D.moment),
                             vector_scale(g, u, stage->pivot.U_over_D.force)};
    through = wrench_add(g, p, through);
    /* Along the joint's own axis this is e . p + u_i (1 - rotor / D) = f_i - u_i rotor / D; without a
     * rotor exactly f_i. */
    (joint->is_revolute ? &through.moment : &through.force)->at[joint->axis] =
        expr_sub(g, solution->side.f[i], expr_mul(g, u, stage->pivot.kept));
    return through;
}

/* The ball joint passes on m and f_p + H^T J^-1 (m - n_p), about the origin of the frame that carries the
 * first turn: theory, sect. 5.3. */
static struct wrench reduce_ball(const struct kinematics *k, const struct stage *stage, struct wrench p,
                                 struct solution *solution) {
    struct graph *g = k->g;
    const struct ball *ball = &stage->ball;
    const int last = stage->last;
    const struct vector moment = ball_moment(k, stage, solution->side.f);
    const struct vector left = vector_sub(g, kinematics_to_child(k, last, moment), p.moment);
    const struct vector turned = articulated_body_solve_ball(g, ball, left);
    const struct vector force = vector_add(g, p.force, matrix_transpose_times(g, ball->H.at, turned));
    solution->angular_at_rest[last] = turned;
    const struct wrench through = {
        kinematics_to_parent(k, stage->first, kinematics_to_parent(k, stage->first + 1, moment)),
        out_of_ball(k, stage, force)};
    return wrench_shift(g, k->joints[stage->first].shift, through);
}

/* The wrench that stage or frame i passes on to its parent. */
static struct wrench reduce(const struct kinematics *k, int i, struct solution *solution) {
    const struct stage *stage = &solution->elimination->stages[i];
    struct wrench p = solution->p[i];
    if (solution->side.loads)
        p = wrench_add(k->g, solution->side.loads[i], p);
    if (!solution->elimination->ends_stage[i])
        return wrench_to_parent(k, i, p);
    kinematics_remark(k, i,
                      stage->last > stage->first ? "m and f_p + H^T J^-1 (m - n_p) are passed on (5.3)"
                                                 : "u = f - e.p, p + U u/D is passed on (5.4)");
    if (stage->last > stage->first)
        return reduce_ball(k, stage, p, solution);
    return wrench_to_parent(k, i, reduce_joint(k, stage, p, solution));
}

static void reduce_inward(struct solution *solution, int i) {
    const struct kinematics *k = solution->k;
    const bool ends = solution->elimination->ends_stage[i];
    const int parent = k->tree->frames[ends ? solution->elimination->stages[i].first : i].parent;
    const struct wrench through = reduce(k, i, solution);
    if (parent >= 0)
        solution->p[parent] = wrench_add(k->g, solution->p[parent], through);
}

/* x_i = (u_i - U . a') / D, where a' is the parent's acceleration moved to this frame; then a = a' + e
 * x_i. Theory, sect. 5.4. */
static struct acceleration accelerate_joint(const struct kinematics *k, const struct stage *stage,
                                            struct acceleration carried, struct solution *solution) {
    struct graph *g = k->g;
    const int i = stage->first;
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct pivot *pivot = &stage->pivot;
    const expression held = wrench_dot(g, pivot->U_over_D, carried.angular, carried.linear);
    const expression x = solution->x[i] = expr_sub(g, expr_mul(g, pivot->D_inverse, solution->u[i]), held);
    const struct reference *references = solution->side.references;
    expression *along = &(joint->is_revolute ? &carried.angular : &carried.linear)->at[joint->axis];
    *along = expr_add(g, *along, x);
    if (references)
        carried.whole = vector_add(g, carried.angular, references[i].angular);
    return carried;
}

/* Acceleration of the origin of frame i while its joint is at rest, in its parent's axes. */
static struct vector carried_origin(const struct kinematics *k, int i, struct acceleration parent) {
    return vector_add(k->g, parent.linear, vector_cross(k->g, parent.angular, k->joints[i].shift));
}

/* a': acceleration of frame i while its joint is at rest. */
static struct acceleration carry_outward(const struct kinematics *k, int i, struct acceleration parent) {
    return (struct acceleration){kinematics_to_child(k, i, parent.angular),
                                 kinematics_to_child(k, i, carried_origin(k, i, parent)),
                                 kinematics_to_child(k, i, parent.whole)};
}

/* wd = J^-1 (m - n_p) - J^-1 H a, relative to the reference wd = 0 (theory, sect. 5.3 and 5.5). `inside`
 * is the acceleration of the joint's carrier. */
static struct acceleration accelerate_ball(const struct kinematics *k, const struct stage *stage,
                                           struct acceleration inside, struct solution *solution) {
    struct graph *g = k->g;
    const struct vector at_rest = solution->angular_at_rest[stage->last];
    const struct vector linear = into_ball(k, stage, carried_origin(k, stage->first, inside));
    const struct vector slowed = matrix_times(g, stage->ball.J_inverse_H.at, linear);
    const struct vector wd = vector_sub(g, at_rest, slowed);
    const bool moves = solution->side.references;
    ball_coordinates(k, stage, moves, moves ? inside.whole : inside.angular, wd, solution->x);
    return (struct acceleration){wd, linear, wd};
}

/* Computes the accelerations of a whole stage at its last frame. */
static void accelerate_outward(struct solution *solution, int i) {
    const struct kinematics *k = solution->k;
    const struct stage *stage = &solution->elimination->stages[i];
    const bool ends = solution->elimination->ends_stage[i];
    const int first = ends ? stage->first : i, parent = k->tree->frames[first].parent;
    const struct acceleration still = {{{0, 0, 0}}, {{0, 0, 0}}, {{0, 0, 0}}};
    const struct acceleration inside = parent < 0 ? still : solution->accelerations[parent];
    if (ends)
        kinematics_remark(k, i,
                          i > first ? "wd = J^-1 (m - n_p) - J^-1 H a (5.3)"
                                    : "x = (u - U.a')/D, a = a' + e x (5.4)");
    struct acceleration own = carry_outward(k, first, inside);
    if (i > first)
        own = accelerate_ball(k, stage, inside, solution);
    else if (ends)
        own = accelerate_joint(k, stage, own, solution);
    solution->accelerations[i] = own;
}

bool articulated_body_ends_ball(const struct elimination *elimination, int i) {
    return elimination->ends_stage[i] && elimination->stages[i].last > elimination->stages[i].first;
}

bool articulated_body_takes_load(const struct elimination *elimination, int i) {
    return elimination->ends_stage[i] || elimination->k->tree->frames[i].kind != FRAME_JOINT;
}

expression *articulated_body_solve(const struct kinematics *k, const struct elimination *elimination,
                                   struct right_side side, struct acceleration **frames) {
    const size_t n = (size_t)k->tree->count + 1;
    struct solution x = {.k = k, .elimination = elimination, .side = side};
    x.p = memory_get(k->memory, n * sizeof *x.p);
    x.u = memory_get(k->memory, n * sizeof *x.u);
    x.angular_at_rest = memory_get(k->memory, n * sizeof *x.angular_at_rest);
    x.accelerations = memory_get(k->memory, n * sizeof *x.accelerations);
    x.x = memory_get(k->memory, n * sizeof *x.x);
    struct recursion inward = kinematics_recursion(k, x.p, sizeof *x.p);
    for (int i = k->tree->count; recursion_inward(&inward, &i);)
        reduce_inward(&x, i);
    struct recursion outward = kinematics_recursion(k, x.accelerations, sizeof *x.accelerations);
    for (int i = -1; recursion_outward(&outward, &i);)
        accelerate_outward(&x, i);
    if (frames)
        *frames = x.accelerations;
    return x.x;
}
