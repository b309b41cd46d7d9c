/*
 * Frames that keep their axes while their bodies turn about parallel axes, as in planar arms and chains:
 * consecutive revolute joints, whose frames may keep the axes that the carrier's body had before it turned.
 *
 * Input: a tree. Output: the tree with marks (theory, sect. 4.12). Vectors then pass from frame to frame
 * unchanged, and angular velocities change along one axis. In return each body's own shift and inertia are
 * turned once, by the sum of the angles (W. Khalil and E. Dombre, Modeling, Identification and Control of
 * Robots, 2002).
 *
 * Beams are excluded: in axes that are not an element's own, the large articulated mass along it mixes with
 * the small one across, which costs digits.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <string.h>

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
