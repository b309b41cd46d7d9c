/*
 * The interpreter of the plan: computes the results of an emitted function node by node, with the doubles of
 * the host. It shares the graph and the form of loops with the printer and nothing else, so that it can judge
 * the C.
 */
#include "tests/judge/judge.h"
#include "gen/plan/plan.h"

#include <assert.h>
#include <string.h>

/* ---- Loops over arrays ---- */

struct loop_values {
    struct loop_walk walk;
    double *all;
};

static double term_value(const struct loop_walk *walk, const struct loop_term *term, const double *all) {
    double value = term->factor;
    for (int k = 0; k < term->operand_count; k++)
        value *= all[loop_place(walk, &term->operands[k])];
    return value;
}

static double sum_value(const struct loop_walk *walk, const struct loop_statement *s, const double *all) {
    double sum = 0, group = 0;
    for (int i = 0; i < s->term_count; i++) {
        const bool begins = s->terms[i].begins_group;
        sum += begins ? group : 0;
        group = (begins ? 0 : group) + term_value(walk, &s->terms[i], all);
    }
    return sum + group;
}

static void assign(struct loop_walk *walk, const struct loop_statement *s, long times) {
    double *all = ((struct loop_values *)walk)->all, *target = &all[loop_place(walk, &s->target)];
    const double value = sum_value(walk, s, all);
    (void)times;
    *target = s->effect == LOOP_SET        ? value
              : s->effect == LOOP_ADD      ? *target + value
              : s->effect == LOOP_MULTIPLY ? *target * value
                                           : 1 / value;
}

/* Runs one loop over the values of all arrays. */
static void run_loop(struct memory *memory, const struct function *function, const struct loop *loop,
                     double *arrays) {
    const size_t count = (size_t)plan_value_count(function);
    struct loop_values values = {.walk.visit = assign};
    values.walk.form = loops_lower(memory, function, loop, false);
    values.all = memory_get(memory, ((size_t)values.walk.form->value_count + 1) * sizeof *values.all);
    memcpy(values.all, arrays, count * sizeof *arrays);
    loop_walk(&values.walk);
    memcpy(arrays, values.all, count * sizeof *arrays);
}

/* ---- Values of nodes ---- */

struct arguments {
    const struct plan *plan;
    const double *p, *x, *q, *qd;
    double t;
};

static double parameter_value(const struct arguments *a, int index) {
    for (int i = 0; i < a->plan->parameter_count; i++)
        if (a->plan->parameters[i] == index)
            return a->p[i];
    return 0;
}

/* Values of nodes. A node of a loop has its value in the latest iteration, and its values in all elements. */
struct state {
    const struct graph *g;
    struct arguments arguments;
    bool *needed;
    double *values, **by_element;
    double *slots;
};

static const struct element_run *run_of(const struct plan *plan, int run) {
    return &plan->rolled->runs[run];
}

/* Accelerations follow the rates in the argument: see enum given in plan.h. */
static double coordinate_value(const struct arguments *a, int coordinate, int order) {
    const int n = a->plan->tree->count;
    return order == 0 ? a->q[coordinate] : a->qd[(order - 1) * n + coordinate];
}

static double element_value(const struct arguments *a, const struct symbol *s, int r) {
    const struct frame *frame = &a->plan->rolled->frames[s->index];
    const int coordinate = frame->coordinate + r * run_of(a->plan, frame->run)->period;
    return coordinate_value(a, coordinate, s->order);
}

static double symbol_value(const struct state *state, const struct symbol *s, int r) {
    const struct arguments *a = &state->arguments;
    switch (s->kind) {
    case SYMBOL_PARAMETER:
        return parameter_value(a, s->index);
    case SYMBOL_INPUT:
        return a->x[s->index];
    case SYMBOL_TIME:
        return a->t;
    case SYMBOL_ELEMENT:
        return element_value(a, s, r);
    case SYMBOL_LAST:
        return r == run_of(a->plan, s->index)->count - 1;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        return state->slots[s->index];
    case SYMBOL_MULTIPLIER:
        return a->qd[2 * a->plan->tree->count + 1 + s->index];
    default:
        assert(s->kind == SYMBOL_COORDINATE); /* no function reads points or start values */
        return coordinate_value(a, s->index, s->order);
    }
}

static void compute(struct state *state, expression e, int r) {
    const struct symbol *s = expr_as_symbol(state->g, e);
    state->values[e] = s ? symbol_value(state, s, r) : graph_node_value(state->g, e, state->values);
}

/* Sets the slots for the next iteration; all new values are computed before any slot changes. */
static void step_slots(struct state *state, int loop) {
    const struct graph *g = state->g;
    for (int s = 0; s < g->slot_count; s++)
        if (g->slots[s].loop == loop)
            state->slots[s] = state->values[g->slots[s].next];
}

/* Two symbols depend on the element of a run: a coordinate of it, and whether it is the last. They have
 * values in the loops over this run alone. */
static bool is_symbol_of(const struct state *state, expression e, int run) {
    if (state->g->nodes[e].loop != ANY_LOOP)
        return false;
    const struct symbol *s = expr_as_symbol(state->g, e);
    return run == (s->kind == SYMBOL_LAST ? s->index : state->arguments.plan->rolled->frames[s->index].run);
}

