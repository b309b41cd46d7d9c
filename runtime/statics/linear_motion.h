/*
 * Small motions about an equilibrium, where forces have no potential.
 *
 * Takes the tangent H of the directions that the rows leave free (balance.h), and in the same coordinates y
 * the mass matrix M and the damping D = -dQ/dqd. Counts the growing modes y e^(lambda t) of
 *     M y'' + D y' + K y = 0,   K = -H
 * With the shift s and w = y'/s this equation is E z' = A z for z = (y, w). The eigenvalues of (A - s E)^-1 E
 * are 1/(lambda - s): slow modes keep their digits among fast ones, and K may be singular. `refdyn modes`
 * finds the same eigenvalues with shapes.
 */
#ifndef REFDYN_LINEAR_MOTION_H
#define REFDYN_LINEAR_MOTION_H

#include "statics/balance.h"

/* Counts growing modes, and neutral directions. After refdyn_newton_solve, with the balance read at `now`;
 * changes H, tangent and terms. Returns 0 where the model has no tangent, or one that is not finite. */
int refdyn_linear_motion_count(struct balance *balance, int *unstable, int *neutral);

#endif
