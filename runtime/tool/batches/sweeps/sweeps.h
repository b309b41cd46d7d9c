/* What this folder offers. */
#ifndef REFDYN_TOOL_SWEEPS_H
#define REFDYN_TOOL_SWEEPS_H

#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>

#include "gen/base/base.h"
#include "gen/gen.h"
#include "gen/read/read.h"
#include "refdyn_batch.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/*
 * A sweep file as plain data: what varies and how, what is derived, how the motions run, and what is kept.
 *
 * The file runs in the sandbox of model files. It is read without the model, so that it may contain any name.
 * Errors are collected in `messages`, to which the caller may add. The caller makes the columns of the cases
 * and has the derived ones computed.
 */

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

/* How the motions run, as the options of `sim`; 0 or NULL if the file does not say. */
struct sweep_run {
    double t_end, tol, step, step_max, every;
    const char *method, *from, *stabilise, *singular, *start, *way;
    const char *hold, *release; /* names separated by commas */
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
    const struct value *derive; /* NULL if nothing is derived */
    struct sweep_run run;
    struct sweep_keep keep;
};

/* The number of cases, at most `cases_max` once the file is read. */
double sweep_file_case_count(const struct sweep_file *file);

/* The place of a field of rd.sweep, or of the sweep if it does not have the field. */
struct place sweep_file_place(const struct sweep_file *file, const char *field);

/* False after an error, which is in messages; without a message, memory is short. Call sweep_file_release in
 * any case. */
bool sweep_file_read(struct sweep_file *file, const char *path);
/* Computes what the file derives from the columns of `given`: new columns in the order of their names, in
 * `memory`. False as above. */
bool sweep_file_derive(struct sweep_file *file, const struct case_table *given, struct memory *memory,
                       struct case_table *derived);
/* The text of all files that it was read from, in `memory`. */
const char *sweep_file_text(const struct sweep_file *file, struct memory *memory);
void sweep_file_release(struct sweep_file *file);

/* Complaints about cases on stderr, and the folder that files of theirs are named from. */

/* FILE:LINE: text, by line. */
void case_messages_print(struct messages *messages);
/* The folder of a file with / at its end, "" for the present one. */
const char *case_folder(struct memory *memory, const char *path);

/*
 * Names that vary: which parameter, input, option, start value or files of samples of the model each of them
 * is.
 *
 * Takes columns of values under the names that a sweep or a table gives them; gives columns of cases, or
 * complaints in `messages`. A name that the model lacks may be one of another structure of it, where options
 * vary: each structure that the cases need is read, which also says whether it may be.
 */

struct case_names {
    struct memory *memory;
    struct messages *messages;
    const struct generation *generation; /* of the model as the command line has it */
    const struct options *options;
    const char *folder; /* of the sweep or the table, "" or with / at its end: files of samples are named from
                           there */
};

/* What the name is; a column of texts or numbers of that name may have other values than it needs. False,
 * with a complaint that calls it `path`, when it is of two kinds, or of none while no options vary. Without a
 * target: not known yet. */
bool case_names_find(const struct case_names *names, const char *path, const struct case_column *column,
                     bool options_vary, struct varied *varied);
/* Is that the name of an option? */
bool case_names_is_option(const struct case_names *names, const char *name);
/* Makes the values of the column those that the kind needs; false with a complaint. */
bool case_names_convert(const struct case_names *names, const char *path, const struct case_column *column,
                        long count, struct varied *varied);
/* Reads each structure of the cases, finds the names that are not known yet, and the files of samples. */
bool case_names_check(const struct case_names *names, const struct case_table *table, struct cases *cases);

/*
 * The cases of a sweep: each point of its grids and lists, and the draws of each.
 *
 * The first name varies slowest, then the others in the order of their names, then the draws. Random numbers
 * are those of sweeps.h by the seed, the column's name and the number of the case. A quasi-random sequence is
 * the same at each point of the grids, its dimensions are the random columns in the order of their names, and
 * a seed shifts it (modulo 1, Cranley and Patterson).
 */

/* Lives in `memory`. */
void sweeps_expand_cases(const struct sweep_file *file, struct memory *memory, struct case_table *cases);

/*
 * What a batch keeps of each motion, as the sweep asks for it: names of columns as in the CSV of `sim`.
 */

struct name_list {
    const char **names;
    const char *const *places; /* (count) "FILE:LINE", where each is asked for */
    int count;
};

