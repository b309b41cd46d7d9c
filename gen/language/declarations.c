/*
 * Options, parameters and inputs of a model, with the settings of the command line (--set). Reads values with
 * their places; returns the value of an option, or the symbol of a parameter or input.
 */
#include "gen/language/language.h"

#include <math.h>
#include <string.h>

void declarations_start(struct declarations *declarations, struct memory *memory, struct graph *graph,
                        const struct read_request *request, struct messages *messages) {
    *declarations =
        (struct declarations){.memory = memory, .graph = graph, .messages = messages, .request = request};
    declarations->setting_kind =
        memory_get(memory, ((size_t)request->setting_count + 1) * sizeof *declarations->setting_kind);
}

static struct place command_line(const struct declarations *declarations) {
    return (struct place){.file = declarations->request->file};
}

const char *setting_source(const struct setting *setting) {
    return setting->source ? setting->source : "--set";
}

/* `place`: where the model declares the name. */
static void refuse_setting(const struct declarations *declarations, struct place place,
                           const struct setting *setting, const char *needed) {
    const char *advice =
        strcmp(needed, "a number") == 0 ? message_number_advice(declarations->memory, setting->value) : "";
    message_error(declarations->messages, place, "%s %s: value \"%s\"; must be %s%s", setting_source(setting),
                  setting->name, setting->value, needed, advice);
}

/* The last setting of that name; NULL if there is none. A name of two kinds is an error, since the setting
 * would change both. */
static const struct setting *setting_of(struct declarations *declarations, struct place place,
                                        const char *kind, const char *name) {
    const struct setting *settings = declarations->request->settings, *last = NULL;
    for (int i = 0; i < declarations->request->setting_count; i++) {
        if (strcmp(settings[i].name, name) != 0)
            continue;
        const char *other = declarations->setting_kind[i];
        if (other && strcmp(other, kind) != 0)
            message_error(declarations->messages, place,
                          "--set %s: the model has this name as %s and as %s; rename one of them", name,
                          other, kind);
        declarations->setting_kind[i] = kind;
        last = &settings[i];
    }
    return last;
}

/* Whether the number is whole and exact both in Lua and in C. */
static bool is_whole(double value) {
    const double largest = 9007199254740992; /* 2^53 */
    return value == floor(value) && fabs(value) <= largest;
}

