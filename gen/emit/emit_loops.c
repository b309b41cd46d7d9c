/*
 * The C text of the loops of a plan, statement by statement from their form (gen/plan/loops.h). Conditions
 * that are known are left out, as are statements without an effect.
 */
#include "gen/emit/emit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct printer {
    struct emission *x;
    struct text *text;
    const struct loop_form *form;
    const char *local; /* precedes the names of local arrays */
    bool *is_used;     /* by table */
    int depth;
};

enum { LONGEST_LINE = 90 };

/* ---- Integers and entries ---- */

static void put_part(const struct printer *p, const struct loop_index_part *part, bool is_first) {
    const struct loop_form *form = p->form;
    const int factor = abs(part->factor);
    text_add(p->text, "%s", is_first ? (part->factor < 0 ? "-" : "") : part->factor < 0 ? " - " : " + ");
    if (factor != 1)
        text_add(p->text, "%d * ", factor);
    if (part->table == NOTHING) {
        text_add(p->text, "%s", form->variables[part->variable]);
        return;
    }
    p->is_used[part->table] = true;
    text_add(p->text, "%s[%s]", form->tables[part->table].name, form->variables[part->variable]);
}

static void put_index(const struct printer *p, const struct loop_index *index) {
    for (int i = 0; i < index->count; i++)
        put_part(p, &index->parts[i], !i);
    if (!index->count)
        text_add(p->text, "%d", index->constant);
    else if (index->constant)
        text_add(p->text, " %c %d", index->constant < 0 ? '-' : '+', abs(index->constant));
}

static void put_entry(const struct printer *p, const struct loop_entry *entry) {
    const struct function *function = p->form->function;
    const int local = entry->array - plan_count_arrays(function);
    const char *name =
        local < 0 ? emit_array_text(p->x, function, entry->array, p->local) : p->form->locals[local].name;
    text_add(p->text, "%s", name);
    if (local >= 0 && !p->form->locals[local].count)
        return;
    text_add(p->text, "[");
    put_index(p, &entry->at);
    text_add(p->text, "]");
}

/* ---- Assignments ---- */

static void put_indent(const struct printer *p) {
    text_add(p->text, "%*s", 4 * p->depth, "");
}

/* The sign of a term stands before it. */
static void put_term(const struct printer *p, const struct loop_term *term) {
    char digits[NUMBER_LENGTH];
    if (fabs(term->factor) != 1)
        text_add(p->text, "%s * ", text_of_number(fabs(term->factor), digits));
    for (int k = 0; k < term->operand_count; k++) {
        text_add(p->text, k ? " * " : "");
        put_entry(p, &term->operands[k]);
    }
}

static void put_sum(const struct printer *p, const struct loop_statement *s, bool is_negated) {
    bool is_open = false;
    for (int i = 0; i < s->term_count; i++) {
        const struct loop_term *term = &s->terms[i];
        const bool is_minus = (term->factor < 0) != is_negated, begins = term->begins_group;
        if (begins && is_open)
            text_add(p->text, ")");
        if (i && text_column(p->text) > LONGEST_LINE) {
            text_add(p->text, "\n");
            text_add(p->text, "%*s", 4 * p->depth + 3, "");
        }
        if (begins)
            text_add(p->text, "%s(%s", i ? " + " : "", is_minus ? "-" : "");
        else
            text_add(p->text, "%s", i ? (is_minus ? " - " : " + ") : is_minus ? "-" : "");
        is_open = is_open || begins;
        put_term(p, term);
    }
    text_add(p->text, "%s", is_open ? ")" : s->term_count ? "" : emit_zero(p->x));
}

static void put_assignment(const struct printer *p, const struct loop_statement *s) {
    static const char *const effects[] = {
        [LOOP_SET] = "", [LOOP_ADD] = "+", [LOOP_MULTIPLY] = "*", [LOOP_INVERT] = ""};
    const bool is_subtracted = s->effect == LOOP_ADD && s->term_count == 1 && s->terms[0].factor < 0;
    put_indent(p);
    if (s->is_declared)
        text_add(p->text, "const %s ", p->x->number);
    put_entry(p, &s->target);
    text_add(p->text, " %s= %s", is_subtracted ? "-" : effects[s->effect],
             s->effect == LOOP_INVERT ? "1.0 / " : "");
    put_sum(p, s, is_subtracted);
    text_add(p->text, ";\n");
}

