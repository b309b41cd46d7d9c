/*
 * A model's functions as CasADi loads them. Input: the plan. Output: NAME_casadi.c, which includes the
 * model's own C under other names and is compiled alone into a shared library.
 *
 * Interface: CasADi 3.6 and later, "external functions". The Jacobian of F is a function jac_F of F's inputs
 * and outputs, whose outputs are the blocks of all pairs, by output. text/casadi_body.c.in has the part that
 * is the same for all models.
 */
#include "gen/emit/emit.h"

#include <string.h>

/* ---- Nonzero entries ---- */

/*
 * Determines which entries of a function's arrays may be nonzero, by place. Straight-line code sets entries
 * one by one; loops are executed with truths instead of numbers: a product is nonzero if both factors are.
 */

static void mark_entry(bool *is_there, const struct array *array, int entry) {
    const int n = array->symmetric;
    is_there[array->offset + entry] = true;
    if (n > 0) /* only the lower half is computed */
        is_there[array->offset + entry % n * n + entry / n] = true;
}

static void mark_straight_code(const struct plan *plan, const struct function *function, bool *is_there) {
    for (int f = 0; f < plan_count_arrays(function); f++)
        for (int i = 0; i < function->arrays[f].single_count; i++)
            mark_entry(is_there, &function->arrays[f], function->arrays[f].singles[i].entry);
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        for (int e = 0; e < plan->rolled->runs[result->run].count; e++)
            mark_entry(is_there, &function->arrays[result->array], result->entry + e * result->stride);
    }
}

struct truths {
    struct loop_walk walk;
    bool *is_there;
};

static void mark_assignment(struct loop_walk *walk, const struct loop_statement *s, long times) {
    bool *is_there = ((struct truths *)walk)->is_there, *target = &is_there[loop_place(walk, &s->target)];
    bool value = s->effect == LOOP_ADD && *target;
    (void)times;
    for (int i = 0; i < s->term_count; i++) {
        bool term = true;
        for (int k = 0; k < s->terms[i].operand_count; k++)
            term = term && is_there[loop_place(walk, &s->terms[i].operands[k])];
        value = value || term;
    }
    *target = s->effect == LOOP_MULTIPLY ? *target && value : value;
}

static bool *mark_loop(const struct plan *plan, const struct function *function, const struct loop *loop,
                       const bool *before) {
    struct truths truths = {.walk.visit = mark_assignment};
    truths.walk.form = loops_lower(plan->memory, function, loop, false);
    truths.is_there = memory_get(plan->memory, (size_t)truths.walk.form->value_count + 1);
    memcpy(truths.is_there, before, (size_t)plan_value_count(function) * sizeof *before);
    loop_walk(&truths.walk);
    return truths.is_there;
}

static bool *mark_nonzeros(const struct plan *plan, const struct function *function) {
    bool *is_there = memory_get(plan->memory, (size_t)plan_value_count(function) + 1);
    mark_straight_code(plan, function, is_there);
    for (int i = 0; i < function->part_count; i++) {
        const struct composed_array *part = &function->parts[i];
        const struct array *from = &part->from->arrays[part->from_array];
        const bool *marked = mark_nonzeros(plan, part->from);
        for (int e = 0; e < from->count; e++)
            if (marked[from->offset + e])
                is_there[function->arrays[part->to_array].offset + e] = true;
    }
    for (int l = 0; l < function->loop_count; l++)
        is_there = mark_loop(plan, function, &function->loops[l], is_there);
    return is_there;
}

/* text/casadi_body.c.in, embedded by the build. */
extern const char casadi_body[];

/* An input or output of a function for CasADi; entry (i, j) is value place + i * stride + j. */
struct port {
    const char *name;
    int rows, columns, place, stride;
    const bool *is_there; /* rows x columns, whether an entry may be nonzero; NULL: all may */
    bool is_empty;        /* it has no values */
};

struct ports {
    struct memory *memory;
    struct port *list;
    int count, capacity;
};

struct writer {
    struct emission *x;
    struct plan *plan;
    struct text *text;
    const char *name;
    const char **patterns; /* texts of the patterns printed so far */
    int pattern_count, pattern_capacity;
};

/* ---- Patterns ---- */

static bool is_port_entry(const struct port *port, int i, int j) {
    return !port->is_empty && (!port->is_there || port->is_there[i * port->columns + j]);
}

