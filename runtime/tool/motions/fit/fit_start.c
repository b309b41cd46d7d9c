/*
 * The data and the motion of the start, compared before the search.
 *
 * In: values, data, the start. Out: units of values without bounds, by the sizes of the motion and the data;
 * messages about columns that look exchanged or in another unit, and about times in another unit.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

/* ---- Units of values without bounds ---- */

/* The range of a column in the data of the fit. */
static double range_of_data(const struct fit *fit, int signal) {
    double least = INFINITY, most = -INFINITY;
    for (int i = 0; i < fit->data_count; i++)
        for (int row = 0; row < fit->data[i].rows && !fit->data[i].is_held_out; row++) {
            const double y = fit->data[i].y[(size_t)row * (size_t)fit->signal_count + (size_t)signal];
            least = fmin(least, y);
            most = fmax(most, y);
        }
    return fmax(most - least, 0);
}

static void scale_offset(const struct fit *fit, struct fit_value *value) {
    const double range = range_of_data(fit, value->signal);
    value->unit = range > 0 ? range : value->unit;
}

/* How many times larger than the motion some column of the data is, at least 1. ranges: of the signals. */
static double ratio_to_motion(const struct fit *fit, const double *ranges) {
    double most = 1;
    for (int k = 0; k < fit->signal_count; k++)
        if (ranges[k] > 0)
            most = fmax(most, range_of_data(fit, k) / ranges[k]);
    return most;
}

/* ranges: of coordinates, rates and signals in the motion of each file (files x width). */
static void scale_start(const struct fit *fit, struct fit_value *value, const double *ranges, int width) {
    const struct refdyn_variable *variable = &value->variable;
    const int n = fit->scene->model->n,
              column = variable->place + (variable->what == REFDYN_VARIED_RATE ? n : 0);
    double size = fabs(value->start);
    for (int i = 0; i < fit->data_count; i++) {
        const double *own = ranges + i * width;
        if (value->kind == FIT_OF_MODEL || value->data == i)
            size = fmax(size, own[column] * ratio_to_motion(fit, own + 2 * n));
    }
    for (int k = 0; k < fit->signal_count; k++)
        if (strcmp(fit->signals[k].name, fit->variables.names[value->column]) == 0)
            size = fmax(size, range_of_data(fit, k));
    value->unit = size > 0 ? size : value->unit;
}

void fit_start_scale(struct fit *fit) {
    const int width = 2 * fit->scene->model->n + fit->signal_count;
    double *ranges = format_allocate_matrix(fit->data_count, width),
           *unknowns = format_allocate((size_t)fit->all_count, sizeof *unknowns);
    bool has_starts = false;
    for (int j = 0; j < fit->all_count; j++) {
        unknowns[j] = fit_unknown_of(&fit->values[j], fit->values[j].start);
        has_starts = has_starts || fit_is_of_state(&fit->values[j].variable);
    }
    for (int i = 0; i < fit->data_count && has_starts; i++)
        fit_motion_ranges(fit, &fit->data[i], unknowns, ranges + i * width);
    for (int j = 0; j < fit->all_count; j++) {
        struct fit_value *value = &fit->values[j];
        if (isfinite(value->lower))
            continue;
        if (value->kind == FIT_OFFSET)
            scale_offset(fit, value);
        else if (value->kind >= FIT_OF_MODEL && fit_is_of_state(&value->variable))
            scale_start(fit, value, ranges, width);
    }
}

/* ---- Columns in another unit, or exchanged ---- */

/* Sums over the rows of a file that have both a datum and a value of the motion. */
struct sums {
    double dd, mm, dm, apart; /* of squares, products, and squared differences */
    long count;
};

static struct sums sum_over(const struct fit *fit, const struct fit_data *data, const double *model,
                            int data_column, int model_column) {
    struct sums sums = {.count = 0};
    const size_t width = (size_t)fit->signal_count;
    for (int i = 0; i < data->rows; i++) {
        const double d = data->y[(size_t)i * width + (size_t)data_column],
                     m = model[(size_t)i * width + (size_t)model_column];
        if (isnan(d))
            continue;
        sums.dd += d * d;
        sums.mm += m * m;
        sums.dm += d * m;
        sums.apart += (d - m) * (d - m);
        sums.count++;
    }
    return sums;
}

