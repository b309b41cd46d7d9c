/*
 * Samples of inputs over time, held from each to the next: see refdyn_batch.h.
 */
#include "refdyn_batch.h"

#include <math.h>

static const double *row_of(const struct refdyn_samples *samples, int number) {
    return samples->rows + (long)number * (samples->width + 1);
}

/* The number of samples at or before t, by halving. */
static int count_until(const struct refdyn_samples *samples, double t) {
    int low = 0, high = samples->count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (*row_of(samples, middle) <= t)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

double refdyn_samples_set(const struct refdyn_samples *samples, double t, double *x) {
    const int past = count_until(samples, t);
    const int next = past > 0 ? past : 1; /* the first value holds before it, too: nothing changes there */
    const double *row = row_of(samples, next - 1);
    for (int i = 0; i < samples->width; i++)
        x[samples->place[i]] = row[1 + i];
    return next < samples->count ? *row_of(samples, next) : INFINITY;
}
