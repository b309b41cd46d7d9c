/* Reads sampled inputs from a CSV file, columns `t` and names of inputs, or from a motion as HDF5. Other
 * columns are skipped. The steps of the motion end at the samples. */
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "gen/base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The file while it is read, with the meaning of each column. */
struct reading {
    struct inputs *inputs;
    const struct refdyn_model *model;
    struct csv csv;
    int *role; /* (csv.count) number of the input's column, or one of: */
};

enum { ROLE_NONE = -1, ROLE_TIME = -2 };

static bool no_input(const struct reading *reading) {
    const struct refdyn_model *model = reading->model;
    if (model->input_count == 0)
        return format_csv_complain(&reading->csv, "the model has no inputs");
    const char *names = model->inputs[0].name;
    for (int i = 1; i < model->input_count; i++)
        names = format_text("%s, %s", names, model->inputs[i].name);
    return format_csv_complain(&reading->csv, "no column is an input, those of the model are %s", names);
}

/* The column of an input; -1 if there is none. In a motion in which another column has its name, this is the
 * column whose name has the kind in front (record.h). `t` is always the time. */
static int find_column(const char *const *names, int count, const char *name) {
    const int column = text_index(format_text("%s%s", record_input_lead, name), names, count);
    return column >= 0 || strcmp(name, "t") == 0 ? column : text_index(name, names, count);
}

static int find_input(const struct reading *reading, const char *name) {
    return find_column((const char *const *)reading->csv.names, reading->csv.count, name);
}

/* Skips a column that is no input, with a warning if it resembles one. */
static void warn_of_passed(const struct reading *reading) {
    const struct refdyn_model *model = reading->model;
    const struct csv *csv = &reading->csv;
    const char **missing = format_allocate((size_t)model->input_count, sizeof *missing);
    int count = 0;
    for (int i = 0; i < model->input_count; i++)
        if (find_input(reading, model->inputs[i].name) < 0)
            missing[count++] = model->inputs[i].name;
    for (int i = 0; i < csv->count; i++) {
        const char *near =
            reading->role[i] == ROLE_NONE ? message_nearest_name(csv->names[i], missing, count) : NULL;
        if (near)
            format_complain_line(csv->path, csv->line,
                                 format_text("warning: inputs: column %s is ignored; the nearest input is %s",
                                             csv->names[i], near));
    }
}

bool scene_inputs_are_set_by_event(const struct refdyn_model *model, int input) {
    for (int i = 0; i < model->change_count; i++)
        if (model->changes[i].what == REFDYN_CHANGED_INPUT && model->changes[i].place == input)
            return true;
    return false;
}

/* The first sampled input that events of the model set, -1 if there is none. */
static int find_set_by_event(const struct inputs *inputs, const struct refdyn_model *model) {
    for (int k = 0; k < inputs->samples.width; k++)
        if (scene_inputs_are_set_by_event(model, inputs->place[k]))
            return inputs->place[k];
    return -1;
}

static bool assign_columns(struct reading *reading) {
    struct inputs *inputs = reading->inputs;
    const struct csv *csv = &reading->csv;
    const struct refdyn_model *model = reading->model;
    reading->role = format_allocate((size_t)csv->count, sizeof *reading->role);
    inputs->place = format_allocate((size_t)model->input_count, sizeof *inputs->place);
    for (int i = 0; i < csv->count; i++)
        reading->role[i] = strcmp(csv->names[i], "t") == 0 ? ROLE_TIME : ROLE_NONE;
    for (int i = 0; i < model->input_count; i++) {
        const int column = find_input(reading, model->inputs[i].name);
        if (column < 0)
            continue;
        reading->role[column] = inputs->samples.width;
        inputs->place[inputs->samples.width++] = i;
    }
    if (format_csv_column(csv, "t") < 0)
        return format_csv_complain(csv, "no column is called t; add the time of each sample");
    inputs->samples.place = inputs->place;
    if (inputs->samples.width == 0)
        return no_input(reading);
    const int wrong = find_set_by_event(inputs, model);
    if (wrong >= 0)
        return format_csv_complain(csv, "column %s: events of the model set this input; samples must not",
                                   model->inputs[wrong].name);
    warn_of_passed(reading);
    return true;
}

