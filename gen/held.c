/* The motion at given accelerations: see held.h. */
#include "held.h"
#include "dynamics.h"
#include "memory.h"
#include "sensitivity.h"

static struct vector to_ground(const struct kinematics *k, int i, struct vector a) {
    return matrix_times(k->g, k->frames[i].rotation.at, a);
}

struct matrix held_gradient(const struct held *held, int i) {
    return acceleration_gradient(held->k->g, held->k->frames[i].angular, held->motions[i].angular);
}

/* wd += w x e qd + e qdd for a turn; the origin goes with the shift. */
static void accelerate_frame(struct held *held, int i, const struct held_motion *parent) {
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    struct held_motion *motion = &held->motions[i];
    const struct joint *joint = &k->tree->frames[i].joint;
    motion->angular = to_child(k, i, parent->angular);
    motion->falling = to_child(k, i, vector_add(g, parent->falling, held->frames[i].shift_rate2));
    if (k->tree->frames[i].kind == FRAME_JOINT && joint->is_turn) {
        const struct vector e = unit_vector(g, joint->axis);
        const struct vector gyration =
            vector_scale(g, coordinate_of(k, i, 1), vector_cross(g, k->frames[i].angular, e));
        motion->angular = vector_add(g, motion->angular, gyration);
        motion->angular = vector_add(g, motion->angular, vector_scale(g, held->accelerations[i], e));
    }
    name_vector(k, i, "wd", motion->angular);
    name_vector(k, i, "a_falling", motion->falling);
}

/* de/dt = w x e, d2e/dt2 = ([wd]x + [w]x [w]x) e. */
static void turn_axis(struct held *held, int i) {
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    struct held_frame *frame = &held->frames[i];
    const struct frame_motion *m = &k->frames[i];
    const struct vector e = unit_vector(g, k->tree->frames[i].joint.axis);
    frame->own_rate = vector_cross(g, m->angular, e);
    frame->own_rate2 = matrix_times(g, held_gradient(held, i).at, e);
    frame->axis = joint_axis(k, i);
    frame->axis_rate = to_ground(k, i, frame->own_rate);
    frame->axis_rate2 = to_ground(k, i, frame->own_rate2);
    name_vector(k, i, "axis_rate", frame->axis_rate);
    name_vector(k, i, "axis_rate2", frame->axis_rate2);
}

/*
 * ds/dt = w x s, d2s/dt2 = wd x s + w x (w x s), with w, wd of the parent; a slide adds e' qd, 2 w x e qd and
 * e qdd.
 */
static void move_shift(struct held *held, int i) {
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    const struct vector s = k->joints[i].shift, still = {{0, 0, 0}};
    const struct vector w = frame->parent < 0 ? still : k->frames[frame->parent].angular;
    struct vector slide = still, speed = still, gain = still;
    if (frame->kind == FRAME_JOINT && !frame->joint.is_turn) {
        slide = matrix_times(g, frame->placement.rotation, unit_vector(g, frame->joint.axis));
        slide = from_body(k, frame->parent, slide);
        speed = vector_scale(g, coordinate_of(k, i, 1), slide);
        gain = vector_scale(g, held->accelerations[i], slide);
    }
    const struct vector carried = vector_cross(g, w, s), coriolis = vector_cross(g, w, speed);
    const struct vector swing =
        frame->parent < 0 ? still : matrix_times(g, held_gradient(held, frame->parent).at, s);
    held->frames[i].shift_rate = vector_add(g, carried, speed);
    held->frames[i].shift_rate2 =
        vector_add(g, vector_add(g, swing, gain), vector_add(g, coriolis, coriolis));
}

