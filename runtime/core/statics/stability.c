/*
 * Stability of an equilibrium.
 *
 * In: the tangent H of the free directions. Out: the numbers of directions in which the stiffness
 * S = -(H + H^T)/2 is negative, or zero. Where forces have a potential, H is symmetric, and an equilibrium is
 * stable where that has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on
 * masses (Sylvester). Where H is not symmetric, as with follower loads, or where dampers add energy, the
 * growing modes of the small motion are counted. Without a tangent for them, S is used: if it is positive,
 * the motion cannot leave the state without oscillating; oscillations may still grow.
 */
#include "runtime/core/statics/statics.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* ---- The signs of the stiffness ---- */

/* Relative to the terms of the entries: bounds below which an eigenvalue counts as 0, and H as symmetric or D
 * as positive; and above which all pivots prove that every eigenvalue is positive. */
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

/* Returns whether the symmetric part of D is nowhere negative: no damper adds energy. */
static int dissipates(struct balance *b, const double *D) {
    const int left = b->count - b->rank;
    const struct spectrum room = room_of(b);
    for (int i = 0; i < left; i++) {
        double largest = fabs(D[i * (left + 1)]);
        for (int j = 0; j < left && D[i * (left + 1)] == 0; j++)
            largest = fmax(largest, fmax(fabs(D[i * left + j]), fabs(D[j * left + i])));
        room.size[i] = largest > 0 ? sqrt(largest) : 1;
    }
    for (int i = 0; i < left; i++)
        for (int j = 0; j < left; j++)
            b->H[i * left + j] = (D[i * left + j] + D[j * left + i]) / 2 / room.size[i] / room.size[j];
    for (int i = 0; i < left; i++)
        b->H[i * (left + 1)] += asymmetry;
    return refdyn_factor(b->H, left, left) < 0;
}

/* Counts growing modes if forces have no potential, or if a damper adds energy. Returns whether they decide.
 */
static int judge_by_modes(struct balance *b, struct refdyn_statics_result *result) {
    const int left = b->count - b->rank;
    return refdyn_growing_find_matrices(b) &&
           (!result->has_potential || !dissipates(b, b->small_motion + left * left)) &&
           refdyn_growing_count(b, &result->unstable, &result->neutral);
}

void refdyn_stability_judge(struct balance *b, struct refdyn_statics_result *result) {
    struct spectrum spectrum;
    const int is_clear = is_clearly_stable(b, result);
    if (judge_by_modes(b, result)) {
        result->criterion = REFDYN_BY_LINEAR_MOTION;
        return;
    }
    result->criterion = result->has_potential ? REFDYN_BY_POTENTIAL : REFDYN_BY_SYMMETRIC_PART;
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
