/*
 * The language of models: fields and their checks; options, parameters and inputs; symbols of formulas; the
 * functions of rd; laws of time.
 */
#ifndef REFDYN_GEN_LANGUAGE_H
#define REFDYN_GEN_LANGUAGE_H

#include "gen/language/values.h"

/* ---- fields.c: values and the table of fields (fields.def) ---- */

/* A number or an expression as an expression; false for anything else. */
bool value_expression(struct graph *graph, const struct value *value, expression *result);

enum field {
#define FIELD(owner, name, item, type, need, range, unit, text) FIELD_##owner##_##name,
#include "gen/language/fields.def"
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
    TYPE_NUMBER,   /* a number and no expression */
    TYPE_VALUE,    /* a number or an expression in parameters */
    TYPE_FREE,     /* a number or any expression */
    TYPE_VECTOR,   /* three values */
    TYPE_VALUES,   /* list of values */
    TYPE_TURNS,    /* list of { axis, value } */
    TYPE_NAMES,    /* list of texts, or one text with commas */
    TYPE_BY_JOINT, /* table of values by joint */
    TYPE_ROTORS,   /* table by joint of tables of OWNER_ROTOR */
    TYPE_LIMITS,   /* table by joint of tables of OWNER_LIMITS */
    TYPE_PLACE,    /* the name of a link or of a point of interest, or a table of OWNER_POINT */
    TYPE_AXIS,     /* a table of the owner of this name, as are the next five */
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
    TYPE_DRIVES,       /* list of texts and of tables of OWNER_EFFORT */
    TYPE_FUNCTION,
    TYPE_COUNT
};

struct field_rule {
    enum owner owner;
    const char *name;
    int item;
    enum field_type type;
    enum { NEED_OPTIONAL, NEED_NEEDED, NEED_SHARED } need;
    enum number_range range;
    const char *unit, *text;
};

extern const struct field_rule field_rules[FIELD_COUNT];

extern const struct type_rule {
    const char *text;
    unsigned takes;   /* a bit for each kind of value */
    enum owner owner; /* of a table of this type; OWNER_COUNT if none */
} type_rules[TYPE_COUNT];

extern const struct owner_rule {
    const char *text; /* "a link" */
    const char *tag;  /* the function of the module that makes such a table, or NULL; not those of rows */
    const char *form; /* "{ \"arm\", joint = \"z\" }" */
} owner_rules[OWNER_COUNT];
/* Lists all such functions, and those of rows: at most OWNER_COUNT + 3. */
int fields_list_tags(const char **tags);
/* An example of the table that such a function expects. */
const char *fields_tag_form(const char *tag);
int item_room(enum owner owner);                       /* number of fields that may be given without a name */
int owner_names(enum owner owner, const char **names); /* lists the names of the owner's fields */

bool is_empty_text(const struct value *value);
bool field_types_matches(const struct value *value, enum field_type type);
/* Whether a function of the module has made the table for another type. */
bool is_made_otherwise(const struct value *value, enum field_type type);
/* Whether the author has made the table, or the function for this owner. For OWNER_COUNT: only the author. */
bool fields_is_made_for(const struct value *table, enum owner owner);
/* Whether the table has no field of the owner and would need several messages: the author meant something
 * else, and fields_check reports this. */
bool fields_is_stranger(const struct value *table, enum owner owner);
/* Whether a field of the table is a misspelling of `name`, which fields_check reports. */
bool fields_is_misspelled(const struct value *table, enum owner owner, const char *name);

/* The field's value of any type, or NULL. */
const struct value *given_field(const struct value *table, enum field field);
/* The field's value, or NULL if it is missing or not of its type. */
const struct value *fields_get(const struct value *table, enum field field);
/* Whether there is such a field, of any type. `table` may be NULL. */
bool fields_has(const struct value *table, enum field field);
/* Returns a number or expression: for a missing or wrong one 1 in a required field, and 0 in any other. */
expression fields_get_value(const struct checker *checker, const struct value *table, enum field field);
void fields_get_vector(const struct checker *checker, const struct value *table, enum field field,
                       expression *vector);

/* check_fields.c: reports all errors in the fields of `table`. Messages call it `path` ("" for the model). */
void fields_check(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path);

/* ---- declarations.c: options, parameters and inputs ---- */

/* As the file declares them, with the settings (--set) applied. A name may be
 * declared once within its kind; check_model.c reports doubles. */
struct declarations {
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const struct read_request *request;
    const char **setting_kind; /* by setting: the kind of what it has set, "option" ..., or NULL */
    bool lacks_parameters;     /* some have errors, so that unknown names are not reported */
    struct model_option *options;
    int option_count, option_capacity;
    struct parameter *parameters;
    int parameter_count, parameter_capacity;
    struct input *inputs;
    int input_count, input_capacity;
    struct requirement *requirements; /* that depend on parameters */
    int requirement_count, requirement_capacity;
};

