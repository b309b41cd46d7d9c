/*
 * Plans a function: which nodes become named values, and where long functions are cut.
 *
 * A node becomes a named value if it has a name for the reader, is used more than once or would make a line
 * too long. All others are printed inside the expression that uses them.
 */
#include "gen/plan/plan.h"

#include <assert.h>
#include <string.h>

enum {
    LONGEST_EXPRESSION = 12, /* operations in one emitted line */
    LONGEST_MATRIX = 2000,   /* statements of a function that returns a matrix: the time of compilers grows
                                faster than linearly */
    LONGEST_VECTOR = 8000,   /* statements of a function that returns vectors: whole, its text grows with the
                                scene; cut, it is a quarter longer */
    LONGEST_PIECE = 400
};

/* ---- Statements and pieces ---- */

static int slot_index(const struct graph *g, expression e) {
    return graph_as_slot(g, e) ? expr_as_symbol(g, e)->index : -1;
}

/* Marks a node; true if a descending sweep at `at` has already passed it. */
static bool need(bool *needed, expression e, expression at) {
    const bool passed = !needed[e] && e > at;
    needed[e] = true;
    return passed;
}

/* Marks the operands of a needed node and the value to which a slot is set. */
static bool need_operands(const struct plan *plan, const struct function *function, bool *needed,
                          expression e) {
    const struct graph *g = plan->g;
    const struct slot *slot = graph_as_slot(g, e);
    bool passed = slot && need(needed, slot->next, e);
    if (slot)
        need(needed, slot->initial, e);
    if (plan_is_moved(plan, function, e))
        return passed;
    for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
        needed[g->nodes[e].operand[k]] = true;
    return passed;
}

/* Marks all nodes of one function. A value that `prepare` computes has its operands there, not here. */
static void mark_function(const struct plan *plan, struct function *function) {
    struct graph *g = plan->g;
    bool *needed = function->is_needed = memory_get(plan->memory, g->count * sizeof *needed);
    plan_mark_results(function, needed);
    for (bool again = true; again;) {
        again = false;
        for (expression e = g->count; e-- > 0;)
            if (needed[e])
                again |= need_operands(plan, function, needed, e);
    }
}

/* Counts uses by results, and by loops, which set slots. */
static void use_roots(const struct plan *plan, const struct function *function, uint32_t *uses) {
    const struct graph *g = plan->g;
    bool *seen = memory_scratch(plan->memory, (size_t)g->slot_count + 1);
    plan_count_results(function, uses);
    for (expression e = 0; e < g->count; e++) {
        const int slot = function->is_needed[e] ? slot_index(g, e) : -1;
        if (slot < 0 || seen[slot])
            continue;
        seen[slot] = true;
        uses[g->slots[slot].initial]++;
        uses[g->slots[slot].next]++;
    }
}

static uint32_t *count_uses(const struct plan *plan, const struct function *function) {
    struct graph *g = plan->g;
    uint32_t *uses = memory_scratch(plan->memory, g->count * sizeof *uses);
    use_roots(plan, function, uses);
    for (expression e = g->count; e-- > 0;) {
        if (!function->is_needed[e] || plan_is_moved(plan, function, e))
            continue;
        for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
            uses[g->nodes[e].operand[k]] += plan_is_sign(g, e) ? uses[e] : 1;
    }
    return uses;
}

/* Chooses the statements from the uses, bottom up, by the length of what is printed inside other
 * expressions. */
static void choose_statements(struct plan *plan, const struct function *function, const uint32_t *uses) {
    struct graph *g = plan->g;
    uint8_t *length = memory_scratch(plan->memory, g->count * sizeof *length);
    memset(plan->is_statement, 0, g->count * sizeof *plan->is_statement);
    for (expression e = 0; e < g->count; e++) {
        const struct node *node = &g->nodes[e];
        const int arity = operation_arity(node->operation);
        if (!uses[e] || !arity || plan_is_moved(plan, function, e))
            continue;
        int total = plan_is_sign(g, e) ? 0 : 1;
        for (int k = 0; k < arity; k++)
            total += length[node->operand[k]];
        assert(total <= UINT8_MAX);
        plan->is_statement[e] =
            plan->is_derived[e] ||
            (!plan_is_sign(g, e) && (uses[e] > 1 || g->names[e] || total >= LONGEST_EXPRESSION));
        length[e] = (uint8_t)(plan->is_statement[e] ? 0 : total);
    }
}

