/*
 * Values of files in Lua as plain C, for all readers of files. Parts, in reading order: names; requests;
 * values; messages about values.
 */
#ifndef REFDYN_GEN_VALUES_H
#define REFDYN_GEN_VALUES_H

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

/* ---- requests: which file to read, and how ---- */

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

/* ---- values of Lua in plain C ---- */

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

#endif
