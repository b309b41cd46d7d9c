/* Sampled inputs from a CSV file: see inputs.h. */
#include "inputs.h"
#include "message.h"
#include "output.h"
#include "text.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A file being read: what each of its columns is. */
struct reading {
    struct inputs *inputs;
    const struct refdyn_model *model;
    long line;
    int *role; /* (column_count) number among the inputs' columns, or one of: */
    int column_count;
};

static const char byte_order_mark[] = "\xEF\xBB\xBF"; /* UTF-8's, which spreadsheets write */

enum { ROLE_NONE = -1, ROLE_TIME = -2 };

static bool refuse(const struct reading *reading, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static bool refuse(const struct reading *reading, const char *format, ...) {
    va_list list;
    va_start(list, format);
    fprintf(stderr, "%s:%ld: inputs: ", reading->inputs->path, reading->line);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    return false;
}

/* The next field of a line, cut off and without the blanks around it; *rest is NULL behind the last one. */
static char *next_field(char **rest) {
    char *field = *rest, *comma = strchr(field, ',');
    *rest = comma ? comma + 1 : NULL;
    if (comma)
        *comma = '\0';
    field += strspn(field, " \t");
    size_t length = strlen(field);
    while (length > 0 && strchr(" \t\r\n", field[length - 1]))
        field[--length] = '\0';
    return field;
}

static bool no_input(const struct reading *reading) {
    const struct refdyn_model *model = reading->model;
    if (model->input_count == 0)
        return refuse(reading, "the model has no inputs");
    char *names = text_format("%s", model->inputs[0].name);
    for (int i = 1; i < model->input_count; i++) {
        char *longer = text_format("%s, %s", names, model->inputs[i].name);
        free(names);
        names = longer;
    }
    refuse(reading, "no column is an input, those of the model are %s", names);
    free(names);
    return false;
}

static bool is_listed(const struct inputs *inputs, int place) {
    for (int i = 0; i < inputs->width; i++)
        if (inputs->place[i] == place)
            return true;
    return false;
}

/* A column that is no input is passed over; one that was meant to be an input is told of. */
static void warn_of_passed(const struct reading *reading, const char *const *columns) {
    const struct refdyn_model *model = reading->model;
    const char **missing = allocate((size_t)model->input_count, sizeof *missing);
    int count = 0;
    for (int i = 0; i < model->input_count; i++)
        if (!is_listed(reading->inputs, i))
            missing[count++] = model->inputs[i].name;
    for (int i = 0; i < reading->column_count; i++) {
        const char *near = reading->role[i] == ROLE_NONE ? nearest_name(columns[i], missing, count) : NULL;
        if (near)
            fprintf(stderr, "%s:%ld: warning: inputs: column %s is passed over, the nearest input is %s\n",
                    reading->inputs->path, reading->line, columns[i], near);
    }
    free(missing);
}

static bool read_columns(struct reading *reading, char *line, const char **columns) {
    struct inputs *inputs = reading->inputs;
    const struct refdyn_model *model = reading->model;
    bool has_time = false;
    for (char *rest = line; rest;) {
        const char *name = next_field(&rest);
        const int place = refdyn_find_name(model->inputs, model->input_count, name);
        const bool is_time = strcmp(name, "t") == 0;
        if (is_time ? has_time : is_listed(inputs, place))
            return refuse(reading, "two columns are called %s", name);
        has_time |= is_time;
        columns[reading->column_count] = name;
        reading->role[reading->column_count++] = is_time ? ROLE_TIME : place < 0 ? ROLE_NONE : inputs->width;
        if (!is_time && place >= 0)
            inputs->place[inputs->width++] = place;
    }
    if (!has_time)
        return refuse(reading, "no column is called t, the time of each sample is needed");
    warn_of_passed(reading, columns);
    return inputs->width > 0 || no_input(reading);
}

static bool read_header(struct reading *reading, char *line) {
    const size_t room = strlen(line) + 1;
    const char **columns = allocate(room, sizeof *columns);
    reading->role = allocate(room, sizeof *reading->role);
    reading->inputs->place = allocate((size_t)reading->model->input_count, sizeof *reading->inputs->place);
    if (strncmp(line, byte_order_mark, strlen(byte_order_mark)) == 0)
        line += strlen(byte_order_mark);
    const bool is_good = read_columns(reading, line, columns);
    free(columns);
    return is_good;
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

static bool read_value(const struct reading *reading, const char *field, double *value) {
    if (!number_of_text(field, value))
        return refuse(reading, "'%s' is no finite number", field);
    return true;
}

static bool read_row(struct reading *reading, char *line) {
    struct inputs *inputs = reading->inputs;
    add_room(inputs);
    int column = 0;
    for (char *rest = line; rest; column++) {
        const char *field = next_field(&rest);
        const int role = column < reading->column_count ? reading->role[column] : ROLE_NONE;
        double value;
        if (role == ROLE_NONE)
            continue;
        if (!read_value(reading, field, &value))
            return false;
        if (role == ROLE_TIME)
            inputs->t[inputs->count] = value;
        else
            inputs->values[inputs->count * inputs->width + role] = value;
    }
    if (column != reading->column_count)
        return refuse(reading, "%d fields under %d names", column, reading->column_count);
    if (inputs->count > 0 && !(inputs->t[inputs->count] > inputs->t[inputs->count - 1]))
        return refuse(reading, "t = %g does not lie behind the sample before", inputs->t[inputs->count]);
    inputs->count++;
    return true;
}

static bool is_blank(const char *line) {
    return line[strspn(line, " \t\r\n")] == '\0';
}

static bool read_lines(struct reading *reading, FILE *file) {
    char *line = NULL;
    size_t size = 0;
    bool is_good = true;
    while (is_good && getline(&line, &size, file) > 0) {
        reading->line++;
        if (reading->line == 1)
            is_good = read_header(reading, line);
        else if (!is_blank(line))
            is_good = read_row(reading, line);
    }
    free(line);
    if (is_good && reading->inputs->count == 0) {
        reading->line += reading->line == 0;
        is_good = refuse(reading, "no sample, a header and at least one line of numbers are needed");
    }
    return is_good;
}

bool inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model) {
    struct reading reading = {.inputs = inputs, .model = model};
    *inputs = (struct inputs){.path = path};
    FILE *file = fopen(path, "r");
    if (!file) {
        fprintf(stderr, "refdyn: %s: cannot be read: %s\n", path, strerror(errno));
        return false;
    }
    const bool is_good = read_lines(&reading, file);
    fclose(file);
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
