/*
 * The expression graph: nodes and their hash table, symbols, loops with their slots, names and remarks.
 *
 * ops.def has the operators; folding.c builds expressions from them.
 */
#include "gen/graph/graph.h"
#include "gen/base/base.h"

#include <assert.h>
#include <math.h>
#include <string.h>

struct operator_entry {
    const char *text;
    int arity;
    enum cost cost;
};

static const struct operator_entry operators[OP_COUNT] = {
    [OP_NUMBER] = {"", 0, COST_NONE},
    [OP_SYMBOL] = {"", 0, COST_NONE},
    [OP_SPLINE] = {"spline", 1, COST_FUNCTION},
#define OP(name, arity, text, cost, value, da, db, dc) [OP_##name] = {text, arity, cost},
#include "gen/graph/ops.def"
#undef OP
};

int operation_arity(enum operation operation) {
    return operators[operation].arity;
}

const char *operation_text(enum operation operation) {
    return operators[operation].text;
}

enum cost operation_cost(enum operation operation) {
    return operators[operation].cost;
}

double operation_value(enum operation operation, double a, double b, double c) {
    switch (operation) {
#define OP(name, arity, text, cost, value, da, db, dc) \
    case OP_##name:                                    \
        return value;
#include "gen/graph/ops.def"
#undef OP
    default:
        return NAN;
    }
}

static uint32_t hash_node(const struct node *node) {
    uint64_t h = node->operation;
    for (int i = 0; i < 3; i++)
        h = (h ^ node->operand[i]) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
    return (uint32_t)(h ^ h >> 32);
}

static bool same_node(const struct node *a, const struct node *b) {
    return a->operation == b->operation && !memcmp(a->operand, b->operand, sizeof a->operand);
}

static void grow_table(struct graph *g) {
    uint32_t size = g->table_size ? 2 * g->table_size : 1024;
    g->table = memory_get(g->memory, size * sizeof *g->table);
    g->table_size = size;
    for (expression e = 1; e < g->count; e++) {
        uint32_t slot = hash_node(&g->nodes[e]) & (size - 1);
        while (g->table[slot])
            slot = (slot + 1) & (size - 1);
        g->table[slot] = e;
    }
}

static void grow_nodes(struct graph *g) {
    uint32_t capacity = g->capacity ? 2 * g->capacity : 512;
    g->nodes = memory_grow(g->memory, g->nodes, g->count * sizeof *g->nodes, capacity * sizeof *g->nodes);
    g->names = memory_grow(g->memory, g->names, g->count * sizeof *g->names, capacity * sizeof *g->names);
    g->name_owners = memory_grow(g->memory, g->name_owners, g->count * sizeof *g->name_owners,
                                 capacity * sizeof *g->name_owners);
    g->capacity = capacity;
}

/* A node that depends on the element of a run belongs to the loop that is open. */
static uint16_t loop_of(const struct graph *g, const struct node *node) {
    if (node->operation == OP_SYMBOL) {
        const struct symbol *s = &g->symbols[node->operand[0]];
        return s->kind == SYMBOL_ELEMENT || s->kind == SYMBOL_LAST ? (uint16_t)ANY_LOOP
               : s->kind == SYMBOL_CARRIED                         ? g->slots[s->index].loop
                                                                   : 0;
    }
    for (int k = 0; k < operators[node->operation].arity; k++)
        if (g->nodes[node->operand[k]].loop) {
            assert(g->open);
            return g->open;
        }
    return 0;
}

/* The place in the table of an equal node, or the empty place where the node belongs. */
static uint32_t slot_of_node(const struct graph *g, const struct node *node) {
    uint32_t slot = hash_node(node) & (g->table_size - 1);
    while (g->table[slot] && !same_node(&g->nodes[g->table[slot]], node))
        slot = (slot + 1) & (g->table_size - 1);
    return slot;
}

expression graph_find_node(const struct graph *g, const struct node *node) {
    return g->table[slot_of_node(g, node)];
}

