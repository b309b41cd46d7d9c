/* Small motions about an equilibrium; statics.h has the formulas. */
#include "runtime/core/statics/statics.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* Relative to the shift: a double eigenvalue 0 splits by sqrt(DBL_EPSILON); */
static const double zero = 1e-6;
/* a growth below these fractions of |lambda| and of |lambda - s|^2 / s is rounding. */
static const double growth = 1e-9, rounding_of_shift = 1e-12;
/* The shift lies between the rates of stiff and soft coordinates, at a ratio that coincides with no closed
 * form. */
static const double shift_share = 0.6180339887498949, low_share = 1e-6;

/* Returns a shift between the largest and the smallest sqrt(K_jj / M_jj). */
static double choose_shift(const struct balance *b, const double *M) {
    const int left = b->count - b->rank;
    double low = INFINITY, high = 0;
    for (int j = 0; j < left; j++) {
        const double mass = M[j * (left + 1)], stiffness = fabs(b->stiffness[j * (left + 1)]);
        const double rate = mass > 0 ? sqrt(stiffness / mass) : 0;
        low = rate > 0 ? fmin(low, rate) : low;
        high = fmax(high, rate);
    }
    return shift_share * (high > 0 ? sqrt(fmax(low, low_share * high)) * sqrt(high) : 1);
}

/* reduced := [1 P^T] X [1; P] for X (n x n). Returns whether it is finite. */
static int reduce(struct balance *b, const double *X, double *reduced) {
    const int left = b->count - b->rank;
    for (int i = 0; i < b->count; i++)
        for (int j = 0; j < b->count; j++)
            b->tangent[i * b->count + j] = X[b->free[i] * b->n + b->free[j]];
    refdyn_balance_reduce(b, b->tangent, reduced);
    return refdyn_is_finite(reduced, left * left);
}

/* Computes M and D (left x left) at `now`. */
static int find_matrices(struct balance *b, double *M, double *D) {
    struct refdyn_workspace *work = b->work;
    if (refdyn_equations(work, b->t, b->now.q, b->rates) || !reduce(b, work->M, M))
        return 0;
    refdyn_linear_stiffness(&b->linear, work, b->t, b->now.q, b->rates, b->motion);
    refdyn_linear_damping(&b->linear, b->motion);
    return reduce(b, b->motion, D);
}

/* Column of s (A - s E)^-1 E: y := -K_s^-1 f, K_s = K + s D + s^2 M factored, and w = y + own. */
static void put_column(struct balance *b, double *f, int column, double own, int row_of_own) {
    const int left = b->count - b->rank, size = 2 * left;
    refdyn_lu_solve(0, b->H, left, b->order, f);
    for (int i = 0; i < left; i++) {
        b->motion[i * size + column] = -f[i];
        b->motion[(left + i) * size + column] = -f[i] + (i == row_of_own ? own : 0);
    }
}

/* b->motion := s (A - s E)^-1 E (2 left x 2 left). Returns whether K_s is regular. */
static int find_pencil(struct balance *b, const double *M, const double *D, double s) {
    const int left = b->count - b->rank;
    for (int i = 0; i < left * left; i++)
        b->H[i] = -b->stiffness[i] + s * D[i] + s * s * M[i];
    if (!refdyn_lu_factor(0, b->H, left, b->order, b->scale))
        return 0;
    for (int j = 0; j < left; j++) {
        for (int i = 0; i < left; i++)
            b->y[i] = s * (D[i * left + j] + s * M[i * left + j]);
        put_column(b, b->y, j, 1, j);
        for (int i = 0; i < left; i++)
            b->y[i] = s * s * M[i * left + j];
        put_column(b, b->y, left + j, 0, -1);
    }
    return 1;
}

/* Counts the eigenvalue lambda = s (1 + 1/tau) of tau = re + i im. */
static void count_mode(double re, double im, int *unstable, int *zeros) {
    const double square = re * re + im * im;
    if (!(square > 0) || im < 0)
        return; /* infinite, of a coordinate without mass; or the conjugate of a counted one */
    const double lambda_re = 1 + re / square, lambda_im = -im / square;
    const double size = hypot(lambda_re, lambda_im);
    if (size <= zero)
        *zeros += im > 0 ? 2 : 1;
    else
        *unstable += lambda_re > growth * size + rounding_of_shift / square;
}

int refdyn_linear_motion_count(struct balance *b, int *unstable, int *neutral) {
    const int left = b->count - b->rank, size = 2 * left;
    if (!refdyn_has_tangent(b->work->model))
        return 0;
    double *M = b->small_motion, *D = M + left * left, *re = b->eigenvalues, *im = re + size;
    int zeros = 0;
    if (!find_matrices(b, M, D) || !find_pencil(b, M, D, choose_shift(b, M)))
        return 0;
    if (!refdyn_eigenvalues(b->motion, size, re, im))
        return 0;
    *unstable = 0;
    for (int i = 0; i < size; i++)
        count_mode(re[i], im[i], unstable, &zeros);
    *neutral = (zeros + 1) / 2;
    return 1;
}