static int count_entries(const struct port *port) {
    int count = 0;
    for (int k = 0; k < port->rows * port->columns; k++)
        count += is_port_entry(port, k / port->columns, k % port->columns);
    return count;
}

static void add_number(struct text *text, int number) {
    if (text_column(text) > 100)
        text_add(text, "\n   ");
    text_add(text, ", %d", number);
}

/* "4, 4, 1", or by columns. */
static const char *pattern_text(struct memory *memory, const struct port *port) {
    struct text text = {.memory = memory};
    const int entries = count_entries(port);
    text_add(&text, "%d, %d", port->rows, port->columns);
    if (entries == port->rows * port->columns && entries > 0) {
        add_number(&text, 1);
        return text.data;
    }
    for (int j = 0, begin = 0; j <= port->columns; j++) {
        add_number(&text, begin);
        for (int i = 0; j < port->columns && i < port->rows; i++)
            begin += is_port_entry(port, i, j);
    }
    for (int j = 0; j < port->columns; j++)
        for (int i = 0; i < port->rows; i++)
            if (is_port_entry(port, i, j))
                add_number(&text, i);
    return text.data;
}

/* The number of a pattern, which is printed if it is new. */
static int put_pattern(struct writer *w, const struct port *port) {
    const char *pattern = pattern_text(w->plan->memory, port);
    for (int i = 0; i < w->pattern_count; i++)
        if (!strcmp(w->patterns[i], pattern))
            return i;
    w->patterns = memory_room(w->plan->memory, w->patterns, w->pattern_count, &w->pattern_capacity,
                              sizeof *w->patterns);
    w->patterns[w->pattern_count] = pattern;
    text_add(w->text, "static const casadi_int casadi_pattern_%d[] = {%s};\n", w->pattern_count, pattern);
    return w->pattern_count++;
}

/* ---- Functions ---- */

static struct port *add_port(struct ports *ports, const char *name, int rows, int columns) {
    ports->list =
        memory_room(ports->memory, ports->list, ports->count, &ports->capacity, sizeof *ports->list);
    struct port *port = &ports->list[ports->count++];
    *port = (struct port){.name = name, .rows = rows, .columns = columns, .stride = columns};
    return port;
}

static void put_ports(struct writer *w, const char *name, const char *what, const struct ports *ports) {
    int *const patterns = memory_get(w->plan->memory, (size_t)ports->count * sizeof *patterns);
    for (int i = 0; i < ports->count; i++)
        patterns[i] = put_pattern(w, &ports->list[i]);
    text_add(w->text, "static const struct casadi_slot %s_%s[] = {\n", name, what);
    for (int i = 0; i < ports->count; i++)
        text_add(w->text, "    {\"%s\", casadi_pattern_%d, %d, %d},\n", ports->list[i].name, patterns[i],
                 ports->list[i].place, ports->list[i].stride);
    text_add(w->text, "};\n");
}

/* Prints the table and the functions of `name`. NAME_compute computes it; its inputs have a table already. */
static void put_function(struct writer *w, const char *name, const char *in_table, int in_count,
                         const struct ports *out, int value_count, int work_count) {
    put_ports(w, name, "out", out);
    text_add(w->text,
             "static const struct casadi_function %s_table = {%d, %d, %s, %s_out, %s_compute, %d, %d};\n",
             name, in_count, out->count, in_table, name, name, value_count, work_count);
    text_add(w->text, "CASADI_FUNCTION(%s, %s_table)\n\n", name, name);
}

/* Prints a Jacobian, which has a separate table of inputs. */
static void put_jacobian_function(struct writer *w, const char *name, const struct ports *in,
                                  const struct ports *out, int value_count, int work_count) {
    put_ports(w, name, "in", in);
    put_function(w, name, memory_format(w->plan->memory, "%s_in", name), in->count, out, value_count,
                 work_count);
}

/* Number of doubles in struct NAME_parameters, including the values that `prepare` computes. */
static int doubles_of_parameters(const struct plan *plan) {
    return plan->parameter_count + plan->prepare.out_count;
}

/* What functions read in addition to the state, the inputs and the parameters. */
enum reads { READS_STATE, READS_ACCELERATIONS, READS_STEP };

