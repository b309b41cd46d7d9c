/*
 * What plan.h promises of a planned function, checked by walking its code as it will be run.
 *
 * Takes a plan, gives the first promise that a function of it breaks, with the value or the place at fault.
 * The walk knows at each statement what has been computed, in which loop it stands, and what loops have kept;
 * it shares the meaning of the plan with the printer, and no code.
 */
#include "graph/describe.h"
#include "base/memory.h"
#include "plan/plan.h"

#include <string.h>

struct walk {
    struct plan *plan;
    const struct function *function;
    const struct graph *g;
    bool *is_known;    /* by handle: a statement that has been passed */
    bool *is_counted;  /* by handle: its operation has been counted */
    bool *has_ended;   /* by group: its loop has been passed */
    expression *value; /* by entry of all arrays: what straight code is to put there */
    bool *is_filled;   /* by entry of all arrays */
    int group, run;    /* of the loop that the walk is in; 0 and -1: in none */
    int written;       /* writes that have been passed */
    struct operation_count count;
    const char *broken; /* the first promise that does not hold; NULL: all hold */
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

/* ---- What code may read where it stands ---- */

static int group_of(const struct walk *w, int loop) {
    return loop == ANY_LOOP ? 0 : w->function->group_of[loop];
}

static bool has_repeat(const struct walk *w, expression e) {
    for (int i = 0; i < w->function->repeat_count; i++)
        if (w->function->repeats[i].group == w->group && w->function->repeats[i].value == e)
            return true;
    return false;
}

/* Of a loop over the same run that was passed before, which kept the value. */
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
    return order < 2 || w->function->given == GIVEN_SIDES || (order == 2 && w->function->given);
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
        return s->index < w->plan->model->row_count && w->function->given;
    case SYMBOL_ELEMENT:
        return is_element_at_hand(w, s);
    case SYMBOL_LAST:
        return s->index == w->run;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        return is_slot_at_hand(w, e);
    default: /* points and starts are expressions or parameters by now */
        return false;
    }
}

static void compute(struct walk *w, expression e);

static void read_value(struct walk *w, expression e) {
    if (expr_as_symbol(w->g, e))
        require(w, is_symbol_at_hand(w, e), e, "a symbol is read where it stands for something");
    else if (!w->plan->is_derived[e] || is_prepare(w)) {
        if (w->plan->is_statement[e])
            require(w, is_statement_at_hand(w, e), e, "a value is read behind what computes it");
        else
            compute(w, e);
    }
}

static void count_node(struct walk *w, expression e) {
    const enum cost cost = operation_cost(w->g->nodes[e].operation);
    const long trips = w->is_counted[e] ? 0 : plan_trips_of(w->plan, e);
    w->is_counted[e] = true;
    w->count.adds += cost == COST_ADD ? trips : 0;
    w->count.muls += cost == COST_MUL ? trips : 0;
    w->count.divs += cost == COST_DIV ? trips : 0;
    w->count.functions += cost == COST_FUNCTION ? trips : 0;
}

static void compute(struct walk *w, expression e) {
    count_node(w, e);
    for (int k = 0; k < operation_arity(w->g->nodes[e].operation); k++)
        read_value(w, w->g->nodes[e].operand[k]);
}

/* ---- Entries of arrays ---- */

static void fill(struct walk *w, int array, int entry) {
    const struct array *of = &w->function->arrays[array];
    const bool is_there = array < plan_count_arrays(w->function) && entry >= 0 && entry < of->count &&
                          plan_is_output_copied(of, entry);
    require_of(w, is_there, "field", array, "what is written lies within its field");
    if (!is_there)
        return;
    require_of(w, !w->is_filled[of->offset + entry], "field", array, "an entry is written once");
    w->is_filled[of->offset + entry] = true;
}

