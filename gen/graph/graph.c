/* The expression graph: hash-consing and exact folding. See graph.h; operators come from ops.def. */
#include "graph/graph.h"
#include "base/memory.h"
#include "graph/spline.h"

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
#include "graph/ops.def"
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
#include "graph/ops.def"
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
    g->capacity = capacity;
}

/* What depends on the element of a run belongs to the loop that is open. */
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

/* The handle of an equal node, or a new one. */
static expression intern(struct graph *g, struct node node) {
    memory_work(g->memory, 1);
    if (4 * g->count >= 3 * g->table_size)
        grow_table(g);
    uint32_t slot = hash_node(&node) & (g->table_size - 1);
    for (; g->table[slot]; slot = (slot + 1) & (g->table_size - 1))
        if (same_node(&g->nodes[g->table[slot]], &node))
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
    /* The number 0 is handle 0; it stands in no slot of the table, where 0 means empty. */
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
    copy.table =
        memory_grow(g->memory, g->table, g->table_size * sizeof *g->table, g->table_size * sizeof *g->table);
    /* Lists without room move before they grow. */
    copy.capacity = g->count;
    copy.symbol_capacity = g->symbol_count;
    copy.remark_capacity = g->remark_count;
    copy.spline_capacity = g->spline_count;
    copy.loop_capacity = g->loop_count;
    copy.slot_capacity = g->slot_count;
    return copy;
}

expression expr_number(struct graph *g, double value) {
    if (value == 0)
        return 0; /* -0.0 too: the sign of a zero is not kept */
    struct node node = {.operation = OP_NUMBER};
    memcpy(node.operand, &value, sizeof value);
    return intern(g, node);
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
        return ON_STATE; /* of the loop: never moved out of it */
    case SYMBOL_ELEMENT:
        return s->order ? ON_RATE : ON_STATE;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        return ON_STATE | ON_RATE;
    }
    return 0;
}

expression expr_symbol(struct graph *g, enum symbol_kind kind, int index, int order) {
    const bool is_new = (kind == SYMBOL_CARRIED || kind == SYMBOL_FINAL); /* made once, with their slot */
    uint32_t i = is_new ? g->symbol_count : 0;
    while (i < g->symbol_count &&
           !(g->symbols[i].kind == kind && g->symbols[i].index == index && g->symbols[i].order == order))
        i++;
    if (i == g->symbol_count) {
        if (g->symbol_count == g->symbol_capacity) {
            uint32_t capacity = g->symbol_capacity ? 2 * g->symbol_capacity : 64;
            g->symbols = memory_grow(g->memory, g->symbols, g->symbol_count * sizeof *g->symbols,
                                     capacity * sizeof *g->symbols);
            g->symbol_capacity = capacity;
        }
        g->symbols[g->symbol_count++] = (struct symbol){kind, index, order};
    }
    return intern(
        g, (struct node){.operation = OP_SYMBOL, .depends = symbol_depends(&g->symbols[i]), .operand = {i}});
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

void graph_remark(struct graph *g, const char *text) {
    if (g->remark_count == g->remark_capacity) {
        uint32_t capacity = g->remark_capacity ? 2 * g->remark_capacity : 64;
        g->remarks = memory_grow(g->memory, g->remarks, g->remark_count * sizeof *g->remarks,
                                 capacity * sizeof *g->remarks);
        g->remark_capacity = capacity;
    }
    g->remarks[g->remark_count++] = (struct remark){g->count, text};
}

bool operation_is_gain(enum operation operation) {
    return operation == OP_RATE_GAIN || operation == OP_POSITION_GAIN;
}

static expression raw(struct graph *g, enum operation operation, expression a, expression b, expression c) {
    uint8_t depends = g->nodes[a].depends;
    if (operators[operation].arity > 1)
        depends |= g->nodes[b].depends;
    if (operators[operation].arity > 2)
        depends |= g->nodes[c].depends;
    if (operation_is_gain(operation))
        depends |= ON_GAIN;
    return intern(g,
                  (struct node){.operation = (uint8_t)operation, .depends = depends, .operand = {a, b, c}});
}

static bool is_negated(const struct graph *g, expression e) {
    return g->nodes[e].operation == OP_NEG;
}

/* x of a node -x. */
static expression inside(const struct graph *g, expression e) {
    return g->nodes[e].operand[0];
}

/* A node -x or a negative number: its sign can move. */
static bool is_negative(const struct graph *g, expression e) {
    double x;
    return expr_is_number(g, e, &x) ? x < 0 : is_negated(g, e);
}

static bool both_numbers(const struct graph *g, expression a, expression b, double *x, double *y) {
    return expr_is_number(g, a, x) && expr_is_number(g, b, y);
}

expression expr_neg(struct graph *g, expression a) {
    double x;
    if (expr_is_number(g, a, &x))
        return expr_number(g, -x);
    if (is_negated(g, a))
        return inside(g, a);
    if (g->nodes[a].operation == OP_SUB)
        return expr_sub(g, g->nodes[a].operand[1], g->nodes[a].operand[0]);
    return raw(g, OP_NEG, a, 0, 0);
}

expression expr_add(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x + y);
    if (a == 0)
        return b;
    if (b == 0)
        return a;
    if (is_negative(g, b))
        return expr_sub(g, a, expr_neg(g, b));
    if (is_negative(g, a))
        return expr_sub(g, b, expr_neg(g, a));
    return a < b ? raw(g, OP_ADD, a, b, 0) : raw(g, OP_ADD, b, a, 0);
}

