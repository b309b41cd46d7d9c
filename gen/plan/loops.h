/*
 * Loops of an emitted function: what runs behind its straight-line values, over arrays of them.
 *
 * A function's plan holds a list of loops, run in order. Each reads and writes arrays of the function by
 * their numbers: parts of the result, or local arrays. What straight-line code has put into an entry is kept:
 * loops add to it. loops.c gives their order and counts their operations, emit_loops.c prints them,
 * interpreter_loops.c runs them; all three walk the entries in the same order, so that every rounding is the
 * same.
 *
 * PAIRS: entries for two coordinates, one of which leads to the other. Each coordinate has vectors in ground
 * axes: far ones (wrenches, about its own origin) and near ones (motions of its joint). At each coordinate j,
 * from the tips, the far vectors of all coordinates beyond it stand about the origin of j, their dot products
 * with j's near vectors are the entries, and they are then moved to the origin of j's parent: moment += shift
 * x force. Going from joint to joint, never by the ground's origin, keeps the digits of short elements.
 * Vectors are stored by position, an order in which all beyond a joint follow it.
 */
#ifndef REFDYN_GEN_LOOPS_H
#define REFDYN_GEN_LOOPS_H

#include "graph/graph.h"

enum { NOTHING = -1 }; /* in place of an array: all of its entries are zero */

/* Three arrays, one by axis. */
struct vector_arrays {
    int at[3];
};

/* factor * (near of j) . (far of i) */
struct pair_term {
    struct vector_arrays near, far;
    double factor;
};

static inline bool has_component(const struct pair_term *term, int axis) {
    return term->near.at[axis] != NOTHING && term->far.at[axis] != NOTHING;
}

struct pair_terms {
    struct pair_term terms[4];
    int count;
};

/* Entry (i, j) of `array` gains `rows`, entry (j, i) gains `columns`, i beyond j; (j, j) gains `rows` alone.
 */
struct pair_entries {
    struct pair_terms rows, columns;
};

struct pair_product {
    int array;                       /* n x n */
    bool is_mirrored;                /* both are the same: `columns` is left out */
    struct pair_entries turn, slide; /* by the joint of j */
};

/* Moments that no product reads are NOTHING. */
struct pair_move {
    struct vector_arrays moment, force, shift;
};

struct pairs {
    struct pair_product products[3];
    struct pair_move moves[4]; /* with four terms each at most: no more than MOST_ARRAYS in all */
    int product_count, move_count;
    const int *order;                   /* n: coordinate by position */
    const int *end;                     /* n: positions up to this one lie beyond */
    const bool *is_revolute, *moves_on; /* n, by position; moves_on: the parent's origin is another one */
    int n;
};

/* target (w x v) += factor * left^T (k x w) * right (k x v) */
struct product {
    int target, left, right;
    double factor;
};

/* L^T D L of a symmetric positive definite matrix in its place: 1 / D on the diagonal, L below it. */
struct factoring {
    int matrix;
};

/* array = -matrix^-1 array, the matrix factored. */
struct solving {
    int matrix, array;
};

enum loop_kind { LOOP_PAIRS, LOOP_PRODUCT, LOOP_FACTORING, LOOP_SOLVING };

struct loop {
    enum loop_kind kind;
    const char *about; /* a line for the reader */
    union {
        struct pairs pairs;
        struct product product;
        struct factoring factoring;
        struct solving solving;
    } of;
};

struct function;
struct operation_count;

/* Adds the operations of one loop, counted by their trips. */
void loops_count_operations(const struct function *function, const struct loop *loop,
                            struct operation_count *count);
/* Where a loop holds the numbers of its arrays. */
enum { MOST_ARRAYS = 400 };
struct array_list {
    int *arrays[MOST_ARRAYS];
    int count;
};
struct array_list loops_list_arrays(struct loop *loop);
/* Runs one loop over the values of all arrays. */
void interpreter_run_loop(const struct function *function, const struct loop *loop, double *values);

#endif
