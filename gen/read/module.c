/* Functions of the module `refdyn`: see reader.h. */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

/* ---- arguments: each asks for one and notes the first fault ---- */

static const struct value *argument(const struct module_call *call, int index) {
    static const struct value nothing = {.kind = VALUE_NOTHING};
    return index < call->argument_count ? &call->arguments[index] : &nothing;
}

static void refuse_argument(struct module_call *call, int index, const char *needed) {
    struct memory *memory = call->declarations->memory;
    if (!call->fault)
        call->fault = memory_format(memory, "rd.%s: argument %d is %s, %s is needed; write %s",
                                    module_function_name(memory, call->function), index + 1,
                                    value_kind_text(argument(call, index)->kind), needed,
                                    module_form(memory, call->function));
}

static expression expression_argument(struct module_call *call, int index) {
    expression e = expr_zero(call->declarations->graph);
    if (!value_expression(call->declarations->graph, argument(call, index), &e))
        refuse_argument(call, index, "a number or an expression");
    return e;
}

/* `standard` when the argument is left out; NULL: it may not be left out. */
static const char *text_argument(struct module_call *call, int index, const char *standard) {
    const struct value *value = argument(call, index);
    if (value->kind == VALUE_TEXT)
        return value->text;
    if (value->kind != VALUE_NOTHING || !standard)
        refuse_argument(call, index, "a text");
    return standard ? standard : "";
}

static void give(struct module_call *call, expression e) {
    call->result = (struct value){.kind = VALUE_EXPRESSION, .expression = e};
}

/* ---- declarations ---- */

static void run_option(struct module_call *call) {
    const char *name = text_argument(call, 0, NULL);
    const struct value *standard = argument(call, 1), *allowed = argument(call, 2);
    if (standard->kind != VALUE_NUMBER && standard->kind != VALUE_TEXT && standard->kind != VALUE_BOOLEAN)
        refuse_argument(call, 1, "a number, a text, true or false");
    if (allowed->kind != VALUE_TABLE && allowed->kind != VALUE_NOTHING)
        refuse_argument(call, 2, "a list of values or { from = 1, to = 9 }");
    if (!call->fault)
        call->result = declarations_add_option(call->declarations, call->place, name, standard,
                                               allowed->kind == VALUE_TABLE ? allowed : NULL);
}

static void run_parameters(struct module_call *call) {
    const struct value *list = argument(call, 0);
    if (list->kind != VALUE_TABLE)
        refuse_argument(call, 0, "a list of { \"name\", value, \"unit\" }");
    else
        declarations_add_parameters(call->declarations, list);
    call->result = (struct value){.kind = VALUE_GROUP};
}

static void run_parameter(struct module_call *call) {
    const char *name = text_argument(call, 0, NULL), *unit = text_argument(call, 2, "");
    expression_argument(call, 1);
    if (!call->fault)
        give(call,
             declarations_add_parameter(call->declarations, call->place, name, argument(call, 1), unit));
}

static void run_input(struct module_call *call) {
    const char *name = text_argument(call, 0, NULL), *unit = text_argument(call, 2, "");
    struct value standard = *argument(call, 1);
    if (standard.kind != VALUE_NUMBER && standard.kind != VALUE_NOTHING)
        refuse_argument(call, 1, "a number");
    if (!call->fault)
        give(call, declarations_add_input(call->declarations, call->place, name, standard.number, unit));
}

/* ---- formulas ---- */

/* Complains where it is known what the values are, and that they are wrong. */
static void require(struct module_call *call, struct requirement requirement) {
    struct declarations *declarations = call->declarations;
    double value;
    for (int i = 0; i < requirement.count; i++)
        if (call->fault || !parameters_are_known(declarations, requirement.values[i], &value))
            return;
    requirement.path = memory_format(declarations->memory, "rd.%s",
                                     module_function_name(declarations->memory, call->function));
    requirement.place = call->place;
    call->fault = declarations_require(declarations, requirement);
}

/* Argument `low` is below argument `high`. */
static void order_arguments(struct module_call *call, int low, int high, const char *needed) {
    const expression below = expression_argument(call, low), above = expression_argument(call, high);
    require(call, requirement_order(call->declarations->memory, needed, below, above));
}