expression expr_sub(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x - y);
    if (a == b)
        return 0; /* assumes a finite value */
    if (b == 0)
        return a;
    if (a == 0)
        return expr_neg(g, b);
    if (is_negative(g, b))
        return expr_add(g, a, expr_neg(g, b));
    if (is_negative(g, a))
        return expr_neg(g, expr_add(g, expr_neg(g, a), b));
    return raw(g, OP_SUB, a, b, 0);
}

/* The sign of a factor moves in front of the product: |a| and whether it was negative. */
static bool take_sign(struct graph *g, expression *a) {
    bool negative = is_negative(g, *a);
    if (negative)
        *a = expr_neg(g, *a);
    return negative;
}

expression expr_mul(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x * y);
    if (a == 0 || b == 0)
        return 0; /* assumes a finite value */
    bool negative = take_sign(g, &a);
    negative ^= take_sign(g, &b);
    expression product = a == 1 ? b : b == 1 ? a : a < b ? raw(g, OP_MUL, a, b, 0) : raw(g, OP_MUL, b, a, 0);
    return negative ? expr_neg(g, product) : product;
}

expression expr_div(struct graph *g, expression a, expression b) {
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, x / y);
    if (a == 0 && b != 0)
        return 0; /* assumes a divisor that is not zero */
    bool negative = take_sign(g, &a);
    negative ^= take_sign(g, &b);
    expression result = b == 1 ? a : a == b ? 1 : raw(g, OP_DIV, a, b, 0);
    return negative ? expr_neg(g, result) : result;
}

static expression whole_power(struct graph *g, expression a, int exponent) {
    if (exponent == 0)
        return 1;
    if (exponent == 1)
        return a;
    expression half = whole_power(g, a, exponent / 2);
    expression square = expr_mul(g, half, half);
    return exponent % 2 ? expr_mul(g, square, a) : square;
}

expression expr_power(struct graph *g, expression a, expression b) {
    enum { LARGEST = 16 };
    double x, y;
    if (both_numbers(g, a, b, &x, &y))
        return expr_number(g, pow(x, y));
    if (expr_is_number(g, b, &y) && y == floor(y) && fabs(y) <= LARGEST) {
        expression p = whole_power(g, a, (int)fabs(y));
        return y < 0 ? expr_div(g, 1, p) : p;
    }
    if (expr_is_number(g, b, &y) && y == 0.5)
        return expr_sqrt(g, a);
    return raw(g, OP_POW, a, b, 0);
}

expression expr_sqrt(struct graph *g, expression a) {
    return expr_apply1(g, OP_SQRT, a);
}

expression expr_where(struct graph *g, expression condition, expression then, expression otherwise) {
    double x;
    if (expr_is_number(g, condition, &x))
        return x != 0 ? then : otherwise;
    return then == otherwise ? then : raw(g, OP_WHERE, condition, then, otherwise);
}

/* Functions that are odd or even in their only operand lose its sign. */
static bool fold_parity(struct graph *g, enum operation operation, expression a, expression *result) {
    if (!is_negated(g, a))
        return false;
    switch (operation) {
    case OP_SIN:
    case OP_TAN:
    case OP_ASIN:
    case OP_ATAN:
    case OP_SINH:
    case OP_TANH:
    case OP_HOLD:
        *result = expr_neg(g, expr_apply1(g, operation, inside(g, a)));
        return true;
    case OP_COS:
    case OP_COSH:
    case OP_ABS:
        *result = expr_apply1(g, operation, inside(g, a));
        return true;
    default:
        return false;
    }
}

