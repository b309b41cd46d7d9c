/*
 * The vectors from which the derivatives of accelerations by q and qd are computed column by column, without
 * M and without derivatives of the equations of motion: theory, sect. 7.7.
 *
 * Input: the motion at given qdd, articulated inertias, applied forces. Output: for each joint the start of
 * its two columns, and the vectors with which loops (plan.h) continue them to all other joints.
 *
 * For the bodies beyond joint j, a change of q_j or qd_j changes their carrier's acceleration by alpha and
 * its angular velocity by beta. Forces that keep their direction in space turn by gamma. A mass element at
 * rho then gains the acceleration A_linear + A_angular x rho + 2 beta x rho'. All factors are computed in the
 * axes of the frames, where a slender element's small inertia about its axis is not mixed with the others.
 * They are turned into the ground's axes at the end.
 */
#include "gen/tangent/tangent.h"

/* A wrench for each of three directions of beta or gamma. */
struct wrenches {
    struct matrix moment, force; /* column by direction */
};

/* The whole load that a joint carries, and its change by gamma. */
struct felt {
    struct wrench load;
    struct wrenches turned;
};

/* (angular, linear) acceleration of a frame by a (moment, force) on it. As [J H; H^T M] of an articulated
 * inertia, with the two halves exchanged: J = linear by force, H = linear by moment, M = angular by moment.
 */
struct columns {
    const struct given_motion *given;
    const struct kinematics *k;
    const struct elimination *elimination;
    struct vector *const *own;
    struct wrenches *spin, *turned; /* by frame, before its stage is eliminated */
    struct wrench *load;            /* by frame */
    struct articulated *response;   /* by frame, after its stage */
    struct acceleration_columns *list;
};

/* ---- Matrices ---- */

static struct matrix cross_matrix(struct graph *g, struct vector a) {
    return (struct matrix){{0, expr_neg(g, a.at[2]), a.at[1], a.at[2], 0, expr_neg(g, a.at[0]),
                            expr_neg(g, a.at[1]), a.at[0], 0}};
}

static struct matrix added(struct graph *g, struct matrix a, struct matrix b) {
    for (int i = 0; i < 9; i++)
        a.at[i] = expr_add(g, a.at[i], b.at[i]);
    return a;
}

static struct matrix subtracted(struct graph *g, struct matrix a, struct matrix b) {
    for (int i = 0; i < 9; i++)
        a.at[i] = expr_sub(g, a.at[i], b.at[i]);
    return a;
}

static struct matrix transposed(struct matrix a) {
    return (struct matrix){{a.at[0], a.at[3], a.at[6], a.at[1], a.at[4], a.at[7], a.at[2], a.at[5], a.at[8]}};
}

static struct matrix full(struct tensor t) {
    struct matrix m;
    for (int i = 0; i < 9; i++)
        m.at[i] = t.at[tensor_index(i / 3, i % 3)];
    return m;
}

static struct tensor upper(struct matrix m) {
    struct tensor t;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            t.at[tensor_index(i, j)] = m.at[3 * i + j];
    return t;
}

static struct vector row_of(const struct matrix *m, int row) {
    return vector_of(m->at + 3 * row);
}

static struct vector column_of(const struct matrix *m, int column) {
    return (struct vector){{m->at[column], m->at[3 + column], m->at[6 + column]}};
}

static void set_column(struct matrix *m, int column, struct vector a) {
    for (int row = 0; row < 3; row++)
        m->at[3 * row + column] = a.at[row];
}

static struct matrix matrix_to_child(const struct kinematics *k, int i, struct matrix m) {
    struct matrix half, whole;
    for (int column = 0; column < 3; column++)
        set_column(&half, column, kinematics_to_child(k, i, column_of(&m, column)));
    for (int row = 0; row < 3; row++) {
        const struct vector turned = kinematics_to_child(k, i, row_of(&half, row));
        for (int column = 0; column < 3; column++)
            whole.at[3 * row + column] = turned.at[column];
    }
    return whole;
}

static struct vector to_ground(const struct kinematics *k, int i, struct vector a) {
    return matrix_times(k->g, k->frames[i].rotation.at, a);
}

