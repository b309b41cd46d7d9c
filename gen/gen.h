/*
 * The generator as one call after another; its pass list is gen.c. The tool and the tests use this header.
 */
#ifndef REFDYN_GEN_GEN_H
#define REFDYN_GEN_GEN_H

#include "gen/base/base.h"
#include "gen/model/model.h"
#include "gen/read/read.h"
#include "gen/tree/tree.h"

#include <setjmp.h>
#include <stdio.h>

struct plan;

struct generation {
    struct memory memory;
    struct graph graph;
    struct messages messages;
    struct model model;
    struct tree tree, rolled; /* see tree.h */
    struct plan *plan;
    const char *emit; /* what is asked for, as in gen_plan */
    bool has_lanes;   /* set before gen_plan: the files of lanes are emitted, too */
    bool has_casadi;  /* the same of the file for CasADi */
    jmp_buf out_of_memory;
};

enum gen_status { GEN_OK, GEN_MODEL_ERROR, GEN_NO_MEMORY, GEN_NOT_WRITTEN };

/* Reads, checks and expands. `allowance` as in base.h; -1 outside of tests. gen_release in any case. A
 * model that takes more memory than one may is GEN_MODEL_ERROR, also of gen_plan and gen_write. */
enum gen_status gen_read(struct generation *generation, const struct read_request *request, long allowance);
/* What is wrong with a list of quantities and what is allowed, or NULL: before gen_plan. */
const char *gen_wrong_emit(struct generation *generation, const char *emit);
/* Derives and plans the functions named in `emit` (comma-separated quantities, "all" or NULL: all that the
 * scene has, but derivatives). A complaint when the scene has none of them. */
enum gen_status gen_plan(struct generation *generation, const char *emit);
/* The same up to a pass, then prints what the generator holds behind it: for people who change the generator.
 */
enum gen_status gen_explain(struct generation *generation, const char *emit, const char *pass, FILE *out);
/* The passes that can be shown, by number from 0; NULL: there are not so many. */
const char *gen_pass(int number);
/* What is wrong with the name of a pass and what is allowed, or NULL: before gen_explain. */
const char *gen_wrong_pass(struct generation *generation, const char *pass);
/* Complains about a file in the folder that has the name of one of ours and is of another model. */
enum gen_status gen_check_folder(struct generation *generation, const char *directory);
/* Parts NAME_2.c ... of a longer emission before this one, in folder `directory`: they would be compiled with
 * it. What else has such a name stays. */
enum gen_status gen_remove_stale_parts(struct generation *generation, const char *directory);
/* What was emitted: coordinates, operation counts, what was left out. */
void gen_print_summary(const struct generation *generation, FILE *out);
/* The tree of links, coordinates, constraints and parameters, as `refdyn check` shows it. */
void gen_print_model(const struct generation *generation, FILE *out);
void gen_release(struct generation *generation);

/* Place in the model's files of the requirement with that number in the emitted table. */
struct place gen_requirement_place(const struct generation *generation, int number);

/* The files of the emitted C, as text. */
/* Is it the name of a file for lanes? */
bool gen_is_for_lanes(const char *name);
struct emitted_file {
    const char *name; /* without folder */
    const char *text;
    size_t length;
};
int gen_file_count(const struct generation *generation);
const struct emitted_file *gen_files(const struct generation *generation);

/* Operations of one emitted function, loops counted by their trips. */
struct operation_count {
    const char *quantity;
    long adds, muls, divs, functions, bytes; /* bytes read and written of parameters, state and results */
};
/* Of a quantity that is emitted. */
const struct operation_count *gen_count(const struct generation *generation, const char *quantity);

/* An emitted function, and the named parts of its result in their order: what NAME.h tells as text. */
struct emitted_function {
    const char *quantity, *about;
    bool takes_motion; /* behind qd stands what `constrained` gives: qdd (n), power (1), lambda (m) */
    bool is_struct;    /* its result is a struct of its parts, not an array */
    int part_count;
};
struct result_part {
    const char *name, *about;
    int count, columns; /* numbers; of a matrix those of a row, 0: a vector */
};
/* By number from 0; false: there are not so many. */
bool gen_function(const struct generation *generation, int number, struct emitted_function *function);
struct result_part gen_result_part(const struct generation *generation, int function, int part);
/* All quantities that there are, in a scene or not, by number from 0; NULL: there are not so many. */
const char *gen_quantity(int number);

/*
 * The interpreter of the plan: the judge of the emitted C. Same arguments as the emitted function of that
 * name; p starts with the parameters, the values derived from them are computed here. 0 when the function
 * exists.
 */
int gen_interpret(const struct generation *generation, const char *quantity, const double *p, const double *x,
                  double t, const double *q, const double *qd, double *out);

#endif
