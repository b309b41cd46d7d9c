/* Sweeps: from a sweep file or a table of cases to the cases of a batch and the models that compute them.
 * Parts: sweep files; names; cases; structures; sweeps, read for one model; sets of texts. */
#ifndef REFDYN_TOOL_SWEEPS_H
#define REFDYN_TOOL_SWEEPS_H

#include <stdbool.h>
#include <stdint.h>

#include "gen/base/base.h"
#include "gen/gen.h"
#include "gen/script/script.h"
#include "refdyn_batch.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/* A sweep file as plain data: what varies and how, what is derived, how the motions run, and what is kept. It
 * is read without the model, so that it may contain any name. The caller makes the columns of the cases and
 * has the derived ones computed. */

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

bool sweeps_is_random(const struct vary *vary);

enum sequence { SEQUENCE_RANDOM, SEQUENCE_SOBOL, SEQUENCE_HALTON };

/* How the motions run, as the options of `sim`; 0 or NULL if the file does not say. */
struct sweep_run {
    double t_end, tol, tol_rates, step, step_max, every, before, after, mesh;
    bool realise;
    const char *method, *from, *stabilise, *singular, *start, *way;
    const char *hold, *release; /* names separated by commas */
};

struct sweep_keep {
    bool final, limits;
    struct plain_names extremes, norms, history, derivatives;
    double *at; /* (at_count) ascending, not below 0 [s] */
    int at_count;
    struct place at_place;
};

struct sweep_file {
    struct plain_file plain;
    struct place place;  /* of the sweep */
    const char *table;   /* file with the cases, instead of `varies`; NULL: none */
    struct vary *varies; /* (vary_count) in the order of their names */
    int vary_count;
    double draws; /* of each point of the grids; 1 where nothing is random */
    double seed;
    bool has_seed;
    enum sequence sequence;
    double cases_max;
    const struct value *derive; /* NULL if nothing is derived */
    struct sweep_run run;
    struct sweep_keep keep;
};

/* The number of cases, at most `cases_max` once the file is read. */
double sweeps_file_case_count(const struct sweep_file *file);

/* The place of a field of rd.sweep, or of the sweep if it does not have the field. */
struct place sweeps_file_place(const struct sweep_file *file, const char *field);

/* Returns false after an error, which is in messages; without a message, memory is exhausted. Call
 * sweeps_file_release in any case. */
bool sweeps_file_read(struct sweep_file *file, const char *path);
/* Computes what the file derives from the columns of `given`: new columns in the order of their names, in
 * `memory`. Returns false as above. */
bool sweeps_file_derive(struct sweep_file *file, const struct case_table *given, struct memory *memory,
                        struct case_table *derived);
/* The text of all files that it was read from, in `memory`. */
const char *sweeps_file_text(const struct sweep_file *file, struct memory *memory);
void sweeps_file_release(struct sweep_file *file);

/* Names: which part of the model each varied name is. Values come in under the names that a sweep or a table
 * uses; columns of cases go out, or errors in `messages`. */

struct case_names {
    struct memory *memory;
    struct messages *messages;
    const struct generation *generation; /* of the model with the settings of the command line */
    const struct options *options;
    const char *folder; /* of the sweep or the table, "" or with / at its end; paths of sample files are
                           relative to it */
};

/* Sets *varied to what the name is; a column of texts or numbers may have other values than it needs. Returns
 * false and reports an error at `path` if the name has two kinds, or none while no options vary.
 * varied->target stays NULL while the name is not known yet. */
bool sweeps_names_find(const struct case_names *names, const char *path, const struct case_column *column,
                       bool options_vary, struct varied *varied);
/* Returns whether the model has an option of this name. */
bool sweeps_names_is_option(const struct case_names *names, const char *name);
/* Converts the values of the column to those that its kind needs; returns false and reports the error if it
 * cannot. */
bool sweeps_names_convert(const struct case_names *names, const char *path, const struct case_column *column,
                          long count, struct varied *varied);
/* Reads each structure of the cases, resolves the names that are not known yet, and checks that the files of
 * samples can be read. */
bool sweeps_names_check(const struct case_names *names, const struct case_table *table, struct cases *cases);

