/*
 * The growing modes of small motions about an equilibrium.
 *
 * In: the tangent H of the free directions, and in the same coordinates y the mass matrix M and the damping
 * D = -dQ/dqd. Out: the number of growing modes y e^(lambda t) of
 *     M y'' + D y' + K y = 0,   K = -H
 * With the shift s and w = y'/s this equation is E z' = A z for z = (y, w). The eigenvalues of
 * T = s (A - s E)^-1 E are tau = s/(lambda - s): slow modes keep their digits among fast ones, and K may be
 * singular. Coordinates without mass and states have tau = 0, and motions at constant place or speed tau =
 * -1. Both are defective, so that their rounding would look like growth; they are removed first. `refdyn
 * modes` computes the same eigenvalues together with shapes.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"
#include "runtime/core/statics/statics.h"

/* A growth below these fractions of |lambda| and of |lambda - s|^2 / s is rounding. */
static const double growth = 1e-9, rounding_of_shift = 1e-12;
/* The shift lies between the rates of stiff and soft coordinates, at a ratio that coincides with no closed
 * form. */
static const double shift_share = 0.6180339887498949, low_share = 1e-6;
/* Entries of T below this are 0; so are those of T + 1 below `zero`, and below the rounding of K / (s^2 M).
 */
static const double rounding = 64 * DBL_EPSILON, zero = 1e-11;

/* Largest rate sqrt(K_jj / M_jj), and a shift. */
struct rates {
    double high, shift;
};

/* The rates of coordinate j: sqrt(K_jj / M_jj) and D_jj / M_jj, or K_jj / D_jj of a state; 0: none. */
static void rates_of(const struct balance *b, const double *M, const double *D, int j, double rate[2]) {
    const int at = j * (b->count - b->rank + 1);
    const double mass = M[at], damping = fabs(D[at]), stiffness = fabs(b->stiffness[at]);
    rate[0] = mass > 0 ? sqrt(stiffness / mass) : 0;
    rate[1] = mass > 0 ? damping / mass : damping > 0 ? stiffness / damping : 0;
}

