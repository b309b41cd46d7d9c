/*
 * The plan: from the expressions of each quantity to statements, blocks, loops and functions.
 *
 * The parts in order: functions and the plan; building results; quantities, which fill the plan; planning;
 * queries; files, which are printed from a plan. loops.h has the loops over arrays.
 */
#ifndef REFDYN_GEN_PLAN_H
#define REFDYN_GEN_PLAN_H

#include "gen/gen.h"
#include "gen/plan/loops.h"

/* ---- Functions and the plan ---- */

/* Values of parameters alone are moved to `prepare`, which computes them once for each set of parameters.
 * Unused values are not in the plan. */

/* A nonzero entry that straight-line code computes. */
struct single {
    int entry;
    expression value;
};

/* A named part of a function's result: entries [offset, offset + count). */
struct array {
    const char *name, *about; /* about: shape, meaning, unit */
    int offset, count;
    struct single *singles; /* in no order; the other entries are zero until loops or calls add to them */
    int single_count, single_capacity;
    int columns;       /* columns of a matrix; 0: a vector */
    int symmetric;     /* > 0: a symmetric matrix of that size, of which only the lower half is computed */
    bool by_parameter; /* one column for each of the model's parameters; columns of parameters that are not
                          emitted are removed */
};

/* The values of all elements of a run: entry + e * stride of an array for element e. */
struct run_result {
    expression value;
    int array, entry, stride, run;
    int block; /* planned: the loop that writes them */
};

/* Statements in a row, executed once or in a loop over the elements of a run. */
struct code_block {
    int run;     /* -1: once */
    int group;   /* of loops that run as one; 0: executed once, or a loop that only writes results */
    bool inward; /* from the last element to the first */
    int end;     /* end of its statements */
};

/* A single entry of an array, and the number of statements and blocks that end before it is written. It is
 * written as soon as it is known, so that few values wait. */
struct write {
    int array, entry, place;
    expression value;
};

/* A value that each group of loops computes again: see angles_is_repeated. */
struct repeat {
    int group;
    expression value;
};

/* An array of a composed function, which is copied from a function that is called. */
struct composed_array {
    const struct function *from;
    int from_array, to_array;
    bool is_added; /* added to the present contents of the array */
};

/* What a function reads after qd. */
enum given {
    GIVEN_NOTHING,
    GIVEN_ACCELERATIONS, /* qdd (n) */
    GIVEN_MOTION         /* the result of `constrained`: qdd (n), power (1), lambda (m) */
};

struct function {
    const char *quantity, *about;
    enum given given;
    bool keeps_parameters; /* computes values of parameters alone itself, instead of reading them from
                              `prepare` */
    bool is_for_runtime;   /* describes the start, the events or the rules of a motion: quantities.def */
    bool has_blocks;       /* a struct even if it has one part, whose name is the name of an argument */
    struct array *arrays;  /* parts of the result, then local arrays, which loops read */
    int array_count, local_count, array_capacity;
    int out_count, local_out_count; /* entries of all arrays */
    struct composed_array *parts;   /* of a composed function, which computes nothing itself; parts from one
                                       function follow each other */
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
    int *group_of;        /* by loop of the graph; 0: the function uses nothing of it */
    struct write *writes; /* in order of execution */
    int write_count, write_capacity;
    struct repeat *repeats;
    int repeat_count, repeat_capacity;
    int first_angle, angle_count; /* coordinates in the pass over angles; count 0: there is no pass */
    bool *is_stored; /* by handle: a loop's value that is kept for all elements, for other loops */
    bool *is_needed; /* by handle: slots of loops among them */
    int *piece_ends; /* blocks are cut into piece_count static functions if there are many statements */
    int piece_count;
    struct operation_count operations;
};

struct plan {
    struct memory *memory;
    struct graph *g;
    const struct model *model;
    const struct tree *tree;   /* one frame for each coordinate */
    const struct tree *rolled; /* each run of equal elements as one; all quantities are derived from it */
    struct function *functions;
    int function_count;
    int *parameters; /* the model's index of each emitted parameter */
    int parameter_count;
    int *anchored; /* the model's index of each parameter that `anchor` sets */
    int anchored_count;
    expression *breaks;   /* times of known kinks: event_terms.c */
    expression *switches; /* values that change sign at other kinks */
    int break_count, switch_count;
    /* largest angular frequencies of the switches, and of events that depend on the state [rad/s] */
    expression pace, event_pace;
    struct requirement *requirements; /* of parameters that some function reads */
    expression *required;             /* for each requirement: whether it holds */
    int requirement_count;
    expression *no_kinks; /* comparisons that are not kinks of the model: event_terms.c */
    int no_kink_count;
    struct function prepare;  /* its results are values of parameters alone, ascending */
    bool *is_statement;       /* scratch, by handle, of the function being planned or printed */
    bool *is_derived;         /* by handle */
    const int *vector_places; /* of `tangent_vectors` (refdyn_model.h), or NULL */
    int coupling_count;
    const char *choices;  /* how M x = f is solved and its cost, for the summary; NULL: not at all */
    const char **lacks;   /* by quantity: what the scene does not have; NULL: the scene has the quantity */
    const char *left_out; /* quantities that the scene does not have, for the summary */
    bool has_lanes;       /* also emit the files for lanes */
    bool has_step;        /* also emit fixed steps */
    bool has_step_parameters; /* and their derivatives with respect to parameters */
    bool has_casadi;          /* also emit the file for CasADi */
    bool is_single;           /* the C computes in single precision: emit_real.c */
    const char *outside;      /* constant of the C that no float can represent; NULL: there is none */
    struct emitted_file *files;
    int file_count;
    int companion_count; /* how many of these files come after the parts of the model */
};

