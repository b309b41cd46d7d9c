/*
 * The functions of the module `refdyn` that a model calls, on plain values: declarations, formulas such as
 * rd.ramp, sections, splines and paths, and the functions of ops.def. Reads the arguments of a call; returns
 * a value, or an error message that ends the script.
 */
#include "gen/language/language.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

static const char *form_of(struct memory *memory, int function);

/* ---- arguments: each function reads one and notes the first error ---- */

static const struct value *argument(const struct module_call *call, int index) {
    static const struct value nothing = {.kind = VALUE_NOTHING};
    return index < call->argument_count ? &call->arguments[index] : &nothing;
}

static void refuse_argument(struct module_call *call, int index, const char *needed) {
    struct memory *memory = call->declarations->memory;
    if (!call->fault)
        call->fault = memory_format(memory, "rd.%s: argument %d is %s; must be %s, as in %s",
                                    module_function_name(memory, call->function), index + 1,
                                    value_kind_text(argument(call, index)->kind), needed,
                                    form_of(memory, call->function));
}

static expression expression_argument(struct module_call *call, int index) {
    expression e = EXPR_ZERO;
    if (!value_expression(call->declarations->graph, argument(call, index), &e))
        refuse_argument(call, index, "a number or an expression");
    return e;
}

/* `standard` is the value of an omitted argument; NULL if it must not be omitted. */
static const char *text_argument(struct module_call *call, int index, const char *standard) {
    const struct value *value = argument(call, index);
    if (value->kind == VALUE_TEXT)
        return value->text;
    if (value->kind != VALUE_NOTHING || !standard)
        refuse_argument(call, index, "a text");
    return standard ? standard : "";
}

static void set_result(struct module_call *call, expression e) {
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
        set_result(
            call, declarations_add_parameter(call->declarations, call->place, name, argument(call, 1), unit));
}

static void run_input(struct module_call *call) {
    const char *name = text_argument(call, 0, NULL), *unit = text_argument(call, 2, "");
    struct value standard = *argument(call, 1);
    if (standard.kind != VALUE_NUMBER && standard.kind != VALUE_NOTHING)
        refuse_argument(call, 1, "a number");
    if (!call->fault)
        set_result(call,
                   declarations_add_input(call->declarations, call->place, name, standard.number, unit));
}

/* ---- courses in time, sections of beams, dry friction ---- */

struct section {
    expression area, Iy, Iz, It; /* [m^2, m^4] */
};

static const double pi = 3.14159265358979323846;

/* (t - t0) / (t1 - t0), kept between 0 and 1. */
static expression clamped(struct graph *g, expression t, expression t0, expression t1) {
    expression part = expr_div(g, expr_sub(g, t, t0), expr_sub(g, t1, t0));
    return expr_apply2(g, OP_MIN, expr_apply2(g, OP_MAX, part, EXPR_ZERO), EXPR_ONE);
}

/* 0 before t0, 1 after t1, (1 - cos) / 2 between. */
static expression ramp(struct graph *g, expression c) {
    expression angle = expr_mul(g, expr_number(g, pi), c);
    return expr_mul(g, expr_number(g, 0.5), expr_sub(g, EXPR_ONE, expr_apply1(g, OP_COS, angle)));
}

/* 0 before t0, 1 after t1; between, the polynomial of degree 2 k - 1 in c whose derivatives 1 to k - 1 vanish
 * at both ends, such as 3 c^2 - 2 c^3: c^k times the sum over i < k of binomial(k - 1 + i, i) binomial(2 k -
 * 1, k - 1 - i) (-c)^i. */
static expression smoothstep(struct graph *g, expression c, int k) {
    expression rest = EXPR_ZERO, power = c;
    for (int i = k - 1; i >= 0; i--) {
        double coefficient = 1;
        for (int l = 1; l <= i; l++)
            coefficient *= (double)(k - 1 + l) / l;
        for (int l = 1; l <= k - 1 - i; l++)
            coefficient *= (double)(k + i + l) / l;
        const expression own = expr_number(g, round(coefficient));
        rest = i == k - 1 ? own : expr_sub(g, own, expr_mul(g, rest, c));
    }
    for (int i = 1; i < k; i++)
        power = expr_mul(g, power, c);
    return expr_mul(g, power, rest);
}

