/* Explicit steps of several motions side by side: see lanes.h. */
#include "base/arithmetic.h"

#include "batch/lanes.h"

#include <stdlib.h>
#include <string.h>

#include "methods/runge_kutta.h"

enum { WIDEST = 8 };

int refdyn_lanes_widest(void) {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx512f"))
        return 8;
    if (__builtin_cpu_supports("avx2"))
        return 4;
#endif
    return 2;
}

/* Of all methods whose table is a tableau. */
static int most_stages(void) {
    int most = 0;
    for (int number = REFDYN_AUTO + 1; number < REFDYN_METHOD_COUNT; number++) {
        const struct refdyn_method_definition *method = refdyn_method_definition((enum refdyn_method)number);
        const struct refdyn_tableau *tableau = method->kind == &refdyn_explicit ? method->table : NULL;
        most = tableau && tableau->stages > most ? tableau->stages : most;
    }
    return most;
}

/* Counts what it gives: with memory NULL, all that is needed. */
static double *take(double *memory, size_t *used, int count, int width) {
    double *piece = memory ? memory + *used : NULL;
    *used += (size_t)(count * width + WIDEST - 1) / WIDEST * WIDEST;
    return piece;
}

static size_t lay_out(struct lanes *lanes, double *memory) {
    const struct refdyn_model *model = lanes->model->model;
    const int width = lanes->model->width, size = 2 * model->n + 1, rates = size + model->m;
    size_t used = 0;
    lanes->p = take(memory, &used, model->parameter_count + model->derived_count, width);
    lanes->x = take(memory, &used, model->input_count, width);
    lanes->t = take(memory, &used, 1, width);
    lanes->state = take(memory, &used, size, width);
    lanes->rates = take(memory, &used, rates, width);
    lanes->state_new = take(memory, &used, size, width);
    lanes->rates_new = take(memory, &used, rates, width);
    lanes->stage = take(memory, &used, size, width);
    lanes->side = take(memory, &used, size, width);
    lanes->error = take(memory, &used, size, width);
    lanes->stages = take(memory, &used, most_stages() * rates, width);
    return used;
}

static int has_functions(const struct refdyn_lane_model *model) {
    return (model->width == 2 || model->width == 4 || model->width == 8) &&
           (model->model->m == 0 ? model->qdd_free : model->constrained) != NULL;
}

int refdyn_lanes_start(struct lanes *lanes, const struct refdyn_lane_model *model) {
    *lanes = (struct lanes){.model = model};
    if (model->interface_version != REFDYN_LANES_VERSION)
        return REFDYN_OTHER_VERSION;
    if (!has_functions(model))
        return REFDYN_FUNCTION_MISSING;
    const size_t size = lay_out(lanes, NULL) * sizeof(double);
    lanes->memory = aligned_alloc(WIDEST * sizeof(double), size);
    if (!lanes->memory)
        return REFDYN_BAD_MEMORY;
    memset(lanes->memory, 0, size);
    lay_out(lanes, lanes->memory);
    return REFDYN_OK;
}

/* By the binary logarithm of the width: on processors that have such vectors, and on others. */
static lanes_take *const takes[2][3] = {
    {refdyn_lanes_take_2, refdyn_lanes_take_4, refdyn_lanes_take_8},
    {refdyn_lanes_take_2, refdyn_lanes_take_4_apart, refdyn_lanes_take_8_apart}};

void refdyn_lanes_take(struct lanes *lanes, struct lane_step *steps) {
    const int width = lanes->model->width, is_apart = width > refdyn_lanes_widest();
    takes[is_apart][width == 8 ? 2 : width == 4 ? 1 : 0](lanes, steps);
}

void refdyn_lanes_release(struct lanes *lanes) {
    free(lanes->memory);
    lanes->memory = NULL;
}