static struct matrix matrix_to_ground(const struct kinematics *k, int i, struct matrix m) {
    const struct matrix turned = transposed(k->frames[i].rotation),
                        half = matrix_product(k->g, k->frames[i].rotation.at, m.at);
    return matrix_product(k->g, half.at, turned.at);
}

/* ---- Ball joints ---- */

static struct vector into(const struct kinematics *k, int from, int last, struct vector a) {
    for (int i = from + 1; i <= last; i++)
        a = kinematics_to_child(k, i, a);
    return a;
}

/* A ball joint in the axes of its last frame: the axes e of its turns, and the rows that turn a relative
 * angular acceleration into those of the coordinates. */
struct turns {
    struct vector axis[3], row[3];
};

static struct turns turns_of(const struct kinematics *k, const struct stage *stage) {
    struct graph *g = k->g;
    const struct frame *frames = k->tree->frames;
    const int first = stage->first, middle = first + 1, last = stage->last;
    const struct vector along_first =
                            vector_scale(g, stage->ball.cos_inverse, vector_unit(frames[first].joint.axis)),
                        along_last = vector_unit(frames[last].joint.axis);
    const struct vector rows[3] = {along_first, vector_unit(frames[middle].joint.axis),
                                   vector_sub(g, along_last, vector_scale(g, stage->ball.tilt, along_first))};
    struct turns turns;
    for (int r = 0; r < 3; r++) {
        turns.axis[r] = into(k, first + r, last, vector_unit(frames[first + r].joint.axis));
        turns.row[r] = kinematics_to_child(k, last, rows[r]);
    }
    return turns;
}

/* The moment that has these components along the three axes. */
static struct vector moment_of(struct graph *g, const struct turns *turns, const expression f[3]) {
    struct vector moment = {{0, 0, 0}};
    for (int r = 0; r < 3; r++)
        moment = vector_add(g, moment, vector_scale(g, f[r], turns->row[r]));
    return moment;
}

/* ---- Changes of velocity and of direction, from the tips ---- */

static struct wrenches wrenches_add(struct graph *g, struct wrenches a, struct wrenches b) {
    return (struct wrenches){added(g, a.moment, b.moment), added(g, a.force, b.force)};
}

/* 2 int rho x (beta x rho') dm = 2 (tr(E) 1 - E) beta, 2 int beta x rho' dm = 2 beta x b: theory, sect. 7.5.
 */
static struct wrenches own_spin(const struct columns *c, int i) {
    struct graph *g = c->k->g;
    const struct flow flow = tangent_own_flow(c->given, i);
    const expression minus_two = expr_number(g, -2);
    const expression *E = flow.growth.at;
    struct wrenches own;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            const int j = (row + 1) % 3, l = (row + 2) % 3;
            const expression sum = expr_add(g, E[4 * j], E[4 * l]);
            own.moment.at[3 * row + column] =
                row == column ? expr_add(g, sum, sum) : expr_mul(g, minus_two, E[3 * row + column]);
        }
    own.force = cross_matrix(g, vector_scale(g, minus_two, flow.momentum));
    return own;
}

/* Subtracts what the joints of a stage take up: U Y^T / D, or H^T J^-1 of the moments. */
static struct wrenches eliminated(const struct columns *c, const struct stage *stage, struct wrenches w) {
    struct graph *g = c->k->g;
    if (stage->last > stage->first) {
        const struct matrix turned = transposed(stage->ball.J_inverse_H);
        const struct matrix taken = matrix_product(g, turned.at, w.moment.at);
        return (struct wrenches){{{0}}, subtracted(g, w.force, taken)};
    }
    const struct joint *joint = &c->k->tree->frames[stage->last].joint;
    const struct pivot *pivot = &stage->pivot;
    const struct vector Y = row_of(joint->is_revolute ? &w.moment : &w.force, joint->axis);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            expression *moment = &w.moment.at[3 * row + column], *force = &w.force.at[3 * row + column];
            *moment = expr_sub(g, *moment, expr_mul(g, pivot->U_over_D.moment.at[row], Y.at[column]));
            *force = expr_sub(g, *force, expr_mul(g, pivot->U_over_D.force.at[row], Y.at[column]));
        }
    for (int column = 0; column < 3; column++)
        (joint->is_revolute ? &w.moment : &w.force)->at[3 * joint->axis + column] =
            expr_mul(g, pivot->kept, Y.at[column]);
    return w;
}

