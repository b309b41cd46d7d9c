/* Small dense kernels: see dense.h. */
#include "dense.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

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
    double sum = 0;
    for (int j = 0; j < count; j++)
        sum += 0.0 * a[j];
    return sum == 0.0;
}

/* Subtracts row k's part from the rows below it. */
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
        A[i * stride] = A[i * stride + i]; /* the diagonal entry before elimination, below the diagonal */
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

/* The row from k on with the largest entry of column k, for its size; -1: all are zero or NaN. */
static int find_pivot(const double *A, int n, int k, const double *scale) {
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

static void swap_rows(double *restrict a, double *restrict b, int count) {
    for (int j = 0; j < count; j++) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

int refdyn_lu_factor(double *A, int n, int *pivot, double *scale) {
    for (int i = 0; i < n; i++)
        scale[i] = 1 / refdyn_largest(A + i * n, n, NULL);
    for (int k = 0; k < n; k++) {
        const int at = find_pivot(A, n, k, scale);
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(A + at * n, A + k * n, n);
            scale[at] = scale[k];
        }
        const double *restrict row = A + k * n;
        const double inverse = 1 / row[k];
        for (int i = k + 1; i < n; i++) {
            double *restrict below = A + i * n;
            below[k] *= inverse;
            dense_add(below + k + 1, -below[k], row + k + 1, n - k - 1);
        }
    }
    return -1;
}

void refdyn_lu_solve(const double *A, int n, const int *pivot, double *x) {
    for (int k = 0; k < n; k++) {
        const double kept = x[pivot[k]];
        x[pivot[k]] = x[k];
        x[k] = kept;
    }
    for (int k = 1; k < n; k++)
        x[k] -= dense_dot(A + k * n, x, k);
    for (int k = n - 1; k >= 0; k--)
        x[k] = (x[k] - dense_dot(A + k * n + k + 1, x + k + 1, n - k - 1)) / A[k * n + k];
}

/* y += (sr + i si) (a + i b): real parts in yr, a, imaginary ones in yi, b */
static void complex_add(double *restrict yr, double *restrict yi, double sr, double si,
                        const double *restrict a, const double *restrict b, int count) {
    for (int j = 0; j < count; j++) {
        yr[j] += sr * a[j] - si * b[j];
        yi[j] += sr * b[j] + si * a[j];
    }
}

/* The row from k on with the largest entry of column k; -1: all are zero or NaN. */
static int find_complex_pivot(const double *re, const double *im, int n, int k) {
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

int refdyn_complex_lu_factor(double *A, int n, int *pivot) {
    double *re = A, *im = A + n * n;
    for (int k = 0; k < n; k++) {
        const int at = find_complex_pivot(re, im, n, k);
        if (at < 0)
            return k;
        pivot[k] = at;
        if (at != k) {
            swap_rows(re + at * n, re + k * n, n);
            swap_rows(im + at * n, im + k * n, n);
        }
        const double a = re[k * n + k], b = im[k * n + k], square = a * a + b * b;
        for (int i = k + 1; i < n; i++) {
            double *lr = &re[i * n + k], *li = &im[i * n + k];
            const double fr = (*lr * a + *li * b) / square, fi = (*li * a - *lr * b) / square;
            *lr = fr;
            *li = fi;
            complex_add(re + i * n + k + 1, im + i * n + k + 1, -fr, -fi, re + k * n + k + 1,
                        im + k * n + k + 1, n - k - 1);
        }
    }
    return -1;
}

void refdyn_complex_lu_solve(const double *A, int n, const int *pivot, double *x) {
    const double *re = A, *im = A + n * n;
    double *xr = x, *xi = x + n;
    for (int k = 0; k < n; k++) {
        const double r = xr[pivot[k]], i = xi[pivot[k]];
        xr[pivot[k]] = xr[k];
        xi[pivot[k]] = xi[k];
        xr[k] = r;
        xi[k] = i;
    }
    for (int k = 1; k < n; k++) {
        const double *a = re + k * n, *b = im + k * n;
        xr[k] -= dense_dot(a, xr, k) - dense_dot(b, xi, k);
        xi[k] -= dense_dot(a, xi, k) + dense_dot(b, xr, k);
    }
    for (int k = n - 1; k >= 0; k--) {
        const double *a = re + k * n + k + 1, *b = im + k * n + k + 1;
        const double r = xr[k] - dense_dot(a, xr + k + 1, n - k - 1) + dense_dot(b, xi + k + 1, n - k - 1);
        const double i = xi[k] - dense_dot(a, xi + k + 1, n - k - 1) - dense_dot(b, xr + k + 1, n - k - 1);
        const double c = re[k * n + k], d = im[k * n + k], square = c * c + d * d;
        xr[k] = (r * c + i * d) / square;
        xi[k] = (i * c - r * d) / square;
    }
}
