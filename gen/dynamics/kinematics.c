/*
 * Kinematics from the base outward: rotations, velocities and bias accelerations of frames and points.
 *
 * Input: the tree. Output: expressions in each frame's own axes (theory, sect. 4.1 to 4.4). A bias
 * acceleration is the acceleration at qdd = 0, sum_jk T_jk qd_j qd_k of theory, sect. 2.1. Points are in the
 * ground frame.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

/* The frame of a coordinate; in a run, the coordinate may belong to a later element. */
static int frame_of(const struct tree *tree, int coordinate) {
    int i = tree->count - 1;
    while (tree->frames[i].kind != FRAME_JOINT || tree->frames[i].coordinate > coordinate)
        i--;
    return i;
}

/* Returns whether neither frame carries the other. */
static bool are_apart(const struct kinematics *k, int i, int j) {
    return !kinematics_is_on_path(k, i, j) && !kinematics_is_on_path(k, j, i);
}

/* A value that frames of one path share is named after the first of them; a value that other frames share
 * is named after none. The same applies to x if they have -x. */
void kinematics_name_scalar(const struct kinematics *k, int i, const char *what, expression e) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    const expression value = g->nodes[e].operation == OP_NEG ? g->nodes[e].operand[0] : e;
    int *owner = &g->name_owners[value];
    if (operation_arity(g->nodes[value].operation) == 0)
        return;
    if (*owner && frame->kind == FRAME_JOINT && are_apart(k, frame_of(k->tree, *owner - 1), i)) {
        g->names[value] = memory_format(k->memory, "shared_%s", what);
        *owner = 0;
    } else if (!g->names[value]) {
        *owner = frame->kind == FRAME_JOINT ? frame->coordinate + 1 : 0;
        graph_name_value(g, e, memory_format(k->memory, "%s_%s", frame->name, what));
    }
}

void kinematics_name_vector(const struct kinematics *k, int i, const char *what, struct vector a) {
    static const char axes[3] = "xyz";
    for (int axis = 0; axis < 3; axis++)
        kinematics_name_scalar(k, i, memory_format(k->memory, "%s_%c", what, axes[axis]), a.at[axis]);
}

void kinematics_name_matrix(const struct kinematics *k, int i, const char *what, const struct matrix *m) {
    static const char axes[3] = "xyz";
    for (int row = 0; row < 3; row++)
        kinematics_name_vector(k, i, memory_format(k->memory, "%s_%c", what, axes[row]),
                               vector_of(m->at + 3 * row));
}

void kinematics_remark(const struct kinematics *k, int i, const char *formula) {
    graph_remark(k->g, memory_format(k->memory, "%s: %s", k->tree->frames[i].name, formula));
}

/* Rot(axis)^T a for the cosine and sine given; Rot(axis) a with the sine negated. */
static struct vector turn_into(struct graph *g, int axis, expression cosine, expression sine,
                               struct vector a) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3;
    const expression aj = a.at[j], al = a.at[l];
    a.at[j] = expr_add(g, expr_mul(g, cosine, aj), expr_mul(g, sine, al));
    a.at[l] = expr_sub(g, expr_mul(g, cosine, al), expr_mul(g, sine, aj));
    return a;
}

struct vector kinematics_from_body(const struct kinematics *k, int i, struct vector a) {
    if (i < 0 || !k->tree->frames[i].keeps_axes)
        return a;
    const struct frame_motion *motion = &k->frames[i];
    return turn_into(k->g, k->tree->frames[i].joint.axis, motion->cosine, expr_neg(k->g, motion->sine), a);
}

static struct vector to_body(const struct kinematics *k, int i, struct vector a) {
    if (i < 0 || !k->tree->frames[i].keeps_axes)
        return a;
    return turn_into(k->g, k->tree->frames[i].joint.axis, k->frames[i].cosine, k->frames[i].sine, a);
}

static bool turns_axes(const struct frame *frame) {
    return frame->joint.is_revolute && !frame->keeps_axes;
}

