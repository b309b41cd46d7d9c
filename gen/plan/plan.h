/* From expressions to statements, blocks and functions. */
#ifndef REFDYN_GEN_PLAN_H
#define REFDYN_GEN_PLAN_H

#include "gen/gen.h"
#include "gen/graph/graph.h"

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

/*
 * The plan: which functions are emitted, which nodes each one computes, in which order and in which pieces.
 *
 * Takes the outputs of the quantities (quantities.c), gives all that a printer or the interpreter needs. What
 * depends on parameters alone is moved to `derived`, computed once per parameter set; what nothing needs is
 * not here.
 */

/* An entry that straight code gives, other than zero. */
struct single {
    int entry;
    expression value;
};

/* A named part of a function's result: entries [offset, offset + count). */
struct array {
    const char *name, *about; /* about: shape, meaning, unit */
    int offset, count;
    struct single *singles; /* in no order; other entries are zero until loops or calls add to them */
    int single_count, single_capacity;
    int columns;       /* of a matrix, 0: a vector */
    int symmetric;     /* > 0: a symmetric square of that size; only its lower half is computed */
    bool by_parameter; /* one column for each of the model's parameters: those not emitted are taken out */
};

/* Values of all elements of a run: entry + e * stride of an array for element e. */
struct run_result {
    expression value;
    int array, entry, stride, run;
    int block; /* planned: the loop that writes them */
};

/* Statements computed one after the other, once or in a loop over the elements of a run. */
struct code_block {
    int run;     /* -1: once */
    int group;   /* of loops of the graph that run as one; 0: once, or a loop that only writes results */
    bool inward; /* from the last element to the first */
    int end;     /* of its statements */
};

/* An entry of an array that stands alone, and how many statements and blocks end before it: it is written as
 * soon as it is known, which keeps few values waiting. */
struct write {
    int array, entry, place;
    expression value;
};

/* A value that a group of loops makes anew: see angles_is_repeated. */
struct repeat {
    int group;
    expression value;
};

struct function;

/* An array of a composed function: that of another one, which is called. */
struct composed_array {
    const struct function *from;
    int from_array, to_array;
    bool is_added; /* to what that array holds */
};

struct function {
    const char *quantity, *about;
    bool takes_motion;     /* after qd follows the result of `constrained`: qdd (n), power (1), lambda (m) */
    bool keeps_parameters; /* computes values of parameters alone itself, instead of `prepare` */
    bool has_blocks;       /* its result is a struct even with one part, whose name is that of an argument */
    struct array *arrays;  /* parts of the result, then local arrays, which loops read */
    int array_count, local_count, array_capacity;
    int out_count, local_out_count; /* entries of all arrays */
    struct composed_array
        *parts; /* of a composed function, which computes nothing itself; parts of one function in a row */
    int part_count, part_capacity;
    struct run_result *run_results;
    int run_result_count, run_result_capacity;
    struct loop *loops;
    int loop_count, loop_capacity;
    /* planned */
    expression *statements; /* nodes that become named values, in order of execution */
    int statement_count;
    struct code_block *blocks;
    int block_count;
    int *group_of;        /* by loop of the graph; 0: the function has nothing of it */
    struct write *writes; /* in order of execution */
    int write_count, write_capacity;
    struct repeat *repeats;
    int repeat_count, repeat_capacity;
    int first_angle, angle_count; /* coordinates in the pass over angles; count 0: there is none */
    bool *is_stored;              /* by handle: of a loop, kept for all elements, since other loops read it */
    bool *is_needed;              /* by handle: slots of loops among them */
    int *piece_ends; /* blocks are cut into piece_count static functions when there are many statements */
    int piece_count;
    struct operation_count operations;
};

struct plan {
    struct memory *memory;
    struct graph *g;
    const struct model *model;
    const struct tree *tree;   /* a frame a coordinate */
    const struct tree *rolled; /* runs of equal elements as one: what everything is derived from */
    struct function *functions;
    int function_count;
    int *parameters; /* model's index of each emitted parameter */
    int parameter_count;
    int *anchored; /* model's index of each parameter that `anchor` sets */
    int anchored_count;
    expression *breaks, *switches; /* times of kinks; what changes sign at others: quantities.h */
    int break_count, switch_count;
    expression pace;      /* of these: their largest angular frequency [rad/s] */
    struct requirement *requirements; /* of parameters that some function reads, */
    expression *required;             /* and where they hold */
    int requirement_count;
    expression *no_kinks; /* comparisons that are none: quantities.h */
    int no_kink_count;
    struct function prepare;  /* results: values of parameters alone, ascending */
    bool *is_statement;       /* scratch of the function being planned or printed, by handle */
    bool *is_derived;         /* by handle */
    const int *vector_places; /* of `tangent_vectors`: refdyn_model.h, or NULL */
    int coupling_count;
    const char *choices;      /* how M x = f is solved and what it costs, for the summary; NULL: not at all */
    const char *left_out;     /* what the scene does not need, for the summary */
    bool has_lanes;           /* the files of lanes are emitted, too */
    bool has_step;            /* those of fixed steps */
    bool has_step_parameters; /* whose derivatives are by the parameters, too */
    bool has_casadi;          /* that for CasADi */
    struct emitted_file *files;
    int file_count;
    int companion_count; /* of these files, behind the parts of the model */
};

/* One more part of a function's result, before any local array: its number. */
int plan_open_result(struct memory *memory, struct function *function, const char *name, const char *about,
                     int count, int columns);
