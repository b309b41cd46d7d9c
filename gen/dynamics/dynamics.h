/*
 * The terms of the equations of motion, derived from the tree.
 *
 * The parts in order: kinematics; rows of programme constraints; derivatives by the coordinates; inertia,
 * bias forces, gravity and energy; the solution of M x = f by articulated bodies or by factors of M; strains
 * of elements; applied forces.
 */
#ifndef REFDYN_GEN_DYNAMICS_H
#define REFDYN_GEN_DYNAMICS_H

#include "gen/tree/tree.h"

/* ---- Kinematics, in each frame's own axes; points in the ground frame ---- */

struct joint_place {
    expression sine, cosine; /* of a turn's angle */
    struct vector shift;     /* origin in the parent's axes, from the parent's origin [m] */
};

struct frame_motion {
    expression cosine, sine; /* of the angle from the frame's axes to those of its body; they differ if the
                                frame keeps its axes (tree.h) */
    struct vector angular, linear;           /* angular velocity w [rad/s], velocity of the origin [m/s] */
    struct vector bias_angular, bias_linear; /* at qdd = 0: dw/dt [rad/s^2], of the origin [m/s^2] */
    struct vector bias_less_gravity; /* the same minus gravity: the reading of an accelerometer [m/s^2] */
    struct matrix gradient; /* B, the gradient of bias_linear in space: B r = wd0 x r + w x (w x r) [1/s^2] */
    struct vector gravity;  /* gravitational acceleration, in own axes [m/s^2] */
    struct matrix rotation; /* axes in the ground frame */
    struct vector position; /* origin in the ground frame [m] */
};

/* Motion of a point, or of a direction; r is then the direction itself. */
struct point_motion {
    struct vector r, rd, d; /* position, velocity, bias acceleration: rdd = C qdd + d */
    struct vector *columns; /* C: one column for each frame, zero off the point's path to the ground */
};

struct kinematics {
    struct graph *g;
    struct memory *memory;
    const struct tree *tree;    /* the rolled tree */
    struct joint_place *joints; /* by frame */
    struct frame_motion *frames;
    struct point_motion *points;
    const struct model *model;
};

void kinematics_derive(struct memory *memory, const struct model *model, const struct tree *tree,
                       struct kinematics *kinematics);
/* A recursion over its frames: see recursion_over in tree.h. */
struct recursion kinematics_recursion(const struct kinematics *k, void *state, size_t size);
/* q, qd or qdd of frame i; in a run, of the current element. */
expression kinematics_coordinate_of(const struct kinematics *k, int i, int order);
/* Returns whether frame `outer` is on the way from frame i to the ground, which includes i itself. */
bool kinematics_is_on_path(const struct kinematics *k, int outer, int i);
/* B = [wd]x + [w]x [w]x. With the acceleration a of the origin, a + B r is the acceleration at r. B is
 * computed once for each frame, for its centre and for all that it carries. */
struct matrix kinematics_acceleration_gradient(struct graph *g, struct vector w, struct vector wd);
/* wd + w x e qd for the axis e of joint i, own axes: dw/dt after a revolute joint at qdd = 0. A prismatic
 * joint adds twice the same term to the acceleration of the origin (theory, sect. 4.3). */
struct vector kinematics_gyroscopic(const struct kinematics *k, int i, struct vector wd);
/* The axis of joint i in the ground frame. */
struct vector kinematics_joint_axis(const struct kinematics *k, int i);
/* A free vector, and a tensor, from the axes of frame i's body (-1: the ground) into its own. */
struct vector kinematics_from_body(const struct kinematics *k, int i, struct vector a);
struct tensor kinematics_tensor_from_body(const struct kinematics *k, int i, struct tensor t);
/* A free vector from the axes of frame i's parent into its own, and back. */
struct vector kinematics_to_child(const struct kinematics *k, int i, struct vector a);
struct vector kinematics_to_parent(const struct kinematics *k, int i, struct vector a);
struct tensor kinematics_tensor_to_parent(const struct kinematics *k, int i, struct tensor t);
/* The same with a few more operations, fewer of which wait for each other: for long recursions. */
struct tensor kinematics_tensor_to_parent_quickly(const struct kinematics *k, int i, struct tensor t);
/* d of a point, in the ground frame, from the acceleration of its frame's origin minus gravity and from B,
 * for callers whose recursion has both. For a direction B is enough. Theory, sect. 4.4. */
