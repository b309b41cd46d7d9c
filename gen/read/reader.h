/*
 * Shared by the files that read models. Parts, in reading order: files and tokens of Lua; work; scripts, the
 * functions of rd and what a file declares; symbols of formulas; fields; the readers of each part of a model.
 */
#ifndef REFDYN_GEN_READER_H
#define REFDYN_GEN_READER_H

#include "gen/read/read.h"

/* ---- lua_source.c: files, tokens, lines of tables ---- */

/* The name of a file in Lua's messages, followed by its number. */
#define SOURCE_CHUNK "model"
/* Reads one more regular file (others may have no end, or wait). NULL, or the reason of a failure. */
const char *source_file_add(struct memory *memory, struct sources *sources, const char *path);
/* The path of NAME.lua in the folder of the file `neighbour`. */
const char *source_file_path(struct memory *memory, const char *neighbour, const char *name);
/* Splits "model0:LINE: text" into the place and the text, `rest`. For other texts, returns false and leaves
 * `place` unchanged. */
bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest);

struct token {
    enum { TOKEN_END, TOKEN_NAME, TOKEN_WORD, TOKEN_STRING, TOKEN_NUMBER, TOKEN_SYMBOL } kind;
    const char *start, *end;
    int line;
};

struct scanner {
    const char *next, *end;
    int line;
};

struct scanner scanner_start(const char *source, size_t length);
struct token scanner_next(struct scanner *scanner);
bool scanner_token_is(const struct token *token, const char *text);
/* Names of locals, functions and their arguments, in the order of the source, at most `room`. */
int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room);

/* A source whose table constructors are marked with numbers, and the lines of these tables and entries. */
struct source_lines {
    struct table_source *tables; /* private to lua_source.c */
    int count, capacity;
    char *text; /* the rewritten source */
    size_t length;
};

/* The numbers follow those of earlier sources. Reports entries that are given twice in one constructor, of
 * which Lua would use the last. */
void source_lines_mark_tables(struct memory *memory, struct messages *messages, const char *file,
                              const char *source, size_t length, struct source_lines *lines);
struct place source_lines_of_table(const struct source_lines *lines, int table);
/* Line of entry `name` (if NULL: of list item `index`) in table number `table`; 0 if unknown. */
int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index);

/* ---- lint.c: mistakes in a source ---- */

/* Warns of mistakes that Lua accepts without an error. */
void lint_source(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length);
/* Reports characters outside ASCII in code, and texts that end with a typographic quotation mark, at most one
 * error a line. Lua would show these characters byte by byte. True if there are none. */
bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length);
/* Advice to follow Lua's message `text` that the source ends too early: the bracket that is open; "" if there
 * is none. */
const char *lint_open_bracket(struct memory *memory, const char *text, const char *source, size_t length);
/* Advice to follow Lua's message `text` about syntax of other languages; "" if there is none. */
const char *lint_advice(const char *text);

/* ---- work_limits.c: memory and work of Lua ---- */

/* Work that a model's Lua has done so far. */
struct work {
    double steps;
    int millions;        /* of steps that are allowed */
    size_t longest_text; /* bytes */
    bool has_remainders; /* a source contains the operator % */
    bool has_zeros;      /* a text may contain bytes 0: Lua compares such texts piece by piece */
};
enum { WORK_MILLIONS = 100 }; /* of steps while a file is read */

void work_add(struct work *work, double steps);
void work_add_steps(struct work *work, int count);
/* A call of a function, or its return, with `count` arguments or results. */
void work_add_call(struct work *work, int count);
void work_add_memory(struct work *work, size_t bytes);
void work_add_text(struct work *work, size_t length);
/* A text that a library function has returned. */
void work_note_zeros(struct work *work, const char *text, size_t length);
/* The work of compiling a source. */
void work_add_source(struct work *work, const char *source, size_t length);
bool work_is_over(const struct work *work);
/* Steps that the search of a pattern, or of a plain text, in a text of `length` bytes may take. */
double work_pattern_steps(size_t length, const char *pattern, size_t pattern_length);
double work_search_steps(size_t length, size_t searched);

/* Memory for Lua from the generator's arena. Freed pieces are kept by size and used again, and all are
 * released with the arena, so that a jump out of the generator leaves nothing allocated. */
enum { POOL_CLASSES = 96 };
struct pool {
    struct memory *memory;
    struct pool_piece *free[POOL_CLASSES];
};
/* Lua's allocator: `old` bytes at `data` become `size` bytes. NULL if memory is short or size is 0. */
void *pool_resize(struct pool *pool, void *data, size_t old, size_t size);

