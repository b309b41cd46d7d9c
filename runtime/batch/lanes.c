/*
 * Lanes: their memory, and the choice between the versions for this processor.
 *
 * In: motions that have halted at a step (motion.h) and the functions for lanes that were emitted for their
 * model. Out: for each motion the end of the step, its error and, where that is small enough, the rates on
 * the programme. The methods are those of one motion (..._step.inc in runtime/core/methods). Widths are 2, 4
 * and 8; 4 and 8 are compiled for processors with such vectors and, separately, for others. Lanes do not
 * depend on each other.
 */
#include "runtime/core/base/core.h"

#include "runtime/batch/batch_private.h"

#include <stdlib.h>
#include <string.h>

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

/* Returns the largest memory of a method that lanes support. */
static int most_memory(const struct lanes *lanes) {
    const struct refdyn_model *model = lanes->model->model;
    int most = 0;
    for (int number = REFDYN_AUTO + 1; number < REFDYN_METHOD_COUNT; number++) {
        const struct refdyn_method_definition *method = refdyn_method_definition((enum refdyn_method)number);
        const int memory =
            refdyn_lanes_have_kind(lanes, method->kind) ? method->kind->memory_size(method, model) : 0;
        most = memory > most ? memory : most;
    }
    return most;
}

static int most(int a, int b) {
    return a > b ? a : b;
}

/* Hands out arrays and counts their bytes; with memory NULL it only counts. */
struct room {
    char *memory;
    size_t used;
    int width;
};

static void *take(struct room *room, int count, size_t size) {
    void *piece = room->memory ? room->memory + room->used : NULL;
    const size_t unit = WIDEST * sizeof(double);
    room->used += ((size_t)(count * room->width) * size + unit - 1) / unit * unit;
    return piece;
}

static double *take_doubles(struct room *room, int count) {
    return take(room, count, sizeof(double));
}

static void lay_out_linear(struct lanes *lanes, struct room *room) {
    const struct refdyn_model *model = lanes->model->model;
    const int n = model->n, m = model->m, size = n + m, matrices = 1 + REFDYN_COMPLEXES_MOST;
    for (int i = 0; i < 2; i++) {
        struct lanes_linear *linear = &lanes->linear[i];
        linear->tangent = take_doubles(room, n + m * (1 + 3 * n) + 3 * n * n);
        linear->real = take_doubles(room, size * size);
        linear->complexes = take_doubles(room, REFDYN_COMPLEXES_MOST * 2 * size * size);
        linear->pivots = take(room, matrices * size, sizeof(int));
    }
    lanes->linear_room = take_doubles(room, n + 3 * size);
}

static size_t lay_out(struct lanes *lanes, char *memory) {
    const struct refdyn_model *model = lanes->model->model;
    const int n = model->n, m = model->m, size = 2 * n + 1, rates = size + m;
    struct room room = {memory, 0, lanes->model->width};
    lanes->p = take_doubles(&room, model->parameter_count + model->derived_count);
    lanes->x = take_doubles(&room, model->input_count);
    lanes->t = take_doubles(&room, 1);
    lanes->state = take_doubles(&room, size);
    lanes->rates = take_doubles(&room, rates);
    lanes->state_new = take_doubles(&room, size);
    lanes->rates_new = take_doubles(&room, rates);
    lanes->stage = take_doubles(&room, size);
    lanes->side = take_doubles(&room, rates);
    lanes->error = take_doubles(&room, size);
    lanes->stages = take_doubles(&room, most_memory(lanes));
    lanes->row_terms = take_doubles(&room, m * (n + 4));
    lanes->sizes = take_doubles(&room, m * n);
    lanes->small = take_doubles(&room, m * (m + 2));
    lanes->zeros = take_doubles(&room, rates);
    lanes->nowhere = take_doubles(&room, most(rates, m * (n + 4)));
    lanes->small_pivots = take(&room, m, sizeof(int));
    lanes->directions = take_doubles(&room, m * n);
    lanes->mass_directions = take_doubles(&room, m * n);
    if (lanes->has_tangent)
        lay_out_linear(lanes, &room);
    return room.used;
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
    lanes->has_tangent = model->tangent && model->model->tangent;
    const size_t size = lay_out(lanes, NULL);
    lanes->memory = aligned_alloc(WIDEST * sizeof(double), size);
    if (!lanes->memory)
        return REFDYN_BAD_MEMORY;
    memset(lanes->memory, 0, size);
    lay_out(lanes, lanes->memory);
    return REFDYN_OK;
}

/* By the binary logarithm of the width, for processors with and without vectors of this width. */
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
