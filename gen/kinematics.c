/* Kinematics from the base outward: see kinematics.h. */
#include "kinematics.h"
#include "memory.h"

void name_scalar(const struct kinematics *k, int i, const char *what, expression e) {
    name_value(k->g, e, memory_format(k->memory, "%s_%s", k->tree->frames[i].name, what));
}

void name_vector(const struct kinematics *k, int i, const char *what, struct vector a) {
    static const char axes[3] = "xyz";
    for (int axis = 0; axis < 3; axis++)
        name_value(k->g, a.at[axis],
                   memory_format(k->memory, "%s_%s_%c", k->tree->frames[i].name, what, axes[axis]));
}

/* Rot(axis)^T a for the cosine and sine given; Rot(axis) a with the sine negated. */
static struct vector turn_into(struct graph *g, int axis, expression cosine, expression sine,
                               struct vector a) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3;
    const expression aj = a.at[j], al = a.at[l];
    a.at[j] = add(g, mul(g, cosine, aj), mul(g, sine, al));
    a.at[l] = sub(g, mul(g, cosine, al), mul(g, sine, aj));
    return a;
}

struct vector to_child(const struct kinematics *k, int i, struct vector a) {
    const struct frame *frame = &k->tree->frames[i];
    const struct frame_motion *motion = &k->frames[i];
    a = transpose_times(k->g, frame->placement.rotation, a);
    return frame->joint.is_turn ? turn_into(k->g, frame->joint.axis, motion->cosine, motion->sine, a) : a;
}

struct vector to_parent(const struct kinematics *k, int i, struct vector a) {
    const struct frame *frame = &k->tree->frames[i];
    const struct frame_motion *motion = &k->frames[i];
    if (frame->joint.is_turn)
        a = turn_into(k->g, frame->joint.axis, motion->cosine, neg(k->g, motion->sine), a);
    return matrix_times(k->g, frame->placement.rotation, a);
}

/*
 * Rot(axis) T Rot(axis)^T: with w = s (jj - ll) + 2 c jl the block across the axis is jj - s w, ll + s w,
 * c w - jl. No diagonal term is a difference from the trace: a slender link's inertia about its axis is a
 * millionth of the others and would drown; here s w carries it, small as the angle is.
 */
static struct tensor tensor_turn_axis(struct graph *g, int axis, expression c, expression s,
                                      struct tensor t) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3;
    const int jj = j, ll = l, jl = tensor_index(j, l), ja = tensor_index(j, axis), la = tensor_index(l, axis);
    const expression across = mul(g, c, add(g, t.at[jl], t.at[jl]));
    const expression w = add(g, mul(g, s, sub(g, t.at[jj], t.at[ll])), across);
    const expression moved = mul(g, s, w);
    struct tensor turned = t;
    turned.at[jj] = sub(g, t.at[jj], moved);
    turned.at[ll] = add(g, t.at[ll], moved);
    turned.at[jl] = sub(g, mul(g, c, w), t.at[jl]);
    turned.at[ja] = sub(g, mul(g, c, t.at[ja]), mul(g, s, t.at[la]));
    turned.at[la] = add(g, mul(g, s, t.at[ja]), mul(g, c, t.at[la]));
    return turned;
}

struct tensor tensor_to_parent(const struct kinematics *k, int i, struct tensor t) {
    const struct frame *frame = &k->tree->frames[i];
    const struct frame_motion *motion = &k->frames[i];
    if (frame->joint.is_turn)
        t = tensor_turn_axis(k->g, frame->joint.axis, motion->cosine, motion->sine, t);
    return tensor_turn(k->g, frame->placement.rotation, t);
}

static expression coordinate(const struct kinematics *k, int i, int order) {
    return symbol(k->g, SYMBOL_COORDINATE, i, order);
}

/* Acceleration at r seen from a frame: a + wd x r + w x (w x r). */
static struct vector carried_acceleration(struct graph *g, const struct frame_motion *m, struct vector a,
                                          struct vector r) {
    return vector_add(g, a, matrix_times(g, m->gradient.at, r));
}

