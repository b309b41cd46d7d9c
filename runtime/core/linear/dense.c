/*
 * Small dense kernels: products, U^T D U and solutions with it. Inner loops are contiguous in memory.
 *
 * The factors come from row-oriented outer products (Golub and Van Loan, Matrix Computations, 4.1). Rounding
 * does not depend on a scaling of rows and columns of A (van der Sluis, Numer. Math. 14:14-23, 1969), so none
 * is applied.
 */
#include "runtime/core/linear/linear.h"

#include <float.h>
#include <math.h>

#define LANES 1
#define NAMED(name) name##_of_one
#include "runtime/core/linear/weighted_sum.inc"

double refdyn_largest(const double *a, int count, int *index) {
    double largest = 0;
    int at = count > 0 ? 0 : -1;
    for (int j = 0; j < count; j++)
        if (!(fabs(a[j]) <= largest)) {
            largest = fabs(a[j]);
            at = j;
            if (isnan(largest))
                break;
        }
    if (index)
        *index = at;
    return largest;
}

/* 0 x is 0 for finite x and NaN for the others. */
int refdyn_is_finite(const double *a, int count) {
    double sum = 0, other = 0;
    int j = 0;
    for (; j + 3 < count; j += 4) {
        sum += 0.0 * a[j] + 0.0 * a[j + 1];
        other += 0.0 * a[j + 2] + 0.0 * a[j + 3];
    }
    for (; j < count; j++)
        sum += 0.0 * a[j];
    return sum + other == 0.0;
}

/* Subtracts the contribution of row k from the rows below it. */
static void eliminate_below(double *restrict A, int n, int stride, int k) {
    const double *restrict row = A + k * stride;
    const double inverse = 1 / row[k];
    for (int i = k + 1; i < n; i++) {
        double *restrict below = A + i * stride;
        const double factor = row[i] * inverse;
        if (factor != 0)
            for (int j = i; j < n; j++)
                below[j] -= factor * row[j];
    }
}

int refdyn_factor(double *A, int n, int stride) {
    const double least = n * DBL_EPSILON;
    for (int i = 1; i < n; i++)
        A[i * stride] =
            A[i * stride + i]; /* stores the diagonal entry before elimination below the diagonal */
    for (int k = 0; k < n; k++) {
        const double size = A[k * stride];
        if (!(size > 0 && A[k * stride + k] > least * size))
            return k;
        eliminate_below(A, n, stride, k);
    }
    return -1;
}

void refdyn_factor_solve(const double *A, int n, int stride, double *x) {
    for (int k = 0; k < n; k++) {
        x[k] /= A[k * stride + k];
        if (x[k] != 0)
            dense_add(x + k + 1, -x[k], A + k * stride + k + 1, n - k - 1);
    }
    for (int k = n - 2; k >= 0; k--) {
        const double *row = A + k * stride;
        x[k] -= dense_dot(row + k + 1, x + k + 1, n - k - 1) / row[k];
    }
}

void refdyn_factor_half_forward(const double *A, int n, int stride, double *x) {
    for (int k = 0; k < n; k++) {
        const double *row = A + k * stride;
        dense_add(x + k + 1, -x[k] / row[k], row + k + 1, n - k - 1);
        x[k] /= sqrt(row[k]);
    }
}

void refdyn_factor_half_backward(const double *A, int n, int stride, double *x) {
    for (int k = n - 1; k >= 0; k--) {
        const double *row = A + k * stride;
        x[k] = (x[k] * sqrt(row[k]) - dense_dot(row + k + 1, x + k + 1, n - k - 1)) / row[k];
    }
}

INLINE int times(const double *A, int rows, int columns, const double *x, double *y) {
    for (int i = 0; i < rows; i++)
        y[i] = dense_dot(A + i * columns, x, columns);
    return 0;
}

INLINE int add_all(double *restrict y, double scale, const double *weights, int count,
                   const double *restrict x, int stride, int n) {
    weighted_sum_of_one(y, scale, weights, count, x, stride, n);
    return 0;
}

COMPILE(int, times, (const double *A, int rows, int columns, const double *x, double *y),
        (A, rows, columns, x, y))
COMPILE(int, add_all,
        (double *restrict y, double scale, const double *weights, int count, const double *restrict x,
         int stride, int n),
        (y, scale, weights, count, x, stride, n))
