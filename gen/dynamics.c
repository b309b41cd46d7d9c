/* Mass matrix, bias forces, gravity and energy from the tips inward: see dynamics.h. */
#include "dynamics.h"
#include "memory.h"

#include <string.h>

static expression *new_values(const struct kinematics *k, size_t count) {
    return memory_get(k->memory, (count + 1) * sizeof(expression));
}

static struct tensor tensor_of(const expression at[6]) {
    struct tensor t;
    memcpy(t.at, at, sizeof t.at);
    return t;
}

struct wrench wrench_add(struct graph *g, struct wrench a, struct wrench b) {
    return (struct wrench){vector_add(g, a.moment, b.moment), vector_add(g, a.force, b.force)};
}

/* About the parent's origin: force f, moment m + r x f. */
struct wrench wrench_to_parent(const struct kinematics *k, int i, struct wrench w) {
    const struct vector force = to_parent(k, i, w.force);
    const struct vector moment = to_parent(k, i, w.moment);
    return (struct wrench){vector_add(k->g, moment, vector_cross(k->g, k->frames[i].shift, force)), force};
}

/* The part of a wrench that the joint's coordinate feels. */
static expression on_joint(const struct kinematics *k, int i, struct wrench w) {
    const struct joint *joint = &k->tree->frames[i].joint;
    return joint->is_turn ? w.moment.at[joint->axis] : w.force.at[joint->axis];
}

/* Sum over all bodies beyond each joint of `own`, felt by the joint's coordinate. */
static expression *sum_inward(const struct kinematics *k,
                              struct wrench (*own)(const struct kinematics *k, int i),
                              const char *moment_name, const char *force_name, const char *what) {
    const int n = k->tree->count;
    struct wrench *sums = memory_get(k->memory, ((size_t)n + 1) * sizeof *sums);
    expression *felt = new_values(k, (size_t)n);
    for (int i = n - 1; i >= 0; i--) {
        const int parent = k->tree->frames[i].parent;
        remark(k->g, memory_format(k->memory, "%s: %s, inward", k->tree->frames[i].name, what));
        const struct wrench sum = wrench_add(k->g, own(k, i), sums[i]);
        name_vector(k, i, moment_name, sum.moment);
        name_vector(k, i, force_name, sum.force);
        felt[i] = on_joint(k, i, sum);
        if (parent >= 0)
            sums[parent] = wrench_add(k->g, sums[parent], wrench_to_parent(k, i, sum));
    }
    return felt;
}

/* Inertia, moment wd J + w x J w + mc x a and force m a + wd x mc + w x (w x mc) for the acceleration a. */
static struct wrench inertia_wrench(const struct kinematics *k, int i, struct vector a) {
    struct graph *g = k->g;
    const struct inertia *inertia = &k->tree->frames[i].inertia;
    const struct frame_motion *m = &k->frames[i];
    const struct vector mc = vector_of(inertia->moment);
    const struct tensor J = tensor_of(inertia->tensor);
    const struct vector spin = vector_cross(g, m->angular, tensor_times(g, J, m->angular));
    const struct vector turn = vector_add(g, tensor_times(g, J, m->bias_angular), spin);
    const struct vector swing = vector_cross(g, m->angular, vector_cross(g, m->angular, mc));
    const struct vector around = vector_add(g, vector_cross(g, m->bias_angular, mc), swing);
    return (struct wrench){vector_add(g, turn, vector_cross(g, mc, a)),
                           vector_add(g, vector_scale(g, inertia->mass, a), around)};
}

static struct wrench bias_wrench(const struct kinematics *k, int i) {
    return inertia_wrench(k, i, k->frames[i].bias_linear);
}

static struct wrench falling_wrench(const struct kinematics *k, int i) {
    return inertia_wrench(k, i, k->frames[i].bias_falling);
}

struct wrench *derive_loads(const struct kinematics *k) {
    struct wrench *loads = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *loads);
    for (int i = 0; i < k->tree->count; i++) {
        remark(k->g, memory_format(k->memory, "%s: inertia and gravity of the body at qdd = 0",
                                   k->tree->frames[i].name));
        loads[i] = falling_wrench(k, i);
        name_vector(k, i, "load_moment", loads[i].moment);
        name_vector(k, i, "load_force", loads[i].force);
    }
    return loads;
}

