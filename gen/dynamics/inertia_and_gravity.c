/*
 * Mass matrix, bias forces, gravity and energy, from the tips inward (theory, sect. 4.5 to 4.11), and the
 * solution of M x = f with M written out.
 *
 * Input: kinematics. Each function is one recursion of theory, sect. 4 or 5, in the axes of each frame.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

static expression *new_values(const struct kinematics *k, size_t count) {
    return memory_get(k->memory, (count + 1) * sizeof(expression));
}

struct wrench wrench_add(struct graph *g, struct wrench a, struct wrench b) {
    return (struct wrench){vector_add(g, a.moment, b.moment), vector_add(g, a.force, b.force)};
}

static struct inertia body_inertia(const struct kinematics *k, int i) {
    static const char *const moments[3] = {"x", "y", "z"}, *const products[6] = {"xx", "yy", "zz",
                                                                                 "xy", "xz", "yz"};
    const struct frame *frame = &k->tree->frames[i];
    const struct element_run *run = frame->run < 0 ? NULL : &k->tree->runs[frame->run];
    struct inertia inertia = frame->inertia;
    if (!run || !run->last)
        return inertia;
    const struct inertia *last = &run->last[frame->coordinate - run->first];
    const expression is_last = expr_symbol(k->g, SYMBOL_LAST, frame->run, 0);
    inertia.mass = expr_where(k->g, is_last, last->mass, inertia.mass);
    kinematics_name_scalar(k, i, "mass", inertia.mass);
    for (int a = 0; a < 3; a++) {
        inertia.moment.at[a] = expr_where(k->g, is_last, last->moment.at[a], inertia.moment.at[a]);
        kinematics_name_scalar(k, i, memory_format(k->memory, "moment_%s", moments[a]), inertia.moment.at[a]);
    }
    for (int e = 0; e < 6; e++) {
        inertia.tensor.at[e] = expr_where(k->g, is_last, last->tensor.at[e], inertia.tensor.at[e]);
        kinematics_name_scalar(k, i, memory_format(k->memory, "inertia_%s", products[e]),
                               inertia.tensor.at[e]);
    }
    return inertia;
}

struct inertia dynamics_own_inertia(const struct kinematics *k, int i) {
    struct inertia inertia = body_inertia(k, i);
    inertia.moment = kinematics_from_body(k, i, inertia.moment);
    inertia.tensor = kinematics_tensor_from_body(k, i, inertia.tensor);
    return inertia;
}

/* (n + r x f, f) */
struct wrench wrench_shift(struct graph *g, struct vector r, struct wrench w) {
    return (struct wrench){vector_add(g, w.moment, vector_cross(g, r, w.force)), w.force};
}

/* (E^T n + s x E^T f, E^T f): theory, sect. 4.6. */
struct wrench wrench_to_parent(const struct kinematics *k, int i, struct wrench w) {
    const struct wrench turned = {kinematics_to_parent(k, i, w.moment), kinematics_to_parent(k, i, w.force)};
    return wrench_shift(k->g, k->joints[i].shift, turned);
}

/* e . wrench: the component that acts on the joint's coordinate. */
static expression on_joint(const struct kinematics *k, int i, struct wrench w) {
    const struct joint *joint = &k->tree->frames[i].joint;
    return joint->is_revolute ? w.moment.at[joint->axis] : w.force.at[joint->axis];
}

/* The summands of a sum over everything beyond a joint, and the names of its values. */
struct inward_sum {
    struct wrench (*own)(const struct kinematics *k, int i);
    const char *moment_name, *force_name, *what;
};

/* F_i = own wrench + sum of F of the children, moved to joint i; e_i . F_i: theory, sect. 4.7. */
static expression *sum_inward(const struct kinematics *k, const struct inward_sum *x) {
    const size_t n = (size_t)k->tree->count + 1;
    struct wrench *sums = memory_get(k->memory, n * sizeof *sums);
    expression *felt = new_values(k, n);
    struct recursion recursion = kinematics_recursion(k, sums, sizeof *sums);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        kinematics_remark(k, i, x->what);
        if (frame->kind == FRAME_JOINT) {
            sums[i] = wrench_add(k->g, x->own(k, i), sums[i]);
            kinematics_name_vector(k, i, x->moment_name, sums[i].moment);
            kinematics_name_vector(k, i, x->force_name, sums[i].force);
            felt[i] = on_joint(k, i, sums[i]);
        }
        if (frame->parent >= 0)
            sums[frame->parent] = wrench_add(k->g, sums[frame->parent], wrench_to_parent(k, i, sums[i]));
    }
    return felt;
}

