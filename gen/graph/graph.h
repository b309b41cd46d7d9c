/* Expressions as a graph. */
#ifndef REFDYN_GEN_GRAPH_H
#define REFDYN_GEN_GRAPH_H

#include <stdbool.h>
#include <stdint.h>

#include "gen/base/base.h"

/*
 * The expression graph: every formula of a model, hash-consed.
 *
 * An `expression` is a 32-bit index into one growing array; equal handles are equal expressions, and the
 * operands of a node have smaller indices than the node, so that a plain loop over indices is an order of
 * evaluation. Handle 0 is the number 0, handle 1 the number 1. Building folds what is exactly safe: 0 and 1,
 * signs, numbers on both sides; x*0 -> 0 and x-x -> 0 assume that x is finite.
 *
 * Nodes do not change while the graph grows. Once it is closed nothing is added, and the planner alone puts
 * summands into another order (order_of_sums.c): a node then still stands for the same value, rounded
 * otherwise.
 */

struct memory;

typedef uint32_t expression;

enum operation {
    OP_NUMBER,
    OP_SYMBOL,
    OP_SPLINE, /* of operand[0]; operand[1] is SPLINE_ORDERS times the table plus the order of the derivative
                */
#define OP(name, arity, text, cost, value, da, db, dc) OP_##name,
#include "gen/graph/ops.def"
#undef OP
    OP_COUNT
};

enum cost { COST_NONE, COST_ADD, COST_MUL, COST_DIV, COST_FUNCTION };

/* What a symbol stands for. `order` counts time derivatives: 0 value, 1 rate, 2 acceleration. */
enum symbol_kind {
    SYMBOL_PARAMETER,  /* index: parameter */
    SYMBOL_INPUT,      /* index: input */
    SYMBOL_TIME,       /* t */
    SYMBOL_COORDINATE, /* index: coordinate, order 0..2: q, qd, qdd */
    SYMBOL_POINT,      /* index: 3 * point + axis, order 0..2, ground frame */
    SYMBOL_MULTIPLIER, /* index: row; of programme forces u^T lambda */
    SYMBOL_START, /* index: handle of a coordinate, point or time symbol, taken at the start of the motion */
    SYMBOL_ELEMENT, /* index: frame of a run (tree.h), order 0..2: the same of the element that a loop is at
                     */
    SYMBOL_LAST,    /* index: run; 1 in its last element, 0 in the others */
    SYMBOL_CARRIED, /* index: slot; its value when an iteration begins */
    SYMBOL_FINAL    /* index: slot; its value behind the loop */
};

struct symbol {
    enum symbol_kind kind;
    int index;
    int order;
};

/* What an expression depends on, as a set. */
enum depends {
    ON_PARAMETER = 1,
    ON_TIME = 2,
    ON_INPUT = 4,
    ON_STATE = 8,
    ON_RATE = 16,
    ON_START = 32,
    ON_GAIN = 64 /* of stabilisation, which the runtime may replace */
};

struct node {
    uint8_t operation;
    uint8_t depends;
    uint16_t loop;         /* that computes it, once an element; 0: computed once */
    expression operand[3]; /* OP_NUMBER: the bits of its value; OP_SYMBOL: an index into symbols, 0, 0 */
};

/*
 * A loop over the elements of a run. What is built between graph_open_loop and graph_close_loop and depends
 * on the element is its body; what does not, is computed before it. Other loops over the same run may use the
 * body's values, of the same element.
 */
struct element_loop {
    int run;
    bool inward;         /* from the last element to the first */
    uint32_t begin, end; /* handles made while it was open */
};

/* A value that a loop carries from one iteration to the next. */
struct slot {
    uint16_t loop;
    expression initial, next;
    expression carried, final; /* symbols for its value when an iteration begins, and behind the loop */
};

/* `loop` of a symbol that every loop over its run may read. */
enum { ANY_LOOP = 0xFFFF };

