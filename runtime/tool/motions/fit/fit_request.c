/*
 * What `fit` is asked: the values to be found (--vary NAME or NAME=FROM:TO) and the measured columns with the
 * standard deviations of their noise (--noise COLUMN=SIGMA).
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

/* Bounds of a positive value without bounds given by the user, as factors of its start: far beyond any start that
 * the search recovers from. */
static const double factor_most = 1e6;

/* The unknown of a value without a logarithm is the value itself in this unit: its size, or 1. */
static double unit_of(double start, double lower, double upper) {
    if (isfinite(lower) && isfinite(upper))
        return (upper - lower) / 2;
    return start != 0 ? fabs(start) : 1;
}

double fit_value_of(const struct fit_value *value, double unknown) {
    return value->is_log ? exp(unknown) : value->unit * unknown;
}

double fit_unknown_of(const struct fit_value *value, double number) {
    return value->is_log ? log(number) : number / value->unit;
}

/* The value that the motion has without the fit. */
static double present_value(const struct fit *fit, const struct refdyn_variable *variable) {
    const struct scene *scene = fit->scene;
    switch (variable->what) {
    case REFDYN_VARIED_PARAMETER:
        return scene->work.p[variable->place];
    case REFDYN_VARIED_INPUT:
        return scene->work.x[variable->place];
    case REFDYN_VARIED_COORDINATE:
        return scene->q[variable->place];
    default:
        return scene->qd[variable->place];
    }
}

static enum status set_range(const struct fit *fit, struct fit_value *value, const char *range) {
    const struct options *options = fit->options;
    const bool is_state =
        value->variable.what == REFDYN_VARIED_COORDINATE || value->variable.what == REFDYN_VARIED_RATE;
    const char *colon = range ? strchr(range, ':') : NULL;
    value->start = present_value(fit, &value->variable);
    value->lower = -INFINITY;
    value->upper = INFINITY;
    if (range &&
        (!colon || !text_to_number(format_text("%.*s", (int)(colon - range), range), &value->lower) ||
         !text_to_number(colon + 1, &value->upper)))
        return options_error(options, "vary", ": %s=%s: must be NAME or NAME=FROM:TO with two numbers",
                             value->name, range);
    if (!(value->lower < value->upper))
        return options_error(options, "vary", ": %s=%s: the range must ascend", value->name, range);
    if (!range && !is_state && value->start == 0)
        return options_error(options, "vary",
                             ": %s is 0, which says nothing about its size; give its range, %s=FROM:TO",
                             value->name, value->name);
    if (value->start < value->lower || value->start > value->upper)
        value->start =
            value->lower > 0 ? sqrt(value->lower * value->upper) : (value->lower + value->upper) / 2;
    value->is_log = !is_state && value->start > 0 && (!range || value->lower > 0);
    value->unit = unit_of(value->start, value->lower, value->upper);
    if (value->is_log && !range) {
        value->lower = value->start / factor_most;
        value->upper = value->start * factor_most;
    }
    return STATUS_DONE;
}

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

static enum status read_values(struct fit *fit) {
    const char **list = options_list(options_text(fit->options, "vary")), *range;
    struct motion_derivatives *variables = &fit->variables;
    fit->count = count_of(list);
    fit->values = format_allocate((size_t)fit->count, sizeof *fit->values);
    *variables = (struct motion_derivatives){
        .option = "vary", .names = format_allocate((size_t)fit->count, sizeof *list), .count = fit->count};
    for (int i = 0; i < fit->count; i++) {
        variables->names[i] = split(list[i], &range);
        if (text_index(variables->names[i], variables->names, i) >= 0)
            return options_error(fit->options, "vary", ": %s is given twice; give it once",
                                 variables->names[i]);
    }
    enum status status = simulate_derivatives_name(variables, fit->scene, fit->options);
    for (int i = 0; i < fit->count && status == STATUS_DONE; i++) {
        split(list[i], &range);
        fit->values[i] = (struct fit_value){.name = variables->names[i], .variable = variables->variables[i]};
        status = set_range(fit, &fit->values[i], range);
    }
    return status;
}

static enum status read_signal(struct fit *fit, const char *item, struct fit_signal *signal) {
    const struct record_table *table = &fit->table;
    const char *text;
    signal->name = split(item, &text);
    signal->column = record_table_find(table, signal->name, strlen(signal->name));
    if (!text || !text_to_number(text, &signal->noise))
        return options_error(fit->options, "noise", ": '%s' must be COLUMN=SIGMA, the standard deviation",
                             item);
    if (!(signal->noise > 0))
        return options_error(fit->options, "noise", ": %s=%s: must be positive", signal->name, text);
    if (signal->column > 0)
        return STATUS_DONE;
    const char *near =
        signal->column == 0 ? NULL : message_nearest_name(signal->name, table->names, table->count);
    return options_error(fit->options, "noise", ": %s %s%s%s", signal->name,
                         signal->column == 0 ? "is the time, which has no noise"
                                             : "is no column of the motion",
                         near ? "; the nearest is " : "", near ? near : "");
}

static enum status read_signals(struct fit *fit) {
    const char **list = options_list(options_text(fit->options, "noise"));
    enum status status = STATUS_DONE;
    const int count = count_of(list);
    fit->signals = format_allocate((size_t)count, sizeof *fit->signals);
    for (int i = 0; i < count && status == STATUS_DONE; i++) {
        struct fit_signal *signal = &fit->signals[i];
        status = read_signal(fit, list[i], signal);
        for (int k = 0; k < i && status == STATUS_DONE; k++)
            if (fit->signals[k].column == signal->column)
                status =
                    options_error(fit->options, "noise", ": %s is given twice; give it once", signal->name);
    }
    fit->signal_count = fit->asked = count;
    return status;
}

enum status fit_request_read(struct fit *fit) {
    const enum status status = read_values(fit);
    return status == STATUS_DONE ? read_signals(fit) : status;
}
