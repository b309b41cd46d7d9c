/*
 * Derivatives by differences of free motions, where those of copies that repeat steps do not exist: a slight
 * change of a value reorders events, or the motion starts exactly on a kink.
 *
 * In: a motion with its outputs and derivatives, which of the derivatives are missing, and from which time
 * on. Out: central differences in their place. Free motions are separate motions that choose their own steps.
 * Their differences have an error of about the tolerance divided by the change. This is too much for standard
 * errors, but not for the direction of a step. Cases do not depend on threads or lanes, so that the search is
 * the same in each run.
 */
#include <math.h>
#include <stdlib.h>

#include "runtime/tool/motions/fit/fit.h"

/* The two motions of each variable that lacks derivatives. */
struct free_motions {
    struct fit *fit;
    fit_writer *write;
    size_t size;      /* of the values of a motion */
    double *values;   /* (cases x size) */
    bool *has_failed; /* (cases) */
};

static int see(void *context, const struct refdyn_batch_case *one, int number) {
    const struct free_motions *motions = context;
    motions->write(motions->fit, one,
                   motions->values + (size_t)one->number * motions->size +
                       (size_t)number * (size_t)motions->fit->signal_count);
    return 0;
}

static int end(void *context, const struct refdyn_batch_case *one, const struct refdyn_batch_result *result) {
    const struct free_motions *motions = context;
    motions->has_failed[one->number] = result->status != REFDYN_OK;
    return 0;
}

/* The values of each case: those of the motion, with one lost variable increased or decreased. */
static void set_columns(const struct refdyn_batch *batch, const int *lost, int count, const double *changes,
                        struct refdyn_batch *free_batch) {
    struct refdyn_batch_column *columns =
        memory_scratch(&format_memory, ((size_t)batch->column_count + 1) * sizeof *columns);
    for (int k = 0; k < batch->column_count; k++) {
        double *values = memory_scratch(&format_memory, 2 * (size_t)count * sizeof *values);
        for (int i = 0; i < 2 * count; i++)
            values[i] = batch->columns[k].values[0] +
                        (k == lost[i / 2] ? (i % 2 == 0 ? changes[k] : -changes[k]) : 0);
        columns[k] = batch->columns[k];
        columns[k].values = values;
    }
    free_batch->columns = columns;
    free_batch->count = 2 * count;
}

/* The first output without a derivative. */
static int first_lost(const struct refdyn_batch *batch, const struct refdyn_underivable *found) {
    int row = 0;
    while (!found->is_at_start && row <= batch->time_count &&
           (row == 0 ? batch->t : batch->times[row - 1]) < found->t)
        row++;
    return row;
}

/* Writes differences of the two motions from output `row` on. If one of them has failed, the motion itself
 * takes its place. */
static void write_differences(const struct free_motions *motions, const struct refdyn_batch *batch,
                              int number, int row, double change, const double *at, double *derivatives) {
    const size_t width = (size_t)motions->fit->signal_count, count = ((size_t)batch->time_count + 1) * width;
    const bool *has_failed = motions->has_failed + 2 * number;
    const double *a = motions->values + 2 * (size_t)number * motions->size, *b = a + motions->size;
    const double *high = has_failed[0] ? at : a, *low = has_failed[1] ? at : b,
                 apart = change * (2 - has_failed[0] - has_failed[1]);
    for (size_t i = (size_t)row * width; i < count && apart > 0; i++)
        derivatives[i] = (high[i] - low[i]) / apart;
}

void fit_free_derivatives(struct fit *fit, const struct refdyn_batch *batch, fit_writer *write,
                          const struct refdyn_underivable *underivable, const double *changes,
                          const double *at, double *derivatives, size_t size) {
    struct free_motions motions = {.fit = fit, .write = write, .size = size};
    struct refdyn_batch free_batch = *batch;
    int *lost = memory_scratch(&format_memory, ((size_t)fit->variables.count + 1) * sizeof *lost), count = 0;
    for (int k = 0; k < fit->variables.count; k++)
        if (underivable[k].status)
            lost[count++] = k;
    if (count == 0)
        return;
    set_columns(batch, lost, count, changes, &free_batch);
    motions.values = format_allocate_large(2 * (size_t)count * size, sizeof *motions.values);
    motions.has_failed = memory_scratch(&format_memory, 2 * (size_t)count * sizeof *motions.has_failed);
    free_batch.context = &motions;
    free_batch.output = see;
    free_batch.end = end;
    const int status = refdyn_batch_run(&free_batch, NULL);
    fit->motions += 2 * count;
    for (int i = 0; i < count && status == REFDYN_OK; i++)
        write_differences(&motions, batch, i, first_lost(batch, &underivable[lost[i]]), changes[lost[i]], at,
                          derivatives + (size_t)lost[i] * size);
    free(motions.values);
}
