/*
 * The cases of a sweep: each point of its grids and lists, and for each the draws of its random columns.
 *
 * The first name varies slowest, then the others in the order of their names, then the draws. A random number
 * is a function of the seed, the column's name and the case's number alone: neither the order of work nor
 * another column changes it. It is also the same to the bit on each machine, since it needs only additions,
 * multiplications, divisions and square roots of IEEE numbers and no functions of libm.
 *
 * A quasi-random sequence fills a cube more evenly than random points. It is the same at each point of the
 * grids. Its dimensions are the random columns in the order of their names, and a seed shifts it (modulo 1,
 * Cranley and Patterson).
 */
#include <math.h>
#include <stdlib.h>

#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/random/random.h"

/* ---- Lists and grids ---- */

/* Point `index` of a grid, whose ends are exact. */
static double grid_point(const struct vary *vary, long index) {
    const double last = vary->count - 1;
    if (index == 0 || (double)index == last)
        return index == 0 ? vary->from : vary->to;
    const double part = (double)index / last;
    if (vary->form == VARY_GRID)
        return vary->from + (vary->to - vary->from) * part;
    const double begin = random_log(vary->from), end = random_log(vary->to);
    return random_exp(begin + (end - begin) * part);
}

/* Each value is repeated for `stride` cases. */
static void fill_listed(const struct vary *vary, long stride, long case_count, double *values) {
    const long count = (long)vary->count;
    for (long i = 0; i < case_count; i++)
        values[i] = i % stride > 0            ? values[i - 1]
                    : i >= stride * count     ? values[i - stride * count]
                    : vary->form == VARY_LIST ? vary->list.values[i / stride]
                                              : grid_point(vary, i / stride);
}

/* ---- Draws ---- */

/* The value below which a fraction u of the distribution lies. */
static double quantile(const struct vary *vary, double u) {
    if (vary->form == VARY_NORMAL)
        return vary->from + vary->to * random_normal_quantile(u);
    if (vary->form == VARY_UNIFORM)
        return vary->from + (vary->to - vary->from) * u;
    const double begin = random_log(vary->from), end = random_log(vary->to);
    return random_exp(begin + (end - begin) * u);
}

static void fill_random(const struct sweep_file *file, const struct vary *vary, long case_count,
                        double *values) {
    const uint64_t stream = random_stream(vary->name);
    for (long i = 0; i < case_count; i++)
        values[i] = quantile(vary, random_uniform((uint64_t)file->seed, stream, (uint64_t)i));
}

/* Fills a column from one coordinate of the points, which are `width` apart in memory. */
static void fill_sequence(const struct sweep_file *file, const struct vary *vary, const double *points,
                          int width, long case_count, double *values) {
    const double least = 0x1p-54; /* the normal distribution has no quantile at 0 */
    const long draws = (long)file->draws;
    const double shift =
        file->has_seed ? random_uniform((uint64_t)file->seed, random_stream(vary->name), 0) : 0;
    for (long i = 0; i < draws; i++) {
        double u = points[i * width] + shift;
        u -= floor(u);
        values[i] = quantile(vary, u > least ? u : least);
    }
    for (long i = draws; i < case_count; i++)
        values[i] = values[i - draws];
}

static int random_count(const struct sweep_file *file) {
    int count = 0;
    for (int i = 0; i < file->vary_count; i++)
        count += sweeps_is_random(&file->varies[i]);
    return count;
}

/* Points for all random columns; NULL without a sequence. */
static double *sequence_points(const struct sweep_file *file, int width) {
    if (file->sequence == SEQUENCE_RANDOM)
        return NULL;
    double *points = format_allocate_large((size_t)file->draws * (size_t)width, sizeof *points);
    if (file->sequence == SEQUENCE_SOBOL)
        random_sobol(width, (long)file->draws, points);
    else
        random_halton(width, 1, (long)file->draws, points);
    return points;
}

static void fill_drawn(const struct sweep_file *file, struct case_table *cases) {
    const int width = random_count(file);
    double *points = sequence_points(file, width);
    for (int i = 0, column = 0; i < file->vary_count; i++) {
        const struct vary *vary = &file->varies[i];
        if (!sweeps_is_random(vary))
            continue;
        if (points)
            fill_sequence(file, vary, points + column, width, cases->count, cases->columns[i].values);
        else
            fill_random(file, vary, cases->count, cases->columns[i].values);
        column++;
    }
    free(points);
}

/* ---- All cases ---- */

static struct case_column column_of(const struct vary *vary, struct memory *memory, long case_count) {
    struct case_column column = {.name = memory_text(memory, vary->name), .place = vary->place};
    column.values = memory_get(memory, (size_t)case_count * sizeof *column.values);
    if (vary->form != VARY_LIST)
        return column;
    column.kind = vary->list.kind;
    column.text_count = column.kind == CASES_TEXTS ? vary->list.text_count : 0;
    column.texts = memory_get(memory, ((size_t)column.text_count + 1) * sizeof *column.texts);
    for (int i = 0; i < column.text_count; i++)
        column.texts[i] = memory_text(memory, vary->list.texts[i]);
    return column;
}

void sweeps_expand_cases(const struct sweep_file *file, struct memory *memory, struct case_table *cases) {
    *cases = (struct case_table){.count = (long)sweeps_file_case_count(file), .width = file->vary_count};
    cases->columns = memory_get(memory, ((size_t)cases->width + 1) * sizeof *cases->columns);
    long stride = (long)file->draws;
    for (int i = file->vary_count - 1; i >= 0; i--) {
        const struct vary *vary = &file->varies[i];
        cases->columns[i] = column_of(vary, memory, cases->count);
        if (sweeps_is_random(vary))
            continue;
        fill_listed(vary, stride, cases->count, cases->columns[i].values);
        stride *= (long)vary->count;
    }
    if (random_count(file) > 0)
        fill_drawn(file, cases);
}
