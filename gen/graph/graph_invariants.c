/*
 * Checks a graph against the rules of graph.h, one line of a table for each rule.
 *
 * Input: the graph between two passes. Result: the first rule that it breaks, with the offending entry as
 * text. gen.c calls it after each pass in builds with assertions.
 */
#include "gen/graph/graph.h"
#include "gen/base/base.h"

#include <ctype.h>
#include <string.h>

struct promise {
    const char *text;
    bool (*holds)(const struct graph *g, uint32_t index);
};

/* ---- Nodes ---- */

static int arity_of(const struct graph *g, expression e) {
    return operation_arity(g->nodes[e].operation);
}

static bool is_known_operation(const struct graph *g, expression e) {
    const struct node *node = &g->nodes[e];
    return node->operation == OP_SYMBOL   ? node->operand[0] < g->symbol_count
           : node->operation == OP_SPLINE ? node->operand[1] / SPLINE_ORDERS < g->spline_count
                                          : node->operation < OP_COUNT;
}

static bool has_smaller_operands(const struct graph *g, expression e) {
    for (int k = 0; k < arity_of(g, e); k++)
        if (g->nodes[e].operand[k] >= e)
            return false;
    return true;
}

/* Handle 0 is not in the table. */
static bool is_found(const struct graph *g, expression e) {
    double value = 0;
    return e == 0 ? expr_is_number(g, 0, &value) && value == 0 : graph_find_node(g, &g->nodes[e]) == e;
}

static bool is_one_at_1(const struct graph *g, expression e) {
    double value = 0;
    return e != 1 || (expr_is_number(g, 1, &value) && value == 1);
}

static bool is_number_node(const struct graph *g, expression e) {
    return expr_is_number(g, e, NULL);
}

/* Unfolded nodes have numbers on all sides, a zero next to + - or *, a factor 1, or a sign before a sign. */
static bool is_folded(const struct graph *g, expression e) {
    const struct node *node = &g->nodes[e];
    const expression a = node->operand[0], b = node->operand[1];
    bool has_numbers_alone = arity_of(g, e) > 0 && !operation_is_gain(node->operation);
    for (int k = 0; k < arity_of(g, e); k++)
        has_numbers_alone &= is_number_node(g, node->operand[k]);
    switch (node->operation) {
    case OP_ADD:
    case OP_SUB:
        return !has_numbers_alone && a && b;
    case OP_MUL:
        return !has_numbers_alone && a > 1 && b > 1;
    case OP_NEG:
        return !has_numbers_alone && g->nodes[a].operation != OP_NEG;
    default:
        return !has_numbers_alone;
    }
}

static bool has_set_of_its_operands(const struct graph *g, expression e) {
    unsigned depends = operation_is_gain(g->nodes[e].operation) ? ON_GAIN : 0;
    for (int k = 0; k < arity_of(g, e); k++)
        depends |= g->nodes[g->nodes[e].operand[k]].depends;
    return g->nodes[e].operation == OP_SYMBOL || g->nodes[e].depends == depends;
}

static bool is_loop(const struct graph *g, int loop) {
    return loop > 0 && loop < g->loop_count;
}

/* True for a node outside loops, a node that every loop over its run computes, or one that was made while
 * its loop was open. */
static bool is_within_its_loop(const struct graph *g, expression e) {
    const uint16_t loop = g->nodes[e].loop;
    if (!loop || loop == ANY_LOOP)
        return (loop == ANY_LOOP) == (expr_as_symbol(g, e) && (expr_as_symbol(g, e)->kind == SYMBOL_ELEMENT ||
                                                               expr_as_symbol(g, e)->kind == SYMBOL_LAST));
    return is_loop(g, loop) && g->loops[loop].begin <= e && e < g->loops[loop].end;
}

/* Returns whether code of loop `loop` (0: outside loops) may read e, which comes before it. */
static bool may_read(const struct graph *g, int loop, expression e) {
    const uint16_t home = g->nodes[e].loop;
    return !home || (loop && home == ANY_LOOP) || (loop && g->loops[home].run == g->loops[loop].run);
}

static bool reads_its_run_alone(const struct graph *g, expression e) {
    for (int k = 0; k < arity_of(g, e); k++)
        if (!may_read(g, g->nodes[e].loop, g->nodes[e].operand[k]))
            return false;
    return true;
}

/* The name must be an identifier of C. Reading it here lets a sanitizer detect freed memory. */
static bool is_called_by_identifier(const struct graph *g, expression e) {
    const char *name = g->names[e];
    if (!name)
        return true;
    for (const char *at = name; *at; at++)
        if (*at != '_' && !isalnum((unsigned char)*at))
            return false;
    return *name && !isdigit((unsigned char)*name) && arity_of(g, e) > 0;
}

static const struct promise of_nodes[] = {
    {"operators are those of ops.def, on existing symbols and splines", is_known_operation},
    {"handle 1 is the number 1", is_one_at_1},
    {"operands have smaller handles than results", has_smaller_operands},
    {"equal nodes have one handle, under which the table finds them", is_found},
    {"exact results are folded", is_folded},
    {"a node depends on what its operands depend on", has_set_of_its_operands},
    {"a loop computes what was made while it was open", is_within_its_loop},
    {"values of elements are read in loops over the same run", reads_its_run_alone},
    {"names are identifiers, of operations", is_called_by_identifier},
};

