/*
 * The expression graph: every formula of a model is a node of it, and equal formulas are one node.
 *
 * The parts in order: nodes, loops and the graph; building expressions and loops; splines; queries, names
 * and operators; rewrites and derivatives; checks; expressions as text.
 */
#ifndef REFDYN_GEN_GRAPH_H
#define REFDYN_GEN_GRAPH_H

#include "gen/base/base.h"

#include <stdint.h>

/*
 * An `expression` is a 32-bit index into one growing array. Equal handles are equal expressions. The operands
 * of a node have smaller handles than the node, so that a plain loop over handles is an order of evaluation.
 *
 * Nodes do not change while the graph grows. After graph_close nothing is added. Only the planner then
 * changes nodes: it reorders summands (order_of_sums.c). Such a node has the same value, rounded differently.
 */
typedef uint32_t expression;
enum { EXPR_ZERO, EXPR_ONE }; /* the handles of the numbers 0 and 1 */

enum operation {
    OP_NUMBER,
    OP_SYMBOL,
    OP_SPLINE, /* of operand[0]; operand[1] is SPLINE_ORDERS * table + order of the derivative */
#define OP(name, arity, text, cost, value, da, db, dc) OP_##name,
#include "gen/graph/ops.def"
#undef OP
    OP_COUNT
};

enum cost { COST_NONE, COST_ADD, COST_MUL, COST_DIV, COST_FUNCTION };

/* What a symbol represents. `order` counts time derivatives: 0 value, 1 rate, 2 acceleration. */
struct symbol {
    enum symbol_kind {
        SYMBOL_PARAMETER,  /* index: parameter */
        SYMBOL_INPUT,      /* index: input */
        SYMBOL_TIME,       /* time t */
        SYMBOL_COORDINATE, /* index: coordinate, order 0..2: q, qd, qdd */
        SYMBOL_POINT,      /* index: 3 * point + axis, order 0..2, ground frame */
        SYMBOL_MULTIPLIER, /* index: row; lambda in the programme forces u^T lambda */
        SYMBOL_START, /* index: handle of a coordinate, point or time symbol; its value at a motion's start */
        SYMBOL_ELEMENT, /* index: frame of a run (tree.h), order 0..2: coordinate of the current element */
        SYMBOL_LAST,    /* index: run; 1 in its last element, 0 in the others */
        SYMBOL_CARRIED, /* index: slot; its value at the beginning of an iteration */
        SYMBOL_FINAL    /* index: slot; its value after the loop */
    } kind;
    int index, order;
};

/* The kinds of values on which an expression depends, as a set. */
enum depends {
    ON_PARAMETER = 1,
    ON_TIME = 2,
    ON_INPUT = 4,
    ON_STATE = 8,
    ON_RATE = 16,
    ON_START = 32,
    ON_GAIN = 64 /* gains of the stabilisation, which the runtime may replace */
};

struct node {
    uint8_t operation;
    uint8_t depends;
    uint16_t loop;         /* the loop that computes the node once an element; 0: computed once */
    expression operand[3]; /* OP_NUMBER: the bits of its value; OP_SYMBOL: an index into symbols, 0, 0 */
};

/*
 * A loop over the elements of a run. Its body consists of the nodes that are built between graph_open_loop
 * and graph_close_loop and depend on the element; all others are computed before the loop. Another loop over
 * the same run may use the body's values of the same element.
 */
struct element_loop {
    int run;
    bool inward;         /* the loop runs from the last element to the first */
    uint32_t begin, end; /* handles made while the loop was open */
};

/* A value that a loop carries from one iteration to the next. */
struct slot {
    uint16_t loop;
    expression initial, next;
    expression carried, final; /* symbols for its value at the beginning of an iteration and after the loop */
};

struct spline {
    int count;      /* number of pieces: the line before the first knot, then one from each knot on */
    double *pieces; /* (count x PIECE_COLUMNS) knot, c0 ... c3 */
};
enum { PIECE_COLUMNS = 5, SPLINE_ORDERS = 4 }; /* derivatives of order 0 to 3 */