/* [wd]x + [w]x [w]x: once a frame, for its centre and for all that it carries. */
static struct matrix acceleration_gradient(struct graph *g, struct vector w, struct vector wd) {
    struct matrix gradient;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        const expression across = mul(g, w.at[i], w.at[j]);
        gradient.at[4 * i] = neg(g, add(g, mul(g, w.at[j], w.at[j]), mul(g, w.at[l], w.at[l])));
        gradient.at[3 * i + j] = sub(g, across, wd.at[l]);
        gradient.at[3 * j + i] = add(g, across, wd.at[l]);
    }
    return gradient;
}

static void place_frame(struct kinematics *k, int i) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    struct frame_motion *motion = &k->frames[i];
    const struct vector axis = unit_vector(g, frame->joint.axis);
    const expression q = coordinate(k, i, 0);
    motion->shift = vector_of(frame->placement.position);
    if (frame->joint.is_turn) {
        motion->sine = apply1(g, OP_SIN, q);
        motion->cosine = apply1(g, OP_COS, q);
        name_scalar(k, i, "sin", motion->sine);
        name_scalar(k, i, "cos", motion->cosine);
    } else {
        const struct vector slide = vector_scale(g, q, axis);
        motion->shift = vector_add(g, motion->shift, matrix_times(g, frame->placement.rotation, slide));
        name_vector(k, i, "shift", motion->shift);
    }
}

/* Rows of R are the ground's axes seen from the frame, so that each is one to_child away from the parent's.
 */
static void place_in_ground(struct kinematics *k, int i, const struct frame_motion *parent) {
    struct graph *g = k->g;
    struct frame_motion *motion = &k->frames[i];
    for (int row = 0; row < 3; row++) {
        const struct vector own = to_child(k, i, vector_of(parent->rotation.at + 3 * row));
        for (int column = 0; column < 3; column++)
            motion->rotation.at[3 * row + column] = own.at[column];
    }
    motion->position = vector_add(g, parent->position, matrix_times(g, parent->rotation.at, motion->shift));
    name_vector(k, i, "position", motion->position);
    for (int row = 0; row < 3; row++) {
        static const char *const names[3] = {"ground_x", "ground_y", "ground_z"};
        name_vector(k, i, names[row], vector_of(motion->rotation.at + 3 * row));
    }
}

