/*
 * Steps of one motion by the sources that serve several, too: their arrays, and the rates of their stages.
 *
 * Included by the file of a kind of methods, before its ..._step.h.
 */
#ifndef REFDYN_STEP_OF_ONE_H
#define REFDYN_STEP_OF_ONE_H

#include "linear/dense.h"
#include "methods/step.h"

#define LANES 1
#define NAMED(name) name##_of_one
#define ADD_ALL refdyn_add_all
#include "methods/step_arrays.h"

static inline struct arrays_of_one arrays_of(struct refdyn_step *step) {
    return (struct arrays_of_one){.n = step->n,
                                  .size = 2 * step->n + 1,
                                  .rates_size = refdyn_rates_size(step->evaluation.work->model),
                                  .state = step->state,
                                  .rates = step->rates,
                                  .state_new = step->state_new,
                                  .stage = step->stage,
                                  .side = step->side,
                                  .error = step->error,
                                  .memory = step->memory};
}

/* A step that is being taken. */
struct taking {
    struct refdyn_step *step;
    double h;
};

/* stage_rates_of_one of such a step. */
static inline int find_rates(void *context, double c, double *stage, double *rates) {
    const struct taking *taking = context;
    struct refdyn_step *step = taking->step;
    const double t = refdyn_step_inside(step, step->t_begin + c * taking->h);
    int status = step->guide ? step->guide->bring(step->guide->context, t, stage) : REFDYN_OK;
    if (!status)
        status = refdyn_rates(&step->evaluation, t, stage, rates);
    if (status)
        step->failed_t = t;
    return status;
}

#endif
