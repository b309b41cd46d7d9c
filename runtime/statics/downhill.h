/*
 * Downhill to a stable equilibrium.
 *
 * Takes a start on the rows; goes where the forces under the whole load lead, by steps
 *     y = |S|^-1 g,   S = -(H + H^T)/2,
 * with |S| of the same eigenvectors and the sizes of the eigenvalues, which is Newton's step where the
 * potential is convex and leads away from its saddles and maxima where it is not (Nocedal and Wright,
 * Numerical Optimization, 3.4). A step is halved until the forces do work along it, as the trapezoidal rule
 * tells from both ends.
 */
#ifndef REFDYN_DOWNHILL_H
#define REFDYN_DOWNHILL_H

#include "statics/newton.h"

/* From q (n), which becomes the equilibrium. Errors: those of refdyn_newton_solve; NO_CONVERGENCE also where
 * the forces lead on and on. */
int refdyn_downhill_go(struct statics *statics, double *q);

#endif
