/*
 * The interpreter of the plan: computes the results of an emitted function node by node, with the doubles of
 * the host. It shares the graph with the printer and nothing else, so that it can judge the C.
 */
#include "gen/plan/plan.h"

#include <assert.h>
#include <string.h>

/* ---- Loops over arrays (plan.h), in the order of the emitted loops ---- */

struct values {
    struct memory *memory;
    const struct function *function;
    double *all;
};

static double *start_of(const struct values *v, int array) {
    return v->all + v->function->arrays[array].offset;
}

static double dot(const struct values *v, const struct pair_terms *terms, int i, int j) {
    double sum = 0;
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++)
            if (has_component(&terms->terms[t], a)) {
                const struct pair_term *term = &terms->terms[t];
                sum += term->factor * start_of(v, term->near.at[a])[j] * start_of(v, term->far.at[a])[i];
            }
    return sum;
}

static void add_pair(const struct values *v, const struct pairs *pairs, const struct pair_product *product,
                     int i, int j) {
    const struct pair_entries *entries = pairs->is_revolute[j] ? &product->turn : &product->slide;
    const int row = pairs->order[i], column = pairs->order[j], n = pairs->n;
    double *array = start_of(v, product->array);
    const double below = dot(v, &entries->rows, i, j);
    array[row * n + column] += below;
    if (i != j)
        array[column * n + row] += product->is_mirrored ? below : dot(v, &entries->columns, i, j);
}

static double entry(const struct values *v, int array, int i) {
    return array == NOTHING ? 0 : start_of(v, array)[i];
}

static void move(const struct values *v, const struct pair_move *move, int i, int j) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const double more = entry(v, move->shift.at[b], j) * entry(v, move->force.at[c], i) -
                            entry(v, move->shift.at[c], j) * entry(v, move->force.at[b], i);
        if (move->moment.at[a] != NOTHING)
            start_of(v, move->moment.at[a])[i] += more;
    }
}

static void run_pairs(const struct values *v, const struct pairs *pairs) {
    for (int j = pairs->n - 1; j >= 0; j--)
        for (int i = j; i < pairs->end[j]; i++) {
            for (int p = 0; p < pairs->product_count; p++)
                add_pair(v, pairs, &pairs->products[p], i, j);
            for (int m = 0; m < pairs->move_count && pairs->moves_on[j]; m++)
                move(v, &pairs->moves[m], i, j);
        }
}

static void run_product(const struct values *v, const struct product *p) {
    const struct array *arrays = v->function->arrays;
    const int height = plan_columns_of(&arrays[p->left]), width = plan_columns_of(&arrays[p->right]);
    const int sum = arrays[p->left].count / height;
    for (int k = 0; k < sum; k++)
        for (int i = 0; i < height; i++) {
            const double left = p->factor * start_of(v, p->left)[k * height + i];
            for (int j = 0; j < width; j++)
                start_of(v, p->target)[i * width + j] += left * start_of(v, p->right)[k * width + j];
        }
}

static void run_factoring(const struct values *v, const struct factoring *factoring) {
    const int n = plan_columns_of(&v->function->arrays[factoring->matrix]);
    double *A = start_of(v, factoring->matrix);
    for (int k = n - 1; k >= 0; k--) {
        A[k * n + k] = 1 / A[k * n + k];
        for (int i = 0; i < k; i++) {
            const double part = A[k * n + i] * A[k * n + k];
            for (int j = 0; j <= i; j++)
                A[i * n + j] -= part * A[k * n + j];
        }
        for (int i = 0; i < k; i++)
            A[k * n + i] *= A[k * n + k];
    }
}

static void run_solving(const struct values *v, const struct solving *solving) {
    const int n = plan_columns_of(&v->function->arrays[solving->matrix]);
    const int width = v->function->arrays[solving->array].count / n;
    const double *L = start_of(v, solving->matrix);
    double *b = start_of(v, solving->array);
    for (int k = n - 1; k >= 0; k--)
        for (int i = 0; i < k; i++)
            for (int j = 0; j < width; j++)
                b[i * width + j] -= L[k * n + i] * b[k * width + j];
    for (int k = 0; k < n; k++)
        for (int j = 0; j < width; j++)
            b[k * width + j] *= -L[k * n + k];
    for (int k = 0; k < n; k++)
        for (int i = 0; i < k; i++)
            for (int j = 0; j < width; j++)
                b[k * width + j] -= L[k * n + i] * b[i * width + j];
}

