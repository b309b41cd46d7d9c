/*
 * The vectors from which exact derivatives of M qdd - h - Q - u^T lambda by coordinates and rates, at given
 * accelerations and multipliers, are computed in O(n^2).
 *
 * Input: the motion at given qdd. Output: vectors of each coordinate for the loops over pairs (plan.h):
 * theory, sect. 7.3 to 7.6. The method is that of Singh, Russo and Wensing (IEEE RA-L 7, 2022), here with
 * arms and velocities from the joints' own origins instead of spatial vectors about one point. With C_j,
 * C_j', C_j'' the column of a mass element, M_ij = int C_i . C_j dm, and the derivative of row i of M qdd + c
 * + g is 2 int C_i . C_j' dm by qd_j and int C_i . C_j'' dm + int dC_i/dq_j . (rdd - grav) dm by q_j.
 */
#include "gen/tangent/tangent.h"
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

/* ---- Applied forces ---- */

struct applied_forces *tangent_no_forces(const struct kinematics *k) {
    struct applied_forces *applied_forces = memory_get(k->memory, sizeof *applied_forces);
    const size_t markers = (size_t)k->model->marker_count + 1;
    applied_forces->coordinates = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof(expression));
    applied_forces->points = memory_get(k->memory, markers * sizeof *applied_forces->points);
    applied_forces->torques = memory_get(k->memory, markers * sizeof *applied_forces->torques);
    return applied_forces;
}

void tangent_add_applied_forces(const struct kinematics *k, struct applied_forces *applied_forces) {
    struct graph *g = k->g;
    const struct named_forces named = forces_collect(k);
    applied_forces->has_springs = true;
    for (int f = 0; f < named.force_count; f++) {
        expression *into = &applied_forces->coordinates[named.forces[f].coordinate];
        *into = expr_add(g, *into, named.forces[f].value);
    }
    for (int l = 0; l < named.load_count; l++) {
        const struct load *load = &named.loads[l];
        struct vector *into =
            (load->is_torque ? applied_forces->torques : applied_forces->points) + load->point;
        *into = vector_add(g, *into, vector_of(load->value));
    }
}

void tangent_add_row_forces(const struct kinematics *k, struct applied_forces *applied_forces) {
    struct graph *g = k->g;
    const int n = k->tree->count;
    for (int row = 0; row < k->model->row_count; row++) {
        const struct row *given = &k->model->rows[row];
        const expression lambda = expr_symbol(g, SYMBOL_MULTIPLIER, row, 0);
        const expression *derivative =
            coordinate_derivatives_symbol_gradient(k, given->residual, (int)given->level, false);
        for (int i = 0; i < n; i++)
            applied_forces->coordinates[i] =
                expr_add(g, applied_forces->coordinates[i], expr_mul(g, lambda, derivative[i]));
        for (int p = 0; p < k->model->marker_count; p++) {
            const struct vector force = vector_scale(g, lambda, vector_of(derivative + n + 3 * p));
            applied_forces->points[p] = vector_add(g, applied_forces->points[p], force);
        }
    }
}

/* d/dt of a symbol; accelerations are symbols, too. */
static expression rate_of_symbol(void *context, struct graph *g, expression e) {
    const struct symbol s = *expr_as_symbol(g, e);
    (void)context;
    if (s.kind == SYMBOL_TIME)
        return EXPR_ONE;
    if ((s.kind == SYMBOL_COORDINATE || s.kind == SYMBOL_POINT) && s.order < 2)
        return expr_symbol(g, s.kind, s.index, s.order + 1);
    return EXPR_ZERO;
}

/* Acceleration rows have no residual to stabilise; velocity rows have no phi. */
struct row_symbols tangent_row_symbols(const struct kinematics *k, int index) {
    struct graph *g = k->g;
    const struct row *row = &k->model->rows[index];
    const expression damping = constraints_rate_gain(g, row), stiffness = constraints_position_gain(g, row);
    if (row->level == ROW_ACCELERATION)
        return (struct row_symbols){.balance = row->residual};
    struct row_symbols s = {.psi = row->residual};
    if (row->level == ROW_POSITION) {
        s.phi = row->residual;
        s.psi = rewrite_derivative(g, s.phi, rate_of_symbol, NULL);
    }
    s.balance = rewrite_derivative(g, s.psi, rate_of_symbol, NULL);
    s.balance =
        expr_add(g, s.balance, expr_add(g, expr_mul(g, damping, s.psi), expr_mul(g, stiffness, s.phi)));
    return s;
}