/* ---- script.c: runs a file in the sandbox; only the files script*.c know Lua ---- */

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

/* The word for a kind of file in messages: "model", "sweep", "fit" or "plan". */
const char *script_kind_noun(enum file_kind kind);
/* Name of the function that makes the result of such a file; NULL for models. */
const char *script_kind_tag(enum file_kind kind);

/* ---- module.c: the functions of rd ---- */

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

/* ---- fields.c: values and the table of fields (fields.def) ---- */

/* A number or an expression as an expression; false for anything else. */
bool value_expression(struct graph *graph, const struct value *value, expression *result);

enum field {
#define FIELD(owner, name, item, type, need, range, unit, text) FIELD_##owner##_##name,
#include "gen/read/fields.def"
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

/* ---- read_model.c and read_result.c: from values to the model ---- */

/* What the files read_*.c share. Each reads values of the file and fills its part of the model. */
struct reader {
    struct checker check;
    struct model *model;
    const struct tree *tree; /* while forces, rows and events are read */
    bool lacks_links;        /* some have errors, so that unknown links are not reported */
};

/* Whether the result of the function `name` is a table of the author. Reports an error if it is not. */
bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed);
/* Reports an unknown coordinate, once for each name. */
void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name);

/* Entries made by one function of the module, with the fields of `owner`. */
struct entry_kind {
    const char *tag;
    enum owner owner;
    void (*read)(const struct reader *reader, const struct value *value, const char *path);
};
/* Reads each entry of a list, and of lists within it, by its kind. */
void read_entries(const struct reader *reader, const struct value *list, const char *path,
                  const struct entry_kind *kinds, size_t count, const char *needed);

/* ---- read_link.c, read_beam.c ---- */

/* The next three return false if the place is unknown. The first reads where a link is attached. */
bool read_carrier(const struct reader *reader, const struct value *table, const char *path,
                  struct attachment *at);
/* The name of a link or, if `may_be_point`, of a point of interest, or a table of OWNER_POINT. */
bool read_place(const struct reader *reader, const struct value *value, const char *path, bool may_be_point,
                struct attachment *at);
/* The field `field` of `table`: a place or the name of one. */
bool read_place_field(const struct reader *reader, const struct value *table, enum field field,
                      const char *path, struct attachment *at);
/* "x", "y", "z" or three values. */
struct vector read_direction(const struct reader *reader, const struct value *value);
void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement);
double read_value_now(const struct reader *reader, expression e); /* with the parameters' values */
/* Reports a requirement that is not met, and keeps it for other values of parameters. */
void read_require(const struct reader *reader, struct requirement requirement, const char *path,
                  struct place place);
/* Mass data of a link and its list of bodies. */
void read_solids(const struct reader *reader, const struct value *table, const char *path, struct link *link);
/* Joints of a link and all fields about them. */
void read_joints(const struct reader *reader, const struct value *table, const char *path, struct link *link);
void read_beam(const struct reader *reader, const struct value *table, const char *path, struct beam *beam);

/* ---- read_states.c, read_forces.c, read_drives.c, read_pulls.c, read_constraints.c, read_events.c;
 * warnings.c: doubtful values ---- */

void read_states(const struct reader *reader, const struct value *result);
/* Adds the rates of states to the forces, after all other forces. */
void read_rates_of_states(const struct reader *reader);
void read_forces(const struct reader *reader, const struct value *result);
/* Adds a force along the line between two places, which drives them apart. False if one is unknown. */
bool read_push(const struct reader *reader, const struct value *value, enum field from, enum field to,
               expression force, const char *path);
/* read_drives.c: after the forces. */
void read_drives(const struct reader *reader, const struct value *list);
/* After the rows: no drive may act on a locked coordinate. Then treats the programme as requested. */
void read_drives_end(const struct reader *reader);
/* read_pulls.c: after the drives. */
void read_pulls(const struct reader *reader);
void read_courses(const struct reader *reader, const struct value *table);
/* read_bounds.c: limits of links, then those of the list, which may be NULL. After the courses. */
void read_bounds(const struct reader *reader, const struct value *list);
void read_constraints(const struct reader *reader, const struct value *result);
void read_events(const struct reader *reader, const struct value *result);

/* Warns of rows whose residual does not change its sign where it is zero. */
void read_check_slopes(const struct reader *reader);
/* Warns of values that look like millimetres or degrees, of thick beams, and of coordinates without inertia
 * or load. The model must have no errors. */
void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