/* The joint's own share: w += e qd, wd += w x e qd for a turn; v += e qd, a += 2 w x e qd for a slide. */
static void add_joint_motion(struct kinematics *k, int i) {
    struct graph *g = k->g;
    struct frame_motion *motion = &k->frames[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    const struct vector rate = vector_scale(g, coordinate(k, i, 1), unit_vector(g, joint->axis));
    const struct vector gyration = vector_cross(g, motion->angular, rate);
    if (joint->is_turn) {
        motion->bias_angular = vector_add(g, motion->bias_angular, gyration);
        motion->angular = vector_add(g, motion->angular, rate);
    } else {
        const struct vector coriolis = vector_add(g, gyration, gyration);
        motion->linear = vector_add(g, motion->linear, rate);
        motion->bias_linear = vector_add(g, motion->bias_linear, coriolis);
        motion->bias_falling = vector_add(g, motion->bias_falling, coriolis);
    }
}

static void move_frame(struct kinematics *k, int i, const struct frame_motion *parent) {
    struct graph *g = k->g;
    struct frame_motion *m = &k->frames[i];
    const struct vector r = m->shift;
    m->angular = to_child(k, i, parent->angular);
    m->linear = to_child(k, i, vector_add(g, parent->linear, vector_cross(g, parent->angular, r)));
    m->bias_angular = to_child(k, i, parent->bias_angular);
    m->bias_linear = to_child(k, i, carried_acceleration(g, parent, parent->bias_linear, r));
    m->bias_falling = to_child(k, i, carried_acceleration(g, parent, parent->bias_falling, r));
    m->gravity = to_child(k, i, parent->gravity);
    add_joint_motion(k, i);
    m->gradient = acceleration_gradient(g, m->angular, m->bias_angular);
    name_vector(k, i, "w", m->angular);
    name_vector(k, i, "v", m->linear);
    name_vector(k, i, "bias_wd", m->bias_angular);
    name_vector(k, i, "bias_a", m->bias_linear);
    name_vector(k, i, "bias_a_falling", m->bias_falling);
    name_vector(k, i, "gravity", m->gravity);
}

static struct frame_motion ground_motion(const struct kinematics *k) {
    struct frame_motion ground = {.rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    ground.gravity = vector_of(k->model->gravity);
    ground.bias_falling = vector_scale(k->g, neg(k->g, one(k->g)), ground.gravity);
    return ground;
}

struct vector joint_axis(const struct kinematics *k, int i) {
    const struct vector axis = unit_vector(k->g, k->tree->frames[i].joint.axis);
    return matrix_times(k->g, k->frames[i].rotation.at, axis);
}

/* Column i of C: how the point, or the direction, moves when only coordinate i does. */
static struct vector point_column(const struct kinematics *k, int i, struct vector r, bool is_direction) {
    const struct vector axis = joint_axis(k, i), still = {{0, 0, 0}};
    if (!k->tree->frames[i].joint.is_turn)
        return is_direction ? still : axis;
    return vector_cross(k->g, axis, is_direction ? r : vector_sub(k->g, r, k->frames[i].position));
}

static void name_point(struct kinematics *k, int index) {
    static const char axes[3] = "xyz";
    const struct point_motion *point = &k->points[index];
    const char *name = k->model->points[index].name;
    for (int a = 0; a < 3; a++) {
        name_value(k->g, point->r.at[a], memory_format(k->memory, "point_%s_%c", name, axes[a]));
        name_value(k->g, point->rd.at[a], memory_format(k->memory, "point_%s_%cd", name, axes[a]));
        name_value(k->g, point->d.at[a], memory_format(k->memory, "point_%s_bias_%c", name, axes[a]));
    }
}

static void derive_point(struct kinematics *k, const struct frame_motion *ground, int index) {
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[index];
    const struct frame_motion *m = fixed->frame < 0 ? ground : &k->frames[fixed->frame];
    const struct vector rho = vector_of(fixed->placement.position);
    const bool is_direction = k->model->points[index].is_direction;
    struct frame_motion carrier = *m;
    struct point_motion *point = &k->points[index];
    if (is_direction)
        carrier.position = carrier.linear = carrier.bias_linear = (struct vector){{0, 0, 0}};
    const struct vector velocity = vector_add(g, carrier.linear, vector_cross(g, m->angular, rho));
    const struct vector bias = carried_acceleration(g, m, carrier.bias_linear, rho);
    remark(g, memory_format(k->memory, "%s %s: r = T rho, rd = C qd, rdd = C qdd + d",
                            is_direction ? "direction" : "point", k->model->points[index].name));
    point->r = vector_add(g, carrier.position, matrix_times(g, m->rotation.at, rho));
    point->rd = matrix_times(g, m->rotation.at, velocity);
    point->d = matrix_times(g, m->rotation.at, bias);
    name_point(k, index);
    point->columns = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *point->columns);
    for (int i = fixed->frame; i >= 0; i = k->tree->frames[i].parent)
        point->columns[i] = point_column(k, i, point->r, is_direction);
}

void derive_kinematics(struct memory *memory, const struct model *model, const struct tree *tree,
                       struct kinematics *k) {
    *k = (struct kinematics){.g = model->graph, .memory = memory, .tree = tree, .model = model};
    k->frames = memory_get(memory, ((size_t)tree->count + 1) * sizeof *k->frames);
    k->points = memory_get(memory, ((size_t)model->marker_count + 1) * sizeof *k->points);
    const struct frame_motion ground = ground_motion(k);
    for (int i = 0; i < tree->count; i++) {
        const int parent = tree->frames[i].parent;
        remark(k->g, memory_format(memory, "%s: motion from %s outward", tree->frames[i].name,
                                   parent < 0 ? "the ground" : tree->frames[parent].name));
        place_frame(k, i);
        place_in_ground(k, i, parent < 0 ? &ground : &k->frames[parent]);
        move_frame(k, i, parent < 0 ? &ground : &k->frames[parent]);
    }
    for (int i = 0; i < model->marker_count; i++)
        derive_point(k, &ground, i);
}