/* A line for the reader of the emitted C: what the nodes from here on compute. */
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
    struct element_loop *loops; /* loops[0] stands for no loop */
    struct slot *slots;
    int remark_capacity, symbol_capacity, spline_capacity; /* of the lists above */
    int loop_count, loop_capacity, slot_count, slot_capacity;
    uint16_t open;      /* the loop that is being built, 0: none */
    bool is_closed;     /* no node is added any more */
    const char **names; /* by handle: what the value is called in the emitted C, or NULL */
    int *name_owners;   /* by handle: 1 + the coordinate whose frame the value is named after, 0: none */
    expression *table;  /* hash table of handles, a power of two long, 0 empty */
    uint32_t table_size;
};

void graph_start(struct graph *g, struct memory *memory);
/* A graph of the same nodes that grows apart from g: for trials. No loop may be open. */
struct graph graph_copy(const struct graph *g);
/* From now on only nodes that are there are asked for. */
void graph_close(struct graph *g);

/* The handle of a node; a new one where no node is equal to it. Only folding.c and graph.c build nodes. */
expression graph_intern(struct graph *g, struct node node);
expression expr_number(struct graph *g, double value);
expression expr_symbol(struct graph *g, enum symbol_kind kind, int index, int order);
static inline expression expr_zero(const struct graph *g) {
    (void)g;
    return 0;
}
static inline expression expr_one(const struct graph *g) {
    (void)g;
    return 1;
}
expression expr_add(struct graph *g, expression a, expression b);
expression expr_sub(struct graph *g, expression a, expression b);
expression expr_mul(struct graph *g, expression a, expression b);
expression expr_div(struct graph *g, expression a, expression b);
expression expr_neg(struct graph *g, expression a);
expression expr_power(struct graph *g, expression a,
                      expression b); /* whole exponents up to 16 become products */
expression expr_sqrt(struct graph *g, expression a);
expression expr_where(struct graph *g, expression condition, expression then,
                      expression otherwise); /* condition != 0 ? then : otherwise */
/* Any operation of ops.def, folded; operands beyond its arity are ignored. */
expression expr_apply(struct graph *g, enum operation operation, expression a, expression b, expression c);
expression expr_apply1(struct graph *g, enum operation operation, expression a);
expression expr_apply2(struct graph *g, enum operation operation, expression a, expression b);

/* Loops do not nest. */
uint16_t graph_open_loop(struct graph *g, int run, bool inward);
void graph_close_loop(struct graph *g);
/* A new slot of the open loop; `next` is set before the loop is closed, `final` is made by it. */
int graph_new_slot(struct graph *g, expression initial);
void graph_set_next(struct graph *g, int slot, expression next);
/* The slot that a symbol stands for, or NULL. */
const struct slot *graph_as_slot(const struct graph *g, expression e);

/* A cubic spline through samples (graph.h), to be used by its number. */
int graph_add_spline(struct graph *g, const double *knots, const double *values, int count);
expression expr_spline(struct graph *g, int table, expression at);
/* The derivative of a spline node by its operand. */
expression expr_spline_derivative(struct graph *g, expression e);

/* The handle of an equal node; 0: there is none. */
expression graph_find_node(const struct graph *g, const struct node *node);
bool expr_is_number(const struct graph *g, expression e, double *value);  /* value may be NULL */
const struct symbol *expr_as_symbol(const struct graph *g, expression e); /* NULL when e is no symbol */
/* The first name given stays. `text` must live as long as the graph. */
void graph_name_value(struct graph *g, expression e, const char *text);

/* "OWNER_WHAT", or "shared_WHAT" where the value has another owner already: what several bodies, links or
 * rows have in common is called after none of them. */
void graph_name_shared(struct graph *g, expression e, const char *owner, const char *what);

/* Starts a section of the graph. `text` must live as long as the graph. */
void graph_remark(struct graph *g, const char *text);
/* The section that e belongs to: the last remark before it, or NULL. */
const char *graph_remark_of(const struct graph *g, expression e);

int operation_arity(enum operation operation);
/* RATE_GAIN or POSITION_GAIN. */
bool operation_is_gain(enum operation operation);
const char *operation_text(enum operation operation);
enum cost operation_cost(enum operation operation);
double operation_value(enum operation operation, double a, double b, double c);
/* Value of node e from the values of its operands; not for symbols. */
double graph_node_value(const struct graph *g, expression e, const double *values);
/* The node of e over other operands. */
expression expr_rebuild(struct graph *g, expression e, const expression operands[3]);
/* Partial derivative of node r by its operand number `which` (0, 1, 2). */
expression operation_partial(struct graph *g, expression r, int which);