expression *derive_bias_forces(const struct kinematics *k, bool falling) {
    if (falling)
        return sum_inward(k, falling_wrench, "carried_moment", "carried_force",
                          "bias and gravity forces c + g");
    return sum_inward(k, bias_wrench, "bias_moment", "bias_force", "bias forces c");
}

static struct inertia inertia_to_parent(const struct kinematics *k, int i, const struct inertia *inner) {
    struct inertia turned = {.mass = inner->mass};
    struct placement shift = placement_identity();
    const struct vector moment = to_parent(k, i, vector_of(inner->moment));
    const struct tensor tensor = tensor_to_parent(k, i, tensor_of(inner->tensor));
    memcpy(turned.moment, moment.at, sizeof turned.moment);
    memcpy(turned.tensor, tensor.at, sizeof turned.tensor);
    memcpy(shift.position, k->frames[i].shift.at, sizeof shift.position);
    return inertia_place(k->g, &shift, turned);
}

struct inertia *derive_composites(const struct kinematics *k) {
    const int n = k->tree->count;
    struct inertia *composites = memory_get(k->memory, ((size_t)n + 1) * sizeof *composites);
    for (int i = n - 1; i >= 0; i--) {
        const int parent = k->tree->frames[i].parent;
        struct inertia *outer = &composites[parent < 0 ? n : parent];
        remark(k->g, memory_format(k->memory, "%s: composite pseudo-inertia of all beyond, inward",
                                   k->tree->frames[i].name));
        composites[i] = inertia_add(k->g, k->tree->frames[i].inertia, composites[i]);
        name_scalar(k, i, "mass_beyond", composites[i].mass);
        name_vector(k, i, "moment_beyond", vector_of(composites[i].moment));
        for (int e = 0; e < 6; e++) {
            static const char *const names[6] = {"inertia_beyond_xx", "inertia_beyond_yy",
                                                 "inertia_beyond_zz", "inertia_beyond_xy",
                                                 "inertia_beyond_xz", "inertia_beyond_yz"};
            name_scalar(k, i, names[e], composites[i].tensor[e]);
        }
        *outer = inertia_add(k->g, *outer, inertia_to_parent(k, i, &composites[i]));
    }
    return composites;
}

struct wrench unit_wrench(const struct kinematics *k, int i, const struct inertia *beyond) {
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct vector axis = unit_vector(g, joint->axis), mc = vector_of(beyond->moment);
    if (joint->is_turn)
        return (struct wrench){tensor_times(g, tensor_of(beyond->tensor), axis), vector_cross(g, axis, mc)};
    return (struct wrench){vector_cross(g, mc, axis), vector_scale(g, beyond->mass, axis)};
}

expression *derive_mass_matrix(const struct kinematics *k, const struct inertia *composites) {
    const int n = k->tree->count;
    expression *M = new_values(k, (size_t)n * (size_t)n);
    for (int i = 0; i < n; i++) {
        remark(k->g,
               memory_format(k->memory, "%s: column of M, M_ij = tr{X_i Hc_k X_j^T} on the way to the ground",
                             k->tree->frames[i].name));
        struct wrench wrench = unit_wrench(k, i, &composites[i]);
        for (int j = i; j >= 0; j = k->tree->frames[j].parent) {
            M[i * n + j] = M[j * n + i] = on_joint(k, j, wrench);
            wrench = wrench_to_parent(k, j, wrench);
        }
    }
    return M;
}

/* g_i: what gravity's field does to the composite moment beyond joint i, with the sign of dEp/dq. */
expression *derive_gravity_forces(const struct kinematics *k, const struct inertia *composites) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    expression *forces = new_values(k, (size_t)n);
    for (int i = 0; i < n; i++) {
        const struct vector field = k->frames[i].gravity;
        const struct vector moment = vector_cross(g, vector_of(composites[i].moment), field);
        const struct wrench weight = {moment, vector_scale(g, composites[i].mass, field)};
        remark(g, memory_format(k->memory, "%s: gravity g = -grav^T X sum(T H e4)", k->tree->frames[i].name));
        forces[i] = neg(g, on_joint(k, i, weight));
    }
    return forces;
}

