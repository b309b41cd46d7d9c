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
#ifndef REFDYN_IMPLICIT_H
#define REFDYN_IMPLICIT_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* What was computed for the steps of a motion. */
struct refdyn_linear_counts {
    long tangents;
    long factorisations; /* a complex one counts four, those that chains do side by side four together */
    long solutions;      /* with these factors, counted alike */
};

enum { REFDYN_COMPLEXES_MOST = 3 }; /* complex matrices that a method needs: six stages at Gauss's points */

struct refdyn_linear {
    int n, m, size;  /* size: n and the independent rows */
    double g;        /* gamma h of the matrix [s] */
    int is_chain;    /* factors in O(n): linear.h; else with matrices */
    double *tangent; /* the result of `tangent` or `tangent_vectors`, NULL: the model has none; its parts: */
    int tangent_size;
    double *f_t, *g_t, *G_q, *G_qd, *u, *diagonals, *K, *D, *M;
    struct refdyn_chain chain;
    double *matrix;          /* (size x size) factors */
    double *directions;      /* (rank x n) u_b z_a = 1 for a = b, else 0 */
    double *sides, *x;       /* room: (2 n), (2 size) */
    double *scale;           /* (size) room */
    int *pivot;              /* (size) */
    int complexes;           /* with room for so many complex matrices */
    double *complex_factors; /* (complexes x 2 x size x size) factors, real and imaginary parts */
    int *complex_pivot;      /* (complexes x size) */
    int *rows;               /* (m) rows of the partition for which they were factored */
    int is_at_begin;         /* the tangent is that of the begin of the step */
    long factored;           /* how often the real matrix was factored */
    double all_h;   /* step for which refdyn_linear_factor_all was called, 0: its factors are gone, */
    int all_choice; /* with partition.choices then */
    struct refdyn_linear_counts counts;
};

/* Lays out the arrays of a linearisation with this many complex matrices; without a tangent it serves
 * directions in the metric of M alone. */
void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct layout *layout);
/* Counts begin anew. */
void refdyn_linear_reset(struct refdyn_linear *linear);
/* Was the tangent evaluated at the begin of the step? */
int refdyn_linear_is_at_begin(const struct refdyn_linear *linear);
/* The tangent is not that of the begin of the step any more. */
void refdyn_linear_leave_begin(struct refdyn_linear *linear);
/* Factors of refdyn_linear_factor_all are not used again. */
void refdyn_linear_drop_factors(struct refdyn_linear *linear);
/* Evaluates the tangent at q (n) and its rates (constraints.h). Errors: NOT_FINITE. */
int refdyn_linear_evaluate(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates);
/* The same at the begin of a step, unless that was done. */
int refdyn_linear_at_begin(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates);
/* K (n x n) alone, of a tangent at q (n) and its rates, which steps then have lost. All else of it may be
 * infinite: nothing is looked at. */
void refdyn_linear_stiffness(struct refdyn_linear *linear, const struct refdyn_workspace *work, double t,
                             const double *q, const double *rates, double *K);
/* D (n x n) of that tangent. */
void refdyn_linear_damping(struct refdyn_linear *linear, double *D);
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
/* The same in the metric of M at a state; the tangent and factors of steps may be lost. Errors: NOT_FINITE,
 * MATRIX_SINGULAR. */
int refdyn_linear_mass_directions(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                                  const double *state);

/* Factors M and its rows, the tangent's; then derivatives of the accelerations by position or rate j, or by
 * time, into linear->x. Errors: MATRIX_SINGULAR. */
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
/* Are the factors of refdyn_linear_factor_all those for a step of h? */
int refdyn_linear_has_factors(const struct refdyn_linear *linear, const struct refdyn_workspace *work,
                              double h);
/* ---- For steps whose matrices somebody else factors: batch/lanes.h ---- */
/* What the first `count` eigenvalues count beside a real one. */
long refdyn_linear_weight(const struct refdyn_linear *linear, int count, const double *lambda);
void refdyn_linear_count(struct refdyn_linear *linear, long tangents, long factorisations, long solutions);
/* As refdyn_linear_factor_all leaves it: there are factors for a step of h. */
void refdyn_linear_mark_factors(struct refdyn_linear *linear, const struct refdyn_workspace *work, double h);
/* As refdyn_linear_directions leaves it, of all rows in their order: returns where the directions go (m x n).
 */
double *refdyn_linear_take_directions(struct refdyn_linear *linear);

/*
 * The largest |eigenvalue| [1/s] of the linearised equations at the begin of a step, and its damping ratio,
 * by iteration of vectors: good to some per cent, since what is asked is a limit of steps. `rates` (2 n + 1 +
 * m) of the state and `room` (2 n) are overwritten, factors are lost. Errors: NOT_FINITE, MATRIX_SINGULAR.
 */
int refdyn_linear_spectrum(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *state, double *rates, double *room, double *rate, double *damping);

#endif
