/*
 * Measurements: CSV files with the time `t` and columns named as in a motion. An empty field is a gap.
 * Columns that are inputs of the model drive it. Reports data that cannot be right: constant columns, other
 * units, exchanged columns, another unit of time.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

enum { COLUMN_OTHER = -1, COLUMN_TIME = -2, COLUMN_INPUT = -3 };

/* A file while it is read. */
struct reading {
    const struct fit *fit;
    struct fit_data *data;
    struct csv csv;
    int *role; /* (csv.count) number of the signal, or COLUMN_* */
    int room_t, room_y;
};

/* ---- Columns ---- */

static int find_signal(const struct fit *fit, const char *name) {
    for (int k = 0; k < fit->signal_count; k++)
        if (strcmp(fit->signals[k].name, name) == 0)
            return k;
    return -1;
}

static bool is_input(const struct refdyn_model *model, const char *name) {
    const size_t lead = strlen(record_input_lead);
    return refdyn_find_name(model->inputs, model->input_count, name) >= 0 ||
           (strncmp(name, record_input_lead, lead) == 0 &&
            refdyn_find_name(model->inputs, model->input_count, name + lead) >= 0);
}

/* Warns of columns without a use: those of the motion in one line, and each other one. */
static void warn_of_columns(const struct reading *reading) {
    enum { SHOWN_MOST = 5 };
    const struct record_table *table = &reading->fit->table;
    const struct csv *csv = &reading->csv;
    struct text unused = {.memory = &format_memory};
    int count = 0;
    for (int i = 0; i < csv->count; i++) {
        const char *name = csv->names[i];
        if (reading->role[i] != COLUMN_OTHER)
            continue;
        if (record_table_find(table, name, strlen(name)) >= 0) {
            if (count++ < SHOWN_MOST)
                text_add(&unused, "%s%s", count > 1 ? ", " : "", name);
            continue;
        }
        const char *near = message_nearest_name(name, table->names, table->count);
        format_complain_line(csv->path, csv->line,
                             format_text("warning: data: column %s is no column of the motion and is not "
                                         "used%s%s",
                                         name, near ? "; the nearest is " : "", near ? near : ""));
    }
    if (count > 0)
        format_complain_line(
            csv->path, csv->line,
            format_text("warning: data: %d column%s without noise %s not used (%s%s); to use "
                        "one, add it to %s",
                        count, count > 1 ? "s" : "", count > 1 ? "are" : "is", unused.data,
                        count > SHOWN_MOST ? ", ..." : "", fit_option_text(reading->fit, "noise")));
}

static bool assign_columns(struct reading *reading) {
    struct csv *csv = &reading->csv;
    bool has_signal = false;
    reading->role = format_allocate((size_t)csv->count, sizeof *reading->role);
    for (int i = 0; i < csv->count; i++) {
        const int signal = find_signal(reading->fit, csv->names[i]);
        const bool is_time = strcmp(csv->names[i], "t") == 0;
        has_signal |= signal >= 0;
        reading->role[i] = is_time                                               ? COLUMN_TIME
                           : signal >= 0                                         ? signal
                           : is_input(reading->fit->scene->model, csv->names[i]) ? COLUMN_INPUT
                                                                                 : COLUMN_OTHER;
        reading->data->has_inputs |= reading->role[i] == COLUMN_INPUT;
    }
    if (format_csv_column(csv, "t") < 0)
        return format_csv_complain(csv, "no column is called t; add the time of each measurement [s]");
    if (!has_signal)
        return format_csv_complain(csv, "no column of %s is here; must have at least one of them",
                                   fit_option_text(reading->fit, "noise"));
    warn_of_columns(reading);
    return true;
}

/* ---- Rows ---- */

static bool take_time(struct reading *reading, int column) {
    struct fit_data *data = reading->data;
    double *t = &data->t[data->rows];
    const double begin = reading->fit->scene->state.t;
    if (!format_csv_number(&reading->csv, column, t))
        return false;
    if (data->rows > 0 && !(*t > t[-1]))
        return format_csv_complain(
            &reading->csv,
            "t = %.9g does not follow %.9g, the time before it; times must ascend: give "
            "each time base its own file",
            *t, t[-1]);
    if (*t < begin)
        return format_csv_complain(
            &reading->csv, "t = %.9g; must not be before the motion, which starts at %.9g", *t, begin);
    return true;
}