expression *tangent_row_balances(const struct kinematics *k) {
    expression *balances = memory_get(k->memory, ((size_t)k->model->row_count + 1) * sizeof *balances);
    for (int row = 0; row < k->model->row_count; row++)
        balances[row] = tangent_row_symbols(k, row).balance;
    return balances;
}

/* The same with symbols replaced by the motion. */
static struct applied_forces *place_forces(const struct given_motion *given,
                                           const struct applied_forces *applied_forces) {
    struct applied_forces *placed = tangent_no_forces(given->k);
    for (int p = 0; p < given->k->model->marker_count; p++) {
        placed->points[p] = given_motion_place_vector(given, applied_forces->points[p]);
        placed->torques[p] = given_motion_place_vector(given, applied_forces->torques[p]);
    }
    for (int i = 0; i < given->k->tree->count; i++)
        placed->coordinates[i] = given_motion_place(given, applied_forces->coordinates[i]);
    return placed;
}

static expression spring_and_damper(const struct given_motion *given, int i) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[i].joint;
    if (k->tree->frames[i].has_strains)
        return element_strains_force(k, i, given->is_resting ? STRAIN_ELASTIC : STRAIN_BOTH);
    const expression stretch = expr_sub(g, kinematics_coordinate_of(k, i, 0), joint->rest);
    const expression damper =
        given->is_resting ? 0 : expr_mul(g, joint->damping, kinematics_coordinate_of(k, i, 1));
    return expr_neg(g, expr_add(g, expr_mul(g, joint->stiffness, stretch), damper));
}

/* Q_j += -s (q - rest) - d qd + sum of F . C_j and of T . e_j: theory, sect. 7.3. */
expression *tangent_generalized_forces(const struct given_motion *given,
                                       const struct applied_forces *applied_forces) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct applied_forces *felt = place_forces(given, applied_forces);
    expression *Q = felt->coordinates;
    for (int j = -1; recursion_next_joint(g, k->tree, &j);) {
        if (applied_forces->has_springs)
            Q[j] = expr_add(g, Q[j], spring_and_damper(given, j));
        for (int p = 0; p < k->model->marker_count; p++) {
            Q[j] = expr_add(g, Q[j], vector_dot(g, felt->points[p], k->points[p].columns[j]));
            if (k->tree->frames[j].joint.is_revolute && kinematics_is_on_path(k, j, k->tree->points[p].frame))
                Q[j] = expr_add(g, Q[j], vector_dot(g, felt->torques[p], kinematics_joint_axis(k, j)));
        }
    }
    return Q;
}

/* ---- Sums beyond a joint ---- */

/* a b^T */
static struct matrix outer(struct graph *g, struct vector a, struct vector b) {
    struct matrix m;
    for (int i = 0; i < 9; i++)
        m.at[i] = expr_mul(g, a.at[i / 3], b.at[i % 3]);
    return m;
}

static struct matrix matrix_add(struct graph *g, struct matrix a, struct matrix b) {
    for (int i = 0; i < 9; i++)
        a.at[i] = expr_add(g, a.at[i], b.at[i]);
    return a;
}

/* int rho rho^T dm = tr(J)/2 1 - J */
static struct matrix second_moments(struct graph *g, const expression J[6]) {
    struct matrix s;
    const expression half = expr_number(g, 0.5);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        s.at[4 * i] = expr_mul(g, half, expr_sub(g, expr_add(g, J[j], J[l]), J[i]));
        s.at[3 * i + j] = s.at[3 * j + i] = expr_neg(g, J[tensor_index(i, j)]);
    }
    return s;
}

/* w x each column */
static struct matrix cross_columns(struct graph *g, struct vector w, const struct matrix *m) {
    struct matrix c;
    for (int column = 0; column < 3; column++) {
        const struct vector v =
            vector_cross(g, w, (struct vector){{m->at[column], m->at[3 + column], m->at[6 + column]}});
        for (int row = 0; row < 3; row++)
            c.at[3 * row + column] = v.at[row];
    }
    return c;
}

static struct wrench own_load(const struct given_motion *given, int i) {
    const struct given_frame_motion *motion = &given->motions[i];
    const struct matrix gradient = given_motion_gradient(given, i);
    return wrench_of_inertia(given->k, i, motion->angular, &gradient, motion->less_gravity);
}

