/*
 * Checks planned functions against the rules of plan.h by walking their code in the order of execution.
 *
 * Input: a plan. Result: the first rule that a function breaks, with the offending value or place. At each
 * statement the walk knows which values have been computed, in which loop the statement is, and which values
 * the loops have kept. The walk shares the meaning of the plan with the printer, but no code.
 */
#include "gen/graph/graph.h"
#include "gen/base/base.h"
#include "gen/plan/plan.h"

#include <string.h>

struct walk {
    struct plan *plan;
    const struct function *function;
    const struct graph *g;
    bool *is_known;   /* by handle: the walk has passed this statement */
    bool *is_counted; /* by handle: its operator has been counted */
    bool *has_ended;  /* by group: the walk has passed its loop */
    bool *is_filled;  /* by entry of all arrays */
    int group, run;   /* of the loop that contains the current statement; 0 and -1: outside loops */
    int written;      /* number of writes that have been passed */
    struct operation_count count;
    const char *broken; /* the first broken rule; NULL: none */
};

static void require(struct walk *w, bool holds, expression e, const char *promise) {
    struct text text = {.memory = w->plan->memory};
    if (holds || w->broken)
        return;
    text_add(&text, "function %s, value ", w->function->quantity);
    describe_value(&text, w->g, e, NULL);
    text_add(&text, " = ");
    describe_definition(&text, w->g, e, NULL);
    text_add(&text, " breaks: %s", promise);
    w->broken = text.data;
}

static void require_of(struct walk *w, bool holds, const char *what, int index, const char *promise) {
    if (!holds && !w->broken)
        w->broken = memory_format(w->plan->memory, "function %s, %s %d breaks: %s", w->function->quantity,
                                  what, index, promise);
}

static bool is_prepare(const struct walk *w) {
    return w->function == &w->plan->prepare;
}

/* ---- What code may read at its place ---- */

static int group_of(const struct walk *w, int loop) {
    return loop == ANY_LOOP ? 0 : w->function->group_of[loop];
}

static bool has_repeat(const struct walk *w, expression e) {
    for (int i = 0; i < w->function->repeat_count; i++)
        if (w->function->repeats[i].group == w->group && w->function->repeats[i].value == e)
            return true;
    return false;
}

/* Returns whether a loop over the same run, passed before, has kept the value. */
static bool is_kept(const struct walk *w, expression e) {
    const int loop = w->g->nodes[e].loop;
    return w->g->loops[loop].run == w->run && w->has_ended[group_of(w, loop)] && w->function->is_stored[e];
}

static bool is_statement_at_hand(const struct walk *w, expression e) {
    const int loop = w->g->nodes[e].loop;
    if (!loop || (w->group && group_of(w, loop) == w->group))
        return w->is_known[e] || (loop && has_repeat(w, e));
    return angles_is_repeated(w->plan, w->function, e) ? has_repeat(w, e) : is_kept(w, e);
}

static bool is_slot_at_hand(const struct walk *w, expression e) {
    const int group = group_of(w, graph_as_slot(w->g, e)->loop);
    if (expr_as_symbol(w->g, e)->kind == SYMBOL_FINAL)
        return w->has_ended[group];
    return (w->group && group == w->group) || is_kept(w, e);
}

static bool is_order_given(const struct walk *w, int order) {
    return order < 2 || (order == 2 && w->function->given != GIVEN_NOTHING);
}

static bool is_element_at_hand(const struct walk *w, const struct symbol *s) {
    return s->index < w->plan->rolled->count && w->run >= 0 && is_order_given(w, s->order) &&
           w->plan->rolled->frames[s->index].run == w->run;
}

static bool is_symbol_at_hand(const struct walk *w, expression e) {
    const struct symbol *s = expr_as_symbol(w->g, e);
    switch (s->kind) {
    case SYMBOL_PARAMETER:
        return s->index < w->plan->model->parameter_count;
    case SYMBOL_INPUT:
        return s->index < w->plan->model->input_count;
    case SYMBOL_TIME:
        return true;
    case SYMBOL_COORDINATE:
        return s->index < w->plan->tree->count && is_order_given(w, s->order);
    case SYMBOL_MULTIPLIER:
        return s->index < w->plan->model->row_count && w->function->given == GIVEN_MOTION;
    case SYMBOL_ELEMENT:
        return is_element_at_hand(w, s);
    case SYMBOL_LAST:
        return s->index == w->run;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        return is_slot_at_hand(w, e);
    default: /* points and start values have been replaced by expressions or parameters */
        return false;
    }
}

static void compute(struct walk *w, expression e);

static void read_value(struct walk *w, expression e) {
    if (expr_as_symbol(w->g, e))
        require(w, is_symbol_at_hand(w, e), e, "a symbol is read where it has a value");
    else if (!w->plan->is_derived[e] || is_prepare(w)) {
        if (w->plan->is_statement[e])
            require(w, is_statement_at_hand(w, e), e, "every value is computed before it is read");
        else
            compute(w, e);
    }
}

