/*
 * Compares compilations of one model: every emitted function at random states, parameters and inputs.
 * test_tiers.py calls it with the name of the model, then the libraries.
 *
 * Prints a line for each function whose results differ in a bit between the first library and another one,
 * and the number of compared results. Any two values that are not numbers count as equal.
 */
#include "refdyn_model.h"

#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 24, LIBRARIES_MOST = 8, UNTOUCHED = 0xa5 };

struct subject {
    const struct refdyn_model *model;
    double *p, *out;
    size_t size;
};

static uint64_t random_bits = 2385;

/* From -1 to 1 (xorshift: Marsaglia 2003). */
static double random_value(void) {
    random_bits ^= random_bits << 13;
    random_bits ^= random_bits >> 7;
    random_bits ^= random_bits << 17;
    return (double)(random_bits >> 11) / 4503599627370496.0 - 1;
}

/* An upper bound on the result of any function. */
static size_t result_size(const struct refdyn_model *model) {
    const size_t n = (size_t)model->n, m = (size_t)model->m, points = (size_t)model->point_count;
    const size_t variables = 2 * n + 1 + (size_t)model->input_count + (size_t)model->parameter_count;
    const size_t values =
        (size_t)model->event_count + (size_t)model->kink_count + (size_t)model->change_count;
    const size_t named = (size_t)model->course_count + (size_t)model->break_count +
                         (size_t)model->switch_count + (size_t)model->anchored_count +
                         7 * (size_t)model->requirement_count;
    return (n + 3 * m + 3 * points + values + 8) * (variables + 2 * n + 8) + named +
           n * (8 + 3 * (REFDYN_VECTOR_COUNT + (size_t)model->coupling_count));
}

static int are_equal(const double *a, const double *b, size_t size) {
    for (size_t i = 0; i < size; i++)
        if (memcmp(&a[i], &b[i], sizeof *a) != 0 && !(isnan(a[i]) && isnan(b[i])))
            return 0;
    return 1;
}

static void evaluate(struct subject *subject, refdyn_function *function, const double *x, double t,
                     const double *q, const double *rest) {
    memset(subject->out, UNTOUCHED, subject->size * sizeof *subject->out);
    function(subject->p, x, t, q, rest, subject->out);
}

static long compare_all(struct subject *subjects, int count, const double *x, double t, const double *q,
                        const double *rest, int *differs) {
    long compared = 0;
#define COMPARE(name)                                                                  \
    for (int i = 0; i < count && subjects[0].model->name; i++) {                       \
        evaluate(&subjects[i], subjects[i].model->name, x, t, q, rest);                \
        compared += i > 0;                                                             \
        if (i > 0 && !are_equal(subjects[0].out, subjects[i].out, subjects[0].size)) { \
            printf("%s of library %d\n", #name, i + 1);                                \
            *differs = 1;                                                              \
        }                                                                              \
    }
    REFDYN_QUANTITIES(COMPARE)
    return compared;
}

/* The same parameters for all, prepared by each library. */
static int set_parameters(struct subject *subjects, int count) {
    const struct refdyn_model *model = subjects[0].model;
    const size_t size = (size_t)(model->parameter_count + model->derived_count);
    for (int i = 0; i < model->parameter_count; i++) {
        const double value = model->parameters[i].value;
        subjects[0].p[i] = isfinite(value) ? value * (1 + 0.1 * random_value()) : 0.37 * random_value();
    }
    for (int i = 0; i < count; i++) {
        memcpy(subjects[i].p, subjects[0].p, (size_t)model->parameter_count * sizeof(double));
        if (model->prepare)
            subjects[i].model->prepare(subjects[i].p);
        if (!are_equal(subjects[0].p, subjects[i].p, size))
            return 0;
    }
    return 1;
}

static int open_subject(struct subject *subject, const char *library, const char *name) {
    char symbol[256];
    void *handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    snprintf(symbol, sizeof symbol, "%s_model", name);
    subject->model = handle ? dlsym(handle, symbol) : NULL;
    if (!subject->model) {
        fprintf(stderr, "%s\n", dlerror());
        return 0;
    }
    subject->size = result_size(subject->model);
    subject->out = malloc(subject->size * sizeof *subject->out);
    subject->p = calloc((size_t)(subject->model->parameter_count + subject->model->derived_count) + 1,
                        sizeof *subject->p);
    return subject->out && subject->p;
}

int main(int argument_count, char **arguments) {
    struct subject subjects[LIBRARIES_MOST];
    const int count = argument_count - 2;
    static const double scales[] = {0.3, 3, 1000}; /* small angles, those that are reduced, and many turns */
    if (count < 2 || count > LIBRARIES_MOST)
        return 2;
    for (int i = 0; i < count; i++)
        if (!open_subject(&subjects[i], arguments[i + 2], arguments[1]))
            return 2;
    const struct refdyn_model *model = subjects[0].model;
    const int rest_count = 3 * model->n + 1 + model->m;
    double *x = calloc((size_t)model->input_count + 1, sizeof *x);
    double *values = calloc((size_t)(model->n + rest_count), sizeof *values);
    long compared = 0;
    int differs = 0;
    for (int state = 0; x && values && state < STATES; state++) {
        if (!set_parameters(subjects, count))
            differs = printf("prepare\n");
        for (int i = 0; i < model->input_count; i++)
            x[i] = model->inputs[i].value + random_value();
        for (int i = 0; i < model->n + rest_count; i++)
            values[i] = scales[state % 3] * random_value();
        compared +=
            compare_all(subjects, count, x, 2 + 2 * random_value(), values, values + model->n, &differs);
    }
    printf("%ld compared\n", compared);
    return differs != 0;
}