struct vector kinematics_to_child(const struct kinematics *k, int i, struct vector a) {
    const struct frame *frame = &k->tree->frames[i];
    const struct joint_place *place = &k->joints[i];
    if (!frame->goes_on)
        a = matrix_transpose_times(k->g, frame->placement.rotation, to_body(k, frame->parent, a));
    return turns_axes(frame) ? turn_into(k->g, frame->joint.axis, place->cosine, place->sine, a) : a;
}

struct vector kinematics_to_parent(const struct kinematics *k, int i, struct vector a) {
    const struct frame *frame = &k->tree->frames[i];
    const struct joint_place *place = &k->joints[i];
    if (turns_axes(frame))
        a = turn_into(k->g, frame->joint.axis, place->cosine, expr_neg(k->g, place->sine), a);
    return frame->goes_on
               ? a
               : kinematics_from_body(k, frame->parent, matrix_times(k->g, frame->placement.rotation, a));
}

/*
 * Rot(axis) T Rot(axis)^T: with w = s (jj - ll) + 2 c jl the block across the axis is jj - s w, ll + s w, c w
 * - jl. No diagonal term is a difference from the trace: the inertia of a slender link about its axis is a
 * millionth of the others and would be lost in rounding. s w is small when the angle is.
 */
static struct tensor tensor_turn_axis(struct graph *g, int axis, expression c, expression s,
                                      struct tensor t) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3;
    const int jj = j, ll = l, jl = tensor_index(j, l), ja = tensor_index(j, axis), la = tensor_index(l, axis);
    const expression across = expr_mul(g, c, expr_add(g, t.at[jl], t.at[jl]));
    const expression w = expr_add(g, expr_mul(g, s, expr_sub(g, t.at[jj], t.at[ll])), across);
    const expression moved = expr_mul(g, s, w);
    struct tensor turned = t;
    turned.at[jj] = expr_sub(g, t.at[jj], moved);
    turned.at[ll] = expr_add(g, t.at[ll], moved);
    turned.at[jl] = expr_sub(g, expr_mul(g, c, w), t.at[jl]);
    turned.at[ja] = expr_sub(g, expr_mul(g, c, t.at[ja]), expr_mul(g, s, t.at[la]));
    turned.at[la] = expr_add(g, expr_mul(g, s, t.at[ja]), expr_mul(g, c, t.at[la]));
    return turned;
}

/* The same by the double angle: four more operations, but a recursion waits for two fewer. Without it, qdd
 * of the manipulator with 16 elements took up to a fifth longer. */
static struct tensor tensor_turn_axis_quickly(struct graph *g, int axis, expression c, expression s,
                                              struct tensor t) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3, jl = tensor_index(j, l);
    const expression ss = expr_mul(g, s, s), sc = expr_mul(g, s, c), twice = expr_add(g, sc, sc);
    const expression cos2 = expr_sub(g, EXPR_ONE, expr_add(g, ss, ss)),
                     difference = expr_sub(g, t.at[j], t.at[l]);
    const expression moved = expr_add(g, expr_mul(g, ss, difference), expr_mul(g, twice, t.at[jl]));
    struct tensor turned = tensor_turn_axis(g, axis, c, s, t);
    turned.at[j] = expr_sub(g, t.at[j], moved);
    turned.at[l] = expr_add(g, t.at[l], moved);
    turned.at[jl] = expr_add(g, expr_mul(g, cos2, t.at[jl]), expr_mul(g, sc, difference));
    return turned;
}

struct tensor kinematics_tensor_from_body(const struct kinematics *k, int i, struct tensor t) {
    if (i < 0 || !k->tree->frames[i].keeps_axes)
        return t;
    return tensor_turn_axis(k->g, k->tree->frames[i].joint.axis, k->frames[i].cosine, k->frames[i].sine, t);
}

/* Undoes the joint's turn: into the axes of the parent. */
static struct tensor tensor_off_joint(const struct kinematics *k, int i, struct tensor t) {
    const struct frame *frame = &k->tree->frames[i];
    return frame->goes_on ? t
                          : kinematics_tensor_from_body(k, frame->parent,
                                                        tensor_turn(k->g, frame->placement.rotation, t));
}

