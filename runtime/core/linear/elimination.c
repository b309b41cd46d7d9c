/*
 * Elimination with pivoting. COMPILE (linear_private.h) compiles it twice, and is_complex becomes a constant.
 *
 * Step k divides column k by its pivot and subtracts A_kj times it from each remaining column j (Golub and
 * Van Loan, Matrix Computations, 3.2.6, by columns). Elimination and solution run along columns, which are
 * contiguous in memory; sums along short rows would wait for each addition. refdyn_lu_factor divides rows by
 * their largest entry when it compares pivots (Golub and Van Loan, 3.4).
 */
#include "runtime/core/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "runtime/core/linear/linear_private.h"

/* (x, y) -= (a + i b) (u, v); of real columns x -= a u */
INLINE void subtract(int is_complex, double *restrict x, double *restrict y, double a, double b,
                     const double *restrict u, const double *restrict v, int count) {
    for (int i = 0; i < count; i++) {
        x[i] -= is_complex ? u[i] * a - v[i] * b : u[i] * a;
        if (is_complex)
            y[i] -= u[i] * b + v[i] * a;
    }
}

/* (x, y) *= a + i b */
INLINE void multiply(int is_complex, double *restrict x, double *restrict y, double a, double b, int count) {
    for (int i = 0; i < count; i++) {
        const double u = x[i], v = is_complex ? y[i] : 0;
        x[i] = is_complex ? u * a - v * b : u * a;
        if (is_complex)
            y[i] = u * b + v * a;
    }
}

/* (x, y) := 1 / (x, y). Returns 0 if this is zero, infinite or NaN. */
INLINE int invert(int is_complex, double *x, double *y) {
    const double re = *x, im = is_complex ? *y : 0, square = re * re + im * im;
    if (is_complex && !(square > 0 && square <= DBL_MAX))
        return 0;
    *x = is_complex ? re / square : 1 / re;
    if (is_complex)
        *y = -im / square;
    return 1;
}

INLINE void swap(double *a, double *b) {
    const double kept = *a;
    *a = *b;
    *b = kept;
}

INLINE void swap_rows(double *A, int rows, int columns, int a, int b) {
    for (int j = 0; j < columns && a != b; j++)
        swap(A + j * rows + a, A + j * rows + b);
}

INLINE void swap_columns(double *A, int rows, int a, int b) {
    for (int i = 0; i < rows && a != b; i++)
        swap(A + a * rows + i, A + b * rows + i);
}

/* Finds the largest entry, relative to the size of its row, of columns [k, last) from row k on. Returns 0 if
 * all are zero or NaN. */
INLINE int find_pivot(int is_complex, const double *re, const double *im, int rows, int k, int last,
                      const double *scale, int *row, int *column) {
    double largest = 0;
    for (int j = k; j < last; j++)
        for (int i = k; i < rows; i++) {
            const double entry = fabs(re[j * rows + i]) + (is_complex ? fabs(im[j * rows + i]) : 0);
            if (entry * scale[i] > largest) {
                largest = entry * scale[i];
                *row = i;
                *column = j;
            }
        }
    return largest > 0;
}

INLINE void subtract_pivot_column(int is_complex, double *re, double *im, int rows, int columns, int k) {
    const double *u = re + k * rows, *v = im + k * rows;
    for (int j = k + 1; j < columns; j++) {
        double *x = re + j * rows, *y = im + j * rows;
        subtract(is_complex, x + k + 1, y + k + 1, x[k], y[k], u + k + 1, v + k + 1, rows - k - 1);
    }
}

INLINE int eliminate_columns(int is_complex, double *A, int rows, int columns, int *pivot, int *order,
                             double *scale) {
    double *re = A, *im = A + (is_complex ? rows * columns : 0);
    int k = 0, row = 0, column = 0;
    for (; k < rows && k < columns; k++) {
        double *x = re + k * rows, *y = im + k * rows;
        if (!find_pivot(is_complex, re, im, rows, k, order ? columns : k + 1, scale, &row, &column))
            break;
        if (order) {
            swap_columns(re, rows, k, column);
            const int kept = order[k];
            order[k] = order[column];
            order[column] = kept;
        }
        pivot[k] = row;
        swap(scale + k, scale + row);
        swap_rows(re, rows, columns, k, row);
        if (is_complex)
            swap_rows(im, rows, columns, k, row);
        if (!invert(is_complex, x + k, y + k))
            break;
        multiply(is_complex, x + k + 1, y + k + 1, x[k], y[k], rows - k - 1);
        subtract_pivot_column(is_complex, re, im, rows, columns, k);
    }
    return k;
}

