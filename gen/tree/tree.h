/*
 * The tree: one frame for each elementary coordinate. Welded bodies are merged with the frame that moves
 * them, beams are cut into rigid finite elements (theory, sect. 3).
 *
 * The parts in order: frames and trees; expanding links; recursions; runs of equal elements; the algebra of
 * vectors and inertias.
 */
#ifndef REFDYN_GEN_TREE_H
#define REFDYN_GEN_TREE_H

#include "gen/model/model.h"

struct vector {
    expression at[3];
};
struct tensor {
    expression at[6]; /* symmetric, 3 x 3, in the order xx yy zz xy xz yz */
};
struct matrix {
    expression at[9]; /* 3 x 3, row-major */
};

/* Inertia about the frame's origin, along its axes. Together with the mass these are the entries of the
 * pseudo-inertia. */
struct inertia {
    expression mass;      /* [kg] */
    struct vector moment; /* mass times centre [kg m] */
    struct tensor tensor; /* about the origin [kg m^2] */
};

/* Consecutive frames whose joints turn about parallel axes: all turn with their bodies, all but the first
 * keep their axes, or all keep them. */
enum kept_axes { AXES_TURNED, AXES_KEPT_AFTER, AXES_KEPT };

/* ENTRY and EXIT enclose the frames of one element of a run. They have no joint. */
enum frame_kind { FRAME_JOINT, FRAME_ENTRY, FRAME_EXIT };

/* Frame i belongs to coordinate i. Its parent has a smaller index; -1 is the ground. T_i = T_p A_i D_i(q_i):
 * theory, sect. 2.1. */
struct frame {
    const char *name; /* of the coordinate: base_z, arm_psi, arm_psi_1 ... */
    int parent;
    enum frame_kind kind;
    int coordinate;    /* of the first element, in a run */
    int step;          /* from one element's coordinate to the next one's; 0 if the frame is in no run */
    int run;           /* -1: in no run */
    int partner;       /* of an ENTRY its EXIT, and the reverse */
    int link, element; /* element 0: the link itself or its first element */
    bool has_strains;  /* one of an element's three turns, whose springs act on strains: dynamics.h */
    int turn;          /* 0 psi, 1 theta, 2 phi in three consecutive frames that share strains; else 0 */
    struct joint joint;
    struct placement placement; /* A_i */
    struct inertia inertia;     /* of all bodies that move with this frame and with no later one */
    bool keeps_axes;            /* its axes do not turn with its body */
    bool goes_on;               /* its body turns about the same axis as its carrier's body */
    bool is_state;              /* the frame of a continuous state: see tree_add_states */
};

/* A body or point fixed to a frame, or to the ground (frame -1). */
struct fixed_frame {
    int frame;
    struct placement placement;
};

/* An element of a beam: the frame that carries it, and its beginning along the beam. */
struct element {
    struct fixed_frame at;
    expression start; /* [m] from the beam's root */
};

/* Where links and points attach: the frame that carries them, and their placement in it. */
struct carrier {
    struct fixed_frame base, tip; /* the link's own frame (a beam's first element) and a beam's end */
    struct element *elements;     /* of a beam */
    int element_count;
};

struct tree {
    struct frame *frames;
    int count;
    struct carrier *carriers;   /* by link: carriers of points */
    struct fixed_frame *points; /* by the model's points, marker_count */
    struct element_run *runs;   /* of a rolled tree */
    int run_count;
    int *frame_of; /* of a rolled tree: by coordinate, its frame; -1: in a run */
    enum kept_axes axes;
};

/* Consecutive elements that are equal except for the last one's inertia: coordinates `first` + r * period
 * + k, r = 0 ... count - 1. */
struct element_run {
    const char *name;
    int first, period, count;
    const struct inertia *last; /* of the last element's frames; NULL: equal to the others */
};

void tree_expand(struct memory *memory, const struct model *model, struct tree *tree);
/*
 * Adds a frame for each continuous state z of the model, after all others. It is a slide on the ground whose
 * rate is z and whose only inertia is a rotor of 1; the model's list of forces has z' as the force on it.
 * All that holds for rates and generalized forces then holds for states: steps, derivatives, events. The
 * coordinate itself, the integral of z, has no meaning, and no formula reads it. Energy and power leave
 * these frames out, and at rest z keeps its value. Theory, sect. 4.14.
 */
