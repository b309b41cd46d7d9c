/*
 * Linear algebra without allocation: dense kernels, elimination, eigenvalues, and trees of joints in O(n).
 *
 * Matrices are row by row unless stated otherwise. A status is one of refdyn.h.
 */
#ifndef REFDYN_LINEAR_H
#define REFDYN_LINEAR_H

#include "runtime/core/base/core.h"

#include "refdyn.h"

/*
 * ---- Dense kernels ----
 *
 * Inner loops are contiguous in memory. A symmetric matrix is stored and factored in its upper triangle, rows
 * `stride` apart; the part below the diagonal is scratch.
 */

/* sum_j a_j b_j. Four partial sums, because one would wait for each addition. */
static inline double dense_dot(const double *restrict a, const double *restrict b, int count) {
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    int j = 0;
    for (; j + 3 < count; j += 4) {
        s0 += a[j] * b[j];
        s1 += a[j + 1] * b[j + 1];
        s2 += a[j + 2] * b[j + 2];
        s3 += a[j + 3] * b[j + 3];
    }
    for (; j < count; j++)
        s0 += a[j] * b[j];
    return s0 + s1 + (s2 + s3);
}

/* y += s x */
static inline void dense_add(double *restrict y, double s, const double *restrict x, int count) {
    for (int j = 0; j < count; j++)
        y[j] += s * x[j];
}

/* The largest |a_j|; NaN counts as largest. *index (or NULL): its place, -1 if count is 0. */
double refdyn_largest(const double *a, int count, int *index);
/* Returns whether all entries are finite. */
int refdyn_is_finite(const double *a, int count);

/*
 * A = U^T D U with unit upper U (row-oriented outer products, Golub and Van Loan, Matrix Computations, 4.1).
 * Afterwards row k holds D_kk, then D_kk U_kj. Rounding does not depend on a scaling of rows and columns of A
 * (van der Sluis, Numer. Math. 14:14-23, 1969), so none is applied.
 * Returns -1, or the index of the first pivot that is not above n eps of its diagonal entry.
 */
int refdyn_factor(double *A, int n, int stride);
/* x := A^-1 x with the factor. */
void refdyn_factor_solve(const double *A, int n, int stride, double *x);
/* x := D^-1/2 U^-T x, so that x^T x becomes x^T A^-1 x; and x := U^-1 D^-1/2 x. */
void refdyn_factor_half_forward(const double *A, int n, int stride, double *x);
void refdyn_factor_half_backward(const double *A, int n, int stride, double *x);

/* y := A x for a contiguous A (rows x columns). Returns 0, as does refdyn_add_all. */
int refdyn_times(const double *A, int rows, int columns, const double *x, double *y);

/* y (n) += scale sum_j weight_j x_j over `count` vectors, `stride` apart. */
int refdyn_add_all(double *y, double scale, const double *weights, int count, const double *x, int stride,
                   int n);

/*
 * ---- Elimination ----
 *
 * P A = L U of dense matrices with pivoting, real and complex. Factors are stored column by column, L_ij or
 * U_ij in A[j n + i], with the inverses of U's diagonal. pivot (k) is the row that was exchanged with row k.
 * The imaginary parts of a complex matrix or vector follow all its real parts.
 */

/*
 * Eliminates a real matrix that is stored column by column. Returns the number of pivots: min(rows, columns),
 * or fewer where the remaining entries are 0. scale (rows) weighs the rows when pivots are compared, 0
 * excludes a row; it is permuted like the rows. order NULL: pivot k is the largest entry of column k (partial
 * pivoting); otherwise it is the largest of all remaining columns (full pivoting), and order (columns) is
 * permuted like them.
 */
int refdyn_eliminate(double *A, int rows, int columns, int *pivot, int *order, double *scale);

