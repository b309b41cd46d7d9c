/*
 * The motion at given accelerations, and its derivatives by one coordinate at a time, while the accelerations
 * of the coordinates stay the same: exact derivatives of the equations consist of them.
 *
 * Input: kinematics and accelerations by frame. Output: the accelerations of frames and points and, for an
 * expression in symbols, its derivatives by q and qd (theory, sect. 7.1 and 7.2). The columns of C and their
 * first two time derivatives suffice: a point's symbol of order i has the derivative (i over o)
 * d^(i-o)C_j/dt^(i-o) by coordinate j's symbol of order o, since r = r(q, t) makes derivatives by q and by t
 * commute.
 */
#include "gen/tangent/tangent.h"
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

/* C_j, dC_j/dt and d2C_j/dt2 of one point or direction: one column for each frame. */
struct column_rates {
    struct vector *by_order[3];
};

static struct vector to_ground(const struct kinematics *k, int i, struct vector a) {
    return matrix_times(k->g, k->frames[i].rotation.at, a);
}

struct matrix given_motion_gradient(const struct given_motion *given, int i) {
    return kinematics_acceleration_gradient(given->k->g, given->k->frames[i].angular,
                                            given->motions[i].angular);
}

/* wd = E wd_p + w x e qd + e qdd, the last two for a revolute joint; a = E (a_p + s''). Theory, sect. 7.1. */
static void accelerate_frame(struct given_motion *given, int i, const struct given_frame_motion *parent) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    struct given_frame_motion *motion = &given->motions[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    motion->angular = kinematics_to_child(k, i, parent->angular);
    motion->less_gravity =
        kinematics_to_child(k, i, vector_add(g, parent->less_gravity, given->frames[i].shift_rate2));
    if (k->tree->frames[i].kind == FRAME_JOINT && joint->is_revolute) {
        const struct vector e = vector_unit(joint->axis);
        const struct vector gyration =
            vector_scale(g, kinematics_coordinate_of(k, i, 1), vector_cross(g, k->frames[i].angular, e));
        motion->angular = vector_add(g, motion->angular, gyration);
        motion->angular = vector_add(g, motion->angular, vector_scale(g, given->accelerations[i], e));
    }
    kinematics_name_vector(k, i, "wd", motion->angular);
    kinematics_name_vector(k, i, "a_falling", motion->less_gravity);
}

/* e' = w x e, e'' = B e: theory, sect. 7.1. */
static void turn_axis(struct given_motion *given, int i) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    struct given_frame_rates *frame = &given->frames[i];
    const struct frame_motion *m = &k->frames[i];
    const struct vector e = vector_unit(k->tree->frames[i].joint.axis);
    frame->own_rate = vector_cross(g, m->angular, e);
    frame->own_rate2 = matrix_times(g, given_motion_gradient(given, i).at, e);
    frame->axis = kinematics_joint_axis(k, i);
    frame->axis_rate = to_ground(k, i, frame->own_rate);
    frame->axis_rate2 = to_ground(k, i, frame->own_rate2);
    kinematics_name_vector(k, i, "axis_rate", frame->axis_rate);
    kinematics_name_vector(k, i, "axis_rate2", frame->axis_rate2);
}

/* s' = w_p x s + e qd, s'' = B_p s + 2 w_p x e qd + e qdd; the terms with e are those of a prismatic
 * joint: theory, sect. 7.1. */
static void move_shift(struct given_motion *given, int i) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    const struct vector s = k->joints[i].shift, still = {{0, 0, 0}};
    const struct vector w = frame->parent < 0 ? still : k->frames[frame->parent].angular;
    struct vector slide = still, speed = still, gain = still;
    if (frame->kind == FRAME_JOINT && !frame->joint.is_revolute) {
        slide = matrix_times(g, frame->placement.rotation, vector_unit(frame->joint.axis));
        slide = kinematics_from_body(k, frame->parent, slide);
        speed = vector_scale(g, kinematics_coordinate_of(k, i, 1), slide);
        gain = vector_scale(g, given->accelerations[i], slide);
    }
    const struct vector carried = vector_cross(g, w, s), coriolis = vector_cross(g, w, speed);
    const struct vector swing =
        frame->parent < 0 ? still : matrix_times(g, given_motion_gradient(given, frame->parent).at, s);
    given->frames[i].shift_rate = vector_add(g, carried, speed);
    given->frames[i].shift_rate2 =
        vector_add(g, vector_add(g, swing, gain), vector_add(g, coriolis, coriolis));
}

/* Velocity and acceleration of the origin in the ground frame: the parent's plus s', s''. Coinciding
 * origins get the same expression. */