/* The arguments of a function of the model. */
static void list_inputs(const struct plan *plan, enum reads reads, struct ports *ports) {
    const int n = plan->tree->count;
    *ports = (struct ports){.memory = plan->memory};
    add_port(ports, "q", n, 1);
    add_port(ports, "qd", n, 1);
    if (reads == READS_ACCELERATIONS)
        add_port(ports, "qdd", n, 1);
    add_port(ports, "t", 1, 1);
    if (reads == READS_STEP)
        add_port(ports, "h", 1, 1);
    add_port(ports, "inputs", plan->model->input_count, 1);
    add_port(ports, "parameters", plan->parameter_count, 1);
}

/* The name of the derivatives with respect to an input, as in d_qdd. */
static const char *block_of_input(const char *input) {
    return !strcmp(input, "inputs") ? "x" : !strcmp(input, "parameters") ? "p" : input;
}

/* The inputs of a Jacobian are followed by the outputs of its function, which it does not read. */
static void add_outputs_to_inputs(struct writer *w, struct ports *in, const struct ports *out) {
    for (int i = 0; i < out->count; i++)
        add_port(in, memory_format(w->plan->memory, "out_%s", out->list[i].name), out->list[i].rows,
                 out->list[i].columns)
            ->is_empty = true;
}

/* A block of a Jacobian, empty until its place is set. */
static struct port *add_block(struct writer *w, struct ports *blocks, const struct port *out,
                              const struct port *in) {
    struct port *block = add_port(blocks, memory_format(w->plan->memory, "jac_%s_%s", out->name, in->name),
                                  out->rows * out->columns, in->rows);
    block->is_empty = true;
    return block;
}

static void set_block(struct port *block, int place, int stride, const bool *is_there) {
    block->is_empty = false;
    block->place = place;
    block->stride = stride;
    block->is_there = is_there;
}

/* ---- Quantities ---- */

/* CasADi calls functions of the state and of accelerations; it has derivatives as Jacobians of these. */
static bool is_for_casadi(const struct function *function) {
    return function->given != GIVEN_MOTION && !function->has_blocks && !function->is_for_runtime;
}

bool emit_has_casadi_function(const struct plan *plan) {
    for (int f = 0; f < plan->function_count; f++)
        if (is_for_casadi(&plan->functions[f]))
            return true;
    return false;
}

static bool reads_accelerations(const struct function *function) {
    return function->given == GIVEN_ACCELERATIONS;
}

static void put_compute(struct writer *w, const char *name, const struct function *function) {
    text_add(w->text,
             "static int %s_compute(const casadi_real *const *arguments, casadi_real *values, casadi_real "
             "*work) {\n"
             "    return casadi_call%s(%s_%s_doubles, arguments, values, work);\n}\n",
             name, reads_accelerations(function) ? "_with_qdd" : "", w->name, function->quantity);
}

/* Scratch of a function: the parameters, then qd and qdd in one array. */
static int work_of(const struct plan *plan, const struct function *function) {
    return doubles_of_parameters(plan) + (reads_accelerations(function) ? 2 * plan->tree->count : 0);
}

static void list_results(const struct plan *plan, const struct function *function, struct ports *out) {
    const bool *is_there = mark_nonzeros(plan, function);
    *out = (struct ports){.memory = plan->memory};
    for (int i = 0; i < function->array_count; i++) {
        const struct array *array = &function->arrays[i];
        const int columns = plan_columns_of(array), width = array->columns ? columns : 1;
        struct port *port = add_port(out, array->name, array->count / width, width);
        set_block(port, array->offset, width, is_there + array->offset);
    }
}

static void find_block(const struct function *function, const bool *is_there, const char *name,
                       struct port *block) {
    for (int i = 0; i < function->array_count; i++) {
        const struct array *array = &function->arrays[i];
        if (!strcmp(array->name, name))
            set_block(block, array->offset, array->columns, is_there + array->offset);
    }
}

static void put_jacobian(struct writer *w, const struct function *function, const struct ports *in,
                         const struct ports *out) {
    const struct derivatives_of *rule = quantities_derivatives_of(function->quantity);
    const struct function *derivatives = rule ? plan_find_function(w->plan, rule->function) : NULL;
    struct ports all = *in, blocks = {.memory = w->plan->memory};
    if (!derivatives)
        return;
    const bool *is_there = mark_nonzeros(w->plan, derivatives);
    for (int i = 0; i < in->count; i++)
        find_block(derivatives, is_there,
                   memory_format(w->plan->memory, "%s%s", rule->before, block_of_input(in->list[i].name)),
                   add_block(w, &blocks, &out->list[0], &in->list[i]));
    add_outputs_to_inputs(w, &all, out);
    const char *name = memory_format(w->plan->memory, "jac_%s_%s", w->name, function->quantity);
    put_compute(w, name, derivatives);
    put_jacobian_function(w, name, &all, &blocks, derivatives->out_count, work_of(w->plan, derivatives));
}

