/*
 * The C text of one function: named values in sections, one statement a line, then the results. Long
 * functions are cut into static pieces; values that later pieces read are carried in a struct on the stack.
 */
#include "gen/emit/emit.h"

#include <string.h>

struct writer {
    struct emission *x;
    struct text *text;
    const struct function *function;
    const char *last_remark;
    const char *indent;
    const char *local; /* precedes the names of local arrays */
    int written;       /* of function->writes */
    bool wrote_result;
};

static bool is_prepare(const struct writer *w) {
    return w->function == &w->x->plan->prepare;
}

static const char *result_name(const struct function *function) {
    return plan_is_struct_result(function) ? "out" : function->arrays[0].name;
}

static void emit_result_type(struct emission *x, struct text *text, const struct function *function) {
    const struct array *array = &function->arrays[0];
    if (plan_is_struct_result(function))
        text_add(text, "struct %s_%s_result *out", x->name, function->quantity);
    else if (array->columns)
        text_add(text, "%s %s[%d * %d]", x->number, array->name, array->count / array->columns,
                 array->columns);
    else
        text_add(text, "%s %s[%d]", x->number, array->name, array->count);
}

void emit_list_given(const struct plan *plan, const struct function *function, struct given_array *list) {
    const int n = plan->tree->count, m = plan->model->row_count;
    list[0] = (struct given_array){"qdd", function->given == GIVEN_NOTHING ? 0 : n, n};
    list[1] = (struct given_array){"lambda", function->given == GIVEN_MOTION ? m : 0, 2 * n + 1};
}

static void emit_arguments(struct emission *x, struct text *text, const struct function *function) {
    const int n = x->plan->tree->count;
    if (function == &x->plan->prepare) {
        text_add(text, "struct %s_parameters *p", x->name);
        return;
    }
    text_add(text, "const struct %s_parameters *p, const struct %s_inputs *x, %s,\n        ", x->name,
             x->name, x->is_lanes ? "const lane t[1]" : "double t");
    text_add(text, "const %s q[%d], const %s qd[%d], ", x->number, n, x->number, n);
    struct given_array given[GIVEN_ARRAYS];
    emit_list_given(x->plan, function, given);
    for (int i = 0; i < GIVEN_ARRAYS; i++)
        if (given[i].count)
            text_add(text, "const %s %s[%d], ", x->number, given[i].name, given[i].count);
    emit_result_type(x, text, function);
}

void emit_signature(struct emission *x, struct text *text, const struct function *function) {
    text_add(text, "%svoid %s_%s(", x->is_lanes ? "static " : "", x->name, function->quantity);
    emit_arguments(x, text, function);
    text_add(text, ")");
}

static void emit_remark(struct writer *w, expression e) {
    const char *remark = graph_remark_of(w->x->g, e);
    if (remark && remark != w->last_remark)
        text_add(w->text, "%s/* %s */\n", w->indent, remark);
    w->last_remark = remark;
}

/* Prints name = ..., s->name = ... or name[e] = ... */
static void emit_target(struct writer *w, expression e) {
    struct emission *x = w->x;
    if (x->is_carried[e]) {
        x->uses_carried = true;
        text_add(w->text, "s->");
    }
    emit_name(x, w->text, e);
    text_add(w->text, "%s = ", w->function->is_stored[e] ? "[e]" : "");
}

static void emit_statement(struct writer *w, expression e) {
    struct emission *x = w->x;
    emit_remark(w, e);
    const bool for_later_alone = x->is_carried[e] && !x->is_read[e];
    text_add(w->text, "%s", w->indent);
    if (x->plan->is_derived[e]) {
        x->uses_p = true;
        text_add(w->text, "p->derived.");
    } else if (!w->function->is_stored[e] && !for_later_alone) {
        text_add(w->text, "const %s ", x->number);
        if (x->is_carried[e]) {
            emit_name(x, w->text, e);
            text_add(w->text, " = ");
        }
    }
    emit_target(w, e);
    emit_definition(x, w->text, e);
    text_add(w->text, ";\n");
}

