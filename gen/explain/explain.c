/* Prints trees, expressions and plans as text. Reads the generator's state after a pass. */
#include "gen/explain/explain.h"
#include "gen/graph/graph.h"
#include "gen/plan/plan.h"

#include <string.h>

/* ---- Trees ---- */

static void explain_frame(struct text *text, const struct tree *tree, int i) {
    const struct frame *frame = &tree->frames[i];
    const int axis = frame->joint.axis;
    text_add(text, "  frame %d, on %d: ", i, frame->parent);
    if (frame->kind != FRAME_JOINT)
        text_add(text, "%s of run %d\n", frame->kind == FRAME_ENTRY ? "entry" : "exit", frame->run);
    else if (frame->is_state)
        text_add(text, "state %s, coordinate %d\n", frame->name, frame->coordinate);
    else if (frame->run < 0)
        text_add(text, "%s %s %c, coordinate %d%s\n", frame->name,
                 frame->joint.is_revolute ? "turns about" : "slides along", "xyz"[axis], frame -> coordinate,
                 frame -> keeps_axes ? ", keeps its axes" : "");
    else
        text_add(text, "%s %s %c, coordinate %d + %d e\n", frame->name,
                 frame->joint.is_revolute ? "turns about" : "slides along", "xyz"[axis], frame -> coordinate,
                 frame -> step);
}

static void explain_frames(struct text *text, const struct tree *tree) {
    for (int i = 0; i < tree->count; i++)
        explain_frame(text, tree, i);
    for (int r = 0; r < tree->run_count; r++)
        text_add(text, "  run %d, %s: %d elements of %d coordinates from %d on%s\n", r, tree->runs[r].name,
                 tree->runs[r].count, tree->runs[r].period, tree->runs[r].first,
                 tree->runs[r].last ? ", the last one with another inertia" : "");
}

void explain_tree(const struct generation *gen, struct text *text) {
    explain_frames(text, &gen->tree);
}

void explain_rolled_tree(const struct generation *gen, struct text *text) {
    explain_frames(text, &gen->rolled);
}

/* ---- Expressions ---- */

/* One function that is being explained. */
struct explanation {
    struct text *text;
    struct plan *plan;
    const struct graph *g;
    const struct function *function;
    bool *needed, *is_marked; /* by handle; marked: with a separate line */
    const char *section;      /* the last one that was printed */
};

/* Prints the section of the graph to which e belongs, if it differs from the last one. */
static void explain_section(struct explanation *x, expression e) {
    const char *section = graph_remark_of(x->g, e);
    if (section && section != x->section)
        text_add(x->text, "  /* %s */\n", section);
    x->section = section;
}

static void explain_value(struct explanation *x, expression e) {
    explain_section(x, e);
    text_add(x->text, "    ");
    describe_value(x->text, x->g, e, NULL);
    text_add(x->text, " = ");
    describe_definition(x->text, x->g, e, x->is_marked);
    if (x->g->nodes[e].loop)
        text_add(x->text, "  (loop %d)", x->g->nodes[e].loop);
    text_add(x->text, "\n");
}

static void explain_entry(struct explanation *x, int array, int entry, int stride, expression value) {
    text_add(x->text, "    %s.%s[%d", x->function->quantity, x->function->arrays[array].name, entry);
    if (stride)
        text_add(x->text, " + %d e", stride);
    text_add(x->text, "] = ");
    describe_value(x->text, x->g, value, x->is_marked);
    text_add(x->text, "\n");
}

static void explain_run_results(struct explanation *x, int block) {
    for (int i = 0; i < x->function->run_result_count; i++) {
        const struct run_result *result = &x->function->run_results[i];
        if (block < 0 || result->block == block)
            explain_entry(x, result->array, result->entry, result->stride, result->value);
    }
}

static void explain_results(struct explanation *x) {
    for (int f = 0; f < plan_count_arrays(x->function); f++) {
        const struct array *array = &x->function->arrays[f];
        for (int i = 0; i < array->single_count; i++)
            explain_entry(x, f, array->singles[i].entry, 0, array->singles[i].value);
    }
    explain_run_results(x, -1);
}

/* Values that loops carry from element to element. */
static void explain_slots(struct explanation *x) {
    for (int s = 0; s < x->g->slot_count; s++) {
        const struct slot *slot = &x->g->slots[s];
        if (!x->needed[slot->carried] && !x->needed[slot->final])
            continue;
        text_add(x->text, "    slot %d of loop %d over run %d, %s: begins with ", s, slot->loop,
                 x->g->loops[slot->loop].run, x->g->loops[slot->loop].inward ? "inward" : "outward");
        describe_value(x->text, x->g, slot->initial, x->is_marked);
        text_add(x->text, ", continues with ");
        describe_value(x->text, x->g, slot->next, x->is_marked);
        text_add(x->text, "\n");
    }
}

