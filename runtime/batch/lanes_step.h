/*
 * The steps of LANES motions: see lanes.h. Included by a file for each width, which defines LANES, and
 * VARIANT, what its names end with.
 *
 * States are gathered into lanes, stepped by the sources that step one motion, brought onto the programme,
 * and given back.
 */
#include "batch/lanes.h"

#include <math.h>
#include <string.h>

#include "linear/dense.h"

#define JOINED_BEFORE(name, width) name##_##width
#define JOINED(name, width) JOINED_BEFORE(name, width)
#define NAMED(name) JOINED(name, VARIANT)

/* Vectors are passed by value between functions of this file alone. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

#include "base/lane.h"
#include "linear/weighted_sum.h"

#define ADD_ALL NAMED(weighted_sum)
#include "methods/step_arrays.h"

/* The steps that are being taken. */
struct NAMED(taking) {
    struct lanes *lanes;
    struct lane_step *steps;
    const struct refdyn_method_definition *method;
    struct NAMED(arrays) arrays;
    int n, m;
    LANE h, t_begin, t_limit; /* those of their steps [s] */
};

static inline LANE *NAMED(lanes_of)(double *numbers) {
    return (LANE *)(void *)numbers;
}

/* Arrays of all motions into their lanes, and back. */
static void NAMED(gather_all)(LANE *to, double *const *from, int count) {
    for (int i = 0; i < count; i++) {
        LANE x;
        for (int lane = 0; lane < LANES; lane++)
            x[lane] = from[lane][i];
        to[i] = x;
    }
}

static void NAMED(scatter_all)(double *const *to, const LANE *from, int count) {
    for (int i = 0; i < count; i++) {
        const LANE x = from[i];
        for (int lane = 0; lane < LANES; lane++)
            to[lane][i] = x[lane];
    }
}

/* An array of one motion into its lane, and back. */
static void NAMED(gather)(double *to, const double *from, int lane, int count) {
    for (int i = 0; i < count; i++)
        to[i * LANES + lane] = from[i];
}

static void NAMED(scatter)(double *to, const double *from, int lane, int count) {
    for (int i = 0; i < count; i++)
        to[i] = from[i * LANES + lane];
}

/* Into lanes->t: the time of a stage at t_begin + c h (refdyn_step_inside). */
static void NAMED(set_stage_times)(const struct NAMED(taking) * taking, double c) {
    const LANE t = taking->t_begin + c * taking->h;
    *NAMED(lanes_of)(taking->lanes->t) = NAMED(select)(t < taking->t_limit, t, taking->t_limit);
}

/* Rates at lanes->t. */
static void NAMED(find_rates)(const struct NAMED(taking) * taking, const LANE *state, LANE *rates) {
    struct lanes *lanes = taking->lanes;
    const int n = taking->n;
    refdyn_lane_function *function = taking->m == 0 ? lanes->model->qdd_free : lanes->model->constrained;
    function(lanes->p, lanes->x, lanes->t, (const double *)state, (const double *)(state + n),
             (double *)(rates + n));
    memcpy(rates, state + n, (size_t)n * sizeof *rates);
    memset(rates + 2 * n, 0, sizeof *rates); /* no power */
}

static int NAMED(find_stage)(void *context, double c, LANE *stage, LANE *rates) {
    NAMED(set_stage_times)(context, c);
    NAMED(find_rates)(context, stage, rates);
    return REFDYN_OK;
}

/* ---- The kinds of methods: each leaves state_new and error, and a status in each step ---- */

#include "methods/runge_kutta_step.h"

static void NAMED(take_by_runge_kutta)(struct NAMED(taking) * taking) {
    const struct refdyn_tableau *tableau = taking->method->table;
    struct lanes *lanes = taking->lanes;
    const int rates = taking->arrays.rates_size;
    NAMED(take_explicit)(tableau, &taking->arrays, taking->h, 1, NAMED(find_stage), taking);
    if (taking->method->is_last_new)
        memcpy(lanes->rates_new, lanes->stages + (tableau->stages - 1) * rates * LANES,
               (size_t)(rates * LANES) * sizeof(double));
    for (int lane = 0; lane < LANES; lane++)
        if (taking->steps[lane].motion)
            taking->steps[lane].motion->work->evaluations += tableau->stages - 1;
}

#include "batch/lanes_implicit.h"
#include "batch/lanes_meet.h"

/* ---- All of a step ---- */

/* What one motion begins its step with; where its state and rates are. */
static void NAMED(load)(struct NAMED(taking) * taking, int lane, double **state, double **rates) {
    struct lanes *lanes = taking->lanes;
    const struct refdyn_model *model = lanes->model->model;
    struct lane_step *one = &taking->steps[lane];
    const struct refdyn_step *step = &one->motion->step;
    taking->h[lane] = one->attempt->h;
    taking->t_begin[lane] = step->t_begin;
    taking->t_limit[lane] = step->t_limit;
    if (one->is_new) {
        NAMED(gather)
        (lanes->p, one->motion->parameters.own, lane, model->parameter_count + model->derived_count);
        NAMED(gather)(lanes->x, one->x, lane, model->input_count);
        refdyn_lanes_forget(lanes, one->motion, lane);
    }
    *state = step->state;
    *rates = step->rates;
    one->status = REFDYN_OK;
}

