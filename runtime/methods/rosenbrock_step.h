/*
 * One step of a Rosenbrock method, for one motion or for several side by side.
 *
 * Formulas in rosenbrock.h; what a file that includes this defines: step_arrays.h. The memory has the
 * increments U_i (2 n) of all stages.
 */
#ifndef REFDYN_ROSENBROCK_STEP_H
#define REFDYN_ROSENBROCK_STEP_H

#include "methods/rosenbrock.h"
#include "methods/step_arrays.h"

#include <string.h>

/* What a step asks for: rates, and solutions with the matrix for gamma h, as refdyn_linear_solve. */
struct NAMED(rosenbrock_needs) {
    NAMED(stage_rates) * find;
    /* for the explicit time: `part` of h */
    void (*solve)(void *context, const LANE *right_q, const LANE *right_v, double part, LANE *dq, LANE *dqd);
    void *context;
};

static inline int NAMED(all_stages)(const struct refdyn_rosenbrock_table *table) {
    return table->stages + table->interpolant_stages;
}

/* y := state + sum_j weight_j U_j, q and qd */
static inline void NAMED(combine_increments)(const struct NAMED(arrays) * arrays, const double *weights,
                                             int count, LANE *y) {
    const int size = 2 * arrays->n;
    memcpy(y, arrays->state, (size_t)size * sizeof *y);
    ADD_ALL(y, NAMED(every)(1), weights, count, arrays->memory, size, size);
}

/* U_i. Returns the status of its rates. */
INLINE int NAMED(take_increment)(const struct refdyn_rosenbrock_table *table,
                                 const struct NAMED(arrays) * arrays, int i, LANE h,
                                 const struct NAMED(rosenbrock_needs) * needs) {
    const int n = arrays->n, size = 2 * n, all = NAMED(all_stages)(table);
    LANE *right = arrays->side, *U = arrays->memory + i * size;
    if (i == 0) {
        memcpy(right, arrays->rates, (size_t)size * sizeof *right);
    } else {
        NAMED(combine_increments)(arrays, table->a + i * all, i, arrays->stage);
        const int status = needs->find(needs->context, table->alpha[i], arrays->stage, right);
        if (status)
            return status;
    }
    ADD_ALL(right, 1 / h, table->c + i * all, i, arrays->memory, size, size);
    needs->solve(needs->context, right, right + n, table->gamma_sum[i], U, U + n);
    return 0;
}

/* From state and rates to state_new and error. Returns the status of the first stage whose rates fail. */
INLINE int NAMED(take_rosenbrock)(const struct refdyn_rosenbrock_table *table,
                                  const struct NAMED(arrays) * arrays, LANE h,
                                  const struct NAMED(rosenbrock_needs) * needs) {
    const int size = 2 * arrays->n;
    for (int i = 0; i < table->stages; i++) {
        const int status = NAMED(take_increment)(table, arrays, i, h, needs);
        if (status)
            return status;
    }
    NAMED(combine_increments)(arrays, table->b, table->stages, arrays->state_new);
    memset(arrays->error, 0, (size_t)size * sizeof(LANE));
    ADD_ALL(arrays->error, NAMED(every)(1), table->e, table->stages, arrays->memory, size, size);
    return 0;
}

/* The stages that only the interpolant needs. Returns as take_rosenbrock. */
INLINE int NAMED(look_into_rosenbrock)(const struct refdyn_rosenbrock_table *table,
                                       const struct NAMED(arrays) * arrays, LANE h,
                                       const struct NAMED(rosenbrock_needs) * needs) {
    int status = 0;
    for (int i = table->stages; i < NAMED(all_stages)(table) && !status; i++)
        status = NAMED(take_increment)(table, arrays, i, h, needs);
    return status;
}

#endif
