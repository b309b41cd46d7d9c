/*
 * Printing a plan as C: the declarations that the files of this folder share. plan.h declares the folder's
 * entry, emit_files.
 *
 * The parts in order: the emission; values and expressions; splines, loops, sines and cosines; functions and
 * headers; companion files (steps, CasADi, lanes); tables.
 */
#ifndef REFDYN_GEN_EMIT_H
#define REFDYN_GEN_EMIT_H

#include "gen/plan/plan.h"

/* An array that a function expects after qd: by coordinate, by row. */
enum { GIVEN_ARRAYS = 2 };
struct given_array {
    const char *name;
    int count; /* 0: the function has none */
    int place; /* of its first entry, counted from qd */
};

struct emission {
    struct plan *plan;
    struct graph *g;
    const char *name;   /* the beginning of the names of functions and structs: NAME or NAME_lanes */
    const char *number; /* the type of numbers: "double" or "lane" */
    bool is_lanes;      /* the file for lanes is being printed: emit_lanes.c */
    bool *uses_spline;  /* in lanes, by spline */
    bool uses_operation[OP_COUNT]; /* in lanes: as a function at the beginning of the file */
    const char **value_names; /* by handle: unique names from the derivation; NULL: the value gets a number in
                                 its function */
    int *temporary;           /* by handle: number of an unnamed value in the current function */
    int *piece_of;            /* by handle: piece that computes it in the current function */
    bool *is_carried;         /* by handle: used in a later piece */
    bool *is_read;            /* by handle: used in the piece that computes it */
    const char **slot_names;  /* by slot: the name of the carried value */
    int *slot_piece;          /* by slot: piece whose loop sets it */
    bool *is_slot_carried;    /* by slot: read in a later piece */
    const struct function *function; /* the current function: the one that is being printed */
    int piece;                       /* the current piece; -1 in `prepare` */
    int group;                       /* the current group of loops; 0: none */
    bool is_cut;                     /* the current function is cut into pieces */
    int *run_numbers; /* by run: the number in the name of its first element; -1: the elements' names are not
                         consecutive numbers */
    long *own_stack;  /* by function: bound of its bytes of stack, without the functions that it calls */
    struct angle_range angles; /* of the current function: the angles in its pass */
    bool has_sincos;           /* the current file has the pass over angles */
    bool uses_p, uses_x, uses_t, uses_q, uses_qd, uses_given[GIVEN_ARRAYS], uses_carried;
};

/* ---- Values and expressions ---- */

/* Prints the expression of e, even if e is a statement. */
void emit_definition(struct emission *emission, struct text *text, expression e);
/* Prints the same after `=` or as an argument, where lanes require a vector instead of a plain number. */
void emit_assigned(struct emission *emission, struct text *text, expression e);
const char *emit_zero(const struct emission *emission);
/* Prints a reference to e: its name if it has one, else its expression. */
void emit_value(struct emission *emission, struct text *text, expression e);
/* Prints the name of the value that a statement defines. */
void emit_name(struct emission *emission, struct text *text, expression e);
void emit_name_values(struct emission *emission);
/* emit_names.c: how tightly an operator binds in C. */
enum binding { BINDS_SUM = 1, BINDS_PRODUCT, BINDS_ATOM };
enum binding binding_of(const struct node *node);
/* Prints first + stride * e, the place of an element's value in an array. */
void emit_run_index(struct text *text, int first, int stride);

/* ---- Splines, loops, sines and cosines ---- */

/* The functions of the used splines, for the first source file, and their prototypes. */
void emit_spline_functions(struct emission *emission, struct text *text);
void emit_spline_prototypes(struct emission *emission, struct text *text);

/* Loops after the straight-line code. `local` precedes the names of local arrays. */
void emit_loops(struct emission *emission, struct text *text, const struct function *function,
                const char *local);
/* The text of an array in these loops. */
const char *emit_array_text(struct emission *emission, const struct function *function, int array,
                            const char *local);
