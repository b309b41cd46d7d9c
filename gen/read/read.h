/* What reading a model file provides to the rest of the program. */
#ifndef REFDYN_GEN_READ_H
#define REFDYN_GEN_READ_H

#include <setjmp.h>
#include <stdbool.h>

#include "gen/base/base.h"
#include "gen/graph/graph.h"
#include "gen/model/model.h"
#include "gen/tree/tree.h"

/*
 * Names of a model that reach C: as members of structs, as the lead of functions and as names of files.
 *
 * Takes names with their places; complains about those that a compiler, a header or a library takes for
 * something else, and about those that are taken twice.
 */

struct named {
    const char *name;
    struct place place;
};

/* Identifiers of C and C++, each once within its kind ("link", "point" ...). */
void names_check(struct messages *messages, const char *kind, const struct named *list, int count);
/* The same for members of an emitted struct, which macros would replace. */
void names_check_members(struct messages *messages, const char *kind, const struct named *list, int count);
/* The model's name is that of its files and the lead of its functions: neither may be someone else's. */
void names_check_model(struct messages *messages, struct named named);

/* A value that the command line gives to an option or a parameter of the model: --set NAME=VALUE. */

struct setting {
    const char *name, *value;
};

/*
 * From a Lua file to the model: see model.h for the two steps. Complaints go to `messages`; a model with
 * errors is not used further.
 */

/* What a Lua file describes: each kind has functions of its own in rd. */
enum file_kind { FILE_MODEL, FILE_SWEEP };

struct read_request {
    const char *file;
    enum file_kind kind;
    const struct setting *settings; /* --set NAME=VALUE, later ones win */
    int setting_count;
    bool fold; /* parameters become numbers; anchored ones stay parameters */
    enum accelerations accelerations;
    enum loops loops;
};

struct script;

/*
 * Opens the file and runs it up to the model's table; NULL when that failed (messages say why). Complaints
 * that leave something to read leave a script too. It is never closed: what it takes lives in `memory` and
 * goes with it, and no code of the model runs any more.
 */
struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages);
/* Fills the model; after complaints it is whole, with harmless values for what is missing, but not to be
 * expanded. */
void read_scene(struct script *script, struct model *model);
/* Of a model and a tree without complaints; complains about unknown settings too. */
void read_programme(struct script *script, const struct tree *tree, struct model *model);
/* The files that it was read from; they outlive the script. */
const struct sources *script_sources(const struct script *script);

/* Checks that need no Lua: names, values at the parameters' defaults, references. */
void check_scene(const struct model *model, struct messages *messages);
void check_programme(const struct model *model, const struct tree *tree, struct messages *messages);

/* The Lua files of a model: its own, and those beside it that it requires. */

/* What the files of one model may be: one file of 4 MB describes 40,000 links. */
enum { SOURCES_BOUND = 100, SOURCE_MEGABYTES = 4 };

struct source_file {
    const char *path;
    const char *text;
    size_t length;
};

struct sources {
    struct source_file *list; /* the first is the model */
    int count, capacity;
    size_t length; /* of all */
};

/* What Lua calls the files in its messages, with their number behind it. */
#define SOURCE_CHUNK "model"

/* Reads one more; NULL, or why it cannot be read. Only regular files are: others may have no end, or wait. */
const char *source_file_add(struct memory *memory, struct sources *sources, const char *path);
/* The path of NAME.lua in the folder of the file `beside`. */
const char *source_file_path(struct memory *memory, const char *beside, const char *name);
/* Takes "model0:LINE: text"; gives the place, and in `rest` the text. Leaves `place` as it is, and gives
 * false, for a text without such a lead. */
bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest);

/*
 * Kinks of formulas in coordinates and rates: a motion's steps end on them, as on events without a name.
 *
 * Takes the formulas of forces, loads, energies and rows. Gives model->kinks, what changes sign at their
 * minima, maxima, absolute values and comparisons of coordinates, positions and rates; those of time alone
 * are others (quantities.h).
 */

void state_kinks_list(struct memory *memory, struct model *model);

/*
 * A sweep file as plain data: what varies and how, what is derived from that, how the motions run, what is
 * kept.
 *
 * Takes the file, which runs in the sandbox of model files; knows no model, so that it takes any name.
 * Complaints about the rest are collected in `messages`, to which the caller may add. The cases themselves
 * are the caller's: it makes their columns and has the derived ones computed.
 */

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
