/*
 * Residuals of the motions, (y_model - y_data)/sigma at each datum, and their derivatives by the unknowns.
 *
 * In: the unknowns. The motion of each file begins at its start, with the inputs of that file. Its columns
 * are compared at the times of the data less the delays of their sensors. Before the start, the value of the
 * start holds. Out: residuals file by file, row by row, column by column; gaps have none.
 *
 * If the delay of a column is unknown, the motion has outputs at t - delay - e and t - delay + e. Their mean
 * is y, and their difference is 2 e dy/dt. The derivative by the delay is -dy/dt.
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

int fit_file_residual_count(const struct fit *fit, const struct fit_data *data, double until) {
    const int rows = fit_rows_until(data, until);
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
            count += fit_file_residual_count(fit, &fit->data[i], until);
    return count;
}

/* ---- Times of outputs ---- */

/* The e of an unknown delay, as part of the mean time between rows: e^2 y'' is then below the noise. */
static const double shift_part = 1e-4;
/* Times closer than this part share an output. */
static const double same_part = 1e-9;

/* The outputs at which columns are compared. Number 0 is the start, number i the time times[i - 1]. */
struct outputs {
    double begin;
    double *times; /* (count) ascending, after the start */
    int count, rows;
    double *shifts; /* (shift_count) each different delay */
    int shift_count;
    int *low,
        *high;    /* (signals) shifts of each column: of t - delay - e and t - delay + e, or both t - delay */
    int *numbers; /* (shift_count x rows) */
};

static int add_shift(struct outputs *outputs, double shift) {
    int i = 0;
    while (i < outputs->shift_count && outputs->shifts[i] != shift)
        i++;
    outputs->shifts[i] = shift;
    outputs->shift_count += i == outputs->shift_count;
    return i;
}

/* All rows at all shifts: sorted, each time once. */
static void merge_times(const struct fit_data *data, double same, struct outputs *outputs) {
    int count = 0, kept = 0;
    for (int s = 0; s < outputs->shift_count; s++)
        for (int i = 0; i < outputs->rows; i++)
            if (data->t[i] - outputs->shifts[s] > outputs->begin + same)
                outputs->times[count++] = data->t[i] - outputs->shifts[s];
    if (outputs->shift_count > 1)
        qsort(outputs->times, (size_t)count, sizeof *outputs->times, format_ascending);
    for (int i = 0; i < count; i++)
        if (kept == 0 || outputs->times[i] - outputs->times[kept - 1] > same)
            outputs->times[kept++] = outputs->times[i];
    if (kept == 0) /* all rows show the start */
        outputs->times[kept++] = outputs->begin + data->t[data->rows - 1] - data->t[0];
    outputs->count = kept;
}

static void number_rows(const struct fit_data *data, double same, struct outputs *outputs) {
    for (int s = 0; s < outputs->shift_count; s++)
        for (int i = 0, at = 0; i < outputs->rows; i++) {
            const double t = data->t[i] - outputs->shifts[s];
            while (at < outputs->count && outputs->times[at] < t - same)
                at++;
            outputs->numbers[s * outputs->rows + i] = t > outputs->begin + same ? at + 1 : 0;
        }
}

/* `has_slopes`: unknown delays have the two times of their derivatives. */
static void choose_outputs(const struct fit *fit, const struct fit_data *data, int rows,
                           const double *unknowns, bool has_slopes, struct outputs *outputs) {
    const size_t width = (size_t)fit->signal_count;
    const double spacing = (data->t[data->rows - 1] - data->t[0]) / (data->rows - 1);
    *outputs = (struct outputs){.begin = fit->batch.t, .rows = rows};
    outputs->shifts = memory_scratch(&format_memory, 2 * width * sizeof *outputs->shifts);
    outputs->low = memory_scratch(&format_memory, width * sizeof *outputs->low);
    outputs->high = memory_scratch(&format_memory, width * sizeof *outputs->high);
    for (int k = 0; k < fit->signal_count; k++) {
        const double delay = fit_sensor_of(fit, k, unknowns).is[FIT_DELAY];
        const double e = has_slopes && fit->signals[k].value[FIT_DELAY] >= 0 ? shift_part * spacing : 0;
        outputs->low[k] = add_shift(outputs, delay + e);
        outputs->high[k] = add_shift(outputs, delay - e);
    }
    const size_t size = (size_t)outputs->shift_count * (size_t)rows;
    outputs->times = memory_scratch(&format_memory, (size + 1) * sizeof *outputs->times);
    outputs->numbers = memory_scratch(&format_memory, size * sizeof *outputs->numbers);
    merge_times(data, same_part * spacing, outputs);
    number_rows(data, same_part * spacing, outputs);
}

