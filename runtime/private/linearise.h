/* clang-format off */
/*
 * The constrained equations of motion, linearised about a state, and the matrix of a linearly implicit step: theory, sect. 8.4.
 *
 * At the accelerations and multipliers of a state the emitted `tangent` gives K, D and f_t of M qdd - h - Q - u^T lambda and
 * G_q, G_qd and g_t of u qdd - k. Accelerations then change with positions, velocities and time by
 *     M da - u^T dlambda = -K dq - D dqd - f_t dt,   u da = -G_q dq - G_qd dqd - g_t dt,
 * and with dq = g (r_q + dqd), dqd = g (r_v + da), all elimination that an implicit step needs is one solution
 *     (M + g D + g^2 K) x - g u^T lambda = -(g D + g^2 K) s + g D r_q - g f_t dt,   s = g r_v + r_q,
 *     (u + g G_qd + g^2 G_q) x           = -(g G_qd + g^2 G_q) s + g G_qd r_q - g g_t dt,
 * dq = g (x + s), dqd = x + s - r_q: no product with M^-1, and none of M, whose digits an ill-conditioned M would
 * take from the right side. Only the independent rows of the partition stand in it.
 */
/* clang-format on */
#ifndef REFDYN_LINEARISE_H
#define REFDYN_LINEARISE_H

#include "constraints/constraints.h"
#include "../refdyn.h"
#include "base/layout.h"

/* Lays out the arrays of a linearisation with this many complex matrices; without a tangent it serves
 * directions in the metric of M alone. */
void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct room *room);
/* Evaluates the tangent at q (n) and its slope (slope.h). Errors: NOT_FINITE. */
int refdyn_linear_evaluate(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *slope);
/* Factors the matrix for g. Errors: MATRIX_SINGULAR. */
int refdyn_linear_factor(struct refdyn_linear *linear, const struct refdyn_workspace *work, double g);
/*
 * dq and dqd of dq = g (r_q + dqd), dqd = g (r_v + da) with da the change of accelerations by dq, dqd and a
 * change dt of time. r_q, r_v, dq, dqd (n).
 */
void refdyn_linear_solve(struct refdyn_linear *linear, const double *r_q, const double *r_v, double dt,
                         double *dq, double *dqd);
/* Directions z_a (n) with u_b z_a = 1 for a = b and 0 otherwise, that are smallest in the metric of the
 * factored matrix: into linear->directions; refdyn_linear_found tells them with their rows. */
void refdyn_linear_directions(struct refdyn_linear *linear);
struct refdyn_directions refdyn_linear_found(const struct refdyn_linear *linear);
/* Factors M and its rows at a state, for directions in the metric of M; the tangent and factors of steps
 * may be lost. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_linear_factor_mass(struct refdyn_drive *drive, double t, const double *state);

/* Derivatives of the accelerations by position or rate j, or by time, into linear->x; with the factors for g
 * = 0. */
enum refdyn_by { REFDYN_BY_Q, REFDYN_BY_QD, REFDYN_BY_T };
void refdyn_linear_change_by(struct refdyn_linear *linear, enum refdyn_by by, int j);

/* Evaluates the tangent at the begin of a drive's step, unless that was done. Errors: NOT_FINITE. */
int refdyn_linear_at_begin(struct refdyn_drive *drive);
/*
 * Factors the matrices for g = h lambda_k of `count` eigenvalues (count x 2: real and imaginary parts), of
 * which the first alone may be real, which then is that of refdyn_linear_factor. Solves for the change of
 * accelerations by residuals: right sides M x and u x; x holds n values for a real eigenvalue, n real and n
 * imaginary ones for another, in place; of the first ones alone where `count` is smaller. Errors:
 * MATRIX_SINGULAR.
 */
int refdyn_linear_factor_all(struct refdyn_linear *linear, const struct refdyn_workspace *work, int count,
                             const double *lambda, double h);
void refdyn_linear_solve_all(struct refdyn_linear *linear, int count, const double *lambda, double *x);
/*
 * The largest |eigenvalue| [1/s] of the linearised equations at the begin of a drive's step, and its damping
 * ratio, by iteration of vectors: good to some per cent, since what is asked is a limit of steps. Where
 * forces saturate, as friction, that at rest, which is the largest. The drive's factors and directions are
 * lost. Errors: NOT_FINITE, MATRIX_SINGULAR.
 */
int refdyn_linear_spectrum(struct refdyn_drive *drive, double *rate, double *damping);

#endif