static bool is_local(const struct writer *w, int f) {
    return f >= w->function->array_count;
}

static void emit_array_name(struct writer *w, int f) {
    text_add(w->text, "%s", emit_array_text(w->x, w->function, f, w->local));
}

/* ---- Loops ---- */

static bool is_slot_of(const struct writer *w, int slot, const struct code_block *block) {
    return block->group && w->function->group_of[w->x->g->slots[slot].loop] == block->group;
}

static bool is_slot_needed(const struct writer *w, int slot) {
    const struct graph *g = w->x->g;
    const bool *needed = w->function->is_needed;
    return needed[g->slots[slot].carried] || needed[g->slots[slot].final];
}

/* Stores, for all elements, the value that the loop carries into them, if other loops read it. */
static void emit_kept_slots(struct writer *w, const struct code_block *block, int count, bool declare) {
    struct emission *x = w->x;
    for (int s = 0; s < x->g->slot_count; s++) {
        const expression e = x->g->slots[s].carried;
        const char *name = x->slot_names[s], *place = x->is_carried[e] ? "s->" : "";
        if (!is_slot_of(w, s, block) || !w->function->is_stored[e])
            continue;
        x->uses_carried |= x->is_carried[e];
        if (!declare)
            text_add(w->text, "        %s%s_at[e] = %s;\n", place, name, name);
        else if (!x->is_carried[e])
            text_add(w->text, "    %s %s_at[%d];\n", x->number, name, count);
    }
}

/* Declares the arrays that the loop fills for others, and the values that it carries. */
static void emit_loop_variables(struct writer *w, const struct code_block *block, int begin, int count) {
    struct emission *x = w->x;
    for (int i = begin; i < block->end; i++) {
        const expression e = w->function->statements[i];
        if (!w->function->is_stored[e] || x->is_carried[e])
            continue;
        text_add(w->text, "    %s ", x->number);
        emit_name(x, w->text, e);
        text_add(w->text, "[%d];\n", count);
    }
    emit_kept_slots(w, block, count, true);
    for (int s = 0; s < x->g->slot_count; s++) {
        if (!is_slot_of(w, s, block) || !is_slot_needed(w, s))
            continue;
        x->slot_piece[s] = x->piece;
        text_add(w->text, "    %s %s = ", x->number, x->slot_names[s]);
        emit_assigned(x, w->text, x->g->slots[s].initial);
        text_add(w->text, ";\n");
    }
}

/* The values for the next iteration: all are computed before any is changed. */
static void emit_slot_updates(struct writer *w, const struct code_block *block) {
    struct emission *x = w->x;
    for (int pass = 0; pass < 2; pass++)
        for (int s = 0; s < x->g->slot_count; s++) {
            const expression next = x->g->slots[s].next;
            const bool is_stated = x->plan->is_statement[next];
            if (!is_slot_of(w, s, block) || !is_slot_needed(w, s))
                continue;
            if (pass == 0 && !is_stated) {
                text_add(w->text, "        const %s next_%s = ", x->number, x->slot_names[s]);
                emit_assigned(x, w->text, next);
                text_add(w->text, ";\n");
            }
            if (pass == 1) {
                text_add(w->text, "        %s = ", x->slot_names[s]);
                if (is_stated)
                    emit_value(x, w->text, next);
                else
                    text_add(w->text, "next_%s", x->slot_names[s]);
                text_add(w->text, ";\n");
            }
        }
}

static void emit_run_results(struct writer *w, int block) {
    const struct function *function = w->function;
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        if (result->block != block)
            continue;
        const int f = result->array;
        w->wrote_result |= !is_local(w, f);
        w->x->uses_carried |= is_local(w, f);
        text_add(w->text, "        ");
        emit_array_name(w, f);
        text_add(w->text, "[");
        emit_run_index(w->text, result->entry, result->stride);
        text_add(w->text, "] = ");
        emit_assigned(w->x, w->text, result->value);
        text_add(w->text, ";\n");
    }
}

