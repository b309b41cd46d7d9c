/*
 * Runs of equal elements: a tree in which each run of equal frames stands for one of its elements.
 *
 * Takes the tree, gives the rolled tree that everything is derived from: frames that stand alone as before,
 * and for each run an ENTRY frame, the frames of one element, and an EXIT frame. The ENTRY is fixed to what
 * carries the run, so displaced that all elements, the first included, are placed alike; the last one may
 * have an inertia of its own (a beam ends with half an element); the EXIT is the last
 * element's last frame, which carries what follows. Derivations walk the element once, in a loop
 * (recursion.h), whatever the count is. Theory, sect. 4.13.
 */
#ifndef REFDYN_GEN_ROLL_H
#define REFDYN_GEN_ROLL_H

#include "tree/tree.h"

/* A frame stands alone when the author's formulas name its coordinate or a point is fixed to it. */
void roll_tree(struct memory *memory, const struct model *model, const struct tree *tree, enum loops loops,
               struct tree *rolled);

#endif