static void run_rise(struct module_call *call,
                     expression rise(struct graph *g, expression t, expression t0, expression t1)) {
    expression t = expression_argument(call, 0), t0 = expression_argument(call, 1),
               t1 = expression_argument(call, 2);
    order_arguments(call, 1, 2, "an end behind the beginning");
    give(call, rise(call->declarations->graph, t, t0, t1));
}

static void run_ramp(struct module_call *call) {
    run_rise(call, vocabulary_ramp);
}

static void run_smoothstep(struct module_call *call) {
    run_rise(call, vocabulary_smoothstep);
}

static void give_section(struct module_call *call, struct section section) {
    static const char *const names[] = {"It", "Iy", "Iz", "area"}; /* fields are sorted by name */
    const expression entries[] = {section.It, section.Iy, section.Iz, section.area};
    struct named_value *fields = memory_get(call->declarations->memory, 4 * sizeof *fields);
    for (int i = 0; i < 4; i++)
        fields[i] = (struct named_value){.name = names[i],
                                         .value = {.kind = VALUE_EXPRESSION, .expression = entries[i]}};
    call->result = (struct value){.kind = VALUE_TABLE, .fields = fields, .field_count = 4};
}

/* Squares would hide a sign. What depends on the motion is refused with the section's fields. */
static expression size_argument(struct module_call *call, int index, bool may_be_zero) {
    const expression e = expression_argument(call, index);
    require(call, requirement_argument(call->declarations->memory,
                                       may_be_zero ? RANGE_NOT_NEGATIVE : RANGE_POSITIVE, index + 1, e));
    return e;
}

static void run_round(struct module_call *call) {
    give_section(call, vocabulary_round_section(call->declarations->graph, size_argument(call, 0, false)));
}

static void run_tube(struct module_call *call) {
    expression outer = size_argument(call, 0, false), inner = size_argument(call, 1, true);
    order_arguments(call, 1, 0, "an outer diameter above the inner one");
    give_section(call, vocabulary_tube_section(call->declarations->graph, outer, inner));
}

static void run_rectangle(struct module_call *call) {
    expression width = size_argument(call, 0, false), height = size_argument(call, 1, false);
    give_section(call, vocabulary_rectangle_section(call->declarations->graph, width, height));
}

static void warn_of_friction(const struct module_call *call, expression level, expression rate) {
    const struct declarations *declarations = call->declarations;
    double value;
    if (parameters_are_known(declarations, level, &value) && value < 0)
        message_warning(declarations->messages, call->place,
                        "rd.friction: argument 1 is %.6g and drives the motion; %.6g brakes it", value,
                        -value);
    if ((declarations->graph->nodes[rate].depends & (ON_STATE | ON_RATE)) == ON_STATE)
        message_warning(declarations->messages, call->place,
                        "rd.friction: argument 2 depends on no rate; a rate such as s.qd.arm_psi is needed");
}

static void run_friction(struct module_call *call) {
    expression level = expression_argument(call, 0), rate = expression_argument(call, 1),
               width = size_argument(call, 2, false);
    if (!call->fault)
        warn_of_friction(call, level, rate);
    give(call, vocabulary_friction(call->declarations->graph, level, rate, width));
}

/* ---- samples ---- */

/* Entry `column` of a sample, which has `least` to 3 numbers; notes a fault when it has not. */
static double sample(struct module_call *call, const struct value *list, int row, int column, int least) {
    const struct value *entry = &list->items[row];
    const bool is_list = entry->kind == VALUE_TABLE && entry->field_count == 0;
    const bool has_count =
        is_list && entry->item_count >= least && entry->item_count <= (least == 1 ? 3 : least);
    const struct value *value = has_count && column < entry->item_count ? &entry->items[column] : NULL;
    if (has_count && (!value || value->kind == VALUE_NUMBER))
        return value ? value->number : 0;
    if (!call->fault)
        call->fault =
            memory_format(call->declarations->memory, "rd.%s: sample %d is not of the form %s, of numbers",
                          module_function_name(call->declarations->memory, call->function), row + 1,
                          least == 2 ? "{ at, value }" : "{ x, y, z }");
    return 0;
}

/* The samples of a list; where there was a gap, which has been said, those that are there. */
static struct value samples_argument(struct module_call *call, const char *needed) {
    const struct value *list = argument(call, 0);
    struct value samples = {.kind = VALUE_TABLE};
    if (list->kind != VALUE_TABLE || list->item_count < 2 || list->field_count > 0)
        refuse_argument(call, 0, needed);
    samples.items =
        memory_get(call->declarations->memory, ((size_t)list->item_count + 1) * sizeof *samples.items);
    for (int i = 0; i < list->item_count && !call->fault; i++)
        if (list->items[i].kind != VALUE_NOTHING)
            samples.items[samples.item_count++] = list->items[i];
    return samples;
}