/* Saves the carried values that later pieces read. */
static void emit_carried_slots(struct writer *w, const struct code_block *block) {
    const struct emission *x = w->x;
    for (int s = 0; s < x->g->slot_count; s++)
        if (is_slot_of(w, s, block) && x->is_slot_carried[s])
            text_add(w->text, "    s->%s = %s;\n", x->slot_names[s], x->slot_names[s]);
}

/* Prints the values that every loop computes again. */
static void emit_repeats(struct writer *w, int group) {
    struct emission *x = w->x;
    for (int i = 0; i < w->function->repeat_count; i++) {
        const struct repeat *use = &w->function->repeats[i];
        if (use->group != group)
            continue;
        x->piece_of[use->value] = x->piece;
        x->is_carried[use->value] = false;
        text_add(w->text, "        const %s ", x->number);
        emit_name(x, w->text, use->value);
        text_add(w->text, " = ");
        emit_definition(x, w->text, use->value);
        text_add(w->text, ";\n");
    }
}

static void emit_loop(struct writer *w, int index, int begin) {
    struct emission *x = w->x;
    const struct code_block *block = &w->function->blocks[index];
    const struct element_run *run = &x->plan->rolled->runs[block->run];
    const bool inward = block->inward;
    emit_loop_variables(w, block, begin, run->count);
    text_add(w->text,
             inward ? "    for (int e = %d; e >= 0; e--) { /* %s, inward */\n"
                    : "    for (int e = 0; e < %d; e++) { /* %s */\n",
             inward ? run->count - 1 : run->count, run->name);
    w->indent = "        ";
    x->group = block->group;
    emit_repeats(w, block->group);
    emit_kept_slots(w, block, run->count, false);
    for (int i = begin; i < block->end; i++)
        emit_statement(w, w->function->statements[i]);
    emit_run_results(w, index);
    emit_slot_updates(w, block);
    w->indent = "    ";
    x->group = 0;
    text_add(w->text, "    }\n");
    emit_carried_slots(w, block);
}

static void emit_result(struct writer *w, const struct write *write) {
    const int f = write->array, entry = write->entry;
    const struct array *array = &w->function->arrays[f];
    w->wrote_result |= !is_local(w, f);
    w->x->uses_carried |= is_local(w, f);
    text_add(w->text, "    ");
    emit_array_name(w, f);
    if (array->columns)
        text_add(w->text, "[%d * %d + %d] = ", entry / array->columns, array->columns,
                 entry % array->columns);
    else
        text_add(w->text, "[%d] = ", entry);
    emit_assigned(w->x, w->text, write->value);
    text_add(w->text, ";\n");
}

/* Writes the results that are known after `place` statements and blocks. */
static void emit_results(struct writer *w, int place) {
    const struct function *function = w->function;
    for (; w->written < function->write_count && function->writes[w->written].place <= place; w->written++)
        emit_result(w, &function->writes[w->written]);
}

/* Clears the entries near the diagonal. */
static void emit_band(struct writer *w, int f) {
    const int n = w->function->arrays[f].columns;
    text_add(w->text,
             "    for (int i = 0; i < %d; i++)\n        for (int j = i < %d ? 0 : i - %d; j <= i + %d && j < "
             "%d; j++)\n"
             "            ",
             n, LOOPS_BAND, LOOPS_BAND, LOOPS_BAND, n);
    emit_array_name(w, f);
    text_add(w->text, "[i * %d + j] = %s;\n", n, emit_zero(w->x));
}

static void emit_fills(struct writer *w) {
    for (int f = 0; f < plan_count_arrays(w->function); f++) {
        const struct array *array = &w->function->arrays[f];
        const bool is_composed = w->function->part_count > 0; /* then no statement writes single zeros */
        if (is_prepare(w) || (is_composed ? is_local(w, f) : !plan_is_cleared(w->x->plan, w->function, f)) ||
            loops_coverage(w->function, f) == LOOPS_SET_ALL)
            continue;
        if (loops_coverage(w->function, f) == LOOPS_SET_OTHERS) {
            emit_band(w, f);
            continue;
        }
        text_add(w->text, "    for (int i = 0; i < %d; i++)\n        ", array->count);
        emit_array_name(w, f);
        text_add(w->text, "[i] = %s;\n", emit_zero(w->x));
    }
}

