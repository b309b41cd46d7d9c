/*
 * The constant tables of a model: names, units, defaults, the tree, and all functions with the signature of
 * refdyn_model.h.
 */
#include "gen/emit/emit.h"
#include "refdyn_model.h"
#include "gen/dynamics/dynamics.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* ---- Limits of joints ---- */

/* NAME_limits has one entry for each joint with limits, for planning and control. A missing limit is
 * infinite, written as 1 / 0.0. The header declares the table if there are any entries. */

static int count_limits(const struct emission *x) {
    int count = 0;
    for (int i = 0; i < x->plan->tree->count; i++)
        count += x->plan->tree->frames[i].joint.limits != NULL;
    return count;
}

void emit_limits_declaration(const struct emission *x, struct text *text) {
    const int count = count_limits(x);
    if (!count)
        return;
    text_add(text, "/* Limits of joints; no function in this file reads them. */\n");
    text_add(text, "enum { %s_limit_count = %d };\n", x->name, count);
    text_add(text, "extern const struct refdyn_limits %s_limits[%d];\n\n", x->name, count);
}

static const char *limit_text(double limit, char digits[32]) {
    if (isinf(limit))
        return limit < 0 ? "-1 / 0.0" : "1 / 0.0"; /* to tcc, -HUGE_VAL is no constant */
    return text_of_number(limit, digits);
}

static void emit_limits(const struct emission *x, struct text *text) {
    const int count = count_limits(x);
    if (!count)
        return;
    text_add(text, "const struct refdyn_limits %s_limits[%d] = {\n", x->name, count);
    for (int i = 0; i < x->plan->tree->count; i++) {
        const struct limits *limits = x->plan->tree->frames[i].joint.limits;
        char digits[4][32];
        if (limits)
            text_add(text, "    {%d, %s, %s, %s, %s},\n", i, limit_text(limits->from, digits[0]),
                     limit_text(limits->to, digits[1]), limit_text(limits->rate, digits[2]),
                     limit_text(limits->force, digits[3]));
    }
    text_add(text, "};\n\n");
}

/* ---- Spatial Jacobians ---- */

/* NAME_spatial has the points with spatial Jacobians, and both functions with the signature of
 * refdyn_model.h. The header declares it if points request it. */

static bool has_function(const struct emission *x, const char *quantity) {
    return plan_find_function(x->plan, quantity) != NULL;
}

static bool emit_is_spatial(const struct function *function) {
    return !strcmp(function->quantity, "J") || !strcmp(function->quantity, "Jd_qd");
}

static bool has_spatial(const struct emission *x) {
    return has_function(x, "J") || has_function(x, "Jd_qd");
}

void emit_spatial_declaration(const struct emission *x, struct text *text) {
    if (has_spatial(x))
        text_add(text,
                 "/* The points of J and Jd_qd, in their order, and these functions on doubles. */\n"
                 "extern const struct refdyn_spatial %s_spatial;\n\n",
                 x->name);
}

static void put_function(const struct emission *x, struct text *text, const char *quantity) {
    if (has_function(x, quantity))
        text_add(text, ", %s_%s_doubles", x->name, quantity);
    else
        text_add(text, ", 0");
}

static void emit_spatial(const struct emission *x, struct text *text) {
    const struct model *model = x->plan->model;
    int count = 0;
    if (!has_spatial(x))
        return;
    text_add(text, "static const int %s_spatial_points[] = {", x->name);
    for (int i = 0; i < model->point_count; i++)
        if (model->points[i].is_angular)
            text_add(text, "%s%d", count++ ? ", " : "", i);
    text_add(text, "};\n\nconst struct refdyn_spatial %s_spatial = {%d, %s_spatial_points", x->name, count,
             x->name);
    put_function(x, text, "J");
    put_function(x, text, "Jd_qd");
    text_add(text, "};\n\n");
}

static void emit_name_entry(struct text *text, const char *name, const char *unit, double value) {
    char digits[32];
    text_add(text, "    {\"%s\", %s, %s},\n", name, text_literal(text->memory, unit),
             text_of_number(value, digits));
}

static void open_names(struct emission *x, struct text *text, const char *what) {
    text_add(text, "static const struct refdyn_name %s_%s[] = {\n", x->name, what);
}

