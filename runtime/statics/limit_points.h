/*
 * The equilibria under a growing and falling load, past limit points.
 *
 * Takes a start; follows the curve (q, s) of
 *     F = Q(q) - (1 - s) Q(q_start),   F + u^T lambda = 0,   phi = 0
 * by pseudo-arclength: a step h along its direction (d, sigma), then Newton on these equations and
 *     d . (q - q_predicted) + sigma (s - s_predicted) = 0,
 * whose matrix is regular at limit points, where sigma changes its sign (Keller, in: Applications of
 * Bifurcation Theory, Academic Press, 1977, 359-384). Lengths are in 1 rad, `length` and the whole load.
 */
#ifndef REFDYN_LIMIT_POINTS_H
#define REFDYN_LIMIT_POINTS_H

#include "statics/newton.h"

void refdyn_limit_points_lay_out(struct statics *statics, const struct refdyn_model *model,
                                 struct layout *layout);
/* From q (n), where no load acts, until the whole load does; q keeps the last equilibrium. Errors: those of
 * refdyn_newton_solve. */
int refdyn_limit_points_pass(struct statics *statics, double *q);

#endif
