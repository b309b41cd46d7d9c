/*
 * The tree: one frame for each elementary coordinate, what is welded merged into the frame that it moves
 * with.
 *
 * Takes the links of a model; cuts beams into rigid finite elements (theory, sect. 3). Frame i belongs to
 * coordinate i, its parent has a smaller index, -1 is the ground. T_i = T_p A_i D_i(q_i): theory, sect. 2.1.
 */
#ifndef REFDYN_GEN_TREE_H
#define REFDYN_GEN_TREE_H

#include "model/model.h"

struct vector {
    expression at[3];
};

/* A symmetric 3 x 3 tensor: xx yy zz xy xz yz. */
struct tensor {
    expression at[6];
};

/* Any 3 x 3 matrix, row-major. */
struct matrix {
    expression at[9];
};

/* Inertia about the frame's origin, along its axes: with the mass these are the entries of the
 * pseudo-inertia. */
struct inertia {
    expression mass;      /* [kg] */
    struct vector moment; /* mass times centre [kg m] */
    struct tensor tensor; /* about the origin [kg m^2] */
};

/* Frames whose joints turn about parallel axes, one behind the other: all turn with their bodies, all but the
 * first keep their axes, or all keep them. See parallel_axes.h. */
enum kept_axes { AXES_TURNED, AXES_KEPT_BEHIND, AXES_KEPT };

/* ENTRY and EXIT enclose the frames of one element of a run: see roll.h. They have no joint. */
enum frame_kind { FRAME_JOINT, FRAME_ENTRY, FRAME_EXIT };

struct frame {
    const char *name; /* of the coordinate: base_z, arm_psi, arm_psi_1 ... */
    int parent;
    enum frame_kind kind;
    int coordinate;    /* of the first element, in a run */
    int step;          /* from one element's coordinate to the next one's; 0 when it stands alone */
    int run;           /* -1: stands alone */
    int partner;       /* ENTRY: its EXIT, and back */
    int link, element; /* element 0: the link itself or its first element */
    bool has_strains;  /* one of an element's three turns whose springs act on strains: element_strains.h */
    int turn;          /* then 0 psi, 1 theta, 2 phi, frames one behind the other; else 0 */
    struct joint joint;
    struct placement placement; /* A_i */
    struct inertia inertia;     /* of all that moves with this frame and no later one */
    bool keeps_axes;            /* its axes do not turn with its body: see parallel_axes.h */
    bool goes_on;               /* its body turns about the same axis as its carrier's body */
};

/* Something fixed to a frame (or to the ground, frame -1). */
struct fixed_frame {
    int frame;
    struct placement placement;
};

struct carrier;

struct tree {
    struct frame *frames;
    int count;
    struct carrier *carriers;   /* by link: where points attach */
    struct fixed_frame *points; /* by the model's points, marker_count */
    struct element_run *runs;   /* of a rolled tree */
    int run_count;
    int *frame_of; /* of a rolled tree: by coordinate, the frame that stands alone, -1: in a run */
    enum kept_axes axes;
};

/* Elements one behind the other that are equal but for the last one's inertia: coordinate `first` + r *
 * period + k, r = 0 ... count - 1. */
struct element_run {
    const char *name;
    int first, period, count;
    const struct inertia *last; /* of the last element's frames, NULL: like those of the others */
};

void tree_expand(struct memory *memory, const struct model *model, struct tree *tree);
/* Points and directions, once forces and rows have named all of them. */
void tree_place_points(struct memory *memory, const struct model *model, struct tree *tree);
int tree_find_coordinate(const struct tree *tree, const char *name); /* -1: none */
const char **tree_coordinate_names(struct memory *memory, const struct tree *tree);

#endif
