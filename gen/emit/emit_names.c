/*
 * Names of values in the emitted C: each value that some function computes gets a unique name. Input: the
 * names from the derivation. Values of parameters alone always have a name. If the derivation did not name
 * them, they are named after their factors and terms (half_L, m_E_times_g), or constant_7 if that is too
 * long.
 */
#include "gen/emit/emit.h"

#include <ctype.h>
#include <string.h>

/* How tightly the operator of a node binds in C. */
enum binding binding_of(const struct node *node) {
    switch (node->operation) {
    case OP_ADD:
    case OP_SUB:
        return BINDS_SUM;
    case OP_MUL:
    case OP_DIV:
    case OP_NEG: /* -a b is (-a) b: the same value */
        return BINDS_PRODUCT;
    default:
        return BINDS_ATOM;
    }
}

/* ---- Names from factors and terms ---- */

enum { LONGEST_NAME = 52, LONGEST_NUMBER = 6 };

/* 12.5 -> "12_5"; "" for a number that a name cannot contain. */
static const char *digits_of(struct memory *memory, double value) {
    char buffer[32];
    if (value == 3.141592653589793)
        return "pi";
    char *digits = memory_text(memory, text_of_number(value, buffer));
    size_t length = strlen(digits);
    if (length > 2 && !strcmp(digits + length - 2, ".0"))
        digits[length -= 2] = 0;
    if (length > LONGEST_NUMBER || strspn(digits, "0123456789.") < length)
        return "";
    if (strchr(digits, '.'))
        *strchr(digits, '.') = '_';
    return digits;
}

/* "A_times_B"; "" if either has no name or the result is too long. A name does not begin with a digit. */
static const char *joined(struct memory *memory, const char *a, const char *word, const char *b) {
    const bool is_none = !*a || !*b || isdigit((unsigned char)*a);
    const bool is_long = strlen(a) + strlen(word) + strlen(b) + 2 > LONGEST_NAME;
    return is_none || is_long ? "" : memory_format(memory, "%s_%s_%s", a, word, b);
}

static const char *affixed(struct memory *memory, const char *before, const char *name, const char *after) {
    return *name ? memory_format(memory, "%s%s%s", before, name, after) : "";
}

/* The name of an operand; "" if it binds less tightly than `at_least`, because the name would be
 * ambiguous. */
static const char *name_of_operand(const struct emission *x, expression e, enum binding at_least);

static const char *name_of_operation(const struct emission *x, const struct node *node) {
    static const char *const words[] = {
        [OP_ADD] = "plus", [OP_SUB] = "minus", [OP_MUL] = "times", [OP_DIV] = "over"};
    struct memory *memory = x->plan->memory;
    const bool is_product = node->operation == OP_MUL, is_quotient = node->operation == OP_DIV;
    const bool is_turned =
        expr_is_number(x->g, node->operand[0], NULL) && (is_product || node->operation == OP_ADD);
    const expression a = node->operand[is_turned], b = node->operand[!is_turned];
    const char *first = name_of_operand(x, a, BINDS_PRODUCT);
    const char *second = name_of_operand(x, b, is_quotient ? BINDS_ATOM : BINDS_PRODUCT);
    if (is_product && a == b)
        return affixed(memory, "", first, "_squared");
    if (is_product && !strcmp(second, "0_5"))
        return affixed(memory, "half_", first, "");
    if (is_quotient && a == EXPR_ONE)
        return affixed(memory, "", second, "_inverse");
    return joined(memory, first, words[node->operation], second);
}

static const char *name_of_definition(const struct emission *x, expression e) {
    const struct node *node = &x->g->nodes[e];
    const struct symbol *s = expr_as_symbol(x->g, e);
    double value;
    if (expr_is_number(x->g, e, &value))
        return digits_of(x->plan->memory, value);
    if (s)
        return s->kind == SYMBOL_PARAMETER ? x->plan->model->parameters[s->index].name : "";
    if (node->operation == OP_SIN || node->operation == OP_COS)
        return joined(x->plan->memory, operation_text(node->operation), "of",
                      name_of_operand(x, node->operand[0], BINDS_ATOM));
    return binding_of(node) < BINDS_ATOM && node->operation != OP_NEG ? name_of_operation(x, node) : "";
}

static const char *name_of_operand(const struct emission *x, expression e, enum binding at_least) {
    const char *name = x->value_names[e];
    if (name)
        return strncmp(name, "constant_", strlen("constant_")) ? name : "";
    if (x->plan->is_statement[e] || binding_of(&x->g->nodes[e]) < at_least)
        return "";
    return name_of_definition(x, e);
}

/* ---- Unique names ---- */

/* The place of a name in a hash table of texts: its own, or the empty one where it belongs. */
static size_t slot_of(const char **table, size_t size, const char *name) {
    size_t h = 5381;
    for (const char *c = name; *c; c++)
        h = h * 33 + (unsigned char)*c;
    h &= size - 1;
    while (table[h] && strcmp(table[h], name))
        h = (h + 1) & (size - 1);
    return h;
}

/* The name itself, or the first of name_2, name_3 ... that is free. */
static const char *unique_name(struct emission *x, const char **table, size_t size, const char *name) {
    const char *candidate = name;
    size_t slot = slot_of(table, size, candidate);
    for (int copy = 2; table[slot]; copy++) {
        candidate = memory_format(x->plan->memory, "%s_%d", name, copy);
        slot = slot_of(table, size, candidate);
    }
    table[slot] = candidate;
    return candidate;
}

/* Makes each name of the derivation that some function prints unique. Values of parameters alone always
 * have one. */
void emit_name_values(struct emission *x) {
    struct memory *memory = x->plan->memory;
    size_t size = 1024;
    int derived = 0;
    while (size < 4 * ((size_t)x->g->count + (size_t)x->g->slot_count))
        size *= 2;
    const char **table = memory_get(memory, size * sizeof *table);
    x->value_names = memory_get(memory, x->g->count * sizeof *x->value_names);
    const bool *needed = plan_mark_nodes_of_functions(x->plan);
    plan_mark_statements(x->plan, &x->plan->prepare);
    for (expression e = 0; e < x->g->count; e++) {
        const char *name = needed[e] ? x->g->names[e] : NULL;
        if (!name && x->plan->is_derived[e])
            name = name_of_definition(x, e);
        if (name && !*name)
            name = memory_format(memory, "constant_%d", ++derived);
        if (name)
            x->value_names[e] = unique_name(x, table, size, name);
    }
    x->slot_names = memory_get(memory, ((size_t)x->g->slot_count + 1) * sizeof *x->slot_names);
    for (int s = 0; s < x->g->slot_count; s++) {
        const char *name = x->g->names[x->g->slots[s].next];
        name = name ? memory_format(memory, "last_%s", name) : memory_format(memory, "carried_%d", s);
        x->slot_names[s] = unique_name(x, table, size, name);
    }
}

/* ---- The place of an element's value in an array ---- */

void emit_run_index(struct text *text, int first, int stride) {
    if (first)
        text_add(text, "%d + ", first);
    if (stride > 1)
        text_add(text, "%d * ", stride);
    text_add(text, "e");
}

const char *emit_array_text(struct emission *x, const struct function *function, int array,
                            const char *local) {
    const bool is_result = array < function->array_count;
    const char *before = !is_result ? local : plan_is_struct_result(function) ? "out->" : "";
    return memory_format(x->plan->memory, "%s%s", before, function->arrays[array].name);
}