struct tensor kinematics_tensor_to_parent_quickly(const struct kinematics *k, int i, struct tensor t) {
    const struct frame *frame = &k->tree->frames[i];
    const struct joint_place *place = &k->joints[i];
    if (turns_axes(frame))
        t = tensor_turn_axis_quickly(k->g, frame->joint.axis, place->cosine, place->sine, t);
    return tensor_off_joint(k, i, t);
}

struct tensor kinematics_tensor_to_parent(const struct kinematics *k, int i, struct tensor t) {
    const struct frame *frame = &k->tree->frames[i];
    const struct joint_place *place = &k->joints[i];
    if (turns_axes(frame))
        t = tensor_turn_axis(k->g, frame->joint.axis, place->cosine, place->sine, t);
    return tensor_off_joint(k, i, t);
}

expression kinematics_coordinate_of(const struct kinematics *k, int i, int order) {
    const struct frame *frame = &k->tree->frames[i];
    if (frame->run >= 0)
        return expr_symbol(k->g, SYMBOL_ELEMENT, i, order);
    return expr_symbol(k->g, SYMBOL_COORDINATE, frame->coordinate, order);
}

bool kinematics_is_on_path(const struct kinematics *k, int outer, int i) {
    while (i > outer)
        i = k->tree->frames[i].parent;
    return i == outer;
}

/* a + B r: acceleration at r in a frame whose origin has the acceleration a. */
static struct vector carried_acceleration(struct graph *g, const struct frame_motion *m, struct vector a,
                                          struct vector r) {
    return vector_add(g, a, matrix_times(g, m->gradient.at, r));
}

struct matrix kinematics_acceleration_gradient(struct graph *g, struct vector w, struct vector wd) {
    struct matrix gradient;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        const expression across = expr_mul(g, w.at[i], w.at[j]);
        gradient.at[4 * i] =
            expr_neg(g, expr_add(g, expr_mul(g, w.at[j], w.at[j]), expr_mul(g, w.at[l], w.at[l])));
        gradient.at[3 * i + j] = expr_sub(g, across, wd.at[l]);
        gradient.at[3 * j + i] = expr_add(g, across, wd.at[l]);
    }
    return gradient;
}

/* s_i = x_A, of a prismatic joint x_A + R_A e q: theory, sect. 4.1. */
static void place_joint(struct kinematics *k, int i) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    struct joint_place *place = &k->joints[i];
    place->shift = kinematics_from_body(k, frame->parent, vector_of(frame->placement.position));
    if (frame->kind != FRAME_JOINT)
        return;
    const struct vector axis = vector_unit(frame->joint.axis);
    const expression q = kinematics_coordinate_of(k, i, 0);
    if (frame->joint.is_revolute) {
        place->sine = expr_apply1(g, OP_SIN, q);
        place->cosine = expr_apply1(g, OP_COS, q);
        kinematics_name_scalar(k, i, "sin", place->sine);
        kinematics_name_scalar(k, i, "cos", place->cosine);
    } else {
        const struct vector slide = vector_scale(g, q, axis);
        const struct vector carried = matrix_times(g, frame->placement.rotation, slide);
        place->shift = vector_add(g, place->shift, kinematics_from_body(k, frame->parent, carried));
        kinematics_name_vector(k, i, "shift", place->shift);
    }
}

/*
 * Cosine and sine of the angle from the frame's axes to those of its body (theory, sect. 4.12): a sum of
 * joint angles. The addition theorems compute them from the sines and cosines of the coordinates, which are
 * all computed in one pass.
 */
