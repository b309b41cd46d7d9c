/*
 * Linear algebra without allocation: dense kernels, elimination, eigenvalues, and trees of joints in O(n).
 *
 * Matrices are row by row unless stated otherwise. A status is one of refdyn.h.
 */
#ifndef REFDYN_LINEAR_H
#define REFDYN_LINEAR_H

#include "runtime/core/base/core.h"

/* ---- Dense kernels. A symmetric matrix is stored and factored in its upper triangle, rows `stride` apart;
 * the part below the diagonal is scratch ---- */

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

/* A = U^T D U with unit upper U. Afterwards row k holds D_kk, then D_kk U_kj. Returns -1, or the index of the
 * first pivot that is not above n eps of its diagonal entry. */
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

/* ---- Elimination: P A = L U with pivoting, real and complex. pivot (k) is the row that was exchanged with
 * row k. The imaginary parts of a complex matrix or vector follow all its real parts ---- */

/*
 * Eliminates a real matrix that is stored column by column: L_ij or U_ij in A[j n + i], with the inverses of
 * U's diagonal. Returns the number of pivots: min(rows, columns), or fewer where the remaining entries are 0.
 * scale (rows) weighs the rows when pivots are compared, 0 excludes a row; it is permuted like the rows.
 * order NULL: partial pivoting; otherwise full pivoting, and order (columns) is permuted like the columns.
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

/* Factors a matrix (n x n, row by row) by partial pivoting. scale (n): 1 over the largest entry of each row,
 * in the order after pivoting. Returns whether the matrix is regular. */
int refdyn_lu_factor(int is_complex, double *A, int n, int *pivot, double *scale);
/* x (n) := A^-1 x with the factors. Returns 0. */
int refdyn_lu_solve(int is_complex, const double *A, int n, const int *pivot, double *x);
/* X := A^-T X for real factors and `count` right sides, rows of X `stride` apart. Returns 0. */
int refdyn_lu_solve_transposed(const double *A, int n, const int *pivot, double *X, int stride, int count);

/* ---- Eigenvalues ---- */

/* values (n) and vectors (n x n, one a column) of a symmetric A (n x n), which is overwritten; in no
 * particular order. Good to rounding of the largest entry. */
void refdyn_symmetric_eigenvalues(double *A, int n, double *values, double *vectors);
/* re and im (n) of the eigenvalues of any A (n x n), which is overwritten. Complex pairs are neighbours, the
 * one with im > 0 first. Returns 0 where the iteration does not converge. */
int refdyn_eigenvalues(double *A, int n, double *re, double *im);

/* Scratch for matrices of up to n x n. */
struct refdyn_rank_scratch {
    double *factors, *scale; /* (n x n), (n) */
    int *pivot, *order;      /* (n) each */
};

/* Returns the rank of A (n x n, column by column): the number of pivots above tol. Overwrites A and, in the
 * scratch, all but `factors`. */
int refdyn_rank(double *A, int n, double tol, const struct refdyn_rank_scratch *scratch);
/* Removes an eigenvalue of A (n x n) with all its Jordan chains; pivots of A - value up to tol are 0. Returns
 * the size of the smaller matrix in A, which has the other eigenvalues. */
int refdyn_deflate(double *A, int n, double value, double tol, const struct refdyn_rank_scratch *scratch);

/* ---- Trees of joints in O(n): chain_sweeps.c has the formulas ---- */

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