void plan_mark_statements(struct plan *plan, const struct function *function) {
    memset(plan->is_statement, 0, plan->g->count * sizeof *plan->is_statement);
    for (int i = 0; i < function->statement_count; i++)
        plan->is_statement[function->statements[i]] = true;
    for (int i = 0; i < function->repeat_count; i++)
        plan->is_statement[function->repeats[i].value] = true;
}

long plan_trips_of(const struct plan *plan, expression e) {
    const struct graph *g = plan->g;
    const uint16_t loop = g->nodes[e].loop;
    if (loop == ANY_LOOP)
        return expr_as_symbol(g, e)->kind == SYMBOL_LAST
                   ? 0
                   : plan->rolled->runs[plan->rolled->frames[expr_as_symbol(g, e)->index].run].count;
    return loop ? plan->rolled->runs[g->loops[loop].run].count : 1;
}

void plan_count_node(const struct plan *plan, expression e, struct operation_count *count) {
    const enum cost cost = operation_cost(plan->g->nodes[e].operation);
    const long trips = plan_trips_of(plan, e);
    count->adds += cost == COST_ADD ? trips : 0;
    count->muls += cost == COST_MUL ? trips : 0;
    count->divs += cost == COST_DIV ? trips : 0;
    count->functions += cost == COST_FUNCTION ? trips : 0;
}

static void count_operations(const struct plan *plan, struct function *function) {
    const struct graph *g = plan->g;
    struct operation_count *count = &function->operations;
    long values = function->out_count;
    *count = (struct operation_count){.quantity = function->quantity};
    for (expression e = 0; e < g->count; e++) {
        if (!function->is_needed[e])
            continue;
        const enum operation operation = g->nodes[e].operation;
        const long trips = plan_trips_of(plan, e);
        values += graph_as_slot(g, e)                                          ? 0
                  : operation == OP_SYMBOL || plan_is_moved(plan, function, e) ? trips
                                                                               : 0;
        if (!plan_is_moved(plan, function, e))
            plan_count_node(plan, e, count);
    }
    for (int i = 0; i < function->loop_count; i++)
        loops_count_operations(plan->memory, function, &function->loops[i], count);
    count->bytes = values * (long)sizeof(double);
}

/* The end of the loop at `end`: a loop is never cut. */
static int end_of_loop(const struct function *function, int end) {
    int begin = 0;
    for (int b = 0; b < function->block_count; b++) {
        if (function->blocks[b].run >= 0 && begin < end && end < function->blocks[b].end)
            return function->blocks[b].end;
        begin = function->blocks[b].end;
    }
    return end;
}

/* The last statement of a piece. A piece ends with a section if one ends in time. */
static int end_of_piece(const struct plan *plan, const struct function *function, int begin,
                        uint32_t *section) {
    const struct graph *g = plan->g;
    int end = begin, at_section = 0;
    while (end < function->statement_count && end - begin < LONGEST_PIECE) {
        while (*section < g->remark_count && g->remarks[*section].from <= function->statements[end]) {
            if (end > begin)
                at_section = end;
            ++*section;
        }
        end++;
    }
    if (end < function->statement_count && at_section > begin + LONGEST_PIECE / 2)
        end = at_section;
    return end_of_loop(function, end);
}

static bool gives_matrix(const struct plan *plan, const struct function *function) {
    const int n = plan->tree->count;
    return function->out_count >= n * n;
}

static void cut_pieces(struct plan *plan, struct function *function) {
    const int most = function->statement_count / (LONGEST_PIECE / 2) + 2;
    uint32_t section = 0;
    function->piece_ends = memory_get(plan->memory, (size_t)most * sizeof *function->piece_ends);
    if (function->statement_count <= (gives_matrix(plan, function) ? LONGEST_MATRIX : LONGEST_VECTOR)) {
        function->piece_ends[function->piece_count++] = function->statement_count;
        return;
    }
    for (int begin = 0; begin < function->statement_count;) {
        begin = end_of_piece(plan, function, begin, &section);
        assert(function->piece_count < most);
        function->piece_ends[function->piece_count++] = begin;
    }
}