static void compute(struct walk *w, expression e) {
    if (!w->is_counted[e])
        plan_count_node(w->plan, e, &w->count);
    w->is_counted[e] = true;
    for (int k = 0; k < operation_arity(w->g->nodes[e].operation); k++)
        read_value(w, w->g->nodes[e].operand[k]);
}

/* ---- Entries of arrays ---- */

static void fill(struct walk *w, int array, int entry) {
    const struct array *of = &w->function->arrays[array];
    const bool is_there = array < plan_count_arrays(w->function) && entry >= 0 && entry < of->count &&
                          plan_is_output_copied(of, entry);
    require_of(w, is_there, "field", array, "writes stay within their array");
    if (!is_there)
        return;
    require_of(w, !w->is_filled[of->offset + entry], "field", array, "an entry is written once");
    w->is_filled[of->offset + entry] = true;
}

/* Passes the writes that are due: `place` statements and blocks have ended. */
static void pass_writes(struct walk *w, int place) {
    for (; w->written < w->function->write_count; w->written++) {
        const struct write *write = &w->function->writes[w->written];
        if (write->place > place)
            return;
        read_value(w, write->value);
        fill(w, write->array, write->entry);
    }
}

static void pass_run_results(struct walk *w, int block) {
    for (int i = 0; i < w->function->run_result_count; i++) {
        const struct run_result *result = &w->function->run_results[i];
        if (result->block != block)
            continue;
        require(w, result->run == w->run, result->value, "a loop over its run writes a result of elements");
        read_value(w, result->value);
        for (int e = 0; e < w->plan->rolled->runs[result->run].count; e++)
            fill(w, result->array, result->entry + e * result->stride);
    }
}

/* Arrays follow one another. Straight-line code leaves no entry out, unless one loop clears the array. */
static void check_arrays(struct walk *w) {
    int offset = 0;
    for (int f = 0; f < plan_count_arrays(w->function); offset += w->function->arrays[f++].count) {
        const struct array *of = &w->function->arrays[f];
        const bool is_whole = !is_prepare(w) && !plan_is_cleared(w->plan, w->function, f);
        require_of(w, of->offset == offset, "field", f, "arrays follow one another");
        for (int i = 0; i < of->count && is_whole && !w->broken; i++)
            require_of(w, w->is_filled[offset + i] || !plan_is_output_copied(of, i), "field", f,
                       "each entry is written");
    }
    require_of(w, offset == plan_value_count(w->function), "field", plan_count_arrays(w->function),
               "all arrays are counted");
}

/* ---- The code, block by block ---- */

static bool is_slot_of_group(const struct walk *w, int slot, int group) {
    const struct slot *s = &w->g->slots[slot];
    return group && w->function->group_of[s->loop] == group &&
           (w->function->is_needed[s->carried] || w->function->is_needed[s->final]);
}

static void read_slots(struct walk *w, int group, bool at_begin) {
    for (int s = 0; s < w->g->slot_count; s++)
        if (is_slot_of_group(w, s, group))
            read_value(w, at_begin ? w->g->slots[s].initial : w->g->slots[s].next);
}

static void pass_statement(struct walk *w, expression e) {
    const int loop = w->g->nodes[e].loop;
    require(w, loop ? group_of(w, loop) == w->group : !w->group, e, "a statement stands in its own loop");
    require(w, !w->is_known[e], e, "a statement occurs once");
    compute(w, e);
    w->is_known[e] = true;
}

static void pass_loop(struct walk *w, int index, int begin) {
    const struct code_block *block = &w->function->blocks[index];
    read_slots(w, block->group, true);
    w->group = block->group;
    w->run = block->run;
    for (int i = 0; i < w->function->repeat_count; i++)
        if (w->function->repeats[i].group == block->group)
            compute(w, w->function->repeats[i].value);
    for (int i = begin; i < block->end; i++)
        pass_statement(w, w->function->statements[i]);
    read_slots(w, block->group, false);
    pass_run_results(w, index);
    w->has_ended[block->group] = true;
    w->group = 0;
    w->run = -1;
}

static void pass_blocks(struct walk *w) {
    int at = 0;
    pass_writes(w, 0);
    for (int b = 0; b < w->function->block_count && !w->broken; b++) {
        const struct code_block *block = &w->function->blocks[b];
        require_of(w, at <= block->end && block->run < w->plan->rolled->run_count, "block", b,
                   "blocks follow one another, over existing runs");
        if (block->run >= 0)
            pass_loop(w, b, at);
        for (int i = at; i < block->end && block->run < 0; i++) {
            pass_statement(w, w->function->statements[i]);
            pass_writes(w, i + 1 + b);
        }
        at = block->end;
        pass_writes(w, at + b + 1);
    }
    require_of(w, at == w->function->statement_count, "block", w->function->block_count,
               "blocks hold all statements");
    require_of(w, w->written == w->function->write_count, "write", w->written, "all results are written");
}

static bool is_within_loop(const struct function *function, int statement) {
    for (int b = 0, begin = 0; b < function->block_count; begin = function->blocks[b++].end)
        if (function->blocks[b].run >= 0 && begin < statement && statement < function->blocks[b].end)
            return true;
    return false;
}

