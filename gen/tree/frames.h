/*
 * Growing the tree frame by frame, while links (tree.c) and beams (rigid_finite_elements.c) are expanded.
 */
#ifndef REFDYN_GEN_FRAMES_H
#define REFDYN_GEN_FRAMES_H

#include "tree/tree.h"

/* An element of a beam: the frame that carries it, and where it begins along the beam. */
struct element {
    struct fixed_frame at;
    expression start; /* [m] from the beam's root */
};

/* Where links and points attach: the frame that carries them and their placement in it. */
struct carrier {
    struct fixed_frame base, tip; /* the link's own frame (a beam's first element) and a beam's end */
    struct element *elements;     /* of a beam */
    int element_count;
};

/* An element or a solid on a frame. */
struct part {
    int link, frame; /* link: an element's beam, or what a solid is welded to */
    struct inertia inertia;
};

struct expansion {
    struct memory *memory;
    const struct model *model;
    struct graph *g;
    struct tree *tree;
    int capacity;
    struct part *parts;
    int part_count, part_capacity;
};

/* A new frame with one joint, standing where `at` is; `at` becomes that frame. */
struct frame *frames_add_joint(struct expansion *x, struct fixed_frame *at, const struct joint *joint);
/* Adds to the inertia of the frame that carries `at`, for that link. What is fixed to the ground has no part
 * in the motion. */
void frames_add_inertia(struct expansion *x, int link, const struct fixed_frame *at, struct inertia inertia);

/* The elements of a link's beam, from the carrier's tip on, and the frames of their joints. */
void rigid_finite_elements_add(struct expansion *x, const struct link *link, struct carrier *carrier);

/* inertia_names.c: names for the masses, moments and inertias of all frames. */
void inertia_names_give(const struct expansion *x);

#endif