/* Wrenches in the axes of frame i's parent and about its origin. `more` is added first; then the forces,
 * which act at the shift, add to the moments. */
static struct wrenches wrenches_to_parent(const struct columns *c, int i, struct wrenches w,
                                          struct wrenches more) {
    struct graph *g = c->k->g;
    w.moment = added(g, articulated_body_matrix_to_parent(c->k, i, w.moment), more.moment);
    w.force = added(g, articulated_body_matrix_to_parent(c->k, i, w.force), more.force);
    for (int column = 0; column < 3; column++) {
        const struct vector arm = vector_cross(g, c->k->joints[i].shift, column_of(&w.force, column));
        set_column(&w.moment, column, vector_add(g, column_of(&w.moment, column), arm));
    }
    return w;
}

/* The shift moves with s', so that beta accelerates the origin of frame i by 2 beta x s'. */
static struct wrenches spin_of_shift(const struct columns *c, int i) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct articulated *passed = &c->elimination->passed[i];
    const struct vector rate = c->given->frames[i].shift_rate;
    struct wrenches more = {{{0}}, {{0}}};
    if (vector_is_zero(rate))
        return more;
    const struct matrix lever = cross_matrix(g, vector_scale(g, expr_number(g, -2), rate)),
                        H = articulated_body_matrix_to_parent(k, i, passed->H),
                        M = full(kinematics_tensor_to_parent_quickly(k, i, passed->M));
    return (struct wrenches){matrix_product(g, H.at, lever.at), matrix_product(g, M.at, lever.at)};
}

static void sum_spins(struct columns *c) {
    const struct kinematics *k = c->k;
    struct wrenches *beyond = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *beyond);
    struct recursion inward = kinematics_recursion(k, beyond, sizeof *beyond);
    for (int i = k->tree->count; recursion_inward(&inward, &i);) {
        const int parent = k->tree->frames[i].parent;
        struct wrenches w = beyond[i];
        if (c->elimination->ends_stage[i]) {
            kinematics_remark(k, i, "Q beta, Q = own + sum of Q - U Y^T / D beyond (7.7)");
            w = c->spin[i] = wrenches_add(k->g, own_spin(c, i), w);
            w = eliminated(c, &c->elimination->stages[i], w);
        }
        if (parent >= 0)
            beyond[parent] =
                wrenches_add(k->g, beyond[parent], wrenches_to_parent(c, i, w, spin_of_shift(c, i)));
    }
}

/* A constant force F at rho and a torque T: the load on the body, and its change by gamma. */
static struct felt felt_from_point(const struct columns *c, const struct applied_forces *applied, int point) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[point];
    const struct vector rho = kinematics_from_body(k, fixed->frame, vector_of(fixed->placement.position));
    const expression *R = k->frames[fixed->frame].rotation.at;
    const struct vector F =
        matrix_transpose_times(g, R, given_motion_place_vector(c->given, applied->points[point]));
    const struct vector T =
        matrix_transpose_times(g, R, given_motion_place_vector(c->given, applied->torques[point]));
    const expression minus = expr_neg(g, EXPR_ONE);
    const bool is_direction = k->model->points[point].is_direction;
    const struct vector none = {{0, 0, 0}};
    struct felt felt = {.turned = {{{0}}, {{0}}}};
    felt.load = (struct wrench){vector_add(g, vector_cross(g, rho, F), T), is_direction ? none : F};
    felt.load =
        (struct wrench){vector_scale(g, minus, felt.load.moment), vector_scale(g, minus, felt.load.force)};
    const struct matrix turns_F = cross_matrix(g, vector_scale(g, minus, F)), /* gamma x F */
        turns_T = cross_matrix(g, vector_scale(g, minus, T));
    for (int column = 0; column < 3; column++) {
        const struct vector moment = vector_cross(g, rho, column_of(&turns_F, column));
        set_column(&felt.turned.moment, column, vector_add(g, moment, column_of(&turns_T, column)));
        if (!is_direction)
            set_column(&felt.turned.force, column, column_of(&turns_F, column));
    }
    return felt;
}