/* One state of the sweeps: an acceleration, and the changes of velocity and of direction that began it. */
struct swept {
    double angular[3], linear[3], spin[3], turned[3];
};

static void read_vector(const struct values *v, const struct vector_arrays *arrays, int i, double *to) {
    for (int a = 0; a < 3; a++)
        to[a] = entry(v, arrays->at[a], i);
}

static double add_dot(const struct values *v, double sum, const struct vector_arrays *arrays, int i,
                      const double *state) {
    for (int a = 0; a < 3; a++)
        sum += entry(v, arrays->at[a], i) * state[a];
    return sum;
}

static void add_crossed(const struct values *v, const double *state, const struct vector_arrays *arrays,
                        int i, double *to) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        to[a] += state[b] * entry(v, arrays->at[c], i) - state[c] * entry(v, arrays->at[b], i);
    }
}

static void move_state(const struct values *v, const struct sweeps *s, int i, struct swept *state) {
    double more[3] = {0};
    if (!s->moves_on[i])
        return;
    add_crossed(v, state->angular, &s->shift, i, more);
    add_crossed(v, state->spin, &s->swing, i, more);
    for (int a = 0; a < 3; a++)
        state->linear[a] += more[a];
}

static double held(const struct values *v, const struct sweeps *s, int i, const struct swept *state) {
    const double sum = add_dot(v, 0, &s->hold_force, i, state->linear);
    return add_dot(v, add_dot(v, sum, &s->hold_spin, i, state->spin), &s->hold_turned, i, state->turned);
}

/* Carries a state across the stage at position i. x: minus the accelerations of its joints. */
static void pass_stage(const struct values *v, const struct sweeps *s, int i, struct swept *state,
                       double x[3]) {
    double after[3], gain[3];
    if (s->kind[i] != STAGE_BALL) {
        double *along = s->kind[i] == STAGE_TURN ? state->angular : state->linear;
        x[0] = add_dot(v, held(v, s, i, state), &s->hold_moment, i, state->angular);
        for (int a = 0; a < 3; a++)
            along[a] -= entry(v, s->turn.at[a], i) * x[0];
        return;
    }
    for (int r = 0; r < 3; r++) {
        after[r] = held(v, s, i + r, state);
        gain[r] = after[r] + state->angular[r];
    }
    for (int r = 0; r < 3; r++) {
        x[r] = add_dot(v, 0, &s->turn, i + r, gain);
        state->angular[r] = -after[r];
    }
}

/* The states of column j: the response to a unit force, and the two columns. */
struct swept_column {
    struct swept response, by[2];
};

static void sweep_pair(const struct values *v, const struct sweeps *s, int i, int j,
                       struct swept_column *states) {
    const int n = s->n, joints = sweeps_joints_at(s, i), row = s->order[i], other = s->order[j];
    double x[3];
    move_state(v, s, i, &states->response);
    for (int c = 0; c < s->column_count; c++) {
        const struct sweep_column *column = &s->columns[c];
        double *entries = start_of(v, column->array);
        for (int r = 0; r < joints; r++) {
            const double up = add_dot(v, 0, &column->push_moment, i + r, states->response.angular);
            entries[other * n + row + r] =
                -add_dot(v, up, &column->push_force, i + r, states->response.linear);
        }
        move_state(v, s, i, &states->by[c]);
        pass_stage(v, s, i, &states->by[c], x);
        for (int r = 0; r < joints; r++)
            entries[(row + r) * n + other] = -x[r];
    }
    pass_stage(v, s, i, &states->response, x);
}

static void begin_column(const struct values *v, const struct sweeps *s, int j, struct swept_column *states) {
    *states = (struct swept_column){.response = {.angular = {0}}};
    read_vector(v, &s->start_angular, j, states->response.angular);
    read_vector(v, &s->start_linear, j, states->response.linear);
    for (int c = 0; c < s->column_count; c++) {
        const struct sweep_column *column = &s->columns[c];
        read_vector(v, &column->start_angular, j, states->by[c].angular);
        read_vector(v, &column->start_linear, j, states->by[c].linear);
        read_vector(v, &column->spin, j, states->by[c].spin);
        read_vector(v, &column->turned, j, states->by[c].turned);
    }
}

