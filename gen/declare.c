/* Options, parameters, inputs and settings: see declare.h. */
#include "declare.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void declarations_start(struct declarations *declarations, struct memory *memory, struct graph *graph,
                        const struct read_request *request, struct messages *messages) {
    *declarations =
        (struct declarations){.memory = memory, .graph = graph, .messages = messages, .request = request};
    declarations->setting_used =
        memory_get(memory, (size_t)request->setting_count * sizeof *declarations->setting_used + 1);
}

/* The last setting of that name counts, NULL: none. */
static const char *setting_of(struct declarations *declarations, const char *name) {
    const char *value = NULL;
    for (int i = 0; i < declarations->request->setting_count; i++) {
        if (strcmp(declarations->request->settings[i].name, name) == 0) {
            declarations->setting_used[i] = true;
            value = declarations->request->settings[i].value;
        }
    }
    return value;
}

/* `value` stays as it is when the text is no finite number. */
static bool parse_number(const char *text, double *value) {
    char *end;
    double parsed = strtod(text, &end);
    if (end == text || *end != 0 || !isfinite(parsed))
        return false;
    *value = parsed;
    return true;
}

static struct place command_line(const struct declarations *declarations) {
    return (struct place){.file = declarations->request->file};
}

static void complain_of_setting(const struct declarations *declarations, const char *name, const char *value,
                                const char *needed) {
    complain(declarations->messages, command_line(declarations), "--set %s: value \"%s\", %s is needed", name,
             value, needed);
}

static struct value option_from_text(struct declarations *declarations, const char *name,
                                     const struct value *standard, const char *text) {
    struct value value = *standard;
    if (standard->kind == VALUE_NUMBER) {
        bool is_number = parse_number(text, &value.number);
        bool is_allowed = is_number && (!standard->is_whole || value.number == floor(value.number));
        if (!is_allowed) {
            complain_of_setting(declarations, name, text, standard->is_whole ? "a whole number" : "a number");
            return *standard;
        }
    } else if (standard->kind == VALUE_BOOLEAN) {
        value.truth = strcmp(text, "true") == 0;
        if (!value.truth && strcmp(text, "false") != 0)
            complain_of_setting(declarations, name, text, "true or false");
    } else {
        value.text = memory_text(declarations->memory, text);
    }
    return value;
}

static const char *value_text(struct memory *memory, const struct value *value) {
    if (value->kind == VALUE_TEXT)
        return value->text;
    if (value->kind == VALUE_BOOLEAN)
        return value->truth ? "true" : "false";
    return memory_format(memory, "%.15g", value->number);
}

static bool is_choice(struct memory *memory, const struct value *value, const struct value *allowed) {
    for (int i = 0; i < allowed->item_count; i++)
        if (strcmp(value_text(memory, value), value_text(memory, &allowed->items[i])) == 0)
            return true;
    return allowed->item_count == 0;
}

/* `allowed` is a list of values, or { from = least, to = largest }. */
static bool is_allowed(struct memory *memory, const struct value *value, const struct value *allowed) {
    const struct value *from = find_field(allowed, "from"), *to = find_field(allowed, "to");
    bool is_within = (!from || value->number >= from->number) && (!to || value->number <= to->number);
    return is_within && is_choice(memory, value, allowed);
}

static const char *allowed_text(struct memory *memory, const struct value *allowed) {
    const struct value *from = find_field(allowed, "from"), *to = find_field(allowed, "to");
    const char *text = allowed->item_count > 0 ? "one of" : "a number";
    for (int i = 0; i < allowed->item_count; i++)
        text =
            memory_format(memory, "%s%s %s", text, i > 0 ? "," : "", value_text(memory, &allowed->items[i]));
    if (from)
        text = memory_format(memory, "%s from %s", text, value_text(memory, from));
    if (to)
        text = memory_format(memory, "%s up to %s", text, value_text(memory, to));
    return text;
}

struct value declare_option(struct declarations *declarations, struct place place, const char *name,
                            const struct value *standard, const struct value *allowed) {
    struct memory *memory = declarations->memory;
    const char *text = setting_of(declarations, name);
    struct value value = text ? option_from_text(declarations, name, standard, text) : *standard;
    if (allowed && !is_allowed(memory, &value, allowed)) {
        complain(declarations->messages, text ? command_line(declarations) : place,
                 "option %s: value \"%s\", %s is needed", name, value_text(memory, &value),
                 allowed_text(memory, allowed));
        value = *standard;
    }
    declarations->options = memory_room(memory, declarations->options, declarations->option_count,
                                        &declarations->option_capacity, sizeof *declarations->options);
    declarations->options[declarations->option_count++] =
        (struct option){.name = name, .value = value_text(memory, &value), .place = place};
    return value;
}

/* Values at the start of a motion become the values that they are taken of. */
static expression base_of_start(void *context, struct graph *graph, expression e) {
    (void)context;
    const struct symbol *symbol = as_symbol(graph, e);
    return symbol->kind == SYMBOL_START ? (expression)symbol->index : e;
}

static double parameter_value(void *context, const struct symbol *symbol) {
    const struct parameter *parameters = context;
    return symbol->kind == SYMBOL_PARAMETER ? parameters[symbol->index].value : 0;
}