static void emit_mirrors(struct writer *w) {
    for (int f = 0; f < w->function->array_count; f++) {
        const struct array *array = &w->function->arrays[f];
        const int n = array->symmetric;
        if (n < 2)
            continue;
        text_add(w->text,
                 "    for (int i = 0; i < %d; i++)\n        for (int j = 0; j < i; j++)\n            ", n);
        emit_array_name(w, f);
        text_add(w->text, "[j * %d + i] = ", n);
        emit_array_name(w, f);
        text_add(w->text, "[i * %d + j];\n", n);
    }
}

/* Prints the statements of one piece, block by block. A loop without statements belongs to the piece in
 * which it begins. */
static void emit_blocks(struct writer *w, int begin, int end) {
    const struct function *function = w->function;
    for (int b = 0, at = 0; b < function->block_count; at = function->blocks[b++].end) {
        const struct code_block *block = &function->blocks[b];
        const bool is_last = at == end && end == function->statement_count;
        if (block->run >= 0 && at >= begin && (at < end || is_last)) {
            emit_loop(w, b, at);
            emit_results(w, block->end + b + 1);
        }
        for (int i = at > begin ? at : begin; block->run < 0 && i < block->end && i < end; i++) {
            emit_statement(w, function->statements[i]);
            emit_results(w, i + b + 1);
        }
    }
}

/* Prints the statements and results of one piece, and notes in the emission which arguments they read. */
static void emit_body(struct writer *w, int piece) {
    struct emission *x = w->x;
    x->piece = piece;
    w->last_remark = NULL;
    w->wrote_result = false;
    x->uses_p = x->uses_x = x->uses_t = x->uses_q = x->uses_qd = false;
    x->uses_carried = false;
    memset(x->uses_given, 0, sizeof x->uses_given);
    if (!piece)
        w->written = 0;
    emit_results(w, 0);
    emit_blocks(w, piece ? w->function->piece_ends[piece - 1] : 0, w->function->piece_ends[piece]);
}

static void emit_unused(const struct writer *w, struct text *text) {
    const struct emission *x = w->x;
    const struct {
        bool used;
        const char *name;
    } arguments[] = {
        {x->uses_p, "p"}, {x->uses_x, "x"}, {x->uses_t, "t"}, {x->uses_q, "q"}, {x->uses_qd, "qd"}};
    struct given_array given[GIVEN_ARRAYS];
    for (int i = 0; i < (is_prepare(w) ? 1 : 5); i++)
        if (!arguments[i].used)
            text_add(text, "    (void)%s;\n", arguments[i].name);
    emit_list_given(x->plan, w->function, given);
    for (int i = 0; i < GIVEN_ARRAYS; i++)
        if (given[i].count && !x->uses_given[i])
            text_add(text, "    (void)%s;\n", given[i].name);
}

static void number_statements(struct writer *w) {
    struct emission *x = w->x;
    int temporary = 0, piece = 0;
    for (int i = 0; i < w->function->statement_count; i++) {
        const expression e = w->function->statements[i];
        while (i >= w->function->piece_ends[piece])
            piece++;
        x->piece_of[e] = piece;
        x->is_carried[e] = x->is_read[e] = false;
        if (!x->value_names[e])
            x->temporary[e] = ++temporary;
    }
    for (int i = 0; i < w->function->repeat_count; i++)
        if (!x->value_names[w->function->repeats[i].value])
            x->temporary[w->function->repeats[i].value] = ++temporary;
}

static void emit_locals(struct writer *w) {
    for (int f = w->function->array_count; f < plan_count_arrays(w->function); f++)
        text_add(w->text, "    %s %s[%d];\n", w->x->number, w->function->arrays[f].name,
                 w->x->is_lanes ? w->function->arrays[f].count : loops_length_of_local(w->function, f));
}

