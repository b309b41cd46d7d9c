/* Eigenvalues of symmetric matrices by Jacobi's rotations. */
#include "runtime/core/linear/linear.h"

#include <float.h>
#include <math.h>

/* Sweeps converge quadratically; about ten suffice. */
enum { SWEEPS_MOST = 60 };

/* Columns p and q of X := those times the rotation (c, s). */
static void rotate_columns(double *X, int n, int p, int q, double c, double s) {
    for (int i = 0; i < n; i++) {
        const double a = X[i * n + p], b = X[i * n + q];
        X[i * n + p] = c * a - s * b;
        X[i * n + q] = s * a + c * b;
    }
}

static void rotate_rows(double *X, int n, int p, int q, double c, double s) {
    for (int j = 0; j < n; j++) {
        const double a = X[p * n + j], b = X[q * n + j];
        X[p * n + j] = c * a - s * b;
        X[q * n + j] = s * a + c * b;
    }
}

/* Makes A_pq 0 by the smaller of the two possible rotations. */
static void rotate(double *A, int n, int p, int q, double *vectors) {
    const double tau = (A[q * n + q] - A[p * n + p]) / (2 * A[p * n + q]);
    const double t = (tau < 0 ? -1 : 1) / (fabs(tau) + sqrt(1 + tau * tau));
    const double c = 1 / sqrt(1 + t * t), s = t * c;
    rotate_columns(A, n, p, q, c, s);
    rotate_rows(A, n, p, q, c, s);
    A[p * n + q] = A[q * n + p] = 0;
    rotate_columns(vectors, n, p, q, c, s);
}

/* Eliminates each entry above the rounding of the largest one. Returns 0 if there was none. */
static int sweep(double *A, int n, double *vectors) {
    double largest = 0;
    int rotations = 0;
    for (int i = 0; i < n * n; i++)
        largest = fmax(largest, fabs(A[i]));
    for (int p = 0; p < n; p++)
        for (int q = p + 1; q < n; q++)
            if (fabs(A[p * n + q]) > DBL_EPSILON / 8 * largest) {
                rotate(A, n, p, q, vectors);
                rotations++;
            }
    return rotations;
}

void refdyn_symmetric_eigenvalues(double *A, int n, double *values, double *vectors) {
    for (int i = 0; i < n * n; i++)
        vectors[i] = i % (n + 1) == 0;
    for (int i = 0; i < SWEEPS_MOST && sweep(A, n, vectors) > 0; i++)
        continue;
    for (int i = 0; i < n; i++)
        values[i] = A[i * n + i];
}
