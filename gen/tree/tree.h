/* The tree of links as frames of rigid finite elements. */
#ifndef REFDYN_GEN_TREE_H
#define REFDYN_GEN_TREE_H

#include <stddef.h>

#include "gen/graph/graph.h"
#include "gen/model/model.h"

/*
 * The tree: one frame for each elementary coordinate, what is welded merged into the frame that it moves
 * with.
 *
 * Takes the links of a model; cuts beams into rigid finite elements (theory, sect. 3). Frame i belongs to
 * coordinate i, its parent has a smaller index, -1 is the ground. T_i = T_p A_i D_i(q_i): theory, sect. 2.1.
 */

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
 * first keep their axes, or all keep them. See tree.h. */
enum kept_axes { AXES_TURNED, AXES_KEPT_BEHIND, AXES_KEPT };

/* ENTRY and EXIT enclose the frames of one element of a run: see tree.h. They have no joint. */
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
    bool has_strains;  /* one of an element's three turns whose springs act on strains: dynamics.h */
    int turn;          /* then 0 psi, 1 theta, 2 phi, frames one behind the other; else 0 */
    struct joint joint;
    struct placement placement; /* A_i */
    struct inertia inertia;     /* of all that moves with this frame and no later one */
    bool keeps_axes;            /* its axes do not turn with its body: see tree.h */
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

/*
 * Growing the tree frame by frame, while links (tree.c) and beams (rigid_finite_elements.c) are expanded.
 */

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

/*
 * A joint about an axis in any direction: a constant rotation that turns one of the frame's own axes onto the
 * given one, before the joint, and its transpose behind it, so that the link's frame stands, at q = 0, as its
 * carrier's does (theory, sect. 2.1). Frames have joints about their own axes alone.
 */

struct expansion;

/* A new frame with the joint, standing where `at` is; `at` becomes the link's frame behind the joint. */
struct frame *joint_axis_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint);

/* "local z", or "(0, 0.6, 0.8)" in the link's axes, with the values that parameters have. */
const char *joint_axis_text(struct memory *memory, const struct model *model, const struct joint *joint);

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

/* The tree with kept axes wherever they can be; itself: nowhere. */
const struct tree *parallel_axes_keep(struct memory *memory, const struct tree *tree, enum kept_axes axes);

/*
 * Recursions over a rolled tree (tree.h): one step a frame, runs in loops.
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

/*
 * Runs of equal elements: a tree in which each run of equal frames stands for one of its elements.
 *
 * Takes the tree, gives the rolled tree that everything is derived from: frames that stand alone as before,
 * and for each run an ENTRY frame, the frames of one element, and an EXIT frame. The ENTRY is fixed to what
 * carries the run, so displaced that all elements, the first included, are placed alike; the last one may
 * have an inertia of its own (a beam ends with half an element); the EXIT is the last
 * element's last frame, which carries what follows. Derivations walk the element once, in a loop
 * (tree.h), whatever the count is. Theory, sect. 4.13.
 */

/* A frame stands alone when the author's formulas name its coordinate or a point is fixed to it. */
void roll_tree(struct memory *memory, const struct model *model, const struct tree *tree, enum loops loops,
               struct tree *rolled);

/*
 * 3-vectors, rotations and inertia tensors of expressions: the algebra that kinematics and dynamics are
 * written in. Everything folds in the graph, so that a zero component costs nothing.
 */

struct vector vector_of(const expression at[3]);
struct vector vector_unit(struct graph *g, int axis);
struct vector vector_add(struct graph *g, struct vector a, struct vector b);
struct vector vector_sub(struct graph *g, struct vector a, struct vector b);
struct vector vector_scale(struct graph *g, expression s, struct vector a);
struct vector vector_cross(struct graph *g, struct vector a, struct vector b);
expression vector_dot(struct graph *g, struct vector a, struct vector b);
bool vector_is_zero(struct vector a);
struct vector matrix_times(struct graph *g, const expression matrix[9], struct vector a);
struct vector matrix_transpose_times(struct graph *g, const expression matrix[9], struct vector a);
struct matrix matrix_product(struct graph *g, const expression a[9], const expression b[9]);

int tensor_index(int row, int column);
struct vector tensor_times(struct graph *g, struct tensor t, struct vector a);
struct tensor tensor_add(struct graph *g, struct tensor a, struct tensor b);
/* R T R^T */
struct tensor tensor_turn(struct graph *g, const expression rotation[9], struct tensor t);
/*
 * What an inertia gains when it is seen from r away (Steiner, both origins off the centre), from the moments
 * before, mc, and after, mc + m r: 2 (r.d) 1 - r d^T - d r^T with d = mc + m r / 2.
 */
struct tensor tensor_of_shift(struct graph *g, struct vector r, struct vector before, struct vector after);

struct placement placement_identity(void);
/* First `outer`, in it `inner`. */
struct placement placement_compose(struct graph *g, const struct placement *outer,
                                   const struct placement *inner);
struct placement placement_shift_x(expression distance);

/* Inertia given in a placed frame, seen from the frame in which it is placed. */
struct inertia inertia_place(struct graph *g, const struct placement *placement, struct inertia inner);
struct inertia inertia_add(struct graph *g, struct inertia a, struct inertia b);
bool inertia_is_zero(const struct inertia *inertia);

#endif