static void emit_short_function(struct writer *w) {
    struct text body = {.memory = w->x->plan->memory}, *text = w->text;
    w->text = &body;
    emit_body(w, 0);
    w->text = text;
    w->x->uses_q |= w->x->angles.count > 0;
    emit_signature(w->x, text, w->function);
    text_add(text, " {\n");
    emit_unused(w, text);
    emit_locals(w);
    emit_angle_arrays(w->x, text);
    emit_angle_pass(w->x, text);
    emit_fills(w);
    text_add(text, "%s", body.data ? body.data : "");
    emit_mirrors(w);
    emit_loops(w->x, text, w->function, w->local);
    text_add(text, "}\n\n");
}

static void emit_carried(struct writer *w) {
    struct emission *x = w->x;
    text_add(w->text, "/* Values of %s_%s that later pieces read. */\nstruct %s_%s_carried {\n", x->name,
             w->function->quantity, x->name, w->function->quantity);
    const size_t begin = w->text->length;
    for (int i = 0; i < w->function->statement_count; i++) {
        const expression e = w->function->statements[i];
        if (!x->is_carried[e])
            continue;
        text_add(w->text, "    %s ", x->number);
        emit_name(x, w->text, e);
        if (w->function->is_stored[e])
            text_add(w->text, "[%d]", x->plan->rolled->runs[x->g->loops[x->g->nodes[e].loop].run].count);
        text_add(w->text, ";\n");
    }
    for (int slot = 0; slot < x->g->slot_count; slot++) {
        if (x->is_slot_carried[slot])
            text_add(w->text, "    %s %s;\n", x->number, x->slot_names[slot]);
        if (x->is_carried[x->g->slots[slot].carried])
            text_add(w->text, "    %s %s_at[%d];\n", x->number, x->slot_names[slot],
                     x->plan->rolled->runs[x->g->loops[x->g->slots[slot].loop].run].count);
    }
    emit_locals(w);
    emit_angle_arrays(x, w->text);
    if (w->text->length == begin)
        text_add(w->text, "    %s none;\n", x->number); /* C has no empty struct */
    text_add(w->text, "};\n\n");
}

static void emit_piece(struct writer *w, int piece) {
    struct emission *x = w->x;
    struct text body = {.memory = x->plan->memory}, *text = w->text;
    w->text = &body;
    emit_body(w, piece);
    w->text = text;
    text_add(text, "static void %s_%s_%d(", x->name, w->function->quantity, piece + 1);
    emit_arguments(x, text, w->function);
    text_add(text, ",\n        struct %s_%s_carried *s) {\n", x->name, w->function->quantity);
    emit_unused(w, text);
    if (!x->uses_carried)
        text_add(text, "    (void)s;\n");
    if (!is_prepare(w) && !w->wrote_result)
        text_add(text, "    (void)%s;\n", result_name(w->function));
    text_add(text, "%s}\n\n", body.data);
}

static void pass_given(const struct writer *w) {
    struct given_array given[GIVEN_ARRAYS];
    emit_list_given(w->x->plan, w->function, given);
    for (int i = 0; i < GIVEN_ARRAYS; i++)
        if (given[i].count)
            text_add(w->text, "%s, ", given[i].name);
}

static void emit_calls(struct writer *w) {
    struct emission *x = w->x;
    const char *result = result_name(w->function);
    emit_signature(x, w->text, w->function);
    text_add(w->text, " {\n    struct %s_%s_carried s;\n", x->name, w->function->quantity);
    w->local = "s.";
    emit_fills(w);
    emit_angle_pass(x, w->text);
    for (int piece = 0; piece < w->function->piece_count; piece++) {
        text_add(w->text, "    %s_%s_%d(", x->name, w->function->quantity, piece + 1);
        if (is_prepare(w)) {
            text_add(w->text, "p, &s);\n");
        } else {
            text_add(w->text, "p, x, t, q, qd, ");
            pass_given(w);
            text_add(w->text, "%s, &s);\n", result);
        }
    }
    emit_mirrors(w);
    emit_loops(x, w->text, w->function, w->local);
    text_add(w->text, "}\n\n");
}

