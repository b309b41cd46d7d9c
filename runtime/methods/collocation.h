/* Collocation methods as data. */
#ifndef REFDYN_COLLOCATION_H
#define REFDYN_COLLOCATION_H

#include "methods/step.h"

/*
 * A step of h (theory, sect. 8.6): accelerations a_i at the times t + c_i h, so that with
 *     Q_i = q + h c_i qd + h^2 sum_j aa_ij a_j,   V_i = qd + h sum_j a_ij a_j
 * they are those of the states (Q_i, V_i); then q_new = q + h qd + h^2 sum_j bb_j a_j, qd_new = qd + h sum_j
 * b_j a_j (Hairer, Norsett and Wanner, Solving ODEs I, II.7). L_j(theta) = sum_k lagrange_jk theta^k are the
 * polynomials that are 1 at c_j and 0 at the others. The matrix a_ij is R B L, R L = 1, with a block of B
 * for each eigenvalue: lambda_k of a real one, the rows (re, -im) and (im, re) of a conjugate pair, of which
 * one is listed. L has the left eigenvectors as rows, of pairs their real parts above their imaginary ones.
 *
 * Error: d = the accelerations at the begin + sum_j e_j a_j, what the polynomial misses there, falls with
 * h^s, and d_low, of one abscissa less, with h^(s - 1). A vibration of x radians a step has d = K x^s and
 * d_low = K_low x^(s
 * - 1) times its acceleration, and an error of its position of C x^(order + 1) times its amplitude: so x =
 * ratio |d| / |d_low|,   error = share h^2 |d| x^(order - s - 1),   ratio = K_low / K, share = C / K.
 */
struct refdyn_collocation_table {
    int stages;
    int continued; /* the last so many accelerations of a step are continued as the next one's first guess */
    int eigenvalues; /* listed */
    double ratio, share;
    const double *c;        /* (s) */
    const double *a;        /* (s x s) integrals of L_j to c_i */
    const double *aa;       /* (s x s) its square */
    const double *b;        /* (s) integrals to 1 */
    const double *bb;       /* (s) their integrals to 1 */
    const double *lagrange; /* (s x s) */
    const double *e;        /* (s) -L_j(0) */
    const double *e_low;    /* (s) the same without the last abscissa */
    const double *lambda;   /* (eigenvalues x 2) real and imaginary part; a real one comes first */
    const double *left;     /* (s x s) L */
    const double *right;    /* (s x s) R */
};

/* Accelerations (n) at theta of the polynomial of the step that was taken. */
void refdyn_collocation_accelerations(const struct refdyn_step *step, double theta, double *qdd);

/* Methods whose table is one of these. A guided step finds its stages without matrices where there is no room
 * for them. */
extern const struct refdyn_method_kind refdyn_collocation;

#endif