/* ---- Loops, slots, symbols, remarks ---- */

/* Entry 0 represents "no loop". */
static bool follows_loop_before(const struct graph *g, uint32_t loop) {
    const struct element_loop *of = &g->loops[loop];
    return loop == 0 || (g->loops[loop - 1].end <= of->begin && of->begin <= of->end && of->end <= g->count);
}

static bool is_slot_symbol(const struct graph *g, uint32_t slot, expression e, enum symbol_kind kind) {
    const struct symbol *s = e < g->count ? expr_as_symbol(g, e) : NULL;
    return s && s->kind == kind && s->index == (int)slot;
}

static bool has_symbols(const struct graph *g, uint32_t slot) {
    const struct slot *s = &g->slots[slot];
    return is_loop(g, s->loop) && is_slot_symbol(g, slot, s->carried, SYMBOL_CARRIED) &&
           is_slot_symbol(g, slot, s->final, SYMBOL_FINAL) && g->nodes[s->carried].loop == s->loop &&
           s->final >= g->loops[s->loop].end;
}

static bool begins_before_loop(const struct graph *g, uint32_t slot) {
    return g->slots[slot].initial < g->slots[slot].carried && !g->nodes[g->slots[slot].initial].loop;
}

static bool steps_within_loop(const struct graph *g, uint32_t slot) {
    const struct slot *s = &g->slots[slot];
    return s->next < g->loops[s->loop].end && may_read(g, s->loop, s->next);
}

static bool is_base_of_start(const struct graph *g, int index) {
    const struct symbol *s = index < (int)g->count ? expr_as_symbol(g, (expression)index) : NULL;
    return s && (s->kind == SYMBOL_COORDINATE || s->kind == SYMBOL_POINT || s->kind == SYMBOL_TIME);
}

static bool is_symbol_in_range(const struct graph *g, uint32_t index) {
    const struct symbol *s = &g->symbols[index];
    if (s->kind > SYMBOL_FINAL || s->index < 0 || s->order < 0 || s->order > 3)
        return false;
    if (s->kind == SYMBOL_START)
        return is_base_of_start(g, s->index);
    return (s->kind != SYMBOL_CARRIED && s->kind != SYMBOL_FINAL) || s->index < g->slot_count;
}

/* Symbols of slots are distinguished by their slots. */
static bool is_symbol_once(const struct graph *g, uint32_t index) {
    if (g->symbols[index].kind == SYMBOL_CARRIED || g->symbols[index].kind == SYMBOL_FINAL)
        return true;
    for (uint32_t i = 0; i < index; i++)
        if (!memcmp(&g->symbols[i], &g->symbols[index], sizeof *g->symbols))
            return false;
    return true;
}

static bool follows_remark_before(const struct graph *g, uint32_t index) {
    const struct remark *remark = &g->remarks[index];
    return remark->text && remark->from <= g->count && (!index || g->remarks[index - 1].from <= remark->from);
}

static bool holds_node(const struct graph *g, uint32_t place) {
    return g->table[place] < g->count;
}

static const struct promise of_places[] = {{"the table holds handles of nodes", holds_node}};
static const struct promise of_loops[] = {{"loops do not nest", follows_loop_before}};
static const struct promise of_slots[] = {
    {"a slot has a loop and its two symbols", has_symbols},
    {"a slot begins with a value from before its loop", begins_before_loop},
    {"a slot continues with a value of its loop", steps_within_loop},
};
static const struct promise of_symbols[] = {
    {"symbols have a known kind and a valid index", is_symbol_in_range},
    {"each symbol exists once", is_symbol_once},
};
static const struct promise of_remarks[] = {{"remarks ascend", follows_remark_before}};

/* ---- All rules ---- */

struct list {
    const char *entry;
    uint32_t count;
    const struct promise *promises;
    size_t promise_count;
};

static const char *violation_at(const struct graph *g, const char *entry, uint32_t index,
                                const char *promise) {
    struct text text = {.memory = g->memory};
    text_add(&text, "%s %u", entry, index);
    if (!strcmp(entry, "node") && is_known_operation(g, index)) {
        text_add(&text, " %s = ", g->names[index] ? g->names[index] : "");
        describe_definition(&text, g, index, NULL);
        text_add(&text, " of loop %d", g->nodes[index].loop);
    }
    text_add(&text, " breaks: %s", promise);
    return text.data;
}

#define LIST(entry, count, promises) \
    { entry, (uint32_t)(count), promises, sizeof promises / sizeof *promises }

const char *graph_violation(const struct graph *g) {
    const struct list lists[] = {
        LIST("symbol", g->symbol_count, of_symbols), LIST("node", g->count, of_nodes),
        LIST("loop", g->loop_count, of_loops),       LIST("slot", g->slot_count, of_slots),
        LIST("remark", g->remark_count, of_remarks), LIST("place", g->table_size, of_places),
    };
    if (g->open)
        return violation_at(g, "loop", g->open, "no loop is open between passes");
    for (size_t l = 0; l < sizeof lists / sizeof *lists; l++)
        for (uint32_t i = 0; i < lists[l].count; i++)
            for (size_t k = 0; k < lists[l].promise_count; k++)
                if (!lists[l].promises[k].holds(g, i))
                    return violation_at(g, lists[l].entry, i, lists[l].promises[k].text);
    return NULL;
}
