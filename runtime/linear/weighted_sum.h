/*
 * Sums of vectors with weights, of one motion or of several side by side.
 *
 * What a file that includes this defines: base/lane.h.
 */
#ifndef REFDYN_WEIGHTED_SUM_H
#define REFDYN_WEIGHTED_SUM_H

#include "base/lane.h"
#include "linear/wide_vectors.h"

/* y (n) += sum_k a_k u_k over `count` of them, 1 to 4, in one pass. */
INLINE void NAMED(add_products)(LANE *restrict y, const LANE *a, const LANE *const *u, int count, int n) {
    for (int i = 0; i < n; i++) {
        LANE sum = y[i] + a[0] * u[0][i];
        if (count > 1)
            sum += a[1] * u[1][i];
        if (count > 2)
            sum += a[2] * u[2][i];
        if (count > 3)
            sum += a[3] * u[3][i];
        y[i] = sum;
    }
}

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
        NAMED(add_products)(y, a, u, 4, n);
        found = 0;
    }
    if (found == 3)
        NAMED(add_products)(y, a, u, 3, n);
    else if (found == 2)
        NAMED(add_products)(y, a, u, 2, n);
    else if (found == 1)
        NAMED(add_products)(y, a, u, 1, n);
}

#endif
