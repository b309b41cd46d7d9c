/*
 * The table of fields (fields.def) and the checks that follow from it.
 *
 * Takes a value of the model file and what it is to be; complains about unknown, missing and ill-typed
 * fields, and gives the good ones.
 */
#ifndef REFDYN_GEN_FIELDS_H
#define REFDYN_GEN_FIELDS_H

#include "declare.h"
#include "value.h"

/* Tables with fields: OWNER(name, text in messages, name of the function of the module that makes one, or
 * NULL) */
#define OWNERS                                                \
    OWNER(MODEL, "the model", "model")                        \
    OWNER(LINK, "a link", NULL)                               \
    OWNER(INERTIA, "an inertia", NULL)                        \
    OWNER(BODY, "a body", NULL)                               \
    OWNER(BOX, "a box", "box")                                \
    OWNER(CYLINDER, "a cylinder", "cylinder")                 \
    OWNER(TUBE, "a tube", "tube")                             \
    OWNER(SPHERE, "a sphere", "sphere")                       \
    OWNER(BEAM, "a beam", NULL)                               \
    OWNER(SEGMENT, "a segment", NULL)                         \
    OWNER(SECTION, "a section", NULL)                         \
    OWNER(DAMPING, "a damping", NULL)                         \
    OWNER(CURVATURE, "a curvature", NULL)                     \
    OWNER(POINT, "a point", NULL)                             \
    OWNER(AXIS, "an axis", NULL)                              \
    OWNER(SPRING, "a spring", "spring")                       \
    OWNER(DAMPER, "a damper", "damper")                       \
    OWNER(ACTUATOR, "an actuator", "actuator")                \
    OWNER(FORCE, "a force", "force")                          \
    OWNER(TORQUE, "a torque", "torque")                       \
    OWNER(ENERGY, "an energy", "energy")                      \
    OWNER(ROW, "a row", NULL)                                 \
    OWNER(LOOP, "rd.loop", "loop")                            \
    OWNER(PARALLEL, "rd.parallel", "parallel")                \
    OWNER(PERPENDICULAR, "rd.perpendicular", "perpendicular") \
    OWNER(ON_LINE, "rd.on_line", "on_line")                   \
    OWNER(ON_PLANE, "rd.on_plane", "on_plane")                \
    OWNER(DISTANCE, "rd.distance", "distance")                \
    OWNER(CLOSE, "rd.close", "close")                         \
    OWNER(DRIVE, "rd.drive", "drive")                         \
    OWNER(LOCK, "rd.lock", "lock")

enum owner {
#define OWNER(name, text, tag) OWNER_##name,
    OWNERS
#undef OWNER
        OWNER_COUNT
};

enum field {
#define FIELD(owner, name, item, type, need, range, unit, text) FIELD_##owner##_##name,
#include "fields.def"
#undef FIELD
    FIELD_COUNT
};

enum field_type {
    TYPE_TEXT,
    TYPE_WHOLE,       /* a whole number */
    TYPE_VALUE,       /* a number or an expression of parameters */
    TYPE_FREE,        /* a number or any expression */
    TYPE_VECTOR,      /* three values */
    TYPE_TURNS,       /* list of { axis, value } */
    TYPE_NAMES,       /* list of texts, or one text with commas */
    TYPE_BY_JOINT,    /* table of values by joint */
    TYPE_PLACE,       /* the name of a link or of a point of interest, or a table of OWNER_POINT */
    TYPE_AXIS,        /* a table of OWNER_AXIS */
    TYPE_DIRECTION,   /* "x", "y", "z" or three values */
    TYPE_FREE_VECTOR, /* three expressions */
    TYPE_TABLE,
    TYPE_LIST, /* list of tables */
    TYPE_FUNCTION
};

enum field_need { NEED_OPTIONAL, NEED_NEEDED, NEED_SHARED };

enum field_range { RANGE_ANY, RANGE_POSITIVE, RANGE_NOT_NEGATIVE, RANGE_POISSON };

struct field_rule {
    enum owner owner;
    const char *name;
    int item;
    enum field_type type;
    enum field_need need;
    enum field_range range;
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

const char *owner_text(enum owner owner); /* "a link" */
/* The function of the module that makes such a table, or NULL; rd.position and its like make rows. */
const char *owner_tag(enum owner owner);
/* All such functions; there is room for OWNER_COUNT + 3. */
int list_tags(const char **tags);
bool has_tag(const struct value *value, const char *tag);
const char *range_text(enum field_range range); /* "positive", or "" */

/* Complains about all that is wrong with the fields of `table`, which messages call `path` ("" for the
 * model). */
void check_fields(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path);
/* The field's value, or NULL when it is missing or not of its type. */
const struct value *get_field(const struct value *table, enum field field);
/* Is there such a field, of whatever type? */
bool has_field(const struct value *table, enum field field);
/* A number or expression; `standard` when the field is missing, 1 when it is needed but missing or wrong. */
expression get_value(const struct checker *checker, const struct value *table, enum field field);
void get_vector(const struct checker *checker, const struct value *table, enum field field,
                expression *vector);
/* Names of a list or of a text with commas; the number of names. */
int get_names(const struct checker *checker, const struct value *value, const char ***names);

/* `path.name` and `path[index]`. */
const char *path_name(const struct checker *checker, const char *path, const char *name);
const char *path_item(const struct checker *checker, const char *path, int index);
/* A number within its range, an expression of parameters alone. */
void check_value(const struct checker *checker, const struct value *value, enum field_range range,
                 const char *path);
/* Complains about an unknown name, with the nearest known one, or else all of them. */
void complain_of_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                      const char *name, const char *const *known, int count);

#endif