static void emit_coordinate(struct emission *x, struct text *text, int i) {
    const struct frame *frame = &x->plan->tree->frames[i];
    if (frame->is_state) {
        const struct model_state *state = &x->plan->model->states[i - tree_joint_count(x->plan->tree)];
        emit_name_entry(text, state->name, state->unit,
                        parameters_evaluate(x->g, x->plan->model->parameters, state->start));
        return;
    }
    const double start = parameters_evaluate(x->g, x->plan->model->parameters, frame->joint.start);
    emit_name_entry(text, frame->name, frame->joint.is_revolute ? "rad" : "m", start);
}

/* One macro for the names in an element. */
static void emit_run_macro(struct emission *x, struct text *text, const struct element_run *run, int index) {
    char digits[32];
    text_add(text, "#define ELEMENT_%d(e)", index + 1);
    for (int k = 0; k < run->period; k++) {
        const struct frame *frame = &x->plan->tree->frames[run->first + k];
        const struct stem stem = emit_name_stem(x, run, k);
        const double start = parameters_evaluate(x->g, x->plan->model->parameters, frame->joint.start);
        text_add(text, "%s {\"%.*s\" #e, \"%s\", %s}", k ? "," : "", stem.length, stem.text,
                 frame->joint.is_revolute ? "rad" : "m", text_of_number(start, digits));
    }
    text_add(text, "\n");
}

static void emit_run_names(struct text *text, const struct element_run *run, int index, int number) {
    for (int e = 0; e < run->count; e++)
        text_add(text, "%sELEMENT_%d(%d),%s", e % 8 ? " " : "    ", index + 1, number + e,
                 e % 8 == 7 || e == run->count - 1 ? "\n" : "");
}

static void emit_coordinate_names(struct emission *x, struct text *text) {
    const struct tree *rolled = x->plan->rolled;
    for (int r = 0; r < rolled->run_count; r++)
        if (x->run_numbers[r] >= 0)
            emit_run_macro(x, text, &rolled->runs[r], r);
    open_names(x, text, "coordinate_names");
    for (int i = 0; i < x->plan->tree->count;) {
        const int r = emit_named_run(x, i);
        if (r >= 0)
            emit_run_names(text, &rolled->runs[r], r, x->run_numbers[r]);
        else
            emit_coordinate(x, text, i);
        i += r < 0 ? 1 : rolled->runs[r].count * rolled->runs[r].period;
    }
    for (int i = 0; i < x->plan->model->state_count; i++) {
        const struct model_state *state = &x->plan->model->states[i];
        emit_name_entry(text, state->name, state->unit, state->scale);
    }
    text_add(text, "};\n");
    for (int r = 0; r < rolled->run_count; r++)
        if (x->run_numbers[r] >= 0)
            text_add(text, "#undef ELEMENT_%d\n", r + 1);
    text_add(text, "\n");
}

static void emit_names(struct emission *x, struct text *text) {
    const struct model *model = x->plan->model;
    emit_coordinate_names(x, text);
    if (x->plan->parameter_count) {
        open_names(x, text, "parameter_names");
        for (int i = 0; i < x->plan->parameter_count; i++) {
            const struct parameter *p = &model->parameters[x->plan->parameters[i]];
            emit_name_entry(text, p->name, p->unit, p->is_anchored && !p->is_given ? 0 : p->value);
        }
        text_add(text, "};\n\n");
    }
    if (model->course_count) {
        text_add(text, "static const char *const %s_courses[] = {", x->name);
        for (int i = 0; i < model->course_count; i++)
            text_add(text, "%s%s", i ? ", " : "", text_literal(text->memory, model->courses[i].name));
        text_add(text, "};\n\n");
    }
    if (model->input_count) {
        open_names(x, text, "input_names");
        for (int i = 0; i < model->input_count; i++)
            emit_name_entry(text, model->inputs[i].name, model->inputs[i].unit, model->inputs[i].value);
        text_add(text, "};\n\n");
    }
}

