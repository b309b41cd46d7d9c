/*
 * A sweep file as plain data: what varies and how, what is derived from that, how the motions run, what is
 * kept.
 *
 * Takes the file, which runs in the sandbox of model files; knows no model, so that it takes any name.
 * Complaints about the rest are collected in `messages`, to which the caller may add. The cases themselves
 * are the caller's: it makes their columns and has the derived ones computed.
 */
#ifndef REFDYN_GEN_SWEEP_FILE_H
#define REFDYN_GEN_SWEEP_FILE_H

#include "base/memory.h"
#include "base/message.h"
#include "graph/graph.h"

#include <setjmp.h>

/* What the values of a column are. */
enum case_values { CASES_NUMBERS, CASES_WHOLE, CASES_TRUTHS, CASES_TEXTS };

/* One name of all cases. */
struct case_column {
    const char *name;
    struct place place;
    enum case_values kind;
    double *values;     /* (count) numbers; of truths 0 or 1; of texts, which of them */
    const char **texts; /* (text_count) of CASES_TEXTS */
    int text_count;
};

struct case_table {
    long count;
    int width;
    struct case_column *columns;
};

/* How a column varies: its list, or a range of points or of random numbers. */
enum vary_form { VARY_LIST, VARY_GRID, VARY_LOG_GRID, VARY_UNIFORM, VARY_LOG_UNIFORM, VARY_NORMAL };

struct vary {
    const char *name;
    struct place place;
    enum vary_form form;
    double from, to;         /* of VARY_NORMAL: mean and standard deviation */
    double count;            /* of a list or grid, 1 for a single value; random: 0 */
    struct case_column list; /* of VARY_LIST: its values */
};

bool vary_is_random(const struct vary *vary);

enum sequence { SEQUENCE_RANDOM, SEQUENCE_SOBOL, SEQUENCE_HALTON };

/* How the motions run, as the options of `sim`: 0 and NULL where the file does not say. */
struct sweep_run {
    double t_end, tol, step, step_max, every;
    const char *method, *from, *stabilise, *singular, *start, *way;
    const char *hold, *release; /* names, commas between */
};

struct sweep_names {
    const char **names;
    struct place *places; /* (count) */
    int count;
};

struct sweep_keep {
    bool final;
    struct sweep_names extremes, norms, history;
    double *at; /* (at_count) ascending, not below 0 [s] */
    int at_count;
    struct place at_place;
};

struct value;
struct script;

struct sweep_file {
    struct memory memory;
    struct graph graph;
    struct messages messages;
    jmp_buf out_of_memory;
    struct script *script;
    struct place place;  /* of the sweep */
    struct vary *varies; /* (vary_count) in the order of their names */
    int vary_count;
    double draws; /* of each point of the grids; 1 where nothing is random */
    double seed;
    bool has_seed;
    enum sequence sequence;
    double cases_max;
    const struct value *derive; /* NULL: nothing is derived */
    struct sweep_run run;
    struct sweep_keep keep;
};

/* The functions of sweep files, by number, with the names of their arguments, commas between; NULL behind the
 * last one. For editors. */
const char *sweep_file_function(int number, const char **arguments);

/* How many cases there are, which `cases_max` bounds once the file is read. */
double sweep_file_case_count(const struct sweep_file *file);

/* Where the file gives a field of rd.sweep; that of the sweep when it does not. */
struct place sweep_file_place(const struct sweep_file *file, const char *field);

/* False: messages say why, or memory is short, when there is none. sweep_file_release in any case. */
bool sweep_file_read(struct sweep_file *file, const char *path);
/* Computes what the file derives from the columns of `given`, and gives these new columns, in the order of
 * their names; they live in `memory`. False as above. */
bool sweep_file_derive(struct sweep_file *file, const struct case_table *given, struct memory *memory,
                       struct case_table *derived);
/* The text of all files that it was read from, in `memory`. */
const char *sweep_file_text(const struct sweep_file *file, struct memory *memory);
void sweep_file_release(struct sweep_file *file);

#endif
