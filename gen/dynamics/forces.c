/*
 * Applied forces: springs and dampers on coordinates, and the forces of the author: on coordinates, loads at
 * points, energies.
 *
 * Input: the model's forces in symbols. Output: generalized forces Q_j, their potential, their power and
 * their tangent (theory, sect. 4.9). A load F at a point contributes Q = C^T F, a torque acts on the turns of
 * its body, and an energy V contributes Q = -dV/dq: a force -dV/dq_j on each coordinate and a load -dV/dr at
 * each point.
 *
 * Springs and dampers of an element's three turns psi, theta, phi act on strains, in a form that is symmetric
 * in the turns (theory, sect. 3.4). The strains are the components of the rotation vector of R = Rz Ry Rx. To
 * second order in the turns (Baker, Campbell, Hausdorff) they are
 *   w_psi = psi - theta phi / 2, w_theta = theta + psi phi / 2, w_phi = phi - psi theta / 2.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"
#include "gen/graph/graph.h"

#include <string.h>

/* ---- Strains of elements ---- */

/* sign_a e, of w_a = q_a + sign_a q_b q_c / 2 */
static expression with_sign(struct graph *g, int a, expression e) {
    return a == 1 ? e : expr_neg(g, e);
}

static expression half_of(struct graph *g, expression e) {
    return expr_mul(g, expr_number(g, 0.5), e);
}

int element_strains_first(const struct kinematics *k, int i) {
    return i - k->tree->frames[i].turn;
}

static const struct joint *joint_of(const struct kinematics *k, int first, int turn) {
    return &k->tree->frames[first + turn].joint;
}

static expression turn_of(const struct kinematics *k, int first, int turn, int order) {
    return kinematics_coordinate_of(k, first + turn, order);
}

/* dw_a/dq_b = sign_a q_c / 2 for three turns a, b, c; 1 for a = b. */
static expression strain_by_turn(const struct kinematics *k, int first, int a, int b) {
    if (a == b)
        return EXPR_ONE;
    return with_sign(k->g, a, half_of(k->g, turn_of(k, first, 3 - a - b, 0)));
}

/* q_a + sign_a q_b q_c / 2 of any three values. */
static expression strain_of(struct graph *g, const expression q[3], int a) {
    const expression product = expr_mul(g, half_of(g, q[(a + 1) % 3]), q[(a + 2) % 3]);
    return expr_add(g, q[a], with_sign(g, a, product));
}

/* w - w_rest */
static expression strain(const struct kinematics *k, int first, int a) {
    expression q[3], rest[3];
    for (int turn = 0; turn < 3; turn++) {
        q[turn] = turn_of(k, first, turn, 0);
        rest[turn] = joint_of(k, first, turn)->rest;
    }
    return expr_sub(k->g, strain_of(k->g, q, a), strain_of(k->g, rest, a));
}

/* J qd */
static expression strain_rate(const struct kinematics *k, int first, int a) {
    expression rate = 0;
    for (int b = 0; b < 3; b++)
        rate = expr_add(k->g, rate, expr_mul(k->g, strain_by_turn(k, first, a, b), turn_of(k, first, b, 1)));
    return rate;
}

/* S (w - w_rest), D J qd, or their sum. */
static expression strain_moment(const struct kinematics *k, int first, int a, enum strain_part part) {
    const struct joint *joint = joint_of(k, first, a);
    expression moment = 0;
    if (part & STRAIN_ELASTIC)
        moment = expr_mul(k->g, joint->stiffness, strain(k, first, a));
    if (part & STRAIN_VISCOUS)
        moment = expr_add(k->g, moment, expr_mul(k->g, joint->damping, strain_rate(k, first, a)));
    return moment;
}

expression element_strains_force(const struct kinematics *k, int i, enum strain_part part) {
    const int first = element_strains_first(k, i), b = i - first;
    expression force = 0;
    for (int a = 0; a < 3; a++)
        force = expr_add(k->g, force,
                         expr_mul(k->g, strain_by_turn(k, first, a, b), strain_moment(k, first, a, part)));
    return expr_neg(k->g, force);
}

/* s_i (w_i - w_rest_i)^2 / 2 */
static expression strain_energy(const struct kinematics *k, int i) {
    const int first = element_strains_first(k, i), a = i - first;
    const expression w = strain(k, first, a);
    return expr_mul(k->g, half_of(k->g, joint_of(k, first, a)->stiffness), expr_mul(k->g, w, w));
}

void element_strains_derivatives(const struct kinematics *k, int i, int order, bool is_resting,
                                 expression by_turn[3]) {
    const int first = element_strains_first(k, i);
    const enum strain_part part = order == 0 && is_resting ? STRAIN_ELASTIC : STRAIN_BOTH;
    expression by[3];
    for (int turn = 0; turn < 3; turn++)
        by[turn] = turn_of(k, first, turn, order);
    rewrite_gradient(k->g, element_strains_force(k, i, part), by, by_turn, 3);
}

