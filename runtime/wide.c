/*
 * Dense kernels that are compiled twice, for wide vectors and for any processor: L U factorisation of real
 * and complex matrices with partial pivoting, products, sums of many vectors. See dense.h.
 *
 * Columns are eliminated in panels: what four of them subtract from the rest is subtracted in one pass, which
 * reads and writes each entry once (Golub and Van Loan, Matrix Computations, 3.2.11).
 */
#include <float.h>
#include <math.h>

#include "dense.h"
#include "wide.h"

enum { PANEL = 4 };

INLINE void swap_rows(double *restrict a, double *restrict b, int count) {
    for (int j = 0; j < count; j++) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

/* ---- Real ---- */

/* The row from k on with the largest entry of column k, for its size; -1: all are zero or NaN. */
INLINE int find_pivot(const double *A, int n, int k, const double *scale) {
    double largest = 0;
    int at = -1;
    for (int i = k; i < n; i++) {
        const double size = fabs(A[i * n + k]) * scale[i];
        if (size > largest) {
            largest = size;
            at = i;
        }
    }
    return at;
}

/* Columns [first, last) of all rows from `first` on: factors, and row swaps over the whole width. */
INLINE int factor_panel(double *A, int n, int first, int last, int *pivot, double *scale) {
    for (int k = first; k < last; k++) {
        const int at = find_pivot(A, n, k, scale);
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(A + at * n, A + k * n, n);
            scale[at] = scale[k];
        }
        const double inverse = 1 / A[k * n + k];
        for (int i = k + 1; i < n; i++) {
            double *row = A + i * n;
            row[k] *= inverse;
            for (int j = k + 1; j < last; j++)
                row[j] -= row[k] * A[k * n + j];
        }
    }
    return -1;
}

/* row -= l_0 u_0 + ... of `count` rows of U above, from column `from` on. */
INLINE void subtract(double *restrict row, const double *restrict l, const double *restrict u, int stride,
                     int count, int from, int n) {
    if (count == PANEL) {
        const double *u1 = u + stride, *u2 = u1 + stride, *u3 = u2 + stride;
        for (int j = from; j < n; j++)
            row[j] = row[j] - l[0] * u[j] - l[1] * u1[j] - l[2] * u2[j] - l[3] * u3[j];
        return;
    }
    for (int k = 0; k < count; k++)
        for (int j = from; j < n; j++)
            row[j] -= l[k] * u[k * stride + j];
}

INLINE int lu_factor(double *A, int n, int *pivot, double *scale) {
    for (int i = 0; i < n; i++) {
        double largest = 0;
        for (int j = 0; j < n; j++)
            largest = fabs(A[i * n + j]) > largest ? fabs(A[i * n + j]) : largest;
        scale[i] = 1 / largest;
    }
    for (int first = 0; first < n; first += PANEL) {
        const int last = first + PANEL < n ? first + PANEL : n;
        const int failed = factor_panel(A, n, first, last, pivot, scale);
        if (failed >= 0)
            return failed;
        for (int i = first + 1; i < last; i++)
            subtract(A + i * n, A + i * n + first, A + first * n, n, i - first, last, n);
        for (int i = last; i < n; i++)
            subtract(A + i * n, A + i * n + first, A + first * n, n, last - first, last, n);
    }
    return -1;
}

/* ---- Complex: real parts first, imaginary ones n n further ---- */

INLINE int find_complex_pivot(const double *re, const double *im, int n, int k) {
    double largest = 0;
    int at = -1;
    for (int i = k; i < n; i++) {
        const double size = fabs(re[i * n + k]) + fabs(im[i * n + k]);
        if (size > largest) {
            largest = size;
            at = i;
        }
    }
    return at;
}

INLINE int factor_complex_panel(double *re, double *im, int n, int first, int last, int *pivot) {
    for (int k = first; k < last; k++) {
        const int at = find_complex_pivot(re, im, n, k);
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(re + at * n, re + k * n, n);
            swap_rows(im + at * n, im + k * n, n);
        }
        const double a = re[k * n + k], b = im[k * n + k], square = a * a + b * b;
        if (!(square > 0 && square <= DBL_MAX))
            return k;
        for (int i = k + 1; i < n; i++) {
            double *x = re + i * n, *y = im + i * n;
            const double lr = (x[k] * a + y[k] * b) / square, li = (y[k] * a - x[k] * b) / square;
            x[k] = lr;
            y[k] = li;
            for (int j = k + 1; j < last; j++) {
                x[j] -= lr * re[k * n + j] - li * im[k * n + j];
                y[j] -= lr * im[k * n + j] + li * re[k * n + j];
            }
        }
    }
    return -1;
}