/* Origins that coincide have one velocity, as one expression. */
static void move_origin(struct held *held, int i) {
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    struct held_motion *motion = &held->motions[i];
    struct held_frame *frame = &held->frames[i];
    const int parent = k->tree->frames[i].parent;
    motion->velocity = frame->shift_rate;
    motion->acceleration = frame->shift_rate2;
    if (parent < 0)
        return;
    const struct held_motion *base = &held->motions[parent];
    const struct vector shift_rate = to_ground(k, parent, frame->shift_rate);
    frame->way_rate = vector_add(g, base->pending_rate, shift_rate);
    if (k->tree->frames[i].kind != FRAME_JOINT)
        motion->pending_rate = frame->way_rate;
    motion->velocity = vector_add(g, base->velocity, shift_rate);
    motion->acceleration = vector_add(g, base->acceleration, to_ground(k, parent, frame->shift_rate2));
}

/* By the frame that carries the point. */
static struct vector accelerate_point(const struct held *held, int index) {
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    const struct fixed_frame *fixed = &k->tree->points[index];
    const struct vector rho = from_body(k, fixed->frame, vector_of(fixed->placement.position)),
                        still = {{0, 0, 0}};
    if (fixed->frame < 0)
        return still;
    const struct held_motion *motion = &held->motions[fixed->frame];
    const struct vector swing = matrix_times(g, held_gradient(held, fixed->frame).at, rho);
    if (k->model->points[index].is_direction)
        return to_ground(k, fixed->frame, swing);
    const struct vector falling = to_ground(k, fixed->frame, vector_add(g, motion->falling, swing));
    return vector_add(g, falling, vector_of(k->model->gravity));
}

/* The motion of frame i, one step from its parent's. */
static void hold_frame(void *context, int i) {
    struct held *held = context;
    const struct kinematics *k = held->k;
    const struct vector gravity = vector_of(k->model->gravity);
    const struct held_motion ground = {.falling = vector_scale(k->g, neg(k->g, one(k->g)), gravity)};
    const int parent = k->tree->frames[i].parent;
    remark(k->g, memory_format(k->memory, "%s: motion at the accelerations found, outward",
                               k->tree->frames[i].name));
    held->motions[i] = (struct held_motion){.angular = {{0, 0, 0}}};
    move_shift(held, i);
    accelerate_frame(held, i, parent < 0 ? &ground : &held->motions[parent]);
    if (k->tree->frames[i].kind == FRAME_JOINT)
        turn_axis(held, i);
    move_origin(held, i);
}

struct held *hold(const struct kinematics *k, const expression *accelerations,
                  const expression *multipliers) {
    struct held *held = memory_get(k->memory, sizeof *held);
    *held = (struct held){.k = k, .accelerations = accelerations, .multipliers = multipliers};
    held->frames = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *held->frames);
    held->motions = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *held->motions);
    held->points = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *held->points);
    held->columns = memory_get(k->memory, ((size_t)k->model->marker_count + 1) * sizeof *held->columns);
    const struct recursion motions =
        recursion_over(k, held->motions, sizeof *held->motions, hold_frame, held);
    recur_outward(&motions);
    for (int i = 0; i < k->model->marker_count; i++)
        held->points[i] = accelerate_point(held, i);
    return held;
}

struct held *hold_still(const struct kinematics *k) {
    struct held *held = memory_get(k->memory, sizeof *held);
    *held = (struct held){.k = k, .is_resting = true};
    return held;
}

/* One point's columns. */
struct column_derivation {
    const struct held *held;
    struct column_rates *rates;
    int point;
};