static void explain_counts(struct explanation *x) {
    long counts[OP_COUNT] = {0};
    for (expression e = 0; e < x->g->count; e++)
        counts[x->g->nodes[e].operation] += x->needed[e];
    text_add(x->text, "%s: nodes", x->function->quantity);
    for (int operation = 0; operation < OP_COUNT; operation++)
        if (counts[operation])
            text_add(x->text, " %s %ld", operation_name(operation), counts[operation]);
    text_add(x->text, "\n");
}

/* Marks values that have a name or are read more than once. */
static void mark_shared(struct explanation *x) {
    const struct memory_mark mark = memory_mark(x->plan->memory);
    bool *is_read = memory_scratch(x->plan->memory, x->g->count);
    for (expression e = 0; e < x->g->count; e++)
        for (int k = 0; x->needed[e] && k < operation_arity(x->g->nodes[e].operation); k++) {
            const expression operand = x->g->nodes[e].operand[k];
            x->is_marked[operand] |= is_read[operand] || x->g->names[operand];
            is_read[operand] = true;
        }
    memory_back(x->plan->memory, mark);
}

static struct explanation start_explanation(const struct generation *gen, struct text *text,
                                            const struct function *function) {
    struct explanation x = {.text = text, .plan = gen->plan, .g = &gen->graph, .function = function};
    x.needed = memory_get(gen->plan->memory, gen->graph.count);
    x.is_marked = memory_get(gen->plan->memory, gen->graph.count);
    plan_mark_results(x.function, x.needed);
    rewrite_mark_operands(x.g, x.needed, x.g->count);
    explain_counts(&x);
    for (int i = 0; i < x.function->part_count; i++)
        text_add(text, "    %s.%s is %s.%s\n", x.function->quantity,
                 x.function->arrays[x.function->parts[i].to_array].name, x.function->parts[i].from->quantity,
                 x.function->parts[i].from->arrays[x.function->parts[i].from_array].name);
    return x;
}

static void explain_parameters(const struct generation *gen, struct text *text) {
    for (int i = 0; i < gen->model.parameter_count; i++)
        text_add(text, "p[%d] is %s\n", i, gen->model.parameters[i].name);
}

void explain_graph(const struct generation *gen, struct text *text) {
    explain_parameters(gen, text);
    for (int f = 0; f < gen->plan->function_count; f++) {
        struct explanation x = start_explanation(gen, text, &gen->plan->functions[f]);
        mark_shared(&x);
        for (expression e = 0; e < x.g->count; e++)
            if (x.is_marked[e] && x.needed[e] && operation_arity(x.g->nodes[e].operation))
                explain_value(&x, e);
        explain_slots(&x);
        explain_results(&x);
    }
}

/* ---- The plan ---- */

/* Results that are known after `place` statements and blocks. */
static void explain_writes(struct explanation *x, int place, int *written) {
    for (; *written < x->function->write_count; ++*written) {
        const struct write *write = &x->function->writes[*written];
        if (write->place > place)
            return;
        explain_entry(x, write->array, write->entry, 0, write->value);
    }
}

static bool is_end_of_piece(const struct function *function, int statement) {
    for (int i = 0; i + 1 < function->piece_count; i++)
        if (function->piece_ends[i] == statement)
            return true;
    return false;
}

static void explain_block(struct explanation *x, int index, int begin) {
    const struct code_block *block = &x->function->blocks[index];
    text_add(x->text, "  block %d, %s", index, block->run < 0 ? "once" : "loop over run");
    if (block->run >= 0)
        text_add(x->text, " %d, %s", block->run, block->inward ? "inward" : "outward");
    text_add(x->text, "\n");
    for (int i = 0; i < x->function->repeat_count; i++)
        if (block->group && x->function->repeats[i].group == block->group)
            explain_value(x, x->function->repeats[i].value);
    for (int i = begin; i < block->end; i++) {
        if (is_end_of_piece(x->function, i))
            text_add(x->text, "  another piece begins\n");
        explain_value(x, x->function->statements[i]);
    }
    explain_run_results(x, index);
}

static void explain_blocks(struct explanation *x) {
    int written = 0;
    for (int b = 0, begin = 0; b < x->function->block_count; begin = x->function->blocks[b++].end) {
        explain_block(x, b, begin);
        explain_writes(x, x->function->blocks[b].end + b + 1, &written);
    }
}

static void explain_function(const struct generation *gen, struct text *text, const struct function *f) {
    struct explanation x = start_explanation(gen, text, f);
    plan_mark_statements(gen->plan, f);
    for (expression e = 0; e < x.g->count; e++)
        x.is_marked[e] = gen->plan->is_statement[e] || gen->plan->is_derived[e];
    explain_blocks(&x);
    explain_slots(&x);
}

void explain_plan(const struct generation *gen, struct text *text) {
    explain_parameters(gen, text);
    for (int f = 0; f < gen->plan->function_count; f++)
        explain_function(gen, text, &gen->plan->functions[f]);
    explain_function(gen, text, &gen->plan->prepare);
}