static void put_quantity(struct writer *w, const struct function *function) {
    const char *name = memory_format(w->plan->memory, "%s_%s", w->name, function->quantity);
    struct ports in, out;
    const bool has_qdd = reads_accelerations(function);
    list_inputs(w->plan, has_qdd ? READS_ACCELERATIONS : READS_STATE, &in);
    list_results(w->plan, function, &out);
    text_add(w->text, "/* %s */\n", function->about);
    put_compute(w, name, function);
    put_function(w, name, has_qdd ? "casadi_qdd_in" : "casadi_state_in", in.count, &out, function->out_count,
                 work_of(w->plan, function));
    put_jacobian(w, function, &in, &out);
}

/* ---- Steps ---- */

static void put_step_compute(struct writer *w, const char *name, const char *step, bool has_derivatives) {
    const struct plan *plan = w->plan;
    text_add(w->text,
             "static int %s_compute(const casadi_real *const *arguments, casadi_real *values, casadi_real "
             "*work) {\n"
             "    casadi_take_parameters(arguments[5], work);\n"
             "    return refdyn_%s_%s((const struct %s_parameters *)(const void *)work,\n"
             "        (const struct %s_inputs *)(const void *)arguments[4], *arguments[2], *arguments[3], 1, "
             "arguments[0], arguments[1], values,\n        %s%s%s, work + %d);\n}\n",
             name, w->name, step, w->name, w->name, has_derivatives ? "(struct " : "",
             has_derivatives ? w->name : "0",
             has_derivatives ? "_step_derivatives *)(void *)(values + 2 * STEP_N)" : "",
             doubles_of_parameters(plan));
}

/* Values: the state at the end, 2 n, then the parts of its derivatives, each of 2 n rows: n of q, n of qd.
 * The part `state` has n columns by q, then n by qd. */
static void put_step_jacobian(struct writer *w, const char *step, const struct ports *in,
                              const struct ports *out, int work_count) {
    const int n = w->plan->tree->count;
    struct ports all = *in, blocks = {.memory = w->plan->memory};
    for (int o = 0; o < out->count; o++)
        for (int i = 0; i < in->count; i++) {
            const struct port *input = &in->list[i];
            struct port *block = add_block(w, &blocks, &out->list[o], input);
            const bool is_state = i < 2;
            const struct step_place place =
                emit_step_place(w->plan, is_state ? "state" : block_of_input(input->name));
            if (place.columns)
                set_block(block, 2 * n + place.offset + o * n * place.columns + (is_state ? i * n : 0),
                          place.columns, NULL);
        }
    add_outputs_to_inputs(w, &all, out);
    const char *name = memory_format(w->plan->memory, "jac_%s_%s", w->name, step);
    put_step_compute(w, name, step, true);
    put_jacobian_function(w, name, &all, &blocks, 2 * n + emit_step_place(w->plan, NULL).offset, work_count);
}

static int step_work_count(const struct plan *plan, int method, bool has_derivatives) {
    return doubles_of_parameters(plan) + (int)emit_step_work(plan, method, has_derivatives);
}

static void put_step(struct writer *w, int method) {
    const int n = w->plan->tree->count;
    const char *step = memory_format(w->plan->memory, "step_%s", emit_step_method(method));
    const char *name = memory_format(w->plan->memory, "%s_%s", w->name, step);
    struct ports in, out = {.memory = w->plan->memory};
    list_inputs(w->plan, READS_STEP, &in);
    add_port(&out, "q_next", n, 1);
    add_port(&out, "qd_next", n, 1)->place = n;
    text_add(w->text, "/* one step of length h */\n");
    put_step_compute(w, name, step, false);
    put_function(w, name, "casadi_step_in", in.count, &out, 2 * n, step_work_count(w->plan, method, false));
    put_step_jacobian(w, step, &in, &out, step_work_count(w->plan, method, true));
}

/* ---- Defaults ---- */