/* Computes this loop's values for one element; those of earlier loops over the run are available. */
static void run_iteration(struct state *state, int loop, int r) {
    const struct graph *g = state->g;
    const int run = g->loops[loop].run;
    for (expression e = 0; e < g->loops[loop].end; e++) {
        const uint16_t home = g->nodes[e].loop;
        if (!state->needed[e] || !home)
            continue;
        if (home == loop || is_symbol_of(state, e, run))
            compute(state, e, r);
        else if (home != ANY_LOOP && g->loops[home].run == run)
            state->values[e] = state->by_element[e][r];
        if (home == loop)
            state->by_element[e][r] = state->values[e];
    }
    step_slots(state, loop);
}

static void run_element_loop(struct state *state, struct memory *memory, int loop) {
    const struct graph *g = state->g;
    const int count = run_of(state->arguments.plan, g->loops[loop].run)->count;
    for (expression e = g->loops[loop].begin; e < g->loops[loop].end; e++)
        if (state->needed[e] && g->nodes[e].loop == loop)
            state->by_element[e] = memory_get(memory, (size_t)count * sizeof(double));
    for (int s = 0; s < g->slot_count; s++)
        if (g->slots[s].loop == loop)
            state->slots[s] = state->values[g->slots[s].initial];
    for (int i = 0; i < count; i++)
        run_iteration(state, loop, g->loops[loop].inward ? count - 1 - i : i);
}

static double result_value(const struct state *state, expression e, int r) {
    const uint16_t home = state->g->nodes[e].loop;
    if (home == ANY_LOOP)
        return element_value(&state->arguments, expr_as_symbol(state->g, e), r);
    return home ? state->by_element[e][r] : state->values[e];
}

/* Writes an entry and, in a symmetric array, its mirror image. */
static void write_entry(const struct array *array, int entry, double value, double *out) {
    const int n = array->symmetric;
    out[array->offset + entry] = value;
    if (n)
        out[array->offset + entry % n * n + entry / n] = value;
}

static void write_results(const struct state *state, const struct function *function, double *out) {
    for (int f = 0; f < plan_count_arrays(function); f++) {
        const struct array *array = &function->arrays[f];
        for (int i = 0; i < array->single_count; i++)
            write_entry(array, array->singles[i].entry, state->values[array->singles[i].value], out);
    }
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        for (int r = 0; r < run_of(state->arguments.plan, result->run)->count; r++)
            out[function->arrays[result->array].offset + result->entry + r * result->stride] =
                result_value(state, result->value, r);
    }
}

static void interpret(struct plan *plan, const struct function *function, const struct arguments *arguments,
                      double *out);

/* Collects the result of a composed function from the functions that it calls. */
static void interpret_parts(struct plan *plan, const struct function *function,
                            const struct arguments *arguments, double *arrays) {
    for (int i = 0; i < function->part_count; i++) {
        const struct composed_array *part = &function->parts[i];
        const struct array *from = &part->from->arrays[part->from_array];
        double *values = memory_get(plan->memory, ((size_t)part->from->out_count + 1) * sizeof *values);
        interpret(plan, part->from, arguments, values);
        double *array = arrays + function->arrays[part->to_array].offset;
        for (int k = 0; k < from->count; k++)
            array[k] = (part->is_added ? array[k] : 0.0) + values[from->offset + k];
    }
}

static void interpret_nodes(struct plan *plan, const struct function *function,
                            const struct arguments *arguments, double *arrays) {
    const struct graph *g = plan->g;
    struct state state = {.g = g, .arguments = *arguments};
    state.needed = memory_get(plan->memory, g->count * sizeof *state.needed);
    state.values = memory_get(plan->memory, g->count * sizeof *state.values);
    state.by_element = memory_get(plan->memory, g->count * sizeof *state.by_element);
    state.slots = memory_get(plan->memory, ((size_t)g->slot_count + 1) * sizeof *state.slots);
    plan_mark_results(function, state.needed);
    rewrite_mark_operands(g, state.needed, g->count);
    int loop = 1;
    for (expression e = 0; e < g->count; e++) {
        for (; loop < g->loop_count && g->loops[loop].end <= e; loop++)
            run_element_loop(&state, plan->memory, loop);
        if (state.needed[e] && !g->nodes[e].loop)
            compute(&state, e, 0);
    }
    for (; loop < g->loop_count; loop++)
        run_element_loop(&state, plan->memory, loop);
    write_results(&state, function, arrays);
}

static void interpret(struct plan *plan, const struct function *function, const struct arguments *arguments,
                      double *out) {
    double *arrays = memory_get(plan->memory, ((size_t)plan_value_count(function) + 1) * sizeof *arrays);
    if (function->part_count)
        interpret_parts(plan, function, arguments, arrays);
    else
        interpret_nodes(plan, function, arguments, arrays);
    for (int i = 0; i < function->loop_count; i++)
        run_loop(plan->memory, function, &function->loops[i], arrays);
    memcpy(out, arrays, (size_t)function->out_count * sizeof *out);
}

int judge_interpret(const struct generation *generation, const char *quantity, const double *p,
                    const double *x, double t, const double *q, const double *qd, double *out) {
    struct plan *plan = generation->plan;
    const struct function *function = plan_find_function(plan, quantity);
    const struct arguments arguments = {plan, p, x, q, qd, t};
    if (!function)
        return 1;
    interpret(plan, function, &arguments, out);
    return 0;
}
