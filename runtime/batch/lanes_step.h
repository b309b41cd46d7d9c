/*
 * The steps of LANES motions: see lanes.h. Included by a file for each width, which defines LANES, and
 * VARIANT, what its names end with.
 *
 * States are gathered into lanes, stepped by the source that steps one motion (methods/runge_kutta_step.h),
 * and given back.
 */
#include "batch/lanes.h"

#include "linear/dense.h"

#define JOINED_BEFORE(name, width) name##_##width
#define JOINED(name, width) JOINED_BEFORE(name, width)
#define NAMED(name) JOINED(name, VARIANT)

/* Vectors are passed by value between functions of this file alone. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

typedef double NAMED(vector) __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));

/* y += h sum_j weight_j x_j, in the order of refdyn_add_all. */
static inline void NAMED(add_all)(NAMED(vector) *restrict y, NAMED(vector) h, const double *weights,
                                  int count, const NAMED(vector) *restrict x, int stride, int n) {
    int j = 0;
    for (; j + 3 < count; j += 4) {
        const NAMED(vector) a = h * weights[j], b = h * weights[j + 1], c = h * weights[j + 2],
                            d = h * weights[j + 3];
        const NAMED(vector) *u = x + j * stride, *v = u + stride, *w = v + stride, *z = w + stride;
        for (int i = 0; i < n; i++)
            y[i] = y[i] + a * u[i] + b * v[i] + c * w[i] + d * z[i];
    }
    for (; j < count; j++) {
        const NAMED(vector) a = h * weights[j], *u = x + j * stride;
        for (int i = 0; i < n; i++)
            y[i] += a * u[i];
    }
}

#define ADD_ALL NAMED(add_all)
#include "methods/runge_kutta_step.h"

/* The steps that are being taken. */
struct NAMED(taking) {
    struct lanes *lanes;
    struct lane_step *steps;
    const struct refdyn_method_definition *method;
    const struct refdyn_tableau *tableau;
    int n, m, has_rates_new;
    LANE h;
};

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
    const struct NAMED(taking) *taking = context;
    for (int lane = 0; lane < LANES; lane++) {
        const struct lane_step *one = &taking->steps[lane];
        if (one->step)
            taking->lanes->t[lane] = refdyn_step_inside(one->step, one->step->t_begin + c * one->h);
    }
    NAMED(find_rates)(taking, stage, rates);
    return REFDYN_OK;
}

/* Rates at the ends, as the motions would find them: where no row may move the ends before. */
static void NAMED(find_rates_new)(const struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    for (int lane = 0; lane < LANES; lane++)
        lanes->t[lane] = taking->steps[lane].t_new;
    NAMED(find_rates)(taking, (const LANE *)(void *)lanes->state_new, (LANE *)(void *)lanes->rates_new);
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

static void NAMED(load)(struct NAMED(taking) * taking, int lane) {
    struct lanes *lanes = taking->lanes;
    const struct refdyn_model *model = lanes->model->model;
    struct lane_step *one = &taking->steps[lane];
    taking->h[lane] = one->h;
    if (one->is_new) {
        NAMED(gather)(lanes->p, one->p, lane, model->parameter_count + model->derived_count);
        NAMED(gather)(lanes->x, one->x, lane, model->input_count);
        one->is_new = 0;
    }
    NAMED(gather)(lanes->state, one->step->state, lane, 2 * taking->n + 1);
    NAMED(gather)(lanes->rates, one->step->rates, lane, 2 * taking->n + 1 + taking->m);
}

static void NAMED(unload)(const struct NAMED(taking) * taking, int lane) {
    const struct lanes *lanes = taking->lanes;
    struct lane_step *one = &taking->steps[lane];
    struct refdyn_step *step = one->step;
    const int n = taking->n, size = 2 * n + 1, rates = size + taking->m, stages = taking->tableau->stages;
    refdyn_step_take_up(step, one->t_new);
    step->has_rates_new = taking->has_rates_new;
    NAMED(scatter)(step->state_new, lanes->state_new, lane, size);
    NAMED(scatter)(step->error, lanes->error, lane, 2 * n);
    if (taking->has_rates_new)
        NAMED(scatter)(step->rates_new, lanes->rates_new, lane, rates);
    for (int s = 0; s < stages && one->needs_stages; s++)
        NAMED(scatter)(step->memory + s * rates, lanes->stages + s * rates * LANES, lane, rates);
    step->evaluation.work->evaluations += stages - 1;
    one->is_taken = refdyn_is_finite(step->state_new, size) && refdyn_is_finite(step->error, 2 * n) &&
                    (!taking->has_rates_new || refdyn_is_finite(step->rates_new, rates));
}

static void NAMED(take_all)(struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    const int n = taking->n, rates = 2 * n + 1 + taking->m;
    const struct NAMED(arrays) arrays = {.n = n,
                                         .size = 2 * n + 1,
                                         .rates_size = rates,
                                         .state = (const LANE *)(void *)lanes->state,
                                         .rates = (const LANE *)(void *)lanes->rates,
                                         .state_new = (LANE *)(void *)lanes->state_new,
                                         .stage = (LANE *)(void *)lanes->stage,
                                         .side = (LANE *)(void *)lanes->side,
                                         .error = (LANE *)(void *)lanes->error,
                                         .memory = (LANE *)(void *)lanes->stages};
    NAMED(take_stages)(taking->tableau, &arrays, taking->h, 1, NAMED(find_stage), taking);
    if (taking->method->is_last_new)
        memcpy(lanes->rates_new, lanes->stages + (taking->tableau->stages - 1) * rates * LANES,
               (size_t)(rates * LANES) * sizeof(double));
    else if (taking->has_rates_new)
        NAMED(find_rates_new)(taking);
}

void NAMED(refdyn_lanes_take)(struct lanes *lanes, struct lane_step *steps) {
    const struct refdyn_model *model = lanes->model->model;
    struct NAMED(taking) taking = {.lanes = lanes, .steps = steps, .n = model->n, .m = model->m};
    for (int lane = 0; lane < LANES; lane++)
        if (steps[lane].step) {
            taking.method = steps[lane].step->method;
            NAMED(load)(&taking, lane);
        }
    taking.tableau = taking.method->table;
    taking.has_rates_new = taking.method->is_last_new || model->m == 0;
    NAMED(take_all)(&taking);
    for (int lane = 0; lane < LANES; lane++)
        if (steps[lane].step)
            NAMED(unload)(&taking, lane);
}