/* The first position of the stage that position i belongs to. */
static int stage_at(const struct sweeps *s, int i) {
    while (s->kind[i] == STAGE_PART)
        i--;
    return i;
}

/* The acceleration of the body after position i by one unit wrench. */
static struct swept unit_response(const struct values *v, const struct sweeps *s, int i, int unit) {
    const struct sweep_branch *branch = s->branches;
    struct swept response = {.angular = {0}};
    while (branch->first != i + 1)
        branch++;
    read_vector(v, &s->unit_angular, UNIT_WRENCHES * branch->body + unit, response.angular);
    read_vector(v, &s->unit_linear, UNIT_WRENCHES * branch->body + unit, response.linear);
    return response;
}

/* Carries a response from the body after position `from` to what carries the stage at position i. */
static void carry_between(const struct values *v, const struct sweeps *s, int from, int i,
                          struct swept *response) {
    const int parent = s->parent[i];
    double x[3];
    if (parent != from) {
        const int stage = stage_at(s, parent);
        carry_between(v, s, from, stage, response);
        pass_stage(v, s, stage, response, x);
    }
    move_state(v, s, i, response);
}

/* The states of column j at the body after position `at`, which carries joint j and other branches. By
 * reciprocity they follow from the body's responses to unit wrenches. */
static struct swept_column seen_from(const struct values *v, const struct sweeps *s, int at, int j) {
    struct swept_column seen = {.response = {.angular = {0}}};
    const int stage = stage_at(s, j);
    for (int unit = 0; unit < UNIT_WRENCHES; unit++) {
        struct swept response = unit_response(v, s, at, unit);
        double x[3];
        carry_between(v, s, at, stage, &response);
        for (int c = 0; c < s->column_count; c++) {
            const double up = add_dot(v, 0, &s->columns[c].push_moment, j, response.angular);
            (unit < 3 ? seen.by[c].angular : seen.by[c].linear)[unit % 3] =
                -add_dot(v, up, &s->columns[c].push_force, j, response.linear);
        }
        pass_stage(v, s, stage, &response, x);
        (unit < 3 ? seen.response.angular : seen.response.linear)[unit % 3] = -x[j - stage];
    }
    return seen;
}

/* `after`: the states of the column after each stage beyond joint j, by the stage's last position. */
static void sweep_column(const struct values *v, const struct sweeps *s, int j, struct swept_column *after) {
    int next = j + 1;
    while (next < s->n && s->kind[next] == STAGE_PART)
        next++;
    begin_column(v, s, j, &after[next - 1]);
    for (; next < s->n && s->root[next] == s->root[j]; next += sweeps_joints_at(s, next)) {
        const int parent = s->parent[next], last = next + sweeps_joints_at(s, next) - 1;
        after[last] = parent < j ? seen_from(v, s, parent, j) : after[parent];
        sweep_pair(v, s, next, j, &after[last]);
    }
}

/* Computes column by column; the emitted loops carry all columns from stage to stage instead. */
static void run_sweeps(const struct values *v, const struct sweeps *s) {
    struct swept_column *after = memory_get(v->memory, ((size_t)s->n + 1) * sizeof *after);
    for (int j = 0; j < s->n; j++)
        sweep_column(v, s, j, after);
}

/* Runs one loop over the values of all arrays. */
static void run_loop(struct memory *memory, const struct function *function, const struct loop *loop,
                     double *values) {
    const struct values v = {memory, function, values};
    switch (loop->kind) {
    case LOOP_PAIRS:
        run_pairs(&v, &loop->of.pairs);
        return;
    case LOOP_PRODUCT:
        run_product(&v, &loop->of.product);
        return;
    case LOOP_FACTORING:
        run_factoring(&v, &loop->of.factoring);
        return;
    case LOOP_SOLVING:
        run_solving(&v, &loop->of.solving);
        return;
    case LOOP_SWEEPS:
        run_sweeps(&v, &loop->of.sweeps);
    }
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

int gen_interpret(const struct generation *generation, const char *quantity, const double *p, const double *x,
                  double t, const double *q, const double *qd, double *out) {
    struct plan *plan = generation->plan;
    const struct function *function = plan_find_function(plan, quantity);
    const struct arguments arguments = {plan, p, x, q, qd, t};
    if (!function)
        return 1;
    interpret(plan, function, &arguments, out);
    return 0;
}