/* A = pi d^2 / 4, Iy = Iz = pi d^4 / 64, It = pi d^4 / 32, of the outer minus the inner diameter. */
static struct section tube_section(struct graph *g, expression outer, expression inner) {
    expression outer2 = expr_mul(g, outer, outer), inner2 = expr_mul(g, inner, inner);
    expression squares = expr_sub(g, outer2, inner2);
    expression fourths = expr_sub(g, expr_mul(g, outer2, outer2), expr_mul(g, inner2, inner2));
    expression bending = expr_mul(g, expr_number(g, pi / 64), fourths);
    return (struct section){.area = expr_mul(g, expr_number(g, pi / 4), squares),
                            .Iy = bending,
                            .Iz = bending,
                            .It = expr_mul(g, expr_number(g, pi / 32), fourths)};
}

/* The tanh of the terms from n = 7 on differs from 1 by less than 6e-10. Their sum is that of all 1 / n^5,
 * 31/32 zeta(5), minus the first three. */
static expression torsion_sum(struct graph *g, expression slenderness) {
    const double all = 1.0045237627951383, without = all - 1 - 1 / 243.0 - 1 / 3125.0;
    const expression half_turn = expr_mul(g, expr_number(g, pi / 2), slenderness);
    const expression first = expr_apply1(g, OP_TANH, half_turn);
    const expression third = expr_apply1(g, OP_TANH, expr_mul(g, expr_number(g, 3), half_turn));
    const expression fifth = expr_apply1(g, OP_TANH, expr_mul(g, expr_number(g, 5), half_turn));
    const expression early = expr_add(g, first, expr_div(g, third, expr_number(g, 243)));
    return expr_add(g, expr_add(g, early, expr_div(g, fifth, expr_number(g, 3125))), expr_number(g, without));
}

/* Torsion of a rectangle a >= b (Timoshenko and Goodier, Theory of Elasticity, sect. 109):
 * It = a b^3 / 3 (1 - 192 b / (pi^5 a) sum over odd n of tanh(n pi a / 2b) / n^5). */
static struct section rectangle_section(struct graph *g, expression width_y, expression height_z) {
    const double pi5 = pi * pi * pi * pi * pi;
    const expression area = expr_mul(g, width_y, height_z), twelfth = expr_number(g, 1.0 / 12);
    const expression a = expr_apply2(g, OP_MAX, width_y, height_z),
                     b = expr_apply2(g, OP_MIN, width_y, height_z);
    const expression lack = expr_mul(g, expr_mul(g, expr_number(g, 192 / pi5), expr_div(g, b, a)),
                                     torsion_sum(g, expr_div(g, a, b)));
    const expression third = expr_div(g, expr_mul(g, area, expr_mul(g, b, b)), expr_number(g, 3));
    return (struct section){.area = area,
                            .Iy = expr_mul(g, twelfth, expr_mul(g, area, expr_mul(g, height_z, height_z))),
                            .Iz = expr_mul(g, twelfth, expr_mul(g, area, expr_mul(g, width_y, width_y))),
                            .It = expr_mul(g, third, expr_sub(g, EXPR_ONE, lack))};
}

/* -level tanh(rate / width): dry friction, smooth within `width` of rest. */
static expression friction(struct graph *g, expression level, expression rate, expression width) {
    return expr_neg(g, expr_mul(g, level, expr_apply1(g, OP_TANH, expr_div(g, rate, width))));
}

/* ---- functions of formulas ---- */

/* Reports values that are known and break the requirement. */
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

/* The share of the time from argument 2 to argument 3 that has passed at argument 1. */
static expression share_of_time(struct module_call *call) {
    expression t = expression_argument(call, 0), t0 = expression_argument(call, 1),
               t1 = expression_argument(call, 2);
    require(call, requirement_order(t0, t1));
    return clamped(call->declarations->graph, t, t0, t1);
}

static void run_ramp(struct module_call *call) {
    set_result(call, ramp(call->declarations->graph, share_of_time(call)));
}