/* Sorts a list in ascending order, such as the columns without a pivot. */
static inline void refdyn_sort(int *list, int count) {
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && list[j - 1] > list[j]; j--) {
            const int kept = list[j];
            list[j] = list[j - 1];
            list[j - 1] = kept;
        }
}

/*
 * Factors a matrix (n x n, row by row) by partial pivoting; rows are divided by their largest entry when
 * pivots are compared (Golub and Van Loan, Matrix Computations, 3.4). scale (n): 1 over the largest entry of
 * each row, in the order after pivoting. Returns whether the matrix is regular.
 */
int refdyn_lu_factor(int is_complex, double *A, int n, int *pivot, double *scale);
/* x (n) := A^-1 x with the factors. Returns 0. */
int refdyn_lu_solve(int is_complex, const double *A, int n, const int *pivot, double *x);
/* X := A^-T X for real factors and `count` right sides, rows of X `stride` apart. Returns 0. */
int refdyn_lu_solve_transposed(const double *A, int n, const int *pivot, double *X, int stride, int count);

/* ---- Eigenvalues ---- */

/*
 * values (n) and vectors (n x n, one a column) of a symmetric A (n x n), which is overwritten; in no
 * particular order. * By Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5): good to rounding
 * of the largest entry.
 */
void refdyn_symmetric_eigenvalues(double *A, int n, double *values, double *vectors);

/*
 * re and im (n) of the eigenvalues of any A (n x n), which is overwritten. Complex pairs are neighbours, the
 * one with im > 0 first. By Householder's reflections to Hessenberg form and Francis's double shifts (Golub
 * and Van Loan, Matrix Computations, 7.4, 7.5). Returns 0 where they do not converge.
 */
int refdyn_eigenvalues(double *A, int n, double *re, double *im);

/* clang-format off */
/*
 * ---- Trees of joints in O(n) ----
 *
 * The tangent of a tree of joints as vectors: its products, and L U in O(n) (theory, sect. 8.5).
 *
 * In: the result of `tangent_vectors` (refdyn_model.h). Out: products with M, D and K, and solutions with
 * A = M + g D + g^2 K + pulled^T (g pull_by_qd + g^2 pull_by_q), bordered by rows. For a joint i beyond j, with wrenches
 * moved to the origin of j,
 *     A_ji = S_j . W_i,   A_ij = Z_j . Y_i
 *     S = (e | e), where e turns | slides
 *     W = (moment | force) of mass + 2 g damping + g^2 stiffness
 *     Y = (mass moment, spin, mass force, turned rows)
 *     Z = (e + 2 g e' + g^2 e'', 2 g e + 2 g^2 e', g^2 lever + [e + 2 g e' + g^2 e''], g^2 e), only the brackets of a slide.
 * Products of all pairs are sums carried from joint to joint. Eliminated from the tips (no pivoting, as in
 * L^T D L of M), x_i adds -S_l . W_i Y_i . Z_k / A_ii to every entry (l, k) of joints nearer the ground. One matrix
 * X = sum W_i Y_i^T / A_ii, moved along, sums this over all joints beyond j, so that at j
 *     W_j -= X Z_j,   Y_j -= X^T S_j,   A_jj = Z_j . Y_j + rotor_j + g damping_j + g^2 stiffness_j.
 * Three turns that share springs (strains) are eliminated together: their entries A_tu are computed, K and D of the
 * strains added, and rows and columns combined, Y_l -= A_lk Y_k / A_kk, W_l -= W_k A_kl / A_kk, A_lj -= A_lk A_kj / A_kk.
 * Couplings and rows are a border, eliminated last. In a plane X is 3 x 5, in space 6 x 12. The matrices of a collocation
 * method, one real or complex g for each eigenvalue, are worked on side by side.
 */
/* clang-format on */

/* The tangent as vectors of joints, and its factors. "By position" means an order in which all joints beyond
 * a joint follow it. */