/* Reads the time of a sample and its values. */
static double *row_of(const struct inputs *inputs, int sample) {
    return inputs->rows + (size_t)sample * (size_t)(inputs->samples.width + 1);
}

/* Room for one more sample. */
static double *next_row(struct inputs *inputs) {
    struct refdyn_samples *samples = &inputs->samples;
    inputs->rows = memory_room(&format_memory, inputs->rows, samples->count, &inputs->room,
                               (size_t)(samples->width + 1) * sizeof *inputs->rows);
    samples->rows = inputs->rows;
    return row_of(inputs, samples->count);
}

static bool take_row(struct reading *reading) {
    struct inputs *inputs = reading->inputs;
    const struct csv *csv = &reading->csv;
    struct refdyn_samples *samples = &inputs->samples;
    double *row = next_row(inputs);
    for (int i = 0; i < csv->count; i++) {
        const int role = reading->role[i];
        double value;
        if (role == ROLE_NONE)
            continue;
        if (!format_csv_number(csv, i, &value))
            return false;
        row[role == ROLE_TIME ? 0 : 1 + role] = value;
    }
    if (samples->count > 0 && !(*row > *row_of(inputs, samples->count - 1)))
        return format_csv_complain(csv, "t = %g does not follow the sample before it", *row);
    samples->count++;
    return true;
}

static bool take_rows(struct reading *reading) {
    int answer = 1;
    while (answer > 0 && (answer = format_csv_next(&reading->csv)) > 0)
        answer = take_row(reading) ? 1 : -1;
    if (answer == 0 && reading->inputs->samples.count == 0)
        return format_csv_complain(&reading->csv,
                                   "no sample; must have a header and at least one line of numbers");
    return answer == 0;
}

static bool take_motion(struct inputs *inputs, struct motion_reader *reader,
                        const struct refdyn_model *model) {
    int count, answer;
    const char *const *names = hdf5_motion_names(reader, &count);
    int *column = format_allocate((size_t)model->input_count, sizeof *column);
    double *values = format_allocate((size_t)count, sizeof *values);
    struct refdyn_samples *samples = &inputs->samples;
    inputs->place = format_allocate((size_t)model->input_count, sizeof *inputs->place);
    samples->place = inputs->place;
    for (int i = 0; i < model->input_count; i++) {
        column[samples->width] = find_column(names, count, model->inputs[i].name);
        if (column[samples->width] >= 0)
            inputs->place[samples->width++] = i;
    }
    if (samples->width == 0) {
        format_complain_line(inputs->path, 0, "inputs: no column is an input of the model");
        return false;
    }
    const int wrong = find_set_by_event(inputs, model);
    if (wrong >= 0) {
        format_complain_line(
            inputs->path, 0,
            format_text("inputs: column %s: events of the model set this input; samples must not",
                        model->inputs[wrong].name));
        return false;
    }
    const int time = text_index("t", names, count);
    while ((answer = hdf5_motion_next(reader, values)) > 0) {
        double *row = next_row(inputs);
        samples->count++;
        row[0] = values[time];
        for (int i = 0; i < samples->width; i++)
            row[1 + i] = values[column[i]];
    }
    return answer == 0 && samples->count > 0;
}

static bool read_motion(struct inputs *inputs, const char *path, const struct refdyn_model *model) {
    struct motion_reader *reader = hdf5_motion_open(path);
    const bool is_good = reader && take_motion(inputs, reader, model);
    hdf5_motion_close(reader);
    return is_good;
}

bool scene_inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model) {
    struct reading reading = {.inputs = inputs, .model = model};
    *inputs = (struct inputs){.path = path};
    if (format_names_hdf5(path))
        return read_motion(inputs, path, model);
    const bool is_good =
        format_csv_open(&reading.csv, path, "inputs") && assign_columns(&reading) && take_rows(&reading);
    format_csv_close(&reading.csv);
    return is_good;
}

void scene_inputs_set(struct inputs *inputs, double t, double *x) {
    inputs->next = refdyn_samples_set(&inputs->samples, t, x);
}
