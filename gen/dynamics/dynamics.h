/*
 * Dynamics: mass matrix, bias forces, gravity, energy and the solution of M x = f, from the tips inward.
 *
 * Takes kinematics, gives expressions. Each function is one recursion of theory, sect. 4 or 5, in the axes of
 * each frame; a wrench is taken about the origin of the frame in whose axes it is given.
 */
#ifndef REFDYN_GEN_DYNAMICS_H
#define REFDYN_GEN_DYNAMICS_H

#include "dynamics/kinematics.h"

struct wrench {
    struct vector moment, force; /* [N m], [N] */
};

struct wrench wrench_add(struct graph *g, struct wrench a, struct wrench b);
/* Of the body that moves with frame i; in a run that of the element that the loop is at. */
struct inertia dynamics_own_inertia(const struct kinematics *k, int i);
/* About a point from which its own is r away. */
struct wrench wrench_shift(struct graph *g, struct vector r, struct wrench w);
/* About the origin of frame i's parent, in its axes. */
struct wrench wrench_to_parent(const struct kinematics *k, int i, struct wrench w);

/*
 * Composite inertias Ic_i of all beyond each joint (theory, sect. 4.5); entry [n] is the ground's. M (n x n,
 * both halves) of a tree without runs is derived on the way, unless it is NULL.
 */
struct inertia *dynamics_composite_inertias(const struct kinematics *k, expression *M);

/* W_i = Ic_i e_i, the wrench that accelerates all beyond joint i by one unit of qdd_i: theory, sect. 4.6. */
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

/* Accelerations of a frame, own axes, at which its body's load is taken: reference_accelerations.c. */
struct reference {
    struct vector angular;  /* dw/dt [rad/s^2] */
    struct vector linear;   /* of the origin, minus gravity [m/s^2] */
    struct matrix gradient; /* of `linear` in space [1/s^2] */
};
/* The wrench of inertia and gravity that each body takes at these accelerations, in its frame. */
struct wrench *dynamics_loads(const struct kinematics *k, const struct reference *references);
/* Of the body of frame i at the acceleration a of its origin: moment J wd + w x J w + mc x a and force m a +
 * B mc, B = [wd]x + [w]x [w]x the gradient. */
struct wrench wrench_of_inertia(const struct kinematics *k, int i, struct vector wd,
                                const struct matrix *gradient, struct vector a);

/* M x = f by articulated inertias, eliminated from the tips; each right side then costs O(n): theory, sect.
 * 5.1 to 5.4. */
struct elimination;
struct elimination *articulated_body_eliminate(const struct kinematics *k);
/* f minus the generalized forces of `loads` (by frame, or NULL), which are summed on the way. `references`:
 * the accelerations that these loads are taken at, NULL: they depend on none. */
struct right_side {
    const expression *f;
    const struct wrench *loads;
    const struct reference *references;
};
/* Accelerations of a frame, own axes, beyond those of its reference; `whole`: dw/dt with the reference's. */
struct acceleration {
    struct vector angular, linear, whole;
};
/* Accelerations by frame into `frames` unless it is NULL. */
expression *articulated_body_solve(const struct kinematics *k, const struct elimination *elimination,
                                   struct right_side side, struct acceleration **frames);
/* Is frame i the last of the turns that are eliminated together? */
bool articulated_body_ends_ball(const struct elimination *elimination, int i);
/* By frame; for bodies behind ball joints dw/dt is not that at qdd = 0. */
struct reference *reference_accelerations_derive(const struct kinematics *k,
                                                 const struct elimination *elimination);
/* Can a load act on frame i? Not on one between the turns that are eliminated together. */
bool articulated_body_takes_load(const struct elimination *elimination, int i);

/*
 * M x = f: M as L^T D L (mass_factor.c); then any right side costs O(n^2), in branched trees less. In trees
 * without runs alone.
 */
struct factors;
struct factors *mass_factor(const struct kinematics *k, const expression *mass_matrix);
expression *mass_factor_solve(const struct factors *factors, const expression *f);
/* Additions and multiplications of the factorisation of a matrix M in which no entry vanishes. */
long mass_factor_operations(const struct tree *tree);

#endif