static void plan_function(struct plan *plan, struct function *function) {
    const struct memory_mark mark = memory_mark(plan->memory);
    mark_function(plan, function);
    choose_statements(plan, function, count_uses(plan, function));
    count_operations(plan, function);
    plan_collect_derived(plan, function);
    schedule_function(plan, function);
    cut_pieces(plan, function);
    memory_back(plan->memory, mark);
}

/* A composed function costs as much as the functions that it calls, each counted once. */
static void add_up_parts(struct memory *memory, struct function *function) {
    struct operation_count *sum = &function->operations;
    if (function->part_count)
        *sum = (struct operation_count){.quantity = function->quantity};
    for (int i = 0; i < function->part_count; i++) {
        const struct operation_count *part = &function->parts[i].from->operations;
        if (function->parts[i].is_added)
            sum->adds += function->arrays[function->parts[i].to_array].count;
        if (i > 0 && function->parts[i - 1].from == function->parts[i].from)
            continue;
        sum->adds += part->adds;
        sum->muls += part->muls;
        sum->divs += part->divs;
        sum->functions += part->functions;
        sum->bytes += part->bytes;
    }
    for (int i = 0; function->part_count && i < function->loop_count; i++)
        loops_count_operations(memory, function, &function->loops[i], sum);
}

void plan_count_results(const struct function *function, uint32_t *uses) {
    for (int f = 0; f < plan_count_arrays(function); f++)
        for (int i = 0; i < function->arrays[f].single_count; i++)
            uses[function->arrays[f].singles[i].value]++;
    for (int i = 0; i < function->run_result_count; i++)
        uses[function->run_results[i].value]++;
}

void plan_mark_results(const struct function *function, bool *needed) {
    for (int f = 0; f < plan_count_arrays(function); f++)
        for (int i = 0; i < function->arrays[f].single_count; i++)
            needed[function->arrays[f].singles[i].value] = true;
    for (int i = 0; i < function->run_result_count; i++)
        needed[function->run_results[i].value] = true;
}

bool *plan_mark_nodes_of_functions(const struct plan *plan) {
    bool *needed = memory_get(plan->memory, plan->g->count * sizeof *needed);
    for (int f = 0; f < plan->function_count; f++)
        plan_mark_results(&plan->functions[f], needed);
    rewrite_mark_operands(plan->g, needed, plan->g->count);
    return needed;
}

/* Lists the parameters that some function reads, directly or through a derived value. */
static void list_parameters(struct plan *plan) {
    struct graph *g = plan->g;
    const bool *read = plan_mark_nodes_of_functions(plan);
    plan->parameters =
        memory_get(plan->memory, ((size_t)plan->model->parameter_count + 1) * sizeof *plan->parameters);
    for (int i = 0; i < plan->model->parameter_count; i++)
        if (read[expr_symbol(g, SYMBOL_PARAMETER, i, 0)])
            plan->parameters[plan->parameter_count++] = i;
}

void plan_close_graph(struct plan *plan) {
    for (int i = 0; i < plan->model->parameter_count; i++)
        expr_symbol(plan->g, SYMBOL_PARAMETER, i, 0);
    graph_close(plan->g);
}

const struct function *plan_find_function(const struct plan *plan, const char *quantity) {
    for (int f = 0; f < plan->function_count; f++)
        if (!strcmp(plan->functions[f].quantity, quantity))
            return &plan->functions[f];
    return NULL;
}

void plan_functions(struct plan *plan) {
    plan->is_statement = memory_get(plan->memory, plan->g->count * sizeof *plan->is_statement);
    plan->is_derived = memory_get(plan->memory, plan->g->count * sizeof *plan->is_derived);
    for (int f = 0; f < plan->function_count; f++)
        if (!plan->functions[f].part_count) /* a composed function computes nothing itself */
            plan_function(plan, &plan->functions[f]);
    for (int f = 0; f < plan->function_count; f++)
        add_up_parts(plan->memory, &plan->functions[f]);
    prepare_open(plan);
    plan_function(plan, &plan->prepare);
    list_parameters(plan);
}