static double *sample_column(struct module_call *call, const struct value *list, int column, int least) {
    double *numbers =
        memory_get(call->declarations->memory, ((size_t)list->item_count + 1) * sizeof *numbers);
    for (int i = 0; i < list->item_count; i++)
        numbers[i] = sample(call, list, i, column, least);
    return numbers;
}

static struct value curve(struct module_call *call, const double *knots, const double *values, int count) {
    return (struct value){.kind = VALUE_CURVE,
                          .curve = graph_add_spline(call->declarations->graph, knots, values, count)};
}

static void run_spline(struct module_call *call) {
    const struct value list = samples_argument(call, "a list of two or more { at, value }");
    const int count = list.item_count;
    const double *knots = sample_column(call, &list, 0, 2), *values = sample_column(call, &list, 1, 2);
    for (int i = 0; i < count && !call->fault; i++)
        if (!isfinite(knots[i]) || !isfinite(values[i]) || (i > 0 && !(knots[i] > knots[i - 1])))
            call->fault = memory_format(
                call->declarations->memory,
                "rd.spline: sample %d is at %.6g, finite ascending numbers are needed", i + 1, knots[i]);
    if (!call->fault)
        call->result = curve(call, knots, values, count);
}

static void run_path(struct module_call *call) {
    static const char *const names[] = {"length", "x", "y", "z"};
    struct memory *memory = call->declarations->memory;
    const struct value list = samples_argument(call, "a list of two or more { x, y, z }");
    const int count = list.item_count;
    const double *const points[3] = {sample_column(call, &list, 0, 1), sample_column(call, &list, 1, 1),
                                     sample_column(call, &list, 2, 1)};
    for (int i = 0; i < count && !call->fault; i++) {
        double apart = i > 0 ? 0 : 1;
        for (int axis = 0; axis < 3; axis++)
            apart += i > 0 ? fabs(points[axis][i] - points[axis][i - 1]) : 0 * points[axis][i];
        if (!isfinite(apart) || apart <= 0)
            call->fault = memory_format(
                memory, "rd.path: sample %d is not finite or at the one before it, points of a path differ",
                i + 1);
    }
    if (call->fault)
        return;
    const struct path path = path_through(memory, points, count);
    struct named_value *fields = memory_get(memory, 4 * sizeof *fields);
    fields[0].value = (struct value){.kind = VALUE_NUMBER, .number = path.length[path.count - 1]};
    for (int axis = 0; axis < 3; axis++)
        fields[axis + 1].value = curve(call, path.length, path.coordinate[axis], path.count);
    for (int i = 0; i < 4; i++)
        fields[i].name = names[i];
    call->result = (struct value){.kind = VALUE_TABLE, .fields = fields, .field_count = 4};
}

static const struct {
    const char *name, *form; /* example of a call */
    int most_arguments;
    void (*run)(struct module_call *call);
} functions[] = {{"option", "(\"n_rfe\", 4)", 3, run_option},
                 {"parameters", " { { \"m\", 0.5, \"kg\" } }", 1, run_parameters},
                 {"parameter", "(\"m\", 0.5, \"kg\")", 3, run_parameter},
                 {"input", "(\"tau\", 0, \"N m\")", 3, run_input},
                 {"ramp", "(t, t0, t1)", 3, run_ramp},
                 {"smoothstep", "(t, t0, t1)", 3, run_smoothstep},
                 {"round", "(diameter)", 1, run_round},
                 {"tube", "(outer, inner)", 2, run_tube},
                 {"rectangle", "(width_y, height_z)", 2, run_rectangle},
                 {"friction", "(level, rate, width)", 3, run_friction},
                 {"spline", " { { 0, 0 }, { 1, 2 } }", 1, run_spline},
                 {"path", " { { 0, 0, 0 }, { 1, 0, 0 } }", 1, run_path}};

enum { FUNCTION_COUNT = sizeof functions / sizeof *functions };

/* ---- the functions of ops.def: numbers give a number, an expression among them an expression ---- */