static struct rates find_rates(const struct balance *b, const double *M, const double *D) {
    struct rates rates = {0, 1};
    double low = INFINITY, high = 0, rate[2];
    for (int j = 0; j < b->count - b->rank; j++) {
        rates_of(b, M, D, j, rate);
        rates.high = fmax(rates.high, rate[0]);
        for (int k = 0; k < 2; k++) {
            low = rate[k] > 0 ? fmin(low, rate[k]) : low;
            high = fmax(high, rate[k]);
        }
    }
    if (high > 0)
        rates.shift = sqrt(fmax(low, low_share * high)) * sqrt(high);
    rates.shift *= shift_share;
    return rates;
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

int refdyn_growing_find_matrices(struct balance *b) {
    struct refdyn_workspace *work = b->work;
    const int n = b->n, left = b->count - b->rank;
    if (!refdyn_has_tangent(work->model))
        return 0;
    double *mass = b->motion + n * n, *M = b->small_motion, *D = M + left * left;
    refdyn_balance_take_states(b, b->now.q);
    if (refdyn_equations(work, b->t, b->now.q, b->rates))
        return 0;
    memcpy(mass, work->M, (size_t)(n * n) * sizeof *mass);
    refdyn_linear_stiffness(&b->linear, work, b->t, b->now.q, b->rates, b->motion);
    refdyn_linear_damping(&b->linear, b->motion);
    for (int i = 0; i < n; i++)
        for (int j = b->joints; j < n; j++) {
            b->motion[i * n + j] = mass[i * n + j];
            mass[i * n + j] = 0;
        }
    return reduce(b, mass, M) && reduce(b, b->motion, D);
}

/* row_i and column_j with |X_ij| <= row_i column_j, and equal somewhere in each row and column: the units in
 * which X (left x left) is about 1. */
static void find_units(const double *X, int left, double *row, double *column) {
    for (int i = 0; i < left; i++) {
        row[i] = fabs(X[i * left]);
        for (int j = 1; j < left; j++)
            row[i] = fmax(row[i], fabs(X[i * left + j]));
        row[i] = row[i] > 0 ? row[i] : 1;
    }
    for (int j = 0; j < left; j++) {
        column[j] = 0;
        for (int i = 0; i < left; i++)
            column[j] = fmax(column[j], fabs(X[i * left + j]) / row[i]);
        column[j] = column[j] > 0 ? column[j] : 1;
    }
}

/* Column of T: y := -K_s^-1 f, K_s = K + s D + s^2 M factored, and w = y + own; in units. */
static void put_column(struct balance *b, double *f, int column, const double *unit, int is_own) {
    const int left = b->count - b->rank, size = 2 * left, j = column % left;
    refdyn_lu_solve(0, b->H, left, b->order, f);
    for (int i = 0; i < left; i++) {
        const double y = -f[i] * (unit[i] / unit[j]);
        b->motion[i * size + column] = y;
        b->motion[(left + i) * size + column] = y + (is_own && i == j);
    }
}

/* b->motion := T (2 left x 2 left). Returns whether K_s is regular. */
static int find_pencil(struct balance *b, double s) {
    const int left = b->count - b->rank;
    const double *M = b->small_motion, *D = M + left * left;
    double *unit = b->eigenvalues; /* 1 over those of K_s */
    for (int i = 0; i < left * left; i++)
        b->H[i] = -b->stiffness[i] + s * D[i] + s * s * M[i];
    find_units(b->H, left, b->scale, unit);
    if (!refdyn_lu_factor(0, b->H, left, b->order, b->scale))
        return 0;
    for (int j = 0; j < left; j++) {
        for (int i = 0; i < left; i++)
            b->y[i] = s * (D[i * left + j] + s * M[i * left + j]);
        put_column(b, b->y, j, unit, 1);
        for (int i = 0; i < left; i++)
            b->y[i] = s * s * M[i * left + j];
        put_column(b, b->y, left + j, unit, 0);
    }
    return 1;
}

/* Returns whether lambda = s (1 + 1/tau) of tau = re + i im grows. Of two conjugates only one counts. */
static int is_growing(double re, double im) {
    const double square = re * re + im * im;
    if (!(square > 0) || im < 0)
        return 0;
    const double lambda_re = 1 + re / square, lambda_im = -im / square;
    return lambda_re > growth * hypot(lambda_re, lambda_im) + rounding_of_shift / square;
}

/* Returns the number of directions in which H is 0 relative to its terms. */
static int count_neutral(struct balance *b) {
    const int left = b->count - b->rank;
    double *row = b->eigenvalues, *column = row + left;
    find_units(b->magnitude, left, row, column);
    for (int i = 0; i < left; i++)
        for (int j = 0; j < left; j++)
            b->H[j * left + i] = b->stiffness[i * left + j] / row[i] / column[j];
    return left - refdyn_rank(b->H, left, zero, &b->elimination);
}

int refdyn_growing_count(struct balance *b, int *unstable, int *neutral) {
    const int left = b->count - b->rank;
    const struct rates rates = find_rates(b, b->small_motion, b->small_motion + left * left);
    const double spread = rates.high / rates.shift;
    if (!find_pencil(b, rates.shift))
        return 0;
    int size = refdyn_deflate(b->motion, 2 * left, 0, rounding, &b->elimination);
    size = refdyn_deflate(b->motion, size, -1, fmax(zero, rounding * spread * spread), &b->elimination);
    double *re = b->eigenvalues, *im = re + size;
    if (!refdyn_eigenvalues(b->motion, size, re, im))
        return 0;
    *unstable = 0;
    for (int i = 0; i < size; i++)
        *unstable += is_growing(re[i], im[i]);
    *neutral = count_neutral(b);
    return 1;
}
