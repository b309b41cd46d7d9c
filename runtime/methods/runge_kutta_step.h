/*
 * One step of an explicit Runge-Kutta method, for one motion or for several side by side.
 *
 * Formulas in runge_kutta.h; what a file that includes this defines: step_arrays.h.
 */
#ifndef REFDYN_RUNGE_KUTTA_STEP_H
#define REFDYN_RUNGE_KUTTA_STEP_H

#include "methods/runge_kutta.h"
#include "methods/step_arrays.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* y := state + h sum_j weight_j rates_j */
INLINE void NAMED(combine_rates)(const struct NAMED(arrays) * arrays, LANE h, const double *weights,
                                 int count, LANE *y) {
    memcpy(y, arrays->state, (size_t)arrays->size * sizeof *y);
    ADD_ALL(y, h, weights, count, arrays->memory, arrays->rates_size, arrays->size);
}

/* error := h sum_j weight_j rates_j, q and qd only */
INLINE void NAMED(estimate_by_rates)(const struct NAMED(arrays) * arrays, LANE h, const double *weights,
                                     int stages, LANE *error) {
    const int count = 2 * arrays->n;
    memset(error, 0, (size_t)count * sizeof *error);
    ADD_ALL(error, h, weights, stages, arrays->memory, arrays->rates_size, count);
}

/* E^2 / sqrt(E^2 + E_low^2 / 100) of each entry, 0 where both are; such small ones are 0 to all who ask. */
static inline void NAMED(scale_error)(const struct NAMED(arrays) * arrays, const LANE *low) {
    for (int i = 0; i < 2 * arrays->n; i++) {
        const LANE square = arrays->error[i] * arrays->error[i], part = low[i] / 10;
        arrays->error[i] = square / (NAMED(root)(square + part * part) + DBL_MIN);
    }
}

/* From state and rates to state_new and error. Returns the status of the first stage whose rates fail. */
INLINE int NAMED(take_explicit)(const struct refdyn_tableau *tableau, const struct NAMED(arrays) * arrays,
                                LANE h, int has_low, NAMED(stage_rates) * find, void *context) {
    const int stages = tableau->stages;
    memcpy(arrays->memory, arrays->rates, (size_t)arrays->rates_size * sizeof(LANE));
    for (int s = 1; s < stages; s++) {
        NAMED(combine_rates)(arrays, h, tableau->a + s * stages, s, arrays->stage);
        const int status =
            find(context, tableau->c[s], arrays->stage, arrays->memory + s * arrays->rates_size);
        if (status)
            return status;
    }
    NAMED(combine_rates)(arrays, h, tableau->b, stages, arrays->state_new);
    if (tableau->e)
        NAMED(estimate_by_rates)(arrays, h, tableau->e, stages, arrays->error);
    if (tableau->e_low && has_low) {
        NAMED(estimate_by_rates)(arrays, h, tableau->e_low, stages, arrays->side);
        NAMED(scale_error)(arrays, arrays->side);
    }
    return REFDYN_OK;
}

#endif