static const struct {
    const char *name;
    enum operation operation;
} operations[] = {
#define OP(name, arity, text, cost, value, da, db, dc) {#name, OP_##name},
#include "gen/graph/ops.def"
#undef OP
};

enum { OPERATION_COUNT = sizeof operations / sizeof *operations, FIRST_FUNCTION = OP_NEG - OP_ADD + 1 };

static void run_operation(struct module_call *call, enum operation operation) {
    struct graph *graph = call->declarations->graph;
    expression operands[3] = {0};
    double values[3] = {0};
    bool are_numbers = true;
    for (int i = 0; i < operation_arity(operation); i++) {
        operands[i] = expression_argument(call, i);
        values[i] = argument(call, i)->number;
        are_numbers = are_numbers && argument(call, i)->kind == VALUE_NUMBER;
    }
    if (are_numbers)
        call->result = (struct value){.kind = VALUE_NUMBER,
                                      .number = operation_value(operation, values[0], values[1], values[2])};
    else if (operation == OP_POW)
        give(call, expr_power(graph, operands[0], operands[1]));
    else
        give(call, expr_apply(graph, operation, operands[0], operands[1], operands[2]));
}

/* ---- all functions, numbered ---- */

int module_function_count(void) {
    return FUNCTION_COUNT + OPERATION_COUNT - FIRST_FUNCTION;
}

static int operation_index(int function) {
    return function - FUNCTION_COUNT + FIRST_FUNCTION;
}

const char *module_function_name(struct memory *memory, int function) {
    if (function < FUNCTION_COUNT)
        return functions[function].name;
    char *name = memory_text(memory, operations[operation_index(function)].name);
    for (char *c = name; *c; c++)
        *c = (char)tolower((unsigned char)*c);
    return name;
}

const char *module_form(struct memory *memory, int function) {
    static const char *const operands[] = {"", "(a)", "(a, b)", "(a, b, c)"};
    const char *form = function < FUNCTION_COUNT
                           ? functions[function].form
                           : operands[operation_arity(operations[operation_index(function)].operation)];
    return memory_format(memory, "rd.%s%s", module_function_name(memory, function), form);
}

bool module_evaluates(int function) {
    static void (*const evaluating[])(struct module_call *) = {run_parameters, run_parameter, run_round,
                                                               run_tube, run_rectangle};
    for (size_t i = 0; function < FUNCTION_COUNT && i < sizeof evaluating / sizeof *evaluating; i++)
        if (functions[function].run == evaluating[i])
            return true;
    return false;
}

bool module_takes_samples(int function) {
    return function < FUNCTION_COUNT &&
           (functions[function].run == run_spline || functions[function].run == run_path);
}

bool module_makes(const char *name) {
    const char *tags[OWNER_COUNT + 3];
    return text_index(name, tags, fields_list_tags(tags)) >= 0;
}

bool module_has(struct memory *memory, const char *name) {
    for (int i = 0; i < module_function_count(); i++)
        if (strcmp(module_function_name(memory, i), name) == 0)
            return true;
    return false;
}

const char *module_unknown(struct memory *memory, const char *name) {
    const int functions_count = module_function_count();
    const char **known = memory_get(memory, (OWNER_COUNT + 4 + (size_t)functions_count) * sizeof *known);
    int count = fields_list_tags(known);
    for (int i = 0; i < functions_count; i++)
        known[count++] = module_function_name(memory, i);
    known[count++] = "pi";
    const char *nearest = message_nearest_name(name, known, count);
    if (nearest)
        return memory_format(memory, "rd.%s: unknown function, the nearest known one is \"%s\"", name,
                             nearest);
    return memory_format(memory, "rd.%s: unknown function, models/README.md lists what rd has", name);
}

void module_run(struct module_call *call) {
    struct memory *memory = call->declarations->memory;
    bool is_operation = call->function >= FUNCTION_COUNT;
    enum operation operation =
        is_operation ? operations[operation_index(call->function)].operation : OP_COUNT;
    int most = is_operation ? operation_arity(operation) : functions[call->function].most_arguments;
    if (call->argument_count > most || (is_operation && call->argument_count < most))
        call->fault = memory_format(memory, "rd.%s: number of arguments is %d, %d is needed; write %s",
                                    module_function_name(memory, call->function), call->argument_count, most,
                                    module_form(memory, call->function));
    else if (is_operation)
        run_operation(call, operation);
    else
        functions[call->function].run(call);
}