/* Writes whose place has come: `place` statements and blocks have ended. */
static void pass_writes(struct walk *w, int place) {
    for (; w->written < w->function->write_count; w->written++) {
        const struct write *write = &w->function->writes[w->written];
        if (write->place > place)
            return;
        read_value(w, write->value);
        fill(w, write->array, write->entry);
        require(
            w, w->broken || w->value[w->function->arrays[write->array].offset + write->entry] == write->value,
            write->value, "an entry is what the quantity has there");
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

static void note_singles(struct walk *w, int array) {
    const struct array *of = &w->function->arrays[array];
    for (int i = 0; i < of->single_count; i++) {
        const struct single *single = &of->singles[i];
        require(w, single->entry >= 0 && single->entry < of->count && !w->value[of->offset + single->entry],
                single->value, "a field has one value an entry");
        if (!w->broken)
            w->value[of->offset + single->entry] = single->value;
    }
}

/* Offsets are those of one array; straight code leaves no entry out, unless one loop clears the array. */
static void check_array(struct walk *w, int array, int offset) {
    const struct array *of = &w->function->arrays[array];
    const bool is_matrix = !of->columns || of->count % of->columns == 0;
    require_of(w, of->offset == offset, "field", array, "fields stand one behind the other");
    require_of(w, is_matrix && (!of->symmetric || of->symmetric * of->symmetric == of->count), "field", array,
               "rows and columns are those of its entries");
    for (int i = 0; i < of->count && !is_prepare(w) && !plan_is_cleared(w->plan, w->function, array); i++)
        require_of(w, w->is_filled[of->offset + i] || !plan_is_output_copied(of, i), "field", array,
                   "each entry is written");
}

static void check_arrays(struct walk *w) {
    int offset = 0;
    for (int f = 0; f < plan_count_arrays(w->function); offset += w->function->arrays[f++].count) {
        check_array(w, f, offset);
        if (f + 1 == w->function->array_count)
            require_of(w, offset + w->function->arrays[f].count == w->function->out_count, "field", f,
                       "results are counted");
    }
    require_of(w, offset == plan_value_count(w->function), "field", plan_count_arrays(w->function),
               "local arrays are counted");
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
    require(w, !w->is_known[e], e, "a statement is there once");
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
                   "blocks follow one another, over runs that there are");
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
        loops_count_operations(w->function, &w->function->loops[i], &w->count);
    require_of(w, w->count.adds == count->adds && w->count.muls == count->muls, "count of", 0,
               "additions and multiplications are those of the code");
    require_of(w, w->count.divs == count->divs && w->count.functions == count->functions, "count of", 1,
               "divisions and functions are those of the code");
}

/* ---- Loops over arrays ---- */

/* Is it an array of `count` entries, or none where none is allowed? */
static bool is_array_of(const struct walk *w, int array, int count) {
    return array == NOTHING || (array >= 0 && array < plan_count_arrays(w->function) &&
                                w->function->arrays[array].count == count);
}

static bool are_arrays(const struct walk *w, const struct vector_arrays *arrays, int count) {
    return is_array_of(w, arrays->at[0], count) && is_array_of(w, arrays->at[1], count) &&
           is_array_of(w, arrays->at[2], count);
}

static bool are_terms(const struct walk *w, const struct pair_terms *terms, int n) {
    bool holds = true;
    for (int t = 0; t < terms->count; t++)
        holds &= are_arrays(w, &terms->terms[t].near, n) && are_arrays(w, &terms->terms[t].far, n);
    return holds;
}

static bool are_pairs(const struct walk *w, const struct pairs *pairs) {
    const int n = pairs->n;
    bool holds = n == w->plan->tree->count;
    for (int j = 0; holds && j < n; j++)
        holds = pairs->order[j] >= 0 && pairs->order[j] < n && j < pairs->end[j] && pairs->end[j] <= n;
    for (int p = 0; p < pairs->product_count; p++) {
        const struct pair_product *product = &pairs->products[p];
        holds &= product->array != NOTHING && is_array_of(w, product->array, n * n) &&
                 are_terms(w, &product->turn.rows, n) && are_terms(w, &product->turn.columns, n) &&
                 are_terms(w, &product->slide.rows, n) && are_terms(w, &product->slide.columns, n);
    }
    for (int m = 0; m < pairs->move_count; m++)
        holds &= are_arrays(w, &pairs->moves[m].moment, n) && are_arrays(w, &pairs->moves[m].force, n) &&
                 are_arrays(w, &pairs->moves[m].shift, n);
    return holds;
}

static bool is_array(const struct walk *w, int array) {
    return array >= 0 && array < plan_count_arrays(w->function);
}

static int columns_of(const struct walk *w, int array) {
    const struct array *of = &w->function->arrays[array];
    return of->columns ? of->columns : of->count;
}

static bool is_square(const struct walk *w, int array) {
    return is_array(w, array) && is_array_of(w, array, columns_of(w, array) * columns_of(w, array));
}

static bool is_product(const struct walk *w, const struct product *product) {
    if (!is_array(w, product->target) || !is_array(w, product->left) || !is_array(w, product->right))
        return false;
    const int height = columns_of(w, product->left), width = columns_of(w, product->right);
    const int sum = w->function->arrays[product->left].count / height;
    return is_array_of(w, product->target, height * width) && is_array_of(w, product->right, sum * width);
}

static bool is_solving(const struct walk *w, const struct solving *solving) {
    return is_square(w, solving->matrix) && is_array(w, solving->array) &&
           is_array_of(w, solving->array, columns_of(w, solving->matrix) * columns_of(w, solving->array));
}

static bool has_its_arrays(const struct walk *w, const struct loop *loop) {
    switch (loop->kind) {
    case LOOP_PAIRS:
        return are_pairs(w, &loop->of.pairs);
    case LOOP_PRODUCT:
        return is_product(w, &loop->of.product);
    case LOOP_FACTORING:
        return is_square(w, loop->of.factoring.matrix);
    case LOOP_SOLVING:
        return is_solving(w, &loop->of.solving);
    }
    return false;
}

/* ---- Composed functions ---- */

static void check_part(struct walk *w, int index) {
    const struct part *part = &w->function->parts[index];
    const int called = (int)(part->from - w->plan->functions);
    const bool is_there = called >= 0 && called < w->plan->function_count && part->from != w->function &&
                          part->from_array < part->from->array_count &&
                          part->to_array < plan_count_arrays(w->function);
    require_of(w, is_there, "part", index, "a part is a result of another function");
    if (!is_there)
        return;
    const struct array *to = &w->function->arrays[part->to_array];
    require_of(w, to->count == part->from->arrays[part->from_array].count, "part", index,
               "a part has as many entries as its place");
    require_of(w, to->count == 0 || w->is_filled[to->offset] == part->is_added, "part", index,
               "a part is the first of its place or is added to it");
    if (to->count)
        w->is_filled[to->offset] = true;
}

/* ---- All functions ---- */

static void check_composed(struct walk *w) {
    for (int i = 0; i < w->function->part_count && !w->broken; i++)
        check_part(w, i);
}

static void check_computed(struct walk *w) {
    plan_mark_statements(w->plan, w->function);
    for (int f = 0; f < plan_count_arrays(w->function); f++)
        note_singles(w, f);
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
    w.value = memory_scratch(plan->memory, entries * sizeof *w.value);
    w.is_filled = memory_scratch(plan->memory, entries * sizeof *w.is_filled);
    for (int i = 0; i < function->loop_count; i++)
        require_of(&w, has_its_arrays(&w, &function->loops[i]), "loop", i,
                   "loops read arrays of their sizes");
    if (function->part_count)
        check_composed(&w);
    else
        check_computed(&w);
    memory_back(plan->memory, mark);
    return w.broken;
}

/* Gains may be replaced behind `prepare`: they alone are told apart from what parameters give. */
static const char *derived_violation(struct plan *plan) {
    struct walk w = {.plan = plan, .function = &plan->prepare, .g = plan->g};
    for (expression e = 0; e < plan->g->count; e++)
        require(&w, !plan->is_derived[e] || !(plan->g->nodes[e].depends & ~(ON_PARAMETER | ON_GAIN)), e,
                "what prepare computes depends on parameters alone");
    return w.broken;
}

const char *plan_violation(struct plan *plan) {
    const char *broken = derived_violation(plan);
    for (int f = 0; f < plan->function_count && !broken; f++)
        broken = function_violation(plan, &plan->functions[f]);
    return broken ? broken : function_violation(plan, &plan->prepare);
}