enum { ANY_LOOP = 0xFFFF }; /* value of `loop` for a symbol that every loop over its run may read */

/* A line for the reader of the emitted C: describes the nodes from handle `from` on. */
struct remark {
    expression from;
    const char *text;
};

struct graph {
    struct memory *memory;
    struct remark *remarks; /* in ascending order */
    uint32_t remark_count;
    struct node *nodes;
    uint32_t count, capacity;
    struct symbol *symbols;
    uint32_t symbol_count;
    struct spline *splines;
    uint32_t spline_count;
    struct element_loop *loops; /* loops[0] represents "no loop" */
    struct slot *slots;
    int remark_capacity, symbol_capacity, spline_capacity; /* of the lists above */
    int loop_count, loop_capacity, slot_count, slot_capacity;
    uint16_t open;      /* the loop that is being built; 0: none */
    bool is_closed;     /* no more nodes may be added */
    const char **names; /* by handle: the name in the emitted C, or NULL */
    int *name_owners;   /* by handle: 1 + the coordinate whose frame the value is named after; 0: none */
    expression *table;  /* hash table of handles; its length is a power of two, 0 marks an empty place */
    uint32_t table_size;
};

void graph_start(struct graph *g, struct memory *memory);
/* A copy of g that grows independently of g: for trials. No loop may be open. */
struct graph graph_copy(const struct graph *g);
/* From now on only existing nodes may be requested. */
void graph_close(struct graph *g);

/* ---- Building expressions ---- */

/* Returns the handle of an equal node, or of a new one. Only folding.c and graph.c build nodes. */
expression graph_intern(struct graph *g, struct node node);
expression expr_number(struct graph *g, double value);
expression expr_symbol(struct graph *g, enum symbol_kind kind, int index, int order);
/* Exchanges symbols of one kind and order in all expressions, also in those that the author's functions keep:
 * first + i becomes first + to[i], for i < count. */
void graph_exchange_symbols(struct graph *g, enum symbol_kind kind, int order, int first, const int *to,
                            int count);
expression expr_add(struct graph *g, expression a, expression b);
expression expr_sub(struct graph *g, expression a, expression b);
expression expr_mul(struct graph *g, expression a, expression b);
expression expr_div(struct graph *g, expression a, expression b);
expression expr_neg(struct graph *g, expression a);
/* a^b; whole exponents up to 16 become products. */
expression expr_power(struct graph *g, expression a, expression b);
expression expr_sqrt(struct graph *g, expression a);
/* condition != 0 ? then : otherwise */
expression expr_where(struct graph *g, expression condition, expression then, expression otherwise);
/* Any operator of ops.def, folded; operands beyond its arity are ignored. */
expression expr_apply(struct graph *g, enum operation operation, expression a, expression b, expression c);
expression expr_apply1(struct graph *g, enum operation operation, expression a);
expression expr_apply2(struct graph *g, enum operation operation, expression a, expression b);

/* ---- Building loops ---- */

/* Loops do not nest. */
uint16_t graph_open_loop(struct graph *g, int run, bool inward);
void graph_close_loop(struct graph *g);
/* A new slot of the open loop. Set `next` before closing the loop, which then makes `final`. */
int graph_new_slot(struct graph *g, expression initial);
void graph_set_next(struct graph *g, int slot, expression next);
/* The slot of a symbol of kind CARRIED or FINAL; NULL for any other expression. */
const struct slot *graph_as_slot(const struct graph *g, expression e);

/* ---- Splines: cubic and natural, straight beyond the ends ---- */

/* A spline through samples; the knots must ascend; count >= 2. */
struct spline spline_through(struct memory *memory, const double *knots, const double *values, int count);
double spline_value(const struct spline *spline, double at, int order);
/* The same as an entry of the graph; returns its number. */
int graph_add_spline(struct graph *g, const double *knots, const double *values, int count);
expression expr_spline(struct graph *g, int table, expression at);
/* The derivative of a spline node with respect to its operand. */
expression expr_spline_derivative(struct graph *g, expression e);

/* ---- Queries, names and remarks ---- */

