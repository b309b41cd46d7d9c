/*
 * A joint about an axis in any direction: a constant rotation that turns one of the frame's own axes onto the
 * given one, before the joint, and its transpose behind it, so that the link's frame stands, at q = 0, as its
 * carrier's does (theory, sect. 2.1). Frames have joints about their own axes alone.
 */
#ifndef REFDYN_GEN_JOINT_AXIS_H
#define REFDYN_GEN_JOINT_AXIS_H

#include "tree/tree.h"

struct expansion;

/* A new frame with the joint, standing where `at` is; `at` becomes the link's frame behind the joint. */
struct frame *joint_axis_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint);

/* "local z", or "(0, 0.6, 0.8)" in the link's axes, with the values that parameters have. */
const char *joint_axis_text(struct memory *memory, const struct model *model, const struct joint *joint);

#endif
