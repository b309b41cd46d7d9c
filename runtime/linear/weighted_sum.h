/*
 * Sums of vectors with weights, of one motion or of several side by side.
 *
 * What a file that includes this defines: base/lane.h.
 */
#ifndef REFDYN_WEIGHTED_SUM_H
#define REFDYN_WEIGHTED_SUM_H

#include "base/lane.h"
#include "linear/wide_vectors.h"

/* y (n) += scale sum_j weight_j x_j over `count` vectors, `stride` apart: those whose weight is not 0, four
 * of them in one pass. */
INLINE void NAMED(weighted_sum)(LANE *restrict y, LANE scale, const double *weights, int count,
                                const LANE *restrict x, int stride, int n) {
    LANE a[4];
    const LANE *u[4];
    int found = 0;
    for (int j = 0; j < count; j++) {
        if (weights[j] == 0)
            continue;
        a[found] = scale * weights[j];
        u[found++] = x + j * stride;
        if (found < 4)
            continue;
        for (int i = 0; i < n; i++)
            y[i] = y[i] + a[0] * u[0][i] + a[1] * u[1][i] + a[2] * u[2][i] + a[3] * u[3][i];
        found = 0;
    }
    for (int k = 0; k < found; k++)
        for (int i = 0; i < n; i++)
            y[i] += a[k] * u[k][i];
}

#endif