/*
 * w x J w from products of the components of w, which B needs anyway; terms of two equal principal moments
 * vanish. Theory, sect. 4.7.
 */
static struct vector gyroscopic_moment(struct graph *g, struct tensor J, struct vector w) {
    struct vector moment;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        const expression jl = J.at[tensor_index(j, l)], il = J.at[tensor_index(i, l)],
                         ij = J.at[tensor_index(i, j)];
        const expression square = expr_sub(g, expr_mul(g, w.at[j], w.at[j]), expr_mul(g, w.at[l], w.at[l]));
        const expression own = expr_mul(g, expr_sub(g, J.at[l], J.at[j]), expr_mul(g, w.at[j], w.at[l]));
        const expression products = expr_sub(g, expr_mul(g, il, expr_mul(g, w.at[i], w.at[j])),
                                             expr_mul(g, ij, expr_mul(g, w.at[i], w.at[l])));
        moment.at[i] = expr_add(g, expr_add(g, own, expr_mul(g, jl, square)), products);
    }
    return moment;
}

/* n = J wd + w x J w + mc x a, f = m a + B mc: theory, sect. 4.7. */
struct wrench wrench_of_inertia(const struct kinematics *k, int i, struct vector wd,
                                const struct matrix *gradient, struct vector a) {
    struct graph *g = k->g;
    const struct inertia own = dynamics_own_inertia(k, i), *inertia = &own;
    const struct vector mc = inertia->moment;
    const struct tensor J = inertia->tensor;
    const struct vector spin = gyroscopic_moment(g, J, k->frames[i].angular);
    const struct vector turn = vector_add(g, tensor_times(g, J, wd), spin);
    const struct vector around = matrix_times(g, gradient->at, mc);
    return (struct wrench){vector_add(g, turn, vector_cross(g, mc, a)),
                           vector_add(g, vector_scale(g, inertia->mass, a), around)};
}

static struct wrench bias_wrench(const struct kinematics *k, int i) {
    const struct frame_motion *m = &k->frames[i];
    return wrench_of_inertia(k, i, m->bias_angular, &m->gradient, m->bias_linear);
}

static struct wrench less_gravity_wrench(const struct kinematics *k, int i) {
    const struct frame_motion *m = &k->frames[i];
    return wrench_of_inertia(k, i, m->bias_angular, &m->gradient, m->bias_less_gravity);
}

struct wrench *dynamics_loads(const struct kinematics *k, const struct reference *references) {
    struct wrench *loads = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *loads);
    for (int i = -1; recursion_next_joint(k->g, k->tree, &i);) {
        const struct reference *reference = &references[i];
        kinematics_remark(k, i, "load l = wrench of I at wdr, ar (4.7, 5.5)");
        loads[i] = wrench_of_inertia(k, i, reference->angular, &reference->gradient, reference->linear);
        kinematics_name_vector(k, i, "load_moment", loads[i].moment);
        kinematics_name_vector(k, i, "load_force", loads[i].force);
    }
    return loads;
}

expression *dynamics_bias_forces(const struct kinematics *k, bool less_gravity) {
    static const struct inward_sum bias = {bias_wrench, "bias_moment", "bias_force",
                                           "c = e.F, F = wrench of I at wd0, a0, and all beyond (4.7)"};
    static const struct inward_sum carried = {
        less_gravity_wrench, "carried_moment", "carried_force",
        "c + g = e.F, F = wrench of I at wd0, a0 - grav, and all beyond (4.7)"};
    return sum_inward(k, less_gravity ? &carried : &bias);
}

/* About the parent's origin, s away: mc + m s, J + (2 mc.s 1 - mc s^T - s mc^T) + m (s.s 1 - s s^T): theory,
 * sect. 4.5. */
static struct inertia inertia_to_parent(const struct kinematics *k, int i, const struct inertia *inner) {
    struct inertia turned = {.mass = inner->mass};
    struct placement shift = placement_identity();
    turned.moment = kinematics_to_parent(k, i, inner->moment);
    turned.tensor = kinematics_tensor_to_parent(k, i, inner->tensor);
    memcpy(shift.position, k->joints[i].shift.at, sizeof shift.position);
    return inertia_place(k->g, &shift, turned);
}