static double time_of(const struct outputs *outputs, int number) {
    return number > 0 ? outputs->times[number - 1] : outputs->begin;
}

/* Numbers of the two outputs of a datum; they are equal unless the delay is unknown. */
struct pair {
    size_t low, high;
};

static struct pair pair_of(const struct outputs *outputs, int row, int signal) {
    return (struct pair){(size_t)outputs->numbers[outputs->low[signal] * outputs->rows + row],
                         (size_t)outputs->numbers[outputs->high[signal] * outputs->rows + row]};
}

/* ---- A motion ---- */

/* The batch of one file: a column for each variable, and one for the samples of its inputs. */
struct file_batch {
    struct refdyn_batch batch;
    struct refdyn_batch_column *columns;
    double *values; /* (fit->variables.count + 1) x cases */
    struct outputs outputs;
};

/* The value that is variable `column` of the motion of a file: the first values are those of the model. */
static int value_of_variable(const struct fit *fit, const struct fit_data *data, int column) {
    const int of_model = fit->request.value_count;
    return column < of_model ? column : data->first_start + column - of_model;
}

/* Describes the motions of `cases` candidates; `unknowns` (cases x values). Several candidates must have the
 * same delays. */
static void describe(const struct fit *fit, const struct fit_data *data, int rows, const double *unknowns,
                     int cases, struct file_batch *file) {
    const int count = fit->variables.count;
    choose_outputs(fit, data, rows, unknowns, cases == 1, &file->outputs);
    file->batch = fit->batch;
    file->columns = memory_scratch(&format_memory, ((size_t)count + 1) * sizeof *file->columns);
    file->values = memory_scratch(&format_memory, ((size_t)count + 1) * (size_t)cases * sizeof *file->values);
    for (int k = 0; k < count; k++) {
        double *values = file->values + (size_t)k * (size_t)cases;
        const int number = value_of_variable(fit, data, k);
        const struct fit_value *value = &fit->values[number];
        for (int i = 0; i < cases; i++)
            values[i] = fit_value_of(value, unknowns[i * fit->count + number]);
        file->columns[k] = (struct refdyn_batch_column){value->variable.what, value->variable.place, values};
    }
    file->columns[count] =
        (struct refdyn_batch_column){REFDYN_VARIED_SAMPLES, 0, file->values + (size_t)count * (size_t)cases};
    file->batch.column_count = count + data->has_inputs;
    file->batch.columns = file->columns;
    file->batch.samples = data->has_inputs ? &data->inputs.samples : NULL;
    file->batch.sample_count = data->has_inputs;
    file->batch.times = file->outputs.times;
    file->batch.time_count = file->outputs.count;
}

int fit_is_stopped(void *context) {
    (void)context;
    return system_interrupted != 0;
}

static void write_signals(void *context, const struct refdyn_batch_case *one, double *values) {
    const struct fit *fit = context;
    struct record_table *table = &fit->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill_row(table);
    for (int k = 0; k < fit->signal_count; k++)
        values[k] = table->values[fit->signals[k].column];
}

/* Writes coordinates, rates and signals. */
static void write_all(void *context, const struct refdyn_batch_case *one, double *values) {
    const struct fit *fit = context;
    const size_t n = (size_t)fit->scene->model->n;
    memcpy(values, one->integrator->q, n * sizeof *values);
    memcpy(values + n, one->integrator->qd, n * sizeof *values);
    write_signals(context, one, values + 2 * n);
}

/* The change of a value in free motions, as part of the value or of its unit. At a tolerance of 1e-6 the
 * error of a difference is then about a thousandth of it. */
static const double free_change = 1e-3;

/* What a motion shows at its outputs. */
struct view {
    int width;
    fit_writer *write;
};

static struct view signals_of(const struct fit *fit) {
    return (struct view){fit->signal_count, write_signals};
}

/* The values (outputs x width) of a motion; their derivatives and which of these are missing, both NULL if
 * not needed. */