static struct felt felt_add(struct graph *g, struct felt a, struct felt b) {
    return (struct felt){wrench_add(g, a.load, b.load), wrenches_add(g, a.turned, b.turned)};
}

/* The load's moments along the axes of its joints equal the forces on these coordinates and are set to them:
 * a sum over all bodies beyond would be rounded in proportion to its largest moment. */
static struct vector balanced(const struct columns *c, int i, const expression *forces, struct wrench load) {
    const struct kinematics *k = c->k;
    const struct stage *stage = &c->elimination->stages[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    if (stage->last > stage->first) {
        const struct turns turns = turns_of(k, stage);
        return moment_of(k->g, &turns, forces + stage->first);
    }
    if (joint->is_revolute)
        load.moment.at[joint->axis] =
            expr_sub(k->g, forces[i], expr_mul(k->g, joint->rotor, c->given->accelerations[i]));
    return load.moment;
}

/* The forces on coordinates alone. */
static const expression *coordinate_forces(const struct columns *c, const struct applied_forces *applied) {
    struct applied_forces *alone = tangent_no_forces(c->k);
    alone->has_springs = applied->has_springs;
    alone->coordinates = applied->coordinates;
    return tangent_generalized_forces(c->given, alone);
}

static void sum_loads(struct columns *c, const struct applied_forces *applied) {
    const struct kinematics *k = c->k;
    const expression *forces = coordinate_forces(c, applied);
    struct felt *beyond = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *beyond);
    struct felt *own = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *own);
    for (int p = 0; p < k->model->marker_count; p++) {
        const int frame = k->tree->points[p].frame;
        if (frame >= 0)
            own[frame] = felt_add(k->g, own[frame], felt_from_point(c, applied, p));
    }
    struct recursion inward = kinematics_recursion(k, beyond, sizeof *beyond);
    for (int i = k->tree->count; recursion_inward(&inward, &i);) {
        const int parent = k->tree->frames[i].parent;
        const struct wrenches none = {{{0}}, {{0}}};
        struct felt felt = felt_add(k->g, own[i], beyond[i]);
        if (k->tree->frames[i].kind == FRAME_JOINT)
            felt.load = wrench_add(k->g, felt.load, tangent_own_flow(c->given, i).load);
        if (c->elimination->ends_stage[i])
            felt.load.moment = balanced(c, i, forces, felt.load);
        c->load[i] = felt.load;
        c->turned[i] = felt.turned;
        if (c->elimination->ends_stage[i])
            felt.turned = eliminated(c, &c->elimination->stages[i], felt.turned);
        felt.load = wrench_to_parent(k, i, felt.load);
        felt.turned = wrenches_to_parent(c, i, felt.turned, none);
        if (parent >= 0)
            beyond[parent] = felt_add(k->g, beyond[parent], felt);
    }
}

/* ---- The start of the columns, from the ground ---- */

static struct wrench respond(struct graph *g, const struct articulated *response, struct wrench w) {
    const struct vector angular = vector_add(g, tensor_times(g, response->M, w.moment),
                                             matrix_transpose_times(g, response->H.at, w.force)),
                        linear = vector_add(g, matrix_times(g, response->H.at, w.moment),
                                            tensor_times(g, response->J, w.force));
    return (struct wrench){angular, linear};
}

static struct wrench press(struct graph *g, const struct articulated *inertia, struct wrench a) {
    return (struct wrench){
        vector_add(g, tensor_times(g, inertia->J, a.moment), matrix_times(g, inertia->H.at, a.force)),
        vector_add(g, matrix_transpose_times(g, inertia->H.at, a.moment),
                   tensor_times(g, inertia->M, a.force))};
}

static struct wrench times(struct graph *g, const struct wrenches *w, struct vector by) {
    return (struct wrench){matrix_times(g, w->moment.at, by), matrix_times(g, w->force.at, by)};
}

