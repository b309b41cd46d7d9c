/*
 * Residuals of the motions, (y_model - y_data)/sigma at each datum, and their derivatives by the unknowns.
 *
 * In: the unknowns. The motion of each file starts at the start of the model, with the inputs of that file;
 * its columns are taken at the times of the data. Out: residuals file by file, row by row, column by column; gaps have none.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"
#include "runtime/tool/support/system/system.h"

/* ---- Counts ---- */

int fit_rows_until(const struct fit_data *data, double until) {
    int low = 0, high = data->rows;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (data->t[middle] <= until)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static const double *row_of(const struct fit *fit, const struct fit_data *data, int row) {
    return data->y + (size_t)row * (size_t)fit->signal_count;
}

static int count_in(const struct fit *fit, const struct fit_data *data, int rows) {
    int count = 0;
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < fit->signal_count; k++)
            count += !isnan(row_of(fit, data, i)[k]);
    return count;
}

int fit_residual_count(const struct fit *fit, bool is_held_out, double until) {
    int count = 0;
    for (int i = 0; i < fit->data_count; i++)
        if (fit->data[i].is_held_out == is_held_out)
            count += count_in(fit, &fit->data[i], fit_rows_until(&fit->data[i], until));
    return count;
}

/* ---- A motion ---- */

/* The batch of one file: a column for each value, and one for the samples of its inputs. */
struct file_batch {
    struct refdyn_batch batch;
    struct refdyn_batch_column *columns;
    double *values; /* (fit->count + 1) x cases */
    int first;      /* output of the first row: 0 if it is at the start of the motion */
};

/* Describes the motions of `cases` candidates; `unknowns` (cases x values). */
static void describe(const struct fit *fit, const struct fit_data *data, int rows, const double *unknowns,
                     int cases, struct file_batch *file) {
    const int count = fit->count;
    file->batch = fit->batch;
    file->columns = memory_scratch(&format_memory, ((size_t)count + 1) * sizeof *file->columns);
    file->values = memory_scratch(&format_memory, ((size_t)count + 1) * (size_t)cases * sizeof *file->values);
    for (int k = 0; k < count; k++) {
        double *values = file->values + (size_t)k * (size_t)cases;
        for (int i = 0; i < cases; i++)
            values[i] = fit_value_of(&fit->values[k], unknowns[i * count + k]);
        file->columns[k] =
            (struct refdyn_batch_column){fit->values[k].variable.what, fit->values[k].variable.place, values};
    }
    file->columns[count] =
        (struct refdyn_batch_column){REFDYN_VARIED_SAMPLES, 0, file->values + (size_t)count * (size_t)cases};
    file->first = data->t[0] > fit->batch.t;
    file->batch.column_count = count + data->has_inputs;
    file->batch.columns = file->columns;
    file->batch.samples = data->has_inputs ? &data->inputs.samples : NULL;
    file->batch.sample_count = data->has_inputs;
    file->batch.times = data->t + !file->first;
    file->batch.time_count = rows - !file->first;
}

static void write_signals(void *context, const struct refdyn_batch_case *one, double *values) {
    const struct fit *fit = context;
    struct record_table *table = &fit->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill(table);
    for (int k = 0; k < fit->signal_count; k++)
        values[k] = table->values[fit->signals[k].column];
}

/* The values (outputs x signals) of a motion, and their derivatives, NULL if not needed. */
static enum fit_outcome run_motion(struct fit *fit, const struct file_batch *file, double *at,
                                   double *derivatives) {
    struct refdyn_underivable *underivable =
        memory_scratch(&format_memory, ((size_t)fit->count + 1) * sizeof *underivable);
    struct refdyn_derivatives given = {.batch = &file->batch,
                                       .count = derivatives ? fit->count : 0,
                                       .variables = fit->variables.variables,
                                       .width = fit->signal_count,
                                       .values = write_signals,
                                       .context = fit,
                                       .at = at,
                                       .derivatives = derivatives,
                                       .underivable = underivable};
    if (system_interrupted)
        return FIT_STOPPED;
    const int status = refdyn_derivatives_run(&given);
    fit->motions += 1 + given.copies;
    fit->end_status = status ? status : given.motion.status;
    fit->end_t = given.motion.t;
    return status || given.outputs < file->batch.time_count + 1 ? FIT_FAILED : FIT_DONE;
}

/* ---- Residuals ---- */

struct entry {
    double *r, *J; /* the next residual, and its derivative by the first unknown */
    size_t apart;  /* of derivatives by the next unknown */
};

static void add_residuals(struct fit *fit, const struct fit_data *data, int rows, int first,
                          const double *unknowns, const double *at, const double *derivatives,
                          struct entry *place) {
    const size_t width = (size_t)fit->signal_count, size = (size_t)(rows - !first + 2) * width;
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < fit->signal_count; k++) {
            const double y = row_of(fit, data, i)[k], noise = fit->signals[k].noise;
            const size_t from = (size_t)(i + first) * width + (size_t)k;
            if (isnan(y))
                continue;
            *place->r++ = (at[from] - y) / noise;
            for (int j = 0; derivatives && j < fit->count; j++) {
                const struct fit_value *value = &fit->values[j];
                const double by = value->is_log ? fit_value_of(value, unknowns[j]) : value->unit,
                             slope = derivatives[(size_t)j * size + from];
                fit->lost += isnan(slope);
                place->J[(size_t)j * place->apart] = isnan(slope) ? 0 : slope * by / noise;
            }
            place->J += derivatives ? 1 : 0;
        }
}