/* C_j = e x rho for a turn, e for a slide; rho the arm from the joint, or the direction itself. */
static void derive_column(void *context, int j) {
    const struct column_derivation *x = context;
    const struct held *held = x->held;
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    const struct held_frame *frame = &held->frames[j];
    const struct held_motion *motion = &held->motions[j];
    const struct point_motion *point = &k->points[x->point];
    struct vector **by_order = x->rates->by_order;
    const bool is_direction = k->model->points[x->point].is_direction;
    const struct vector axis[3] = {frame->axis, frame->axis_rate, frame->axis_rate2};
    struct vector arm[3] = {point->r, point->rd, held->points[x->point]};
    const struct vector origin[3] = {k->frames[j].position, motion->velocity, motion->acceleration};
    if (!is_on_path(k, j, k->tree->points[x->point].frame))
        return;
    for (int o = 0; o < 3 && !is_direction; o++)
        arm[o] = vector_sub(g, arm[o], origin[o]);
    if (!k->tree->frames[j].joint.is_turn) {
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

static const struct column_rates *column_rates(struct held *held, int point) {
    const struct kinematics *k = held->k;
    struct column_rates *rates = &held->columns[point];
    if (rates->by_order[0])
        return rates;
    remark(k->g, memory_format(k->memory, "%s: dC_j/dt and d2C_j/dt2", k->model->points[point].name));
    rates->by_order[0] = k->points[point].columns;
    for (int o = 1; o < 3; o++)
        rates->by_order[o] = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof(struct vector));
    struct column_derivation x = {held, rates, point};
    visit_joints(k->g, k->tree, derive_column, &x);
    return rates;
}

static expression place_symbol(void *context, struct graph *g, expression e) {
    const struct held *held = context;
    const struct kinematics *k = held->k;
    const struct symbol s = *as_symbol(g, e);
    const bool moves = s.kind == SYMBOL_COORDINATE || s.kind == SYMBOL_POINT;
    if (held->is_resting && moves && s.order > 0)
        return zero(g);
    if (s.kind == SYMBOL_MULTIPLIER && held->multipliers)
        return held->multipliers[s.index];
    if (s.kind == SYMBOL_COORDINATE && s.order == 2)
        return held->accelerations[k->tree->frame_of[s.index]];
    if (s.kind != SYMBOL_POINT)
        return e;
    const struct point_motion *point = &k->points[s.index / 3];
    if (s.order == 2)
        return held->points[s.index / 3].at[s.index % 3];
    return (s.order ? point->rd : point->r).at[s.index % 3];
}

expression place_held(const struct held *held, expression e) {
    substitute(held->k->g, place_symbol, (void *)held, &e, &e, 1);
    return e;
}

struct vector place_vector(const struct held *held, struct vector v) {
    for (int a = 0; a < 3; a++)
        v.at[a] = place_held(held, v.at[a]);
    return v;
}

/* What a pull on one point adds: weight . column_j */
struct column_slopes {
    const struct kinematics *k;
    struct vector weight;
    const struct vector *columns;
    expression *slopes;
};

static void add_column_slope(void *context, int j) {
    const struct column_slopes *x = context;
    struct graph *g = x->k->g;
    x->slopes[j] = add(g, x->slopes[j], vector_dot(g, x->weight, x->columns[j]));
}

/* At rest the columns have no rates. */
static void add_point_slopes(struct held *held, int point, struct vector weight, int rate_order,
                             expression *slopes) {
    const struct kinematics *k = held->k;
    if (vector_is_zero(weight) || (held->is_resting && rate_order > 0))
        return;
    const struct vector *columns =
        rate_order ? column_rates(held, point)->by_order[rate_order] : k->points[point].columns;
    struct column_slopes x = {k, weight, columns, slopes};
    visit_joints(k->g, k->tree, add_column_slope, &x);
}

expression *held_slopes(struct held *held, expression e, int order) {
    static const double over[3][3] = {{1, 0, 0}, {1, 1, 0}, {1, 2, 1}}; /* (i over o) */
    const struct kinematics *k = held->k;
    struct graph *g = k->g;
    const int n = k->tree->count, markers = k->model->marker_count;
    expression *slopes = memory_get(k->memory, ((size_t)n + 1) * sizeof *slopes);
    for (int i = order; i < 3; i++) {
        expression *partial = symbol_gradient(k, e, i);
        substitute(g, place_symbol, held, partial, partial, n + 3 * markers);
        for (int j = 0; j < n && i == order; j++)
            slopes[j] = add(g, slopes[j], partial[j]); /* of frames that stand alone */
        for (int p = 0; p < markers; p++) {
            const struct vector weight = vector_of(partial + n + 3 * p);
            add_point_slopes(held, p, vector_scale(g, number(g, over[i][order]), weight), i - order, slopes);
        }
    }
    return slopes;
}
