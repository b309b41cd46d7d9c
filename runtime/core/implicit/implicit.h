/* clang-format off */
/*
 * The constrained equations of motion, linearised about a state, and the matrix of a linearly implicit step: theory, sect. 8.4.
 *
 * At the accelerations and multipliers of a state the emitted `tangent` gives K, D and f_t of M qdd - h - Q - u^T lambda and
 * G_q, G_qd and g_t of u qdd - k. Accelerations then change with positions, velocities and time by
 *     M da - u^T dlambda = -K dq - D dqd - f_t dt,   u da = -G_q dq - G_qd dqd - g_t dt,
 * and with dq = g (r_q + dqd), dqd = g (r_v + da), an implicit step needs one solution of
 *     (M + g D + g^2 K) x - g u^T lambda = -(g D + g^2 K) s + g D r_q - g f_t dt,   s = g r_v + r_q,
 *     (u + g G_qd + g^2 G_q) x           = -(g G_qd + g^2 G_q) s + g G_qd r_q - g g_t dt,
 * dq = g (x + s), dqd = x + s - r_q: there is no product with M^-1, nor one with M, in which an ill-conditioned M
 * would cost the right side digits. Only the independent rows of the partition take part.
 */
/* clang-format on */
#ifndef REFDYN_IMPLICIT_H
#define REFDYN_IMPLICIT_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Counts of the work for the steps of a motion. */
struct refdyn_linear_counts {
    long tangents;
    long factorisations; /* a complex one counts four; four complex ones that chains compute side by side
                            count four together */
    long solutions;      /* with these factors, counted in the same way */
};

enum {
    REFDYN_COMPLEXES_MOST = 3
}; /* of a method: six stages at Gauss's points have three complex matrices */

struct refdyn_linear {
    int n, m, size;  /* size: n and the independent rows */
    double g;        /* gamma h of the matrix [s] */
    int is_chain;    /* factors in O(n): linear.h; else with matrices */
    double *tangent; /* the result of `tangent` or `tangent_vectors`, NULL: not emitted; its parts: */
    int tangent_size;
    double *f_t, *g_t, *G_q, *G_qd, *u, *diagonals, *K, *D, *M;
    struct refdyn_chain chain;
    double *matrix;          /* (size x size) factors */
    double *directions;      /* (rank x n) u_b z_a = 1 for a = b, else 0 */
    double *sides, *x;       /* scratch: (2 n), (2 size) */
    double *scale;           /* (size) scratch */
    int *pivot;              /* (size) */
    int complexes;           /* number of complex matrices that fit */
    double *complex_factors; /* (complexes x 2 x size x size) factors, real and imaginary parts */
    int *complex_pivot;      /* (complexes x size) */
    int *rows;               /* (m) rows of the partition for which they were factored */
    int is_at_begin;         /* the tangent was evaluated at the start of the step */
    long factored;           /* how often the real matrix was factored */
    double all_h;            /* step for which refdyn_linear_factor_all was called; 0: its factors are lost */
    int all_choice;          /* partition.choices at that call */
    struct refdyn_linear_counts counts;
};

/* Lays out the arrays of a linearisation with this many complex matrices. Without a tangent it only computes
 * directions in the metric of M. */
void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct layout *layout);
/* Resets the counts. */
void refdyn_linear_reset(struct refdyn_linear *linear);
/* Returns whether the tangent was evaluated at the start of the step. */
int refdyn_linear_is_at_begin(const struct refdyn_linear *linear);
/* Marks that the tangent is no longer that of the start of the step. */
void refdyn_linear_leave_begin(struct refdyn_linear *linear);
/* Discards the factors of refdyn_linear_factor_all. */
void refdyn_linear_drop_factors(struct refdyn_linear *linear);
/* Evaluates the tangent at q (n) and its rates (constraints.h). Errors: NOT_FINITE. */
int refdyn_linear_evaluate(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates);
/* Does this at the start of a step, unless it was done there already. */
int refdyn_linear_at_begin(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates);
/* Computes K (n x n) of the tangent at q (n) and its rates; the tangent of steps is lost. Other parts may be
 * infinite, for they are not checked. */
void refdyn_linear_stiffness(struct refdyn_linear *linear, const struct refdyn_workspace *work, double t,
                             const double *q, const double *rates, double *K);
/* Copies D (n x n) of that tangent. */
void refdyn_linear_damping(struct refdyn_linear *linear, double *D);
/* Factors the matrix for g. Errors: MATRIX_SINGULAR. */
int refdyn_linear_factor(struct refdyn_linear *linear, const struct refdyn_workspace *work, double g);
/*
 * Solves dq = g (r_q + dqd), dqd = g (r_v + da) for dq and dqd, where da is the change of accelerations by
 * dq, dqd and a change dt of time. r_q, r_v, dq, dqd (n).
 */
void refdyn_linear_solve(struct refdyn_linear *linear, const double *r_q, const double *r_v, double dt,
                         double *dq, double *dqd);
/* Writes into linear->directions the z_a (n), smallest in the metric of the factored matrix, with u_b z_a = 1
 * for a = b and 0 otherwise. refdyn_linear_found returns them with their rows. */
void refdyn_linear_directions(struct refdyn_linear *linear);
struct refdyn_directions refdyn_linear_found(const struct refdyn_linear *linear);
/* Does the same in the metric of M at a state; the tangent and factors of steps may be lost. Errors:
 * NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_linear_mass_directions(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                                  const double *state);

/* Factors M and the rows of the tangent; afterwards derivatives of the accelerations by position or rate j,
 * or by time, are computed into linear->x. Errors: MATRIX_SINGULAR. */
int refdyn_linear_factor_accelerations(struct refdyn_linear *linear, const struct refdyn_workspace *work);
enum refdyn_by { REFDYN_BY_Q, REFDYN_BY_QD, REFDYN_BY_T };
void refdyn_linear_change_by(struct refdyn_linear *linear, enum refdyn_by by, int j);

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
/* Returns whether the factors of refdyn_linear_factor_all are valid for a step of h. */
int refdyn_linear_has_factors(const struct refdyn_linear *linear, const struct refdyn_workspace *work,
                              double h);
/* ---- For steps whose matrices batches factor side by side (lanes_implicit.inc) ---- */
/* Cost of the matrices of the first `count` eigenvalues in units of a real one. */
long refdyn_linear_weight(const struct refdyn_linear *linear, int count, const double *lambda);
void refdyn_linear_count(struct refdyn_linear *linear, long tangents, long factorisations, long solutions);
/* Marks that there are factors for a step of h, as refdyn_linear_factor_all does. */
void refdyn_linear_mark_factors(struct refdyn_linear *linear, const struct refdyn_workspace *work, double h);
/* Prepares directions of all rows in their order, as refdyn_linear_directions does. Returns the array to fill
 * (m x n). */
double *refdyn_linear_take_directions(struct refdyn_linear *linear);

/*
 * The largest |eigenvalue| [1/s] of the linearised equations at the begin of a step, and its damping ratio,
 * by iteration of vectors: accurate to some per cent, which suffices to bound steps. Overwrites `rates` (2 n
 * + 1 + m) of the state and the scratch `room` (2 n); factors are lost. Errors: NOT_FINITE, MATRIX_SINGULAR.
 */
int refdyn_linear_spectrum(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *state, double *rates, double *room, double *rate, double *damping);

#endif