/* Factors between units that users confuse. */
static const struct {
    double factor;
    const char *text;
} units[] = {{180 / 3.14159265358979, "degrees instead of radians"},
             {1000, "thousandths of the model's unit, such as mm"},
             {100, "hundredths of the model's unit, such as cm"},
             {1 / 0.0254, "inches instead of metres"},
             {0.5 / 3.14159265358979, "revolutions instead of radians"},
             {1 / 9.81, "multiples of g"}};
/* Data are in another unit if their cosine with the motion is larger, which is so even if noise is as large
 * as the motion, and the factor is within this part. */
static const double cosine_least = 0.6, factor_part = 0.2;
/* The sign of a column seems reversed if its cosine with the motion is below minus this. This is no error,
 * since the search may find a value of the other sign. */
static const double reversed_least = 0.95;
/* Columns are exchanged if the exchange decreases both sums of squares, one of them by this factor. */
static const double exchange_gain = 30;

static enum status refuse_unit(const struct fit *fit, const struct fit_data *data, const double *model,
                               int k) {
    const struct sums sums = sum_over(fit, data, model, k, k);
    const double factor = sums.dm / sums.mm, cosine = sums.dm / sqrt(sums.dd * sums.mm);
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (cosine > cosine_least && fabs(factor / units[i].factor - 1) < factor_part) {
            format_complain_line(data->path, 1,
                                 format_text("data: column %s is %.3g times the motion: it seems to be in %s",
                                             fit->signals[k].name, factor, units[i].text));
            return STATUS_FAULT;
        }
    if (cosine < -reversed_least)
        format_complain_line(data->path, 1,
                             format_text("warning: data: column %s is %.3g times the motion: its sign seems "
                                         "to be reversed",
                                         fit->signals[k].name, factor));
    return STATUS_DONE;
}

static enum status refuse_exchange(const struct fit *fit, const struct fit_data *data, const double *model,
                                   int a, int b) {
    const struct sums aa = sum_over(fit, data, model, a, a), bb = sum_over(fit, data, model, b, b),
                      ab = sum_over(fit, data, model, a, b), ba = sum_over(fit, data, model, b, a);
    const bool is_better = ab.apart < aa.apart && ba.apart < bb.apart,
               is_far_better = exchange_gain * ab.apart < aa.apart || exchange_gain * ba.apart < bb.apart;
    if (!is_better || !is_far_better)
        return STATUS_DONE;
    format_complain_line(
        data->path, 1,
        format_text("data: columns %s and %s seem exchanged: each resembles the motion of the other",
                    fit->signals[a].name, fit->signals[b].name));
    return STATUS_FAULT;
}

static enum status compare_columns(const struct fit *fit, const struct fit_data *data, const double *model) {
    enum status status = STATUS_DONE;
    for (int a = 0; a < fit->signal_count; a++)
        for (int b = a + 1; b < fit->signal_count && status == STATUS_DONE; b++)
            if (!fit_sensor_is_scaled(fit, a) && !fit_sensor_is_scaled(fit, b))
                status = refuse_exchange(fit, data, model, a, b);
    for (int k = 0; k < fit->signal_count && status == STATUS_DONE; k++)
        if (!fit_sensor_is_scaled(fit, k))
            status = refuse_unit(fit, data, model, k);
    return status;
}

/* ---- Times in another unit ---- */

/* Units that users confuse with seconds. */
static const struct {
    double factor;
    const char *text;
} time_units[] = {{1e-6, "microseconds"}, {1e-3, "milliseconds"}};
enum { TIME_UNITS = sizeof time_units / sizeof *time_units, ROWS_COMPARED = 1000 };
/* The motion in another unit resembles the data if its mean squared residual is less than this part of their
 * spread. The motion in seconds, which may last for days, is then limited to so many times its steps. */
static const double resembles_most = 0.5, steps_factor = 100;
/* The motion in a unit of time, compared with the data. */
struct time_unit {
    double misfit; /* mean squared residual; infinite if the motion fails */
    long steps;
};

/* The mean of all squared residuals. */
static double misfit(const struct fit *fit, const struct fit_data *data, const double *model) {
    double sum = 0;
    long count = 0;
    for (int k = 0; k < fit->signal_count; k++) {
        const struct sums sums = sum_over(fit, data, model, k, k);
        sum += sums.apart / (fit->signals[k].noise * fit->signals[k].noise);
        count += sums.count;
    }
    return sum / (double)count;
}

