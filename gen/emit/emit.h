/*
 * What the parts of the C printer share: names of values and the text of expressions.
 */
#ifndef REFDYN_GEN_EMIT_H
#define REFDYN_GEN_EMIT_H

#include "gen/base/base.h"
#include "gen/plan/plan.h"

/* An array that a function takes behind qd: by coordinate, by row. */
enum { GIVEN_ARRAYS = 2 };
struct given_array {
    const char *name;
    int count; /* 0: it takes none */
    int place; /* of its first entry, from qd */
};

enum { MOST_COMPANIONS = 5 }; /* files beside those of the model */

struct emission {
    struct plan *plan;
    struct graph *g;
    const char *name; /* what the names of functions and structs begin with: the model's own, or NAME_lanes */
    const char *number;            /* the type of numbers: "double" or "lane" */
    bool is_lanes;                 /* the file of lanes is printed: emit_lanes.c */
    bool *uses_spline;             /* in lanes, by spline */
    bool uses_operation[OP_COUNT]; /* in lanes: by a function of the file's beginning */
    const char *
        *value_names; /* by handle: names given by the derivation, unique; NULL: numbered in its function */
    int *temporary;   /* by handle: number of a value without a name in the function being printed */
    int *piece_of;    /* by handle: piece that computes it in the function being printed */
    bool *is_carried; /* by handle: used in a later piece */
    bool *is_read;    /* by handle: used in the piece that computes it */
    const char **slot_names;         /* by slot: what a loop carries is called */
    int *slot_piece;                 /* by slot: piece whose loop sets it */
    bool *is_slot_carried;           /* by slot: read in a later piece */
    const struct function *function; /* being printed */
    int piece;                       /* being printed; -1 in `prepare` */
    int group;                       /* of loops, being printed; 0: none */
    bool is_cut;                     /* the function being printed is cut into pieces */
    int *run_numbers; /* by run: in the name of its first element; -1: the names are not numbered on from
                         there */
    long *own_bytes;  /* by function: of its local arrays, without those of functions that it calls */
    struct angle_range angles; /* of the function being printed: those in its pass */
    bool has_sincos;           /* the file being printed has the pass over angles */
    bool uses_p, uses_x, uses_t, uses_q, uses_qd, uses_given[GIVEN_ARRAYS], uses_carried;
};

/* The expression of e, its own value spelled out even when it is a statement. */
void emit_definition(struct emission *emission, struct text *text, expression e);
/* The same behind `=` and as an argument, where lanes want a vector of a plain number. */
void emit_assigned(struct emission *emission, struct text *text, expression e);
const char *emit_zero(const struct emission *emission);
/* A reference to e: its name where it has one, else its expression. */
void emit_value(struct emission *emission, struct text *text, expression e);
/* The name of the value that a statement defines. */
void emit_name(struct emission *emission, struct text *text, expression e);
void emit_name_values(struct emission *emission);
/* emit_expression.c: how tightly an operator binds in C. */
enum binding { BINDS_SUM = 1, BINDS_PRODUCT, BINDS_ATOM };
enum binding binding_of(const struct node *node);
/* first + stride * e */
void emit_run_index(struct text *text, int first, int stride);

/* Splines that the functions use: in the first source, and their prototypes. */
void emit_spline_functions(struct emission *emission, struct text *text);
void emit_spline_prototypes(struct emission *emission, struct text *text);

/* Loops behind the straight-line code; `local` stands before the names of local arrays. */
void emit_loops(struct emission *emission, struct text *text, const struct function *function,
                const char *local);
/* Do they write all entries of an array, so that it need not be cleared? */
bool emit_is_written_by_loops(const struct function *function, int array);
/* How an array is called there. */
const char *emit_array_text(struct emission *emission, const struct function *function, int array,
                            const char *local);
enum { SINCOS_BYTES = 3 * FEWEST_ANGLES * (int)sizeof(double) }; /* of local arrays of the pass */
/* Sines and cosines in one pass (emit_sincos.c): the pass, once a file; its arrays; its call; */
void emit_sincos(struct emission *emission, struct text *text);
/* In lanes: what the file being printed has used of it, before its functions. */
void emit_lane_sincos(struct emission *emission, struct text *text);
/* Which angles the pass of the function being printed has. */
void emit_begin_angles(struct emission *emission);
void emit_angle_arrays(const struct emission *emission, struct text *text);
void emit_angle_pass(struct emission *emission, struct text *text);
/* and the array entry that e is; false when it is none. */
bool emit_angle(struct emission *emission, struct text *text, expression e);