static void run_smoothstep(struct module_call *call) {
    const struct value *degree = argument(call, 3);
    const expression c = share_of_time(call);
    const double number = degree->kind == VALUE_NUMBER ? degree->number : 3;
    if ((degree->kind != VALUE_NOTHING && degree->kind != VALUE_NUMBER) ||
        !(number == 3 || number == 5 || number == 7 || number == 9))
        refuse_argument(call, 3, "3, 5, 7 or 9");
    else
        set_result(call, smoothstep(call->declarations->graph, c, ((int)number + 1) / 2));
}

static void give_section(struct module_call *call, struct section section) {
    static const char *const names[] = {"It", "Iy", "Iz", "area"}; /* fields are sorted by name */
    const expression entries[] = {section.It, section.Iy, section.Iz, section.area};
    struct value_field *fields = memory_get(call->declarations->memory, 4 * sizeof *fields);
    for (int i = 0; i < 4; i++)
        fields[i] = (struct value_field){.name = names[i],
                                         .value = {.kind = VALUE_EXPRESSION, .expression = entries[i]}};
    call->result = (struct value){.kind = VALUE_TABLE, .fields = fields, .field_count = 4};
}

/* A size must be positive, which its square would not show. A size that depends on the motion is refused with
 * the fields of the section. */
static expression size_argument(struct module_call *call, int index, bool may_be_zero) {
    const expression e = expression_argument(call, index);
    require(call, requirement_argument(call->declarations->memory,
                                       may_be_zero ? RANGE_NOT_NEGATIVE : RANGE_POSITIVE, index + 1, e));
    return e;
}

static void run_round(struct module_call *call) {
    struct graph *graph = call->declarations->graph;
    give_section(call, tube_section(graph, size_argument(call, 0, false), EXPR_ZERO));
}

static void run_tube(struct module_call *call) {
    expression outer = size_argument(call, 0, false), inner = size_argument(call, 1, true);
    require(call, requirement_hole(inner, outer));
    give_section(call, tube_section(call->declarations->graph, outer, inner));
}

static void run_rectangle(struct module_call *call) {
    expression width = size_argument(call, 0, false), height = size_argument(call, 1, false);
    give_section(call, rectangle_section(call->declarations->graph, width, height));
}

static void warn_of_friction(const struct module_call *call, expression level, expression rate) {
    const struct declarations *declarations = call->declarations;
    double value;
    if (parameters_are_known(declarations, level, &value) && value < 0)
        message_warning(declarations->messages, call->place,
                        "rd.friction: argument 1 is %.6g and drives the motion; to brake it write %.6g",
                        value, -value);
    if ((declarations->graph->nodes[rate].depends & (ON_STATE | ON_RATE)) == ON_STATE)
        message_warning(declarations->messages, call->place,
                        "rd.friction: argument 2 depends on no rate; must be a rate such as s.qd.arm_psi");
}

static void run_friction(struct module_call *call) {
    expression level = expression_argument(call, 0), rate = expression_argument(call, 1),
               width = size_argument(call, 2, false);
    if (!call->fault)
        warn_of_friction(call, level, rate);
    set_result(call, friction(call->declarations->graph, level, rate, width));
}

/*
 * ---- rd.path: a smooth path through points in space, by arc length ----
 *
 * Natural cubic splines through the points, by arc length. Their knots are found by iteration from the
 * chords. The path is then sampled more finely, so that a step in the length s is a step along the path.
 */

struct path {
    int count;
    double *length;        /* knots, from 0 [m] */
    double *coordinate[3]; /* at the knots [m] */
};

enum { ITERATIONS = 30, FINER = 16 };

static double *new_numbers(struct memory *memory, int count) {
    return memory_get(memory, ((size_t)count + 1) * sizeof(double));
}

static double speed(const struct spline splines[3], double at) {
    const double x = spline_value(&splines[0], at, 1), y = spline_value(&splines[1], at, 1),
                 z = spline_value(&splines[2], at, 1);
    return sqrt(x * x + y * y + z * z);
}

