/*
 * Values and measured columns of a fit: finds in the model what the request names, and chooses the unknowns
 * of the search.
 *
 * In: the request, the scene, the columns of the motion. Out: fit->values in the order model, sensors,
 * starts; fit->signals; fit->variables, by which motions are differentiated: values of the model, then
 * starts.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

/* Bounds of a positive value if the user states none, as factors of its start: the search does not recover
 * from starts this far off. */
static const double factor_most = 1e6;

/* ---- Unknowns ---- */

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

struct fit_sensor fit_sensor_of(const struct fit *fit, int signal, const double *unknowns) {
    const struct fit_signal *own = &fit->signals[signal];
    struct fit_sensor sensor;
    for (int i = 0; i < FIT_SENSOR_COUNT; i++)
        sensor.is[i] = own->value[i] < 0 ? own->sensor[i]
                                         : fit_value_of(&fit->values[own->value[i]], unknowns[own->value[i]]);
    return sensor;
}

bool fit_sensor_is_scaled(const struct fit *fit, int signal) {
    return fit->signals[signal].value[FIT_OFFSET] >= 0 || fit->signals[signal].value[FIT_GAIN] >= 0;
}

/* ---- Messages ---- */

const char *fit_option_text(const struct fit *fit, const char *name) {
    return fit->request.path ? name : format_text("--%s", name);
}

/* The options, with messages about `option` at the place of its entry in FIT.lua. */
static const struct options *options_at(const struct fit *fit, const char *option, const char *place) {
    if (!place)
        return fit->options;
    struct options *options = format_allocate(1, sizeof *options);
    struct option_origin *origin = format_allocate(1, sizeof *origin);
    *origin = (struct option_origin){option, option, place};
    *options = *fit->options;
    options->origins = origin;
    options->origin_count = 1;
    return options;
}

/* ---- Values of the model ---- */

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

bool fit_is_of_state(const struct refdyn_variable *variable) {
    return variable->what == REFDYN_VARIED_COORDINATE || variable->what == REFDYN_VARIED_RATE;
}

/* Sets start, bounds and unknown. The search begins at the present value if it is within the bounds. */
static void set_range(struct fit_value *value, const struct fit_range *range, double present,
                      bool may_be_log) {
    value->start = range->has_start ? range->start : present;
    value->lower = range->is_bounded ? range->lower : -INFINITY;
    value->upper = range->is_bounded ? range->upper : INFINITY;
    if (value->start < value->lower || value->start > value->upper)
        value->start =
            value->lower > 0 ? sqrt(value->lower * value->upper) : (value->lower + value->upper) / 2;
    value->is_log = may_be_log && value->start > 0 && (!range->is_bounded || value->lower > 0);
    value->unit = unit_of(value->start, value->lower, value->upper);
    if (value->is_log && !range->is_bounded) {
        value->lower = value->start / factor_most;
        value->upper = value->start * factor_most;
    }
}

static enum status find_variable(struct fit *fit, const char *option, const struct fit_asked_value *asked,
                                 struct refdyn_variable *variable) {
    const char *name = asked->name;
    struct motion_derivatives one = {.option = option, .names = &name, .count = 1};
    const enum status status =
        simulate_derivatives_name(&one, fit->scene, options_at(fit, option, asked->place));
    if (status == STATUS_DONE)
        *variable = one.variables[0];
    return status;
}

static void add_variable(struct fit *fit, const char *name, const struct refdyn_variable *variable) {
    struct motion_derivatives *variables = &fit->variables;
    variables->names[variables->count] = name;
    variables->variables[variables->count++] = *variable;
}

static enum status find_value(struct fit *fit, const struct fit_asked_value *asked) {
    struct fit_value *value = &fit->values[fit->count];
    const struct options *options = options_at(fit, "vary", asked->place);
    *value = (struct fit_value){.name = asked->name, .kind = FIT_OF_MODEL, .column = fit->variables.count};
    if (text_index(asked->name, fit->variables.names, fit->variables.count) >= 0)
        return options_error(options, "vary", ": %s is given twice; give it once", asked->name);
    const enum status status = find_variable(fit, "vary", asked, &value->variable);
    if (status != STATUS_DONE)
        return status;
    const double present = present_value(fit, &value->variable);
    const bool is_state = fit_is_of_state(&value->variable);
    if (!asked->range.is_bounded && !is_state && present == 0)
        return options_error(options, "vary",
                             fit->request.path
                                 ? ": %s is 0, which says nothing about its size; give its range, %s = "
                                   "rd.within(FROM, TO)"
                                 : ": %s is 0, which says nothing about its size; give its range, %s=FROM:TO",
                             value->name, value->name);
    set_range(value, &asked->range, present, !is_state);
    add_variable(fit, asked->name, &value->variable);
    fit->count++;
    return STATUS_DONE;
}

/* ---- Measured columns and their sensors ---- */

static enum status find_signal(struct fit *fit, const struct fit_asked_column *asked,
                               struct fit_signal *signal) {
    const struct record_table *table = &fit->table;
    *signal = (struct fit_signal){.name = asked->name, .noise = asked->noise};
    signal->column = record_table_find(table, signal->name, strlen(signal->name));
    for (int i = 0; i < FIT_SENSOR_COUNT; i++) {
        signal->sensor[i] = asked->sensor[i].number;
        signal->value[i] = -1;
    }
    if (signal->column > 0)
        return STATUS_DONE;
    if (signal->column == 0)
        return options_error(options_at(fit, "noise", asked->place), "noise",
                             ": %s is the time, which has no noise", signal->name);
    return options_error(options_at(fit, "noise", asked->place), "noise", ": %s is no column of the motion%s",
                         signal->name,
                         message_nearest_advice(&format_memory, signal->name, table->names, table->count));
}