static struct wrench wrench_sub(struct graph *g, struct wrench a, struct wrench b) {
    return (struct wrench){vector_sub(g, a.moment, b.moment), vector_sub(g, a.force, b.force)};
}

/* The response of frame i while its joint is at rest. */
static struct articulated carried_response(const struct columns *c, int i) {
    const struct kinematics *k = c->k;
    const int parent = k->tree->frames[i].parent;
    struct articulated r = {.J = {{0}}};
    if (parent < 0)
        return r;
    const struct vector back = vector_scale(k->g, expr_neg(k->g, EXPR_ONE), k->joints[i].shift);
    r = articulated_body_shift(k->g, back, c->response[parent]);
    return (struct articulated){upper(matrix_to_child(k, i, full(r.J))), matrix_to_child(k, i, r.H),
                                upper(matrix_to_child(k, i, full(r.M)))};
}

/* The change of motion beyond joint j by q (order 0) or qd (order 1), in the axes of frame `last`:
 * q: alpha = (e'', lever), beta = e', gamma = e; qd: alpha = (2 e', 0), beta = e. A slide has alpha = (0,
 * e'') and (0, 2 e') alone. */
struct carried_change {
    struct wrench alpha; /* (angular, linear) */
    struct vector beta, gamma;
};

static struct carried_change change_of(const struct columns *c, int j, int last, int order) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[j].joint;
    const struct given_frame_rates *rates = &c->given->frames[j];
    const struct vector e = into(k, j, last, vector_unit(joint->axis)), none = {{0, 0, 0}};
    const struct vector rate = into(k, j, last, rates->own_rate);
    const struct vector twice = vector_add(g, rate, rate), rate2 = into(k, j, last, rates->own_rate2);
    if (!joint->is_revolute)
        return (struct carried_change){.alpha = {none, order ? twice : rate2}};
    if (order)
        return (struct carried_change){.alpha = {twice, none}, .beta = e};
    return (struct carried_change){
        .alpha = {rate2, vector_cross(g, c->given->motions[last].less_gravity, e)}, .beta = rate, .gamma = e};
}

/* The load that turns with joint j, or moves with it if it slides, as seen by what carries the joint. */
static struct wrench turned_load(const struct columns *c, int j, int last, int order) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct joint *joint = &k->tree->frames[j].joint;
    const struct vector e = into(k, j, last, vector_unit(joint->axis)), none = {{0, 0, 0}};
    const struct wrench *load = &c->load[last];
    if (order)
        return (struct wrench){none, none};
    if (!joint->is_revolute)
        return (struct wrench){vector_cross(g, e, load->force), none};
    return (struct wrench){vector_cross(g, e, load->moment), vector_cross(g, e, load->force)};
}

/* p = IA alpha + Q beta + T gamma */
static struct wrench pressed(const struct columns *c, int last, const struct carried_change *change) {
    struct graph *g = c->k->g;
    const struct wrench inertia = press(g, &c->elimination->whole[last], change->alpha),
                        spin = times(g, &c->spin[last], change->beta),
                        turned = times(g, &c->turned[last], change->gamma);
    return wrench_add(g, wrench_add(g, inertia, spin), turned);
}

/* Turns one column into the ground's axes. push: what the stage passes on; start: A after it. */
static void set_column_of(const struct columns *c, int j, int last, int order,
                          const struct carried_change *change, struct wrench push, struct wrench start,
                          struct vector own) {
    struct acceleration_column *column = &c->list[j].by[order];
    start = wrench_add(c->k->g, start, change->alpha);
    *column = (struct acceleration_column){.spin = to_ground(c->k, last, change->beta),
                                           .push_moment = to_ground(c->k, last, push.moment),
                                           .push_force = to_ground(c->k, last, push.force),
                                           .start_angular = to_ground(c->k, last, start.moment),
                                           .start_linear = to_ground(c->k, last, start.force),
                                           .own = own};
}

static void set_start(const struct columns *c, int j, int last, struct wrench z) {
    c->list[j].start_angular = to_ground(c->k, last, z.moment);
    c->list[j].start_linear = to_ground(c->k, last, z.force);
}