/* One more local array, behind all other arrays: its number. */
int plan_open_local(struct memory *memory, struct function *function, const char *name, int count,
                    int columns);
/* Gives one entry of an array, or `count` of them from `first` on. */
void plan_set_entry(struct memory *memory, struct function *function, int array, int entry, expression value);
void plan_set_entries(struct memory *memory, struct function *function, int array, int first,
                      const expression *values, int count);

/* The value of a frame with a joint, in entry `first` + step * e of an array, e the element in a run, 0 else.
 */
void plan_set_frame(struct memory *memory, const struct tree *tree, struct function *function, int array,
                    int first, int step, int frame, expression value);

/* quantities.c: outputs of every function asked for (`emit` as in gen_plan); false: the scene has none of
 * them. */
bool quantities_list_functions(struct plan *plan, const char *emit);
/* asked_words.c: `emit` with words that stand for several quantities replaced by these, and what they ask for
 * beside. */
const char *quantities_of_words(struct plan *plan, const char *emit);
/* Is it such a word? */
bool quantities_is_word(const char *word);
/* The function whose parts `before` q, qd, t, x and p are all derivatives of a quantity; NULL: there is none.
 */
struct derivatives_of {
    const char *quantity, *function, *before;
};
const struct derivatives_of *quantities_derivatives_of(const char *quantity);
/* The function of a quantity; NULL: it is not emitted. */
const struct function *plan_find_function(const struct plan *plan, const char *quantity);
/* All handles exist from here on: arrays by handle can be made. */
void plan_close_graph(struct plan *plan);
/* order_of_sums.c: in all functions. */
void order_of_sums(struct plan *plan);
/* prepare.c: a sign, which stands where it is used; whether an expression is computed by `prepare` and not by this
 * function; collects such values of a function; opens `prepare` with all of them as its results. */
bool plan_is_sign(const struct graph *g, expression e);
bool plan_is_moved(const struct plan *plan, const struct function *function, expression e);
void plan_collect_derived(struct plan *plan, const struct function *function);
void prepare_open(struct plan *plan);
/* plan.c: statements, derived values, pieces, counts; when sums are in order. */
void plan_functions(struct plan *plan);
enum { FEWEST_ANGLES = 4 }; /* of one pass: as wide as vectors of doubles mostly are */
/* Coordinates from the first to the last one whose sine or cosine a function takes. */
struct angle_range {
    int first, count;     /* count 0: there is none */
    bool is_dense;        /* two thirds of them are such */
    const bool *is_angle; /* by coordinate */
};
struct angle_range angles_range(const struct plan *plan, const struct function *function);
/* Is a node the sine or cosine of a coordinate alone? */
bool angles_is_plain(const struct plan *plan, expression e);
/* angles.c: the coordinates in the pass over angles, and whether a node is one of its results. */
void angles_find(const struct plan *plan, struct function *function);
bool angles_is_in_pass(const struct plan *plan, const struct function *function, expression e);
/* A value that every loop makes anew instead of reading it: of the pass, or one of two constants. */
bool angles_is_repeated(const struct plan *plan, const struct function *function, expression e);
/* schedule.c: order of execution from is_statement and is_needed; takes scratch that the caller gives back.
 */
void schedule_function(struct plan *plan, struct function *function);
/* How often a call computes a node; adds the operations of these times. */
long plan_trips_of(const struct plan *plan, expression e);
void plan_count_node(const struct plan *plan, expression e, struct operation_count *count);
/* Marks is_statement for one function: before printing it. */
void plan_mark_statements(struct plan *plan, const struct function *function);
bool plan_is_output_copied(const struct array *array, int entry); /* false in the mirrored upper half */
/* Are there so many zeros in an array that one loop writes all of it before the others are written? */
bool plan_is_cleared(const struct plan *plan, const struct function *function, int array);
/* Is the result a struct of its parts, not an array? */
bool plan_is_struct_result(const struct function *function);
/* Entries of a row; all of them in a vector. */
int plan_columns_of(const struct array *array);
/* Results and local arrays. */
int plan_count_arrays(const struct function *function);
/* Entries of all arrays. */
int plan_value_count(const struct function *function);

/* Counts, and marks, a function's results, by handle. */
void plan_count_results(const struct function *function, uint32_t *uses);
void plan_mark_results(const struct function *function, bool *needed);
/* By handle: all nodes that the functions listed so far are made of. */
bool *plan_mark_nodes_of_functions(const struct plan *plan);

/* saturation.c: is there something in the accelerations that a rate drives to its limit, or makes jump, as
 * friction? */
bool plan_saturates(const struct plan *plan);

/* plan_invariants.c: what of the above does not hold of planned functions, with the value at fault; NULL: all
 * holds. */
const char *plan_violation(struct plan *plan);

/* emit.c: the text of all files into plan->files, NAME.h first, then the parts NAME.c, NAME_2.c ... */
void emit_files(struct plan *plan);
/* The name of a part, from 1, and the line that it begins with. */
const char *emit_part_name(struct memory *memory, const char *model, int part);
const char *emit_part_lead(struct memory *memory, const char *model, int part);
/* Files behind them that an emission may have: the name and the first line of one, by number from 0; false:
 * there are not so many. */
struct companion {
    const char *name, *lead;
};
bool emit_companion(struct memory *memory, const char *model, int number, struct companion *companion);
/* Is there a function that CasADi calls, steps apart? */
bool emit_has_casadi_function(const struct plan *plan);

#endif