static void emit_integers(struct emission *x, struct text *text, const char *what, const int *values,
                          int count) {
    if (!count)
        return;
    text_add(text, "static const int %s_%s[] = {", x->name, what);
    for (int i = 0; i < count; i++)
        text_add(text, "%s%d", !i ? "" : i % 20 ? ", " : ",\n    ", values[i]);
    text_add(text, "};\n\n");
}

static int *coordinate_indices(struct emission *x, const char **names, int count) {
    int *indices = memory_get(x->plan->memory, ((size_t)count + 1) * sizeof *indices);
    for (int i = 0; i < count; i++)
        indices[i] = tree_find_frame(x->plan->tree, names[i]);
    return indices;
}

/* The position of each anchored parameter among the emitted ones. */
static int *anchored_indices(struct emission *x) {
    const struct plan *plan = x->plan;
    int *indices = memory_get(plan->memory, ((size_t)plan->anchored_count + 1) * sizeof *indices);
    for (int i = 0; i < plan->anchored_count; i++)
        while (plan->parameters[indices[i]] != plan->anchored[i])
            indices[i]++;
    return indices;
}

/* The place in p of a value of parameters alone; -1: no emitted function reads it. */
static int place_in_parameters(const struct plan *plan, expression e) {
    for (int i = 0; i < plan->prepare.out_count; i++)
        if (plan->prepare.arrays->singles[i].value == e)
            return plan->parameter_count + i;
    return -1;
}

static int *gain_places(struct emission *x) {
    const struct model *model = x->plan->model;
    int *places = memory_get(x->plan->memory, (2 * (size_t)model->row_count + 1) * sizeof *places);
    for (int i = 0; i < model->row_count; i++) {
        places[2 * i] = place_in_parameters(x->plan, constraints_rate_gain(x->g, &model->rows[i]));
        places[2 * i + 1] = place_in_parameters(x->plan, constraints_position_gain(x->g, &model->rows[i]));
    }
    return places;
}

static void emit_index_tables(struct emission *x, struct text *text) {
    const struct model *model = x->plan->model;
    const int n = x->plan->tree->count;
    int *parents = memory_get(x->plan->memory, ((size_t)n + 1) * sizeof *parents);
    for (int i = 0; i < n; i++)
        parents[i] = x->plan->tree->frames[i].is_state ? REFDYN_STATE : x->plan->tree->frames[i].parent;
    emit_integers(x, text, "parent", parents, n);
    emit_integers(x, text, "dependent", coordinate_indices(x, model->dependent, model->dependent_count),
                  model->dependent_count);
    emit_integers(x, text, "held", coordinate_indices(x, model->hold, model->hold_count), model->hold_count);
    emit_integers(x, text, "gains", gain_places(x), 2 * model->row_count);
    emit_integers(x, text, "vector_places", x->plan->vector_places,
                  x->plan->vector_places ? 3 * REFDYN_VECTOR_COUNT : 0);
    emit_integers(x, text, "anchored", anchored_indices(x), x->plan->anchored_count);
}

static void emit_rows_and_points(struct emission *x, struct text *text) {
    static const char *const levels[] = {"REFDYN_POSITION", "REFDYN_VELOCITY", "REFDYN_ACCELERATION"};
    _Static_assert(sizeof levels / sizeof *levels == ROW_ACCELERATION + 1, "each level has a name");
    const struct model *model = x->plan->model;
    if (model->row_count) {
        text_add(text, "static const struct refdyn_row %s_rows[] = {\n", x->name);
        for (int i = 0; i < model->row_count; i++)
            text_add(text, "    {%s, %s, %d, \"%s\"},\n", text_literal(text->memory, model->rows[i].name),
                     levels[model->rows[i].level], model->rows[i].driven, model->rows[i].unit);
        text_add(text, "};\n\n");
    }
    if (model->point_count) {
        text_add(text, "static const char *const %s_points[] = {", x->name);
        for (int i = 0; i < model->point_count; i++)
            text_add(text, "%s\"%s\"", i ? ", " : "", model->points[i].name);
        text_add(text, "};\n\n");
    }
}

/* "(const lane *)(const void *)": converts doubles to the argument of a function for lanes. */
static const char *as_numbers(const struct emission *x, const char *qualifier) {
    return x->is_lanes ? memory_format(x->plan->memory, "(%slane *)(%svoid *)", qualifier, qualifier) : "";
}

