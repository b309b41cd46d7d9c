/*
 * Reads model files, for the rest of the program. Parts, in reading order: names; model files; sources;
 * values; fields; files of other kinds; tables of cases.
 */
#ifndef REFDYN_GEN_READ_H
#define REFDYN_GEN_READ_H

#include <setjmp.h>

#include "gen/tree/tree.h"

/* ---- names: identifiers that reach C ---- */

/* A name that reaches C as a member of a struct, in a function's name or in a file's name. */
struct named {
    const char *name;
    struct place place;
};

/* Reports names that are not identifiers of C and C++ or are taken twice within their kind ("link" ...). */
void names_check(struct messages *messages, const char *kind, const struct named *list, int count);
/* The same for members of an emitted struct, which must not be macros either. */
void names_check_members(struct messages *messages, const char *kind, const struct named *list, int count);
/* The model's name begins the names of its files and functions, which must not be those of the system. */
void names_check_model(struct messages *messages, struct named named);

/* ---- model files: from a Lua file to the model, and its checks ---- */

/* A value of the command line for an option or a parameter of the model: --set NAME=VALUE. */
struct setting {
    const char *name, *value;
    const char *source; /* the option of the command line that states it, for messages; NULL: --set */
};
/* The option of the command line that states it. */
const char *setting_source(const struct setting *setting);

struct read_request {
    const char *file;
    enum file_kind {
        FILE_MODEL,
        FILE_SWEEP,
        FILE_FIT,
        FILE_PLAN
    } kind;                         /* each has its own functions in rd */
    const struct setting *settings; /* --set NAME=VALUE; the last one of a name is used */
    int setting_count;
    const char *name; /* replaces the model's name; NULL: the model keeps it */
    bool fold;        /* parameters become numbers, except for anchored ones */
    enum accelerations accelerations;
    enum loops loops;
    bool has_pulls; /* a hand can pull the points of interest (read_pulls.c) */
    enum programme {
        PROGRAMME_ACTS,  /* by ideal forces */
        PROGRAMME_RESTS, /* acts, and before t = 0 rests at its values of t = 0 */
        PROGRAMME_FREE   /* its rows are read and checked, but do not act: drives move the model */
    } programme;
};

struct script;

/* Opens the file and runs it up to the table that it returns. NULL after an error that ends the reading;
 * other errors are in `messages` only. The script is never closed: its memory is released with `memory`, and
 * no code of the model runs then. */
struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages);
/* Fills the model in the first of its two steps (model.h). After errors the model has harmless values for
 * what is missing, but must not be expanded. */
void read_scene(struct script *script, struct model *model);
/* The second step, for a model and a tree without errors. Reports unknown settings too. */
/* Also adds the frames of continuous states to the tree. */
void read_programme(struct script *script, struct tree *tree, struct model *model);

/* Checks that need no Lua: names, values at the parameters' defaults, references. */
void check_scene(const struct model *model, struct messages *messages);
void check_programme(const struct model *model, const struct tree *tree, struct messages *messages);

/* Lists kinks of formulas in coordinates and rates as model->kinks. */
void state_kinks_list(struct memory *memory, struct model *model);

/* ---- sources ---- */

struct source_file {
    const char *path, *text;
    size_t length;
};

/* The Lua files of a model: its own, and files of the same folder that it requires. */
struct sources {
    struct source_file *list; /* the first is the model */
    int count, capacity;
    size_t length; /* of all */
};
/* The files that a script was read from. They outlive the script. */
const struct sources *script_sources(const struct script *script);

/* ---- values of Lua in plain C, for files of other kinds ---- */

enum value_kind {
    VALUE_NOTHING,
    VALUE_NUMBER,
    VALUE_TEXT,
    VALUE_BOOLEAN,
    VALUE_EXPRESSION,
    VALUE_FUNCTION,
    VALUE_CURVE, /* result of rd.spline: a function of an expression */
    VALUE_TABLE,
    VALUE_GROUP /* parameters, or a part of the state: something with named values */
};

/* A Lua value with its file and line. List items are in order, named entries are sorted by name. */
struct value {
    enum value_kind kind;
    struct place place;
    double number;
    bool is_whole, truth;
    const char *text;
    expression expression;
    int function;    /* handle of script_call */
    int curve;       /* number of the graph's spline */
    const char *tag; /* "model", "position" ... of a table made by a function of the module, or NULL */
    struct value *items;
    int item_count;
    struct value_field *fields;
    int field_count;
};

struct value_field {
    const char *name;
    struct value value;
};

/* The table that the file returns. */
const struct value *script_result(const struct script *script);
/* The word for the kind in messages: "a number", "a table" ... */
const char *value_kind_text(enum value_kind kind);
/* The entry of this name, or NULL. */
const struct value *value_find_field(const struct value *table, const char *name);

/* ---- fields: messages about values ---- */

/* What checks of values use. */
struct checker {
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    struct declarations *declarations; /* of a model file */
};