/* ---- Building results ---- */

/* Adds one part to a function's result, before any local array. Returns its number. */
int plan_open_result(struct memory *memory, struct function *function, const char *name, const char *about,
                     int count, int columns);
/* Adds one local array after all other arrays. Returns its number. */
int plan_open_local(struct memory *memory, struct function *function, const char *name, int count,
                    int columns);
/* Sets one entry of an array, or `count` entries from `first` on. */
void plan_set_entry(struct memory *memory, struct function *function, int array, int entry, expression value);
void plan_set_entries(struct memory *memory, struct function *function, int array, int first,
                      const expression *values, int count);
/* Sets entry `first` + step * e of an array to the value of a frame with a joint, where e is the element
 * in a run and otherwise 0. */
void plan_set_frame(struct memory *memory, const struct tree *tree, struct function *function, int array,
                    int first, int step, int frame, expression value);

/* ---- Quantities ---- */

/* quantities.c: lists the functions of all requested quantities (`emit` as in gen_plan). Returns false if the
 * scene lacks them all. */
bool quantities_list_functions(struct plan *plan, const char *emit);
/* Returns `emit` with each word for several quantities replaced by their names, and marks in the plan what
 * else these words request. */
const char *quantities_of_words(struct plan *plan, const char *emit);
/* The function whose parts `before` q, qd, t, x and p are all derivatives of a quantity; NULL: there is
 * none. */
struct derivatives_of {
    const char *quantity, *function, *before;
};
const struct derivatives_of *quantities_derivatives_of(const char *quantity);

/* ---- Planning ---- */

/* The function of a quantity; NULL: it is not emitted. */
const struct function *plan_find_function(const struct plan *plan, const char *quantity);
/* All handles exist from here on, so that arrays by handle can be made. */
void plan_close_graph(struct plan *plan);
/* order_of_sums.c: orders the summands in all functions. */
void order_of_sums(struct plan *plan);
/* prepare.c: plan_is_sign returns whether e is a sign, which stays where it is used. The next functions
 * return whether `prepare` computes an expression instead of this function, collect these values of a
 * function, and open `prepare` with all of them as its results. */
bool plan_is_sign(const struct graph *g, expression e);
bool plan_is_moved(const struct plan *plan, const struct function *function, expression e);
void plan_collect_derived(struct plan *plan, const struct function *function);
void prepare_open(struct plan *plan);
/* plan.c: plans statements, derived values, pieces and counts. Call it after ordering the sums. */
void plan_functions(struct plan *plan);
enum { FEWEST_ANGLES = 4 }; /* in one pass: the usual width of vectors of doubles */
/* The coordinates from the first to the last one whose sine or cosine a function needs. */
struct angle_range {
    int first, count;     /* count 0: there is none */
    bool is_dense;        /* at least two thirds of them are angles */
    const bool *is_angle; /* by coordinate */
};
struct angle_range angles_range(const struct plan *plan, const struct function *function);
/* Returns whether a node is the sine or cosine of a coordinate alone. */
bool angles_is_plain(const struct plan *plan, expression e);
/* Returns whether every loop computes the value again instead of reading it: a result of the pass, or a
 * choice of one of two constants. */
bool angles_is_repeated(const struct plan *plan, const struct function *function, expression e);
/* schedule.c: the order of execution, from is_statement and is_needed. It uses scratch, which the caller
 * releases. */
void schedule_function(struct plan *plan, struct function *function);

/* ---- Queries ---- */

/* How often one call computes a node. The next function adds the operations of these times. */
long plan_trips_of(const struct plan *plan, expression e);
void plan_count_node(const struct plan *plan, expression e, struct operation_count *count);
/* Marks is_statement for one function: call it before printing the function. */
void plan_mark_statements(struct plan *plan, const struct function *function);
bool plan_is_output_copied(const struct array *array, int entry); /* false in the mirrored upper half */
/* Whether an array has so many zeros that one loop clears all of it before other entries are written. */
bool plan_is_cleared(const struct plan *plan, const struct function *function, int array);
/* Returns whether the result is a struct of its parts, not an array. */
bool plan_is_struct_result(const struct function *function);
int plan_columns_of(const struct array *array);         /* entries of a row; all of them in a vector */
int plan_count_arrays(const struct function *function); /* results and local arrays */
int plan_value_count(const struct function *function);  /* entries of all arrays */
/* Counts and marks a function's results, by handle. */
void plan_count_results(const struct function *function, uint32_t *uses);
void plan_mark_results(const struct function *function, bool *needed);
/* Marks, by handle, all nodes of the functions listed so far. */
bool *plan_mark_nodes_of_functions(const struct plan *plan);
/* saturation.c: returns whether a rate drives a term of the accelerations to its limit, or makes it jump,
 * as in friction. */
bool plan_saturates(const struct plan *plan);
/* plan_invariants.c: the first rule of this header that planned functions break, with the offending value;
 * NULL if they keep all. */
const char *plan_violation(struct plan *plan);

/* ---- Files ---- */

/* emit.c: prints all files into plan->files: NAME.h first, then the parts NAME.c, NAME_2.c ... */
void emit_files(struct plan *plan);
/* The name of a part, from 1, and its first line. */
const char *emit_part_name(struct memory *memory, const char *model, int part);
const char *emit_part_lead(struct memory *memory, const char *model, int part);
/* Further files that an emission may have after the parts: the name and the first line of one, by number
 * from 0. False: there are no more. */
struct companion {
    const char *name, *lead;
};
bool emit_companion(struct memory *memory, const char *model, int number, struct companion *companion);
/* Returns whether the plan has a function, steps excepted, that CasADi can call. */
bool emit_has_casadi_function(const struct plan *plan);

#endif
