/*
 * One step of an explicit Runge-Kutta method, for one motion or for several side by side.
 *
 * Each file that includes this defines LANES, how many motions there are, NAMED(name), which makes its names
 * its own, and ADD_ALL, refdyn_add_all of lanes. Entry i of all motions is one `lane`: a vector of LANES
 * doubles, and for one motion a double; so that the statements are the same, and each motion gets the bits
 * that it gets alone. No motion looks at another one. Formulas in runge_kutta.h.
 */
#include "methods/runge_kutta.h"

#include <float.h>
#include <math.h>
#include <string.h>

#if LANES == 1
typedef double NAMED(lane);
#else
typedef double NAMED(lane) __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));
#endif
#define LANE NAMED(lane)

/* A step's arrays: struct refdyn_step tells what they are. */
struct NAMED(arrays) {
    int n, size, rates_size; /* coordinates, entries of a state and of its rates */
    const LANE *state, *rates;
    LANE *state_new, *stage, *side, *error;
    LANE *memory; /* (stages x rates_size) */
};

/* Rates (rates_size) of a stage at t_begin + c h, whose state may be moved. Returns a status. */
typedef int NAMED(stage_rates)(void *context, double c, LANE *stage, LANE *rates);

static inline LANE NAMED(root)(LANE x) {
#if LANES == 1
    return sqrt(x);
#else
    for (int lane = 0; lane < LANES; lane++)
        x[lane] = sqrt(x[lane]);
    return x;
#endif
}

/* y := state + h sum_j weight_j rates_j */
static inline void NAMED(combine)(const struct NAMED(arrays) * arrays, LANE h, const double *weights,
                                  int count, LANE *y) {
    memcpy(y, arrays->state, (size_t)arrays->size * sizeof *y);
    ADD_ALL(y, h, weights, count, arrays->memory, arrays->rates_size, arrays->size);
}

/* error := h sum_j weight_j rates_j, q and qd only */
static inline void NAMED(estimate)(const struct NAMED(arrays) * arrays, LANE h, const double *weights,
                                   int stages, LANE *error) {
    const int count = 2 * arrays->n;
    memset(error, 0, (size_t)count * sizeof *error);
    for (int j = 0; j < stages; j++) {
        const LANE weight = h * weights[j], *rates = arrays->memory + j * arrays->rates_size;
        for (int i = 0; i < count && weights[j] != 0; i++)
            error[i] += weight * rates[i];
    }
}

/* E^2 / sqrt(E^2 + E_low^2 / 100) of each entry, 0 where both are; such small ones are 0 to all who ask. */
static inline void NAMED(scale_error)(const struct NAMED(arrays) * arrays, const LANE *low) {
    for (int i = 0; i < 2 * arrays->n; i++) {
        const LANE square = arrays->error[i] * arrays->error[i], part = low[i] / 10;
        arrays->error[i] = square / (NAMED(root)(square + part * part) + DBL_MIN);
    }
}

/* From state and rates to state_new and error. Returns the status of the first stage whose rates fail. */
static inline int NAMED(take_stages)(const struct refdyn_tableau *tableau,
                                     const struct NAMED(arrays) * arrays, LANE h, int has_low,
                                     NAMED(stage_rates) * find, void *context) {
    const int stages = tableau->stages;
    memcpy(arrays->memory, arrays->rates, (size_t)arrays->rates_size * sizeof(LANE));
    for (int s = 1; s < stages; s++) {
        NAMED(combine)(arrays, h, tableau->a + s * stages, s, arrays->stage);
        const int status =
            find(context, tableau->c[s], arrays->stage, arrays->memory + s * arrays->rates_size);
        if (status)
            return status;
    }
    NAMED(combine)(arrays, h, tableau->b, stages, arrays->state_new);
    if (tableau->e)
        NAMED(estimate)(arrays, h, tableau->e, stages, arrays->error);
    if (tableau->e_low && has_low) {
        NAMED(estimate)(arrays, h, tableau->e_low, stages, arrays->side);
        NAMED(scale_error)(arrays, arrays->side);
    }
    return REFDYN_OK;
}
