/*
 * Runs files in Lua in a sandbox. Parts, in reading order: sources; scripts and calls of the author's
 * functions; sweeps, fits and plans as plain data; tables of cases.
 */
#ifndef REFDYN_GEN_SCRIPT_H
#define REFDYN_GEN_SCRIPT_H

#include <setjmp.h>

#include "gen/language/values.h"

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
struct script;
/* The files that a script was read from. They outlive the script. */
const struct sources *script_sources(const struct script *script);

/* ---- script.c: runs a file in the sandbox ---- */

/* Opens the file and runs it up to the table that it returns. NULL after an error that ends the reading;
 * other errors are in `messages` only. The script is never closed: its memory is released with `memory`, and
 * no code of the model runs then. */
struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages);
/* The table that the file returns. */
const struct value *script_result(const struct script *script);
struct declarations *script_declarations(struct script *script);
struct messages *script_messages(struct script *script);
/* The names that the author's functions may use from now on. */
void script_set_names(struct script *script, struct model *model, const char *const *coordinates,
                      int coordinate_count);
/* From now on s.states may have any name as a field, which becomes a state of the model; or only those of the
 * model. */
void script_declare_states(struct script *script, bool declares_states);
/* Calls an author's function with the state `s`. Messages call it `name`. False after an error, which is in
 * messages. */
bool script_call(struct script *script, const struct value *function, const char *name, struct value *result);

/* ---- files of other kinds, such as sweeps, fits and plans: from Lua to plain data ---- */

/* Called when memory is exhausted after the reading. It must not return. */
typedef void plain_fail(void);

/* The caller embeds it. It must not move once it is read, since its parts point to each other. */
struct plain_file {
    const char *path;
    enum file_kind kind;
    struct memory memory;
    struct graph graph;
    struct messages messages;
    struct checker check;
    struct script *script; /* NULL if the file could not be run */
    jmp_buf out_of_memory; /* valid while messages.ends_reading */
    plain_fail *fail;
    void *data; /* the plain data */
};

/* Reads a value of one kind into `target`. `path` names it in messages: "keep.at". */
typedef void plain_read(const struct plain_file *file, const struct value *value, const char *path,
                        void *target);

/* Runs the file, and reads the table that it returns into `data`. Returns false after an error, which is in
 * the messages, sorted by line; without a message, memory is exhausted. Call memory_release in any case. */
bool plain_file_read(struct plain_file *file, const char *path, enum file_kind kind, plain_read *read,
                     void *data, plain_fail *fail);
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
