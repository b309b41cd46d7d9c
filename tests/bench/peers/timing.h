/*
 * What all timing programs share: they read a state, write the values of a quantity, and time one call of it.
 * For C and C++. A program runs in the working folder:
 *
 *     PROGRAM values|times N_RFE ...
 *
 * "values" writes the results of each quantity to values/PROGRAM-QUANTITY-VARIANT-N_RFE as doubles.
 * "times" prints one JSON object a line: program, quantity, variant, n_rfe, n, and us, the microseconds of
 * one call.
 */
#ifndef TIMING_H
#define TIMING_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { BATCHES = 100, PATH_SIZE = 500 };

/* The random state of models/stateN.txt: coordinates, rates, forces, and accelerations for inverse dynamics.
 */
struct bench {
    const char *program;
    int only_values, n_rfe, n;
    double *q, *qd, *tau, *qdd;
};

/* A call repeats the quantity, so that the measured loop has no other call in it. */
typedef void bench_call(void *subject, long times);

/* Arrays of a quantity, the last one with values = NULL. */
struct bench_result {
    const double *values;
    size_t count;
};

static void stop(const char *what, const char *which) {
    fprintf(stderr, "%s: %s\n", which, what);
    exit(1);
}

static double *new_array(size_t count) {
    double *values = (double *)calloc(count + 1, sizeof *values);
    if (!values)
        stop("no memory is left", "timing");
    return values;
}

static double *read_row(FILE *file, int n, const char *path) {
    double *row = new_array((size_t)n);
    for (int i = 0; i < n; i++)
        if (fscanf(file, "%lf", &row[i]) != 1)
            stop("too few numbers", path);
    return row;
}

static struct bench open_bench(const char *program, int argc, char **argv) {
    struct bench b = {program, 0, 0, 0, NULL, NULL, NULL, NULL};
    char path[PATH_SIZE];
    if (argc < 3 || (strcmp(argv[1], "values") && strcmp(argv[1], "times")))
        stop("usage: (values | times) N_RFE ...", argv[0]);
    b.only_values = !strcmp(argv[1], "values");
    b.n_rfe = atoi(argv[2]);
    b.n = 3 * b.n_rfe + 1;
    snprintf(path, sizeof path, "models/state%d.txt", b.n_rfe);
    FILE *file = fopen(path, "r");
    if (!file)
        stop("no such file", path);
    b.q = read_row(file, b.n, path);
    b.qd = read_row(file, b.n, path);
    b.tau = read_row(file, b.n, path);
    b.qdd = read_row(file, b.n, path);
    fclose(file);
    return b;
}

/* CPU time of this thread: what other processes do delays it less than it delays the clock on the wall. */
static double cpu_seconds(bench_call *call, void *subject, long times) {
    struct timespec from, to;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &from);
    call(subject, times);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &to);
    return (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
}

/* The shortest of many batches of about 1 ms, most of which no other process interrupts. */
static double microseconds(bench_call *call, void *subject) {
    long times = 1;
    double passed = cpu_seconds(call, subject, times);
    while (passed < 5e-4) {
        times = passed < 1e-5 ? times * 10 : (long)((double)times * 1e-3 / passed) + 1;
        passed = cpu_seconds(call, subject, times);
    }
    double shortest = passed;
    for (int i = 0; i < BATCHES; i++) {
        passed = cpu_seconds(call, subject, times);
        if (passed < shortest)
            shortest = passed;
    }
    return 1e6 * shortest / (double)times;
}

static void write_values(const struct bench *b, const char *quantity, const char *variant,
                         const struct bench_result *results) {
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "values/%s-%s-%s-%d", b->program, quantity, variant, b->n_rfe);
    FILE *file = fopen(path, "wb");
    if (!file)
        stop("cannot be written", path);
    for (; results->values; results++)
        fwrite(results->values, sizeof(double), results->count, file);
    if (fclose(file))
        stop("cannot be written", path);
}

static void measure(const struct bench *b, const char *quantity, const char *variant, bench_call *call,
                    void *subject, const struct bench_result *results) {
    call(subject, 1);
    if (b->only_values) {
        write_values(b, quantity, variant, results);
        return;
    }
    printf("{\"program\": \"%s\", \"quantity\": \"%s\", \"variant\": \"%s\", \"n_rfe\": %d, \"n\": %d, "
           "\"us\": %.4f}\n",
           b->program, quantity, variant, b->n_rfe, b->n, microseconds(call, subject));
    fflush(stdout);
}

#endif
