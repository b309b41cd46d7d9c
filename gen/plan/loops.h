/*
 * Loops over arrays: what they compute, and the form of statements to which each is lowered.
 *
 * The parts in order: the loops; their form; building a form; visiting its statements in the order of
 * execution.
 */
#ifndef REFDYN_GEN_LOOPS_H
#define REFDYN_GEN_LOOPS_H

#include "gen/base/base.h"

#include <stdbool.h>

struct function;
struct operation_count;

/* ---- Loops over arrays ---- */

/*
 * Loops run in order after a function's straight-line values and add to its entries. They read and write
 * arrays by their numbers: parts of the result, or local arrays. PAIRS computes entries for two coordinates,
 * one of which carries the other: lower_pairs.c explains it. SWEEPS: lower_sweeps.c.
 */

enum { NOTHING = -1 }; /* instead of an array: all of its entries are zero */

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

/* For i beyond j, entry (i, j) of `array` gains `rows` and entry (j, i) gains `columns`; (j, j) gains
 * `rows` alone. */
struct pair_entries {
    struct pair_terms rows, columns;
};

struct pair_product {
    int array;                       /* n x n */
    bool is_mirrored;                /* both are equal: `columns` is left out */
    struct pair_entries turn, slide; /* by the joint of j */
};

/* A moment that no product reads is NOTHING. */
struct pair_move {
    struct vector_arrays moment, force, shift;
};

struct pairs {
    struct pair_product products[3];
    struct pair_move moves[4]; /* with at most four terms each: no more than MOST_ARRAYS in all */
    int product_count, move_count;
    const int *order;                  /* n: coordinate by position */
    const int *end;                    /* n: positions up to this one are beyond */
    const int *is_revolute, *moves_on; /* n, by position, 0 or 1; moves_on: the parent has another origin */
    int n;
};

/* target (w x v) += factor * left^T (k x w) * right (k x v) */
struct product {
    int target, left, right;
    double factor;
};

/* Replaces a symmetric positive definite matrix by its L^T D L: 1 / D on the diagonal, L below it. */
struct factoring {
    int matrix;
};

/* array = -matrix^-1 array, where the matrix is factored. */
struct solving {
    int matrix, array;
};

/* Derivatives of accelerations, column by column: acceleration_columns in tangent.h has the vectors, by
 * position, and sweeps.c the loop. */
struct sweep_column {
    int array; /* n x n */
    struct vector_arrays spin, turned, push_moment, push_force, start_angular, start_linear;
};

enum stage_kind {
    STAGE_TURN,
    STAGE_SLIDE,
    STAGE_BALL,
    STAGE_PART
}; /* PART: not the first joint of its ball */

/* Branches of bodies that carry several ones, ascending by position. */
struct sweep_branches {
    int count;
    const int *starts; /* count + 1: positions at which they begin; n */
    const int *opened; /* where the body's first branch begins */
    const int *levels; /* number of bodies whose unit wrenches are carried to the body */
    const int *units;  /* the place of the body's unit wrenches; -1: the body's last branch */
};

enum { UNIT_WRENCHES = 6 }; /* a moment along x, y, z and a force along x, y, z */

struct sweeps {
    struct vector_arrays turn, shift, swing, hold_moment, hold_force, hold_spin, hold_turned;
    struct vector_arrays start_angular, start_linear;
    struct vector_arrays unit_angular, unit_linear; /* six for each body with several branches: its
                                                       acceleration by each unit wrench */
    struct sweep_column columns[2];
    int column_count;
    struct sweep_branches branches;
    int body_count;      /* bodies with several branches */
    int levels;          /* most bodies whose unit wrenches are carried at once */
    const int *order;    /* n: coordinate by position */
    const int *root;     /* n: the first position of the tree, which begins on the ground */
    const int *kind;     /* n: enum stage_kind */
    const int *moves_on; /* n: 1 if the parent has another origin */
    int n;
};

/* Which components of a state of the sweeps may be nonzero. */
struct sweep_state {
    bool angular[3], linear[3], spin[3], turned[3];
};
/* column -1: the response to a unit force. */
struct sweep_state sweeps_state(const struct sweeps *sweeps, int column);
/* Drops the components of vectors that multiply only zeros. */
void sweeps_drop_unread(struct sweeps *sweeps);

struct loop {
    enum loop_kind { LOOP_PAIRS, LOOP_PRODUCT, LOOP_FACTORING, LOOP_SOLVING, LOOP_SWEEPS } kind;
    const char *about; /* a line for the reader of the C */
    union {
        struct pairs pairs;
        struct product product;
        struct factoring factoring;
        struct solving solving;
        struct sweeps sweeps;
    } of;
};

