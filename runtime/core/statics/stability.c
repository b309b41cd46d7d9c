/*
 * Stability of an equilibrium.
 *
 * In: the tangent H of the free directions. Out: the numbers of directions in which the stiffness
 * S = -(H + H^T)/2 is negative, or zero. Where forces have a potential, H is symmetric, and an equilibrium is
 * stable where that has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on
 * masses (Sylvester). Where H is not symmetric, as with follower loads, the growing modes of the small motion
 * are counted. Without a tangent for them, S is used: if it is positive, the motion cannot leave the state
 * without oscillating; oscillations may still grow.
 */
#include "runtime/core/statics/statics.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/*
 * ---- Small motions, for forces without a potential ----
 *
 * In: the tangent H of the free directions, and in the same coordinates y the mass matrix M and the damping
 * D = -dQ/dqd. Out: the number of growing modes y e^(lambda t) of
 *     M y'' + D y' + K y = 0,   K = -H
 * With the shift s and w = y'/s this equation is E z' = A z for z = (y, w). The eigenvalues of (A - s E)^-1 E
 * are 1/(lambda - s): slow modes keep their digits among fast ones, and K may be singular. `refdyn modes`
 * computes the same eigenvalues together with shapes.
 */

/* Relative to the shift: a double eigenvalue 0 splits by sqrt(DBL_EPSILON); */
static const double zero_mode = 1e-6;
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

/* Computes M and D (left x left) at `now`. The equation of a state z is of first order: its column of M moves
 * to D, whose column is part of H. */
static int find_matrices(struct balance *b, double *M, double *D) {
    struct refdyn_workspace *work = b->work;
    const int n = b->n;
    double *mass = b->motion + n * n;
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
    if (size <= zero_mode)
        *zeros += im > 0 ? 2 : 1;
    else
        *unstable += lambda_re > growth * size + rounding_of_shift / square;
}

/* Counts growing modes and neutral directions at `now`. Overwrites H, tangent and terms. Returns 0 if the
 * model has no tangent, or one that is not finite. */
static int count_small_motions(struct balance *b, int *unstable, int *neutral) {
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

/* ---- The signs of the stiffness ---- */

/* Relative to the terms of the entries: bounds below which an eigenvalue counts as 0 and H as symmetric, and
 * above which all pivots prove that every eigenvalue is positive. */
static const double zero = 1e-11, asymmetry = 1e-9, pivot_clear = 1e-6;

/* size: units with H_ij of the order size_i size_j, from the diagonal or, where it is 0, from the row. */
static void find_sizes(const struct balance *b, double *size) {
    const int left = b->count - b->rank;
    for (int i = 0; i < left; i++) {
        double largest = b->magnitude[i * left + i];
        for (int j = 0; j < left && b->magnitude[i * left + i] == 0; j++)
            largest = fmax(largest, b->magnitude[i * left + j]);
        size[i] = largest > 0 ? sqrt(largest) : 1;
    }
}

/* S := D^-1 S D^-1. Returns whether H is symmetric. */
static int scale(const struct balance *b, const double *size, double *S) {
    const int left = b->count - b->rank;
    int is_symmetric = 1;
    for (int i = 0; i < left; i++)
        for (int j = 0; j < left; j++) {
            const double above = b->stiffness[i * left + j], below = b->stiffness[j * left + i];
            const double unit = size[i] * size[j];
            S[i * left + j] = -(above + below) / 2 / unit;
            is_symmetric &= fabs(above - below) <= asymmetry * unit;
        }
    return is_symmetric;
}

static struct spectrum room_of(const struct balance *b) {
    return (struct spectrum){.size = b->trial.Q, .values = b->trial.g, .vectors = b->tangent};
}

void refdyn_stability_find_spectrum(struct balance *b, struct spectrum *spectrum) {
    const int left = b->count - b->rank;
    *spectrum = room_of(b);
    find_sizes(b, spectrum->size);
    scale(b, spectrum->size, b->H);
    refdyn_symmetric_eigenvalues(b->H, left, spectrum->values, spectrum->vectors);
    for (int i = 0; i < left; i++) {
        spectrum->unstable += spectrum->values[i] < -zero;
        spectrum->neutral += fabs(spectrum->values[i]) <= zero;
    }
}

void refdyn_stability_lowest(const struct balance *b, const struct spectrum *spectrum, double *y) {
    const int left = b->count - b->rank;
    int lowest = 0;
    for (int i = 1; i < left; i++)
        lowest = spectrum->values[i] < spectrum->values[lowest] ? i : lowest;
    for (int i = 0; i < left; i++)
        y[i] = spectrum->vectors[i * left + lowest] / spectrum->size[i];
}

/* A factorisation proves stability fastest, and most equilibria are stable. */
static int is_clearly_stable(struct balance *b, struct refdyn_statics_result *result) {
    const int left = b->count - b->rank;
    const struct spectrum room = room_of(b);
    find_sizes(b, room.size);
    result->has_potential = scale(b, room.size, b->H);
    int is_clear = refdyn_factor(b->H, left, left) < 0;
    for (int i = 0; i < left; i++)
        is_clear &= b->H[i * (left + 1)] > pivot_clear;
    return is_clear;
}

/* Returns the coordinate that moves most, in units, when the independent ones move along b->y. */
static int most_moved(struct balance *b) {
    double *step = b->scale, largest = 0;
    int most = -1;
    for (int k = 0; k < b->rank; k++)
        b->p[k] = 0;
    refdyn_balance_expand(b, b->y, b->p, step);
    for (int i = 0; i < b->count; i++)
        if (fabs(step[i]) / b->unit[b->free[i]] > largest) {
            largest = fabs(step[i]) / b->unit[b->free[i]];
            most = b->free[i];
        }
    return most;
}

void refdyn_stability_judge(struct balance *b, struct refdyn_statics_result *result) {
    struct spectrum spectrum;
    const int is_clear = is_clearly_stable(b, result);
    if (!result->has_potential) {
        result->criterion = REFDYN_BY_LINEAR_MOTION;
        if (count_small_motions(b, &result->unstable, &result->neutral))
            return;
        result->criterion = REFDYN_BY_SYMMETRIC_PART;
    }
    if (is_clear)
        return;
    refdyn_stability_find_spectrum(b, &spectrum);
    result->unstable = spectrum.unstable;
    result->neutral = spectrum.neutral;
    if (spectrum.unstable > 0) {
        refdyn_stability_lowest(b, &spectrum, b->y);
        result->unstable_coordinate = most_moved(b);
    }
}
