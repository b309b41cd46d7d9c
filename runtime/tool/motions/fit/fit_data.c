/*
 * Measurements: CSV files with the time `t` and columns named as in a motion. An empty field is a gap.
 * Columns that are inputs of the model drive it. Reports data that cannot be right in themselves: constant
 * columns, times that do not ascend, files whose times have different units.
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
    int count = 0, unknown = 0;
    for (int i = 0; i < csv->count; i++) {
        const char *name = csv->names[i];
        if (reading->role[i] != COLUMN_OTHER)
            continue;
        if (record_table_find(table, name, strlen(name)) >= 0) {
            if (count++ < SHOWN_MOST)
                text_add(&unused, "%s%s", count > 1 ? ", " : "", name);
            continue;
        }
        if (unknown++ >= SHOWN_MOST)
            continue;
        const char *near = message_nearest_name(name, table->names, table->count);
        format_complain_line(csv->path, csv->line,
                             format_text("warning: data: column %s is no column of the motion and is not "
                                         "used%s%s",
                                         name, near ? "; the nearest is " : "", near ? near : ""));
    }
    if (unknown > SHOWN_MOST)
        format_complain_line(
            csv->path, csv->line,
            format_text("warning: data: %d columns are no columns of the motion and are not used", unknown));
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

static double length_of(const struct fit_data *data) {
    return data->t[data->rows - 1] - data->t[0];
}

/* The mean time between rows. */
static double spacing(const struct fit_data *data) {
    return length_of(data) / (data->rows - 1);
}

/* Refuses times of a clock that started long before the motion. */
static bool refuse_clock(const struct fit *fit, const struct fit_data *data) {
    const double begin = fit->scene->state.t, ahead = data->t[0] - begin;
    if (ahead < 100 * length_of(data))
        return true;
    format_complain_line(
        data->path, 2,
        format_text("data: t begins at %.9g, but the motion starts at %.9g, earlier by %.3g times "
                    "the length of the data; t must count from the start of the motion",
                    data->t[0], begin, ahead / length_of(data)));
    return false;
}

/* Returns the usual time between rows, which is the median. *last: the row after the longest time. */
static double usual_spacing(const struct fit_data *data, int *last) {
    const int count = data->rows - 1;
    double *gaps = format_allocate_large((size_t)count, sizeof *gaps);
    *last = 1;
    for (int i = 0; i < count; i++) {
        gaps[i] = data->t[i + 1] - data->t[i];
        *last = gaps[i] > gaps[*last - 1] ? i + 1 : *last;
    }
    qsort(gaps, (size_t)count, sizeof *gaps, format_ascending);
    const double median = gaps[count / 2];
    free(gaps);
    return median;
}

/* Refuses a stray time, which would make the motion far longer than all other data. */
static bool refuse_stray_time(const struct fit_data *data) {
    enum { LONGER = 100 };
    int last;
    const double usual = usual_spacing(data, &last), ratio = length_of(data) / usual;
    if (ratio <= fmax(RECORD_KEPT_MAX, (double)LONGER * data->rows))
        return true;
    format_complain_line(
        data->path, 1,
        format_text("data: t = %.9g follows %.9g, and the data are %.3g times as long as the usual time "
                    "between rows, %.3g s; must be at most %.3g times; correct the time, or give each "
                    "recording its own file",
                    data->t[last], data->t[last - 1], ratio, usual,
                    fmax(RECORD_KEPT_MAX, (double)LONGER * data->rows)));
    return false;
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
    return is_good && refuse_stray_time(data) && refuse_clock(fit, data) && refuse_time_base(fit, data);
}

static long count_measurements(const struct fit_data *data, int width, int column) {
    long count = 0;
    for (int i = 0; i < data->rows; i++)
        count += !isnan(data->y[(size_t)i * (size_t)width + (size_t)column]);
    return count;
}

/* Refuses a column that no file has; a file may lack columns that others have. */
static bool refuse_missing(const struct fit *fit) {
    for (int k = 0; k < fit->signal_count; k++) {
        long count = 0;
        for (int i = 0; i < fit->data_count; i++)
            count += fit->data[i].is_held_out ? 0 : count_measurements(&fit->data[i], fit->signal_count, k);
        if (count > 0)
            continue;
        format_complain_line(
            fit->data[0].path, 1,
            format_text("data: %s has no measurement in %s; add its column, or omit it from %s",
                        fit->signals[k].name, fit->data_count > 1 ? "any file of the fit" : "this file",
                        fit_option_text(fit, "noise")));
        return false;
    }
    return true;
}

enum status fit_data_read(struct fit *fit) {
    double last = 0;
    for (int i = 0; i < fit->data_count; i++) {
        if (!read_file(fit, &fit->data[i]))
            return STATUS_FAULT;
        last = fmax(last, fit->data[i].t[fit->data[i].rows - 1]);
    }
    const enum status status = simulate_check_steps(fit->options, last - fit->scene->state.t);
    if (status != STATUS_DONE)
        return status;
    return refuse_missing(fit) ? STATUS_DONE : STATUS_FAULT;
}

enum status fit_data_imagine(struct fit *fit) {
    const struct options *options = fit->options;
    const double begin = fit->scene->state.t, length = options_number(options, "until") - begin;
    const enum status status = simulate_check_times(fit->scene, options, RECORD_KEPT_MAX);
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