/* emit_sincos.c: the pass over angles, once for each file. */
void emit_sincos(struct emission *emission, struct text *text);
/* In lanes: the parts of the pass that the current file uses, before its functions. */
void emit_lane_sincos(struct emission *emission, struct text *text);
/* Determines the angles in the pass of the current function. */
void emit_begin_angles(struct emission *emission);
void emit_angle_arrays(const struct emission *emission, struct text *text);
void emit_angle_pass(struct emission *emission, struct text *text);
/* Prints the array entry that has the value of e; false: there is none. */
bool emit_angle(struct emission *emission, struct text *text, expression e);

/* ---- Constants, functions and headers ---- */

/* The beginning of a name, without the number at its end. */
struct stem {
    const char *text;
    int length;
};

/* emit_constants.c: sets the numbers of the runs. */
void emit_number_runs(struct emission *emission);
/* The run that begins at coordinate i and whose elements have consecutive numbers in their names; else -1. */
int emit_named_run(const struct emission *emission, int i);
/* The stem of the names of joint k of each element. */
struct stem emit_name_stem(const struct emission *emission, const struct element_run *run, int k);

void emit_constants(const struct emission *emission, struct text *text);
/* emit_tables.c: declare the tables of spatial Jacobians and of joint limits, if the model has any. */
void emit_spatial_declaration(const struct emission *emission, struct text *text);
void emit_limits_declaration(const struct emission *emission, struct text *text);
void emit_header(struct emission *emission, struct text *text);
/* Prints a function and returns where its text begins. */
const char *emit_function(struct emission *emission, struct text *text, const struct function *function);

/* emit_summary.c: characters of the longest name of a function, for columns; at least 10. */
int emit_name_width(const struct plan *plan);
/* emit_real.c: bytes of a number of the emitted C. */
int emit_real_bytes(const struct plan *plan);
/* A file of C for doubles as C for floats. `outside` receives the first constant that no normal float can
 * represent. */
struct text emit_as_single(struct memory *memory, const char *text, const char **outside);

/* Numbers on the stack where that many values are alive. */
long emit_places_of_values(const struct plan *plan, long alive);

/* emit_stack.c: upper bounds of the bytes of stack, of a function by its text without the functions that it
 * calls, and of a function with them. */
long emit_own_stack(const struct emission *emission, const char *text);
long emit_stack(const struct emission *emission, const struct function *function);

/* ---- Companion files ---- */

/* The first line of a companion file, which says what it is. */
const char *emit_lead(struct memory *memory, const char *model, const char *what);

/* emit_step.c: NAME_step.h and NAME_step.c. */
void emit_step(struct emission *emission, struct text *header, struct text *source);
/* The names of the methods, by number from 0; NULL: there are no more. */
const char *emit_step_method(int number);
/* Number of doubles at `work` of the method with that number. */
long emit_step_work(const struct plan *plan, int method, bool has_derivatives);
/* The place of a part among a step's derivatives, and its columns; 0: there is no such part. NULL: the
 * place after all parts. */
struct step_place {
    int offset, columns;
};
struct step_place emit_step_place(const struct plan *plan, const char *part);
/* emit_casadi.c: NAME_casadi.c. */
void emit_casadi(struct emission *emission, struct text *text);
/* emit_lanes.c: NAME_lanes.h and NAME_lanes.c, which follow the files of the model. */
void emit_lanes(struct emission *emission, struct text *header, struct text *source);
/* The beginning of the name of an operator's function: "sin" of sin_lanes. */
const char *emit_lane_function(enum operation operation);

/* ---- Tables ---- */

/* Structs of parameters, inputs and results. */
void emit_structs(struct emission *emission, struct text *text);
void emit_tables(struct emission *emission, struct text *text, const char *hash);
/* The functions with the one signature of the table, and the table's entries from `start` on. */
void emit_adapters(struct emission *emission, struct text *text);
void emit_before_table(struct text *text, const char *model, const char *macro, const char *header,
                       int version);
void emit_table_of_functions(struct emission *emission, struct text *text);
/* The conditions that a source file checks when it is compiled. */
void emit_refusal(const struct plan *plan, struct text *text, const char *file);
/* Lists the GIVEN_ARRAYS arrays that a function expects after qd. */
void emit_list_given(const struct plan *plan, const struct function *function, struct given_array *list);
/* "void NAME_M(const struct NAME_parameters *p, ..., double M[9])" */
void emit_signature(struct emission *emission, struct text *text, const struct function *function);

#endif