static void name_composite(const struct kinematics *k, int i, const struct inertia *composite) {
    static const char *const names[6] = {"inertia_beyond_xx", "inertia_beyond_yy", "inertia_beyond_zz",
                                         "inertia_beyond_xy", "inertia_beyond_xz", "inertia_beyond_yz"};
    kinematics_name_scalar(k, i, "mass_beyond", composite->mass);
    kinematics_name_vector(k, i, "moment_beyond", composite->moment);
    for (int e = 0; e < 6; e++)
        kinematics_name_scalar(k, i, names[e], composite->tensor.at[e]);
}

/* W = (J e, e x mc) of a revolute joint, (mc x e, m e) of a prismatic one: theory, sect. 4.6. */
struct wrench wrench_of_unit(const struct kinematics *k, int i, const struct inertia *beyond) {
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct vector axis = vector_unit(joint->axis), mc = beyond->moment;
    if (joint->is_revolute)
        return (struct wrench){tensor_times(g, beyond->tensor, axis), vector_cross(g, axis, mc)};
    return (struct wrench){vector_cross(g, mc, axis), vector_scale(g, beyond->mass, axis)};
}

/* M_ij = e_j . W_i, with W_i moved from joint to joint, and the rotor's inertia in M_ii (theory, sect.
 * 4.6). Each column follows its composite directly: few later values read it, and compilers then keep less
 * in registers. */
static void derive_column(const struct kinematics *k, const struct inertia *composites, int i,
                          expression *M) {
    const int n = k->tree->count;
    kinematics_remark(k, i, "its column of M, e_j.W, W = Ic e moved to joint j (4.6)");
    struct wrench wrench = wrench_of_unit(k, i, &composites[i]);
    for (int j = i; j >= 0; j = k->tree->frames[j].parent) {
        M[i * n + j] = M[j * n + i] = on_joint(k, j, wrench);
        wrench = wrench_to_parent(k, j, wrench);
    }
    M[i * n + i] = expr_add(k->g, M[i * n + i], k->tree->frames[i].joint.rotor);
}

/* Ic_i = I_i + sum of Ic of the children, moved to frame i: theory, sect. 4.5. */
struct inertia *dynamics_composite_inertias(const struct kinematics *k, expression *M) {
    struct inertia *composites = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *composites);
    struct recursion recursion = kinematics_recursion(k, composites, sizeof *composites);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        struct inertia *outer = &composites[frame->parent < 0 ? k->tree->count : frame->parent];
        kinematics_remark(k, i, "Ic = I + Ic of all that it carries (4.5)");
        if (frame->kind == FRAME_JOINT) {
            composites[i] = inertia_add(k->g, dynamics_own_inertia(k, i), composites[i]);
            name_composite(k, i, &composites[i]);
        }
        *outer = inertia_add(k->g, *outer, inertia_to_parent(k, i, &composites[i]));
        if (M)
            derive_column(k, composites, i, M);
    }
    return composites;
}

/* g_i = -e_i . (mc x grav, m grav) with m, mc of the composite: theory, sect. 4.8. */
expression *dynamics_gravity_forces(const struct kinematics *k, const struct inertia *composites) {
    expression *forces = new_values(k, (size_t)k->tree->count);
    for (int i = -1; recursion_next_joint(k->g, k->tree, &i);) {
        const struct vector field = k->frames[i].gravity;
        const struct vector moment = vector_cross(k->g, composites[i].moment, field);
        const struct wrench weight = {moment, vector_scale(k->g, composites[i].mass, field)};
        kinematics_remark(k, i, "g = -e.(mc x grav, m grav) of Ic (4.8)");
        forces[i] = expr_neg(k->g, on_joint(k, i, weight));
    }
    return forces;
}

/*
 * dg_i/dq_j = -(grav x e_i) . Delta_j for a revolute i on the way from j to the ground, where Delta_j is the
 * change of the mass moment beyond joint j by q_j: theory, sect. 4.8. In the ground frame nothing is moved
 * from joint to joint.
 */