struct refdyn_chain {
    const struct refdyn_model *model;
    int n, is_planar, border;            /* border: couplings, and the rows of the last factorisation */
    int left, right;                     /* components of a wrench, 3 or 6, and of Y and Z, 5 or 12 */
    int record;                          /* doubles of a joint's vectors, in the order of chain_sweeps.c */
    double *records;                     /* (n x record) */
    double *stiffness, *damping, *rotor; /* (n) joint terms of K, D and M outside the vectors */
    int has_strains;
    double *strains; /* (n x 6) K row, K column and D by the previous turn, then by the one before that */
    int *ends_ball;  /* (n) the third of three turns that share strains */
    const double *pulled, *by_q, *by_qd; /* (couplings x n) in the result */
    double *factors;     /* n x refdyn_chain_numbers real numbers, then as many wide ones: linear_private.h */
    double *responses;   /* (couplings + m) x n, likewise: A^-1 of the border's columns */
    double *border_rows; /* likewise: the rows of the border for the last g */
    double *corner;      /* (couplings + m)^2, then as many complex ones for each lane: its L U */
    double *inner;       /* (slots x left x right) numbers: the matrices X */
    double *sweep;       /* (n x right) numbers: the sums that are carried */
    double *side;        /* scratch for right sides: 4 n, and 2 n + 2 (couplings + m) numbers */
    double *scale;       /* (couplings + m) scratch */
    int *order;          /* (n) coordinate by position */
    int *parent;         /* (n) position of the next joint towards the ground, -1: none */
    int *other, *next;   /* (n) the second joint beyond each, and the next sibling, -1: none */
    int *moves;          /* (n) 0: it shares the origin of the joint before */
    int *slot;           /* (n) slot of X: that of the first joint beyond, or its own */
    int *pivot;          /* (couplings + m), then as many for each lane */
};

/* Lays out arrays for the factors of a real matrix and, with has_wide, for those of a collocation method. */
void refdyn_chain_lay_out(struct refdyn_chain *chain, const struct refdyn_model *model, int has_wide,
                          struct layout *layout);
/* Doubles of the result of tangent_vectors after its rows. */
int refdyn_chain_result_size(const struct refdyn_model *model);
/* Keeps the parts of such a result that M needs and clears the others. */
void refdyn_chain_keep_mass(const struct refdyn_model *model, double *result, double *diagonals);
/* Reads the vectors; `diagonals` points to the first entry after the rows of `result`. */
void refdyn_chain_take(struct refdyn_chain *chain, const double *result, const double *diagonals);

/* y (n) := M m + D d + K k; each of m, d, k (n) may be NULL. */
void refdyn_chain_times(struct refdyn_chain *chain, const double *m, const double *d, const double *k,
                        double *y);

/* Rows of a border: columns -u^T, rows u + g by_qd + g^2 by_q, `count` of those that `places` names. */
struct refdyn_border {
    const double *u, *by_qd, *by_q; /* (m x n) each */
    const int *places;              /* (count) */
    int count;
};

/* Factors the matrix for a real g, and solves in place: x (n + count), whose border entries stay. Errors:
 * MATRIX_SINGULAR. */
int refdyn_chain_factor(struct refdyn_chain *chain, double g, const struct refdyn_border *border);
void refdyn_chain_solve(struct refdyn_chain *chain, double *x);
/*
 * The same for g = h lambda_k of `count` eigenvalues (count x 2: real and imaginary parts), side by side.
 * Solves for the change of accelerations by residuals: right sides M x and u x; x holds n values for a real
 * eigenvalue, n real and n imaginary ones for another, in place. A count may be smaller than that of the
 * factors. Errors: MATRIX_SINGULAR.
 */
int refdyn_chain_factor_all(struct refdyn_chain *chain, int count, const double *lambda, double h,
                            const struct refdyn_border *border);
void refdyn_chain_solve_all(struct refdyn_chain *chain, int count, const double *lambda,
                            const struct refdyn_border *border, double *x);

#endif
