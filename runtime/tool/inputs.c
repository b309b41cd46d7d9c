/* Sampled inputs from a CSV file: see inputs.h. */
#include "inputs.h"
#include "csv.h"
#include "base/message.h"
#include "output.h"
#include "table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A file being read: what each of its columns is. */
struct reading {
    struct inputs *inputs;
    const struct refdyn_model *model;
    struct csv csv;
    int *role; /* (csv.count) number among the inputs' columns, or one of: */
};

enum { ROLE_NONE = -1, ROLE_TIME = -2 };

static bool no_input(const struct reading *reading) {
    const struct refdyn_model *model = reading->model;
    if (model->input_count == 0)
        return csv_complain(&reading->csv, "the model has no inputs");
    char *names = text_format("%s", model->inputs[0].name);
    for (int i = 1; i < model->input_count; i++) {
        char *longer = text_format("%s, %s", names, model->inputs[i].name);
        free(names);
        names = longer;
    }
    csv_complain(&reading->csv, "no column is an input, those of the model are %s", names);
    free(names);
    return false;
}

static int find_column(const struct csv *csv, const char *name) {
    for (int i = 0; i < csv->count; i++)
        if (strcmp(csv->names[i], name) == 0)
            return i;
    return -1;
}

/* The column of an input: in the CSV of a motion that has another column of its name, the one with the kind
 * before it (table.h). `t` is the time alone. */
static int find_input(const struct csv *csv, const char *name) {
    char *long_name = text_format("%s%s", table_input_lead, name);
    int column = find_column(csv, long_name);
    free(long_name);
    if (column < 0 && strcmp(name, "t") != 0)
        column = find_column(csv, name);
    return column;
}

/* A column that is no input is passed over; one that was meant to be an input is told of. */
static void warn_of_passed(const struct reading *reading) {
    const struct refdyn_model *model = reading->model;
    const struct csv *csv = &reading->csv;
    const char **missing = allocate((size_t)model->input_count, sizeof *missing);
    int count = 0;
    for (int i = 0; i < model->input_count; i++)
        if (find_input(csv, model->inputs[i].name) < 0)
            missing[count++] = model->inputs[i].name;
    for (int i = 0; i < csv->count; i++) {
        const char *near =
            reading->role[i] == ROLE_NONE ? message_nearest_name(csv->names[i], missing, count) : NULL;
        char *text = near ? text_format("warning: inputs: column %s is passed over, the nearest input is %s",
                                        csv->names[i], near)
                          : NULL;
        if (text)
            complain_line(csv->path, csv->line, text);
        free(text);
    }
    free(missing);
}

static bool assign_columns(struct reading *reading) {
    struct inputs *inputs = reading->inputs;
    const struct csv *csv = &reading->csv;
    const struct refdyn_model *model = reading->model;
    reading->role = allocate((size_t)csv->count, sizeof *reading->role);
    inputs->place = allocate((size_t)model->input_count, sizeof *inputs->place);
    for (int i = 0; i < csv->count; i++)
        reading->role[i] = strcmp(csv->names[i], "t") == 0 ? ROLE_TIME : ROLE_NONE;
    for (int i = 0; i < model->input_count; i++) {
        const int column = find_input(csv, model->inputs[i].name);
        if (column < 0)
            continue;
        reading->role[column] = inputs->width;
        inputs->place[inputs->width++] = i;
    }
    if (find_column(csv, "t") < 0)
        return csv_complain(csv, "no column is called t, the time of each sample is needed");
    if (inputs->width == 0)
        return no_input(reading);
    warn_of_passed(reading);
    return true;
}

static void add_room(struct inputs *inputs) {
    if (inputs->count < inputs->room)
        return;
    inputs->room = 2 * inputs->room + 64;
    double *t = allocate((size_t)inputs->room, sizeof *t);
    double *values = allocate((size_t)(inputs->room * inputs->width), sizeof *values);
    if (inputs->count > 0) {
        memcpy(t, inputs->t, (size_t)inputs->count * sizeof *t);
        memcpy(values, inputs->values, (size_t)(inputs->count * inputs->width) * sizeof *values);
    }
    free(inputs->t);
    free(inputs->values);
    inputs->t = t;
    inputs->values = values;
}

static bool take_row(struct reading *reading) {
    struct inputs *inputs = reading->inputs;
    const struct csv *csv = &reading->csv;
    add_room(inputs);
    for (int i = 0; i < csv->count; i++) {
        const int role = reading->role[i];
        double value;
        if (role == ROLE_NONE)
            continue;
        if (!csv_number(csv, i, &value))
            return false;
        if (role == ROLE_TIME)
            inputs->t[inputs->count] = value;
        else
            inputs->values[inputs->count * inputs->width + role] = value;
    }
    if (inputs->count > 0 && !(inputs->t[inputs->count] > inputs->t[inputs->count - 1]))
        return csv_complain(csv, "t = %g does not lie behind the sample before", inputs->t[inputs->count]);
    inputs->count++;
    return true;
}

static bool take_rows(struct reading *reading) {
    int answer = 1;
    while (answer > 0 && (answer = csv_next(&reading->csv)) > 0)
        answer = take_row(reading) ? 1 : -1;
    if (answer == 0 && reading->inputs->count == 0)
        return csv_complain(&reading->csv, "no sample, a header and at least one line of numbers are needed");
    return answer == 0;
}

bool inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model) {
    struct reading reading = {.inputs = inputs, .model = model};
    *inputs = (struct inputs){.path = path};
    const bool is_good =
        csv_open(&reading.csv, path, "inputs") && assign_columns(&reading) && take_rows(&reading);
    csv_close(&reading.csv);
    free(reading.role);
    return is_good;
}

void inputs_set(struct inputs *inputs, double t, double *x) {
    if (inputs->next > 0 && t < inputs->t[inputs->next - 1])
        inputs->next = 0; /* another motion begins */
    while (inputs->next < inputs->count && inputs->t[inputs->next] <= t)
        inputs->next++;
    const long sample = inputs->next > 0 ? inputs->next - 1 : 0;
    for (int i = 0; i < inputs->width; i++)
        x[inputs->place[i]] = inputs->values[sample * inputs->width + i];
    if (inputs->next == 0)
        inputs->next = 1; /* the first value holds before it, too: nothing changes there */
}

double inputs_next(const struct inputs *inputs) {
    return inputs->next < inputs->count ? inputs->t[inputs->next] : INFINITY;
}

void inputs_release(struct inputs *inputs) {
    free(inputs->place);
    free(inputs->t);
    free(inputs->values);
    *inputs = (struct inputs){.count = 0};
}