/*
 * For i on the way from j to the ground, i a turn: g_i,j = -(grav x e_i) . (change of the moment beyond by
 * q_j), all in the ground frame, where nothing has to be carried from joint to joint.
 */
expression *derive_gravity_tangent(const struct kinematics *k, const struct inertia *composites) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct vector gravity = vector_of(k->model->gravity);
    expression *tangent = new_values(k, (size_t)n * (size_t)n);
    struct vector *levers = memory_get(k->memory, ((size_t)n + 1) * sizeof *levers);
    for (int j = 0; j < n; j++) {
        remark(g,
               memory_format(k->memory, "%s: column of the gravity tangent g_i,j", k->tree->frames[j].name));
        const struct vector own = unit_wrench(k, j, &composites[j]).force;
        const struct vector change = matrix_times(g, k->frames[j].rotation.at, own);
        levers[j] = vector_cross(g, gravity, joint_axis(k, j));
        name_vector(k, j, "gravity_lever", levers[j]);
        name_vector(k, j, "moment_change", change);
        for (int i = j; i >= 0; i = k->tree->frames[i].parent)
            if (k->tree->frames[i].joint.is_turn)
                tangent[i * n + j] = tangent[j * n + i] = neg(g, vector_dot(g, levers[i], change));
    }
    return tangent;
}

/* Momentum about the frame's origin: force slot m v + w x mc, moment slot J w + mc x v. */
static struct wrench momentum(const struct kinematics *k, int i) {
    struct graph *g = k->g;
    const struct inertia *inertia = &k->tree->frames[i].inertia;
    const struct frame_motion *m = &k->frames[i];
    const struct vector mc = vector_of(inertia->moment);
    const struct vector turn = tensor_times(g, tensor_of(inertia->tensor), m->angular);
    return (struct wrench){
        vector_add(g, turn, vector_cross(g, mc, m->linear)),
        vector_add(g, vector_scale(g, inertia->mass, m->linear), vector_cross(g, m->angular, mc))};
}

/*
 * s_i = dEk/dq_i = (rate of change of joint axis i) . (momentum beyond i): with p_i = X_i . L, dp_i/dt =
 * dX_i/dt . L + X_i . dL/dt and, at qdd = 0, dp_i/dt - dEk/dq_i = c_i = X_i . dL/dt.
 */
expression *derive_printed_sum(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    struct wrench *sums = memory_get(k->memory, ((size_t)n + 1) * sizeof *sums);
    expression *s = new_values(k, (size_t)n);
    for (int i = n - 1; i >= 0; i--) {
        const struct frame_motion *m = &k->frames[i];
        const struct joint *joint = &k->tree->frames[i].joint;
        const int parent = k->tree->frames[i].parent;
        const struct vector axis = unit_vector(g, joint->axis);
        remark(g, memory_format(k->memory, "%s: s = sum tr{T_m H T_in^T} qd_m qd_n, inward",
                                k->tree->frames[i].name));
        const struct wrench L = wrench_add(g, sums[i], momentum(k, i));
        const struct vector turning = vector_cross(g, m->angular, axis);
        if (joint->is_turn)
            s[i] = add(g, vector_dot(g, turning, L.moment),
                       vector_dot(g, vector_cross(g, m->linear, axis), L.force));
        else
            s[i] = vector_dot(g, turning, L.force);
        if (parent >= 0)
            sums[parent] = wrench_add(g, sums[parent], wrench_to_parent(k, i, L));
    }
    return s;
}

/* Ek = 1/2 sum (v . p + w . L) over the bodies. */
expression derive_kinetic_energy(const struct kinematics *k) {
    struct graph *g = k->g;
    expression twice = 0;
    remark(g, "kinetic energy");
    for (int i = 0; i < k->tree->count; i++) {
        const struct wrench L = momentum(k, i);
        twice = add(g, twice, vector_dot(g, k->frames[i].linear, L.force));
        twice = add(g, twice, vector_dot(g, k->frames[i].angular, L.moment));
    }
    return mul(g, number(g, 0.5), twice);
}

expression derive_gravity_energy(const struct kinematics *k, const struct inertia *composites) {
    const struct inertia *all = &composites[k->tree->count];
    remark(k->g, "potential energy of gravity, zero at the ground's origin");
    return neg(k->g, vector_dot(k->g, vector_of(k->model->gravity), vector_of(all->moment)));
}