static enum status find_signals(struct fit *fit) {
    const struct fit_request *request = &fit->request;
    enum status status = STATUS_DONE;
    fit->signals = format_allocate((size_t)request->column_count, sizeof *fit->signals);
    fit->signal_count = fit->asked = request->column_count;
    for (int i = 0; i < request->column_count && status == STATUS_DONE; i++) {
        status = find_signal(fit, &request->columns[i], &fit->signals[i]);
        for (int k = 0; k < i && status == STATUS_DONE; k++)
            if (fit->signals[k].column == fit->signals[i].column)
                status = options_error(options_at(fit, "noise", request->columns[i].place), "noise",
                                       ": %s is given twice; give it once", fit->signals[i].name);
    }
    return status;
}

/* Unknown properties of sensors become values NAME_offset, NAME_gain and NAME_delay. */
static void add_sensors(struct fit *fit) {
    for (int k = 0; k < fit->signal_count; k++)
        for (int i = 0; i < FIT_SENSOR_COUNT; i++) {
            const struct fit_range *range = &fit->request.columns[k].sensor[i];
            if (!range->is_unknown)
                continue;
            struct fit_value *value = &fit->values[fit->count];
            *value =
                (struct fit_value){.name = format_text("%s_%s", fit->signals[k].name, fit_sensor_words[i]),
                                   .kind = (enum fit_kind)i,
                                   .signal = k};
            set_range(value, range, fit_sensor_ideal[i], i == FIT_GAIN);
            fit->signals[k].value[i] = fit->count++;
        }
}

/* ---- Starts of files ---- */

/* Finds the coordinates and rates of `starts`. */
static enum status find_starts(struct fit *fit, struct refdyn_variable *variables) {
    const struct fit_request *request = &fit->request;
    enum status status = STATUS_DONE;
    for (int i = 0; i < request->start_count && status == STATUS_DONE; i++) {
        const struct fit_asked_value *asked = &request->starts[i];
        const struct options *options = options_at(fit, "starts", asked->place);
        status = find_variable(fit, "starts", asked, &variables[i]);
        if (status == STATUS_DONE && !fit_is_of_state(&variables[i]))
            status = options_error(options, "starts",
                                   ": %s has no start; use a coordinate or its rate NAME_d", asked->name);
        else if (status == STATUS_DONE &&
                 text_index(asked->name, fit->variables.names, fit->variables.count) >= 0)
            status =
                options_error(options, "starts", ": %s is in vary, too; remove one of them", asked->name);
    }
    for (int i = 0; i < request->start_count && status == STATUS_DONE; i++)
        add_variable(fit, request->starts[i].name, &variables[i]);
    return status;
}

/* Adds the starts of each file; those of held-out files follow the values of the fit. */
static void add_starts(struct fit *fit, const struct refdyn_variable *variables) {
    const struct fit_request *request = &fit->request;
    const int first_column = fit->variables.count - request->start_count;
    fit->all_count = fit->count;
    for (int i = 0; i < fit->data_count; i++) {
        fit->data[i].first_start = fit->all_count;
        for (int k = 0; k < request->start_count; k++) {
            struct fit_value *value = &fit->values[fit->all_count++];
            const char *file = fit->data[i].name;
            *value = (struct fit_value){.name = *file ? format_text("%s@%s", request->starts[k].name, file)
                                                      : request->starts[k].name,
                                        .kind = FIT_START,
                                        .variable = variables[k],
                                        .column = first_column + k,
                                        .data = i};
            set_range(value, &request->starts[k].range, present_value(fit, &variables[k]), false);
        }
        if (!fit->data[i].is_held_out)
            fit->count = fit->all_count;
    }
}

/* The files, held-out ones last. With --check one imagined file replaces them. */
static void list_data(struct fit *fit) {
    const struct fit_request *request = &fit->request;
    if (options_has(fit->options, "check")) {
        fit->data = format_allocate(1, sizeof *fit->data);
        fit->data[0] = (struct fit_data){.path = "", .name = "", .weight = 1};
        fit->data_count = 1;
        return;
    }
    fit->data = format_allocate((size_t)request->data_count, sizeof *fit->data);
    for (int i = 0; i < request->data_count; i++)
        fit->data[i] = (struct fit_data){.path = request->data[i].path,
                                         .name = request->data[i].name,
                                         .weight = request->data[i].weight,
                                         .is_held_out = request->data[i].is_held_out};
    fit->data_count = request->data_count;
}

enum status fit_values_find(struct fit *fit) {
    const struct fit_request *request = &fit->request;
    list_data(fit);
    const size_t most = (size_t)(request->value_count + FIT_SENSOR_COUNT * request->column_count +
                                 fit->data_count * request->start_count),
                 names = (size_t)(request->value_count + request->start_count);
    struct refdyn_variable *starts = format_allocate((size_t)request->start_count, sizeof *starts);
    fit->values = format_allocate(most, sizeof *fit->values);
    fit->variables = (struct motion_derivatives){.option = "vary"};
    fit->variables.names = format_allocate(names, sizeof *fit->variables.names);
    fit->variables.variables = format_allocate(names, sizeof *fit->variables.variables);
    enum status status = STATUS_DONE;
    for (int i = 0; i < request->value_count && status == STATUS_DONE; i++)
        status = find_value(fit, &request->values[i]);
    if (status == STATUS_DONE)
        status = find_signals(fit);
    if (status == STATUS_DONE)
        status = find_starts(fit, starts);
    if (status != STATUS_DONE)
        return status;
    add_sensors(fit);
    add_starts(fit, starts);
    return STATUS_DONE;
}
