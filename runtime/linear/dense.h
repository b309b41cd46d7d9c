/*
 * Small dense kernels: row-major, no allocation, loops contiguous in memory.
 *
 * A symmetric matrix is given and factored in its upper triangle, rows `stride` apart; what lies below the
 * diagonal is not read, and serves as room.
 */
#ifndef REFDYN_DENSE_H
#define REFDYN_DENSE_H

/* sum_j a_j b_j; four sums side by side, since one alone would wait for each addition */
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

/* Largest |a_j|, NaN counting as largest; *index (or NULL) its place, -1 when count is 0. */
double refdyn_largest(const double *a, int count, int *index);
/* True when no entry is infinite or NaN. */
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

/* y := A x, A (rows x columns) without gaps. Returns 0, as the next one. */
int refdyn_times(const double *A, int rows, int columns, const double *x, double *y);

/* y (n) += scale sum_j weight_j x_j over `count` vectors, `stride` apart. */
int refdyn_add_all(double *y, double scale, const double *weights, int count, const double *x, int stride,
                   int n);

#endif