static enum fit_outcome residuals_of(struct fit *fit, const struct fit_data *data, double until,
                                     const double *unknowns, struct entry *place) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const int rows = fit_rows_until(data, until);
    struct file_batch file;
    if (rows < 2)
        return FIT_DONE;
    describe(fit, data, rows, unknowns, 1, &file);
    const size_t size = (size_t)(file.batch.time_count + 2) * (size_t)fit->signal_count;
    double *at = format_allocate_large(size, sizeof *at),
           *derivatives =
               place->J ? format_allocate_large(size * (size_t)fit->count, sizeof *derivatives) : NULL;
    const enum fit_outcome outcome = run_motion(fit, &file, at, derivatives);
    if (outcome == FIT_DONE)
        add_residuals(fit, data, rows, file.first, unknowns, at, derivatives, place);
    free(at);
    free(derivatives);
    memory_back(&format_memory, mark);
    return outcome;
}

enum fit_outcome fit_residuals(struct fit *fit, bool is_held_out, double until, const double *unknowns,
                               double *r, double *J, size_t apart) {
    struct entry place = {r, J, apart};
    enum fit_outcome outcome = FIT_DONE;
    fit->lost = 0;
    for (int i = 0; i < fit->data_count && outcome == FIT_DONE; i++)
        if (fit->data[i].is_held_out == is_held_out)
            outcome = residuals_of(fit, &fit->data[i], until, unknowns, &place);
    return outcome;
}

enum fit_outcome fit_motion_values(struct fit *fit, const struct fit_data *data, const double *unknowns,
                                   double *values) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct file_batch file;
    describe(fit, data, data->rows, unknowns, 1, &file);
    const size_t width = (size_t)fit->signal_count, size = (size_t)(file.batch.time_count + 2) * width;
    double *at = format_allocate_large(size, sizeof *at);
    const enum fit_outcome outcome = run_motion(fit, &file, at, NULL);
    memcpy(values, at + (size_t)file.first * width, (size_t)data->rows * width * sizeof *values);
    free(at);
    memory_back(&format_memory, mark);
    return outcome;
}

/* ---- Candidates ---- */

struct candidates {
    struct fit *fit;
    const struct fit_data *data;
    int first, rows;
    double *chi2;   /* by number of the case: of this file */
    double *values; /* (rooms x signals) */
};

static int see_candidate(void *context, const struct refdyn_batch_case *one, int number) {
    struct candidates *candidates = context;
    const struct fit *fit = candidates->fit;
    const int row = number - candidates->first;
    double *values = candidates->values + one->room * fit->signal_count;
    if (row < 0 || row >= candidates->rows)
        return 0;
    write_signals(candidates->fit, one, values);
    for (int k = 0; k < fit->signal_count; k++) {
        const double y = row_of(fit, candidates->data, row)[k],
                     r = isnan(y) ? 0 : (values[k] - y) / fit->signals[k].noise;
        candidates->chi2[one->number] += r * r;
    }
    return 0;
}

static int end_candidate(void *context, const struct refdyn_batch_case *one,
                         const struct refdyn_batch_result *result) {
    struct candidates *candidates = context;
    if (result->status)
        candidates->chi2[one->number] = INFINITY;
    return 0;
}

static int is_stopped(void *context) {
    (void)context;
    return system_interrupted != 0;
}

enum fit_outcome fit_try_candidates(struct fit *fit, double until, const double *unknowns, int count,
                                    double *chi2) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct candidates candidates = {.fit = fit, .chi2 = chi2};
    candidates.values = memory_scratch(&format_memory, (size_t)(fit->batch.threads * fit->rooms_of_thread) *
                                                           (size_t)fit->signal_count * sizeof(double));
    memset(chi2, 0, (size_t)count * sizeof *chi2);
    for (int i = 0; i < fit->data_count && !system_interrupted; i++) {
        struct file_batch file;
        candidates.data = &fit->data[i];
        candidates.rows = fit_rows_until(candidates.data, until);
        if (candidates.data->is_held_out || candidates.rows < 2)
            continue;
        describe(fit, candidates.data, candidates.rows, unknowns, count, &file);
        candidates.first = file.first;
        file.batch.count = count;
        file.batch.context = &candidates;
        file.batch.output = see_candidate;
        file.batch.end = end_candidate;
        file.batch.stop = is_stopped;
        if (refdyn_batch_run(&file.batch, NULL) != REFDYN_OK)
            for (int k = 0; k < count; k++)
                chi2[k] = INFINITY;
        fit->motions += count;
    }
    memory_back(&format_memory, mark);
    return system_interrupted ? FIT_STOPPED : FIT_DONE;
}
