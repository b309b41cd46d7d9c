/* Applied forces: see forces.h. */
#include "forces.h"
#include "memory.h"
#include "recursion.h"
#include "sensitivity.h"

#include <string.h>

/* All that the author names, brought to forces on coordinates and loads at points; still in symbols. */
struct named_forces {
    struct force *forces; /* `coordinate` is the frame */
    struct load *loads;
    int force_count, load_count;
    int own_forces, own_loads; /* the first ones are the author's own, the others come from energies */
};

static expression *new_values(const struct kinematics *k, size_t count) {
    return memory_get(k->memory, (count + 1) * sizeof(expression));
}

static expression rate(const struct kinematics *k, int i) {
    return coordinate_of(k, i, 1);
}

static expression stretch(const struct kinematics *k, int i) {
    return sub(k->g, coordinate_of(k, i, 0), k->tree->frames[i].joint.rest);
}

/* -dV/dq_j and -dV/dr */
static void add_energy(const struct kinematics *k, const struct potential *potential,
                       struct named_forces *named) {
    const int n = k->tree->count;
    const expression *slope = symbol_gradient(k, potential->energy, 0);
    for (int j = 0; j < n; j++)
        if (slope[j])
            named->forces[named->force_count++] =
                (struct force){.coordinate = j, .value = neg(k->g, slope[j]), .place = potential->place};
    for (int p = 0; p < k->model->marker_count; p++) {
        const struct vector pull = vector_scale(k->g, neg(k->g, one(k->g)), vector_of(slope + n + 3 * p));
        struct load load = {.point = p, .place = potential->place};
        memcpy(load.value, pull.at, sizeof load.value);
        if (!vector_is_zero(pull))
            named->loads[named->load_count++] = load;
    }
}

static struct named_forces collect(const struct kinematics *k) {
    const struct model *model = k->model;
    const size_t energies = (size_t)model->potential_count;
    const size_t forces = (size_t)model->force_count + energies * (size_t)k->tree->count;
    const size_t loads = (size_t)model->load_count + energies * (size_t)model->marker_count;
    struct named_forces named = {.force_count = model->force_count,
                                 .load_count = model->load_count,
                                 .own_forces = model->force_count,
                                 .own_loads = model->load_count};
    named.forces = memory_grow(k->memory, model->forces, (size_t)model->force_count * sizeof *named.forces,
                               (forces + 1) * sizeof *named.forces);
    named.loads = memory_grow(k->memory, model->loads, (size_t)model->load_count * sizeof *named.loads,
                              (loads + 1) * sizeof *named.loads);
    for (int i = 0; i < model->force_count; i++)
        named.forces[i].coordinate = k->tree->frame_of[model->forces[i].coordinate];
    for (int i = 0; i < model->potential_count; i++)
        add_energy(k, &model->potentials[i], &named);
    return named;
}

/* How the load's point of attack, or its body's orientation, moves with coordinate j. */
static struct vector load_column(const struct kinematics *k, const struct load *load, int j) {
    const struct vector still = {{0, 0, 0}}, column = k->points[load->point].columns[j];
    if (!load->is_torque)
        return column;
    for (int i = k->tree->points[load->point].frame; i >= 0; i = k->tree->frames[i].parent)
        if (i == j && k->tree->frames[i].joint.is_turn)
            return joint_axis(k, i);
    return still;
}

struct application {
    const struct kinematics *k;
    struct named_forces named;
    struct vector *F; /* by load, in terms of the coordinates */
    struct applied applied;
};

/* Springs and dampers of frame j, forces that name it, and Q_j += F . column_j. */
static void apply_forces(void *context, int j) {
    const struct application *x = context;
    const struct kinematics *k = x->k;
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[j].joint;
    expression *conservative = &x->applied.conservative[j], *others = &x->applied.others[j];
    *conservative = neg(g, mul(g, joint->stiffness, stretch(k, j)));
    *others = neg(g, mul(g, joint->damping, rate(k, j)));
    for (int f = 0; f < x->named.force_count; f++) {
        expression *into = f < x->named.own_forces ? others : conservative;
        if (x->named.forces[f].coordinate == j)
            *into = add(g, *into, with_points(k, x->named.forces[f].value));
    }
    for (int l = 0; l < x->named.load_count; l++) {
        expression *into = l < x->named.own_loads ? others : conservative;
        *into = add(g, *into, vector_dot(g, x->F[l], load_column(k, &x->named.loads[l], j)));
    }
}