/* Any function without algebra of its own: numbers are computed, equal operands of min, max and < are folded.
 */
static expression apply_function(struct graph *g, enum operation operation, expression a, expression b) {
    int arity = operators[operation].arity;
    double x = 0, y = 0;
    expression result;
    if (operation_is_gain(operation))
        return raw(g, operation, a, 0, 0);
    if (expr_is_number(g, a, &x) && (arity < 2 || expr_is_number(g, b, &y)))
        return expr_number(g, operation_value(operation, x, y, 0));
    if (a == b && (operation == OP_MIN || operation == OP_MAX))
        return a;
    if (a == b && operation == OP_LESS)
        return 0;
    if (fold_parity(g, operation, a, &result))
        return result;
    return raw(g, operation, a, arity > 1 ? b : 0, 0);
}

expression expr_apply(struct graph *g, enum operation operation, expression a, expression b, expression c) {
    switch (operation) {
    case OP_ADD:
        return expr_add(g, a, b);
    case OP_SUB:
        return expr_sub(g, a, b);
    case OP_MUL:
        return expr_mul(g, a, b);
    case OP_DIV:
        return expr_div(g, a, b);
    case OP_NEG:
        return expr_neg(g, a);
    case OP_POW:
        return expr_power(g, a, b);
    case OP_WHERE:
        return expr_where(g, a, b, c);
    default:
        return apply_function(g, operation, a, b);
    }
}

expression expr_apply1(struct graph *g, enum operation operation, expression a) {
    return expr_apply(g, operation, a, 0, 0);
}

expression expr_apply2(struct graph *g, enum operation operation, expression a, expression b) {
    return expr_apply(g, operation, a, b, 0);
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
    g->loops[loop].end = g->count;
    g->open = 0;
    for (int s = g->slot_count; s-- > 0 && g->slots[s].loop == loop;)
        g->slots[s].final = expr_symbol(g, SYMBOL_FINAL, s, 0);
}

int graph_new_slot(struct graph *g, expression initial) {
    g->slots = memory_room(g->memory, g->slots, g->slot_count, &g->slot_capacity, sizeof *g->slots);
    const int slot = g->slot_count++;
    g->slots[slot] = (struct slot){g->open, initial, initial, 0, 0};
    g->slots[slot].carried = expr_symbol(g, SYMBOL_CARRIED, slot, 0);
    return slot;
}

void graph_set_next(struct graph *g, int slot, expression next) {
    g->slots[slot].next = next;
}

const struct slot *graph_as_slot(const struct graph *g, expression e) {
    const struct symbol *s = expr_as_symbol(g, e);
    return s && (s->kind == SYMBOL_CARRIED || s->kind == SYMBOL_FINAL) ? &g->slots[s->index] : NULL;
}

int graph_add_spline(struct graph *g, const double *knots, const double *values, int count) {
    if (g->spline_count == g->spline_capacity) {
        uint32_t capacity = g->spline_capacity ? 2 * g->spline_capacity : 4;
        g->splines = memory_grow(g->memory, g->splines, g->spline_count * sizeof *g->splines,
                                 capacity * sizeof *g->splines);
        g->spline_capacity = capacity;
    }
    g->splines[g->spline_count] = spline_through(g->memory, knots, values, count);
    return (int)g->spline_count++;
}

static expression spline_node(struct graph *g, uint32_t code, expression at) {
    double x;
    if (expr_is_number(g, at, &x))
        return expr_number(g,
                           spline_value(&g->splines[code / SPLINE_ORDERS], x, (int)(code % SPLINE_ORDERS)));
    return intern(
        g, (struct node){.operation = OP_SPLINE, .depends = g->nodes[at].depends, .operand = {at, code}});
}

expression expr_spline(struct graph *g, int table, expression at) {
    return spline_node(g, SPLINE_ORDERS * (uint32_t)table, at);
}

expression expr_spline_derivative(struct graph *g, expression e) {
    const struct node node = g->nodes[e];
    const uint32_t code = node.operand[1];
    return code % SPLINE_ORDERS == SPLINE_ORDERS - 1 ? expr_zero(g)
                                                     : spline_node(g, code + 1, node.operand[0]);
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

expression expr_rebuild(struct graph *g, expression e, const expression operands[3]) {
    const struct node node = g->nodes[e];
    if (node.operation == OP_SPLINE)
        return spline_node(g, node.operand[1], operands[0]);
    return expr_apply(g, node.operation, operands[0], operands[1], operands[2]);
}
