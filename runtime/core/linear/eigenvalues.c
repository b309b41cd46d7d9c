/*
 * Eigenvalues of symmetric matrices by Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5), of
 * others by Householder's reflections to Hessenberg form and Francis's double shifts (7.4, 7.5).
 */
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

enum { ITERATIONS_MOST = 60, EXCEPTIONAL = 10 };

/* A reflection 1 - beta v v^T of two or three coordinates from `at` on that takes x to a multiple of the
 * first. */
struct reflection {
    int at, size;
    double v[3], beta;
};

static struct reflection reflection_of(int at, int size, const double *x) {
    struct reflection r = {.at = at, .size = size};
    double scale = 0, square = 0;
    for (int i = 0; i < size; i++)
        scale = fmax(scale, fabs(x[i]));
    for (int i = 0; i < size && scale > 0; i++) {
        r.v[i] = x[i] / scale;
        square += r.v[i] * r.v[i];
    }
    const double length = copysign(sqrt(square), r.v[0]);
    const double along = length * (length + r.v[0]);
    r.v[0] += length;
    r.beta = along > 0 ? 1 / along : 0;
    return r;
}

/* Applies a reflection to rows of A, in columns from `first` to `last`. */
static void reflect_rows(double *A, int n, const struct reflection *r, int first, int last) {
    for (int j = first; j <= last; j++) {
        double sum = 0;
        for (int i = 0; i < r->size; i++)
            sum += r->v[i] * A[(r->at + i) * n + j];
        for (int i = 0; i < r->size; i++)
            A[(r->at + i) * n + j] -= r->beta * sum * r->v[i];
    }
}

/* Applies a reflection to columns of A, in rows from `first` to `last`. */
static void reflect_columns(double *A, int n, const struct reflection *r, int first, int last) {
    for (int i = first; i <= last; i++) {
        double sum = 0, *row = A + i * n + r->at;
        for (int j = 0; j < r->size; j++)
            sum += r->v[j] * row[j];
        for (int j = 0; j < r->size; j++)
            row[j] -= r->beta * sum * r->v[j];
    }
}

/* Reduces A to zeros below the first subdiagonal, pair by pair from below. */
static void reduce_to_hessenberg(double *A, int n) {
    for (int j = 0; j < n - 2; j++)
        for (int i = n - 2; i > j; i--) {
            const double x[] = {A[i * n + j], A[(i + 1) * n + j]};
            if (x[1] == 0)
                continue;
            const struct reflection r = reflection_of(i, 2, x);
            reflect_rows(A, n, &r, j, n - 1);
            reflect_columns(A, n, &r, 0, n - 1);
            A[(i + 1) * n + j] = 0;
        }
}

/* Returns the first row of the unreduced block that ends at `last`. Entries below the diagonal of at most
 * `negligible` are 0. */
static int begin_of_block(double *A, int n, int last, double negligible) {
    for (int i = last; i > 0; i--) {
        const double size = fabs(A[(i - 1) * (n + 1)]) + fabs(A[i * (n + 1)]);
        if (fabs(A[i * n + i - 1]) <= fmax(DBL_EPSILON * size, negligible)) {
            A[i * n + i - 1] = 0;
            return i;
        }
    }
    return 0;
}

/* Computes the eigenvalues of the 2 x 2 block at `at`. */
static void take_pair(const double *A, int n, int at, double *re, double *im) {
    const double a = A[at * (n + 1)], b = A[at * n + at + 1];
    const double c = A[(at + 1) * n + at], d = A[(at + 1) * (n + 1)];
    const double half = (a - d) / 2, square = half * half + b * c, root = sqrt(fabs(square));
    const double far = half >= 0 ? half + root : half - root;
    const int is_real = square >= 0;
    re[at] = is_real ? d + far : (a + d) / 2;
    re[at + 1] = !is_real ? (a + d) / 2 : far != 0 ? d - b * c / far : d;
    im[at] = is_real ? 0 : root;
    im[at + 1] = -im[at];
}

/* Makes one double step of a block; the shifts have this sum and product. */
static void francis_step(double *A, int n, int first, int last, double sum, double product) {
    const double *H = A + first * (n + 1);
    double x[3] = {H[0] * H[0] + H[1] * H[n] - sum * H[0] + product, H[n] * (H[0] + H[n + 1] - sum),
                   H[n] * H[2 * n + 1]};
    for (int k = first; k < last; k++) {
        const int size = last - k < 2 ? 2 : 3, below = k + 3 < last ? k + 3 : last;
        const struct reflection r = reflection_of(k, size, x);
        reflect_rows(A, n, &r, k > first ? k - 1 : first, last);
        reflect_columns(A, n, &r, first, below);
        for (int i = 0; i < 3 && k + 1 + i <= last; i++)
            x[i] = A[(k + 1 + i) * n + k];
    }
    for (int i = first + 2; i <= last; i++)
        for (int j = first; j < i - 1; j++)
            A[i * n + j] = 0;
}

/* Makes a step with the eigenvalues of the last two rows as shifts, and with exceptional shifts now and then.
 */
static void step_of_block(double *A, int n, int first, int last, int iteration) {
    const double a = A[(last - 1) * (n + 1)], d = A[last * (n + 1)];
    const double below = A[last * n + last - 1], above = A[(last - 1) * n + last];
    if (iteration % EXCEPTIONAL == EXCEPTIONAL - 1) {
        const double size = fabs(below) + fabs(A[(last - 1) * n + last - 2]);
        francis_step(A, n, first, last, 1.5 * size, size * size);
    } else
        francis_step(A, n, first, last, a + d, a * d - above * below);
}

/* The rounding of the whole matrix. */
static double rounding_of(const double *A, int n) {
    double square = 0;
    for (int i = 0; i < n * n; i++)
        square += A[i] * A[i];
    return DBL_EPSILON * sqrt(square);
}

/* Entries as small as their neighbours' rounding are neglected, so that small eigenvalues keep their digits.
 * A block of equal eigenvalues with few vectors may never get there; then the rounding of the matrix counts.
 */
int refdyn_eigenvalues(double *A, int n, double *re, double *im) {
    const double rounding = rounding_of(A, n);
    reduce_to_hessenberg(A, n);
    for (int last = n - 1, iteration = 0; last >= 0;) {
        const int first = begin_of_block(A, n, last, iteration < EXCEPTIONAL ? DBL_MIN : rounding);
        if (last - first < 2) {
            if (first < last)
                take_pair(A, n, first, re, im);
            else {
                re[last] = A[last * (n + 1)];
                im[last] = 0;
            }
            last = first - 1;
            iteration = 0;
        } else if (iteration == ITERATIONS_MOST)
            return 0;
        else
            step_of_block(A, n, first, last, iteration++);
    }
    return 1;
}
