/*
 * Dense kernels that are compiled twice, for wide vectors and for any processor: L U factorisation of real
 * and complex matrices with partial pivoting, products, sums of many vectors. See dense.h.
 *
 * Factors stand column by column, so that elimination and solution run down columns: sums along short rows
 * wait for their own additions. Columns are eliminated in panels: what four of them subtract from the rest is
 * subtracted in one pass, which reads and writes each entry once (Golub and Van Loan, Matrix Computations,
 * 3.2.11).
 */
#include "base/arithmetic.h"

#include <float.h>
#include <math.h>

#include "linear/dense.h"
#include "linear/wide.h"

enum { PANEL = 4 };

INLINE void transpose(double *A, int n) {
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            const double kept = A[i * n + j];
            A[i * n + j] = A[j * n + i];
            A[j * n + i] = kept;
        }
}

/* Of a matrix that stands column by column. */
INLINE void swap_rows(double *A, int n, int a, int b) {
    for (int j = 0; j < n; j++) {
        const double kept = A[j * n + a];
        A[j * n + a] = A[j * n + b];
        A[j * n + b] = kept;
    }
}

/* ---- Real ---- */

/* The row from k on with the largest entry of a column, for its size; -1: all are zero or NaN. */
INLINE int find_pivot(const double *column, int n, int k, const double *scale) {
    double largest = 0;
    int at = -1;
    for (int i = k; i < n; i++) {
        const double size = fabs(column[i]) * scale[i];
        if (size > largest) {
            largest = size;
            at = i;
        }
    }
    return at;
}

/* The columns [first, last): factors, inverse pivots on their diagonal; row swaps of all columns. */
INLINE int factor_panel(double *A, int n, int first, int last, int *pivot, double *scale) {
    for (int k = first; k < last; k++) {
        double *column = A + k * n;
        const int at = find_pivot(column, n, k, scale), below = n - k - 1;
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(A, n, at, k);
            scale[at] = scale[k];
        }
        column[k] = 1 / column[k];
        for (int i = k + 1; i < n; i++)
            column[i] *= column[k];
        for (int j = k + 1; j < last; j++)
            dense_add(A + j * n + k + 1, -A[j * n + k], column + k + 1, below);
    }
    return -1;
}

/* A column right of the panel that begins at `first`: its part of U, and what the panel subtracts below. */
INLINE void subtract_panel(double *restrict column, const double *restrict l0, int n, int first) {
    const double *l1 = l0 + n, *l2 = l1 + n, *l3 = l2 + n;
    double *u = column + first;
    const double a = u[0];
    const double b = u[1] - l0[first + 1] * a;
    const double c = u[2] - l0[first + 2] * a - l1[first + 2] * b;
    const double d = u[3] - l0[first + 3] * a - l1[first + 3] * b - l2[first + 3] * c;
    u[1] = b;
    u[2] = c;
    u[3] = d;
    for (int i = first + PANEL; i < n; i++)
        column[i] = column[i] - l0[i] * a - l1[i] * b - l2[i] * c - l3[i] * d;
}

INLINE int lu_factor(double *A, int n, int *pivot, double *scale) {
    for (int i = 0; i < n; i++) {
        double largest = 0;
        for (int j = 0; j < n; j++)
            largest = fabs(A[i * n + j]) > largest ? fabs(A[i * n + j]) : largest;
        scale[i] = 1 / largest;
    }
    transpose(A, n);
    for (int first = 0; first < n; first += PANEL) {
        const int last = first + PANEL < n ? first + PANEL : n;
        const int failed = factor_panel(A, n, first, last, pivot, scale);
        if (failed >= 0)
            return failed;
        for (int j = last; j < n; j++)
            subtract_panel(A + j * n, A + first * n, n, first);
    }
    return -1;
}

/* ---- Complex: real parts first, imaginary ones n n further ---- */

INLINE int find_complex_pivot(const double *re, const double *im, int n, int k) {
    double largest = 0;
    int at = -1;
    for (int i = k; i < n; i++) {
        const double size = fabs(re[i]) + fabs(im[i]);
        if (size > largest) {
            largest = size;
            at = i;
        }
    }
    return at;
}

/* (x, y) -= (a + i b) (u, v), entries from `from` to `to` */
INLINE void subtract_complex(double *restrict x, double *restrict y, double a, double b,
                             const double *restrict u, const double *restrict v, int from, int to) {
    for (int i = from; i < to; i++) {
        x[i] -= u[i] * a - v[i] * b;
        y[i] -= u[i] * b + v[i] * a;
    }
}

/* (x, y) *= a + i b, entries from `from` to `to` */
INLINE void scale_complex(double *restrict x, double *restrict y, double a, double b, int from, int to) {
    for (int i = from; i < to; i++) {
        const double u = x[i], v = y[i];
        x[i] = u * a - v * b;
        y[i] = u * b + v * a;
    }
}

INLINE int factor_complex_panel(double *re, double *im, int n, int first, int last, int *pivot) {
    for (int k = first; k < last; k++) {
        double *x = re + k * n, *y = im + k * n;
        const int at = find_complex_pivot(x, y, n, k);
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(re, n, at, k);
            swap_rows(im, n, at, k);
        }
        const double square = x[k] * x[k] + y[k] * y[k], a = x[k] / square, b = -y[k] / square;
        if (!(square > 0 && square <= DBL_MAX))
            return k;
        x[k] = a;
        y[k] = b;
        scale_complex(x, y, a, b, k + 1, n);
        for (int j = k + 1; j < last; j++)
            subtract_complex(re + j * n, im + j * n, re[j * n + k], im[j * n + k], x, y, k + 1, n);
    }
    return -1;
}

