/*
 * Times a function of a library that `refdyn compile --for-lanes` has left, for tests/bench/python.
 *
 * Arguments: library, model's name, width of lanes, count of states. Reads the prepared parameters (their
 * count first), then q and qd of each state, as doubles from stdin; prints, for each of the rounds that stdin
 * asks for by a byte each, the nanoseconds of a call of qdd at the first state, and those of a state by lanes
 * over all states, which stand side by side in memory already.
 */
#include "refdyn_lanes.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CALLS = 20000, TURNS = 10 };

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double *doubles(size_t count) {
    double *data = aligned_alloc(64, (count * sizeof *data + 127) / 64 * 64);
    if (!data)
        exit(1);
    return data;
}

static void read_doubles(double *data, size_t count) {
    if (fread(data, sizeof *data, count, stdin) != count)
        exit(1);
}

/* Rows of `size` entries to groups of `width` rows side by side. */
static double *interleaved(const double *rows, size_t count, size_t size, size_t width) {
    double *lanes = doubles(count * size);
    for (size_t row = 0; row < count; row++)
        for (size_t i = 0; i < size; i++)
            lanes[row / width * width * size + i * width + row % width] = rows[row * size + i];
    return lanes;
}

int main(int argc, char **argv) {
    char symbol[300];
    if (argc != 5)
        return 2;
    const size_t width = strtoul(argv[3], NULL, 10), count = strtoul(argv[4], NULL, 10);
    void *library = dlopen(argv[1], RTLD_NOW);
    snprintf(symbol, sizeof symbol, "%s_lanes_%zu", argv[2], width);
    const struct refdyn_lane_model *lanes = library ? dlsym(library, symbol) : NULL;
    if (!lanes || count % width)
        return 1;
    const struct refdyn_model *model = lanes->model;
    const size_t n = (size_t)model->n, p_count = (size_t)(model->parameter_count + model->derived_count);
    double *p = doubles(p_count), *p_lanes = doubles(p_count * width), *t = doubles(width);
    double *q = doubles(n * count), *qd = doubles(n * count), *out = doubles(n * count);
    read_doubles(p, p_count);
    read_doubles(q, n * count);
    read_doubles(qd, n * count);
    for (size_t i = 0; i < p_count * width; i++)
        p_lanes[i] = p[i / width];
    const double *q_lanes = interleaved(q, count, n, width), *qd_lanes = interleaved(qd, count, n, width);
    memset(t, 0, width * sizeof *t);
    while (getchar() != EOF) {
        double start = seconds();
        for (int i = 0; i < CALLS; i++)
            model->qdd(p, NULL, 0, q, qd, out);
        const double one = (seconds() - start) / CALLS;
        start = seconds();
        for (int i = 0; i < TURNS; i++)
            for (size_t first = 0; first < count; first += width)
                lanes->qdd(p_lanes, NULL, t, q_lanes + first * n, qd_lanes + first * n, out + first * n);
        const double by_lanes = (seconds() - start) / (TURNS * (double)count);
        printf("%.4g %.4g\n", 1e9 * one, 1e9 * by_lanes);
        fflush(stdout);
    }
    return 0;
}