INLINE int eliminate(double *A, int rows, int columns, int *pivot, int *order, double *scale) {
    return eliminate_columns(0, A, rows, columns, pivot, order, scale);
}

INLINE void transpose(double *A, int n) {
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            swap(A + i * n + j, A + j * n + i);
}

INLINE int factor(int is_complex, double *A, int n, int *pivot, double *scale) {
    double *im = A + n * n;
    for (int i = 0; i < n; i++) {
        double largest = 0;
        for (int j = i * n; j < i * n + n; j++) {
            const double size = fabs(A[j]) + (is_complex ? fabs(im[j]) : 0);
            largest = size > largest ? size : largest;
        }
        scale[i] = 1 / largest;
    }
    transpose(A, n);
    if (is_complex)
        transpose(im, n);
    const int count = eliminate_columns(is_complex, A, n, n, pivot, NULL, scale);
    return count < n ? count : -1;
}

INLINE int lu_factor(int is_complex, double *A, int n, int *pivot, double *scale) {
    return is_complex ? factor(1, A, n, pivot, scale) : factor(0, A, n, pivot, scale);
}

/* ---- Solution ---- */

INLINE void exchange(double *x, int n, const int *pivot) {
    for (int k = 0; k < n; k++)
        swap(x + k, x + pivot[k]);
}

INLINE int solve(int is_complex, const double *A, int n, const int *pivot, double *x) {
    const double *re = A, *im = A + (is_complex ? n * n : 0);
    double *y = x + (is_complex ? n : 0);
    exchange(x, n, pivot);
    if (is_complex)
        exchange(y, n, pivot);
    for (int k = 0; k < n; k++) {
        const int at = k * n + k + 1;
        subtract(is_complex, x + k + 1, y + k + 1, x[k], y[k], re + at, im + at, n - k - 1);
    }
    for (int k = n - 1; k >= 0; k--) {
        multiply(is_complex, x + k, y + k, re[k * n + k], im[k * n + k], 1);
        subtract(is_complex, x, y, x[k], y[k], re + k * n, im + k * n, k);
    }
    return 0;
}

INLINE int lu_solve(int is_complex, const double *A, int n, const int *pivot, double *x) {
    return is_complex ? solve(1, A, n, pivot, x) : solve(0, A, n, pivot, x);
}

/* A^T = U^T L^T P */
INLINE int lu_solve_transposed(const double *A, int n, const int *pivot, double *X, int stride, int count) {
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < k; i++)
            dense_add(X + k * stride, -A[k * n + i], X + i * stride, count);
        for (int j = 0; j < count; j++)
            X[k * stride + j] *= A[k * n + k];
    }
    for (int k = n - 1; k >= 0; k--)
        for (int i = k + 1; i < n; i++)
            dense_add(X + k * stride, -A[k * n + i], X + i * stride, count);
    for (int k = n - 1; k >= 0; k--)
        for (int j = 0; j < count && pivot[k] != k; j++)
            swap(X + k * stride + j, X + pivot[k] * stride + j);
    return 0;
}

COMPILE(int, eliminate, (double *A, int rows, int columns, int *pivot, int *order, double *scale),
        (A, rows, columns, pivot, order, scale))
COMPILE(int, lu_factor, (int is_complex, double *A, int n, int *pivot, double *scale),
        (is_complex, A, n, pivot, scale))
COMPILE(int, lu_solve, (int is_complex, const double *A, int n, const int *pivot, double *x),
        (is_complex, A, n, pivot, x))
COMPILE(int, lu_solve_transposed,
        (const double *A, int n, const int *pivot, double *X, int stride, int count),
        (A, n, pivot, X, stride, count))