static void NAMED(load_all)(struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    double *states[LANES], *rates[LANES];
    for (int lane = 0; lane < LANES; lane++) {
        states[lane] = rates[lane] = lanes->zeros;
        if (!taking->steps[lane].motion)
            continue;
        taking->method = taking->steps[lane].motion->step.method;
        NAMED(load)(taking, lane, &states[lane], &rates[lane]);
    }
    NAMED(gather_all)(NAMED(lanes_of)(lanes->state), states, 2 * taking->n + 1);
    NAMED(gather_all)(NAMED(lanes_of)(lanes->rates), rates, 2 * taking->n + 1 + taking->m);
}

/* What a state inside of the step is found from, and what the next step goes on from. */
static void NAMED(unload_memory)(const struct NAMED(taking) * taking, int lane) {
    struct lanes *lanes = taking->lanes;
    const struct lane_step *one = &taking->steps[lane];
    struct refdyn_step *step = &one->motion->step;
    const int size = step->method->kind->memory_size(step->method, lanes->model->model);
    if (step->method->kind == &refdyn_collocation)
        NAMED(unload_stages)(taking, lane);
    else if (one->needs_stages)
        NAMED(scatter)(step->memory, lanes->stages, lane, size);
}

/* Gives the end of the step, and the size of its error. */
static void NAMED(unload)(const struct NAMED(taking) * taking, int lane, double error) {
    struct lane_step *one = &taking->steps[lane];
    struct refdyn_step *step = &one->motion->step;
    if (!isfinite(error)) {
        one->status = REFDYN_LEFT_TO_MOTION;
        return;
    }
    refdyn_step_take_up(step, one->attempt->t_new);
    NAMED(unload_memory)(taking, lane);
    refdyn_attempt_measured(one->motion, one->attempt, error);
}

/* Of steps that failed, too: nobody asks for those. */
static void NAMED(unload_ends)(const struct NAMED(taking) * taking) {
    double *ends[LANES];
    for (int lane = 0; lane < LANES; lane++) {
        const struct refdyn_motion *motion = taking->steps[lane].motion;
        ends[lane] = motion ? motion->step.state_new : taking->lanes->nowhere;
    }
    NAMED(scatter_all)(ends, taking->arrays.state_new, 2 * taking->n + 1);
}

/* refdyn_step_largest_error; not finite where that or the state is not. */
static LANE NAMED(find_errors)(const struct NAMED(taking) * taking) {
    const struct NAMED(arrays) *arrays = &taking->arrays;
    const int n = taking->n;
    const double *units = NULL;
    LANE largest = NAMED(every)(0), not_finite = largest;
    for (int lane = 0; lane < LANES; lane++)
        units = taking->steps[lane].motion ? taking->steps[lane].motion->step.units : units;
    for (int j = 0; j < n; j++) {
        const LANE position = NAMED(size)(arrays->error[j]),
                   velocity = taking->h * NAMED(size)(arrays->error[n + j]);
        largest = NAMED(larger)(largest, NAMED(larger)(velocity, position) / units[j]);
        not_finite += 0 * arrays->state_new[j] + 0 * arrays->state_new[n + j];
    }
    return largest + not_finite;
}

void NAMED(refdyn_lanes_take)(struct lanes *lanes, struct lane_step *steps) {
    const struct refdyn_model *model = lanes->model->model;
    const int n = model->n, m = model->m;
    struct NAMED(taking) taking = {.lanes = lanes, .steps = steps, .n = n, .m = m};
    NAMED(load_all)(&taking);
    taking.arrays = (struct NAMED(arrays)){.n = n,
                                           .size = 2 * n + 1,
                                           .rates_size = 2 * n + 1 + m,
                                           .state = NAMED(lanes_of)(lanes->state),
                                           .rates = NAMED(lanes_of)(lanes->rates),
                                           .state_new = NAMED(lanes_of)(lanes->state_new),
                                           .stage = NAMED(lanes_of)(lanes->stage),
                                           .side = NAMED(lanes_of)(lanes->side),
                                           .error = NAMED(lanes_of)(lanes->error),
                                           .memory = NAMED(lanes_of)(lanes->stages)};
    if (taking.method->kind == &refdyn_explicit)
        NAMED(take_by_runge_kutta)(&taking);
    else if (taking.method->kind == &refdyn_rosenbrock)
        NAMED(take_by_rosenbrock)(&taking);
    else
        NAMED(take_by_collocation)(&taking);
    const LANE errors = NAMED(find_errors)(&taking);
    for (int lane = 0; lane < LANES; lane++)
        if (steps[lane].motion && !steps[lane].status)
            NAMED(unload)(&taking, lane, errors[lane]);
    NAMED(unload_ends)(&taking);
    NAMED(meet)(&taking);
}