static bool take_row(struct reading *reading) {
    struct fit_data *data = reading->data;
    const struct csv *csv = &reading->csv;
    const int width = reading->fit->signal_count;
    data->t = memory_room(&format_memory, data->t, data->rows, &reading->room_t, sizeof *data->t);
    data->y =
        memory_room(&format_memory, data->y, data->rows, &reading->room_y, (size_t)width * sizeof *data->y);
    double *y = data->y + (size_t)data->rows * (size_t)width;
    for (int k = 0; k < width; k++)
        y[k] = NAN;
    for (int i = 0; i < csv->count; i++) {
        const int role = reading->role[i];
        if (role == COLUMN_TIME && !take_time(reading, i))
            return false;
        if (role >= 0 && *csv->fields[i] && !format_csv_number(csv, i, &y[role]))
            return false;
    }
    data->rows++;
    return true;
}

static bool take_rows(struct reading *reading) {
    int answer = 1;
    while (answer > 0 && (answer = format_csv_next(&reading->csv)) > 0)
        answer = take_row(reading) ? 1 : -1;
    if (answer == 0 && reading->data->rows < 2)
        return format_csv_complain(&reading->csv,
                                   "fewer than 2 rows; must have a header and at least two rows");
    return answer == 0;
}

/* ---- Columns that cannot be right ---- */

static bool refuse_constant(const struct reading *reading) {
    const struct fit *fit = reading->fit;
    const struct fit_data *data = reading->data;
    for (int k = 0; k < fit->signal_count; k++) {
        long count = 0;
        double least = INFINITY, most = -INFINITY;
        for (int i = 0; i < data->rows; i++) {
            const double y = data->y[(size_t)i * (size_t)fit->signal_count + (size_t)k];
            if (isnan(y))
                continue;
            least = fmin(least, y);
            most = fmax(most, y);
            count++;
        }
        if (count > 1 && least == most) {
            format_complain_line(
                data->path, 1,
                format_text("data: column %s is %.9g in all %ld rows: a sensor that does not "
                            "move; omit it from %s",
                            fit->signals[k].name, least, count, fit_option_text(fit, "noise")));
            return false;
        }
    }
    return true;
}

/* The mean time between rows. */
static double spacing(const struct fit_data *data) {
    return (data->t[data->rows - 1] - data->t[0]) / (data->rows - 1);
}

/* Files whose rows are a hundred times further apart than those of the first have times in other units. */
static bool refuse_time_base(const struct fit *fit, const struct fit_data *data) {
    const double ratio = spacing(data) / spacing(&fit->data[0]);
    if (ratio < 100 && ratio > 0.01)
        return true;
    format_complain_line(
        data->path, 1,
        format_text(
            "data: the rows are %.3g s apart, but %.3g s in %s; times must be in seconds in each file",
            spacing(data), spacing(&fit->data[0]), fit->data[0].path));
    return false;
}

static bool read_file(struct fit *fit, struct fit_data *data) {
    struct reading reading = {.fit = fit, .data = data};
    bool is_good = format_csv_open(&reading.csv, data->path, "data") && assign_columns(&reading) &&
                   take_rows(&reading) && refuse_constant(&reading);
    format_csv_close(&reading.csv);
    if (is_good && data->has_inputs)
        is_good = scene_inputs_read(&data->inputs, data->path, fit->scene->model);
    return is_good && refuse_time_base(fit, data);
}

enum status fit_data_read(struct fit *fit) {
    for (int i = 0; i < fit->data_count; i++)
        if (!read_file(fit, &fit->data[i]))
            return STATUS_FAULT;
    return STATUS_DONE;
}

enum status fit_data_imagine(struct fit *fit) {
    const struct options *options = fit->options;
    const double begin = fit->scene->state.t, length = options_number(options, "until") - begin;
    const enum status status = simulate_check_times(fit->scene, options);
    if (status != STATUS_DONE)
        return status;
    const double every = record_distance(length, options_number(options, "every"));
    struct fit_data *data = &fit->data[0];
    data->rows = (int)record_count_outputs(length, every);
    data->t = format_allocate((size_t)data->rows, sizeof *data->t);
    data->y = format_allocate((size_t)data->rows * (size_t)fit->signal_count, sizeof *data->y);
    for (int i = 0; i < data->rows; i++)
        data->t[i] = i + 1 < data->rows ? begin + i * every : begin + length;
    return STATUS_DONE;
}