void tree_add_states(struct memory *memory, const struct model *model, struct tree *tree);
int tree_joint_count(const struct tree *tree);                  /* of frames before those of states */
int tree_find_state(const struct tree *tree, const char *name); /* -1: none */
int tree_find_frame(const struct tree *tree, const char *name); /* of a joint or a state; -1: none */
/* Places points and directions, after forces and rows have named all of them. */
void tree_place_points(struct memory *memory, const struct model *model, struct tree *tree);
/* The frame of a joint; -1: none. */
int tree_find_coordinate(const struct tree *tree, const char *name);
/* The names of all frames: of joints, then of states. */
const char **tree_coordinate_names(struct memory *memory, const struct tree *tree);
/* "local z", or "(0, 0.6, 0.8)" in the link's axes, for the present values of parameters. */
const char *joint_axis_text(struct memory *memory, const struct model *model, const struct joint *joint);
/* The tree with kept axes wherever possible; the tree itself if there are none. */
const struct tree *parallel_axes_keep(struct memory *memory, const struct tree *tree, enum kept_axes axes);

/* ---- Expanding links: tree.c, with frames.c, and rigid_finite_elements.c for beams ---- */

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

/* Adds a frame with one joint at the place `at`, which then becomes that frame. */
struct frame *frames_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint);
/* The same for a joint about an axis in any direction. */
struct frame *joint_axis_add(struct expansion *x, struct fixed_frame *at, const struct joint *joint);
/* Adds to the inertia of the frame that carries `at`, for that link. A body fixed to the ground has no
 * part in the motion. */
void frames_add_inertia(struct expansion *x, int link, const struct fixed_frame *at, struct inertia inertia);
/* Adds the elements of a link's beam, from the carrier's tip on, and the frames of their joints. */
void rigid_finite_elements_add(struct expansion *x, const struct link *link, struct carrier *carrier);

/*
 * Recursions over a rolled tree: one step for each frame, with runs in loops. The state is a record of
 * expressions for each frame. Outward, a step reads the state of the frame's parent and sets its own; inward,
 * it reads the contributions from beyond the frame in its own state and adds to the parent's.
 *
 *     struct recursion r = recursion_over(memory, g, tree, sums, sizeof *sums);
 *     for (int i = tree->count; recursion_inward(&r, &i);)
 *         ...
 */

struct recursion {
    struct memory *memory;
    struct graph *g;
    const struct tree *tree;
    expression *state; /* by frame */
    int width;         /* expressions in the state of a frame */
    struct carry {
        expression *initial;
        int *slots; /* -1: no iteration changes it */
    } carry;        /* the values that the loop carries */
};

/* state: for each frame a structure of `size` bytes that consists of expressions alone; it must be zero
 * before an inward recursion. */
struct recursion recursion_over(struct memory *memory, struct graph *g, const struct tree *tree, void *state,
                                size_t size);
/* Sets *i to the frame of the next step; begin with -1. False: there is none. */
bool recursion_outward(struct recursion *recursion, int *i);
/* The same inward; begin with *i = tree->count. */
bool recursion_inward(struct recursion *recursion, int *i);
/* The next frame with a joint, outward from *i = -1; in runs inside a loop. The caller must continue to the
 * end of the tree. */
bool recursion_next_joint(struct graph *g, const struct tree *tree, int *i);
/* A sum over all frames with a joint and all elements: its terms, beginning with *i = -1, and their total. */
struct recursion recursion_sum(struct memory *memory, struct graph *g, const struct tree *tree);
bool recursion_next_term(struct recursion *sum, int *i);
void recursion_add_term(struct recursion *sum, int i, expression term);
expression recursion_total(const struct recursion *sum);

/* Replaces each run of equal elements by an ENTRY frame, the frames of one element, and an EXIT frame. A
 * frame is in no run if the author's formulas name its coordinate or if a point is fixed to it. */
void roll_tree(struct memory *memory, const struct model *model, const struct tree *tree, enum loops loops,
               struct tree *rolled);

/* ---- The algebra of vectors, rotations and inertias ---- */

struct vector vector_of(const expression at[3]);
struct vector vector_unit(int axis);
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

struct placement placement_identity(void);
/* First `outer`, then `inner` in it. */
struct placement placement_compose(struct graph *g, const struct placement *outer,
                                   const struct placement *inner);
struct placement placement_shift_x(expression distance);

/* An inertia given in a placed frame, expressed in the frame in which it is placed. */
struct inertia inertia_place(struct graph *g, const struct placement *placement, struct inertia inner);
struct inertia inertia_add(struct graph *g, struct inertia a, struct inertia b);
bool inertia_is_zero(const struct inertia *inertia);

#endif