struct keep {
    bool final;                /* the state at the end: t, coordinates, rates, points */
    struct name_list extremes; /* smallest and largest value over the outputs, with their times */
    struct name_list norms;    /* root mean square over time */
    struct name_list history;  /* the value at each output */
    const double *at; /* (at_count) ascending times at which all that `final` keeps is kept, too [s] */
    int at_count;
};

/* Quasi-random sequences of GSL (gsl_qrng): points that fill a cube more evenly than random ones. */

/* Is the program built with GSL? */
bool quasi_random_is_there(void);
/* The first `count` points of a sequence in `width` dimensions: coordinate i of point k at points[k * width +
 * i], in [0, 1). The width is one that the sequence has. */
void quasi_random_points(enum sequence sequence, int width, long count, double *points);

/*
 * Random numbers of cases: each a function of the seed, the column's name and the case's number alone, so
 * that neither the order of the work nor another column changes it, and the same to the bit on each machine:
 * nothing but additions, multiplications, divisions and square roots of IEEE numbers, none of libm's
 * functions.
 */

/* Philox 4x32-10 of a counter and a key, which are as long as its result. */
void random_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t result[4]);
/* Uniform in (0, 1), without the ends. `stream`: random_stream of a name. */
double random_uniform(uint64_t seed, uint64_t stream, uint64_t number);
uint64_t random_stream(const char *name);
/* The value below which a standard normal variable lies with probability u, 0 < u < 1. */
double random_normal_quantile(double u);
/* Natural logarithm and exponential, to a few units in the last place; x > 0 and finite, result finite. */
double random_log(double x);
double random_exp(double x);

/*
 * The structures of a batch: its cases sorted by their options, and for each such group the model that is
 * compiled for it, with what varies in places of that model.
 */

struct structure {
    struct options options; /* of the command, and the values of the options that vary */
    struct scene scene;
    unsigned needs; /* of the scene */
    bool is_open;   /* the scene is to be closed */
    long example;   /* a case of it */
    long *numbers;  /* (count) of its cases that are computed, ascending */
    long count;
    struct refdyn_batch_column *columns; /* what varies and the model has */
    struct refdyn_samples *samples;      /* of the files of inputs */
    int column_count, sample_count;
    int *held; /* (held_count) coordinates that statics holds */
    int held_count;
    struct refdyn_statics_options statics;
};

/* Each is a compiled library with what was read of its model, all open at once. */
enum { STRUCTURES_MOST = 512 };

struct structures {
    struct structure *list;
    int count, room;
};

/* Sorts all cases, of which [first, end) are computed: what is kept of a case, and where, is the same for all
 * ranges. Complains of too many structures. */
enum status structures_sort(struct structures *structures, struct memory *memory, const struct cases *cases,
                            long first, long end, const struct options *options);
/*
 * Generates, compiles and loads all of them, several at the same time; then finds what varies in each.
 * Complains of what a structure lacks. structures_close in any case.
 */
enum status structures_open(struct structures *structures, struct memory *memory, const struct cases *cases,
                            const struct refdyn_options *integration, int threads);
void structures_close(struct structures *structures);

/*
 * A sweep file in Lua, or a table of cases as CSV: the cases of a batch, and what is to be kept.
 *
 * Takes a path and the model that was read; gives the cases, the options of the motions and what to keep, or
 * complaints as FILE:LINE on stderr.
 */

struct generation;
struct memory;

struct sweep {
    struct cases cases;
    struct keep keep;
    const char *text; /* all that the cases come from: the hash of a batch is of it */
};

/* Lives in `memory`. Options of the motions that the file tells (t_end tol method from every ...) go into
 * *options, whose own values, from the command line, win. */
enum status sweep_read(struct sweep *sweep, struct memory *memory, const char *path,
                       const struct generation *generation, struct options *options);
/* One row a case, a column for each name that varies; final states are kept. */
enum status sweep_read_table(struct sweep *sweep, struct memory *memory, const char *path,
                             const struct generation *generation, const struct options *options);

/* Different texts, numbered in the order in which they came. */

struct memory;

struct text_set {
    struct memory *memory; /* of the texts; set by the user, all else 0 */
    const char **texts;    /* (count) */
    int count, room;
    int *places; /* (place_count) a hash table: number of a text plus one, 0: free */
    int place_count;
};

/* The number of the text, of which the set keeps a copy. */
int text_set_add(struct text_set *set, const char *text);

#endif