/* Length of the curve from a to b by Gauss's rule with five points. */
static double length_between(const struct spline splines[3], double a, double b) {
    static const double places[] = {0, 0.538469310105683091, 0.906179845938663993},
                        weights[] = {0.568888888888888889, 0.478628670499366468, 0.236926885056189088};
    const double middle = (a + b) / 2, half = (b - a) / 2;
    double sum = weights[0] * speed(splines, middle);
    for (int i = 1; i < 3; i++)
        sum += weights[i] *
               (speed(splines, middle - half * places[i]) + speed(splines, middle + half * places[i]));
    return half * sum;
}

static void fit(struct memory *memory, const double *knots, const double *const points[3], int count,
                struct spline splines[3]) {
    for (int axis = 0; axis < 3; axis++)
        splines[axis] = spline_through(memory, knots, points[axis], count);
}

static void measure_chords(const double *const points[3], int count, double *knots) {
    for (int i = 1; i < count; i++) {
        double square = 0;
        for (int axis = 0; axis < 3; axis++)
            square += pow(points[axis][i] - points[axis][i - 1], 2);
        knots[i] = knots[i - 1] + sqrt(square);
    }
}

/* Replaces the knots by lengths along the spline that they define. Returns the largest change. */
static double measure_arcs(const struct spline splines[3], int count, double *knots) {
    double before = knots[0], change = 0;
    for (int i = 1; i < count; i++) {
        const double own = knots[i];
        knots[i] = knots[i - 1] + length_between(splines, before, own);
        change = fmax(change, fabs(knots[i] - own));
        before = own;
    }
    return change;
}

/* A path through `count` >= 2 points, of which no two neighbours are equal. */
static struct path path_through(struct memory *memory, const double *const points[3], int count) {
    const int fine = (count - 1) * FINER + 1;
    struct path path = {.count = fine, .length = new_numbers(memory, fine)};
    double *knots = new_numbers(memory, count);
    struct spline splines[3];
    measure_chords(points, count, knots);
    fit(memory, knots, points, count, splines);
    for (int i = 0; i < ITERATIONS && measure_arcs(splines, count, knots) > 1e-14 * knots[count - 1]; i++)
        fit(memory, knots, points, count, splines);
    for (int axis = 0; axis < 3; axis++)
        path.coordinate[axis] = new_numbers(memory, fine);
    double before = 0;
    for (int i = 0; i < fine; i++) {
        const int piece = i / FINER < count - 1 ? i / FINER : count - 2;
        const double step = (knots[piece + 1] - knots[piece]) / FINER;
        const double at = i == fine - 1 ? knots[count - 1] : knots[piece] + step * (i - piece * FINER);
        path.length[i] = i > 0 ? path.length[i - 1] + length_between(splines, before, at) : 0;
        for (int axis = 0; axis < 3; axis++)
            path.coordinate[axis][i] = spline_value(&splines[axis], at, 0);
        before = at;
    }
    return path;
}

/* ---- samples ---- */

/* Entry `column` of a sample, which must have `least` to 3 numbers. Notes an error if it has not. */
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
            memory_format(call->declarations->memory, "rd.%s: sample %d must be %s with plain numbers",
                          module_function_name(call->declarations->memory, call->function), row + 1,
                          least == 2 ? "{ at, value }" : "{ x, y, z }");
    return 0;
}

/* The samples of a list without its gaps, which have been reported. */
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
            call->fault = memory_format(call->declarations->memory,
                                        "rd.spline: sample %d is at %.6g; places must be finite and ascend",
                                        i + 1, knots[i]);
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
                memory,
                "rd.path: sample %d is not finite or equal to the one before it; neighbours must differ",
                i + 1);
    }
    if (call->fault)
        return;
    const struct path path = path_through(memory, points, count);
    struct value_field *fields = memory_get(memory, 4 * sizeof *fields);
    fields[0].value = (struct value){.kind = VALUE_NUMBER, .number = path.length[path.count - 1]};
    for (int axis = 0; axis < 3; axis++)
        fields[axis + 1].value = curve(call, path.length, path.coordinate[axis], path.count);
    for (int i = 0; i < 4; i++)
        fields[i].name = names[i];
    call->result = (struct value){.kind = VALUE_TABLE, .fields = fields, .field_count = 4};
}

/* ---- time laws and shapers ---- */

