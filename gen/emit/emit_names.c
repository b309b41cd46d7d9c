/*
 * Names of values in the emitted C: takes the names that the derivation gave, gives each value that some
 * function computes one of its own. Values of parameters alone always have one: those that the derivation
 * did not name are called after their factors and terms (half_L, m_E_times_g), or constant_7 where that is
 * long.
 */
#include "emit/emit.h"

#include <ctype.h>
#include <string.h>

/* ---- After factors and terms ---- */

enum { LONGEST_NAME = 52, LONGEST_NUMBER = 6 };

/* 12.5 -> "12_5"; "" where a name cannot hold it. */
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

/* Characters of b that are leading words of both, as "arm_" of arm_mass and arm_moment_x; none before a
 * digit. */
static size_t common_lead(const char *a, const char *b) {
    size_t lead = 0;
    for (size_t i = 0; a[i] && a[i] == b[i]; i++)
        lead = a[i] == '_' && !isdigit((unsigned char)b[i + 1]) ? i + 1 : lead;
    return lead;
}

/* "A_times_B", words that both begin with only once where that is long; "" where either has no name, or it is
 * long all the same. A name begins with no digit. */
static const char *joined(struct memory *memory, const char *a, const char *word, const char *b) {
    if (!*a || !*b || isdigit((unsigned char)*a))
        return "";
    if (strlen(a) + strlen(word) + strlen(b) + 2 > LONGEST_NAME)
        b += common_lead(a, b);
    const char *name = memory_format(memory, "%s_%s_%s", a, word, b);
    return strlen(name) > LONGEST_NAME ? "" : name;
}

static const char *affixed(struct memory *memory, const char *before, const char *name, const char *behind) {
    return *name ? memory_format(memory, "%s%s%s", before, name, behind) : "";
}

/* What an operand is called where only what binds as tightly as `at_least` has an unambiguous name. */
static const char *name_of_operand(const struct emission *x, expression e, enum binding at_least);

static bool is_value(const struct emission *x, expression e, double value) {
    double number;
    return expr_is_number(x->g, e, &number) && number == value;
}

static const char *name_of_sum(const struct emission *x, const struct node *node) {
    const expression a = node->operand[0], b = node->operand[1];
    const char *first = name_of_operand(x, a, BINDS_PRODUCT), *second = name_of_operand(x, b, BINDS_PRODUCT);
    if (node->operation == OP_SUB)
        return joined(x->plan->memory, first, "minus", second);
    return a == b ? affixed(x->plan->memory, "twice_", first, "")
                  : joined(x->plan->memory, first, "plus", second);
}

static const char *name_of_product(const struct emission *x, expression a, expression b) {
    struct memory *memory = x->plan->memory;
    const char *first = name_of_operand(x, a, BINDS_PRODUCT), *second = name_of_operand(x, b, BINDS_PRODUCT);
    if (a == b)
        return affixed(memory, "", first, "_squared");
    if (is_value(x, b, 0.5) || is_value(x, b, 2))
        return affixed(memory, is_value(x, b, 2) ? "twice_" : "half_", first, "");
    return joined(memory, first, "times", second);
}

static const char *name_of_quotient(const struct emission *x, const struct node *node) {
    struct memory *memory = x->plan->memory;
    const char *divisor = name_of_operand(x, node->operand[1], BINDS_ATOM);
    if (is_value(x, node->operand[0], 1))
        return affixed(memory, "", divisor, "_inverse");
    return joined(memory, name_of_operand(x, node->operand[0], BINDS_PRODUCT), "over", divisor);
}

static const char *name_of_definition(const struct emission *x, expression e) {
    const struct node *node = &x->g->nodes[e];
    const struct symbol *s = expr_as_symbol(x->g, e);
    double value;
    if (expr_is_number(x->g, e, &value))
        return digits_of(x->plan->memory, value);
    if (s)
        return s->kind == SYMBOL_PARAMETER ? x->plan->model->parameters[s->index].name : "";
    switch (node->operation) {
    case OP_ADD:
    case OP_SUB:
        return name_of_sum(x, node);
    case OP_MUL:
        return expr_is_number(x->g, node->operand[0], NULL)
                   ? name_of_product(x, node->operand[1], node->operand[0])
                   : name_of_product(x, node->operand[0], node->operand[1]);
    case OP_DIV:
        return name_of_quotient(x, node);
    case OP_SIN:
    case OP_COS:
    case OP_SQRT:
        return joined(x->plan->memory, operation_text(node->operation), "of",
                      name_of_operand(x, node->operand[0], BINDS_ATOM));
    default:
        return "";
    }
}

static const char *name_of_operand(const struct emission *x, expression e, enum binding at_least) {
    const char *name = x->value_names[e];
    if (name)
        return strncmp(name, "constant_", strlen("constant_")) ? name : "";
    if (x->plan->is_statement[e] || binding_of(&x->g->nodes[e]) < at_least)
        return "";
    return name_of_definition(x, e);
}

/* ---- One name each ---- */

/* A slot of a hash table of texts: the name's own, or the empty one where it belongs. */
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

/* Each name of the derivation that some function prints once; values of parameters alone always have one. */
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