/*
 * Rewrites: result of `leaf` for each symbol, everything above built anew. `leaf` returns the replacement of
 * the symbol `e` (itself to keep it).
 */
typedef expression leaf_rule(void *context, struct graph *g, expression e);
void rewrite_substitute(struct graph *g, leaf_rule *leaf, void *context, const expression *from,
                        expression *to, int count);
/* e with one node in it replaced. */
expression rewrite_replace(struct graph *g, expression e, expression node, expression by);
/* Directional derivative (one forward sweep): `leaf` returns the derivative of the symbol `e`. */
expression rewrite_derivative(struct graph *g, expression e, leaf_rule *leaf, void *context);
/*
 * The same of several expressions in several directions, in one sweep: `leaf` is called with one context for
 * each direction, `to` has `count` entries for each. Expressions of elements have theirs in new loops over
 * the same runs, so that no loop may be open. What OP_HOLD holds does not change.
 */
void rewrite_derivatives(struct graph *g, const expression *from, expression *to, int count, leaf_rule *leaf,
                         void *const *contexts, int directions);
/* Derivatives of e by each symbol in `by` (one backward sweep); 0 by handle 0. */
void rewrite_gradient(struct graph *g, expression e, const expression *by, expression *result, int count);

/* Marks (by handle) all that the marked nodes below `limit` are made of, what loops carry included. */
void rewrite_mark_operands(const struct graph *g, bool *needed, uint32_t limit);

/* The symbols that e depends on, in order of handles. */
expression *rewrite_list_symbols(struct graph *g, expression e, int *count);

/*
 * Value of e with the given values of symbols (`value_of` returns one; SYMBOL_START passes the base symbol as
 * is). For single values, as in checks; whole functions are interpreted from a plan.
 */
double rewrite_evaluate(struct graph *g, expression e,
                        double (*value_of)(void *context, const struct symbol *s), void *context);

/* graph_invariants.c: what of the above does not hold, with the entry at fault; NULL: all holds. No loop may
 * be open. */
const char *graph_violation(const struct graph *g);

/*
 * Expressions as text, for people who change the generator: in messages of checks, and in `refdyn gen
 * --explain`.
 *
 * A value is called by its name and its handle, "w_x#412", or by its handle alone, "#412"; numbers and
 * symbols are shown as what they are: p[2] a parameter, x[0] an input, q[3], qd[3], qdd[3] a coordinate,
 * e.q[7] that of frame 7 in the element that a loop is at, carried[5] and final[5] what slot 5 holds when an
 * iteration begins and behind the loop.
 */

/* The name of an operation in ops.def. */
const char *operation_name(enum operation operation);
/* What stands for e where it is read: marked nodes by name and handle, what is not marked is spelled out.
 * `is_marked` by handle; NULL: all are. */
void describe_value(struct text *text, const struct graph *g, expression e, const bool *is_marked);
/* The operation of e over its operands. */
void describe_definition(struct text *text, const struct graph *g, expression e, const bool *is_marked);

/*
 * Cubic splines through samples, as an operation of the graph.
 *
 * Takes knots and values, gives pieces y = c0 + h (c1 + h (c2 + h c3)), h = x - knot, twice continuously
 * differentiable (natural spline: no curvature at the ends; de Boor, A Practical Guide to Splines, 1978, ch.
 * IV). Beyond the ends it goes on as a straight line, which keeps both derivatives continuous.
 */

struct memory;

enum { PIECE_COLUMNS = 5, SPLINE_ORDERS = 4 }; /* knot, c0 ... c3; derivatives of order 0 to 3 */

struct spline {
    int count;      /* pieces: the line before the first knot, one from each knot on */
    double *pieces; /* (count x 5) */
};

/* knots ascending, count >= 2 */
struct spline spline_through(struct memory *memory, const double *knots, const double *values, int count);
double spline_value(const struct spline *spline, double at, int order);

#endif
