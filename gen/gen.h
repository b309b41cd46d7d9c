/*
 * The generator, one call after another. The tool and the tests use this header; gen.c has the list of
 * passes.
 */
#ifndef REFDYN_GEN_GEN_H
#define REFDYN_GEN_GEN_H

#include "gen/model_file/model_file.h"

#include <setjmp.h>
#include <stdio.h>

struct plan;

struct generation {
    struct memory memory;
    struct graph graph;
    struct messages messages;
    struct model model;
    struct tree tree, rolled; /* as read, and with runs of equal elements rolled (tree.h) */
    struct plan *plan;
    const char *emit; /* the requested quantities, as in gen_plan */
    bool has_lanes;   /* set before gen_plan: also emit the files for lanes */
    bool has_casadi;  /* set before gen_plan: also emit the file for CasADi */
    bool is_single;   /* set before gen_plan: the C computes in single precision, without files for lanes or
                         CasADi */
    jmp_buf out_of_memory;
};

enum gen_status { GEN_OK, GEN_MODEL_ERROR, GEN_NO_MEMORY, GEN_NOT_WRITTEN };

/* Reads, checks and expands a model. `allowance` is that of base.h; -1 except in tests. Call gen_release
 * in any case. A model that exceeds its bound of memory is a GEN_MODEL_ERROR, also in gen_plan. */
enum gen_status gen_read(struct generation *generation, const struct read_request *request, long allowance);
/* The message about a wrong list of quantities, with the allowed ones; NULL: the list is right. Call it
 * before gen_plan. */
const char *gen_wrong_emit(struct generation *generation, const char *emit);
/* Returns whether a list of quantities names this one, as a whole or by a block; "all" and NULL name all. */
bool gen_is_named(const char *emit, const char *quantity);
/* Returns whether a list of quantities asks for fixed steps. */
bool gen_has_steps(const char *emit);
/* Derives and plans the functions named in `emit`: comma-separated quantities, "all", or NULL for all that
 * the scene has except derivatives. Reports an error if the scene lacks them all. */
enum gen_status gen_plan(struct generation *generation, const char *emit);
/* Does the same up to a pass and prints its result, for people who change the generator. */
enum gen_status gen_explain(struct generation *generation, const char *emit, const char *pass, FILE *out);
/* The passes that can be shown, by number from 0; NULL: there are no more. */
const char *gen_pass(int number);
/* The message about a wrong name of a pass, with the allowed ones; NULL: the name is right. Call it before
 * gen_explain. */
const char *gen_wrong_pass(struct generation *generation, const char *pass);
/* Reports an error if the folder has a file with the name of one of ours that belongs to another model. */
enum gen_status gen_check_folder(struct generation *generation, const char *directory);
/* Removes the parts NAME_2.c ... of a longer earlier emission from the folder, because they would be
 * compiled with this one. Other files with such names stay. */
enum gen_status gen_remove_stale_parts(struct generation *generation, const char *directory);
/* The requested quantities that the model does not have, with reasons; NULL: it has all. */
const char *gen_left_out(const struct generation *generation);
/* Prints what was emitted: coordinates, operation counts, omitted quantities. */
void gen_print_summary(const struct generation *generation, FILE *out);
/* Prints the tree of links, coordinates, constraints and parameters, as `refdyn check` shows it. */
void gen_print_model(const struct generation *generation, FILE *out);
void gen_release(struct generation *generation);
/* The place in the model's files of the requirement with that number in the emitted table. */
struct place gen_requirement_place(const struct generation *generation, int number);

/* Returns whether it is the name of a file for lanes. */
bool gen_is_for_lanes(const char *name);
/* The files of the emitted C, as text. */
struct emitted_file {
    const char *name; /* without folder */
    const char *text;
    size_t length;
};
int gen_file_count(const struct generation *generation);
const struct emitted_file *gen_files(const struct generation *generation);

/* Operations of one emitted function; those in loops count once for each repetition. */
struct operation_count {
    const char *quantity;
    long adds, muls, divs, functions, bytes; /* bytes read and written of parameters, state and results */
};
/* The quantity must be emitted. */
const struct operation_count *gen_count(const struct generation *generation, const char *quantity);

/* An emitted function, and the named parts of its result in their order: the facts that NAME.h states as
 * text. */
struct emitted_function {
    const char *quantity, *about;
    int given_count;   /* numbers that it reads after qd: qdd (n), or qdd (n), power (1), lambda (m) */
    bool is_struct;    /* its result is a struct of its parts, not an array */
    bool reads_inputs; /* itself, not by functions that it calls */
    int part_count;
};
struct result_part {
    const char *name, *about;
    int count, columns; /* numbers in all, and numbers in a row of a matrix; 0: a vector */
};
/* Functions by number from 0; false: there are no more. */
bool gen_function(const struct generation *generation, int number, struct emitted_function *function);
struct result_part gen_result_part(const struct generation *generation, int function, int part);
/* All existing quantities, whether the scene has them or not, by number from 0; NULL: there are no more. */
const char *gen_quantity(int number);
/* What a scene without quantity `number` does not have; NULL: the scene has the quantity. */
const char *gen_lack(const struct generation *generation, int number);

#endif
