/*
 * Times emitted functions as the peers' own C benches do: the median of nine batches of 40 ms.
 *
 * usage: time_emitted LIBRARY NAME STATE QUANTITY[,QUANTITY] RESULT
 * LIBRARY: the emitted C of model NAME as a shared object; STATE: q, qd, tau, n numbers each; tau goes into
 * the inputs tau_COORDINATE. Prints microseconds for one call of all of the quantities, writes the first n
 * numbers of the first into RESULT.
 */
#include "refdyn_model.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { BATCHES = 9, FUNCTIONS = 4, NAME_SIZE = 200 };

static const double least_seconds = 0.03, batch_seconds = 0.04; /* as the peers' */

struct subject {
    const struct refdyn_model *model;
    refdyn_function *functions[FUNCTIONS];
    int function_count;
    double *p, *x, *q, *qd, *out[FUNCTIONS];
};

static void stop(const char *what, const char *which) {
    fprintf(stderr, "time_emitted: %s: %s\n", what, which);
    exit(1);
}

static double *room(size_t count) {
    double *values = calloc(count + 1, sizeof *values);
    if (!values)
        stop("memory", "none left");
    return values;
}

static void *find(void *library, const char *name, const char *what) {
    char symbol[NAME_SIZE];
    snprintf(symbol, sizeof symbol, "%s_%s", name, what);
    void *found = dlsym(library, symbol);
    if (!found)
        stop("not emitted", symbol);
    return found;
}

static void open_functions(struct subject *s, const char *path, const char *name, char *quantities) {
    void *library = dlopen(path, RTLD_NOW), *found;
    if (!library)
        stop("library", dlerror());
    s->model = find(library, name, "model");
    for (char *q = strtok(quantities, ","); q && s->function_count < FUNCTIONS; q = strtok(NULL, ",")) {
        found = find(library, name, q);
        memcpy(&s->functions[s->function_count++], &found, sizeof found);
    }
}

static void prepare(const struct subject *s) {
    if (s->model->prepare)
        s->model->prepare(s->p);
}

/* Default parameters; those that are values at the start of a motion from the model's start. */
static void set_parameters(struct subject *s) {
    const struct refdyn_model *model = s->model;
    double *state = room(2 * (size_t)model->n), *anchors = room((size_t)model->anchored_count);
    s->p = room((size_t)model->parameter_count + (size_t)model->derived_count);
    for (int i = 0; i < model->parameter_count; i++)
        s->p[i] = model->parameters[i].value;
    prepare(s);
    if (model->anchor && model->start) {
        model->start(s->p, s->x, 0, NULL, NULL, state);
        model->anchor(s->p, s->x, 0, state, state + model->n, anchors);
        for (int i = 0; i < model->anchored_count; i++)
            s->p[model->anchored[i]] = anchors[i];
        prepare(s);
    }
    free(state);
    free(anchors);
}

static double *read_row(FILE *file, int n, const char *path) {
    double *row = room((size_t)n);
    for (int i = 0; i < n; i++)
        if (fscanf(file, "%lf", &row[i]) != 1)
            stop("too few numbers", path);
    return row;
}

static void set_input(const struct subject *s, const char *coordinate, double value) {
    char name[NAME_SIZE];
    snprintf(name, sizeof name, "tau_%s", coordinate);
    for (int i = 0; i < s->model->input_count; i++)
        if (strcmp(s->model->inputs[i].name, name) == 0)
            s->x[i] = value;
}

static void read_state(struct subject *s, const char *path) {
    FILE *file = fopen(path, "r");
    const int n = s->model->n;
    if (!file)
        stop("no such state", path);
    s->q = read_row(file, n, path);
    s->qd = read_row(file, n, path);
    double *tau = read_row(file, n, path);
    fclose(file);
    s->x = room((size_t)s->model->input_count);
    for (int i = 0; i < n; i++)
        set_input(s, s->model->coordinates[i].name, tau[i]);
    free(tau);
}

static double seconds(const struct subject *s, long times) {
    struct timespec from, to;
    clock_gettime(CLOCK_MONOTONIC, &from);
    for (long i = 0; i < times; i++)
        for (int k = 0; k < s->function_count; k++)
            s->functions[k](s->p, s->x, 0, s->q, s->qd, s->out[k]);
    clock_gettime(CLOCK_MONOTONIC, &to);
    return (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
}

/* Calls that make a batch. */
static long batch_calls(const struct subject *s) {
    long times = 1;
    for (;;) {
        double t = seconds(s, times);
        if (t > least_seconds)
            return times;
        times = t < 1e-4 ? times * 10 : (long)((double)times * batch_seconds / t) + 1;
    }
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_seconds(const struct subject *s) {
    double t[BATCHES];
    long times = batch_calls(s);
    for (int i = 0; i < BATCHES; i++)
        t[i] = seconds(s, times) / (double)times;
    qsort(t, BATCHES, sizeof *t, by_size);
    return t[BATCHES / 2];
}

static void write_result(const struct subject *s, const char *path) {
    FILE *file = fopen(path, "w");
    if (!file)
        stop("not written", path);
    for (int i = 0; i < s->model->n; i++)
        fprintf(file, "%.17g\n", s->out[0][i]);
    if (fclose(file))
        stop("not written", path);
}

int main(int argc, char **argv) {
    struct subject s = {.function_count = 0};
    if (argc != 6) {
        fprintf(stderr, "usage: time_emitted LIBRARY NAME STATE QUANTITY[,QUANTITY] RESULT\n");
        return 2;
    }
    open_functions(&s, argv[1], argv[2], argv[4]);
    read_state(&s, argv[3]);
    set_parameters(&s);
    for (int k = 0; k < s.function_count; k++) {
        size_t n = (size_t)s.model->n;
        s.out[k] = room(n * (n + 2));
    }
    printf("%.4f\n", 1e6 * median_seconds(&s));
    write_result(&s, argv[5]);
    return 0;
}
