/*
 * Axes of joints: joints about axes in any direction, and frames that keep their axes.
 *
 * With a = (x, y, z) of length 1, where the last axis is the one to be turned, the columns of the rotation
 * are (1 + s x x f, s x y f, -s x), (x y f, s + y y f, -y) and a, where s is the sign of z and f = -1 / (s +
 * z): T. Duff et al., Building an Orthonormal Basis, Revisited (Journal of Computer Graphics Techniques 6,
 * 2017). It is a rotation for each a, for all values of parameters. Any rotation that turns the axis onto a
 * will do, because two of them differ by a turn about a, which commutes with the joint's own.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <math.h>
#include <string.h>

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
    return vector_scale(g, expr_div(g, expr_one(g), length), v);
}

static expression sign_of(struct graph *g, expression e) {
    const expression one = expr_one(g), is_negative = expr_apply2(g, OP_LESS, e, expr_zero(g));
    return expr_where(g, is_negative, expr_neg(g, one), one);
}

/* The rotation that turns axis `axis` onto a. */
static struct matrix turn_onto(struct graph *g, int axis, struct vector a) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const expression x = a.at[i], y = a.at[j], one = expr_one(g), s = sign_of(g, a.at[axis]);
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
        return frames_add_joint(x, at, joint);
    struct joint about = *joint;
    about.axis = nearest_axis(x, joint);
    const struct matrix turn = turn_onto(x->g, about.axis, unit_of(x->g, joint->direction));
    turn_placement(x->g, &at->placement, &turn);
    struct frame *frame = frames_add_joint(x, at, &about);
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

/* ---- Frames that keep their axes ---- */

/* Marks frames that keep their axes while their bodies turn about parallel axes (theory, sect. 4.12). */

static bool is_unturned(const struct frame *frame) {
    const struct placement identity = placement_identity();
    return !memcmp(frame->placement.rotation, identity.rotation, sizeof identity.rotation);
}

/* Returns whether frame i is an element of a beam, or the beam's own frame, which is the first element. */
static bool belongs_to_beam(const struct tree *tree, int i) {
    bool belongs = tree->frames[i].element > 0;
    for (int j = i + 1; j < tree->count; j++)
        belongs = belongs || (tree->frames[j].link == tree->frames[i].link && tree->frames[j].element > 0);
    return belongs;
}

/* The axis about which all frames of one element of a run turn; -1: none. */
static int axis_of_element(const struct tree *tree, int entry) {
    const int axis = tree->frames[entry + 1].joint.axis;
    for (int i = entry + 1; tree->frames[i].kind == FRAME_JOINT; i++) {
        const struct frame *frame = &tree->frames[i];
        if (!frame->joint.is_revolute || frame->joint.axis != axis || !is_unturned(frame) ||
            belongs_to_beam(tree, i))
            return -1;
    }
    return axis;
}

/* The axis about which the body of frame i turns while the frame may keep its axes; -1: none. */
static int axis_of(const struct tree *tree, int i) {
    while (tree->frames[i].run >= 0 && tree->frames[i].kind != FRAME_ENTRY)
        i--;
    const struct frame *frame = &tree->frames[i];
    if (frame->kind == FRAME_ENTRY)
        return axis_of_element(tree, i);
    return frame->joint.is_revolute && !belongs_to_beam(tree, i) ? frame->joint.axis : -1;
}

/* Returns whether frame i turns about the axis about which its carrier's body turned. */
static bool goes_on(const struct tree *tree, int i) {
    const struct frame *frame = &tree->frames[i];
    const int axis = axis_of(tree, i);
    return axis >= 0 && frame->parent >= 0 && axis_of(tree, frame->parent) == axis && is_unturned(frame);
}

const struct tree *parallel_axes_keep(struct memory *memory, const struct tree *tree, enum kept_axes axes) {
    struct tree *kept = memory_get(memory, sizeof *kept);
    const size_t size = (size_t)tree->count * sizeof *kept->frames;
    *kept = *tree;
    kept->frames = memory_grow(memory, tree->frames, size, size + sizeof *kept->frames);
    for (int i = 0; i < tree->count && axes != AXES_TURNED; i++) {
        struct frame *frame = &kept->frames[i];
        if (!goes_on(tree, i))
            continue;
        struct frame *carrier = &kept->frames[frame->parent];
        frame->goes_on = frame->keeps_axes = true;
        carrier->keeps_axes = carrier->keeps_axes || axes == AXES_KEPT || carrier->kind == FRAME_ENTRY;
        kept->axes = axes;
    }
    for (int i = 0; i < tree->count; i++)
        if (kept->frames[i].keeps_axes)
            kept->frames[i].joint.axis = axis_of(tree, i);
    return kept->axes == AXES_TURNED ? tree : kept;
}