expression graph_intern(struct graph *g, struct node node) {
    memory_work(g->memory, 1);
    if (4 * g->count >= 3 * g->table_size)
        grow_table(g);
    const uint32_t slot = slot_of_node(g, &node);
    if (g->table[slot])
        return g->table[slot];
    assert(!g->is_closed);
    if (g->count == g->capacity)
        grow_nodes(g);
    node.loop = loop_of(g, &node);
    g->nodes[g->count] = node;
    g->table[slot] = g->count;
    return g->count++;
}

void graph_start(struct graph *g, struct memory *memory) {
    memset(g, 0, sizeof *g);
    g->memory = memory;
    grow_table(g);
    grow_nodes(g);
    /* The number 0 has handle 0. It is not in the table, where 0 marks an empty place. */
    g->nodes[g->count++] = (struct node){.operation = OP_NUMBER};
    expr_number(g, 1);
}

void graph_close(struct graph *g) {
    g->is_closed = true;
}

struct graph graph_copy(const struct graph *g) {
    struct graph copy = *g;
    copy.names =
        memory_grow(g->memory, g->names, g->count * sizeof *g->names, g->capacity * sizeof *g->names);
    copy.name_owners = memory_grow(g->memory, g->name_owners, g->count * sizeof *g->name_owners,
                                   g->capacity * sizeof *g->name_owners);
    copy.table =
        memory_grow(g->memory, g->table, g->table_size * sizeof *g->table, g->table_size * sizeof *g->table);
    /* Lists at full capacity are copied before they grow. */
    copy.capacity = g->count;
    copy.symbol_capacity = (int)g->symbol_count;
    copy.remark_capacity = (int)g->remark_count;
    copy.spline_capacity = (int)g->spline_count;
    copy.loop_capacity = g->loop_count;
    copy.slot_capacity = g->slot_count;
    return copy;
}

_Static_assert(sizeof(double) == 2 * sizeof(expression), "the bits of a number are two operands");

expression expr_number(struct graph *g, double value) {
    if (value == 0)
        return 0; /* also -0.0: the graph does not keep the sign of a zero */
    struct node node = {.operation = OP_NUMBER};
    memcpy(node.operand, &value, sizeof value);
    return graph_intern(g, node);
}

static uint8_t symbol_depends(const struct symbol *s) {
    switch (s->kind) {
    case SYMBOL_PARAMETER:
        return ON_PARAMETER;
    case SYMBOL_INPUT:
        return ON_INPUT;
    case SYMBOL_TIME:
        return ON_TIME;
    case SYMBOL_START:
        return ON_START;
    case SYMBOL_COORDINATE:
        return s->order ? ON_RATE : ON_STATE;
    case SYMBOL_MULTIPLIER:
        return ON_STATE | ON_RATE;
    case SYMBOL_POINT:
        return s->order ? ON_STATE | ON_RATE : ON_STATE;
    case SYMBOL_LAST:
        return ON_STATE; /* the value belongs to the loop and never moves out of it */
    case SYMBOL_ELEMENT:
        return s->order ? ON_RATE : ON_STATE;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        return ON_STATE | ON_RATE;
    }
    return 0;
}

expression expr_symbol(struct graph *g, enum symbol_kind kind, int index, int order) {
    const bool is_new = (kind == SYMBOL_CARRIED || kind == SYMBOL_FINAL); /* each slot makes its own once */
    uint32_t i = is_new ? g->symbol_count : 0;
    while (i < g->symbol_count &&
           !(g->symbols[i].kind == kind && g->symbols[i].index == index && g->symbols[i].order == order))
        i++;
    if (i == g->symbol_count) {
        g->symbols =
            memory_room(g->memory, g->symbols, (int)g->symbol_count, &g->symbol_capacity, sizeof *g->symbols);
        g->symbols[g->symbol_count++] = (struct symbol){kind, index, order};
    }
    return graph_intern(
        g, (struct node){.operation = OP_SYMBOL, .depends = symbol_depends(&g->symbols[i]), .operand = {i}});
}