/* Returns the handle of an equal node; 0: there is none. */
expression graph_find_node(const struct graph *g, const struct node *node);
bool expr_is_number(const struct graph *g, expression e, double *value);  /* value may be NULL */
const struct symbol *expr_as_symbol(const struct graph *g, expression e); /* NULL if e is not a symbol */
/* A value keeps the first name that it receives. `text` must live as long as the graph. */
void graph_name_value(struct graph *g, expression e, const char *text);
/* Names a value "OWNER_WHAT", or "shared_WHAT" if it already has another owner: a value that several bodies,
 * links or rows share has the name of no owner. */
void graph_name_shared(struct graph *g, expression e, const char *owner, const char *what);
/* Starts a section of the graph with a remark. `text` must live as long as the graph. */
void graph_remark(struct graph *g, const char *text);
/* The section that contains e: the last remark before it, or NULL. */
const char *graph_remark_of(const struct graph *g, expression e);

int operation_arity(enum operation operation);
bool operation_is_gain(enum operation operation); /* RATE_GAIN or POSITION_GAIN */
const char *operation_text(enum operation operation);
enum cost operation_cost(enum operation operation);
double operation_value(enum operation operation, double a, double b, double c);
/* The value of node e from the values of its operands; not for symbols. */
double graph_node_value(const struct graph *g, expression e, const double *values);
/* The operator of e applied to other operands. */
expression expr_rebuild(struct graph *g, expression e, const expression operands[3]);

/* ---- Rewrites and derivatives ---- */

/* Substitution: `leaf` returns the replacement of symbol e (e itself to keep it), and all expressions above
 * are built again. */
typedef expression leaf_rule(void *context, struct graph *g, expression e);
void rewrite_substitute(struct graph *g, leaf_rule *leaf, void *context, const expression *from,
                        expression *to, int count);
/* Builds e with one node replaced. */
expression rewrite_replace(struct graph *g, expression e, expression node, expression by);
/* Directional derivative, by one forward sweep: `leaf` returns the derivative of symbol e. */
expression rewrite_derivative(struct graph *g, expression e, leaf_rule *leaf, void *context);
/* Directional derivatives of several expressions in several directions, by one sweep. `leaf` is called with
 * one context for each direction; `to` has `count` entries for each. Derivatives of values in loops go into
 * new loops over the same runs, so that no loop may be open. The operand of OP_HOLD counts as constant. */
void rewrite_derivatives(struct graph *g, const expression *from, expression *to, int count, leaf_rule *leaf,
                         void *const *contexts, int directions);
/* Derivatives of e with respect to each symbol in `by`, by one backward sweep. The derivative with respect
 * to handle 0 is 0. */
void rewrite_gradient(struct graph *g, expression e, const expression *by, expression *result, int count);
/* Marks, by handle, all direct and indirect operands of the marked nodes below `limit`, including the
 * values that loops carry. */
void rewrite_mark_operands(const struct graph *g, bool *needed, uint32_t limit);
/* The symbols on which e depends, in order of handles. */
expression *rewrite_list_symbols(struct graph *g, expression e, int *count);
/* The value of e. `value_of` returns the value of a symbol; for SYMBOL_START it receives the base symbol. For
 * single values, as in checks; the interpreter evaluates whole functions from a plan. */
double rewrite_evaluate(struct graph *g, expression e,
                        double (*value_of)(void *context, const struct symbol *s), void *context);

/* The first rule of this header that the graph breaks, with the offending entry; NULL if it keeps all. No
 * loop may be open. */
const char *graph_violation(const struct graph *g);

/* ---- Expressions as text ---- */

/* The name of an operator in ops.def. */
const char *operation_name(enum operation operation);
/* The text for e where it is read, in the notation of describe.c: marked nodes as name and handle, all others
 * spelled out. `is_marked` is by handle; NULL: all are marked. */
void describe_value(struct text *text, const struct graph *g, expression e, const bool *is_marked);
/* The text of e's operator with its operands. */
void describe_definition(struct text *text, const struct graph *g, expression e, const bool *is_marked);

#endif