/* b = w x mc, E = [w]x int rho rho^T dm, L the inertia wrench at the given accelerations. */
struct flow tangent_own_flow(const struct given_motion *given, int i) {
    struct graph *g = given->k->g;
    const struct inertia own = dynamics_own_inertia(given->k, i), *inertia = &own;
    const struct vector w = given->k->frames[i].angular;
    const struct matrix moments = second_moments(g, inertia->tensor.at);
    return (struct flow){.momentum = vector_cross(g, w, inertia->moment),
                         .growth = cross_columns(g, w, &moments),
                         .load = own_load(given, i)};
}

static struct flow flow_add(struct graph *g, struct flow a, struct flow b) {
    return (struct flow){.momentum = vector_add(g, a.momentum, b.momentum),
                         .growth = matrix_add(g, a.growth, b.growth),
                         .load = wrench_add(g, a.load, b.load)};
}

/* Replaces rho, rho' by rho + s, rho' + s': E + b s^T + s' (mc + m s)^T, b + m s'. Theory, sect. 7.5. */
static struct flow flow_to_parent(const struct given_motion *given, int i, const struct inertia *beyond,
                                  struct flow flow) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct vector s = k->joints[i].shift, rate = given->frames[i].shift_rate;
    const struct vector mc = kinematics_to_parent(k, i, beyond->moment);
    const struct vector moved = vector_add(g, mc, vector_scale(g, beyond->mass, s));
    struct flow out = {.momentum = kinematics_to_parent(k, i, flow.momentum),
                       .growth = articulated_body_matrix_to_parent(k, i, flow.growth),
                       .load = wrench_to_parent(k, i, flow.load)};
    out.growth = matrix_add(g, out.growth, outer(g, out.momentum, s));
    out.growth = matrix_add(g, out.growth, outer(g, rate, moved));
    out.momentum = vector_add(g, out.momentum, vector_scale(g, beyond->mass, rate));
    return out;
}

static void name_flow(const struct kinematics *k, int i, const struct flow *flow) {
    kinematics_name_vector(k, i, "momentum", flow->momentum);
    kinematics_name_matrix(k, i, "growth", &flow->growth);
    kinematics_name_vector(k, i, "held_moment", flow->load.moment);
    kinematics_name_vector(k, i, "held_force", flow->load.force);
}

/* ---- Vectors of one coordinate ---- */

/* int rho x (a x rho') dm = (tr(E) 1 - E) a; transposed: int rho' x (a x rho) dm, with E^T. Diagonal terms
 * are sums of two entries, not differences from the trace. */
static struct vector around(struct graph *g, const struct matrix *E, bool is_transposed, struct vector a) {
    struct vector b;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        const expression ij = is_transposed ? E->at[3 * j + i] : E->at[3 * i + j];
        const expression il = is_transposed ? E->at[3 * l + i] : E->at[3 * i + l];
        const expression off = expr_add(g, expr_mul(g, ij, a.at[j]), expr_mul(g, il, a.at[l]));
        b.at[i] = expr_sub(g, expr_mul(g, expr_add(g, E->at[4 * j], E->at[4 * l]), a.at[i]), off);
    }
    return b;
}

static struct vector twice(struct graph *g, struct vector a) {
    return vector_add(g, a, a);
}

/* Prismatic joint: C_i = e, with e', e'' in own axes: theory, sect. 7.5. */
static void slide_vectors(struct graph *g, const struct inertia *beyond, const struct flow *flow,
                          const struct given_frame_rates *a, struct vector e, struct pair_vectors *v) {
    const struct vector mc = beyond->moment;
    v->spin = vector_cross(g, flow->momentum, e);
    v->stiffness.force = vector_scale(g, beyond->mass, a->own_rate2);
    v->stiffness.moment =
        vector_add(g, vector_cross(g, mc, a->own_rate2), vector_cross(g, e, flow->load.force));
    v->damping.force = vector_scale(g, beyond->mass, a->own_rate);
    v->damping.moment = vector_cross(g, mc, a->own_rate);
}

/*
 * Revolute joint: C_i = e x rho: theory, sect. 7.5. In the stiffness, the load that turns with i and the part
 * e x rho'' of C_i'' add up, with lever = (a - grav) x e and a the acceleration of the origin:
 *     int rho x (e x rho'') + (e x rho) x (rdd - grav) dm = e x int rho x (rdd - grav) dm + mc x lever.
 */