/* The place of a parameter in p; -1: no emitted function reads it. */
static int place_of_parameter(const struct plan *plan, int parameter) {
    for (int i = 0; i < plan->parameter_count; i++)
        if (plan->parameters[i] == parameter)
            return i;
    return -1;
}

static void emit_changes(struct emission *x, struct text *text) {
    static const char *const kinds[] = {"REFDYN_CHANGED_RATE", "REFDYN_CHANGED_INPUT",
                                        "REFDYN_CHANGED_PARAMETER"};
    _Static_assert(sizeof kinds / sizeof *kinds == CHANGED_PARAMETER + 1, "each kind has a name");
    const struct model *model = x->plan->model;
    if (!model->change_count)
        return;
    text_add(text, "static const struct refdyn_change %s_changes[] = {\n", x->name);
    for (int i = 0; i < model->change_count; i++) {
        const struct change *change = &model->changes[i];
        const bool is_parameter = change->what == CHANGED_PARAMETER;
        text_add(text, "    {%s, %d},\n", kinds[change->what],
                 is_parameter ? place_of_parameter(x->plan, change->index) : change->index);
    }
    text_add(text, "};\n\n");
}

static void emit_events(struct emission *x, struct text *text) {
    const struct model *model = x->plan->model;
    if (!model->event_count)
        return;
    text_add(text, "static const struct refdyn_event %s_events[] = {\n", x->name);
    for (int i = 0; i < model->event_count; i++) {
        const struct event *event = &model->events[i];
        text_add(text, "    {%s, %d, %d, %d, %d, %d, %d},\n", text_literal(text->memory, event->name),
                 event->direction, event->ends, event->is_impact, event->first_change, event->change_count,
                 event->is_sampled ? -1 : event->contact + 1);
    }
    text_add(text, "};\n\n");
}

static void emit_requirements(struct emission *x, struct text *text) {
    const struct plan *plan = x->plan;
    if (!plan->requirement_count)
        return;
    text_add(text, "static const struct refdyn_requirement %s_requirements[] = {\n", x->name);
    for (int i = 0; i < plan->requirement_count; i++) {
        const struct requirement *requirement = &plan->requirements[i];
        text_add(text, "    {%s, %s, %d},\n", text_literal(text->memory, requirement->path),
                 text_literal(text->memory, requirement->fact), requirement->count);
    }
    text_add(text, "};\n\n");
}

static void emit_adapter(struct emission *x, struct text *text, const struct function *function) {
    const char *read = as_numbers(x, "const "), *name = x->name;
    struct given_array given[GIVEN_ARRAYS];
    text_add(text,
             "static void %s_%s_doubles(const double *p, const double *x, %st, const double *q,\n"
             "        const double *qd, double *out) {\n",
             name, function->quantity, x->is_lanes ? "const double *" : "double ");
    text_add(text,
             "    %s_%s((const struct %s_parameters *)(const void *)p,\n        (const struct %s_inputs "
             "*)(const void *)x, %st, %sq, %sqd, ",
             name, function->quantity, name, name, read, read, read);
    emit_list_given(x->plan, function, given);
    for (int i = 0; i < GIVEN_ARRAYS; i++)
        if (given[i].count)
            text_add(text, "%sqd + %d, ", read, given[i].place);
    if (plan_is_struct_result(function))
        text_add(text, "(struct %s_%s_result *)(void *)", name, function->quantity);
    else
        text_add(text, "%s", as_numbers(x, ""));
    text_add(text, "out);\n}\n\n");
}

/* Adapts each function to the one signature of the table. */
void emit_adapters(struct emission *x, struct text *text) {
    if (x->plan->prepare.out_count)
        text_add(text,
                 "static void %s_prepare_doubles(double *p) {\n    %s_prepare((struct %s_parameters *)(void "
                 "*)p);\n}\n\n",
                 x->name, x->name, x->name);
    for (int f = 0; f < x->plan->function_count; f++)
        if (!x->is_lanes || !emit_is_spatial(&x->plan->functions[f])) /* lanes have no table of these */
            emit_adapter(x, text, &x->plan->functions[f]);
}