static enum fit_outcome run_motion(struct fit *fit, const struct file_batch *file, struct view view,
                                   double *at, double *derivatives, struct refdyn_underivable *underivable) {
    struct refdyn_derivatives given = {.batch = &file->batch,
                                       .count = derivatives ? fit->variables.count : 0,
                                       .variables = fit->variables.variables,
                                       .width = view.width,
                                       .values = view.write,
                                       .context = fit,
                                       .at = at,
                                       .derivatives = derivatives,
                                       .keeps_means = 1,
                                       .underivable = underivable};
    if (system_interrupted)
        return FIT_STOPPED;
    const int status = refdyn_derivatives_run(&given);
    fit->motions += 1 + given.copies;
    fit->end_status = status ? status : given.motion.status;
    fit->end_t = given.motion.t;
    fit->end_steps = given.motion.steps_alone;
    if (system_interrupted)
        return FIT_STOPPED;
    return status || given.outputs < file->batch.time_count + 1 ? FIT_FAILED : FIT_DONE;
}

/* The values of a motion, and their derivatives, NULL if not needed. Derivatives that copies do not have are
 * differences of free motions. */
static enum fit_outcome differentiate(struct fit *fit, const struct fit_data *data,
                                      const struct file_batch *file, double *at, double *derivatives,
                                      size_t size) {
    const size_t count = (size_t)fit->variables.count;
    struct refdyn_underivable *underivable =
        memory_scratch(&format_memory, (count + 1) * sizeof *underivable);
    double *changes = memory_scratch(&format_memory, (count + 1) * sizeof *changes);
    const enum fit_outcome outcome = run_motion(fit, file, signals_of(fit), at, derivatives, underivable);
    if (outcome != FIT_DONE || !derivatives)
        return outcome;
    for (size_t k = 0; k < count; k++) {
        struct fit_value *value = &fit->values[value_of_variable(fit, data, (int)k)];
        changes[k] = free_change * (value->is_log ? file->columns[k].values[0] : value->unit);
        value->is_rough = value->is_rough || (underivable[k].status && !data->is_held_out);
    }
    fit_free_derivatives(fit, &file->batch, write_signals, underivable, changes, at, derivatives, size);
    return outcome;
}

/* ---- Residuals ---- */

struct entry {
    double *r, *J;    /* the next residual, and its derivative by the first unknown */
    size_t apart;     /* of derivatives by the next unknown */
    int first, count; /* unknowns of J */
};

/* A motion with its outputs (outputs x signals), and their derivatives (variables x outputs x signals). */
struct shown {
    const struct outputs *outputs;
    const double *at, *derivatives;
    size_t size; /* of `at` */
};

static double mean_of(const struct fit *fit, const double *at, struct pair pair, int signal) {
    const size_t width = (size_t)fit->signal_count, k = (size_t)signal;
    return pair.low == pair.high ? at[pair.low * width + k]
                                 : (at[pair.low * width + k] + at[pair.high * width + k]) / 2;
}

/* dy/dt between the two outputs of a datum. */
static double slope_of(const struct fit *fit, const struct shown *shown, struct pair pair, int signal) {
    const size_t width = (size_t)fit->signal_count, k = (size_t)signal;
    if (pair.low == pair.high)
        return 0;
    return (shown->at[pair.high * width + k] - shown->at[pair.low * width + k]) /
           (time_of(shown->outputs, (int)pair.high) - time_of(shown->outputs, (int)pair.low));
}

/* The derivative of a shown value by value j. */
static double derivative_of(const struct fit *fit, const struct fit_data *data, const struct shown *shown,
                            struct pair pair, int signal, double gain, int j) {
    const struct fit_value *value = &fit->values[j];
    const bool is_own = value->kind == FIT_START ? &fit->data[value->data] == data
                                                 : value->kind == FIT_OF_MODEL || value->signal == signal;
    if (!is_own)
        return 0;
    switch (value->kind) {
    case FIT_OFFSET:
        return 1;
    case FIT_GAIN:
        return mean_of(fit, shown->at, pair, signal);
    case FIT_DELAY:
        return -gain * slope_of(fit, shown, pair, signal);
    default:
        return gain * mean_of(fit, shown->derivatives + (size_t)value->column * shown->size, pair, signal);
    }
}