static void check_pieces(struct walk *w) {
    const struct function *f = w->function;
    for (int i = 0, begin = 0; i < f->piece_count; begin = f->piece_ends[i++])
        require_of(w, begin <= f->piece_ends[i] && !is_within_loop(f, f->piece_ends[i]), "piece", i,
                   "pieces follow one another and cut no loop");
    require_of(w, f->piece_ends[f->piece_count - 1] == f->statement_count, "piece", f->piece_count - 1,
               "pieces hold all statements");
}

static void check_counts(struct walk *w) {
    const struct operation_count *count = &w->function->operations;
    for (int i = 0; i < w->function->loop_count; i++)
        loops_count_operations(w->plan->memory, w->function, &w->function->loops[i], &w->count);
    require_of(w, w->count.adds == count->adds && w->count.muls == count->muls, "count of", 0,
               "additions and multiplications are those of the code");
    require_of(w, w->count.divs == count->divs && w->count.functions == count->functions, "count of", 1,
               "divisions and functions are those of the code");
}

/* ---- Loops over arrays ---- */

static bool has_its_arrays(const struct walk *w, struct loop *loop) {
    const struct array_list list = loops_list_arrays(loop);
    for (int i = 0; i < list.count; i++)
        if (*list.arrays[i] < NOTHING || *list.arrays[i] >= plan_count_arrays(w->function))
            return false;
    return true;
}

struct bounds {
    struct loop_walk walk;
    bool are_kept;
};

static bool is_within(const struct loop_walk *walk, const struct loop_entry *entry) {
    const struct function *function = walk->form->function;
    const int local = entry->array - plan_count_arrays(function), at = loop_index_value(walk, &entry->at);
    const int count = local < 0 ? function->arrays[entry->array].count : walk->form->locals[local].count;
    return at >= 0 && at < (count ? count : 1);
}

static void check_bounds(struct loop_walk *walk, const struct loop_statement *assignment, long times) {
    struct bounds *bounds = (struct bounds *)walk;
    (void)times;
    bounds->are_kept = bounds->are_kept && is_within(walk, &assignment->target);
    for (int i = 0; i < assignment->term_count; i++)
        for (int k = 0; k < assignment->terms[i].operand_count; k++)
            bounds->are_kept = bounds->are_kept && is_within(walk, &assignment->terms[i].operands[k]);
}

static bool stays_within(const struct walk *w, const struct loop *loop) {
    struct bounds bounds = {.are_kept = true};
    bounds.walk.form = loops_lower(w->plan->memory, w->function, loop, false);
    bounds.walk.visit = check_bounds;
    loop_walk(&bounds.walk);
    return bounds.are_kept;
}

/* ---- All functions ---- */

static void check_computed(struct walk *w) {
    plan_mark_statements(w->plan, w->function);
    pass_blocks(w);
    for (int i = 0; is_prepare(w) && i < w->function->arrays[0].single_count; i++)
        read_value(w, w->function->arrays[0].singles[i].value);
    check_pieces(w);
    check_counts(w);
    check_arrays(w);
}

static const char *function_violation(struct plan *plan, const struct function *function) {
    struct walk w = {.plan = plan, .function = function, .g = plan->g, .run = -1};
    const size_t entries = (size_t)plan_value_count(function) + 1;
    const struct memory_mark mark = memory_mark(plan->memory);
    w.is_known = memory_scratch(plan->memory, plan->g->count * sizeof *w.is_known);
    w.is_counted = memory_scratch(plan->memory, plan->g->count * sizeof *w.is_counted);
    w.has_ended = memory_scratch(plan->memory, ((size_t)plan->g->loop_count + 1) * sizeof *w.has_ended);
    w.is_filled = memory_scratch(plan->memory, entries * sizeof *w.is_filled);
    for (int i = 0; i < function->loop_count; i++)
        require_of(&w, has_its_arrays(&w, &function->loops[i]) && stays_within(&w, &function->loops[i]),
                   "loop", i, "loops stay within their arrays");
    if (!function->part_count) /* a composed function computes nothing itself */
        check_computed(&w);
    memory_back(plan->memory, mark);
    return w.broken;
}

/* The runtime may replace gains after `prepare`, so they alone are distinguished from values of
 * parameters. */
static const char *derived_violation(struct plan *plan) {
    struct walk w = {.plan = plan, .function = &plan->prepare, .g = plan->g};
    for (expression e = 0; e < plan->g->count; e++)
        require(&w, !plan->is_derived[e] || !(plan->g->nodes[e].depends & ~(ON_PARAMETER | ON_GAIN)), e,
                "values that prepare computes depend on parameters alone");
    return w.broken;
}

const char *plan_violation(struct plan *plan) {
    const char *broken = derived_violation(plan);
    for (int f = 0; f < plan->function_count && !broken; f++)
        broken = function_violation(plan, &plan->functions[f]);
    return broken ? broken : function_violation(plan, &plan->prepare);
}