/* The places in a loop that refer to its arrays. */
enum { MOST_ARRAYS = 400 };
struct array_list {
    int *arrays[MOST_ARRAYS];
    int count;
};
static inline void array_list_add_vectors(struct array_list *list, struct vector_arrays *vectors) {
    for (int a = 0; a < 3; a++)
        list->arrays[list->count++] = &vectors->at[a];
}
void sweeps_list_arrays(struct array_list *list, struct sweeps *sweeps);
struct array_list loops_list_arrays(struct loop *loop);

/* ---- The form ---- */

/*
 * A loop is lowered to a list of statements. The form is printed as C, counted and executed, always in the
 * same order, so that every rounding is the same.
 */

enum { MOST_PARTS = 3 };
/* An integer: constant + factor * variable + ... ; a part may look its variable up in a table. */
struct loop_index {
    int constant, count;
    struct loop_index_part {
        int factor, variable, table; /* table: NOTHING, or of the form */
    } parts[MOST_PARTS];
};

/* An entry of an array of the function, or of one of the form, whose numbers follow. */
struct loop_entry {
    int array;
    struct loop_index at;
};

/* factor, or factor * entry, or factor * entry * entry */
struct loop_term {
    double factor;
    struct loop_entry operands[2];
    int operand_count;
    bool begins_group; /* its group is added first: (a + b) + (c + d) */
};

enum { MOST_TERMS = 16 };
struct loop_sum {
    struct loop_term terms[MOST_TERMS];
    int count;
    bool opens_group; /* the next term begins a group */
};

struct loop_list {
    struct loop_statement *first, *last;
};

enum loop_relation { LOOP_LESS, LOOP_GREATER, LOOP_AT_LEAST, LOOP_EQUAL };

/* The value becomes the target, is added to it or multiplied with it, or the target becomes 1 / value. */
enum loop_effect { LOOP_SET, LOOP_ADD, LOOP_MULTIPLY, LOOP_INVERT };

/*
 * Compilers turn inner loops into vector instructions if the number of their iterations is a constant. Such
 * loops are printed for single motions in blocks of `block` iterations. They compute some values that nothing
 * reads, or that are computed again. UP: the first block may begin before `from`, the last one may end after
 * `to`. DOWN: the last block ends at `to`, the first one may begin before `from`, but not before 0. WITHIN:
 * as UP, but blocks end at `limit` at the latest.
 */
enum loop_blocks { NO_BLOCKS, BLOCKS_UP, BLOCKS_DOWN, BLOCKS_WITHIN };

struct loop_statement {
    enum loop_statement_kind {
        LOOP_FOR,      /* for (variable = from; variable RELATION to; variable += step) body */
        LOOP_IF,       /* if (from RELATION to) body else otherwise */
        LOOP_INTEGER,  /* variable = from */
        LOOP_ASSIGN,   /* target and the sum of terms, by `effect` */
        LOOP_ARRAY,    /* declares target.array */
        LOOP_SEQUENCE, /* body: values that the statements after it read */
    } kind;
    struct loop_statement *next;
    int variable;
    struct loop_index from, to, step;
    enum loop_relation relation;
    enum loop_blocks blocks;
    int block, limit;
    bool is_declared;        /* FOR, INTEGER, ASSIGN: a new variable or value */
    bool is_constant;        /* INTEGER: never set again; ASSIGN: of a single value before inner loops */
    bool is_unread_at_first; /* ASSIGN: nothing reads the value of the first iteration; it is not counted */
    struct loop_entry target;
    enum loop_effect effect;
    struct loop_term *terms;
    int term_count;
    struct loop_list body, otherwise, *outer; /* outer: contains the statement */
};

enum { MOST_VARIABLES = 16, MOST_TABLES = 12 };

struct loop_form {
    struct memory *memory;
    const struct function *function;
    const char *variables[MOST_VARIABLES];
    int variable_count;
    struct loop_table {
        const char *name;
        const int *values;
        int count;
    } tables[MOST_TABLES];
    int table_count;
    struct loop_local {
        const char *name;
        int count; /* 0: a single value */
        int place; /* among the values of the function and the form */
    } * locals;    /* their numbers follow the arrays of the function */
    int local_count, local_capacity;
    int value_count; /* of the function and the form */
    struct loop_list body;
    /* while the form is built */
    struct loop_list *at, *constants;
};

/* ---- Building a form ---- */