void graph_exchange_symbols(struct graph *g, enum symbol_kind kind, int order, int first, const int *to,
                            int count) {
    for (uint32_t i = 0; i < g->symbol_count; i++) {
        struct symbol *symbol = &g->symbols[i];
        const int place = symbol->index - first;
        if (symbol->kind == kind && symbol->order == order && place >= 0 && place < count)
            symbol->index = first + to[place];
    }
}

bool expr_is_number(const struct graph *g, expression e, double *value) {
    if (g->nodes[e].operation != OP_NUMBER)
        return false;
    if (value)
        memcpy(value, g->nodes[e].operand, sizeof *value);
    return true;
}

const struct symbol *expr_as_symbol(const struct graph *g, expression e) {
    return g->nodes[e].operation == OP_SYMBOL ? &g->symbols[g->nodes[e].operand[0]] : NULL;
}

void graph_name_value(struct graph *g, expression e, const char *text) {
    if (operators[g->nodes[e].operation].arity && !g->names[e])
        g->names[e] = text;
}

void graph_name_shared(struct graph *g, expression e, const char *owner, const char *what) {
    const char *name = memory_format(g->memory, "%s_%s", owner, what);
    if (g->names[e] && strcmp(g->names[e], name))
        g->names[e] = memory_format(g->memory, "shared_%s", what);
    graph_name_value(g, e, name);
}

void graph_remark(struct graph *g, const char *text) {
    g->remarks =
        memory_room(g->memory, g->remarks, (int)g->remark_count, &g->remark_capacity, sizeof *g->remarks);
    g->remarks[g->remark_count++] = (struct remark){g->count, text};
}

const char *graph_remark_of(const struct graph *g, expression e) {
    uint32_t low = 0, high = g->remark_count;
    while (low < high) {
        const uint32_t middle = (low + high) / 2;
        if (g->remarks[middle].from <= e)
            low = middle + 1;
        else
            high = middle;
    }
    return low ? g->remarks[low - 1].text : NULL;
}

bool operation_is_gain(enum operation operation) {
    return operation == OP_RATE_GAIN || operation == OP_POSITION_GAIN;
}

uint16_t graph_open_loop(struct graph *g, int run, bool inward) {
    assert(!g->open);
    if (!g->loop_count)
        g->loop_count = 1;
    g->loops = memory_room(g->memory, g->loops, g->loop_count, &g->loop_capacity, sizeof *g->loops);
    g->loops[g->loop_count] = (struct element_loop){run, inward, g->count, g->count};
    return g->open = (uint16_t)g->loop_count++;
}

void graph_close_loop(struct graph *g) {
    const uint16_t loop = g->open;
    assert(loop);
    g->loops[loop].end = g->count;
    g->open = 0;
    for (int s = g->slot_count; s-- > 0 && g->slots[s].loop == loop;)
        g->slots[s].final = expr_symbol(g, SYMBOL_FINAL, s, 0);
}

int graph_new_slot(struct graph *g, expression initial) {
    assert(g->open && !g->nodes[initial].loop);
    g->slots = memory_room(g->memory, g->slots, g->slot_count, &g->slot_capacity, sizeof *g->slots);
    const int slot = g->slot_count++;
    g->slots[slot] = (struct slot){g->open, initial, initial, 0, 0};
    g->slots[slot].carried = expr_symbol(g, SYMBOL_CARRIED, slot, 0);
    return slot;
}

void graph_set_next(struct graph *g, int slot, expression next) {
    assert(g->open && g->slots[slot].loop == g->open);
    g->slots[slot].next = next;
}

const struct slot *graph_as_slot(const struct graph *g, expression e) {
    const struct symbol *s = expr_as_symbol(g, e);
    return s && (s->kind == SYMBOL_CARRIED || s->kind == SYMBOL_FINAL) ? &g->slots[s->index] : NULL;
}

/* ---- Splines ---- */

