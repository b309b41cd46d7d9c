/*
 * Values of emitted C: reads the values that interpreted.c wrote and prints the same lines. test_compilers.py
 * compiles it with NAME, the name of the model, and links it with the model's C.
 */
#include "refdyn_model.h"
#include "quantity_lists.h"

#include <stdio.h>
#include <stdlib.h>

#define TABLE_OF(name) name##_model
#define TABLE(name) TABLE_OF(name)

extern const struct refdyn_model TABLE(NAME);

static int refdyn_chain_result_size(const struct refdyn_model *model) {
    int used = 0;
    for (int i = 0; i < 3 * REFDYN_VECTOR_COUNT; i++)
        used += model->vector_places[i] >= 0;
    return 2 * model->n + (used + 3 * model->coupling_count) * model->n;
}

static int read_list(FILE *in, double *list, int count) {
    int read = 0;
    while (read < count && fscanf(in, "%la", &list[read]) == 1)
        read++;
    return read == count;
}

static void print_results(const char *quantity, int state, const double *results, int count) {
    for (int i = 0; i < count; i++)
        printf("%d %s %d %.17g\n", state, quantity, i, results[i]);
}

int main(int argument_count, char **arguments) {
    const struct refdyn_model *model = &TABLE(NAME);
    const int n = model->n, m = model->m, points = model->point_count;
    const int variables = 2 * n + 1 + model->input_count + model->parameter_count;
    const size_t most = (size_t)(3 * (points + 1) + 3 * n + 3 * m + 8) * (size_t)(variables + 8);
    double *p = calloc((size_t)(model->parameter_count + model->derived_count) + 1, sizeof *p);
    double *x = calloc((size_t)model->input_count + 1, sizeof *x);
    double *values = calloc(3 * (size_t)n + 2 + (size_t)m, sizeof *values), *out = calloc(most, sizeof *out);
    FILE *in = fopen(arguments[argument_count - 1], "r");
    if (!in || !read_list(in, p, model->parameter_count) || !read_list(in, x, model->input_count))
        return 1;
    if (model->prepare)
        model->prepare(p);
    for (int state = 0; read_list(in, values, 3 * n + 2 + m); state++) {
        const double t = values[0], *q = values + 1, *qd = q + n;
#define PRINT(name, count)                       \
    if (model->name && (count) > 0) {            \
        model->name(p, x, t, q, qd, out);        \
        print_results(#name, state, out, count); \
    }
        QUANTITIES(PRINT)
    }
    return 0;
}
