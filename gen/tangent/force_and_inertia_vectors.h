/*
 * Exact derivatives of M qdd - h - Q - u^T lambda by coordinates and rates, at given accelerations and
 * multipliers, in O(n^2).
 *
 * Takes the given motion, gives vectors of each coordinate for the loops over pairs (loops.h). The method is
 * that of Singh, Russo and Wensing (IEEE RA-L 7, 2022), here with arms and velocities from the joints' own
 * origins instead of spatial vectors about one point: with rho the arm of a mass element from the origin of
 * joint j, C_j = e x rho, dC_j = e' x rho + e x rho', ddC_j = e'' x rho + 2 e' x rho' + e x rho'', M_ij = int
 * C_i . C_j dm, d/dqd_j of row i = 2 int C_i . dC_j dm, d/dq_j of row i = int C_i . ddC_j dm + int dC_i/dq_j
 * . (rdd - grav) dm.
 */
#ifndef REFDYN_GEN_FORCE_AND_INERTIA_VECTORS_H
#define REFDYN_GEN_FORCE_AND_INERTIA_VECTORS_H

#include "dynamics/dynamics.h"
#include "tangent/given_motion.h"

/* What applied_forces at coordinates, points and bodies; in symbols, but for springs and dampers. Generalized
 * forces are what they do on columns of C. */
struct applied_forces {
    bool has_springs;        /* and dampers, on all coordinates */
    expression *coordinates; /* forces by frame that stands alone */
    struct vector *points;   /* by point: a force there, or the force on a direction */
    struct vector *torques;  /* by point: on the body that carries it */
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
/* sum force . column by frame: generalized forces of the applied_forces. */
expression *tangent_generalized_forces(const struct given_motion *given,
                                       const struct applied_forces *applied_forces);

/* Vectors of one coordinate, own origin and ground axes: see loops.h. Near ones move joint j, far ones are
 * felt. */
struct pair_vectors {
    struct vector less_gravity_lever; /* near: (acceleration - gravity) x e */
    struct wrench mass;               /* int C_i, int rho x C_i */
    struct vector spin;               /* int rho' x C_i */
    struct wrench stiffness, damping; /* int ddC_i and int dC_i, with what turns C_j along */
};

/* By frame, with the inertia beyond each joint. */
struct pair_vectors *tangent_pair_vectors(const struct given_motion *given, const struct inertia *composites);

/* M qdd + c + g at the given accelerations, by frame: what the derivatives are of. */
expression *tangent_inertia_forces(const struct given_motion *given);

#endif
