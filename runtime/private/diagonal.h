/* clang-format off */
/*
 * The matrix of a linearly implicit step with the diagonals of K and D alone: M + g D + g^2 K, D and K those of the springs,
 * dampers and forces of the joints themselves, without weight, inertia forces and the curvature of rows.
 *
 * It is positive definite for any g, needs no tangent, and a W-method keeps its order with it. The emitted `shifted` eliminates
 * it in O(n m) at each solution. Of rows it knows what stabilises them, G_qd = 2 alpha u and G_q = beta^2 u with their gains.
 * What gains make of the curvature of rows, 2 alpha d(u qd)/dq, is left out: where they are large a step loses accuracy.
 * With f_t = g_t = 0 the system of linearise.h becomes, s = g r_v + r_q,
 *     (M + g D + g^2 K) x - g u^T lambda = -(g D + g^2 K) s + g D r_q,
 *     (1 + 2 alpha g + beta^2 g^2) u x   = -(2 alpha g + beta^2 g^2) u s + 2 alpha g u r_q,
 * dqd = x + g r_v, dq = g (r_q + dqd).
 */
/* clang-format on */
#ifndef REFDYN_DIAGONAL_H
#define REFDYN_DIAGONAL_H

#include "../refdyn.h"
#include "base/layout.h"

void refdyn_diagonal_lay_out(struct refdyn_diagonal *diagonal, const struct refdyn_model *model,
                             struct room *room);
/* Takes D and K at t, q and qd (n), negative entries as 0, and u of rows with gains. Errors: NOT_FINITE. */
int refdyn_diagonal_evaluate(struct refdyn_diagonal *diagonal, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd);
/* The matrix for g. */
void refdyn_diagonal_factor(struct refdyn_diagonal *diagonal, double g);
/* dq and dqd (n) from r_q and r_v (n), as refdyn_linear_solve. */
void refdyn_diagonal_solve(struct refdyn_diagonal *diagonal, const double *r_q, const double *r_v, double *dq,
                           double *dqd);
/* z (n) with u_a z = 1 and u_b z = 0 for all other rows, smallest in the metric of the matrix. All rows have
 * to be independent. */
void refdyn_diagonal_direction(struct refdyn_diagonal *diagonal, int a, double *z);

#endif