static expression component(const struct joint *joint, struct wrench w) {
    return (joint->is_revolute ? w.moment : w.force).at[joint->axis];
}

static expression wrench_dot(struct graph *g, struct wrench a, struct wrench b) {
    return expr_add(g, vector_dot(g, a.moment, b.moment), vector_dot(g, a.force, b.force));
}

static struct wrench wrench_scale(struct graph *g, expression factor, struct wrench w) {
    return (struct wrench){vector_scale(g, factor, w.moment), vector_scale(g, factor, w.force)};
}

/* a + e x */
static struct wrench along(struct graph *g, const struct joint *joint, struct wrench a, expression x) {
    expression *at = &(joint->is_revolute ? &a.moment : &a.force)->at[joint->axis];
    *at = expr_add(g, *at, x);
    return a;
}

/* u = -change of the required force - e . p; p + U u / D is passed on, a' = -(response) of it, and x = u / D
 * - U . a' / D. */
static void begin_single_column(struct columns *c, const struct stage *stage,
                                const struct articulated *carried, int order) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const int j = stage->last;
    const struct joint *joint = &k->tree->frames[j].joint;
    const struct pivot *pivot = &stage->pivot;
    const struct carried_change change = change_of(c, j, j, order);
    const struct wrench p = pressed(c, j, &change);
    const expression tau = expr_neg(g, c->own[order][j].at[0]);
    const expression u = expr_sub(g, tau, component(joint, p));
    struct wrench push = wrench_add(g, p, wrench_scale(g, u, pivot->U_over_D));
    (joint->is_revolute ? &push.moment : &push.force)->at[joint->axis] =
        expr_sub(g, tau, expr_mul(g, u, pivot->kept));
    push = wrench_add(g, push, turned_load(c, j, j, order));
    const struct wrench none = {{{0}}, {{0}}}, inside = wrench_sub(g, none, respond(g, carried, push));
    const expression x =
        expr_sub(g, expr_mul(g, u, pivot->D_inverse), wrench_dot(g, pivot->U_over_D, inside));
    set_column_of(c, j, j, order, &change, push, along(g, joint, inside, x), (struct vector){{x, 0, 0}});
}

static void begin_single(struct columns *c, int j) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct stage *stage = &c->elimination->stages[j];
    const struct joint *joint = &k->tree->frames[j].joint;
    const struct pivot *pivot = &stage->pivot;
    const struct articulated carried = carried_response(c, j);
    struct acceleration_columns *list = &c->list[j];
    list->turn = to_ground(k, j, vector_unit(joint->axis));
    if (joint->is_revolute)
        list->turned = list->turn;
    list->hold_moment = to_ground(k, j, pivot->U_over_D.moment);
    list->hold_force = to_ground(k, j, pivot->U_over_D.force);
    const struct matrix *spin = joint->is_revolute ? &c->spin[j].moment : &c->spin[j].force,
                        *turned = joint->is_revolute ? &c->turned[j].moment : &c->turned[j].force;
    list->hold_spin = to_ground(k, j, vector_scale(g, pivot->D_inverse, row_of(spin, joint->axis)));
    list->hold_turned = to_ground(k, j, vector_scale(g, pivot->D_inverse, row_of(turned, joint->axis)));
    for (int order = 0; order < 2; order++)
        begin_single_column(c, stage, &carried, order);
    /* By a unit force: V = response of U / D, x = 1 / D + U . V / D. The response gains the same values along
     * the joint's axis: R - e V^T - V e^T + e e^T x. */
    const struct wrench V = respond(g, &carried, pivot->U_over_D), none = {{{0}}, {{0}}};
    const expression x = expr_add(g, pivot->D_inverse, wrench_dot(g, pivot->U_over_D, V));
    const struct wrench z = along(g, joint, wrench_sub(g, none, V), x);
    set_start(c, j, j, z);
    struct articulated *response = &c->response[j];
    *response = carried;
    const int axis = joint->axis;
    struct tensor *same = joint->is_revolute ? &response->M : &response->J;
    const struct vector with = joint->is_revolute ? V.moment : V.force,
                        across = joint->is_revolute ? V.force : V.moment;
    for (int i = 0; i < 3; i++) {
        expression *at = &same->at[tensor_index(axis, i)];
        *at = expr_sub(g, *at, with.at[i]);
        if (i == axis)
            *at = expr_add(g, expr_sub(g, *at, with.at[i]), x);
        at = &response->H.at[joint->is_revolute ? 3 * i + axis : 3 * axis + i];
        *at = expr_sub(g, *at, across.at[i]);
    }
}