/* ---- Loops and conditions ---- */

static void put_list(struct printer *p, const struct loop_list *list);

/* Returns whether a condition holds: 1 or 0 if it is known, else -1. */
static int known_condition(const struct loop_statement *s) {
    const struct loop_index *a = &s->from, *b = &s->to;
    if (a->count == b->count && !memcmp(a->parts, b->parts, (size_t)a->count * sizeof *a->parts))
        return loop_holds(a->constant, s->relation, b->constant);
    return -1;
}

static bool has_effect(const struct loop_list *list);

static bool does_something(const struct loop_statement *s) {
    const int known = s->kind == LOOP_IF ? known_condition(s) : -1;
    if (s->kind != LOOP_FOR && s->kind != LOOP_IF && s->kind != LOOP_SEQUENCE)
        return true;
    return (known != 0 && has_effect(&s->body)) || (known != 1 && has_effect(&s->otherwise));
}

static bool has_effect(const struct loop_list *list) {
    for (const struct loop_statement *s = list->first; s; s = s->next)
        if (does_something(s))
            return true;
    return false;
}

static void put_relation(const struct printer *p, const struct loop_statement *s, const char *variable) {
    static const char *const signs[] = {
        [LOOP_LESS] = "<", [LOOP_GREATER] = ">", [LOOP_AT_LEAST] = ">=", [LOOP_EQUAL] = "=="};
    if (variable)
        text_add(p->text, "%s", variable);
    else
        put_index(p, &s->from);
    text_add(p->text, " %s ", signs[s->relation]);
    put_index(p, &s->to);
}

static void put_body(struct printer *p, const struct loop_list *body, int depth) {
    text_add(p->text, " {\n");
    p->depth += depth;
    put_list(p, body);
    p->depth -= depth;
    put_indent(p);
}

/* for (int i = first; i < first + length; i++) */
static void put_block(struct printer *p, const struct loop_statement *s, const char *first, int depth) {
    const char *variable = p->form->variables[s->variable];
    p->depth += depth;
    put_indent(p);
    text_add(p->text, "for (int %s = %s; %s < %s + %d; %s++)", variable, first, variable, first, s->block,
             variable);
    put_body(p, &s->body, 1);
    text_add(p->text, "}\n");
    p->depth -= depth;
}

/* "block = from / 8 * 8": the beginning of the first block. */
static void put_first_block(const struct printer *p, const struct loop_statement *s) {
    const bool is_sum = s->from.count + (s->from.constant != 0) > 1;
    text_add(p->text, "int block = %s", is_sum ? "(" : "");
    put_index(p, &s->from);
    text_add(p->text, "%s / %d * %d; ", is_sum ? ")" : "", s->block, s->block);
}

static void put_blocks_up(struct printer *p, const struct loop_statement *s) {
    put_indent(p);
    text_add(p->text, "for (");
    put_first_block(p, s);
    put_relation(p, s, "block");
    text_add(p->text, "; block += %d)\n", s->block);
    put_block(p, s, "block", 1);
}

/* There is always a complete block: only in this form does a compiler that looks for uninitialised values see
 * that all are set. */
static void put_whole_blocks(struct printer *p, const struct loop_statement *s) {
    const bool is_down = s->blocks == BLOCKS_DOWN;
    const int most = s->limit - s->block;
    put_indent(p);
    if (is_down) {
        text_add(p->text, "int top = ");
        put_index(p, &s->to);
        text_add(p->text, ";");
    } else {
        put_first_block(p, s);
    }
    text_add(p->text, "\n");
    put_indent(p);
    text_add(p->text, "do {\n");
    p->depth++;
    put_indent(p);
    if (is_down)
        text_add(p->text, "const int first = top > %d ? top - %d : 0;\n", s->block, s->block);
    else
        text_add(p->text, "const int first = block < %d ? block : %d;\n", most, most);
    put_block(p, s, "first", 0);
    put_indent(p);
    text_add(p->text, is_down ? "top -= %d;\n" : "block += %d;\n", s->block);
    p->depth--;
    put_indent(p);
    text_add(p->text, is_down ? "} while (top > " : "} while (block < ");
    put_index(p, is_down ? &s->from : &s->to);
    text_add(p->text, ");\n");
}