static void emit_defaults(struct emission *x, struct text *text) {
    const struct plan *plan = x->plan;
    char digits[32];
    if (!plan->parameter_count)
        return;
    text_add(text, "void %s_defaults(struct %s_parameters *p) {\n", x->name, x->name);
    for (int i = 0; i < plan->parameter_count; i++) {
        const struct parameter *parameter = &plan->model->parameters[plan->parameters[i]];
        const bool waits = parameter->is_anchored && !parameter->is_given;
        text_add(text, "    p->%s = %s;\n", parameter->name,
                 text_of_number(waits ? 0 : parameter->value, digits));
    }
    if (plan->prepare.out_count)
        text_add(text, "    %s_prepare(p);\n", x->name);
    if (plan->anchored_count) {
        const int n = plan->tree->count;
        text_add(text, "    double start[%d], anchored[%d];\n", 2 * n, plan->anchored_count);
        if (plan->model->input_count) {
            text_add(text, "    static const struct %s_inputs inputs = {", x->name);
            for (int i = 0; i < plan->model->input_count; i++)
                text_add(text, "%s%s", i ? ", " : "", text_of_number(plan->model->inputs[i].value, digits));
            text_add(text, "};\n");
        }
        const char *inputs = plan->model->input_count ? "&inputs" : "0";
        text_add(text, "    static const double zeros[%d] = {0.0};\n", n);
        text_add(text, "    %s_start(p, %s, 0.0, zeros, zeros, start);\n", x->name, inputs);
        text_add(text, "    %s_anchor(p, %s, 0.0, start, start + %d, anchored);\n", x->name, inputs, n);
        for (int i = 0; i < plan->anchored_count; i++)
            text_add(text, "    p->%s = anchored[%d];\n", plan->model->parameters[plan->anchored[i]].name, i);
        if (plan->prepare.out_count)
            text_add(text, "    %s_prepare(p);\n", x->name);
    }
    text_add(text, "}\n\n");
}

static void set_pointer(struct emission *x, struct text *text, const char *array, const char *value,
                        bool exists) {
    if (exists)
        text_add(text, "    SET(%s) %s_%s,\n", array, x->name, value);
    else
        text_add(text, "    SET(%s) 0,\n", array);
}

/* The struct has exactly the quantities of REFDYN_QUANTITIES, in the same order. */
#define PLACE(name) PLACE_##name,
enum { REFDYN_QUANTITIES(PLACE) FUNCTION_COUNT };
#define CHECK_PLACE(name)                                                                               \
    _Static_assert(offsetof(struct refdyn_model, name) ==                                               \
                       offsetof(struct refdyn_model, start) + PLACE_##name * sizeof(refdyn_function *), \
                   "the struct and the list of quantities have the same order");
REFDYN_QUANTITIES(CHECK_PLACE)
_Static_assert(sizeof(struct refdyn_model) ==
                   offsetof(struct refdyn_model, start) + FUNCTION_COUNT * sizeof(refdyn_function *),
               "the struct ends with the quantities");

static void set_functions(struct emission *x, struct text *text) {
#define NAME(name) #name,
    static const char *const names[] = {REFDYN_QUANTITIES(NAME)};
    for (int i = 0; i < FUNCTION_COUNT; i++)
        set_pointer(x, text, names[i], memory_format(x->plan->memory, "%s_doubles", names[i]),
                    has_function(x, names[i]));
}

void emit_table_of_functions(struct emission *x, struct text *text) {
    set_pointer(x, text, "prepare", "prepare_doubles", x->plan->prepare.out_count > 0);
    set_functions(x, text);
    text_add(text, "};\n#undef SET\n");
}

/* Operations of one call: a division counts as four, a function as ten; 0: it is not emitted. */
static long cost_of(const struct plan *plan, const char *quantity) {
    const struct function *function = plan_find_function(plan, quantity);
    if (!function)
        return 0;
    const struct operation_count *count = &function->operations;
    return count->adds + count->muls + 4 * count->divs + 10 * count->functions;
}

