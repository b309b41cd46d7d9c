/*
 * Frames: how the tree grows by one frame for each joint, and joints about axes in any direction.
 *
 * Input: a place in the tree, and a joint or an inertia there. Output: the frame after the joint; the inertia
 * with the frame that carries it. Theory, sect. 2.1.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- Growing the tree frame by frame ---- */

static struct frame *new_frame(struct expansion *x) {
    struct tree *tree = x->tree;
    if (tree->count == x->capacity) {
        int capacity = x->capacity ? 2 * x->capacity : 32;
        tree->frames = memory_grow(x->memory, tree->frames, (size_t)tree->count * sizeof *tree->frames,
                                   (size_t)capacity * sizeof *tree->frames);
        x->capacity = capacity;
    }
    return &tree->frames[tree->count++];
}

struct frame *frames_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint) {
    struct frame *frame = new_frame(x);
    assert(at->frame < x->tree->count - 1);
    frame->parent = at->frame;
    frame->run = -1;
    frame->coordinate = x->tree->count - 1;
    frame->placement = at->placement;
    frame->joint = *joint;
    at->frame = x->tree->count - 1;
    at->placement = placement_identity();
    return frame;
}

void frames_add_inertia(struct expansion *x, int link, const struct fixed_frame *at, struct inertia inertia) {
    if (at->frame < 0)
        return;
    struct inertia *into = &x->tree->frames[at->frame].inertia;
    const struct inertia placed = inertia_place(x->g, &at->placement, inertia);
    x->parts = memory_room(x->memory, x->parts, x->part_count, &x->part_capacity, sizeof *x->parts);
    x->parts[x->part_count++] = (struct part){link, at->frame, placed};
    *into = inertia_add(x->g, *into, placed);
}

/* ---- Joints about axes in any direction ---- */

/*
 * A constant rotation before the joint turns one of the frame's own axes onto the given one. Its transpose
 * follows the joint, so that at q = 0 the link's frame is parallel to its carrier's (theory, sect. 2.1).
 * With a = (x, y, z) of length 1, where the last axis is the one to be turned, the columns of the rotation
 * are (1 + s x x f, s x y f, -s x), (x y f, s + y y f, -y) and a, where s is the sign of z and f = -1 / (s +
 * z): T. Duff et al., Building an Orthonormal Basis, Revisited (Journal of Computer Graphics Techniques 6,
 * 2017). It is a rotation for each a, for all values of parameters. Any rotation that turns the axis onto a
 * will do, because two of them differ by a turn about a, which commutes with the joint's own.
 */

/* The frame's axis nearest to the direction, for the present values of parameters; the joint's own axis if
 * others are equally near. For a direction along an axis of the frame the rotation is 1 or half a turn. */
static int nearest_axis(const struct expansion *x, const struct joint *joint) {
    double along[3];
    int nearest = joint->axis;
    for (int i = 0; i < 3; i++)
        along[i] = fabs(parameters_evaluate(x->g, x->model->parameters, joint->direction[i]));
    for (int i = 0; i < 3; i++)
        if (along[i] > along[nearest])
            nearest = i;
    return nearest;
}

static struct vector unit_of(struct graph *g, const expression direction[3]) {
    const struct vector v = vector_of(direction);
    const expression length = expr_apply1(g, OP_SQRT, vector_dot(g, v, v));
    return vector_scale(g, expr_div(g, EXPR_ONE, length), v);
}

static expression sign_of(struct graph *g, expression e) {
    const expression one = EXPR_ONE, is_negative = expr_apply2(g, OP_LESS, e, EXPR_ZERO);
    return expr_where(g, is_negative, expr_neg(g, one), one);
}

/* The rotation that turns axis `axis` onto a. */
static struct matrix turn_onto(struct graph *g, int axis, struct vector a) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const expression x = a.at[i], y = a.at[j], one = EXPR_ONE, s = sign_of(g, a.at[axis]);
    const expression f = expr_div(g, expr_neg(g, one), expr_add(g, s, a.at[axis]));
    const expression sx = expr_mul(g, s, x), xf = expr_mul(g, x, f), xyf = expr_mul(g, xf, y);
    struct matrix R;
    R.at[3 * i + i] = expr_add(g, one, expr_mul(g, sx, xf));
    R.at[3 * j + i] = expr_mul(g, s, xyf);
    R.at[3 * axis + i] = expr_neg(g, sx);
    R.at[3 * i + j] = xyf;
    R.at[3 * j + j] = expr_add(g, s, expr_mul(g, y, expr_mul(g, y, f)));
    R.at[3 * axis + j] = expr_neg(g, y);
    for (int row = 0; row < 3; row++)
        R.at[3 * row + axis] = a.at[row];
    return R;
}

static void transpose(const expression matrix[9], expression transposed[9]) {
    for (int i = 0; i < 9; i++)
        transposed[i] = matrix[i % 3 * 3 + i / 3];
}

/* If two consecutive joints have the same direction, the rotation back after one and the rotation before
 * the next cancel. The frame is then not turned: exactly 1, so that parallel axes stay parallel. */
static void turn_placement(struct graph *g, struct placement *placement, const struct matrix *turn) {
    struct placement inner = placement_identity();
    expression back[9];
    memcpy(inner.rotation, turn->at, sizeof inner.rotation);
    transpose(placement->rotation, back);
    if (!memcmp(back, turn->at, sizeof back))
        memcpy(placement->rotation, placement_identity().rotation, sizeof placement->rotation);
    else
        *placement = placement_compose(g, placement, &inner);
}

struct frame *joint_axis_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint) {
    if (!joint->has_direction)
        return frames_add(x, at, joint);
    struct joint about = *joint;
    about.axis = nearest_axis(x, joint);
    const struct matrix turn = turn_onto(x->g, about.axis, unit_of(x->g, joint->direction));
    turn_placement(x->g, &at->placement, &turn);
    struct frame *frame = frames_add(x, at, &about);
    transpose(turn.at, at->placement.rotation);
    return frame;
}

const char *joint_axis_text(struct memory *memory, const struct model *model, const struct joint *joint) {
    double along[3];
    for (int i = 0; i < 3; i++)
        along[i] = parameters_evaluate(model->graph, model->parameters, joint->direction[i]);
    if (!joint->has_direction)
        return memory_format(memory, "local %c", "xyz"[joint->axis]);
    return memory_format(memory, "(%.6g, %.6g, %.6g)", along[0], along[1], along[2]);
}