/* The beginning of a name, without the number at its end. */
struct stem {
    const char *text;
    int length;
};

/* emit_constants.c: sets the numbers of the runs; */
void emit_number_runs(struct emission *emission);
/* the run that begins at coordinate i and whose elements' names are numbered, else -1; */
int emit_named_run(const struct emission *emission, int i);
/* the stem of the names of joint k of each element. */
struct stem emit_name_stem(const struct emission *emission, const struct element_run *run, int k);

/* local_arrays.c: bytes of local arrays that a text declares; those of one call, with all that it calls. */
long local_arrays_count_bytes(const char *text);
long local_arrays_bytes(const struct emission *emission, const struct function *function);

/* The parts of a model's files. */
void emit_constants(const struct emission *emission, struct text *text);

/* emit_spatial.c: the same of spatial Jacobians; is the function one of theirs? */
void emit_spatial_declaration(const struct emission *emission, struct text *text);
void emit_spatial(const struct emission *emission, struct text *text);
bool emit_is_spatial(const struct function *function);

/* emit_limits.c: where a model has limits, their table, and what the header says of it. */
void emit_limits_declaration(const struct emission *emission, struct text *text);
void emit_limits(const struct emission *emission, struct text *text);
void emit_header(struct emission *emission, struct text *text);
/* Gives the bytes of its local arrays. */
long emit_function(struct emission *emission, struct text *text, const struct function *function);

/* emit_companions.c: the files that stand beside those of the model, behind them in the list. */
void emit_companions(struct emission *emission);
const char *emit_lanes_name(struct memory *memory, const char *model, const char *ending);
const char *emit_lanes_lead(struct memory *memory, const char *model);
/* The first line of such a file, which says what it is. */
const char *emit_lead(struct memory *memory, const char *model, const char *what);
void emit_add_file(struct plan *plan, const char *name, const struct text *text);

/* emit_step.c: NAME_step.h and NAME_step.c. */
void emit_step(struct emission *emission, struct text *header, struct text *source);
/* The names of its methods, by number from 0; NULL: there are not so many. */
const char *emit_step_method(int number);
/* Doubles at `work`. */
long emit_step_work(const struct plan *plan);
/* Where a part of its derivatives stands among them, and its columns; 0: it has none. NULL: behind all parts.
 */
struct step_place {
    int offset, columns;
};
struct step_place emit_step_place(const struct plan *plan, const char *part);

/* pattern.c: by entry, may it be other than zero? */
const bool *emit_pattern(const struct plan *plan, const struct function *function, int array);
/* emit_casadi.c: NAME_casadi.c. */
void emit_casadi(struct emission *emission, struct text *text);

/* emit_lanes.c: NAME_lanes.h and NAME_lanes.c, behind the files of the model; */
void emit_lanes(struct emission *emission, struct text *header, struct text *source);
/* what its function of an operator begins with: "sin" of sin_lanes. */
const char *emit_lane_function(enum operation operation);
/* Structs of parameters, inputs and results. */
void emit_structs(struct emission *emission, struct text *text);
void emit_tables(struct emission *emission, struct text *text, const char *hash);
/* The functions in the one form of the table, and its entries from `start` on. */
void emit_adapters(struct emission *emission, struct text *text);
void emit_before_table(struct text *text, const char *model, const char *macro, const char *header,
                       int version);
void emit_table_of_functions(struct emission *emission, struct text *text);
/* What a source begins with: what it needs of the compiler. */
void emit_refusal(struct text *text, const char *file);
/* Those of a function: GIVEN_ARRAYS of them. */
void emit_list_given(const struct plan *plan, const struct function *function, struct given_array *list);
/* "void NAME_M(const struct NAME_parameters *p, ..., double M[9])" */
void emit_signature(struct emission *emission, struct text *text, const struct function *function);

#endif