/* The cases: each point of the grids and lists, and the draws of each. */
void sweeps_expand_cases(const struct sweep_file *file, struct memory *memory, struct case_table *cases);

/* Kept values: names of columns as in the CSV of `sim`. */

struct name_list {
    const char **names;
    const char *const *places; /* (count) "FILE:LINE", where the sweep names each */
    int count;
};

struct keep {
    bool final;                /* the state at the end: t, coordinates, rates, points */
    bool realise;              /* the numbers of the report of --realise */
    bool limits;               /* of the model: extremes, first time beyond and duration */
    struct name_list extremes; /* smallest and largest value over the outputs, with their times */
    struct name_list norms;    /* root mean square over time */
    struct name_list history;  /* the value at each output */
    struct name_list
        derivatives;  /* parameters, inputs and start values by which the final state is differentiated */
    const double *at; /* (at_count) further times at which the state is kept, ascending [s] */
    int at_count;
};

/* Structures: cases with equal options share one structure of the model, which is compiled once. */

struct structure {
    struct options options; /* of the command, and the values of the options that vary */
    struct scene scene;
    struct scene played;     /* with --realise: the scene without its programme */
    unsigned needs;          /* of the scene */
    bool is_open, is_played; /* scene_close must be called, for both */
    long example;            /* number of one of its cases */
    long *numbers;           /* (count) of its cases that are computed, ascending */
    long count;
    struct refdyn_batch_column *columns; /* the varied values that this model has */
    struct refdyn_samples *samples;      /* read from the files of inputs */
    int column_count, sample_count;
    int *held; /* (held_count) coordinates that statics keeps at their start */
    int held_count;
    struct refdyn_statics_options statics;
};

/* All structures of a batch are open at once, each with its compiled library and its model in memory. */
enum { STRUCTURES_MOST = 512 };

struct structures {
    struct structure *list;
    int count, room;
};

/* Groups all cases, of which [first, end) are computed. All of them count, so that the layout of the results
 * is the same for every range. Reports an error if there are too many structures. */
enum status sweeps_structures_sort(struct structures *structures, struct memory *memory,
                                   const struct cases *cases, long first, long end,
                                   const struct options *options);
/* Generates, compiles and loads all structures, several at the same time; then looks up in each model what
 * varies. Reports what a structure lacks. Call sweeps_structures_close in any case. */
enum status sweeps_structures_open(struct structures *structures, struct memory *memory,
                                   const struct cases *cases, const struct refdyn_options *integration,
                                   int threads);
/* Returns whether the case lacks a number that it needs, and writes which. NaN of a parameter that the model
 * anchors leaves it to the start of the motion, except where statics needs it. */
bool sweeps_structures_refuse(const struct structure *structure, const struct cases *cases, long number,
                              char fact[static REFUSED_LENGTH]);
void sweeps_structures_close(struct structures *structures);

/* Sweeps: a sweep file in Lua or a table of cases as CSV, read for one model. Errors go to stderr as
 * FILE:LINE. */

struct sweep {
    struct cases cases;
    struct keep keep;
    const char *text;  /* everything that the cases come from; the batch is identified by its hash */
    const char *table; /* file of the cases that the sweep file names, or NULL */
};

/* The sweep lives in `memory`. Options of the motions that the file sets (t_end tol method from every ...) go
 * into *options, unless the command line sets them. */
enum status sweeps_read(struct sweep *sweep, struct memory *memory, const char *path,
                        const struct generation *generation, struct options *options);
/* A table has one row a case and a column for each varied name. Its batch keeps final states. */
enum status sweeps_read_table(struct sweep *sweep, struct memory *memory, const char *path,
                              const struct generation *generation, const struct options *options);

/* Text sets: different texts, numbered in the order in which they were added. */
struct text_set {
    struct memory *memory; /* of the texts; the caller sets it and leaves the other members 0 */
    const char **texts;    /* (count) */
    int count, room;
    int *places; /* (place_count) hash table: number of a text plus one; 0 if free */
    int place_count;
};

/* Returns the number of the text; the set keeps a copy of a new one. */
int sweeps_text_set_add(struct text_set *set, const char *text);

#endif