static expression *new_values(const struct kinematics *k, size_t count) {
    return memory_get(k->memory, (count + 1) * sizeof(expression));
}

static expression rate(const struct kinematics *k, int i) {
    return kinematics_coordinate_of(k, i, 1);
}

static expression stretch(const struct kinematics *k, int i) {
    return expr_sub(k->g, kinematics_coordinate_of(k, i, 0), k->tree->frames[i].joint.rest);
}

/* -dV/dq_j and the load -dV/dr at each point: theory, sect. 4.9. */
static void add_energy(const struct kinematics *k, const struct potential *potential,
                       struct named_forces *named) {
    const int n = k->tree->count;
    const expression *slope = coordinate_derivatives_symbol_gradient(k, potential->energy, 0, false);
    for (int j = 0; j < n; j++)
        if (slope[j])
            named->forces[named->force_count++] =
                (struct force){.coordinate = j, .value = expr_neg(k->g, slope[j]), .place = potential->place};
    for (int p = 0; p < k->model->marker_count; p++) {
        const struct vector pull = vector_scale(k->g, expr_neg(k->g, EXPR_ONE), vector_of(slope + n + 3 * p));
        struct load load = {.point = p, .place = potential->place};
        memcpy(load.value, pull.at, sizeof load.value);
        if (!vector_is_zero(pull))
            named->loads[named->load_count++] = load;
    }
}

struct named_forces forces_collect(const struct kinematics *k) {
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

/* C_j of a force's point of attack; e_j of a torque's body. */
static struct vector load_column(const struct kinematics *k, const struct load *load, int j) {
    const struct vector still = {{0, 0, 0}}, column = k->points[load->point].columns[j];
    if (!load->is_torque)
        return column;
    for (int i = k->tree->points[load->point].frame; i >= 0; i = k->tree->frames[i].parent)
        if (i == j && k->tree->frames[i].joint.is_revolute)
            return kinematics_joint_axis(k, i);
    return still;
}

/* Adds forces that name q_j and the sum of F . C_j and of T . e_j: theory, sect. 4.9. F is by load, in
 * terms of the coordinates. */
static void add_named(const struct kinematics *k, const struct named_forces *named, const struct vector *F,
                      int j, struct applied *applied) {
    struct graph *g = k->g;
    expression *conservative = &applied->conservative[j], *others = &applied->others[j];
    for (int f = 0; f < named->force_count; f++) {
        expression *into = f < named->own_forces ? others : conservative;
        if (named->forces[f].coordinate == j)
            *into = expr_add(g, *into, coordinate_derivatives_with_points(k, named->forces[f].value));
    }
    for (int l = 0; l < named->load_count; l++) {
        expression *into = l < named->own_loads ? others : conservative;
        *into = expr_add(g, *into, vector_dot(g, F[l], load_column(k, &named->loads[l], j)));
    }
}

/* Q_j = -s (q - rest) - d qd + named forces: theory, sect. 4.9. */
static void apply_forces(const struct kinematics *k, const struct named_forces *named, const struct vector *F,
                         int j, struct applied *applied) {
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[j].joint;
    applied->conservative[j] = expr_neg(g, expr_mul(g, joint->stiffness, stretch(k, j)));
    applied->others[j] = expr_neg(g, expr_mul(g, joint->damping, rate(k, j)));
    add_named(k, named, F, j, applied);
}

/* The same for an element's strains: theory, sect. 3.4. */
static void apply_strained(const struct kinematics *k, const struct named_forces *named,
                           const struct vector *F, int j, struct applied *applied) {
    struct graph *g = k->g;
    add_named(k, named, F, j, applied);
    const expression all_named = expr_add(g, applied->conservative[j], applied->others[j]);
    applied->strained[j] = expr_add(g, element_strains_force(k, j, STRAIN_BOTH), all_named);
    applied->conservative[j] =
        expr_add(g, element_strains_force(k, j, STRAIN_ELASTIC), applied->conservative[j]);
    applied->others[j] = expr_add(g, element_strains_force(k, j, STRAIN_VISCOUS), applied->others[j]);
}

struct applied forces_generalized(const struct kinematics *k) {
    const size_t n = (size_t)k->tree->count;
    const struct named_forces named = forces_collect(k);
    struct applied applied = {new_values(k, n), new_values(k, n), new_values(k, n)};
    graph_remark(k->g, "Q = -s (q - rest) - d qd + F.C + T.e (4.9)");
    struct vector *F = memory_get(k->memory, ((size_t)named.load_count + 1) * sizeof *F);
    for (int l = 0; l < named.load_count; l++)
        for (int a = 0; a < 3; a++)
            F[l].at[a] = coordinate_derivatives_with_points(k, named.loads[l].value[a]);
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);)
        (k->tree->frames[j].has_strains ? apply_strained : apply_forces)(k, &named, F, j, &applied);
    return applied;
}

