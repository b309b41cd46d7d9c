/*
 * Recursions over a rolled tree (roll.h): one step a frame, runs in loops.
 *
 * A recursion's state is a record of expressions a frame. Outward, a step takes the state of the frame's
 * parent and sets its own; inward, a step takes what came from beyond the frame in its own state and adds to
 * the parent's. At a run the step is taken with symbols for what the loop carries (theory, sect. 4.13). A
 * part of the state that no iteration changes is found by trying, so that the frames of a run may come
 * several times; it keeps its value from before the loop, which often is zero.
 *
 *     struct recursion r = recursion_over(memory, g, tree, sums, sizeof *sums);
 *     for (int i = tree->count; recursion_inward(&r, &i);)
 *         ...
 */
#ifndef REFDYN_GEN_RECURSION_H
#define REFDYN_GEN_RECURSION_H

#include "tree/tree.h"

#include <stddef.h>

/* What the loop that a recursion is in carries. */
struct carry {
    expression *initial;
    int *slots; /* -1: no iteration changes it */
};

struct recursion {
    struct memory *memory;
    struct graph *g;
    const struct tree *tree;
    expression *state; /* by frame */
    int width;         /* of the state of a frame */
    struct carry carry;
};

/* state: by frame a structure of expressions and nothing else, of `size` bytes, zero before a recursion
 * inward. */
struct recursion recursion_over(struct memory *memory, struct graph *g, const struct tree *tree, void *state,
                                size_t size);
/* The frame of the next step, from *i = -1 on; false: there is none. */
bool recursion_outward(struct recursion *recursion, int *i);
/* The same from *i = tree->count on. */
bool recursion_inward(struct recursion *recursion, int *i);

/* The next frame with a joint, from *i = -1 outward; in runs inside a loop. The tree is gone through to its
 * end. */
bool recursion_next_joint(struct graph *g, const struct tree *tree, int *i);

/* A sum over all frames with a joint and all elements: its terms, from *i = -1 on, and what they add up to.
 */
struct recursion recursion_sum(struct memory *memory, struct graph *g, const struct tree *tree);
bool recursion_next_term(struct recursion *sum, int *i);
void recursion_add_term(struct recursion *sum, int i, expression term);
expression recursion_total(const struct recursion *sum);

#endif
