/*
 * Recursions over a rolled tree (roll.h): one step a frame, runs in loops.
 *
 * A recursion's state is a record of expressions a frame. Outward, a step takes the state of the frame's
 * parent and sets its own; inward, a step takes what came from beyond the frame in its own state and adds to
 * the parent's. At a run the step is taken once, with symbols for what the loop carries (theory, sect. 4.13).
 * A part of the state that no iteration changes is found by trying, and keeps its value from before the loop,
 * which often is zero.
 */
#ifndef REFDYN_GEN_RECURSION_H
#define REFDYN_GEN_RECURSION_H

#include "tree/tree.h"

struct recursion {
    struct memory *memory;
    struct graph *g;
    const struct tree *tree;
    void *state; /* by frame: a structure of `width` expressions and nothing else, zero before a recursion
                    inward */
    int width;
    void (*step)(void *context, int i);
    void *context;
};

void recursion_outward(const struct recursion *recursion);
void recursion_inward(const struct recursion *recursion);

/* Calls `visit` for each frame with a joint, from the ground outward; in runs inside a loop. */
void recursion_visit_joints(struct graph *g, const struct tree *tree, void (*visit)(void *context, int i),
                            void *context);

/* The sum of `term` over all frames with a joint and all elements. */
expression recursion_sum_over_joints(struct graph *g, const struct tree *tree,
                                     expression (*term)(void *context, int i), void *context);

#endif