static void turn_vectors(struct graph *g, const struct inertia *beyond, const struct flow *flow,
                         const struct given_frame_rates *a, struct vector e, struct vector lever,
                         struct pair_vectors *v) {
    const struct vector mc = beyond->moment;
    const struct tensor J = beyond->tensor;
    const struct vector lifted = vector_scale(g, beyond->mass, lever);
    const struct vector swung = vector_add(g, vector_cross(g, a->own_rate2, mc),
                                           twice(g, vector_cross(g, a->own_rate, flow->momentum)));
    const struct vector turned = vector_add(g, tensor_times(g, J, a->own_rate2),
                                            twice(g, around(g, &flow->growth, false, a->own_rate)));
    v->spin = around(g, &flow->growth, true, e);
    v->stiffness.force = vector_add(g, vector_add(g, swung, vector_cross(g, e, flow->load.force)), lifted);
    v->stiffness.moment = vector_add(g, vector_add(g, turned, vector_cross(g, e, flow->load.moment)),
                                     vector_cross(g, mc, lever));
    v->damping.force = vector_add(g, vector_cross(g, a->own_rate, mc), vector_cross(g, e, flow->momentum));
    v->damping.moment = vector_add(g, tensor_times(g, J, a->own_rate), around(g, &flow->growth, false, e));
}

static void vectors_to_ground(const struct kinematics *k, int i, struct pair_vectors *v) {
    struct vector *const own[] = {
        &v->less_gravity_lever, &v->mass.moment,     &v->mass.force,     &v->spin,
        &v->stiffness.moment,   &v->stiffness.force, &v->damping.moment, &v->damping.force};
    for (size_t a = 0; a < sizeof own / sizeof *own; a++)
        *own[a] = matrix_times(k->g, k->frames[i].rotation.at, *own[a]);
}

static struct pair_vectors vectors_of_joint(const struct given_motion *given, int i,
                                            const struct inertia *beyond, const struct flow *flow) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct given_frame_rates *rates = &given->frames[i];
    const struct vector e = vector_unit(k->tree->frames[i].joint.axis);
    struct pair_vectors v = {.mass = wrench_of_unit(k, i, beyond)};
    if (k->tree->frames[i].joint.is_revolute) {
        v.less_gravity_lever = vector_cross(g, given->motions[i].less_gravity, e);
        turn_vectors(g, beyond, flow, rates, e, v.less_gravity_lever, &v);
    } else {
        slide_vectors(g, beyond, flow, rates, e, &v);
    }
    vectors_to_ground(k, i, &v);
    return v;
}

/* Sums b, E and L inward, and computes from them the vectors of each joint: theory, sect. 7.5. */
struct pair_vectors *tangent_pair_vectors(const struct given_motion *given,
                                          const struct inertia *composites) {
    const struct kinematics *k = given->k;
    const size_t n = (size_t)k->tree->count + 1;
    struct flow *flows = memory_get(k->memory, n * sizeof *flows);
    struct pair_vectors *vectors = memory_get(k->memory, n * sizeof *vectors);
    struct recursion recursion = kinematics_recursion(k, flows, sizeof *flows);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        kinematics_remark(k, i, "momentum b, growth E and load L of all beyond (7.5)");
        if (frame->kind == FRAME_JOINT) {
            flows[i] = flow_add(k->g, tangent_own_flow(given, i), flows[i]);
            name_flow(k, i, &flows[i]);
            vectors[i] = vectors_of_joint(given, i, &composites[i], &flows[i]);
        }
        if (frame->parent >= 0)
            flows[frame->parent] =
                flow_add(k->g, flows[frame->parent], flow_to_parent(given, i, &composites[i], flows[i]));
    }
    return vectors;
}

/* F_i = own load + sum of F of the children, e_i . F_i + rotor qdd_i: theory, sect. 4.7 at the given
 * accelerations. */
expression *tangent_inertia_forces(const struct given_motion *given) {
    const struct kinematics *k = given->k;
    const size_t n = (size_t)k->tree->count + 1;
    struct wrench *sums = memory_get(k->memory, n * sizeof *sums);
    expression *forces = memory_get(k->memory, n * sizeof *forces);
    struct recursion recursion = kinematics_recursion(k, sums, sizeof *sums);
    for (int i = k->tree->count; recursion_inward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        if (frame->kind == FRAME_JOINT) {
            sums[i] = wrench_add(k->g, sums[i], own_load(given, i));
            forces[i] = (frame->joint.is_revolute ? sums[i].moment : sums[i].force).at[frame->joint.axis];
            forces[i] =
                expr_add(k->g, forces[i], expr_mul(k->g, frame->joint.rotor, given->accelerations[i]));
        }
        if (frame->parent >= 0)
            sums[frame->parent] = wrench_add(k->g, sums[frame->parent], wrench_to_parent(k, i, sums[i]));
    }
    return forces;
}