/* A column right of the panel that begins at `first`, as of real matrices; two columns in one pass. */
INLINE void subtract_complex_panel(double *restrict x, double *restrict y, const double *restrict re,
                                   const double *restrict im, int n, int first) {
    const int last = first + PANEL;
    for (int k = first; k < last - 1; k++)
        subtract_complex(x, y, x[k], y[k], re + k * n, im + k * n, k + 1, last);
    for (int k = first; k < last; k += 2) {
        const double *u = re + k * n, *v = im + k * n, *w = u + n, *z = v + n;
        const double a = x[k], b = y[k], c = x[k + 1], d = y[k + 1];
        for (int i = last; i < n; i++) {
            x[i] = x[i] - (u[i] * a - v[i] * b) - (w[i] * c - z[i] * d);
            y[i] = y[i] - (u[i] * b + v[i] * a) - (w[i] * d + z[i] * c);
        }
    }
}

INLINE int complex_lu_factor(double *A, int n, int *pivot) {
    double *re = A, *im = A + n * n;
    transpose(re, n);
    transpose(im, n);
    for (int first = 0; first < n; first += PANEL) {
        const int last = first + PANEL < n ? first + PANEL : n;
        const int failed = factor_complex_panel(re, im, n, first, last, pivot);
        if (failed >= 0)
            return failed;
        for (int j = last; j < n; j++)
            subtract_complex_panel(re + j * n, im + j * n, re, im, n, first);
    }
    return -1;
}

/* ---- Solution ---- */

INLINE void exchange(double *x, int n, const int *pivot) {
    for (int k = 0; k < n; k++) {
        const double kept = x[pivot[k]];
        x[pivot[k]] = x[k];
        x[k] = kept;
    }
}

INLINE int lu_solve(const double *A, int n, const int *pivot, double *x) {
    exchange(x, n, pivot);
    for (int k = 0; k < n; k++)
        dense_add(x + k + 1, -x[k], A + k * n + k + 1, n - k - 1);
    for (int k = n - 1; k >= 0; k--) {
        x[k] *= A[k * n + k];
        dense_add(x, -x[k], A + k * n, k);
    }
    return 0;
}

INLINE int complex_lu_solve(const double *A, int n, const int *pivot, double *x) {
    const double *re = A, *im = A + n * n;
    double *y = x + n;
    exchange(x, n, pivot);
    exchange(y, n, pivot);
    for (int k = 0; k < n; k++)
        subtract_complex(x, y, x[k], y[k], re + k * n, im + k * n, k + 1, n);
    for (int k = n - 1; k >= 0; k--) {
        scale_complex(x, y, re[k * n + k], im[k * n + k], k, k + 1);
        subtract_complex(x, y, x[k], y[k], re + k * n, im + k * n, 0, k);
    }
    return 0;
}

/* ---- Products and sums ---- */

/* sum_j a_j x_j, in four sums, which fit a vector */
INLINE double dot(const double *restrict a, const double *restrict x, int count) {
    double s[4] = {0, 0, 0, 0};
    int j = 0;
    for (; j + 3 < count; j += 4)
        for (int i = 0; i < 4; i++)
            s[i] += a[j + i] * x[j + i];
    double rest = 0;
    for (; j < count; j++)
        rest += a[j] * x[j];
    return s[0] + s[1] + (s[2] + s[3]) + rest;
}

INLINE int times(const double *A, int rows, int columns, const double *x, double *y) {
    for (int i = 0; i < rows; i++)
        y[i] = dot(A + i * columns, x, columns);
    return 0;
}

/* y += scale sum_j weight_j x_j, vectors `stride` apart; four of them in one pass */
INLINE int add_all(double *restrict y, double scale, const double *weights, int count,
                   const double *restrict x, int stride, int n) {
    int j = 0;
    for (; j + 3 < count; j += 4) {
        const double a = scale * weights[j], b = scale * weights[j + 1], c = scale * weights[j + 2],
                     d = scale * weights[j + 3];
        const double *u = x + j * stride, *v = u + stride, *w = v + stride, *z = w + stride;
        for (int i = 0; i < n; i++)
            y[i] = y[i] + a * u[i] + b * v[i] + c * w[i] + d * z[i];
    }
    for (; j < count; j++) {
        const double a = scale * weights[j], *u = x + j * stride;
        for (int i = 0; i < n; i++)
            y[i] += a * u[i];
    }
    return 0;
}

/* ---- Each of them compiled twice: for wide vectors, and for any processor ---- */

COMPILE(int, lu_factor, (double *A, int n, int *pivot, double *scale), (A, n, pivot, scale))
COMPILE(int, complex_lu_factor, (double *A, int n, int *pivot), (A, n, pivot))
COMPILE(int, lu_solve, (const double *A, int n, const int *pivot, double *x), (A, n, pivot, x))
COMPILE(int, complex_lu_solve, (const double *A, int n, const int *pivot, double *x), (A, n, pivot, x))
COMPILE(int, times, (const double *A, int rows, int columns, const double *x, double *y),
        (A, rows, columns, x, y))
COMPILE(int, add_all,
        (double *restrict y, double scale, const double *weights, int count, const double *restrict x,
         int stride, int n),
        (y, scale, weights, count, x, stride, n))