static void put_defaults(struct writer *w) {
    const struct plan *plan = w->plan;
    const int n = plan->tree->count, k = plan->model->input_count, parameters = plan->parameter_count;
    struct ports out = {.memory = plan->memory};
    add_port(&out, "q", n, 1);
    add_port(&out, "qd", n, 1)->place = n;
    add_port(&out, "inputs", k, 1)->place = 2 * n;
    add_port(&out, "parameters", parameters, 1)->place = 2 * n + k;
    text_add(w->text,
             "/* the model's values: the start of a motion, inputs, parameters */\n"
             "static int %s_defaults_compute(const casadi_real *const *arguments, casadi_real *values, "
             "casadi_real *work) {\n    (void)arguments;\n",
             w->name);
    if (parameters)
        text_add(w->text, "    refdyn_%s_defaults((struct %s_parameters *)(void *)work);\n", w->name,
                 w->name);
    for (int i = 0; i < k; i++)
        text_add(w->text, "    values[%d] = %s_input_names[%d].value;\n", 2 * n + i, w->name, i);
    text_add(w->text,
             "    memset(values, 0, %d * sizeof *values);\n"
             "    %s_start_doubles(work, values + %d, 0.0, values, values, work + %d);\n"
             "    memcpy(values, work + %d, %d * sizeof *values);\n",
             2 * n, w->name, 2 * n, doubles_of_parameters(plan), doubles_of_parameters(plan), 2 * n);
    if (parameters)
        text_add(w->text, "    memcpy(values + %d, work, %d * sizeof *values);\n", 2 * n + k, parameters);
    text_add(w->text, "    return 0;\n}\n");
    put_function(w, memory_format(plan->memory, "%s_defaults", w->name), "0", 0, &out, 2 * n + k + parameters,
                 doubles_of_parameters(plan) + 2 * n);
}

/* ---- The file ---- */

static void put_named(struct writer *w, const char *what, const char *name, const char *unit, int place) {
    text_add(w->text, " *   %s %d %s [%s]\n", what, place, name, text_comment(w->plan->memory, unit));
}

static bool has_accelerations(const struct plan *plan) {
    for (int f = 0; f < plan->function_count; f++)
        if (reads_accelerations(&plan->functions[f]))
            return true;
    return false;
}

static void put_remarks(struct writer *w) {
    const struct plan *plan = w->plan;
    text_add(w->text,
             "%s/*\n * Functions for CasADi 3.6 and later:\n"
             " *     cc -O2 -fPIC -shared -I$REFDYN_INCLUDE %s_casadi.c -o lib%s_casadi.so -lm\n"
             " * where REFDYN_INCLUDE is the folder of refdyn_model.h, then\n"
             " *     casadi.external(\"%s_qdd\", \"./lib%s_casadi.so\")\n"
             " * Arguments: q, qd, t, inputs, parameters; a step has its length h after t%s. %s_defaults "
             "returns the "
             "model's values.\n",
             emit_lead(plan->memory, w->name, "CasADi"), w->name, w->name, w->name, w->name,
             has_accelerations(plan) ? ", inverse dynamics qdd after qd" : "", w->name);
    for (int i = 0; i < plan->tree->count && i < 20; i++)
        put_named(w, "q", plan->tree->frames[i].name, plan->tree->frames[i].joint.is_revolute ? "rad" : "m",
                  i);
    if (plan->tree->count > 20)
        text_add(w->text, " *   and so on: %s.h\n", w->name);
    for (int i = 0; i < plan->model->input_count; i++)
        put_named(w, "inputs", plan->model->inputs[i].name, plan->model->inputs[i].unit, i);
    for (int i = 0; i < plan->parameter_count; i++)
        put_named(w, "parameters", plan->model->parameters[plan->parameters[i]].name,
                  plan->model->parameters[plan->parameters[i]].unit, i);
    text_add(w->text, " */\n");
}

static void put_renaming(struct writer *w, const char *what) {
    text_add(w->text, "#define %s_%s refdyn_%s_%s\n", w->name, what, w->name, what);
}

static void put_end_of_renaming(struct writer *w, const char *what) {
    text_add(w->text, "#undef %s_%s\n", w->name, what);
}