static void add_derivatives(struct fit *fit, const struct fit_data *data, const struct shown *shown,
                            struct pair pair, int signal, const double *unknowns, double gain, double noise,
                            struct entry *place) {
    for (int i = 0; i < place->count; i++) {
        const int j = place->first + i;
        const struct fit_value *value = &fit->values[j];
        const double by = value->is_log ? fit_value_of(value, unknowns[j]) : value->unit,
                     slope = derivative_of(fit, data, shown, pair, signal, gain, j);
        fit->lost += isnan(slope);
        place->J[(size_t)i * place->apart] = isnan(slope) ? 0 : slope * by / noise;
    }
    place->J++;
}

static void add_residuals(struct fit *fit, const struct fit_data *data, const double *unknowns,
                          const struct shown *shown, struct entry *place) {
    struct fit_sensor *sensors = format_allocate((size_t)fit->signal_count, sizeof *sensors);
    for (int k = 0; k < fit->signal_count; k++)
        sensors[k] = fit_sensor_of(fit, k, unknowns);
    for (int i = 0; i < shown->outputs->rows; i++)
        for (int k = 0; k < fit->signal_count; k++) {
            const double y = row_of(fit, data, i)[k], noise = fit->signals[k].noise / sqrt(data->weight),
                         gain = sensors[k].is[FIT_GAIN];
            const struct pair pair = pair_of(shown->outputs, i, k);
            if (isnan(y))
                continue;
            *place->r++ = (gain * mean_of(fit, shown->at, pair, k) + sensors[k].is[FIT_OFFSET] - y) / noise;
            if (place->J)
                add_derivatives(fit, data, shown, pair, k, unknowns, gain, noise, place);
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
               place->J ? format_allocate_large(size * (size_t)fit->variables.count, sizeof *derivatives)
                        : NULL;
    const struct shown shown = {&file.outputs, at, derivatives, size};
    const enum fit_outcome outcome = differentiate(fit, data, &file, at, derivatives, size);
    if (outcome == FIT_DONE)
        add_residuals(fit, data, unknowns, &shown, place);
    free(at);
    free(derivatives);
    memory_back(&format_memory, mark);
    return outcome;
}

enum fit_outcome fit_residuals(struct fit *fit, double until, const double *unknowns, double *r, double *J,
                               size_t apart) {
    struct entry place = {r, J, apart, 0, fit->count};
    enum fit_outcome outcome = FIT_DONE;
    if (J) {
        fit->lost = 0;
        for (int k = 0; k < fit->count; k++)
            fit->values[k].is_rough = false;
    }
    for (int i = 0; i < fit->data_count && outcome == FIT_DONE; i++)
        if (!fit->data[i].is_held_out)
            outcome = residuals_of(fit, &fit->data[i], until, unknowns, &place);
    return outcome;
}

enum fit_outcome fit_file_residuals(struct fit *fit, const struct fit_data *data, const double *unknowns,
                                    int first, int count, double *r, double *J) {
    struct entry place = {r, J, (size_t)fit_file_residual_count(fit, data, INFINITY), first, count};
    return residuals_of(fit, data, INFINITY, unknowns, &place);
}

enum fit_outcome fit_motion_values(struct fit *fit, const struct fit_data *data, const double *unknowns,
                                   double *values) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct file_batch file;
    describe(fit, data, data->rows, unknowns, 1, &file);
    const size_t width = (size_t)fit->signal_count, size = (size_t)(file.batch.time_count + 2) * width;
    double *at = format_allocate_large(size, sizeof *at);
    const enum fit_outcome outcome = run_motion(fit, &file, signals_of(fit), at, NULL, NULL);
    for (int k = 0; k < fit->signal_count; k++) {
        const struct fit_sensor sensor = fit_sensor_of(fit, k, unknowns);
        for (int i = 0; i < data->rows; i++)
            values[(size_t)i * width + (size_t)k] =
                sensor.is[FIT_GAIN] * mean_of(fit, at, pair_of(&file.outputs, i, k), k) +
                sensor.is[FIT_OFFSET];
    }
    free(at);
    memory_back(&format_memory, mark);
    return outcome;
}

/* ---- Sizes of a motion ---- */

