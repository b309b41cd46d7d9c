/*
 * The table of fields (fields.def) and the checks that follow from it: fields.c has the
 * table and look-ups in it, check_fields.c the checks.
 *
 * Takes a value of the model file and what it is to be; complains about unknown, missing and ill-typed
 * fields, and gives the good ones.
 */
#ifndef REFDYN_GEN_FIELDS_H
#define REFDYN_GEN_FIELDS_H

#include "read/declarations.h"
#include "read/value.h"

enum field {
#define FIELD(owner, name, item, type, need, range, unit, text) FIELD_##owner##_##name,
#include "read/fields.def"
#undef FIELD
    FIELD_COUNT
};

enum owner {
#define OWNER(name, text, tag, form) OWNER_##name,
    OWNERS
#undef OWNER
        OWNER_COUNT
};

enum field_type {
    TYPE_TEXT,
    TYPE_WHOLE,    /* a whole number */
    TYPE_NUMBER,   /* a number, no expression */
    TYPE_VALUE,    /* a number or an expression of parameters */
    TYPE_FREE,     /* a number or any expression */
    TYPE_VECTOR,   /* three values */
    TYPE_TURNS,    /* list of { axis, value } */
    TYPE_NAMES,    /* list of texts, or one text with commas */
    TYPE_BY_JOINT, /* table of values by joint */
    TYPE_ROTORS,   /* table by joint of tables of OWNER_ROTOR */
    TYPE_LIMITS,   /* and of OWNER_LIMITS */
    TYPE_PLACE,    /* the name of a link or of a point of interest, or a table of OWNER_POINT */
    TYPE_AXIS,     /* a table of that owner, as the next five */
    TYPE_INERTIA,
    TYPE_BEAM,
    TYPE_SECTION,
    TYPE_DAMPING,
    TYPE_CURVATURE,
    TYPE_DIRECTION,    /* "x", "y", "z" or three values */
    TYPE_FREE_VECTOR,  /* three expressions */
    TYPE_FREE_TURNS,   /* list of { axis, expression } */
    TYPE_FREE_BY_NAME, /* table of expressions by name */
    TYPE_TRUTH,        /* true or false */
    TYPE_POINTS,       /* table of places by name */
    TYPE_LIST,         /* list of tables */
    TYPE_FUNCTION,
    TYPE_COUNT
};

enum field_need { NEED_OPTIONAL, NEED_NEEDED, NEED_SHARED };

struct field_rule {
    enum owner owner;
    const char *name;
    int item;
    enum field_type type;
    enum field_need need;
    enum number_range range;
    const char *unit, *text;
};

extern const struct field_rule field_rules[FIELD_COUNT];

/* What the checks need of the reader. */
struct checker {
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    struct declarations *declarations;
};

const char *fields_owner_text(enum owner owner); /* "a link" */
const char *owner_form(enum owner owner);        /* "{ \"arm\", joint = \"z\" }" */
/* The function of the module that makes such a table, or NULL; rd.position and its like make rows. */
const char *fields_owner_tag(enum owner owner);
/* All such functions; there is room for OWNER_COUNT + 3. */
int fields_list_tags(const char **tags);
/* An example of the table that such a function takes. */
const char *fields_tag_form(const char *tag);
bool fields_has_tag(const struct value *value, const char *tag);
const char *fields_range_text(enum number_range range); /* "positive", or "" */

/* Complains about all that is wrong with the fields of `table`, which messages call `path` ("" for the
 * model). */
void fields_check(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path);
/* Has the author made the table, or the function of the module that makes such? OWNER_COUNT: none does. */
bool fields_is_made_for(const struct value *table, enum owner owner);
/* Nothing in the table is a field of the owner, and it would be told of each: something else was meant.
 * fields_check says so. */
bool fields_is_stranger(const struct value *table, enum owner owner);
/* Was a field of the table meant to be `name`, and misspelled? fields_check has said so. */
bool fields_is_misspelled(const struct value *table, enum owner owner, const char *name);
/* The field's value, or NULL when it is missing or not of its type. */
const struct value *fields_get(const struct value *table, enum field field);
/* Is there such a field, of whatever type? */
bool fields_has(const struct value *table, enum field field);
/* A number or expression; `standard` when the field is missing, 1 when it is needed but missing or wrong. */
expression fields_get_value(const struct checker *checker, const struct value *table, enum field field);
void fields_get_vector(const struct checker *checker, const struct value *table, enum field field,
                       expression *vector);
/* Names of a list or of a text with commas; the number of names. */
int fields_get_names(const struct checker *checker, const struct value *value, const char ***names);

/* What messages call a value that is not what is needed: "a number", "made by rd.box". */
const char *fields_made_text(const struct checker *checker, const struct value *value);
/* `path.name` and `path[index]`. */
const char *fields_path_name(const struct checker *checker, const char *path, const char *name);
const char *fields_path_item(const struct checker *checker, const char *path, int index);
/* Complains about named entries where a list is needed, and about items where names are; true: there are
 * none. */
bool field_types_has_no_names(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed);
bool field_types_has_no_items(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed);
/* Complains about an unknown name, with the nearest known one, or else all of them. */
void fields_refuse_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                        const char *name, const char *const *known, int count);

#endif