static void turn_body(struct kinematics *k, int i, const struct frame_motion *parent) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    const struct joint_place *place = &k->joints[i];
    struct frame_motion *motion = &k->frames[i];
    motion->cosine = frame->goes_on ? parent->cosine : EXPR_ONE;
    motion->sine = frame->goes_on ? parent->sine : EXPR_ZERO;
    if (!frame->keeps_axes || frame->kind != FRAME_JOINT)
        return;
    const expression c = motion->cosine, s = motion->sine;
    motion->cosine = expr_sub(g, expr_mul(g, c, place->cosine), expr_mul(g, s, place->sine));
    motion->sine = expr_add(g, expr_mul(g, s, place->cosine), expr_mul(g, c, place->sine));
    kinematics_name_scalar(k, i, "body_cos", motion->cosine);
    kinematics_name_scalar(k, i, "body_sin", motion->sine);
}

/* R_i = R_p E_i^T, r_i = r_p + R_p s_i (theory, sect. 4.1). The rows of R are the ground's axes in the
 * frame's axes, so that each is E_i times the parent's row. */
static void place_in_ground(struct kinematics *k, int i, const struct frame_motion *parent) {
    struct graph *g = k->g;
    struct frame_motion *motion = &k->frames[i];
    for (int row = 0; row < 3; row++) {
        const struct vector own = kinematics_to_child(k, i, vector_of(parent->rotation.at + 3 * row));
        for (int column = 0; column < 3; column++)
            motion->rotation.at[3 * row + column] = own.at[column];
    }
    motion->position =
        vector_add(g, parent->position, matrix_times(g, parent->rotation.at, k->joints[i].shift));
    kinematics_name_vector(k, i, "position", motion->position);
    kinematics_name_matrix(k, i, "ground", &motion->rotation);
}

struct vector kinematics_gyroscopic(const struct kinematics *k, int i, struct vector wd) {
    const struct vector axis = vector_unit(k->tree->frames[i].joint.axis);
    const struct vector rate = vector_scale(k->g, kinematics_coordinate_of(k, i, 1), axis);
    return vector_add(k->g, wd, vector_cross(k->g, k->frames[i].angular, rate));
}

/* Adds the joint's own motion. Revolute: wd0 += w x e qd, w += e qd. Prismatic: v += e qd, a0 += 2 w x e
 * qd. Theory, sect. 4.2 and 4.3. */