/* Row i of A -= L U over the rows [first, last) of U, from column `from` on; two of them in one pass. */
INLINE void subtract_complex(double *restrict A, int n, int i, int first, int last, int from) {
    double *restrict x = A + i * n, *restrict y = x + n * n;
    int k = first;
    for (; k + 1 < last; k += 2) {
        const double *u = A + k * n, *v = u + n * n, *w = u + n, *z = v + n;
        const double a = x[k], b = y[k], c = x[k + 1], d = y[k + 1];
        for (int j = from; j < n; j++) {
            x[j] = x[j] - (a * u[j] - b * v[j]) - (c * w[j] - d * z[j]);
            y[j] = y[j] - (a * v[j] + b * u[j]) - (c * z[j] + d * w[j]);
        }
    }
    for (; k < last; k++) {
        const double *u = A + k * n, *v = u + n * n;
        const double a = x[k], b = y[k];
        for (int j = from; j < n; j++) {
            x[j] -= a * u[j] - b * v[j];
            y[j] -= a * v[j] + b * u[j];
        }
    }
}

INLINE int complex_lu_factor(double *A, int n, int *pivot) {
    for (int first = 0; first < n; first += PANEL) {
        const int last = first + PANEL < n ? first + PANEL : n;
        const int failed = factor_complex_panel(A, A + n * n, n, first, last, pivot);
        if (failed >= 0)
            return failed;
        for (int i = first + 1; i < last; i++)
            subtract_complex(A, n, i, first, i, last);
        for (int i = last; i < n; i++)
            subtract_complex(A, n, i, first, last, last);
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

INLINE int lu_solve(const double *A, int n, const int *pivot, double *x) {
    exchange(x, n, pivot);
    for (int k = 1; k < n; k++)
        x[k] -= dot(A + k * n, x, k);
    for (int k = n - 1; k >= 0; k--)
        x[k] = (x[k] - dot(A + k * n + k + 1, x + k + 1, n - k - 1)) / A[k * n + k];
    return 0;
}

/* (r, i) -= sum_j (a_j + i b_j) (x_j + i y_j) */
INLINE void subtract_dot(const double *restrict a, const double *restrict b, const double *restrict x,
                         const double *restrict y, int count, double *r, double *i) {
    double u[4] = {0, 0, 0, 0}, v[4] = {0, 0, 0, 0}, rest_r = 0, rest_i = 0;
    int j = 0;
    for (; j + 3 < count; j += 4)
        for (int k = 0; k < 4; k++) {
            u[k] += a[j + k] * x[j + k] - b[j + k] * y[j + k];
            v[k] += a[j + k] * y[j + k] + b[j + k] * x[j + k];
        }
    for (; j < count; j++) {
        rest_r += a[j] * x[j] - b[j] * y[j];
        rest_i += a[j] * y[j] + b[j] * x[j];
    }
    *r -= u[0] + u[1] + (u[2] + u[3]) + rest_r;
    *i -= v[0] + v[1] + (v[2] + v[3]) + rest_i;
}

INLINE int complex_lu_solve(const double *A, int n, const int *pivot, double *x) {
    const double *re = A, *im = A + n * n;
    double *y = x + n;
    exchange(x, n, pivot);
    exchange(y, n, pivot);
    for (int k = 1; k < n; k++)
        subtract_dot(re + k * n, im + k * n, x, y, k, &x[k], &y[k]);
    for (int k = n - 1; k >= 0; k--) {
        const int at = k * n + k;
        double r = x[k], i = y[k];
        subtract_dot(re + at + 1, im + at + 1, x + k + 1, y + k + 1, n - k - 1, &r, &i);
        const double square = re[at] * re[at] + im[at] * im[at];
        x[k] = (r * re[at] + i * im[at]) / square;
        y[k] = (i * re[at] - r * im[at]) / square;
    }
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
