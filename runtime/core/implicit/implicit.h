/* The constrained equations of motion, linearised about a state, and the matrix of a linearly implicit step:
 * linearisation.c has the formulas. */
#ifndef REFDYN_IMPLICIT_H
#define REFDYN_IMPLICIT_H

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Counts of the work for the steps of a motion. A complex factorisation or solution counts four; four that
 * chains compute side by side count four together. */
struct refdyn_linear_counts {
    long tangents, factorisations, solutions;
};

/* Complex matrices of a method: six stages at Gauss's points have three. */
enum { REFDYN_COMPLEXES_MOST = 3 };

struct refdyn_linear {
    int n, m, size;  /* size: n and the independent rows */
    double g;        /* gamma h of the matrix [s] */
    int is_chain;    /* factors in O(n): linear.h; else with matrices */
    double *tangent; /* the result of `tangent` or `tangent_vectors`, NULL: not emitted; its parts: */
    int tangent_size;
    double *f_t, *g_t, *G_q, *G_qd, *u, *diagonals, *K, *D, *M;
    struct refdyn_chain chain;
    double *matrix;          /* (size x size) factors */
    double *directions;      /* (rank x n) z_a: u_b z_a = 1 for a = b, else 0 */
    double *sides, *x;       /* scratch: (2 n), (2 size) */
    double *scale;           /* (size) scratch */
    int *pivot;              /* (size) */
    int complexes;           /* number of complex matrices that fit */
    double *complex_factors; /* (complexes x 2 x size x size) factors, real and imaginary parts */
    int *complex_pivot;      /* (complexes x size) */
    int *rows;               /* (m) rows of the partition for which they were factored */
    int is_at_begin;         /* the tangent is that of the start of the step */
    long factored;           /* how often the real matrix was factored */
    double all_h;            /* step for which refdyn_linear_factor_all was called; 0: its factors are lost */
    int all_choice;          /* partition.choices at that call */
    struct refdyn_linear_counts counts;
};

/* Lays out the arrays of a linearisation with this many complex matrices. Without a tangent it only computes
 * directions in the metric of M. */
void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct layout *layout);
void refdyn_linear_reset(struct refdyn_linear *linear);
/* Is the tangent that of the start of the step? It is no longer. */
int refdyn_linear_is_at_begin(const struct refdyn_linear *linear);
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
/* Solves dq = g (r_q + dqd), dqd = g (r_v + da) for dq and dqd (n), where da is the change of accelerations
 * by dq, dqd and a change dt of time. r_q, r_v (n). */
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
 * As refdyn_chain_factor_all and refdyn_chain_solve_all: factors for g = h lambda_k, and solutions. Only the
 * first eigenvalue may be real; its matrix is that of refdyn_linear_factor. Errors: MATRIX_SINGULAR.
 */
int refdyn_linear_factor_all(struct refdyn_linear *linear, const struct refdyn_workspace *work, int count,
                             const double *lambda, double h);
void refdyn_linear_solve_all(struct refdyn_linear *linear, int count, const double *lambda, double *x);
/* Are the factors of refdyn_linear_factor_all valid for a step of h? */
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

/* The largest |eigenvalue| [1/s] of the linearised equations at the beginning of a step, and its damping
 * ratio, to some per cent. Overwrites `rates` (2 n + 1 + m) of the state and the scratch `room` (2 n);
 * factors are lost. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_linear_spectrum(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *state, double *rates, double *room, double *rate, double *damping);

#endif