expression *dynamics_gravity_tangent(const struct kinematics *k, const struct inertia *composites) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct vector gravity = vector_of(k->model->gravity);
    expression *tangent = new_values(k, (size_t)n * (size_t)n);
    struct vector *levers = memory_get(k->memory, ((size_t)n + 1) * sizeof *levers);
    for (int j = 0; j < n; j++) {
        kinematics_remark(k, j, "dg_i/dq = -(grav x e_i).Delta (4.8)");
        const struct vector own = wrench_of_unit(k, j, &composites[j]).force;
        const struct vector change = matrix_times(g, k->frames[j].rotation.at, own);
        levers[j] = vector_cross(g, gravity, kinematics_joint_axis(k, j));
        kinematics_name_vector(k, j, "gravity_lever", levers[j]);
        kinematics_name_vector(k, j, "moment_change", change);
        for (int i = j; i >= 0; i = k->tree->frames[i].parent)
            if (k->tree->frames[i].joint.is_revolute)
                tangent[i * n + j] = tangent[j * n + i] = expr_neg(g, vector_dot(g, levers[i], change));
    }
    return tangent;
}

/* (L, p) about the frame's origin: L = J w + mc x v, p = m v + w x mc. Theory, sect. 4.10. */
static struct wrench momentum(const struct kinematics *k, int i) {
    struct graph *g = k->g;
    const struct inertia own = dynamics_own_inertia(k, i), *inertia = &own;
    const struct frame_motion *m = &k->frames[i];
    const struct vector mc = inertia->moment;
    const struct vector turn = tensor_times(g, inertia->tensor, m->angular);
    return (struct wrench){
        vector_add(g, turn, vector_cross(g, mc, m->linear)),
        vector_add(g, vector_scale(g, inertia->mass, m->linear), vector_cross(g, m->angular, mc))};
}

/*
 * s_i = dEk/dq_i = (w x e) . L + (v x e) . p of a revolute joint, (w x e) . p of a prismatic one: theory,
 * sect. 4.11. With the momentum p_i = X_i . L of coordinate i, dp_i/dt = dX_i/dt . L + X_i . dL/dt, and at
 * qdd = 0 dp_i/dt - dEk/dq_i = c_i = X_i . dL/dt, so that dEk/dq_i = dX_i/dt . L.
 */
static expression printed_term(const struct kinematics *k, int i, struct wrench L) {
    struct graph *g = k->g;
    const struct frame_motion *m = &k->frames[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct vector axis = vector_unit(joint->axis), turning = vector_cross(g, m->angular, axis);
    if (!joint->is_revolute)
        return vector_dot(g, turning, L.force);
    const expression shifting = vector_dot(g, vector_cross(g, m->linear, axis), L.force);
    return expr_add(g, vector_dot(g, turning, L.moment), shifting);
}

expression *dynamics_printed_sum(const struct kinematics *k) {
    const size_t n = (size_t)k->tree->count + 1;
    struct wrench *momenta = memory_get(k->memory, n * sizeof *momenta);
    expression *s = new_values(k, n);
    struct recursion recursion = kinematics_recursion(k, momenta, sizeof *momenta);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        kinematics_remark(k, i, "s = (w x e).L + (v x e).p of all beyond (4.11)");
        if (frame->kind == FRAME_JOINT) {
            momenta[i] = wrench_add(k->g, momenta[i], momentum(k, i));
            s[i] = printed_term(k, i, momenta[i]);
        }
        if (frame->parent >= 0)
            momenta[frame->parent] =
                wrench_add(k->g, momenta[frame->parent], wrench_to_parent(k, i, momenta[i]));
    }
    return s;
}

/* Twice the energy is the sum of v . p + w . L of all bodies and of rotor qd^2: theory, sect. 4.10. States
 * have none. */
static expression rotor_term(const struct kinematics *k, int i) {
    if (k->tree->frames[i].is_state)
        return EXPR_ZERO;
    const expression rate = kinematics_coordinate_of(k, i, 1);
    return expr_mul(k->g, expr_mul(k->g, k->tree->frames[i].joint.rotor, rate), rate);
}

expression dynamics_kinetic_energy(const struct kinematics *k) {
    struct graph *g = k->g;
    struct recursion twice = recursion_sum(k->memory, g, k->tree);
    graph_remark(g, "2 Ek = sum of v.p + w.L (4.10)");
    for (int i = -1; recursion_next_term(&twice, &i);) {
        const struct wrench L = momentum(k, i);
        const expression turning = vector_dot(g, k->frames[i].angular, L.moment);
        const expression moving = vector_dot(g, k->frames[i].linear, L.force);
        recursion_add_term(&twice, i, expr_add(g, expr_add(g, moving, turning), rotor_term(k, i)));
    }
    return expr_mul(g, expr_number(g, 0.5), recursion_total(&twice));
}