/* With the moment m in the joint and p of the bodies beyond: y = J^-1 (m - n_p), f_p + H^T y is passed on,
 * and wd = y - J^-1 H a with a the acceleration of the joint's origin. */
static void begin_ball_column(struct columns *c, const struct stage *stage, const struct turns *turns,
                              const struct articulated *carried, int number, int order) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const int j = stage->first + number, last = stage->last;
    const struct ball *ball = &stage->ball;
    const struct carried_change change = change_of(c, j, last, order);
    const struct wrench p = pressed(c, last, &change), load = turned_load(c, j, last, order);
    expression f[3];
    for (int r = 0; r < 3; r++) {
        f[r] = expr_neg(g, c->own[order][stage->first + r].at[number]);
        if (r < number) /* a turn nearer to the ground feels how this one turns the load */
            f[r] = expr_sub(g, f[r], vector_dot(g, turns->axis[r], load.moment));
    }
    const struct vector m = moment_of(g, turns, f);
    const struct vector y = articulated_body_solve_ball(g, ball, vector_sub(g, m, p.moment));
    const struct vector force = vector_add(g, p.force, matrix_transpose_times(g, ball->H.at, y));
    const struct wrench push = wrench_add(g, (struct wrench){m, force}, load), none = {{{0}}, {{0}}};
    const struct wrench inside = wrench_sub(g, none, respond(g, carried, push));
    const struct vector wd = vector_sub(g, y, matrix_times(g, ball->J_inverse_H.at, inside.force));
    const struct vector turn = vector_sub(g, wd, inside.moment);
    struct vector own;
    for (int r = 0; r < 3; r++)
        own.at[r] = vector_dot(g, turns->row[r], turn);
    set_column_of(c, j, last, order, &change, push, (struct wrench){wd, inside.force}, own);
}

static void hold_ball(struct columns *c, const struct stage *stage, const struct turns *turns) {
    const struct kinematics *k = c->k;
    const int last = stage->last;
    struct matrix spin, turned;
    for (int column = 0; column < 3; column++) {
        set_column(&spin, column,
                   articulated_body_solve_ball(k->g, &stage->ball, column_of(&c->spin[last].moment, column)));
        set_column(
            &turned, column,
            articulated_body_solve_ball(k->g, &stage->ball, column_of(&c->turned[last].moment, column)));
    }
    const struct matrix force = matrix_to_ground(k, last, stage->ball.J_inverse_H);
    spin = matrix_to_ground(k, last, spin);
    turned = matrix_to_ground(k, last, turned);
    for (int r = 0; r < 3; r++) {
        struct acceleration_columns *list = &c->list[stage->first + r];
        list->turn = to_ground(k, last, turns->row[r]);
        list->turned = to_ground(k, last, turns->axis[r]);
        list->hold_force = row_of(&force, r);
        list->hold_spin = row_of(&spin, r);
        list->hold_turned = row_of(&turned, r);
    }
}

/* With G = J^-1 H and Phi the carried response of the linear acceleration to forces, the response after the
 * joint is [J^-1 + G Phi G^T, -G Phi; -Phi G^T, Phi]. */
