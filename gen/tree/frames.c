/* Growing the tree frame by frame: see tree.h. */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <assert.h>

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

struct frame *frames_add_joint(struct expansion *x, struct fixed_frame *at, const struct joint *joint) {
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
