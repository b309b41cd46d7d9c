/*
 * Revolute joints about parallel axes, one behind the other, as of planar arms and chains: such a frame may
 * keep the axes that its carrier's body had before it turned, while its own body turns relative to it.
 *
 * Takes a tree, gives it with marks (theory, sect. 4.12). Vectors then go from frame to frame unchanged, and
 * angular velocities change along one axis; in return each body's own shift and inertia are turned once, by
 * the sum of the angles (W. Khalil and E. Dombre, Modeling, Identification and Control of Robots, 2002).
 *
 * Beams are left out: in axes that are not an element's own, the large articulated mass along it mixes with
 * the small one across, which costs digits.
 */
#ifndef REFDYN_GEN_PARALLEL_AXES_H
#define REFDYN_GEN_PARALLEL_AXES_H

#include "tree/tree.h"

/* The tree with kept axes wherever they can be; itself: nowhere. */
const struct tree *parallel_axes_keep(struct memory *memory, const struct tree *tree, enum kept_axes axes);

#endif
