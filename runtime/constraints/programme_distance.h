/*
 * How far states are off the programme, and when a projection has ended, for one motion or for several side
 * by side.
 *
 * Formulas in projection.c; what a file that includes this defines: base/lane.h.
 */
#ifndef REFDYN_PROGRAMME_DISTANCE_H
#define REFDYN_PROGRAMME_DISTANCE_H

#include "base/lane.h"
#include "constraints/constraints.h"

#include <float.h>
#include <math.h>

/* Newton doubles the digits from any start that it converges from; 30 corrections also halve a distance 30
 * times. */
enum { CORRECTIONS_MOST = 30 };

/* Rounding of a residual: a few units in the last place of each term. */
static const double rounding = 4 * DBL_EPSILON;

/* Near enough to the programme for Newton to square the residual: one more correction would reach rounding.
 */
static const double near = 0x1p-26; /* sqrt(DBL_EPSILON) */

/* Row terms at a state, of one level: positions are met by the rows up to position level, velocities by those
 * up to velocity level. */
struct NAMED(level) {
    int n, m;
    const struct refdyn_row *rows;
    enum refdyn_row_level last;
    const LANE *u;        /* (m x n) */
    const LANE *residual; /* (m) phi or psi */
};

static inline int NAMED(has)(const struct NAMED(level) * level, int a) {
    return level->rows[a].level <= level->last;
}

/* sum_j |u_aj| max(|x_j|, least): what row a makes of the state x */
static inline LANE NAMED(size_of_row)(const struct NAMED(level) * level, int a, const LANE *x, double least) {
    LANE sum = NAMED(every)(0);
    for (int j = 0; j < level->n; j++) {
        const LANE size = NAMED(size)(x[j]);
        sum += NAMED(size)(level->u[a * level->n + j]) *
               NAMED(select)(size > NAMED(every)(least), size, NAMED(every)(least));
    }
    return sum;
}

static inline MASK NAMED(rows_hold)(const struct NAMED(level) * level, double tol, double least,
                                    const LANE *x) {
    MASK hold = NAMED(every)(0) == NAMED(every)(0);
    for (int a = 0; a < level->m; a++)
        if (NAMED(has)(level, a))
            hold &= NAMED(size)(level->residual[a]) <= tol * NAMED(size_of_row)(level, a, x, least);
    return hold;
}

/* The largest residual over the largest coefficient of its row. */
static inline LANE NAMED(distance)(const struct NAMED(level) * level) {
    LANE largest = NAMED(every)(0);
    for (int a = 0; a < level->m; a++) {
        LANE size = NAMED(every)(0);
        for (int j = 0; j < level->n; j++)
            size = NAMED(larger)(size, NAMED(size)(level->u[a * level->n + j]));
        const LANE part = NAMED(size)(level->residual[a]) / size;
        largest = NAMED(select)((size > NAMED(every)(0)) & (part > largest), part, largest);
    }
    return largest;
}

/* At rounding level, or near it and no longer falling; *last is the distance before the last correction. */
static inline MASK NAMED(level_is_done)(const struct NAMED(level) * level, const LANE *x, LANE *last) {
    const LANE now = NAMED(distance)(level), before = *last;
    *last = now;
    return NAMED(rows_hold)(level, rounding, 0, x) |
           ((now > before / 2) & NAMED(rows_hold)(level, near, 1, x));
}

#endif