static struct value option_from_setting(struct declarations *declarations, struct place place,
                                        const struct setting *setting, const struct value *standard) {
    const char *text = setting->value;
    struct value value = *standard;
    if (standard->kind == VALUE_NUMBER) {
        bool is_number = text_to_number(text, &value.number);
        if (!is_number || (standard->is_whole && !is_whole(value.number))) {
            refuse_setting(declarations, place, setting, standard->is_whole ? "a whole number" : "a number");
            return *standard;
        }
    } else if (standard->kind == VALUE_BOOLEAN) {
        value.truth = strcmp(text, "true") == 0;
        if (!value.truth && strcmp(text, "false") != 0)
            refuse_setting(declarations, place, setting, "true or false");
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

/* The error in the list of values that an option may have, or NULL. */
static const char *fault_of_list(struct memory *memory, const struct value *standard,
                                 const struct value *allowed) {
    for (int i = 0; i < allowed->item_count; i++) {
        const struct value *item = &allowed->items[i];
        if (item->kind == VALUE_NOTHING)
            continue; /* a gap, reported before */
        if (item->kind != standard->kind)
            return memory_format(memory, "value %d is %s; must be %s, as the default is", i + 1,
                                 value_kind_text(item->kind), value_kind_text(standard->kind));
        for (int j = 0; j < i; j++)
            if (strcmp(value_text(memory, item), value_text(memory, &allowed->items[j])) == 0)
                return memory_format(memory, "\"%s\" is given twice; give it once", value_text(memory, item));
    }
    return allowed->item_count > 0 ? NULL : "empty; must be a list of values or { from = 1, to = 9 }";
}

static const char *fault_of_range(struct memory *memory, const struct value *standard,
                                  const struct value *allowed) {
    const struct value *from = value_find_field(allowed, "from"), *to = value_find_field(allowed, "to");
    if (standard->kind != VALUE_NUMBER)
        return memory_format(memory, "a range, but the default is %s; must be a list of values",
                             value_kind_text(standard->kind));
    if ((from && from->kind != VALUE_NUMBER) || (to && to->kind != VALUE_NUMBER))
        return "from or to is not a number; write { from = 1, to = 9 }";
    if (from && to && !(from->number <= to->number))
        return memory_format(memory, "from %.15g to %.15g; the range must ascend", from->number, to->number);
    return NULL;
}

/* `allowed` is a list of values of the default's kind, or { from = least, to = largest }. */
static bool is_range_or_list(struct declarations *declarations, const char *name,
                             const struct value *standard, const struct value *allowed) {
    static const char *const bounds[] = {"from", "to"};
    struct memory *memory = declarations->memory;
    const char *fault = NULL;
    for (int i = 0; i < allowed->field_count && !fault; i++) {
        const char *bound = allowed->fields[i].name;
        if (text_index(bound, bounds, 2) < 0)
            fault = memory_format(memory, "unknown field \"%s\"%s", bound,
                                  message_advice_on_name(memory, bound, bounds, 2));
    }
    if (!fault && allowed->field_count > 0 && allowed->item_count > 0)
        fault = "a list of values and a range; give one of them";
    if (!fault)
        fault = allowed->field_count > 0 ? fault_of_range(memory, standard, allowed)
                                         : fault_of_list(memory, standard, allowed);
    if (fault)
        message_error(declarations->messages, allowed->place, "option %s: allowed: %s", name, fault);
    return !fault;
}

static bool is_allowed(struct memory *memory, const struct value *value, const struct value *allowed) {
    const struct value *from = value_find_field(allowed, "from"), *to = value_find_field(allowed, "to");
    bool is_within = (!from || value->number >= from->number) && (!to || value->number <= to->number);
    return is_within && is_choice(memory, value, allowed);
}

static const char *allowed_text(struct memory *memory, const struct value *allowed) {
    const struct value *from = value_find_field(allowed, "from"), *to = value_find_field(allowed, "to");
    const char *text = allowed->item_count > 0 ? "one of" : "a number";
    for (int i = 0; i < allowed->item_count; i++)
        text =
            memory_format(memory, "%s%s %s", text, i > 0 ? "," : "", value_text(memory, &allowed->items[i]));
    if (from)
        text = memory_format(memory, "%s from %s", text, value_text(memory, from));
    if (to)
        text = memory_format(memory, "%s%s %s", text, from ? " to" : " up to", value_text(memory, to));
    return text;
}

struct value declarations_add_option(struct declarations *declarations, struct place place, const char *name,
                                     const struct value *standard, const struct value *allowed) {
    struct memory *memory = declarations->memory;
    const struct setting *setting = setting_of(declarations, place, "option", name);
    struct value value = setting ? option_from_setting(declarations, place, setting, standard) : *standard;
    if (standard->kind == VALUE_NUMBER && !isfinite(standard->number)) {
        message_error(declarations->messages, place, "option %s: value %s; must be finite", name,
                      text_not_finite(standard->number));
        value.number = setting ? value.number : 1; /* so that no further error follows */
    } else if (allowed && is_range_or_list(declarations, name, standard, allowed) &&
               !is_allowed(memory, &value, allowed)) {
        message_error(declarations->messages, place, "option %s: value \"%s\"; must be %s", name,
                      value_text(memory, &value), allowed_text(memory, allowed));
        value = *standard;
    }
    declarations->options = memory_room(memory, declarations->options, declarations->option_count,
                                        &declarations->option_capacity, sizeof *declarations->options);
    declarations->options[declarations->option_count++] =
        (struct model_option){.name = name,
                              .value = value_text(memory, &value),
                              .is_text = value.kind == VALUE_TEXT,
                              .place = place};
    return value;
}

/* Replaces a value at the start of a motion by the variable whose value it is. */
static expression base_of_start(void *context, struct graph *graph, expression e) {
    (void)context;
    const struct symbol *symbol = expr_as_symbol(graph, e);
    return symbol->kind == SYMBOL_START ? (expression)symbol->index : e;
}

/* Whether a value depends on a parameter that is known only at the start of a motion. */
static bool waits_for_start(const struct declarations *declarations, expression e) {
    int count;
    const expression *symbols = rewrite_list_symbols(declarations->graph, e, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(declarations->graph, symbols[i]);
        if (symbol->kind == SYMBOL_PARAMETER && declarations->parameters[symbol->index].is_late)
            return true;
    }
    return false;
}

/* Whether a parameter's default depends on the state at the start. */
static bool depends_on_start(const struct declarations *declarations, const struct parameter *parameter) {
    if (!parameter->is_anchored || parameter->is_given)
        return false;
    if (declarations->graph->nodes[parameter->anchor].depends & (ON_STATE | ON_RATE))
        return true;
    int count;
    declarations_start_values(declarations, parameter->anchor, &count);
    return count > 0;
}

const char **declarations_start_values(const struct declarations *declarations, expression e, int *count) {
    int symbol_count;
    const expression *symbols = rewrite_list_symbols(declarations->graph, e, &symbol_count);
    const char **names = memory_get(declarations->memory, ((size_t)symbol_count + 1) * sizeof *names);
    *count = 0;
    for (int i = 0; i < symbol_count; i++) {
        const struct symbol *symbol = expr_as_symbol(declarations->graph, symbols[i]);
        if (symbol->kind == SYMBOL_PARAMETER &&
            depends_on_start(declarations, &declarations->parameters[symbol->index]))
            names[(*count)++] = declarations->parameters[symbol->index].name;
    }
    return names;
}

bool parameters_are_known(const struct declarations *declarations, expression e, double *value) {
    if (declarations->graph->nodes[e].depends & ~ON_PARAMETER || waits_for_start(declarations, e))
        return false;
    *value = parameters_evaluate(declarations->graph, declarations->parameters, e);
    return true;
}

static void set_standard(struct declarations *declarations, struct parameter *parameter,
                         const struct value *standard) {
    struct graph *graph = declarations->graph;
    expression e;
    if (!value_expression(graph, standard, &e)) {
        if (standard->kind != VALUE_NOTHING) /* a gap, reported before */
            message_error(declarations->messages, parameter->place,
                          "parameter %s: %s; must be a number or an expression", parameter->name,
                          value_kind_text(standard->kind));
        parameter->value = 1;
    } else if (expr_is_number(graph, e, &parameter->value)) {
        return;
    } else if (graph->nodes[e].depends & (ON_TIME | ON_INPUT | ON_STATE | ON_RATE)) {
        message_error(declarations->messages, parameter->place,
                      "parameter %s: depends on the motion; use s.start for values at its start",
                      parameter->name);
    } else {
        parameter->is_anchored = true;
        rewrite_substitute(graph, base_of_start, NULL, &e, &parameter->anchor, 1);
        parameter->is_late = !parameters_are_known(declarations, e, &parameter->value);
    }
}

/* Requirements of plain numbers need not be kept. */
static bool hangs_on_parameters(const struct declarations *declarations,
                                const struct requirement *requirement) {
    for (int i = 0; i < requirement->count; i++)
        if (declarations->graph->nodes[requirement->values[i]].depends)
            return true;
    return false;
}

const char *declarations_require(struct declarations *declarations, struct requirement requirement) {
    const char *fault =
        requirement_broken(declarations->memory, declarations->graph, declarations->parameters, &requirement);
    if (fault || !hangs_on_parameters(declarations, &requirement))
        return fault;
    declarations->requirements =
        memory_room(declarations->memory, declarations->requirements, declarations->requirement_count,
                    &declarations->requirement_capacity, sizeof *declarations->requirements);
    declarations->requirements[declarations->requirement_count++] = requirement;
    return NULL;
}

expression declarations_parameter_expression(const struct declarations *declarations, int index) {
    const struct parameter *parameter = &declarations->parameters[index];
    if (declarations->request->fold && !parameter->is_mode &&
        (!parameter->is_anchored || parameter->is_given))
        return expr_number(declarations->graph, parameter->value);
    return expr_symbol(declarations->graph, SYMBOL_PARAMETER, index, 0);
}

expression declarations_add_parameter(struct declarations *declarations, struct place place, const char *name,
                                      const struct value *standard, const char *unit) {
    struct parameter parameter = {.name = name, .unit = unit, .place = place};
    set_standard(declarations, &parameter, standard);
    const struct setting *setting = setting_of(declarations, place, "parameter", name);
    if (setting && text_to_number(setting->value, &parameter.value))
        parameter.is_given = true;
    else if (setting)
        refuse_setting(declarations, place, setting, "a number");
    parameter.is_late = parameter.is_late && !parameter.is_given;
    if (!isfinite(parameter.value)) {
        message_error(declarations->messages, place, "parameter %s: value %s; must be finite", name,
                      text_not_finite(parameter.value));
        parameter.value = 1; /* so that no further error follows */
    }
    declarations->parameters =
        memory_room(declarations->memory, declarations->parameters, declarations->parameter_count,
                    &declarations->parameter_capacity, sizeof *declarations->parameters);
    declarations->parameters[declarations->parameter_count++] = parameter;
    return declarations_parameter_expression(declarations, declarations->parameter_count - 1);
}

expression declarations_add_mode(struct declarations *declarations, struct place place, const char *name) {
    const struct value zero = {.kind = VALUE_NUMBER, .place = place};
    declarations_add_parameter(declarations, place, name, &zero, "");
    declarations->parameters[declarations->parameter_count - 1].is_mode = true;
    return declarations_parameter_expression(declarations, declarations->parameter_count - 1);
}

static void declare_entry(struct declarations *declarations, const struct value *entry, int index) {
    const struct value *part = entry->items;
    const bool has_name = entry->kind == VALUE_TABLE && entry->item_count >= 2 && part[0].kind == VALUE_TEXT;
    const bool has_unit = has_name && entry->item_count == 3 && part[2].kind == VALUE_TEXT;
    if (has_name && (entry->item_count == 2 || has_unit) && entry->field_count == 0) {
        declarations_add_parameter(declarations, entry->place, part[0].text, &part[1],
                                   has_unit ? part[2].text : "");
        return;
    }
    declarations->lacks_parameters = true;
    if (entry->kind != VALUE_NOTHING) /* a gap, reported before */
        message_error(declarations->messages, entry->place,
                      "parameters[%d]: %s; must be { \"name\", value, \"unit\" }", index + 1,
                      entry->kind == VALUE_TABLE ? "not a parameter" : value_kind_text(entry->kind));
}

void declarations_add_parameters(struct declarations *declarations, const struct value *list) {
    if (list->item_count > 1 && list->items[0].kind == VALUE_TEXT && list->items[1].kind == VALUE_NUMBER) {
        declarations->lacks_parameters = true;
        message_error(declarations->messages, list->place,
                      "parameters: a single parameter; must be a list of { \"name\", value, \"unit\" }");
        return;
    }
    for (int i = 0; i < list->item_count; i++)
        declare_entry(declarations, &list->items[i], i);
    declarations->lacks_parameters = declarations->lacks_parameters || list->field_count > 0;
    for (int i = 0; i < list->field_count; i++)
        message_error(declarations->messages, list->fields[i].value.place,
                      "parameters.%s: a named entry; write { \"%s\", value, \"unit\" }", list->fields[i].name,
                      list->fields[i].name);
}

expression declarations_add_input(struct declarations *declarations, struct place place, const char *name,
                                  double standard, const char *unit) {
    struct input input = {.name = name, .unit = unit, .place = place, .value = standard};
    const struct setting *setting = setting_of(declarations, place, "input", name);
    if (setting && !text_to_number(setting->value, &input.value))
        refuse_setting(declarations, place, setting, "a number");
    input.is_given = setting != NULL;
    declarations->inputs = memory_room(declarations->memory, declarations->inputs, declarations->input_count,
                                       &declarations->input_capacity, sizeof *declarations->inputs);
    declarations->inputs[declarations->input_count++] = input;
    return expr_symbol(declarations->graph, SYMBOL_INPUT, declarations->input_count - 1, 0);
}

/* The names that --set can set. */
static const char **settable_names(const struct declarations *declarations, int *count) {
    *count = declarations->option_count + declarations->parameter_count + declarations->input_count;
    const char **names = memory_get(declarations->memory, ((size_t)*count + 1) * sizeof *names);
    int at = 0;
    for (int i = 0; i < declarations->option_count; i++)
        names[at++] = declarations->options[i].name;
    for (int i = 0; i < declarations->parameter_count; i++)
        names[at++] = declarations->parameters[i].name;
    for (int i = 0; i < declarations->input_count; i++)
        names[at++] = declarations->inputs[i].name;
    return names;
}

/* The names as a list, which is cut if it is long. */
static const char *shown_names(const struct declarations *declarations, const char *const *names, int count) {
    enum { SHOWN = 20 };
    const char *list = message_names(declarations->memory, names, count < SHOWN ? count : SHOWN);
    if (count == 0)
        return "it has none; declare a number by rd.parameter";
    return memory_format(declarations->memory, count > SHOWN ? "it has %s and %d more" : "it has %s", list,
                         count - SHOWN);
}

void declarations_refuse_unknown_settings(const struct declarations *declarations,
                                          const char *const *coordinates, int coordinate_count) {
    for (int i = 0; i < declarations->request->setting_count; i++) {
        const char *name = declarations->request->settings[i].name, *dot = strrchr(name, '.');
        if (declarations->setting_kind[i] || declarations->lacks_parameters)
            continue;
        int count;
        const char **names = settable_names(declarations, &count);
        const char *nearest = message_nearest_name(dot ? dot + 1 : name, names, count);
        if (text_index(name, coordinates, coordinate_count) >= 0)
            message_error(declarations->messages, command_line(declarations),
                          "--set %s: a coordinate; set its start in the model or in a STATE.json", name);
        else if (nearest)
            message_error(declarations->messages, command_line(declarations),
                          "--set %s: unknown option, parameter or input; did you mean \"%s\"%s?", name,
                          nearest, strchr(name, ' ') ? ", without blanks" : "");
        else
            message_error(declarations->messages, command_line(declarations),
                          "--set %s: the model has no option, parameter or input of this name; %s", name,
                          shown_names(declarations, names, count));
    }
}