struct vector kinematics_acceleration_less_gravity(const struct kinematics *k, int point,
                                                   struct vector less_gravity, const struct matrix *gradient);
/* By frame: the vector from the origin of the previous joint to that of this joint, ground axes. */
struct vector *kinematics_ground_shifts(const struct kinematics *k);

/* Adds the remark "arm_psi: <formula>" for the reader of the C. */
void kinematics_remark(const struct kinematics *k, int i, const char *formula);
/* Names values for the reader of the C: "arm_psi_1_<what>_x" ... */
void kinematics_name_vector(const struct kinematics *k, int i, const char *what, struct vector a);
/* Names the rows of a matrix: "<what>_x_x", "<what>_x_y" ... */
void kinematics_name_matrix(const struct kinematics *k, int i, const char *what, const struct matrix *m);
void kinematics_name_scalar(const struct kinematics *k, int i, const char *what, expression e);

/* ---- Programme constraints: theory, sect. 6.1 to 6.3 ---- */

struct row_terms {
    expression *u;             /* n coefficients */
    expression v, phi, psi, k; /* u qdd + v = 0; residuals; stabilised right side */
    expression *pull;          /* gradient by the row's own coordinates, by frame */
    struct vector *pulls;      /* gradient by each point, ground frame: u = pull + C^T pulls */
};

/* 2 alpha and beta^2: values of the parameter struct, which the runtime may replace. */
expression constraints_rate_gain(struct graph *g, const struct row *row);
expression constraints_position_gain(struct graph *g, const struct row *row);
struct row_terms *constraints_derive(const struct kinematics *k);
/* row_sizes.c: by frame, the sizes of the coefficients u of row `index` without cancellation: theory, sect.
 * 6.7. */
expression *constraints_sizes(const struct kinematics *k, int index, const struct row_terms *row);
/* By row, u M^-1 u^T of bodies that no joint holds: theory, sect. 5.6. */
expression *constraints_free_responses(const struct kinematics *k, const struct row_terms *rows);

/* ---- Derivatives by the coordinates ---- */

/* Derivatives of e by the symbols of one order: one for each frame's coordinate, then three for each
 * point. They are still in symbols. `resting`: at rest a state is its own coordinate, so that derivatives by
 * the coordinates (order 0) contain those by states, which are symbols of order 1. */
expression *coordinate_derivatives_symbol_gradient(const struct kinematics *k, expression e, int order,
                                                   bool resting);
/* Whether the symbol is zero at rest: a rate or an acceleration, but no state. */
bool coordinate_derivatives_rests(const struct kinematics *k, const struct symbol *symbol);
/* The derivatives by the coordinates of all frames, with points replaced by their kinematics; `resting`:
 * at qd = 0. */
expression *coordinate_derivatives_coefficients(const struct kinematics *k, expression e, int order,
                                                bool resting);
/* d/dt of an expression in symbols at qdd = 0, in symbols: theory, sect. 6.2. */
expression coordinate_derivatives_rate(const struct kinematics *k, expression e);
/* Replaces the symbols of points by their kinematics, with accelerations at qdd = 0. */
expression coordinate_derivatives_with_points(const struct kinematics *k, expression e);
/* The same at qd = 0. */
expression coordinate_derivatives_at_rest(const struct kinematics *k, expression e);

/* ---- Inertia, bias forces, gravity and energy ---- */

/* About the origin of the frame in whose axes it is given. */
struct wrench {
    struct vector moment, force; /* [N m], [N] */
};

