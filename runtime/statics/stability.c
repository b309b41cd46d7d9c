/* Is an equilibrium stable? See stability.h. */
#include "base/arithmetic.h"

#include "statics/stability.h"

#include <math.h>

#include "linear/dense.h"
#include "linear/eigenvalues.h"

/* In units of the terms that entries are made of: as small an eigenvalue is 0, as small a difference across
 * the diagonal none, and pivots above the last one leave no eigenvalue in doubt. */
static const double zero = 1e-11, asymmetry = 1e-9, pivot_clear = 1e-6;

/* Entries H_ij in units of size_i size_j: that of the diagonal, or, where there is none, of the row. */
static void find_sizes(const struct balance *b, double *size) {
    const int left = b->count - b->rank;
    for (int i = 0; i < left; i++) {
        double largest = b->magnitude[i * left + i];
        for (int j = 0; j < left && b->magnitude[i * left + i] == 0; j++)
            largest = fmax(largest, b->magnitude[i * left + j]);
        size[i] = largest > 0 ? sqrt(largest) : 1;
    }
}

/* S = -(H + H^T)/2 in units of the sizes; is H symmetric? */
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

/* S is overwritten. Most equilibria are stable, and this is the quickest way to see it. */
static int is_clearly_positive(double *S, int n) {
    int is_clear = refdyn_factor(S, n, n) < 0;
    for (int i = 0; i < n; i++)
        is_clear &= S[i * (n + 1)] > pivot_clear;
    return is_clear;
}

/* The coordinate that moves most when the independent ones move along y, in units. */
static int most_moved(struct balance *b, const double *y, const double *size) {
    const int left = b->count - b->rank;
    double *step = b->scale, largest = 0;
    int most = -1;
    for (int i = 0; i < left; i++)
        b->y[i] = y[i * left] / size[i];
    for (int k = 0; k < b->rank; k++)
        b->p[k] = 0;
    balance_expand(b, b->y, b->p, step);
    for (int i = 0; i < b->count; i++)
        if (fabs(step[i]) / b->unit[b->free[i]] > largest) {
            largest = fabs(step[i]) / b->unit[b->free[i]];
            most = b->free[i];
        }
    return most;
}

void stability_judge(struct balance *b, struct refdyn_statics_result *result) {
    const int left = b->count - b->rank;
    double *size = b->Q_start, *S = b->H, *vectors = b->tangent, *values = b->trial.g;
    int lowest = 0;
    find_sizes(b, size);
    result->has_potential = scale(b, size, S);
    if (is_clearly_positive(S, left))
        return;
    scale(b, size, S);
    refdyn_symmetric_eigenvalues(S, left, values, vectors);
    for (int i = 0; i < left; i++) {
        result->unstable += values[i] < -zero;
        result->neutral += fabs(values[i]) <= zero;
        lowest = values[i] < values[lowest] ? i : lowest;
    }
    if (result->unstable > 0)
        result->unstable_coordinate = most_moved(b, vectors + lowest, size);
}
