/*
 * The arrays of a step of one motion, or of several side by side (base/lane.h), and what a step asks for.
 *
 * A file that includes this defines ADD_ALL, refdyn_add_all of lanes, besides.
 */
#ifndef REFDYN_STEP_ARRAYS_H
#define REFDYN_STEP_ARRAYS_H

#include "base/lane.h"

/* struct refdyn_step tells what they are. */
struct NAMED(arrays) {
    int n, size, rates_size; /* coordinates, entries of a state and of its rates */
    const LANE *state, *rates;
    LANE *state_new, *stage, *side, *error;
    LANE *memory;
};

/* Rates (rates_size) of a stage at t_begin + c h, whose state may be moved. Returns a status. */
typedef int NAMED(stage_rates)(void *context, double c, LANE *stage, LANE *rates);

#endif