struct wrench wrench_add(struct graph *g, struct wrench a, struct wrench b);
/* The inertia of the body that moves with frame i; in a run, of the current element. */
struct inertia dynamics_own_inertia(const struct kinematics *k, int i);
/* The wrench about a point from which its own reference point is r away. */
struct wrench wrench_shift(struct graph *g, struct vector r, struct wrench w);
/* The wrench about the origin of frame i's parent, in the parent's axes. */
struct wrench wrench_to_parent(const struct kinematics *k, int i, struct wrench w);
/* Composite inertias Ic_i of everything beyond each joint (theory, sect. 4.5); entry [n] is the ground's.
 * Unless M is NULL, it receives the mass matrix (n x n, both halves) of a tree without runs. */
struct inertia *dynamics_composite_inertias(const struct kinematics *k, expression *M);
/* W_i = Ic_i e_i, the wrench that accelerates everything beyond joint i by one unit of qdd_i: theory,
 * sect. 4.6. */
struct wrench wrench_of_unit(const struct kinematics *k, int i, const struct inertia *beyond);
/* R m R^T for the rotation R from frame i to its parent. */
struct matrix articulated_body_matrix_to_parent(const struct kinematics *k, int i, struct matrix m);
/* c_i = tr{X_i Gc_i} = e_i . F_i, and with `less_gravity` c_i + g_i: theory, sect. 4.7. */
expression *dynamics_bias_forces(const struct kinematics *k, bool less_gravity);
/* g_i = dEp_g/dq_i, and dg_i/dq_j (n x n): theory, sect. 4.8. */
expression *dynamics_gravity_forces(const struct kinematics *k, const struct inertia *composites);
expression *dynamics_gravity_tangent(const struct kinematics *k, const struct inertia *composites);
/* s_i = dEk/dq_i, the second sum of the printed form of h: theory, sect. 4.11. */
expression *dynamics_printed_sum(const struct kinematics *k);
expression dynamics_kinetic_energy(const struct kinematics *k);
expression dynamics_gravity_energy(const struct kinematics *k, const struct inertia *composites);

/* Accelerations of a frame, in own axes, at which its body's load is evaluated. */
struct reference {
    struct vector angular;  /* dw/dt [rad/s^2] */
    struct vector linear;   /* of the origin, minus gravity [m/s^2] */
    struct matrix gradient; /* of `linear` in space [1/s^2] */
};
/* The wrench of inertia and gravity of each body at these accelerations, in its frame. */
struct wrench *dynamics_loads(const struct kinematics *k, const struct reference *references);
/* The wrench of the body of frame i at the acceleration a of its origin: moment J wd + w x J w + mc x a
 * and force m a + B mc, where B = [wd]x + [w]x [w]x is the gradient. */
struct wrench wrench_of_inertia(const struct kinematics *k, int i, struct vector wd,
                                const struct matrix *gradient, struct vector a);

/* ---- Solution of M x = f ---- */

/* By articulated inertias, eliminated from the tips; each right side then costs O(n): theory, sect. 5. */

/* IA = [J H; H^T M] maps (angular, linear) acceleration to (moment, force). */
struct articulated {
    struct tensor J;
    struct matrix H;
    struct tensor M;
};

/* Values kept of joint i: U = IA e, D = e . U + rotor, as U / D and 1 / D. Theory, sect. 5.2. */
struct pivot {
    struct wrench U, U_over_D;
    expression D_inverse;
    expression kept; /* rotor / D: the part of U, and of joint i's force, that remains along its own axis */
};

/* Values kept of a ball joint, in the axes of its last frame: J = L D L^T, J^-1 H, and the directions of
 * its three axes. Theory, sect. 5.3. */
struct ball {
    expression D_inverse[3], L[3]; /* L: yx zx zy */
    struct matrix H, J_inverse_H;
    struct matrix turn; /* from the last frame's axes to those of the first frame's carrier */
    expression tilt,
        cos_inverse; /* in the middle frame the first axis is cos along itself, tilt along the last axis */
};

/* One step of the elimination: the joint of frame `first`, or a ball joint of the three frames up to `last`.
 */
struct stage {
    int first, last;
    struct pivot pivot;
    struct ball ball;
};