void emit_before_table(struct text *text, const char *model, const char *macro, const char *header,
                       int version) {
    text_add(text, "/* C checks the names of the fields; C++17 has no designated initialisers, the order is "
                   "the same. */\n"
                   "#ifdef __cplusplus\n#define SET(field)\n#else\n#define SET(field) .field =\n#endif\n\n");
    text_add(text,
             "#if REFDYN_%s_VERSION != %d\n#error \"%s was emitted for version %d of %s, and this %s has "
             "another version: emit it again.\"\n#endif\n\n",
             macro, version, model, version, header, header);
}

static void emit_model_table(struct emission *x, struct text *text, const char *hash) {
    const struct plan *plan = x->plan;
    const struct model *model = plan->model;
    emit_before_table(text, plan->model->name, "MODEL", "refdyn_model.h", REFDYN_MODEL_VERSION);
    text_add(text, "const struct refdyn_model %s_model = {\n    SET(interface_version) %d,\n", x->name,
             REFDYN_MODEL_VERSION);
    text_add(text, "    SET(name) \"%s\",\n    SET(hash) \"%s\",\n", x->name, hash);
    text_add(text, "    SET(n) %d,\n    SET(m) %d,\n", plan->tree->count, model->row_count);
    text_add(text, "    SET(parameter_count) %d,\n    SET(derived_count) %d,\n", plan->parameter_count,
             plan->prepare.out_count);
    text_add(text, "    SET(input_count) %d,\n    SET(point_count) %d,\n", model->input_count,
             model->point_count);
    text_add(text, "    SET(course_count) %d,\n", model->course_count);
    text_add(text, "    SET(break_count) %d,\n    SET(switch_count) %d,\n", plan->break_count,
             plan->switch_count);
    text_add(text, "    SET(event_count) %d,\n    SET(kink_count) %d,\n    SET(change_count) %d,\n",
             model->event_count, model->kink_count, model->change_count);
    text_add(text, "    SET(requirement_count) %d,\n", plan->requirement_count);
    text_add(text, "    SET(saturates) %d,\n    SET(length) %.17g,\n", plan_saturates(plan), model->length);
    text_add(text, "    SET(qdd_cost) %ld,\n    SET(tangent_cost) %ld,\n",
             cost_of(plan, model->row_count ? "constrained" : "qdd_free"), cost_of(plan, "tangent"));
    text_add(text, "    SET(tangent_vectors_cost) %ld,\n    SET(coupling_count) %d,\n",
             cost_of(plan, "tangent_vectors"), plan->coupling_count);
    set_pointer(x, text, "coordinates", "coordinate_names", true);
    set_pointer(x, text, "parameters", "parameter_names", plan->parameter_count > 0);
    set_pointer(x, text, "inputs", "input_names", model->input_count > 0);
    set_pointer(x, text, "points", "points", model->point_count > 0);
    set_pointer(x, text, "courses", "courses", model->course_count > 0);
    set_pointer(x, text, "rows", "rows", model->row_count > 0);
    set_pointer(x, text, "events", "events", model->event_count > 0);
    set_pointer(x, text, "changes", "changes", model->change_count > 0);
    set_pointer(x, text, "requirements", "requirements", plan->requirement_count > 0);
    set_pointer(x, text, "parent", "parent", true);
    set_pointer(x, text, "dependent", "dependent", model->dependent_count > 0);
    set_pointer(x, text, "gains", "gains", model->row_count > 0);
    set_pointer(x, text, "vector_places", "vector_places", plan->vector_places != NULL);
    set_pointer(x, text, "held", "held", model->hold_count > 0);
    text_add(text, "    SET(held_count) %d,\n", model->hold_count);
    set_pointer(x, text, "anchored", "anchored", plan->anchored_count > 0);
    text_add(text, "    SET(anchored_count) %d,\n", plan->anchored_count);
    emit_table_of_functions(x, text);
}

void emit_tables(struct emission *x, struct text *text, const char *hash) {
    emit_defaults(x, text);
    if (x->plan->is_single) /* the runtime, which reads the tables, computes with doubles */
        return;
    emit_names(x, text);
    emit_index_tables(x, text);
    emit_rows_and_points(x, text);
    emit_changes(x, text);
    emit_events(x, text);
    emit_requirements(x, text);
    emit_limits(x, text);
    emit_adapters(x, text);
    emit_spatial(x, text);
    emit_model_table(x, text, hash);
}