static void move_origin(struct given_motion *given, int i) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    struct given_frame_motion *motion = &given->motions[i];
    struct given_frame_rates *frame = &given->frames[i];
    const int parent = k->tree->frames[i].parent;
    motion->velocity = frame->shift_rate;
    motion->acceleration = frame->shift_rate2;
    if (parent < 0)
        return;
    const struct given_frame_motion *base = &given->motions[parent];
    const struct vector shift_rate = to_ground(k, parent, frame->shift_rate);
    frame->way_rate = vector_add(g, base->pending_rate, shift_rate);
    if (k->tree->frames[i].kind != FRAME_JOINT)
        motion->pending_rate = frame->way_rate;
    motion->velocity = vector_add(g, base->velocity, shift_rate);
    motion->acceleration = vector_add(g, base->acceleration, to_ground(k, parent, frame->shift_rate2));
}

/* rdd = R (a + B rho) + grav, where a is the acceleration of the frame's origin minus gravity. */
static struct vector accelerate_point(const struct given_motion *given, int index) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[index];
    const struct vector rho = kinematics_from_body(k, fixed->frame, vector_of(fixed->placement.position)),
                        still = {{0, 0, 0}};
    if (fixed->frame < 0)
        return still;
    const struct given_frame_motion *motion = &given->motions[fixed->frame];
    const struct vector swing = matrix_times(g, given_motion_gradient(given, fixed->frame).at, rho);
    if (k->model->points[index].is_direction)
        return to_ground(k, fixed->frame, swing);
    const struct vector less_gravity = to_ground(k, fixed->frame, vector_add(g, motion->less_gravity, swing));
    return vector_add(g, less_gravity, vector_of(k->model->gravity));
}

/* The motion of frame i, one step from its parent's. */
static void hold_frame(struct given_motion *given, int i) {
    const struct kinematics *k = given->k;
    const struct vector gravity = vector_of(k->model->gravity);
    const struct given_frame_motion ground = {.less_gravity =
                                                  vector_scale(k->g, expr_neg(k->g, EXPR_ONE), gravity)};
    const int parent = k->tree->frames[i].parent;
    kinematics_remark(k, i, "wd = E wd_p + w x e qd + e qdd, a = E (a_p + s'') (7.1)");
    given->motions[i] = (struct given_frame_motion){.angular = {{0, 0, 0}}};
    move_shift(given, i);
    accelerate_frame(given, i, parent < 0 ? &ground : &given->motions[parent]);
    if (k->tree->frames[i].kind == FRAME_JOINT)
        turn_axis(given, i);
    move_origin(given, i);
}

struct given_motion *given_motion_derive(const struct kinematics *k, const expression *accelerations,
                                         const expression *multipliers) {
    struct given_motion *given = memory_get(k->memory, sizeof *given);
    *given = (struct given_motion){.k = k, .accelerations = accelerations, .multipliers = multipliers};
    given->frames = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *given->frames);
    given->motions = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *given->motions);
    given->points = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *given->points);
    given->columns = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *given->columns);
    struct recursion motions = kinematics_recursion(k, given->motions, sizeof *given->motions);
    for (int i = -1; recursion_outward(&motions, &i);)
        hold_frame(given, i);
    for (int i = 0; i < k->model->marker_count; i++)
        given->points[i] = accelerate_point(given, i);
    return given;
}

struct given_motion *given_motion_at_rest(const struct kinematics *k) {
    struct given_motion *given = memory_get(k->memory, sizeof *given);
    *given = (struct given_motion){.k = k, .is_resting = true};
    return given;
}

/* C_j' = e' x rho + e x rho', C_j'' = e'' x rho + 2 e' x rho' + e x rho'' of a revolute joint, e', e'' of
 * a prismatic one; rho is the arm from the joint, or the direction itself. Theory, sect. 7.2. */
static void derive_column(const struct given_motion *given, int index, int j, struct vector **by_order) {
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const struct given_frame_rates *frame = &given->frames[j];
    const struct given_frame_motion *motion = &given->motions[j];
    const struct point_motion *point = &k->points[index];
    const bool is_direction = k->model->points[index].is_direction;
    const struct vector axis[3] = {frame->axis, frame->axis_rate, frame->axis_rate2};
    struct vector arm[3] = {point->r, point->rd, given->points[index]};
    const struct vector origin[3] = {k->frames[j].position, motion->velocity, motion->acceleration};
    if (!kinematics_is_on_path(k, j, k->tree->points[index].frame))
        return;
    for (int o = 0; o < 3 && !is_direction; o++)
        arm[o] = vector_sub(g, arm[o], origin[o]);
    if (!k->tree->frames[j].joint.is_revolute) {
        for (int o = 1; o < 3 && !is_direction; o++)
            by_order[o][j] = axis[o];
        return;
    }
    const struct vector middle = vector_cross(g, axis[1], arm[1]);
    by_order[1][j] = vector_add(g, vector_cross(g, axis[1], arm[0]), vector_cross(g, axis[0], arm[1]));
    by_order[2][j] =
        vector_add(g, vector_add(g, vector_cross(g, axis[2], arm[0]), vector_cross(g, axis[0], arm[2])),
                   vector_add(g, middle, middle));
}