struct applied derive_applied_forces(const struct kinematics *k) {
    const size_t n = (size_t)k->tree->count;
    struct application x = {k, collect(k), NULL, {new_values(k, n), new_values(k, n)}};
    remark(k->g, "springs -s (q - rest), dampers -d qd, and forces that the model names");
    x.F = memory_get(k->memory, ((size_t)x.named.load_count + 1) * sizeof *x.F);
    for (int l = 0; l < x.named.load_count; l++)
        for (int a = 0; a < 3; a++)
            x.F[l].at[a] = with_points(k, x.named.loads[l].value[a]);
    visit_joints(k->g, k->tree, apply_forces, &x);
    return x.applied;
}

static expression spring_energy(void *context, int i) {
    const struct kinematics *k = context;
    const expression half = mul(k->g, number(k->g, 0.5), k->tree->frames[i].joint.stiffness);
    return mul(k->g, half, mul(k->g, stretch(k, i), stretch(k, i)));
}

expression derive_applied_energy(const struct kinematics *k) {
    struct graph *g = k->g;
    expression energy = sum_over_joints(g, k->tree, spring_energy, (void *)k);
    for (int i = 0; i < k->model->potential_count; i++)
        energy = add(g, energy, with_points(k, k->model->potentials[i].energy));
    return energy;
}

/*
 * d(column_j)/dq_i: a turn nearer to the ground turns the column of the one farther out, e x column; a
 * torque's axis is turned by the nearer joints alone.
 */
static struct vector column_change(const struct kinematics *k, const struct load *load, int j, int i) {
    const struct vector still = {{0, 0, 0}};
    const int near = i < j ? i : j, far = i < j ? j : i;
    if (!is_on_path(k, near, far) || !k->tree->frames[near].joint.is_turn || (load->is_torque && i >= j))
        return still;
    return vector_cross(k->g, joint_axis(k, near), load_column(k, load, far));
}

static void add_load_tangent(const struct kinematics *k, const struct load *load, expression *tangent) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    struct vector F = vector_of(load->value);
    for (int a = 0; a < 3; a++) {
        const expression *change = coefficients_of(k, F.at[a], 0, true);
        F.at[a] = at_rest(k, F.at[a]);
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const expression more = mul(g, load_column(k, load, j).at[a], change[i]);
                tangent[j * n + i] = add(g, tangent[j * n + i], more);
            }
    }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const expression more = vector_dot(g, F, column_change(k, load, j, i));
            tangent[j * n + i] = add(g, tangent[j * n + i], more);
        }
}

expression *derive_applied_tangent(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct named_forces named = collect(k);
    expression *tangent = new_values(k, (size_t)n * (size_t)n);
    remark(g, "tangent of springs and of forces that the model names, at rest");
    for (int i = 0; i < n; i++)
        tangent[i * n + i] = neg(g, k->tree->frames[i].joint.stiffness);
    for (int f = 0; f < named.force_count; f++) {
        const expression *row = coefficients_of(k, named.forces[f].value, 0, true);
        expression *into = tangent + named.forces[f].coordinate * n;
        for (int j = 0; j < n; j++)
            into[j] = add(g, into[j], row[j]);
    }
    for (int l = 0; l < named.load_count; l++)
        add_load_tangent(k, &named.loads[l], tangent);
    return tangent;
}

/* extra_i += power . d(value)/dqd_i */
static void add_printed_rate(const struct kinematics *k, expression speed, expression value,
                             expression *extra) {
    const expression *slope = coefficients_of(k, value, 1, false);
    for (int i = 0; i < k->tree->count; i++)
        extra[i] = add(k->g, extra[i], mul(k->g, speed, slope[i]));
}

expression *derive_printed_rates(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct named_forces named = collect(k);
    expression *extra = new_values(k, (size_t)n);
    remark(g, "printed form: sum_j qd_j dQ_j/dqd_i");
    for (int i = 0; i < n; i++) /* -d_i qd_i is linear in qd_i alone */
        extra[i] = neg(g, mul(g, k->tree->frames[i].joint.damping, rate(k, i)));
    for (int f = 0; f < named.force_count; f++)
        add_printed_rate(k, rate(k, named.forces[f].coordinate), named.forces[f].value, extra);
    for (int l = 0; l < named.load_count; l++) {
        struct vector speed = {{0, 0, 0}};
        for (int j = 0; j < n; j++)
            speed = vector_add(g, speed, vector_scale(g, rate(k, j), load_column(k, &named.loads[l], j)));
        for (int a = 0; a < 3; a++)
            add_printed_rate(k, speed.at[a], named.loads[l].value[a], extra);
    }
    return extra;
}