double value_at_parameters(struct graph *graph, const struct parameter *parameters, expression e) {
    struct parameter *context = (struct parameter *)(uintptr_t)parameters; /* only read */
    return evaluate(graph, e, parameter_value, context);
}

static void set_standard(struct declarations *declarations, struct parameter *parameter,
                         const struct value *standard) {
    struct graph *graph = declarations->graph;
    expression e;
    if (!value_expression(graph, standard, &e)) {
        complain(declarations->messages, parameter->place,
                 "parameter %s: %s, a number or an expression is needed", parameter->name,
                 kind_text(standard->kind));
    } else if (is_number(graph, e, &parameter->value)) {
        return;
    } else if (graph->nodes[e].depends & (ON_TIME | ON_INPUT | ON_STATE | ON_RATE)) {
        complain(declarations->messages, parameter->place,
                 "parameter %s: depends on the motion, s.start gives values at its start", parameter->name);
    } else {
        parameter->is_anchored = true;
        substitute(graph, base_of_start, NULL, &e, &parameter->anchor, 1);
        if (!(graph->nodes[e].depends & ON_START))
            parameter->value = value_at_parameters(graph, declarations->parameters, e);
    }
}

expression parameter_expression(const struct declarations *declarations, int index) {
    const struct parameter *parameter = &declarations->parameters[index];
    if (declarations->request->fold && (!parameter->is_anchored || parameter->is_given))
        return number(declarations->graph, parameter->value);
    return symbol(declarations->graph, SYMBOL_PARAMETER, index, 0);
}

expression declare_parameter(struct declarations *declarations, struct place place, const char *name,
                             const struct value *standard, const char *unit) {
    struct parameter parameter = {.name = name, .unit = unit, .place = place};
    set_standard(declarations, &parameter, standard);
    const char *text = setting_of(declarations, name);
    if (text && parse_number(text, &parameter.value))
        parameter.is_given = true;
    else if (text)
        complain_of_setting(declarations, name, text, "a number");
    declarations->parameters =
        memory_room(declarations->memory, declarations->parameters, declarations->parameter_count,
                    &declarations->parameter_capacity, sizeof *declarations->parameters);
    declarations->parameters[declarations->parameter_count++] = parameter;
    return parameter_expression(declarations, declarations->parameter_count - 1);
}

void declare_parameters(struct declarations *declarations, const struct value *list) {
    for (int i = 0; i < list->item_count; i++) {
        const struct value *entry = &list->items[i];
        const struct value *part = entry->items;
        bool has_name = entry->kind == VALUE_TABLE && entry->item_count >= 2 && part[0].kind == VALUE_TEXT;
        bool has_unit = has_name && entry->item_count == 3 && part[2].kind == VALUE_TEXT;
        if (!has_name || (entry->item_count > 2 && !has_unit) || entry->field_count > 0)
            complain(declarations->messages, entry->place,
                     "parameters[%d]: %s, { \"name\", value, \"unit\" } is needed", i + 1,
                     entry->kind == VALUE_TABLE ? "not of that form" : kind_text(entry->kind));
        else
            declare_parameter(declarations, entry->place, part[0].text, &part[1],
                              has_unit ? part[2].text : "");
    }
    for (int i = 0; i < list->field_count; i++)
        complain(declarations->messages, list->fields[i].value.place,
                 "parameters.%s: a named entry, { \"%s\", value, \"unit\" } is needed", list->fields[i].name,
                 list->fields[i].name);
}

expression declare_input(struct declarations *declarations, struct place place, const char *name,
                         double standard, const char *unit) {
    struct input input = {.name = name, .unit = unit, .place = place, .value = standard};
    const char *text = setting_of(declarations, name);
    if (text && !parse_number(text, &input.value))
        complain_of_setting(declarations, name, text, "a number");
    declarations->inputs = memory_room(declarations->memory, declarations->inputs, declarations->input_count,
                                       &declarations->input_capacity, sizeof *declarations->inputs);
    declarations->inputs[declarations->input_count++] = input;
    return symbol(declarations->graph, SYMBOL_INPUT, declarations->input_count - 1, 0);
}

static const char *nearest_declared(const struct declarations *declarations, const char *name) {
    int count = declarations->option_count + declarations->parameter_count + declarations->input_count;
    const char **names = memory_get(declarations->memory, ((size_t)count + 1) * sizeof *names);
    int at = 0;
    for (int i = 0; i < declarations->option_count; i++)
        names[at++] = declarations->options[i].name;
    for (int i = 0; i < declarations->parameter_count; i++)
        names[at++] = declarations->parameters[i].name;
    for (int i = 0; i < declarations->input_count; i++)
        names[at++] = declarations->inputs[i].name;
    return nearest_name(name, names, count);
}

void complain_of_unknown_settings(const struct declarations *declarations) {
    for (int i = 0; i < declarations->request->setting_count; i++) {
        const char *name = declarations->request->settings[i].name;
        if (declarations->setting_used[i])
            continue;
        const char *nearest = nearest_declared(declarations, name);
        if (nearest)
            complain(declarations->messages, command_line(declarations),
                     "--set %s: unknown option or parameter, the nearest known one is \"%s\"", name, nearest);
        else
            complain(declarations->messages, command_line(declarations),
                     "--set %s: the model has no option or parameter of that name", name);
    }
}