/* `path.name` and `path[index]`. */
const char *fields_path_name(const struct checker *checker, const char *path, const char *name);
const char *fields_path_item(const struct checker *checker, const char *path, int index);
/* The word for a value in messages: "a number", "made by rd.box". */
const char *fields_made_text(const struct checker *checker, const struct value *value);
/* Whether a function of this name has made the table. */
bool fields_has_tag(const struct value *value, const char *tag);
/* The names of a list or of a text with commas. Returns their number. */
int fields_get_names(const struct checker *checker, const struct value *value, const char ***names);
/* Report named entries in a list, and items in a table of names. True if there are none. */
bool field_types_has_no_names(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed);
bool field_types_has_no_items(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed);
/* Reports an unknown name, with the nearest known one or all of them. */
void fields_refuse_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                        const char *name, const char *const *known, int count);

/* ---- files of other kinds, such as sweeps, fits and plans: from Lua to plain data ---- */

/* The caller embeds it. It must not move once it is read, since its parts point to each other. */
struct plain_file {
    const char *path;
    enum file_kind kind;
    struct memory memory;
    struct graph graph;
    struct messages messages;
    struct checker check;
    struct script *script; /* NULL if the file could not be run */
    jmp_buf out_of_memory;
    void *data; /* the plain data */
};

/* Reads a value of one kind into `target`. `path` names it in messages: "keep.at". */
typedef void plain_read(const struct plain_file *file, const struct value *value, const char *path,
                        void *target);

/* Runs the file, and reads the table that it returns into `data`. Returns false after an error, which is in
 * the messages, sorted by line; without a message, memory is exhausted. Call memory_release in any case. */
bool plain_file_read(struct plain_file *file, const char *path, enum file_kind kind, plain_read *read,
                     void *data);
/* Calls `work` with the memory of the file, and returns its answer. Returns false as above if memory ends. */
bool plain_file_try(struct plain_file *file, bool (*work)(struct plain_file *file, void *context),
                    void *context);

/* Report a value: "PATH: a text; must be NEEDED", "PATH: value -1; must be NEEDED". */
void plain_refuse(const struct plain_file *file, const struct value *value, const char *path,
                  const char *needed);
void plain_refuse_number(const struct plain_file *file, const struct value *value, const char *path,
                         const char *needed);
const char *plain_number_text(const struct plain_file *file, double x);

/* Values of one kind: double, const char *, bool. */
plain_read plain_read_positive, plain_read_text, plain_read_truth;
/* Report any other value. */
bool plain_is_number(const struct plain_file *file, const struct value *value, const char *path);
bool plain_is_whole(const struct plain_file *file, const struct value *value, const char *path, double least,
                    double most, const char *needed);

bool plain_is_list(const struct value *value);
/* Report anything but a list; a table of names; a table of names with an entry. `form` is an example. */
bool plain_needs_list(const struct plain_file *file, const struct value *value, const char *path,
                      const char *form);
bool plain_needs_table(const struct plain_file *file, const struct value *value, const char *path,
                       const char *form);
bool plain_needs_names(const struct plain_file *file, const struct value *value, const char *path,
                       const char *form);

/* Different names, as a list or as a text with commas between them. */
struct plain_names {
    const char **names;
    struct place *places; /* (count) */
    int count;
};
/* Read struct plain_names; a const char * with commas between the names, as on the command line. */
plain_read plain_read_names, plain_read_joined;

/* Whether a function of rd has made the value with `least` to `most` numbers, and the file has not changed it
 * since. */
bool plain_is_made(const struct value *value, const char *tag, int least, int most);

struct plain_range {
    double from, to, start;
    bool has_start;
};
/* Reads a value of rd.within. */
bool plain_read_range(const struct plain_file *file, const struct value *value, const char *path,
                      const char *needed, struct plain_range *range);

struct plain_field {
    const char *name;
    plain_read *read;
    size_t target; /* its offset in the plain data */
};
/* Reads the fields of a table in the order of `fields`, and reports all other ones. */
void plain_read_fields(const struct plain_file *file, const struct value *table, const char *path,
                       const struct plain_field *fields, int count);
/* Reports a missing field; `form` is an example of its value. */
void plain_needs_field(const struct plain_file *file, const struct value *table, const char *name,
                       const char *form);

/* ---- tables of cases, whose derived columns a Lua function computes ---- */

/* The values of one name in all cases. */
struct case_column {
    const char *name;
    struct place place;
    enum case_values { CASES_NUMBERS, CASES_WHOLE, CASES_TRUTHS, CASES_TEXTS } kind;
    double *values;     /* (count) numbers; of truths 0 or 1; of texts the index in `texts` */
    const char **texts; /* (text_count) of CASES_TEXTS */
    int text_count;
};

struct case_table {
    long count;
    int width;
    struct case_column *columns;
};

/* Calls a sweep's function with the values of each case of `given`. Its results become the columns of
 * `derived`, in the order of their names, which live in `memory`. False after an error, which is in messages.
 */
bool script_derive(struct script *script, const struct value *function, const struct case_table *given,
                   struct memory *memory, struct case_table *derived);

/* The functions of sweep or fit files by number, with the names of their arguments separated by commas; NULL
 * after the last one. For editors. */
const char *script_kind_function(enum file_kind kind, int number, const char **arguments);

#endif