struct elimination {
    const struct kinematics *k;
    struct stage *stages;               /* by the frame that ends the stage; the others are empty */
    bool *ends_stage;                   /* by frame */
    struct articulated *beyond;         /* by frame: the contribution of everything beyond it */
    struct articulated *whole, *passed; /* by frame: IA before and after its stage is eliminated */
};

struct elimination *articulated_body_eliminate(const struct kinematics *k);
/* About another point, from which the present origin is r away: theory, sect. 5.1. */
struct articulated articulated_body_shift(struct graph *g, struct vector r, struct articulated a);
/* J^-1 v of a ball joint. */
struct vector articulated_body_solve_ball(struct graph *g, const struct ball *ball, struct vector v);
/* f minus the generalized forces of `loads` (by frame, or NULL), which the recursion sums. `references`:
 * the accelerations at which these loads are evaluated; NULL: they depend on none. */
struct right_side {
    const expression *f;
    const struct wrench *loads;
    const struct reference *references;
};
/* Accelerations of a frame, in own axes, relative to its reference; `whole`: dw/dt including the
 * reference's. */
struct acceleration {
    struct vector angular, linear, whole;
};
/* Writes the accelerations by frame into `frames` unless it is NULL. */
expression *articulated_body_solve(const struct kinematics *k, const struct elimination *elimination,
                                   struct right_side side, struct acceleration **frames);
/* Returns whether frame i is the last of three turns that are eliminated together. */
bool articulated_body_ends_ball(const struct elimination *elimination, int i);
/* Reference accelerations by frame. After a ball joint their dw/dt is not the one at qdd = 0. */
struct reference *reference_accelerations_derive(const struct kinematics *k,
                                                 const struct elimination *elimination);
/* Returns whether a load may act on frame i: not between turns that are eliminated together. */
bool articulated_body_takes_load(const struct elimination *elimination, int i);

/* M x = f by M = L^T D L; any right side then costs O(n^2), less in branched trees. Only for trees without
 * runs. */
struct factors;
struct factors *mass_factor(const struct kinematics *k, const expression *mass_matrix);
expression *mass_factor_solve(const struct factors *factors, const expression *f);
/* Additions and multiplications of the factorisation of a matrix M without zero entries. */
long mass_factor_operations(const struct tree *tree);

/* ---- Strains of the three turns of an element: theory, sect. 3.4 ---- */

/* The frame of the first of the three turns; they are consecutive frames. */
int element_strains_first(const struct kinematics *k, int i);

enum strain_part { STRAIN_ELASTIC = 1, STRAIN_VISCOUS = 2, STRAIN_BOTH = 3 };
/* The part of Q_i from springs, dampers or both: -(J^T S (w - w_rest))_i, -(J^T D J qd)_i, with J = dw/dq. */
expression element_strains_force(const struct kinematics *k, int i, enum strain_part part);
/* Derivatives of both parts of Q_i by the element's three turns (order 0) or their rates (order 1);
 * is_resting: at qd = 0. */
void element_strains_derivatives(const struct kinematics *k, int i, int order, bool is_resting,
                                 expression by_turn[3]);

/* ---- Applied forces: theory, sect. 4.9 ---- */

/* All forces, loads and energies of the model as forces on coordinates and loads at points, in symbols. */
struct named_forces {
    struct force *forces; /* `coordinate` is the frame */
    struct load *loads;
    int force_count, load_count;
    int own_forces, own_loads; /* the author's own come first; the others come from energies */
};
struct named_forces forces_collect(const struct kinematics *k);

struct applied {
    expression *conservative; /* n: springs and energies */
    expression *others;       /* n: dampers, and forces and loads of the author */
    expression *strained; /* n: the sum of both if springs act on strains, else 0, so that J^T occurs once */
};
struct applied forces_generalized(const struct kinematics *k);
/* Energy of springs, 1/2 s (q - rest)^2 or the energy of strains, and of the author's potentials. */
expression forces_energy(const struct kinematics *k);
/* dQ_i/dq_j of all of these at qd = 0 (n x n). */
expression *forces_tangent(const struct kinematics *k);
/* sum_j qd_j dQ_j/dqd_i: the printed form's extra term. */
expression *forces_printed_rates(const struct kinematics *k);

#endif
