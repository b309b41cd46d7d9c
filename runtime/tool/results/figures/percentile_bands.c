/* Percentiles of a history over time: see figures.h. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PERCENTILES = 5, MEDIAN = 2, BANDS = 2, NUMBERS_MOST = 1 << 22 /* of all cases, held at a time */ };

static const double parts[PERCENTILES] = {0.05, 0.25, 0.5, 0.75, 0.95};
static const char *const names[BANDS] = {"5 to 95 %", "25 to 75 %"};

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Between neighbours in order, as numpy's default; NaN of none. */
static double percentile(const double *sorted, long count, double part) {
    const double at = part * (double)(count - 1);
    const long below = (long)at;
    if (count == 0)
        return NAN;
    if (below + 1 >= count)
        return sorted[count - 1];
    return sorted[below] + (at - (double)below) * (sorted[below + 1] - sorted[below]);
}

/* Of one time: value `k` of `stride` of each case. Those that are no numbers take no part. */
static void find_percentiles(const double *values, long cases, int stride, int k, double *sorted,
                             double found[static PERCENTILES]) {
    long count = 0;
    for (long row = 0; row < cases; row++)
        if (runs_charts_can_draw(values[row * stride + k]))
            sorted[count++] = values[row * stride + k];
    qsort(sorted, (size_t)count, sizeof *sorted, compare);
    for (int i = 0; i < PERCENTILES; i++)
        found[i] = percentile(sorted, count, parts[i]);
}

/* Courses (PERCENTILES x size), by as many times at once as there is room for. */
static bool fill(struct runs_charts *figure, const struct kept_item *item, double *courses) {
    const long cases = hdf5_runs_count(figure->reader);
    const int most = cases > 0 && NUMBERS_MOST / cases > 1 ? (int)(NUMBERS_MOST / cases) : 1;
    double *sorted = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof *sorted);
    for (int first = 0; first < item->size; first += most) {
        const int count = item->size - first < most ? item->size - first : most;
        struct runs_charts part = {.reader = figure->reader, .memory = arena_start()};
        const double *values = runs_charts_read(&part, item, first, count);
        for (int k = 0; k < count && values; k++) {
            double found[PERCENTILES];
            find_percentiles(values, cases, count, k, sorted, found);
            for (int i = 0; i < PERCENTILES; i++)
                courses[i * item->size + first + k] = found[i];
        }
        memory_release(&part.memory);
        if (!values)
            return false;
    }
    return true;
}

static const struct kept_axis *find_axis(const struct runs_layout *layout, const char *path) {
    for (int i = 0; i < layout->axis_count; i++)
        if (path && strcmp(layout->axes[i].path, path) == 0)
            return &layout->axes[i];
    return NULL;
}

/* Times at which there is a value, moved to the front, with their values; returns how many. */
static long keep_finite(double *x, double *courses, int size) {
    long kept = 0;
    for (int i = 0; i < size; i++) {
        if (!isfinite(courses[MEDIAN * size + i]))
            continue;
        x[kept] = x[i];
        for (int k = 0; k < PERCENTILES; k++)
            courses[k * size + kept] = courses[k * size + i];
        kept++;
    }
    return kept;
}

static void add_key(struct chart *chart, const char *name, struct stroke stroke) {
    const int key = chart_key(chart, name, strlen(name)); /* the list of keys may move */
    chart->keys[key].stroke = stroke;
}

static void add_courses(struct chart *chart, const double *x, const double *courses, int size, long count) {
    for (int i = 0; i < BANDS; i++) {
        const struct stroke stroke = style_band(i);
        chart_add_band(chart, (struct band){.x = x,
                                            .low = courses + i * size,
                                            .high = courses + (PERCENTILES - 1 - i) * size,
                                            .count = count,
                                            .colour = stroke.colour});
        add_key(chart, names[i], stroke);
    }
    const struct stroke median = style_quantity(0, 1, 0, 1);
    chart_add_curve(chart, (struct curve){.x = x,
                                          .y = courses + MEDIAN * size,
                                          .count = count,
                                          .stride = 1,
                                          .stroke = median,
                                          .key = BANDS});
    add_key(chart, "median", median);
}

bool figures_bands_add(struct runs_charts *figure, const struct kept_item *item) {
    const struct kept_axis *axis = find_axis(hdf5_runs_layout(figure->reader), item->axis);
    const size_t size = (size_t)item->size;
    double *x = memory_get(&figure->memory, (size + 1) * sizeof *x);
    double *courses = memory_get(&figure->memory, (PERCENTILES * size + 1) * sizeof *courses);
    for (int i = 0; i < item->size; i++)
        x[i] = axis && axis->values ? axis->values[i] : i;
    if (!fill(figure, item, courses))
        return false;
    const long count = keep_finite(x, courses, item->size);
    if (count < 2)
        return true;
    struct chart *chart = &figure->charts[figure->chart_count++];
    *chart = (struct chart){.title = text_format("%s over time, percentiles of the cases", item->name),
                            .x_label = runs_charts_label("", "t", axis ? axis->unit : NULL),
                            .y_label = runs_charts_label("", item->name, item->unit)};
    add_courses(chart, x, courses, item->size, count);
    return true;
}