struct loop_index loop_number(int number);
/* The variable of that name. */
struct loop_index loop_variable(struct loop_form *form, const char *name);
struct loop_index loop_plus(struct loop_index a, struct loop_index b);
struct loop_index loop_plus_number(struct loop_index a, int number);
struct loop_index loop_times(struct loop_index a, int factor);
/* values[of], where `of` is a variable. If all values are equal, or equal to their places, no table is
 * needed. */
struct loop_index loop_look_up(struct loop_form *form, const char *name, const int *values, int count,
                               struct loop_index of);

struct loop_entry loop_entry(int array, struct loop_index at);
/* Declares an array of the form. Returns its number. */
int loop_declare_array(struct loop_form *form, const char *name, int count);
/* A sum without terms is 0. */
void loop_add_entry(struct loop_sum *sum, double factor, struct loop_entry a);
void loop_add_product(struct loop_sum *sum, double factor, struct loop_entry a, struct loop_entry b);
void loop_assign(struct loop_form *form, struct loop_entry target, enum loop_effect effect,
                 const struct loop_sum *sum);
/* The same for the sum of one entry. */
void loop_assign_entry(struct loop_form *form, struct loop_entry target, enum loop_effect effect,
                       struct loop_entry value);
/* Declares a single value of the form. */
struct loop_entry loop_declare(struct loop_form *form, const char *name, const struct loop_sum *sum);
/* The same before the statements since loop_open_constants, outside the inner loops; once for each name. */
void loop_open_constants(struct loop_form *form);
struct loop_entry loop_constant(struct loop_form *form, const char *name, double factor,
                                struct loop_entry value);
/* A variable that begins with a value. */
struct loop_index loop_declare_integer(struct loop_form *form, const char *name, struct loop_index value);
/* A constant variable of a value; a number needs no variable. */
struct loop_index loop_name_integer(struct loop_form *form, const char *name, struct loop_index value);
void loop_set_integer(struct loop_form *form, struct loop_index variable, struct loop_index value);

/* Further statements are in the loop or under the condition until loop_close. */
struct loop_statement *loop_open_for(struct loop_form *form, struct loop_index variable,
                                     struct loop_index from, enum loop_relation relation,
                                     struct loop_index to, struct loop_index step);
/* for (variable = from; variable < to; variable++) */
struct loop_statement *loop_open_range(struct loop_form *form, const char *variable, struct loop_index from,
                                       struct loop_index to);
struct loop_statement *loop_open_if(struct loop_form *form, struct loop_index a, enum loop_relation relation,
                                    struct loop_index b);
void loop_open_else(struct loop_form *form, struct loop_statement *condition);
void loop_close(struct loop_form *form, struct loop_statement *opened);

/* ---- Lowering and visiting ---- */

/* `is_in_strips`: as printed for single motions, where pairs of long chains are computed in strips. */
struct loop_form *loops_lower(struct memory *memory, const struct function *function, const struct loop *loop,
                              bool is_in_strips);
void loops_lower_pairs(struct loop_form *form, const struct pairs *pairs, bool is_in_strips);
void loops_lower_product(struct loop_form *form, const struct product *product);
void loops_lower_factoring(struct loop_form *form, const struct factoring *factoring);
void loops_lower_solving(struct loop_form *form, const struct solving *solving);
void loops_lower_sweeps(struct loop_form *form, const struct sweeps *sweeps);
/* The entries of a local array of a function, rounded up to whole blocks if strips need them. */
int loops_length_of_local(const struct function *function, int array);

/* Which entries of an array of a function its loops set before they read them, so that these need not be
 * cleared: some, all but those within LOOPS_BAND of the diagonal, or all. */
enum loops_coverage { LOOPS_SET_SOME, LOOPS_SET_OTHERS, LOOPS_SET_ALL };
enum { LOOPS_BAND = 2 };
enum loops_coverage loops_coverage(const struct function *function, int array);
enum loops_coverage loops_pairs_coverage(const struct function *function, const struct pairs *pairs,
                                         int array);

/* Visits the assignments in the order of execution. */
struct loop_walk {
    const struct loop_form *form;
    void (*visit)(struct loop_walk *walk, const struct loop_statement *assignment, long times);
    bool is_counting; /* statements of the innermost loops are visited once for all iterations */
    int variables[MOST_VARIABLES];
};
void loop_walk(struct loop_walk *walk);
int loop_index_value(const struct loop_walk *walk, const struct loop_index *index);
bool loop_holds(int a, enum loop_relation relation, int b);
/* The place of an entry among the values of the function and the form. */
int loop_place(const struct loop_walk *walk, const struct loop_entry *entry);
/* Adds the operations of one loop, including its repetitions. */
void loops_count_operations(struct memory *memory, const struct function *function, const struct loop *loop,
                            struct operation_count *count);

#endif
