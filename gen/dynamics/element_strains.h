/*
 * Springs and dampers of an element with three turns, in a form that is symmetric in them: theory, sect. 3.4.
 *
 * Takes the turns psi, theta, phi of one spring-damping element, gives what its springs and dampers add to
 * the generalized forces, their energy and their derivatives. The strains are the components of the rotation
 * vector of R = Rz Ry Rx to second order in the turns (Baker, Campbell, Hausdorff), w_psi = psi - theta phi /
 * 2,   w_theta = theta + psi phi / 2,   w_phi = phi - psi theta / 2.
 */
#ifndef REFDYN_GEN_ELEMENT_STRAINS_H
#define REFDYN_GEN_ELEMENT_STRAINS_H

#include "dynamics/kinematics.h"

/* Do the spring and damper of frame i act on strains? Then the three turns are frames one behind the other.
 */
bool element_strains_has(const struct kinematics *k, int i);
/* The frame of the element's first turn. */
int element_strains_first(const struct kinematics *k, int i);

enum strain_part { STRAIN_ELASTIC = 1, STRAIN_VISCOUS = 2, STRAIN_BOTH = 3 };

/* What springs, dampers or both add to Q_i: -(J^T S (w - w_rest))_i, -(J^T D J qd)_i, with J = dw/dq. */
expression element_strains_force(const struct kinematics *k, int i, enum strain_part part);
/* s_i (w_i - w_rest_i)^2 / 2 */
expression element_strains_energy(const struct kinematics *k, int i);
/* Derivatives of what both add to Q_i by the element's three turns (order 0) or their rates (order 1);
 * is_resting: at qd = 0. */
void element_strains_derivatives(const struct kinematics *k, int i, int order, bool is_resting,
                                 expression by_turn[3]);

#endif