/* Applies `put` to all global names in the model's own files. */
static void for_all_names(struct writer *w, void (*put)(struct writer *w, const char *what)) {
    static const char *const others[] = {"defaults", "prepare", "model", "limits", "spatial"};
    static const char *const of_step[] = {"", "_state", "_work"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        put(w, others[i]);
    for (int f = 0; f < w->plan->function_count; f++)
        put(w, w->plan->functions[f].quantity);
    for (int i = 0; w->plan->has_step && emit_step_method(i); i++)
        for (size_t k = 0; k < sizeof of_step / sizeof *of_step; k++)
            put(w, memory_format(w->plan->memory, "step_%s%s", emit_step_method(i), of_step[k]));
}

static void put_includes(struct writer *w) {
    text_add(w->text,
             "\n/* The model's own functions, renamed, because CasADi's functions have their names. */\n");
    for_all_names(w, put_renaming);
    for (int i = 1; i < w->plan->file_count - w->plan->companion_count; i++) /* 0 is the header */
        text_add(w->text, "#include \"%s\"\n", w->plan->files[i].name);
    if (w->plan->has_step)
        text_add(w->text, "#include \"%s_step.c\"\n", w->name);
    for_all_names(w, put_end_of_renaming);
}

/* The length of the longest input that may be NULL. */
static int largest_input(const struct plan *plan) {
    const int n = plan->tree->count, k = plan->model->input_count, p = plan->parameter_count;
    const int larger = n > k ? n : k;
    return larger > p ? larger : p > 1 ? p : 1;
}

static void put_calls(struct writer *w) {
    const struct plan *plan = w->plan;
    text_add(w->text, "/* Copies the parameters and computes the values derived from them. */\n"
                      "static void casadi_take_parameters(const casadi_real *from, casadi_real *p) {\n");
    if (plan->parameter_count)
        text_add(w->text, "    memcpy(p, from, %d * sizeof *p);\n", plan->parameter_count);
    else
        text_add(w->text, "    (void)from;\n    (void)p;\n");
    if (plan->prepare.out_count)
        text_add(w->text, "    %s_prepare_doubles(p);\n", w->name);
    text_add(w->text, "}\n\nstatic int casadi_call(refdyn_function *function, const casadi_real *const "
                      "*arguments, casadi_real "
                      "*values,\n                       casadi_real *p) {\n"
                      "    casadi_take_parameters(arguments[4], p);\n"
                      "    function(p, arguments[3], *arguments[2], arguments[0], arguments[1], values);\n"
                      "    return 0;\n}\n\n");
    if (!has_accelerations(plan))
        return;
    text_add(
        w->text,
        "/* The arguments are q, qd, qdd, t, inputs, parameters; the function expects qdd after qd. */\n"
        "static int casadi_call_with_qdd(refdyn_function *function, const casadi_real *const *arguments, "
        "casadi_real *values,\n                                casadi_real *p) {\n"
        "    casadi_real *const rates = p + %d;\n"
        "    const casadi_real *const others[] = {arguments[0], rates, arguments[3], arguments[4], "
        "arguments[5]};\n"
        "    memcpy(rates, arguments[1], %d * sizeof *rates);\n"
        "    memcpy(rates + %d, arguments[2], %d * sizeof *rates);\n"
        "    return casadi_call(function, others, values, p);\n}\n\n",
        doubles_of_parameters(plan), plan->tree->count, plan->tree->count, plan->tree->count);
}

/* The inputs that all functions of the state share, those of all functions of accelerations, and of all
 * steps. */
static void put_inputs(struct writer *w) {
    struct ports in;
    list_inputs(w->plan, READS_STATE, &in);
    put_ports(w, "casadi_state", "in", &in);
    if (has_accelerations(w->plan)) {
        list_inputs(w->plan, READS_ACCELERATIONS, &in);
        put_ports(w, "casadi_qdd", "in", &in);
    }
    if (w->plan->has_step) {
        list_inputs(w->plan, READS_STEP, &in);
        put_ports(w, "casadi_step", "in", &in);
    }
}

void emit_casadi(struct emission *x, struct text *text) {
    struct writer w = {.x = x, .plan = x->plan, .text = text, .name = x->plan->model->name};
    put_remarks(&w);
    put_includes(&w);
    text_add(text, "\n#define CASADI_LARGEST_INPUT %d\n%s\n", largest_input(w.plan), casadi_body);
    put_calls(&w);
    put_defaults(&w);
    put_inputs(&w);
    for (int f = 0; f < w.plan->function_count; f++)
        if (is_for_casadi(&w.plan->functions[f]))
            put_quantity(&w, &w.plan->functions[f]);
    for (int i = 0; w.plan->has_step && emit_step_method(i); i++)
        put_step(&w, i);
}