static void add_joint_motion(struct kinematics *k, int i) {
    struct graph *g = k->g;
    struct frame_motion *motion = &k->frames[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct vector rate = vector_scale(g, kinematics_coordinate_of(k, i, 1), vector_unit(joint->axis));
    const struct vector none = {{0, 0, 0}}, gyration = kinematics_gyroscopic(k, i, none);
    if (joint->is_revolute) {
        motion->bias_angular = vector_add(g, motion->bias_angular, gyration);
        motion->angular = vector_add(g, motion->angular, rate);
    } else {
        const struct vector coriolis = vector_add(g, gyration, gyration);
        motion->linear = vector_add(g, motion->linear, rate);
        motion->bias_linear = vector_add(g, motion->bias_linear, coriolis);
        motion->bias_less_gravity = vector_add(g, motion->bias_less_gravity, coriolis);
    }
}

/* w = E w_p, v = E (v_p + w_p x s), wd0 = E wd0_p, a0 = E (a0_p + B_p s), then the joint's own motion:
 * theory, sect. 4.2 and 4.3. */
static void move_frame(struct kinematics *k, int i, const struct frame_motion *parent) {
    struct graph *g = k->g;
    struct frame_motion *m = &k->frames[i];
    const struct vector r = k->joints[i].shift;
    m->angular = kinematics_to_child(k, i, parent->angular);
    m->linear = kinematics_to_child(k, i, vector_add(g, parent->linear, vector_cross(g, parent->angular, r)));
    m->bias_angular = kinematics_to_child(k, i, parent->bias_angular);
    m->bias_linear = kinematics_to_child(k, i, carried_acceleration(g, parent, parent->bias_linear, r));
    m->bias_less_gravity =
        kinematics_to_child(k, i, carried_acceleration(g, parent, parent->bias_less_gravity, r));
    m->gravity = kinematics_to_child(k, i, parent->gravity);
    if (k->tree->frames[i].kind == FRAME_JOINT)
        add_joint_motion(k, i);
    m->gradient = kinematics_acceleration_gradient(g, m->angular, m->bias_angular);
    kinematics_name_vector(k, i, "w", m->angular);
    kinematics_name_vector(k, i, "v", m->linear);
    kinematics_name_vector(k, i, "bias_wd", m->bias_angular);
    kinematics_name_vector(k, i, "bias_a", m->bias_linear);
    kinematics_name_vector(k, i, "bias_a_falling", m->bias_less_gravity);
    kinematics_name_vector(k, i, "gravity", m->gravity);
}

/* The ground is at rest; minus gravity its acceleration is -grav. */
static struct frame_motion ground_motion(const struct kinematics *k) {
    struct frame_motion ground = {.rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    ground.gravity = vector_of(k->model->gravity);
    ground.bias_less_gravity = vector_scale(k->g, expr_neg(k->g, EXPR_ONE), ground.gravity);
    return ground;
}

struct vector kinematics_joint_axis(const struct kinematics *k, int i) {
    const struct vector axis = vector_unit(k->tree->frames[i].joint.axis);
    return matrix_times(k->g, k->frames[i].rotation.at, axis);
}

/* C_i = e x (r - r_i), for a direction e x r; for a prismatic joint e, for a direction 0: theory, sect.
 * 4.4. */
static struct vector point_column(const struct kinematics *k, int i, struct vector r, bool is_direction) {
    const struct vector axis = kinematics_joint_axis(k, i), still = {{0, 0, 0}};
    if (!k->tree->frames[i].joint.is_revolute)
        return is_direction ? still : axis;
    return vector_cross(k->g, axis, is_direction ? r : vector_sub(k->g, r, k->frames[i].position));
}

static void name_point(struct kinematics *k, int index) {
    static const char axes[3] = "xyz";
    const struct point_motion *point = &k->points[index];
    const char *name = k->model->points[index].name;
    for (int a = 0; a < 3; a++) {
        graph_name_value(k->g, point->r.at[a], memory_format(k->memory, "point_%s_%c", name, axes[a]));
        graph_name_value(k->g, point->rd.at[a], memory_format(k->memory, "point_%s_%cd", name, axes[a]));
        graph_name_value(k->g, point->d.at[a], memory_format(k->memory, "point_%s_bias_%c", name, axes[a]));
    }
}

static void derive_columns(struct kinematics *k, int index) {
    struct point_motion *point = &k->points[index];
    point->columns = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *point->columns);
    for (int i = -1; recursion_next_joint(k->g, k->tree, &i);)
        if (kinematics_is_on_path(k, i, k->tree->points[index].frame))
            point->columns[i] = point_column(k, i, point->r, k->model->points[index].is_direction);
}

/* r = r_i + R rho, rd = R (v + w x rho), d = R (a0 + B rho): theory, sect. 4.4. */
static void derive_point(struct kinematics *k, int index) {
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[index];
    const struct frame_motion ground = ground_motion(k);
    const struct frame_motion *m = fixed->frame < 0 ? &ground : &k->frames[fixed->frame];
    const struct vector rho = kinematics_from_body(k, fixed->frame, vector_of(fixed->placement.position));
    const bool is_direction = k->model->points[index].is_direction;
    struct frame_motion carrier = *m;
    struct point_motion *point = &k->points[index];
    if (is_direction)
        carrier.position = carrier.linear = carrier.bias_linear = (struct vector){{0, 0, 0}};
    const struct vector velocity = vector_add(g, carrier.linear, vector_cross(g, m->angular, rho));
    const struct vector bias = carried_acceleration(g, m, carrier.bias_linear, rho);
    graph_remark(g, memory_format(k->memory, "%s %s: r = T rho, rd = C qd, rdd = C qdd + d (4.4)",
                                  is_direction ? "direction" : "point", k->model->points[index].name));
    point->r = vector_add(g, carrier.position, matrix_times(g, m->rotation.at, rho));
    point->rd = matrix_times(g, m->rotation.at, velocity);
    point->d = matrix_times(g, m->rotation.at, bias);
    name_point(k, index);
    derive_columns(k, index);
}

struct vector kinematics_acceleration_less_gravity(const struct kinematics *k, int point,
                                                   struct vector less_gravity,
                                                   const struct matrix *gradient) {
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[point];
    const struct vector rho = kinematics_from_body(k, fixed->frame, vector_of(fixed->placement.position));
    const struct vector across = matrix_times(g, gradient->at, rho);
    if (vector_is_zero(k->points[point].d)) /* a point on the ground, or after prismatic joints alone */
        return k->points[point].d;
    const expression *rotation = k->frames[fixed->frame].rotation.at;
    if (k->model->points[point].is_direction)
        return matrix_times(g, rotation, across);
    const struct vector moved = matrix_times(g, rotation, vector_add(g, less_gravity, across));
    return vector_add(g, moved, vector_of(k->model->gravity));
}

static void remark_motion(const struct kinematics *k, int i) {
    const struct frame *frame = &k->tree->frames[i];
    const char *parent = frame->parent < 0 ? "the ground" : k->tree->frames[frame->parent].name;
    const char *formula = "r = r_p + R_p s, v = v_p + w_p x s (4.13)";
    if (frame->kind == FRAME_JOINT)
        formula = frame->joint.is_revolute ? "w = E w_p + e qd, v = E (v_p + w_p x s) (4.2)"
                                           : "w = E w_p, v = E (v_p + w_p x s) + e qd (4.2)";
    graph_remark(k->g, memory_format(k->memory, "%s from %s: %s", frame->name, parent, formula));
}

/* The motion of frame i, one step from its parent's. */
static void step_outward(struct kinematics *k, int i) {
    const int parent = k->tree->frames[i].parent;
    const struct frame_motion ground = ground_motion(k);
    remark_motion(k, i);
    place_joint(k, i);
    turn_body(k, i, parent < 0 ? &ground : &k->frames[parent]);
    place_in_ground(k, i, parent < 0 ? &ground : &k->frames[parent]);
    move_frame(k, i, parent < 0 ? &ground : &k->frames[parent]);
}

struct recursion kinematics_recursion(const struct kinematics *k, void *state, size_t size) {
    return recursion_over(k->memory, k->g, k->tree, state, size);
}

void kinematics_derive(struct memory *memory, const struct model *model, const struct tree *tree,
                       struct kinematics *k) {
    *k = (struct kinematics){.g = model->graph, .memory = memory, .tree = tree, .model = model};
    k->frames = memory_get(memory, ((size_t)tree->count + 1) * sizeof *k->frames);
    k->joints = memory_get(memory, ((size_t)tree->count + 1) * sizeof *k->joints);
    k->points = memory_get(memory, ((size_t)model->marker_count + 1) * sizeof *k->points);
    struct recursion motions = kinematics_recursion(k, k->frames, sizeof *k->frames);
    for (int i = -1; recursion_outward(&motions, &i);)
        step_outward(k, i);
    for (int i = 0; i < model->marker_count; i++)
        derive_point(k, i);
}

/* Shifts of frames without joints are collected in `pending` until the next frame with a joint, because
 * theory, sect. 7.4, moves wrenches from joint to joint. */
struct vector *kinematics_ground_shifts(const struct kinematics *k) {
    const size_t n = (size_t)k->tree->count + 1;
    const struct vector none = {{0, 0, 0}};
    struct vector *pending = memory_get(k->memory, n * sizeof *pending),
                  *shifts = memory_get(k->memory, n * sizeof *shifts);
    struct recursion recursion = kinematics_recursion(k, pending, sizeof *pending);
    for (int i = -1; recursion_outward(&recursion, &i);) {
        const struct frame *frame = &k->tree->frames[i];
        struct vector shift = none;
        if (frame->parent >= 0) {
            shift = matrix_times(k->g, k->frames[frame->parent].rotation.at, k->joints[i].shift);
            shift = vector_add(k->g, shift, pending[frame->parent]);
        }
        pending[i] = frame->kind == FRAME_JOINT ? none : shift;
        shifts[i] = shift;
        kinematics_name_vector(k, i, "shift_ground", shift);
    }
    return shifts;
}