static void put_step(const struct printer *p, const struct loop_statement *s) {
    const char *variable = p->form->variables[s->variable];
    const bool is_down = !s->step.count && s->step.constant < 0;
    if (!s->step.count && abs(s->step.constant) == 1) {
        text_add(p->text, is_down ? "%s--" : "%s++", variable);
        return;
    }
    const struct loop_index step = is_down ? loop_times(s->step, -1) : s->step;
    text_add(p->text, is_down ? "%s -= " : "%s += ", variable);
    put_index(p, &step);
}

static void put_for(struct printer *p, const struct loop_statement *s) {
    const char *variable = p->form->variables[s->variable];
    if (s->blocks == BLOCKS_UP && !p->x->is_lanes) {
        put_blocks_up(p, s);
        return;
    }
    if (s->blocks && !p->x->is_lanes) {
        put_whole_blocks(p, s);
        return;
    }
    put_indent(p);
    text_add(p->text, s->is_declared ? "for (int %s = " : "for (", variable);
    if (s->is_declared)
        put_index(p, &s->from);
    text_add(p->text, "; ");
    put_relation(p, s, variable);
    text_add(p->text, "; ");
    put_step(p, s);
    text_add(p->text, ")");
    put_body(p, &s->body, 1);
    text_add(p->text, "}\n");
}

static void put_if(struct printer *p, const struct loop_statement *s) {
    const int known = known_condition(s);
    if (known >= 0) {
        put_list(p, known ? &s->body : &s->otherwise);
        return;
    }
    put_indent(p);
    text_add(p->text, "if (");
    put_relation(p, s, NULL);
    text_add(p->text, ")");
    put_body(p, &s->body, 1);
    if (has_effect(&s->otherwise)) {
        text_add(p->text, "} else");
        put_body(p, &s->otherwise, 1);
    }
    text_add(p->text, "}\n");
}

static void put_integer(const struct printer *p, const struct loop_statement *s) {
    const char *variable = p->form->variables[s->variable];
    put_indent(p);
    text_add(p->text, "%s%s%s = ", s->is_constant ? "const " : "", s->is_declared ? "int " : "", variable);
    put_index(p, &s->from);
    text_add(p->text, ";\n");
}

static void put_array(const struct printer *p, const struct loop_statement *s) {
    const struct loop_local *local = &p->form->locals[s->target.array - plan_count_arrays(p->form->function)];
    put_indent(p);
    text_add(p->text, "%s %s[%d];\n", p->x->number, local->name, local->count);
}

static void put_list(struct printer *p, const struct loop_list *list) {
    for (const struct loop_statement *s = list->first; s; s = s->next) {
        if (!does_something(s))
            continue;
        switch (s->kind) {
        case LOOP_FOR:
            put_for(p, s);
            break;
        case LOOP_IF:
            put_if(p, s);
            break;
        case LOOP_INTEGER:
            put_integer(p, s);
            break;
        case LOOP_ASSIGN:
            put_assignment(p, s);
            break;
        case LOOP_ARRAY:
            put_array(p, s);
            break;
        case LOOP_SEQUENCE:
            put_list(p, &s->body);
            break;
        }
    }
}

/* ---- All loops of a function ---- */

static void put_table(struct text *text, const struct loop_table *table) {
    bool is_small = true;
    for (int i = 0; i < table->count; i++)
        is_small = is_small && table->values[i] >= 0 && table->values[i] <= UINT8_MAX;
    text_add(text, "        static const %s %s[%d] = {", is_small ? "unsigned char" : "int", table->name,
             table->count);
    for (int i = 0; i < table->count; i++)
        text_add(text, "%s%d", !i ? "" : i % 24 ? ", " : ",\n            ", table->values[i]);
    text_add(text, "};\n");
}

/* The text of the statements, which is printed first, says which tables they use. */
void emit_loops(struct emission *x, struct text *text, const struct function *function, const char *local) {
    for (int i = 0; i < function->loop_count; i++) {
        const struct loop *loop = &function->loops[i];
        struct text body = {.memory = x->plan->memory};
        bool is_used[MOST_TABLES] = {false};
        struct printer p = {x,     &body,   loops_lower(x->plan->memory, function, loop, !x->is_lanes),
                            local, is_used, 2};
        put_list(&p, &p.form->body);
        text_add(text, "    { /* %s */\n", loop->about);
        for (int t = 0; t < p.form->table_count; t++)
            if (is_used[t])
                put_table(text, &p.form->tables[t]);
        text_add(text, "%s    }\n", body.data ? body.data : "");
    }
}