/* ---- Fewer data for rough solutions ---- */

static long count_measurements(const struct fit_data *data, int width, int column) {
    long count = 0;
    for (int i = 0; i < data->rows; i++)
        count += !isnan(data->y[(size_t)i * (size_t)width + (size_t)column]);
    return count;
}

void fit_data_thin(const struct fit *fit, const struct fit_data *data, int most, struct fit_data *thin) {
    const int width = fit->signal_count;
    long *every = format_allocate((size_t)width, sizeof *every),
         *number = format_allocate((size_t)width, sizeof *number);
    bool is_thin = false;
    *thin = *data;
    for (int k = 0; k < width; k++) {
        every[k] = (count_measurements(data, width, k) + most - 1) / most;
        is_thin = is_thin || every[k] > 1;
    }
    if (!is_thin)
        return;
    const size_t rows = (size_t)most * (size_t)width + 1;
    thin->rows = 0;
    thin->t = format_allocate(rows, sizeof *thin->t);
    thin->y = format_allocate(rows * (size_t)width, sizeof *thin->y);
    for (int i = 0; i < data->rows; i++) {
        double *y = thin->y + (size_t)thin->rows * (size_t)width;
        bool is_kept = false;
        for (int k = 0; k < width; k++) {
            y[k] = data->y[(size_t)i * (size_t)width + (size_t)k];
            if (!isnan(y[k]) && number[k]++ % every[k] != 0)
                y[k] = NAN;
            is_kept = is_kept || !isnan(y[k]);
        }
        thin->t[thin->rows] = data->t[i];
        thin->rows += is_kept;
    }
}

/* ---- Comparison with the motion of the start ---- */

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
             {1 / 9.81, "multiples of g"}};
/* Data are in another unit if their cosine with the motion is larger, which is so even if noise is as large
 * as the motion, and the factor is within this part. */
static const double cosine_least = 0.6, factor_part = 0.2;
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

enum status fit_data_compare(const struct fit *fit, const struct fit_data *data, const double *model) {
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
} time_units[] = {{1e-3, "milliseconds"}, {1e-6, "microseconds"}};

/* The sum of all squared residuals. */
static double misfit(const struct fit *fit, const struct fit_data *data, const double *model) {
    double sum = 0;
    for (int k = 0; k < fit->signal_count; k++)
        sum += sum_over(fit, data, model, k, k).apart / (fit->signals[k].noise * fit->signals[k].noise);
    return sum;
}

/* The same if times are in this part of a second. */
static double misfit_in_unit(struct fit *fit, const struct fit_data *data, const double *from,
                             double factor) {
    const double begin = fit->scene->state.t;
    struct fit_data scaled = *data;
    double *model = format_allocate_large((size_t)data->rows * (size_t)fit->signal_count, sizeof *model);
    scaled.t = format_allocate_large((size_t)data->rows, sizeof *scaled.t);
    for (int i = 0; i < data->rows; i++)
        scaled.t[i] = begin + factor * (data->t[i] - begin);
    const double sum =
        fit_motion_values(fit, &scaled, from, model) == FIT_DONE ? misfit(fit, data, model) : INFINITY;
    free(model);
    free(scaled.t);
    return sum;
}

enum status fit_data_check_times(struct fit *fit, const struct fit_data *data, const double *from,
                                 const double *model) {
    const double present = model ? misfit(fit, data, model) : INFINITY;
    for (size_t i = 0; i < sizeof time_units / sizeof *time_units; i++)
        if (present > exchange_gain * data->rows &&
            exchange_gain * misfit_in_unit(fit, data, from, time_units[i].factor) < present) {
            format_complain_line(data->path, 1,
                                 format_text("data: t ends at %.6g: it seems to be in %s; must be in seconds",
                                             data->t[data->rows - 1], time_units[i].text));
            return STATUS_FAULT;
        }
    return STATUS_DONE;
}