expression forces_energy(const struct kinematics *k) {
    struct graph *g = k->g;
    struct recursion springs = recursion_sum(k->memory, g, k->tree);
    for (int i = -1; recursion_next_term(&springs, &i);) {
        const expression half = expr_mul(g, expr_number(g, 0.5), k->tree->frames[i].joint.stiffness);
        recursion_add_term(&springs, i,
                           k->tree->frames[i].has_strains
                               ? strain_energy(k, i)
                               : expr_mul(g, half, expr_mul(g, stretch(k, i), stretch(k, i))));
    }
    expression energy = recursion_total(&springs);
    for (int i = 0; i < k->model->potential_count; i++)
        energy = expr_add(g, energy, coordinate_derivatives_with_points(k, k->model->potentials[i].energy));
    return energy;
}

/*
 * dC_j/dq_i: of two joints the nearer to the ground, if revolute, turns the column of the farther one, e x C.
 * Only nearer joints turn the axis of a torque. Theory, sect. 7.3.
 */
static struct vector column_change(const struct kinematics *k, const struct load *load, int j, int i) {
    const struct vector still = {{0, 0, 0}};
    const int near = i < j ? i : j, far = i < j ? j : i;
    if (!kinematics_is_on_path(k, near, far) || !k->tree->frames[near].joint.is_revolute ||
        (load->is_torque && i >= j))
        return still;
    return vector_cross(k->g, kinematics_joint_axis(k, near), load_column(k, load, far));
}

/* dQ_j/dq_i += C_j . dF/dq_i + F . dC_j/dq_i: theory, sect. 7.3. */
static void add_load_tangent(const struct kinematics *k, const struct load *load, expression *tangent) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    struct vector F = vector_of(load->value);
    for (int a = 0; a < 3; a++) {
        const expression *change = coordinate_derivatives_coefficients(k, F.at[a], 0, true);
        F.at[a] = coordinate_derivatives_at_rest(k, F.at[a]);
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const expression more = expr_mul(g, load_column(k, load, j).at[a], change[i]);
                tangent[j * n + i] = expr_add(g, tangent[j * n + i], more);
            }
    }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const expression more = vector_dot(g, F, column_change(k, load, j, i));
            tangent[j * n + i] = expr_add(g, tangent[j * n + i], more);
        }
}

/* Sets row i of dQ/dq of springs. */
static void set_spring_tangent(const struct kinematics *k, int i, expression *row) {
    if (k->tree->frames[i].has_strains)
        element_strains_derivatives(k, i, 0, true, row + element_strains_first(k, i));
    else
        row[i] = expr_neg(k->g, k->tree->frames[i].joint.stiffness);
}

expression *forces_tangent(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct named_forces named = forces_collect(k);
    expression *tangent = new_values(k, (size_t)n * (size_t)n);
    graph_remark(g, "dQ/dq of springs and of the model's own forces, at qd = 0 (4.9, 7.3)");
    for (int i = 0; i < n; i++)
        set_spring_tangent(k, i, tangent + i * n);
    for (int f = 0; f < named.force_count; f++) {
        const expression *row = coordinate_derivatives_coefficients(k, named.forces[f].value, 0, true);
        expression *into = tangent + named.forces[f].coordinate * n;
        for (int j = 0; j < n; j++)
            into[j] = expr_add(g, into[j], row[j]);
    }
    for (int l = 0; l < named.load_count; l++)
        add_load_tangent(k, &named.loads[l], tangent);
    return tangent;
}

/* extra_i += speed * d(value)/dqd_i: a part of sum_j qd_j dQ_j/dqd_i, theory, sect. 9. */
static void add_printed_rate(const struct kinematics *k, expression speed, expression value,
                             expression *extra) {
    const expression *slope = coordinate_derivatives_coefficients(k, value, 1, false);
    for (int i = 0; i < k->tree->count; i++)
        extra[i] = expr_add(k->g, extra[i], expr_mul(k->g, speed, slope[i]));
}

expression *forces_printed_rates(const struct kinematics *k) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    const struct named_forces named = forces_collect(k);
    expression *extra = new_values(k, (size_t)n);
    graph_remark(g, "printed form: sum_j qd_j dQ_j/dqd_i (9)");
    for (int i = 0; i < n; i++) /* dampers: -D qd with a symmetric D is its own extra term */
        extra[i] = k->tree->frames[i].has_strains
                       ? element_strains_force(k, i, STRAIN_VISCOUS)
                       : expr_neg(g, expr_mul(g, k->tree->frames[i].joint.damping, rate(k, i)));
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