/* Ep = -grav . mc of all that moves, in the ground frame. */
expression dynamics_gravity_energy(const struct kinematics *k, const struct inertia *composites) {
    const struct inertia *all = &composites[k->tree->count];
    graph_remark(k->g, "Ep = -grav.(mc of all) + springs, zero at the ground's origin (4.10)");
    return expr_neg(k->g, vector_dot(k->g, vector_of(k->model->gravity), all->moment));
}

/* ---- Factors of the mass matrix ---- */

/*
 * M = L^T D L, then substitutions (theory, sect. 5.7; Featherstone, Rigid Body Dynamics Algorithms, 2008,
 * sect. 6.5).
 *
 * Input: M and right sides f. Result: x. M_ij is zero unless one of both joints carries the other. The
 * factorisation proceeds from the tips inward, so that L has no entry where M has none. For trees without
 * loops over equal elements.
 */

struct factors {
    const struct kinematics *k;
    expression *L;         /* n x n, L_ij for j nearer to the ground; its diagonal of ones is not stored */
    expression *D_inverse; /* by coordinate */
};

static int parent_of(const struct factors *x, int i) {
    return x->k->tree->frames[i].parent;
}

/* 1 / D_i = 1 / M_ii, L_ij = M_ij / D_i, M_jl -= L_ij M_il for j, l on the way from i to the ground. */
static void eliminate_row(struct factors *x, expression *M, int i) {
    struct graph *g = x->k->g;
    const int n = x->k->tree->count;
    x->D_inverse[i] = expr_div(g, EXPR_ONE, M[i * n + i]);
    kinematics_name_scalar(x->k, i, "pivot_inverse", x->D_inverse[i]);
    for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j)) {
        const expression ratio = x->L[i * n + j] = expr_mul(g, M[i * n + j], x->D_inverse[i]);
        for (int l = j; l >= 0; l = parent_of(x, l))
            M[j * n + l] = expr_sub(g, M[j * n + l], expr_mul(g, ratio, M[i * n + l]));
    }
}

struct factors *mass_factor(const struct kinematics *k, const expression *mass_matrix) {
    const size_t n = (size_t)k->tree->count, size = n * n * sizeof(expression);
    struct factors *x = memory_get(k->memory, sizeof *x);
    x->k = k;
    x->L = memory_get(k->memory, size + sizeof *x->L);
    x->D_inverse = memory_get(k->memory, (n + 1) * sizeof *x->D_inverse);
    expression *rest = memory_grow(k->memory, mass_matrix, size, size + sizeof *rest);
    for (int i = k->tree->count - 1; i >= 0; i--) {
        kinematics_remark(k, i, "its row of M = L^T D L (5.7)");
        eliminate_row(x, rest, i);
    }
    return x;
}

/* y = L^-T f and z = D^-1 y inward, x = L^-1 z outward. */
expression *mass_factor_solve(const struct factors *x, const expression *f) {
    struct graph *g = x->k->g;
    const int n = x->k->tree->count;
    const size_t size = (size_t)n * sizeof *f;
    expression *solution = memory_grow(x->k->memory, f, size, size + sizeof *f);
    graph_remark(g, "L^T D L x = f (5.7)");
    for (int i = n - 1; i >= 0; i--) {
        for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j))
            solution[j] = expr_sub(g, solution[j], expr_mul(g, x->L[i * n + j], solution[i]));
        solution[i] = expr_mul(g, x->D_inverse[i], solution[i]);
    }
    for (int i = 0; i < n; i++)
        for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j))
            solution[i] = expr_sub(g, solution[i], expr_mul(g, x->L[i * n + j], solution[j]));
    return solution;
}

long mass_factor_operations(const struct tree *tree) {
    long operations = 0;
    for (int i = 0; i < tree->count; i++) {
        long depth = 0;
        for (int j = tree->frames[i].parent; j >= 0; j = tree->frames[j].parent)
            depth++;
        operations += depth * (depth + 1);
    }
    return operations;
}