void fit_motion_ranges(struct fit *fit, const struct fit_data *data, const double *unknowns, double *ranges) {
    enum { OUTPUTS_MOST = 1000 };
    const struct memory_mark mark = memory_mark(&format_memory);
    const struct view view = {2 * fit->scene->model->n + fit->signal_count, write_all};
    const size_t width = (size_t)view.width;
    struct fit_data few;
    struct file_batch file;
    fit_data_thin(fit, data, OUTPUTS_MOST, &few);
    describe(fit, &few, few.rows, unknowns, 1, &file);
    double *at = format_allocate_large((size_t)(file.batch.time_count + 2) * width, sizeof *at);
    const enum fit_outcome outcome = run_motion(fit, &file, view, at, NULL, NULL);
    for (size_t k = 0; k < width && outcome == FIT_DONE; k++) {
        double least = at[k], most = at[k];
        for (int i = 1; i <= file.batch.time_count; i++) {
            least = fmin(least, at[(size_t)i * width + k]);
            most = fmax(most, at[(size_t)i * width + k]);
        }
        ranges[k] = most - least;
    }
    free(at);
    memory_back(&format_memory, mark);
}

/* ---- Candidates ---- */

struct candidates {
    struct fit *fit;
    const struct fit_data *data;
    const struct outputs *outputs;
    const double *unknowns; /* (candidates x values) */
    double *chi2;           /* by number of the case */
    double *values;         /* (rooms x signals) */
    int *next;              /* (rooms x signals) the next row of each column */
};

/* Adds the rows of a column that output `number` shows. */
static void add_shown_rows(const struct candidates *candidates, const struct refdyn_batch_case *one,
                           int number, int signal, double value, int *next) {
    const struct fit *fit = candidates->fit;
    const struct fit_data *data = candidates->data;
    const struct fit_sensor sensor =
        fit_sensor_of(fit, signal, candidates->unknowns + one->number * fit->count);
    for (; *next < candidates->outputs->rows &&
           pair_of(candidates->outputs, *next, signal).low == (size_t)number;
         ++*next) {
        const double y = row_of(fit, data, *next)[signal],
                     r = isnan(y) ? 0
                                  : (sensor.is[FIT_GAIN] * value + sensor.is[FIT_OFFSET] - y) /
                                        fit->signals[signal].noise;
        candidates->chi2[one->number] += data->weight * r * r;
    }
}

static int see_candidate(void *context, const struct refdyn_batch_case *one, int number) {
    struct candidates *candidates = context;
    const struct fit *fit = candidates->fit;
    double *values = candidates->values + one->room * fit->signal_count;
    int *next = candidates->next + one->room * fit->signal_count;
    if (number == 0)
        memset(next, 0, (size_t)fit->signal_count * sizeof *next);
    if (number > candidates->outputs->count)
        return 0;
    write_signals(candidates->fit, one, values);
    for (int k = 0; k < fit->signal_count; k++)
        add_shown_rows(candidates, one, number, k, values[k], &next[k]);
    return 0;
}

static int end_candidate(void *context, const struct refdyn_batch_case *one,
                         const struct refdyn_batch_result *result) {
    struct candidates *candidates = context;
    if (result->status)
        candidates->chi2[one->number] = INFINITY;
    return 0;
}

enum fit_outcome fit_try_candidates(struct fit *fit, double until, const double *unknowns, int count,
                                    double *chi2) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct candidates candidates = {.fit = fit, .chi2 = chi2, .unknowns = unknowns};
    const size_t room_values =
        (size_t)(fit->batch.threads * fit->rooms_of_thread) * (size_t)fit->signal_count;
    candidates.values = memory_scratch(&format_memory, room_values * sizeof *candidates.values);
    candidates.next = memory_scratch(&format_memory, room_values * sizeof *candidates.next);
    memset(chi2, 0, (size_t)count * sizeof *chi2);
    for (int i = 0; i < fit->data_count && !system_interrupted; i++) {
        struct file_batch file;
        const int rows = fit_rows_until(&fit->data[i], until);
        candidates.data = &fit->data[i];
        if (candidates.data->is_held_out || rows < 2)
            continue;
        describe(fit, candidates.data, rows, unknowns, count, &file);
        candidates.outputs = &file.outputs;
        file.batch.count = count;
        file.batch.context = &candidates;
        file.batch.output = see_candidate;
        file.batch.end = end_candidate;
        if (refdyn_batch_run(&file.batch, NULL) != REFDYN_OK)
            for (int k = 0; k < count; k++)
                chi2[k] = INFINITY;
        fit->motions += count;
    }
    memory_back(&format_memory, mark);
    return system_interrupted ? FIT_STOPPED : FIT_DONE;
}
