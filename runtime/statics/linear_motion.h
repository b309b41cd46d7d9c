/*
 * Small motions about an equilibrium, where forces have no potential.
 *
 * Takes the tangent H of what the rows leave free (balance.h), and in the same coordinates y the mass matrix
 * M and the damping D = -dQ/dqd; counts the modes y e^(lambda t) of M y'' + D y' + K y = 0,   K = -H that
 * grow. With w = y'/s and the shift s the eigenvalues tau of (A - s E)^-1 E, where E z' = A z is that
 * equation for z = (y, w), are 1/(lambda - s): slow modes keep their digits among fast ones, and K may be
 * singular. `refdyn modes` finds the same eigenvalues with shapes.
 */
#ifndef REFDYN_LINEAR_MOTION_H
#define REFDYN_LINEAR_MOTION_H

#include "statics/balance.h"

/* Counts growing modes, and neutral directions. After refdyn_newton_solve, with the balance read at `now`;
 * changes H, tangent and terms. Returns 0 where the model has no tangent, or one that is not finite. */
int refdyn_linear_motion_count(struct balance *balance, int *unstable, int *neutral);

#endif