static const struct column_rates *column_rates(struct given_motion *given, int point) {
    const struct kinematics *k = given->k;
    struct column_rates *rates = &given->columns[point];
    if (rates->by_order[0])
        return rates;
    graph_remark(k->g, memory_format(k->memory, "%s: C_j' = e' x rho + e x rho', C_j'' (7.2)",
                                     k->model->points[point].name));
    rates->by_order[0] = k->points[point].columns;
    for (int o = 1; o < 3; o++)
        rates->by_order[o] = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof(struct vector));
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);)
        derive_column(given, point, j, rates->by_order);
    return rates;
}

static expression place_symbol(void *context, struct graph *g, expression e) {
    const struct given_motion *given = context;
    const struct kinematics *k = given->k;
    const struct symbol s = *expr_as_symbol(g, e);
    if (given->is_resting && coordinate_derivatives_rests(k, &s))
        return EXPR_ZERO;
    if (s.kind == SYMBOL_MULTIPLIER && given->multipliers)
        return given->multipliers[s.index];
    if (s.kind == SYMBOL_COORDINATE && s.order == 2)
        return given->accelerations[k->tree->frame_of[s.index]];
    if (s.kind != SYMBOL_POINT)
        return e;
    const struct point_motion *point = &k->points[s.index / 3];
    if (s.order == 2)
        return given->points[s.index / 3].at[s.index % 3];
    return (s.order ? point->rd : point->r).at[s.index % 3];
}

expression given_motion_place(const struct given_motion *given, expression e) {
    rewrite_substitute(given->k->g, place_symbol, (void *)given, &e, &e, 1);
    return e;
}

struct vector given_motion_place_vector(const struct given_motion *given, struct vector v) {
    for (int a = 0; a < 3; a++)
        v.at[a] = given_motion_place(given, v.at[a]);
    return v;
}

/* derivatives_j += weight . C_j, or . C_j', C_j'': the contribution of one point's symbol. At rest C_j'
 * and C_j'' are zero. */
static void add_point_derivatives(struct given_motion *given, int point, struct vector weight, int rate_order,
                                  expression *derivatives) {
    const struct kinematics *k = given->k;
    if (vector_is_zero(weight) || (given->is_resting && rate_order > 0))
        return;
    const struct vector *columns =
        rate_order ? column_rates(given, point)->by_order[rate_order] : k->points[point].columns;
    for (int j = -1; recursion_next_joint(k->g, k->tree, &j);)
        derivatives[j] = expr_add(k->g, derivatives[j], vector_dot(k->g, weight, columns[j]));
}

/* de/dq_j^(o) = its own part + sum over i >= o of (i over o) (de/dr^(i)) . d^(i-o)C_j/dt^(i-o), theory,
 * sect. 7.2. */
expression *given_motion_derivatives(struct given_motion *given, expression e, int order) {
    static const double over[3][3] = {{1, 0, 0}, {1, 1, 0}, {1, 2, 1}}; /* (i over o) */
    const struct kinematics *k = given->k;
    struct graph *g = k->g;
    const int n = k->tree->count, markers = k->model->marker_count;
    expression *derivatives = memory_get(k->memory, ((size_t)n + 1) * sizeof *derivatives);
    for (int i = order; i < 3; i++) {
        expression *partial = coordinate_derivatives_symbol_gradient(k, e, i, given->is_resting);
        rewrite_substitute(g, place_symbol, given, partial, partial, n + 3 * markers);
        for (int j = 0; j < n && i == order; j++)
            derivatives[j] = expr_add(g, derivatives[j], partial[j]); /* of frames that are in no run */
        for (int p = 0; p < markers; p++) {
            const struct vector weight = vector_of(partial + n + 3 * p);
            add_point_derivatives(given, p, vector_scale(g, expr_number(g, over[i][order]), weight),
                                  i - order, derivatives);
        }
    }
    return derivatives;
}