/* The same for the means of the columns in place of a motion. */
static double spread(const struct fit *fit, const struct fit_data *data) {
    const size_t width = (size_t)fit->signal_count;
    double *means = format_allocate_large((size_t)data->rows * width, sizeof *means);
    for (size_t k = 0; k < width; k++) {
        double sum = 0;
        long count = 0;
        for (size_t i = 0; i < (size_t)data->rows; i++)
            if (!isnan(data->y[i * width + k])) {
                sum += data->y[i * width + k];
                count++;
            }
        for (size_t i = 0; i < (size_t)data->rows; i++)
            means[i * width + k] = sum / (double)count;
    }
    const double found = misfit(fit, data, means);
    free(means);
    return found;
}

/* Compares the motion whose times are in this part of a second. */
static struct time_unit compare_unit(struct fit *fit, const struct fit_data *data, const double *from,
                                     double factor) {
    const double begin = fit->scene->state.t;
    struct fit_data scaled = *data;
    double *model = format_allocate_large((size_t)data->rows * (size_t)fit->signal_count, sizeof *model);
    scaled.t = format_allocate_large((size_t)data->rows, sizeof *scaled.t);
    for (int i = 0; i < data->rows; i++)
        scaled.t[i] = begin + factor * (data->t[i] - begin);
    struct time_unit unit = {INFINITY, 0};
    if (fit_motion_values(fit, &scaled, from, model) == FIT_DONE)
        unit = (struct time_unit){misfit(fit, data, model), fit->end_steps};
    free(model);
    free(scaled.t);
    return unit;
}

/* Times in a smaller unit remain near the start of the motion, which data may resemble by chance. If data
 * begin later than they last, a clock that began before the motion is the more likely cause. */
static enum status refuse_times(const struct fit *fit, const struct fit_data *data, const char *text) {
    const double begin = fit->scene->state.t, first = data->t[0], last = data->t[data->rows - 1];
    format_complain_line(
        data->path, 1,
        first - begin < last - first
            ? format_text("data: t ends at %.6g: it seems to be in %s; must be in seconds", last, text)
            : format_text(
                  "data: t begins at %.6g, but the motion starts at %.6g and differs from the data at "
                  "these times; t must be in seconds from the start of the motion",
                  first, begin));
    return STATUS_FAULT;
}

/* Computes the motion in seconds. Refuses the times if the motion in another unit explains the data far
 * better. */
static enum status check_times(struct fit *fit, const struct fit_data *data, const double *from,
                               double *model, enum fit_outcome *outcome) {
    struct fit_data few;
    struct time_unit found[TIME_UNITS];
    const long limit = fit->batch.options.step_limit;
    int best = 0;
    fit_data_thin(fit, data, ROWS_COMPARED, &few);
    for (int i = 0; i < TIME_UNITS; i++) {
        found[i] = compare_unit(fit, &few, from, time_units[i].factor);
        best = found[i].misfit < found[best].misfit ? i : best;
    }
    const bool resembles = found[best].misfit < resembles_most * spread(fit, &few);
    if (resembles)
        fit->batch.options.step_limit = (long)(steps_factor * fmax((double)found[best].steps, steps_factor));
    *outcome = fit_motion_values(fit, data, from, model);
    fit->batch.options.step_limit = limit;
    const double present = *outcome == FIT_DONE ? misfit(fit, data, model) : INFINITY;
    const bool is_long = resembles && fit->end_status == REFDYN_TOO_MANY_STEPS,
               is_worse = present > exchange_gain && exchange_gain * found[best].misfit < present;
    return is_long || is_worse ? refuse_times(fit, data, time_units[best].text) : STATUS_DONE;
}

/* ---- All files ---- */

static enum status compare_file(struct fit *fit, const struct fit_data *data, const double *from) {
    double *model = format_allocate_large((size_t)data->rows * (size_t)fit->signal_count, sizeof *model);
    enum fit_outcome outcome;
    enum status status = check_times(fit, data, from, model, &outcome);
    if (status == STATUS_DONE)
        status = outcome == FIT_DONE ? compare_columns(fit, data, model) : fit_report_outcome(fit, outcome);
    free(model);
    return status;
}

enum status fit_start_compare(struct fit *fit, const double *from) {
    enum status status = STATUS_DONE;
    for (int i = 0; i < fit->data_count && status == STATUS_DONE; i++)
        status = compare_file(fit, &fit->data[i], from);
    return status;
}