void declarations_start(struct declarations *declarations, struct memory *memory, struct graph *graph,
                        const struct read_request *request, struct messages *messages);
/* Returns the option's value, of the kind of `standard`. `allowed` is a list of values, { from = , to = }, or
 * NULL. */
struct value declarations_add_option(struct declarations *declarations, struct place place, const char *name,
                                     const struct value *standard, const struct value *allowed);
/* `standard`: a number, or an expression in other parameters and in values at the start of a motion. */
expression declarations_add_parameter(struct declarations *declarations, struct place place, const char *name,
                                      const struct value *standard, const char *unit);
/* A parameter that contacts set during a motion. It is 0 at the start, and a symbol even if parameters are
 * folded. */
expression declarations_add_mode(struct declarations *declarations, struct place place, const char *name);
/* A list of { name, value, unit }. */
void declarations_add_parameters(struct declarations *declarations, const struct value *list);
expression declarations_add_input(struct declarations *declarations, struct place place, const char *name,
                                  double standard, const char *unit);
/* The error message if expressions in parameters break the requirement, or NULL. A requirement that depends
 * on parameters is kept for other values of them. */
const char *declarations_require(struct declarations *declarations, struct requirement requirement);
/* The value of an expression in parameters. False if it depends on more, or on the start of a motion. */
bool parameters_are_known(const struct declarations *declarations, expression e, double *value);
/* Names of the parameters in e that have values of the state at the start of a motion and are not given. */
const char **declarations_start_values(const struct declarations *declarations, expression e, int *count);
/* The expression of parameter number `index`: a symbol, or a number if parameters are folded. */
expression declarations_parameter_expression(const struct declarations *declarations, int index);
/* Reports unknown settings. Call it after all declarations. */
void declarations_refuse_unknown_settings(const struct declarations *declarations,
                                          const char *const *coordinates, int coordinate_count);

/* ---- state_symbols.c: what the author's functions see as `s`, and the model as `p`; markers ---- */

/* Something with named fields; its members are private to state_symbols.c. */
struct view {
    int kind, order, index;
    bool at_start;
};
extern const struct view view_of_state, view_of_parameters;

/* The names that a view can have as fields. */
struct view_names {
    const struct declarations *declarations;
    struct model *model;            /* its links and points; the directions that are read become markers */
    const char *const *coordinates; /* of joints */
    int coordinate_count;
    bool declares_states; /* unknown names of states become states of the model */
};

struct view_result {
    bool is_view;
    struct view view;
    expression expression;
    const char *fault; /* NULL, or an error message */
    bool is_reported;  /* the same error has been reported before */
};
struct view_result state_symbols_field(const struct view_names *names, struct view view, const char *field);
/* The number of a state in the model's list. An unknown one is added, or else -1. */
int state_symbols_find_state(struct model *model, const char *name, bool adds);

struct attachment markers_ground_attachment(void);
/* Number of the marker of a point on a link. */
int markers_point(struct model *model, const struct attachment *at);
/* The marker's components in the ground frame: order 0 position, 1 velocity, 2 acceleration. */
struct vector markers_point_vector(struct model *model, const struct attachment *at, int order);
/* The same for a direction with components in the axes of `at`. */
struct vector markers_direction_vector(struct model *model, const struct attachment *at,
                                       struct vector components);
/* Lists kinks of formulas in coordinates and rates as model->kinks. */
void state_kinks_list(struct memory *memory, struct model *model);

/* ---- functions.c: the functions of rd ---- */

/* A call of a function of `rd`. */
struct module_call {
    struct declarations *declarations;
    struct place place; /* of the call */
    int function;       /* number of the function */
    const struct value *arguments;
    int argument_count;
    struct value result;
    const char *fault; /* NULL, or an error message that ends the script */
};

int module_function_count(void);
const char *module_function_name(struct memory *memory, int function);
/* Whether the function evaluates expressions, which takes a pass over the whole graph. */
bool module_evaluates(int function);
/* Whether the function reads samples, which may be more than the entries of other lists. */
bool module_takes_samples(int function);
/* Whether there is a function of values of this name, such as rd.sin. */
bool module_has(struct memory *memory, const char *name);
/* Whether there is a function of this name that makes a table, such as rd.position. */
bool module_makes(const char *name);
/* The error message for a name that the module does not have. */
const char *module_unknown(struct memory *memory, const char *name);
void module_run(struct module_call *call);

/* ---- time_laws.c: courses from rest to rest ---- */

/* The shaped course of a table of OWNER_SHAPER, and the way and duration of a table of OWNER_TIMING. Errors
 * are reported; the results are then 0. */
expression time_laws_shaper(const struct checker *checker, const struct value *table);
struct value time_laws_timing(const struct checker *checker, const struct value *table);

#endif