/* The carried values are known only after all pieces have been printed: a first printing, which is
 * discarded, finds them. */
static void find_carried(struct writer *w) {
    struct text unread = {.memory = w->x->plan->memory}, *text = w->text;
    w->text = &unread;
    for (int piece = 0; piece < w->function->piece_count; piece++)
        emit_body(w, piece);
    w->text = text;
}

/* ---- Composed functions ---- */

/* Returns whether the called function writes into the part's place itself. Otherwise its result is copied
 * there. */
static bool writes_in_place(const struct composed_array *part) {
    return !plan_is_struct_result(part->from) && !part->is_added;
}

static void emit_part_call(struct writer *w, const struct composed_array *part) {
    const struct function *from = part->from;
    const char *name = w->x->name, *arguments = "p, x, t, q, qd";
    if (writes_in_place(part)) {
        text_add(w->text, "    %s_%s(%s, ", name, from->quantity, arguments);
        emit_array_name(w, part->to_array);
        text_add(w->text, ");\n");
        return;
    }
    if (plan_is_struct_result(from))
        text_add(w->text, "    struct %s_%s_result %s;\n", name, from->quantity, from->quantity);
    else
        text_add(w->text, "    %s %s[%d];\n", w->x->number, from->quantity, from->out_count);
    text_add(w->text, "    %s_%s(%s, %s%s);\n", name, from->quantity, arguments,
             plan_is_struct_result(from) ? "&" : "", from->quantity);
}

/* "terms.u": the source of a part that is copied. */
static const char *source_text(const struct writer *w, const struct composed_array *part) {
    const char *from = part->from->quantity;
    return plan_is_struct_result(part->from)
               ? memory_format(w->x->plan->memory, "%s.%s", from, part->from->arrays[part->from_array].name)
               : from;
}

static void emit_part_copy(struct writer *w, const struct composed_array *part) {
    const char *source = source_text(w, part),
               *target = emit_array_text(w->x, w->function, part->to_array, w->local);
    if (part->is_added)
        text_add(w->text, "    for (int i = 0; i < %d; i++)\n        %s[i] += %s[i];\n",
                 part->from->arrays[part->from_array].count, target, source);
    else
        text_add(w->text, "    memcpy(%s, %s, sizeof %s);\n", target, source, source);
}

static void emit_composed(struct writer *w) {
    const struct function *function = w->function;
    emit_signature(w->x, w->text, function);
    text_add(w->text, " {\n");
    emit_locals(w);
    if (function->loop_count)
        emit_fills(w);
    for (int i = 0; i < function->part_count; i++) {
        const struct composed_array *part = &function->parts[i];
        if (i == 0 || function->parts[i - 1].from != part->from)
            emit_part_call(w, part);
        if (!writes_in_place(part))
            emit_part_copy(w, part);
    }
    emit_loops(w->x, w->text, function, w->local);
    text_add(w->text, "}\n\n");
}

static void emit_whole(struct writer *w) {
    struct emission *x = w->x;
    plan_mark_statements(x->plan, w->function);
    number_statements(w);
    x->is_cut = w->function->piece_count > 1;
    if (!x->is_cut) {
        emit_short_function(w);
        return;
    }
    w->local = "s->";
    find_carried(w);
    emit_carried(w);
    for (int piece = 0; piece < w->function->piece_count; piece++)
        emit_piece(w, piece);
    emit_calls(w);
}

const char *emit_function(struct emission *x, struct text *text, const struct function *function) {
    struct writer w = {.x = x, .text = text, .function = function, .indent = "    ", .local = ""};
    x->function = function;
    memset(x->is_slot_carried, 0, (size_t)x->g->slot_count);
    for (int slot = 0; slot < x->g->slot_count; slot++)
        x->is_carried[x->g->slots[slot].carried] = false;
    emit_begin_angles(x);
    if (x->angles.count && !x->is_lanes)
        emit_sincos(x, text);
    const size_t begin = text->length;
    if (function->part_count)
        emit_composed(&w);
    else
        emit_whole(&w);
    return text->data + begin;
}