/*
 * Cubic splines through samples, as an operator of the graph.
 *
 * Input: knots and values. Result: pieces y = c0 + h (c1 + h (c2 + h c3)), h = x - knot, twice continuously
 * differentiable (natural spline: no curvature at the ends; de Boor, A Practical Guide to Splines, 1978, ch.
 * IV). Beyond the ends the spline continues as a straight line, which keeps both derivatives continuous.
 */

/* Second derivatives at the knots, from the tridiagonal system of a natural spline: zero at both ends. */
static double *knot_curvatures(struct memory *memory, const double *x, const double *y, int count) {
    double *curvature = memory_get(memory, (size_t)count * sizeof *curvature);
    double *factor = memory_get(memory, (size_t)count * sizeof *factor);
    for (int i = 1; i < count - 1; i++) {
        const double before = x[i] - x[i - 1], after = x[i + 1] - x[i];
        const double bend = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
        const double pivot = 2 * (before + after) - before * factor[i - 1];
        factor[i] = after / pivot;
        curvature[i] = (6 * bend - before * curvature[i - 1]) / pivot;
    }
    for (int i = count - 2; i > 0; i--)
        curvature[i] -= factor[i] * curvature[i + 1];
    return curvature;
}

static void set_piece(double *piece, double knot, double c0, double c1, double c2, double c3) {
    piece[0] = knot, piece[1] = c0, piece[2] = c1, piece[3] = c2, piece[4] = c3;
}

struct spline spline_through(struct memory *memory, const double *x, const double *y, int count) {
    struct spline spline = {count + 1,
                            memory_get(memory, (size_t)(count + 1) * PIECE_COLUMNS * sizeof(double))};
    const double *curvature = knot_curvatures(memory, x, y, count);
    for (int i = 0; i < count - 1; i++) {
        const double h = x[i + 1] - x[i];
        const double slope = (y[i + 1] - y[i]) / h - h * (2 * curvature[i] + curvature[i + 1]) / 6;
        set_piece(spline.pieces + PIECE_COLUMNS * (i + 1), x[i], y[i], slope, curvature[i] / 2,
                  (curvature[i + 1] - curvature[i]) / (6 * h));
    }
    const double *last = spline.pieces + PIECE_COLUMNS * (count - 1);
    const double h = x[count - 1] - x[count - 2];
    set_piece(spline.pieces, x[0], y[0], spline.pieces[PIECE_COLUMNS + 2], 0, 0);
    set_piece(spline.pieces + PIECE_COLUMNS * count, x[count - 1], y[count - 1],
              last[2] + h * (2 * last[3] + 3 * h * last[4]), 0, 0);
    return spline;
}

double spline_value(const struct spline *spline, double at, int order) {
    int low = 0, high = spline->count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (spline->pieces[PIECE_COLUMNS * middle] <= at)
            low = middle;
        else
            high = middle;
    }
    const double *c = spline->pieces + PIECE_COLUMNS * low + 1, h = at - c[-1];
    switch (order) {
    case 0:
        return c[0] + h * (c[1] + h * (c[2] + h * c[3]));
    case 1:
        return c[1] + h * (2 * c[2] + h * (3 * c[3]));
    case 2:
        return 2 * c[2] + h * (6 * c[3]);
    default:
        return 6 * c[3];
    }
}

int graph_add_spline(struct graph *g, const double *knots, const double *values, int count) {
    g->splines =
        memory_room(g->memory, g->splines, (int)g->spline_count, &g->spline_capacity, sizeof *g->splines);
    g->splines[g->spline_count] = spline_through(g->memory, knots, values, count);
    return (int)g->spline_count++;
}

double graph_node_value(const struct graph *g, expression e, const double *values) {
    const struct node *node = &g->nodes[e];
    const expression *operand = node->operand;
    double value;
    if (expr_is_number(g, e, &value))
        return value;
    if (node->operation == OP_SPLINE)
        return spline_value(&g->splines[operand[1] / SPLINE_ORDERS], values[operand[0]],
                            (int)(operand[1] % SPLINE_ORDERS));
    return operation_value(node->operation, values[operand[0]], values[operand[1]], values[operand[2]]);
}
