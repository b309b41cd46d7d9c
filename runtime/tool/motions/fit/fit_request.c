/*
 * A request on the command line: the values to be found (--vary NAME or NAME=FROM:TO), the measured
 * columns with the standard deviations of their noise (--noise COLUMN=SIGMA), and files of data.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

const char *const fit_sensor_words[] = {"offset", "gain", "delay"};
const double fit_sensor_ideal[] = {0, 1, 0};

static int count_of(const char *const *list) {
    int count = 0;
    while (list[count])
        count++;
    return count;
}

/* NAME of NAME=TEXT; *text becomes NULL without the sign. */
static const char *split(const char *item, const char **text) {
    const char *sign = strchr(item, '=');
    *text = sign ? sign + 1 : NULL;
    return sign ? format_text("%.*s", (int)(sign - item), item) : item;
}

static enum status read_value(const struct options *options, const char *item,
                              struct fit_asked_value *value) {
    struct fit_range *range = &value->range;
    const char *text, *colon;
    value->name = split(item, &text);
    *range = (struct fit_range){
        .is_unknown = true, .is_bounded = text != NULL, .lower = -INFINITY, .upper = INFINITY};
    if (!text)
        return STATUS_DONE;
    colon = strchr(text, ':');
    if (!colon || !text_to_number(format_text("%.*s", (int)(colon - text), text), &range->lower) ||
        !text_to_number(colon + 1, &range->upper))
        return options_error(options, "vary", ": %s=%s: must be NAME or NAME=FROM:TO with two numbers",
                             value->name, text);
    if (!(range->lower < range->upper))
        return options_error(options, "vary", ": %s=%s: the range must ascend", value->name, text);
    return STATUS_DONE;
}

static enum status read_values(const struct options *options, struct fit_request *request) {
    const char **list = options_list(options_text(options, "vary"));
    enum status status = STATUS_DONE;
    request->value_count = count_of(list);
    request->values = format_allocate((size_t)request->value_count, sizeof *request->values);
    for (int i = 0; i < request->value_count && status == STATUS_DONE; i++)
        status = read_value(options, list[i], &request->values[i]);
    return status;
}

static enum status read_column(const struct options *options, const char *item,
                               struct fit_asked_column *column) {
    const char *text;
    column->name = split(item, &text);
    for (int i = 0; i < FIT_SENSOR_COUNT; i++)
        column->sensor[i] = (struct fit_range){.number = fit_sensor_ideal[i]};
    if (!text || !text_to_number(text, &column->noise))
        return options_error(options, "noise", ": '%s' must be COLUMN=SIGMA, the standard deviation", item);
    if (!(column->noise > 0))
        return options_error(options, "noise", ": %s=%s: must be positive", column->name, text);
    return STATUS_DONE;
}

static enum status read_columns(const struct options *options, struct fit_request *request) {
    const char **list = options_list(options_text(options, "noise"));
    enum status status = STATUS_DONE;
    request->column_count = count_of(list);
    request->columns = format_allocate((size_t)request->column_count, sizeof *request->columns);
    for (int i = 0; i < request->column_count && status == STATUS_DONE; i++)
        status = read_column(options, list[i], &request->columns[i]);
    return status;
}

static void list_data(const struct options *options, struct fit_request *request) {
    const char **held_out = options_list(options_text(options, "held-out"));
    const int used = options->operand_count - 1;
    request->data_count = used + count_of(held_out);
    request->data = format_allocate((size_t)request->data_count, sizeof *request->data);
    for (int i = 0; i < request->data_count; i++) {
        const char *path = i < used ? options->operands[1 + i] : held_out[i - used];
        request->data[i] =
            (struct fit_asked_data){.name = path, .path = path, .weight = 1, .is_held_out = i >= used};
    }
}

enum status fit_request_read(const struct options *options, struct fit_request *request) {
    enum status status = read_values(options, request);
    if (status == STATUS_DONE)
        status = read_columns(options, request);
    if (status == STATUS_DONE)
        list_data(options, request);
    return status;
}