static struct checker checker_of(const struct module_call *call) {
    struct declarations *declarations = call->declarations;
    return (struct checker){declarations->memory, declarations->graph, declarations->messages, declarations};
}

/* The table of a function with named fields; NULL after an error. */
static const struct value *table_argument(struct module_call *call) {
    if (argument(call, 0)->kind != VALUE_TABLE)
        refuse_argument(call, 0, "a table");
    return call->fault ? NULL : argument(call, 0);
}

static void run_timing(struct module_call *call) {
    const struct checker checker = checker_of(call);
    const struct value *table = table_argument(call);
    if (table)
        call->result = time_laws_timing(&checker, table);
}

static void run_shaper(struct module_call *call) {
    const struct checker checker = checker_of(call);
    const struct value *table = table_argument(call);
    if (table)
        set_result(call, time_laws_shaper(&checker, table));
}

static expression unit_for_time(void *context, struct graph *g, expression e) {
    (void)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? EXPR_ONE : EXPR_ZERO;
}

/* The derivative of a course by the time. */
static void run_rate(struct module_call *call) {
    struct graph *g = call->declarations->graph;
    const expression course = expression_argument(call, 0);
    if (!call->fault && g->nodes[course].depends & ~(ON_TIME | ON_PARAMETER))
        call->fault = "rd.rate: the argument depends on the state or on inputs; must be a course in time";
    if (!call->fault)
        set_result(call, rewrite_derivative(g, course, unit_for_time, NULL));
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
                 {"smoothstep", "(t, t0, t1)", 4, run_smoothstep},
                 {"round", "(diameter)", 1, run_round},
                 {"tube", "(outer, inner)", 2, run_tube},
                 {"rectangle", "(width_y, height_z)", 2, run_rectangle},
                 {"friction", "(level, rate, width)", 3, run_friction},
                 {"spline", " { { 0, 0 }, { 1, 2 } }", 1, run_spline},
                 {"path", " { { 0, 0, 0 }, { 1, 0, 0 } }", 1, run_path},
                 {"timing", " { s.t, length = 1, rate = 0.5, acceleration = 2 }", 1, run_timing},
                 {"shaper", " { course, frequency = 2 }", 1, run_shaper},
                 {"rate", "(course)", 1, run_rate}};

enum { FUNCTION_COUNT = sizeof functions / sizeof *functions };

/* ---- functions of ops.def: of numbers they are a number, otherwise an expression ---- */

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
        set_result(call, expr_power(graph, operands[0], operands[1]));
    else
        set_result(call, expr_apply(graph, operation, operands[0], operands[1], operands[2]));
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

static const char *form_of(struct memory *memory, int function) {
    static const char *const operands[] = {"", "(a)", "(a, b)", "(a, b, c)"};
    const char *form = function < FUNCTION_COUNT
                           ? functions[function].form
                           : operands[operation_arity(operations[operation_index(function)].operation)];
    return memory_format(memory, "rd.%s%s", module_function_name(memory, function), form);
}

bool module_evaluates(int function) {
    static void (*const evaluating[])(struct module_call *) = {run_parameters, run_parameter, run_round,
                                                               run_tube,       run_rectangle, run_rate};
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
        return memory_format(memory, "rd.%s: unknown function; did you mean \"%s\"?", name, nearest);
    return memory_format(memory, "rd.%s: unknown function; models/README.md lists the functions", name);
}

void module_run(struct module_call *call) {
    struct memory *memory = call->declarations->memory;
    bool is_operation = call->function >= FUNCTION_COUNT;
    enum operation operation =
        is_operation ? operations[operation_index(call->function)].operation : OP_COUNT;
    int most = is_operation ? operation_arity(operation) : functions[call->function].most_arguments;
    if (call->argument_count > most || (is_operation && call->argument_count < most))
        call->fault = memory_format(memory, "rd.%s: %d argument%s; must have %s%d, as in %s",
                                    module_function_name(memory, call->function), call->argument_count,
                                    call->argument_count == 1 ? "" : "s", is_operation ? "" : "at most ",
                                    most, form_of(memory, call->function));
    else if (is_operation)
        run_operation(call, operation);
    else
        functions[call->function].run(call);
}