static void begin_ball(struct columns *c, int last) {
    const struct kinematics *k = c->k;
    struct graph *g = k->g;
    const struct stage *stage = &c->elimination->stages[last];
    const struct ball *ball = &stage->ball;
    const struct articulated carried = carried_response(c, last);
    const struct turns turns = turns_of(k, stage);
    struct articulated *response = &c->response[last];
    const struct matrix Phi = full(carried.J), G = ball->J_inverse_H, GT = transposed(G),
                        crossed = matrix_product(g, Phi.at, GT.at),
                        more = matrix_product(g, G.at, crossed.at);
    struct matrix J_inverse;
    hold_ball(c, stage, &turns);
    for (int column = 0; column < 3; column++)
        set_column(&J_inverse, column, articulated_body_solve_ball(g, ball, vector_unit(column)));
    response->J = carried.J;
    response->M = tensor_add(g, upper(J_inverse), upper(more));
    for (int i = 0; i < 9; i++)
        response->H.at[i] = expr_neg(g, crossed.at[i]);
    for (int number = 0; number < 3; number++) {
        for (int order = 0; order < 2; order++)
            begin_ball_column(c, stage, &turns, &carried, number, order);
        const struct vector y = articulated_body_solve_ball(g, ball, turns.row[number]);
        const struct vector linear =
            vector_add(g, matrix_times(g, carried.H.at, turns.row[number]),
                       matrix_times(g, Phi.at, matrix_transpose_times(g, ball->H.at, y)));
        set_start(c, stage->first + number, last,
                  (struct wrench){vector_add(g, y, matrix_times(g, G.at, linear)),
                                  vector_scale(g, expr_neg(g, EXPR_ONE), linear)});
    }
}

static void begin_columns(struct columns *c) {
    const struct kinematics *k = c->k;
    const struct elimination *elimination = c->elimination;
    struct recursion outward = kinematics_recursion(k, c->response, sizeof *c->response);
    for (int i = -1; recursion_outward(&outward, &i);) {
        if (!elimination->ends_stage[i]) {
            c->response[i] = carried_response(c, i);
            continue;
        }
        kinematics_remark(k, i, "the columns of d(qdd) begin: p = IA alpha + Q beta (7.7)");
        if (elimination->stages[i].last > elimination->stages[i].first)
            begin_ball(c, i);
        else
            begin_single(c, i);
    }
}

/* ---- Bodies with several branches ---- */

bool acceleration_columns_branch(const struct tree *tree, int frame) {
    int branches = 0;
    for (int i = frame + 1; i < tree->count && branches < 2; i++)
        branches += tree->frames[i].parent == frame;
    return branches > 1;
}

/* The response of such a frame, column by column, in the ground's axes. */
static void set_units(const struct columns *c, int i) {
    const struct kinematics *k = c->k;
    const struct articulated *response = &c->response[i];
    const struct matrix J = matrix_to_ground(k, i, full(response->J)),
                        H = matrix_to_ground(k, i, response->H),
                        M = matrix_to_ground(k, i, full(response->M));
    for (int a = 0; a < 3; a++) {
        c->list[i].units[a] = (struct wrench){column_of(&M, a), column_of(&H, a)};
        c->list[i].units[3 + a] = (struct wrench){row_of(&H, a), column_of(&J, a)};
    }
}

static void begin_branches(const struct columns *c) {
    for (int i = 0; i < c->k->tree->count; i++)
        if (acceleration_columns_branch(c->k->tree, i)) {
            kinematics_remark(c->k, i, "the response to unit wrenches before the body branches (7.7)");
            set_units(c, i);
        }
}

struct acceleration_columns *acceleration_columns_derive(const struct given_motion *given,
                                                         const struct elimination *elimination,
                                                         const struct applied_forces *applied_forces,
                                                         struct vector *const own[2]) {
    const struct kinematics *k = given->k;
    const size_t n = (size_t)k->tree->count + 1;
    struct columns c = {.given = given, .k = k, .elimination = elimination, .own = own};
    c.spin = memory_get(k->memory, n * sizeof *c.spin);
    c.turned = memory_get(k->memory, n * sizeof *c.turned);
    c.load = memory_get(k->memory, n * sizeof *c.load);
    c.response = memory_get(k->memory, n * sizeof *c.response);
    c.list = memory_get(k->memory, n * sizeof *c.list);
    sum_spins(&c);
    sum_loads(&c, applied_forces);
    begin_columns(&c);
    begin_branches(&c);
    return c.list;
}
