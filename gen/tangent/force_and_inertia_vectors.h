/*
 * Exact derivatives of M qdd - h - Q - u^T lambda by coordinates and rates, at given accelerations and
 * multipliers, in O(n^2).
 *
 * Takes the motion at given qdd, gives vectors of each coordinate for the loops over pairs (loops.h): theory,
 * sect. 7.3 to 7.6. The method is that of Singh, Russo and Wensing (IEEE RA-L 7, 2022), here with arms and
 * velocities from the joints' own origins instead of spatial vectors about one point. With C_j, C_j', C_j''
 * the column of a mass element, M_ij = int C_i . C_j dm, and of row i of M qdd + c + g the derivative by qd_j
 * is 2 int C_i . C_j' dm and by q_j int C_i . C_j'' dm + int dC_i/dq_j . (rdd - grav) dm.
 */
#ifndef REFDYN_GEN_FORCE_AND_INERTIA_VECTORS_H
#define REFDYN_GEN_FORCE_AND_INERTIA_VECTORS_H

#include "dynamics/dynamics.h"
#include "tangent/given_motion.h"

/* Forces on coordinates, at points and on bodies, in symbols, but for springs and dampers. Their generalized
 * forces are F . C_i and T . e_i: theory, sect. 7.3. */
struct applied_forces {
    bool has_springs;        /* and dampers, on all coordinates */
    expression *coordinates; /* forces by frame that stands alone */
    struct vector *points;   /* by point: a force F there, or what multiplies the columns of a direction */
    struct vector *torques;  /* by point: a torque T on the body that carries it */
};

struct applied_forces *tangent_no_forces(const struct kinematics *k);
/* Springs, dampers and what the model names. */
void tangent_add_applied_forces(const struct kinematics *k, struct applied_forces *applied_forces);
/* u^T lambda: lambda times the gradient of each row's residual by its symbols of highest order. */
void tangent_add_row_forces(const struct kinematics *k, struct applied_forces *applied_forces);
/* Of one row, in symbols: residuals, and u qdd - k with what stabilises it. */
struct row_symbols {
    expression phi, psi, balance;
};

struct row_symbols tangent_row_symbols(const struct kinematics *k, int row);
/* The balances of all rows. */
expression *tangent_row_balances(const struct kinematics *k);
/* Generalized forces of the applied_forces, by frame. */
expression *tangent_generalized_forces(const struct given_motion *given,
                                       const struct applied_forces *applied_forces);

/* Vectors of one coordinate, about its own origin, in the ground frame: near ones are motions of joint j, far
 * ones wrenches of a coordinate i beyond it (theory, sect. 7.4; loops.h). */
struct pair_vectors {
    struct vector less_gravity_lever; /* near: (acceleration - gravity) x e */
    struct wrench mass;               /* (int rho x C_i, int C_i) */
    struct vector spin;               /* int rho' x C_i */
    struct wrench stiffness, damping; /* the same of C_i'' and C_i'; in `stiffness` the load turns with i */
};

/* By frame, with the inertia beyond each joint. */
struct pair_vectors *tangent_pair_vectors(const struct given_motion *given, const struct inertia *composites);

/* M qdd + c + g at the given accelerations, by frame. */
expression *tangent_inertia_forces(const struct given_motion *given);

#endif
