/* The parts of the reader of model files. */
#ifndef REFDYN_GEN_READER_H
#define REFDYN_GEN_READER_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/base/base.h"
#include "gen/graph/graph.h"
#include "gen/model/model.h"
#include "gen/read/read.h"
#include "gen/tree/tree.h"

/*
 * Bounds of the values of expressions. Coordinates, points, inputs and time are unbounded; parameters have
 * their values. Bounds are never too narrow.
 */

struct bounds {
    double least, most;
};

/* Bounds of all values of the graph so far, by handle, in the scratch of its memory. */
struct bounds *bounds_of_values(const struct graph *g, const struct parameter *parameters);

/*
 * A Lua value in plain C: what script_value.c makes of the table that a model file returns, so that nothing
 * after it knows Lua. Named entries are sorted by name, list items stand in order; each knows its file and
 * line.
 */

enum value_kind {
    VALUE_NOTHING,
    VALUE_NUMBER,
    VALUE_TEXT,
    VALUE_BOOLEAN,
    VALUE_EXPRESSION,
    VALUE_FUNCTION,
    VALUE_CURVE, /* what rd.spline makes: a function of an expression */
    VALUE_TABLE,
    VALUE_GROUP /* parameters, or a part of the state: something with named values */
};

struct named_value;

struct value {
    enum value_kind kind;
    struct place place;
    double number;
    bool is_whole, truth;
    const char *text;
    expression expression;
    int function;    /* handle of script_call */
    int curve;       /* number of the graph's spline */
    const char *tag; /* "model", "position" ... of a table that a function of the module has made, or NULL */
    struct value *items;
    int item_count;
    struct named_value *fields;
    int field_count;
};

struct named_value {
    const char *name;
    struct value value;
};

/* "a number", "a table" ...: for messages. */
const char *value_kind_text(enum value_kind kind);
/* The entry of that name, or NULL. */
const struct value *value_find_field(const struct value *table, const char *name);
/* Number or expression as an expression; false for anything else. */
bool value_expression(struct graph *graph, const struct value *value, expression *result);

/*
 * Options, parameters and inputs of a model, as its file declares them, with the settings (--set) applied.
 *
 * Takes values with their places; gives the value of an option, or the symbol of a parameter or input. A name
 * may be declared once within its kind; check_model.c complains about doubles.
 */

struct declarations {
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const struct read_request *request;
    const char **setting_kind; /* by setting: what it has set, "option" ..., or NULL */
    bool lacks_parameters;     /* some could not be read: a name that is not among them is no mistake */
    struct model_option *options;
    int option_count, option_capacity;
    struct parameter *parameters;
    int parameter_count, parameter_capacity;
    struct input *inputs;
    int input_count, input_capacity;
    struct requirement *requirements; /* numbers that depend on parameters and have been looked at */
    int requirement_count, requirement_capacity;
};

void declarations_start(struct declarations *declarations, struct memory *memory, struct graph *graph,
                        const struct read_request *request, struct messages *messages);
/* The option's value, of the type of `standard`; `allowed`: a list of values, { from = , to = }, or NULL. */
struct value declarations_add_option(struct declarations *declarations, struct place place, const char *name,
                                     const struct value *standard, const struct value *allowed);
/* `standard`: a number, or an expression of other parameters and of values at the start of a motion. */
expression declarations_add_parameter(struct declarations *declarations, struct place place, const char *name,
                                      const struct value *standard, const char *unit);
/* A parameter that contacts set while a motion runs; it is 0 at the start. It remains a symbol even where
 * parameters are folded. */
expression declarations_add_mode(struct declarations *declarations, struct place place, const char *name);
/* A list of { name, value, unit }. */
void declarations_add_parameters(struct declarations *declarations, const struct value *list);
expression declarations_add_input(struct declarations *declarations, struct place place, const char *name,
                                  double standard, const char *unit);
/* What is wrong with expressions of parameters alone, as a message; NULL: nothing, and where they hang on
 * parameters the requirement is kept for other values of these. */
const char *declarations_require(struct declarations *declarations, struct requirement requirement);
/* The value of an expression that is known while the model is read: of parameters, none of which waits for
 * the start of a motion. */
bool parameters_are_known(const struct declarations *declarations, expression e, double *value);
/* Names of the parameters with values of the state at the start of a motion, and not given, that e reads. */
const char **declarations_start_values(const struct declarations *declarations, expression e, int *count);
/* The expression that stands for parameter number `index`: a number when parameters are folded. */
expression declarations_parameter_expression(const struct declarations *declarations, int index);
/* To be called when all is declared. */
void declarations_refuse_unknown_settings(const struct declarations *declarations,
                                          const char *const *coordinates, int coordinate_count);

/*
 * The table of fields (fields.def) and the checks that follow from it: fields.c has the
 * table and look-ups in it, check_fields.c the checks.
 *
 * Takes a value of the model file and what it is to be; complains about unknown, missing and ill-typed
 * fields, and gives the good ones.
 */

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

/*
 * What the checks of fields (check_fields.c) need of the table of fields (fields.c): the rule of each type,
 * and what a table has of an owner's fields.
 */

extern const struct type_rule {
    const char *text;
    unsigned takes;   /* a bit for each kind of value */
    enum owner owner; /* of a table of that type, OWNER_COUNT for none */
} type_rules[TYPE_COUNT];

bool is_empty_text(const struct value *value);
bool field_types_matches(const struct value *value, enum field_type type);
/* A table made by a function of the module that is not for this type. */
bool is_made_otherwise(const struct value *value, enum field_type type);
/* The field's value, whatever it is, or NULL. */
const struct value *given_field(const struct value *table, enum field field);
/* How many fields may stand without a name. */
int item_room(enum owner owner);
/* Names of the owner's fields. */
int owner_names(enum owner owner, const char **names);

/*
 * Looks in a Lua source for mistakes that Lua accepts without an error: `==` between an expression and a
 * number (always false), an expression as a condition (always true), and a decimal comma (a value that is
 * dropped).
 *
 * Knows as expressions: fields of what `forces` and `constraints` take, of rd.parameters, results of
 * rd.parameter and rd.input, and of names that are set to one of these. Gives warnings.
 */

void lint_source(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length);

/*
 * Looks for characters outside ASCII in code, and for texts that a typographic quotation mark should end. Lua
 * would show these characters byte by byte. Reports at most one error a line. True: no errors.
 */
bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length);

/*
 * Points and directions that forces and rows need beside the points of interest: markers of the model.
 *
 * Takes an attachment, gives expressions in symbols of the marker, which is made when there is none like it.
 * What stands on the ground is constant and needs no marker.
 */

struct attachment markers_ground_attachment(void);
/* Number of the marker of a point on a link. */
int markers_point(struct model *model, const struct attachment *at);
/* Number of the marker of a vector given in the axes of `at`, which is on a link. */
int markers_direction(struct model *model, const struct attachment *at, struct vector components);

/* The marker's components in the ground frame: order 0 position, 1 velocity, 2 acceleration. */
struct vector markers_point_vector(struct model *model, const struct attachment *at, int order);
struct vector markers_direction_vector(struct model *model, const struct attachment *at,
                                       struct vector components);

/*
 * The functions of the module `refdyn` that a model file calls, on plain values: rd.option, rd.sin, rd.round
 * ... script.c hands them to Lua; those of ops.def are among them.
 */

struct module_call {
    struct declarations *declarations;
    struct place place; /* of the call */
    int function;       /* number of the function */
    const struct value *arguments;
    int argument_count;
    struct value result;
    const char *fault; /* NULL, or a message that ends the script */
};

int module_function_count(void);
const char *module_function_name(struct memory *memory, int function);
/* Example of a call: "rd.tube(outer, inner)". */
const char *module_form(struct memory *memory, int function);
/* Does it take the values of expressions, which takes a pass through all of them? */
bool module_evaluates(int function);
/* Does it take samples, of which there may be more than entries in other lists? */
bool module_takes_samples(int function);
/* Is there a function of values with this name, such as rd.sin? One that makes a table, such as rd.position?
 */
bool module_has(struct memory *memory, const char *name);
bool module_makes(const char *name);
/* What to say of a name that the module does not have. */
const char *module_unknown(struct memory *memory, const char *name);
void module_run(struct module_call *call);

/*
 * A smooth path through points in space, as functions of the length along it.
 *
 * Takes points, gives knots s and samples of x, y, z at them for splines: natural cubic splines through the
 * points by arc length, found by iteration from the chords and sampled more finely, so that a step in s is a
 * step along the path.
 */

struct memory;

struct path {
    int count;
    double *length;        /* knots, from 0 [m] */
    double *coordinate[3]; /* at the knots [m] */
};

/* Coordinates of `count` points, no two neighbours alike; count >= 2. */
struct path path_through(struct memory *memory, const double *const points[3], int count);

/*
 * Memory for Lua out of the generator's arena: freed pieces are kept by size and used again, everything goes
 * with the arena. So a jump out of the generator leaves nothing behind.
 */

enum { POOL_CLASSES = 96 };

struct pool_piece;

struct pool {
    struct memory *memory;
    struct pool_piece *free[POOL_CLASSES];
};

/* As Lua's allocator: `old` bytes at `data` become `size` bytes; NULL when memory is short or for size 0. */
void *pool_resize(struct pool *pool, void *data, size_t old, size_t size);

/*
 * What the parts of the reader share: read_model.c (links, points, names), read_place.c,
 * read_joints.c, read_body.c, read_beam.c, and, once the coordinates are known, read_forces.c,
 * read_constraints.c and read_events.c with read_result.c. Each takes values of the file and fills its part
 * of the model.
 */

struct reader {
    struct checker check;
    struct model *model;
    const struct tree *tree; /* while forces and rows are read */
    bool lacks_links;        /* some could not be read: what names a link is not judged */
};

/* ---- read_place.c ---- */

/* The fields by which a table says where something is; FIELD_COUNT for one that it does not have. */
struct place_fields {
    enum field on, along, at, turn;
};
extern const struct place_fields link_place;

/* Place of a table with such fields; `may_be_point`: `on` may name a point of interest. False when what
 * carries it is not known, as these two. */
bool read_attachment(const struct reader *reader, const struct value *table,
                     const struct place_fields *fields, const char *path, bool may_be_point,
                     struct attachment *at);
/* The name of a link or point, or a table of OWNER_POINT. */
bool read_place(const struct reader *reader, const struct value *value, const char *path, bool may_be_point,
                struct attachment *at);
/* The field `field` of `table`, a place or the name of one; false when it is missing or wrong. */
bool read_place_field(const struct reader *reader, const struct value *table, enum field field,
                      const char *path, struct attachment *at);
/* "x", "y", "z" or three values. */
struct vector read_direction(const struct reader *reader, const struct value *value);
void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement);

/* ---- read_joints.c, read_body.c, read_beam.c ---- */

/* Joints of a link and all fields about them. */
void read_joints(const struct reader *reader, const struct value *table, const char *path, struct link *link);
double read_value_now(const struct reader *reader, expression e); /* with the parameters' values */
/* Complains when it is not met; keeps it for other values of parameters. */
void read_require(const struct reader *reader, struct requirement requirement, const char *path,
                  struct place place);
/* Mass data of a link and its list of bodies. */
void read_solids(const struct reader *reader, const struct value *table, const char *path, struct link *link);
void read_beam(const struct reader *reader, const struct value *table, const char *path, struct beam *beam);

/* ---- read_result.c ---- */

/* Is what the function `name` gives a table of the author? Complains when it is not. */
bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed);
/* Complains about an unknown coordinate, once for each name. */
void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name);

/* Entries that one function of the module makes, with the fields of `owner`. */
struct entry_kind {
    const char *tag;
    enum owner owner;
    void (*read)(const struct reader *reader, const struct value *value, const char *path);
};
/* Reads each entry of a list, and of lists within it, as what its kind is. */
void read_entries(const struct reader *reader, const struct value *list, const char *path,
                  const struct entry_kind *kinds, size_t count, const char *needed);

/* ---- read_forces.c, read_constraints.c, read_events.c ---- */

void read_forces(const struct reader *reader, const struct value *result);
void read_courses(const struct reader *reader, const struct value *table);
void read_constraints(const struct reader *reader, const struct value *result);
void read_events(const struct reader *reader, const struct value *result);

/* ---- row_slopes.c ---- */

/* Complains about rows whose residual does not change its sign where it is zero. */
void read_check_slopes(const struct reader *reader);

/*
 * The part of the sandbox of model files that is written in Lua. Runs once, with the module, a function that
 * compiles a file beside the model, one that marks tables, which such a file takes, and table.sort as
 * arguments; what it leaves in its globals, script.c gives to the model.
 *
 * `pairs` goes through a table in one order on every run: numbers upward, then names.
 */

static const char sandbox_source[] =
    "local rd, compile_beside, mark_table, sort = ...\n"
    "local each, type, error, rawget, match = next, type, error, rawget, string.match\n"
    "\n"
    "local function sorted_keys(t)\n"
    "  local keys, names = {}, {}\n"
    "  for key in each, t do\n"
    "    local kind = type(key)\n"
    "    if kind ~= 'number' and kind ~= 'string' then\n"
    "      error('pairs: a key of type ' .. kind .. ', numbers and names have an order', 0)\n"
    "    end\n"
    "    local list = kind == 'number' and keys or names\n"
    "    list[#list + 1] = key\n"
    "  end\n"
    "  sort(keys)\n"
    "  sort(names)\n"
    "  for i = 1, #names do keys[#keys + 1] = names[i] end\n"
    "  return keys\n"
    "end\n"
    "\n"
    "function pairs(t)\n"
    "  local kind = type(t)\n"
    "  if kind == 'userdata' then error('pairs: an expression or a group of values, a table is needed', 0) "
    "end\n"
    "  if kind ~= 'table' then error('pairs: ' .. kind .. ', a table is needed', 0) end\n"
    "  local keys, at = sorted_keys(t), 0\n"
    "  return function()\n"
    "    local key, value\n"
    "    repeat\n"
    "      at = at + 1\n"
    "      key = keys[at]\n"
    "      value = key ~= nil and rawget(t, key)\n"
    "    until value ~= nil\n"
    "    if key ~= nil then return key, value end\n"
    "  end, t\n"
    "end\n"
    "\n"
    "local loaded = { refdyn = rd }\n"
    "function require(name)\n"
    "  if type(name) ~= 'string' or not match(name, '^[%a_][%w_]*$') then\n"
    "    error('require: only \"refdyn\" and files beside the model, by their names without .lua, can be '\n"
    "      .. 'required', 0)\n"
    "  end\n"
    "  if loaded[name] == nil then\n"
    "    local run = compile_beside(name)\n"
    "    loaded[name] = false\n"
    "    local result, more = run(mark_table)\n"
    "    if more ~= nil then error('require: \"' .. name .. '\" returns two values, one is needed', 0) end\n"
    "    loaded[name] = result == nil and true or result\n"
    "  elseif not loaded[name] then\n"
    "    error('require: \"' .. name .. '\" requires itself, by way of others or at once', 0)\n"
    "  end\n"
    "  return loaded[name]\n"
    "end\n";

/* Tokens of a Lua source: Lua 5.4 manual, sect. 3.1. The source must be free of syntax errors. */

struct memory;

enum token_kind { TOKEN_END, TOKEN_NAME, TOKEN_WORD, TOKEN_STRING, TOKEN_NUMBER, TOKEN_SYMBOL };

struct token {
    enum token_kind kind;
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
/* Names of locals, functions and their arguments, in the order of the source; at most `room`. */
int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room);

/*
 * Lua as a server: runs a model file in a sandbox and gives plain values. Only the files behind it
 * (script_state.h) know Lua.
 *
 * script_open is declared in read.h. Errors of the script become complaints.
 */

/* The table that the file returns. */
const struct value *script_result(const struct script *script);
struct declarations *script_declarations(struct script *script);
struct messages *script_messages(struct script *script);
/* The names that the author's functions may use from now on. */
void script_set_names(struct script *script, struct model *model, const char *const *coordinates,
                      int coordinate_count);
/* Calls an author's function, which messages call `name`, with the state `s`; false when it failed (messages
 * say why). */
bool script_call(struct script *script, const struct value *function, const char *name, struct value *result);

/* Calls a sweep's function with the values of each case of `given`; the values that it gives are the columns
 * of `derived`, in the order of their names, which live in `memory`. False as above. */
bool script_derive(struct script *script, const struct value *function, const struct case_table *given,
                   struct memory *memory, struct case_table *derived);

/* Forms that authors write out of habit from other languages, and what Lua has instead. */

/* What to write instead, to follow Lua's message `text`; "": there is no advice. */
const char *slips_advice(const char *text);

/*
 * Lines of the tables in a Lua source.
 *
 * Lua forgets where a table was written. The source is rewritten so that each constructor `{...}` becomes
 * `__at(NUMBER, {...})` (`f{...}` becomes `f(__at(NUMBER, {...}))`), with a local `__at`, the argument of the
 * chunk, in front of it, but without a line break added, so that the lines of Lua's own messages stay;
 * `tables[NUMBER]` says where the table and its entries begin. The source must be free of syntax errors.
 */

#define TABLE_MARK "__at"

/* An entry of a constructor: `name = ...` or `["name"] = ...`, or the list item `index` (from 1) when name is
 * NULL.
 */
struct table_entry {
    const char *name;
    int index;
    int line;
};

struct table_source {
    const char *file;
    int line;
    struct table_entry *entries; /* list items in order, then names sorted */
    int count, capacity;
};

struct source_lines {
    struct table_source *tables;
    int count, capacity;
    char *text; /* the rewritten source */
    size_t length;
};

/* Numbers go on where those of an earlier source ended. What is given twice in one constructor is complained
 * about: Lua would silently take the last. */
void source_lines_mark_tables(struct memory *memory, struct messages *messages, const char *file,
                              const char *source, size_t length, struct source_lines *lines);
/* Line of entry `name` (NULL: of list item `index`) in table number `table`; 0 when unknown. */
int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index);

/*
 * What an author's function sees as `s` (and `p` outside of functions): names to symbols.
 *
 * s.t  s.q.NAME  s.qd.NAME  s.qdd.NAME  s.points.NAME.x ... zdd  s.points.NAME.axes.x.x ... zdd
 * s.axes.LINK.x.x ... zdd  s.points.NAME.wx ... wzd  s.axes.LINK.wx ... wzd  s.inputs.NAME  s.start.<the
 * same>  p.NAME
 */

enum view_kind {
    VIEW_PARAMETERS,
    VIEW_STATE,
    VIEW_COORDINATES,
    VIEW_POINTS,
    VIEW_POINT,
    VIEW_INPUTS,
    VIEW_AXES, /* by link */
    VIEW_AXES_OF_POINT,
    VIEW_AXES_OF_LINK,
    VIEW_AXES_OF_TIP,
    VIEW_DIRECTION
};

/* Something with named fields: `order` is that of coordinates, `index` that of a point, direction or link. */
struct view {
    enum view_kind kind;
    int order, index;
    bool at_start;
};

/* The names that a view reaches. */
struct view_names {
    const struct declarations *declarations;
    struct model *model; /* its links and points; directions that are asked for become markers */
    const char *const *coordinates;
    int coordinate_count;
};

struct view_result {
    bool is_view;
    struct view view;
    expression expression;
    const char *fault; /* NULL, or a message that names what is known */
    bool is_told;      /* the same fault has been complained about before */
};

struct view_result state_symbols_field(const struct view_names *names, struct view view, const char *field);

/* Formulas that model files call by name: courses in time and sections of beams. */

/* 0 before t0, 1 after t1, (1 - cos) / 2 between. */
expression vocabulary_ramp(struct graph *g, expression t, expression t0, expression t1);
/* 0 before t0, 1 after t1, 3 c^2 - 2 c^3 between. */
expression vocabulary_smoothstep(struct graph *g, expression t, expression t0, expression t1);

struct section {
    expression area, Iy, Iz, It; /* [m^2, m^4] */
};

struct section vocabulary_round_section(struct graph *g, expression diameter);
struct section vocabulary_tube_section(struct graph *g, expression outer, expression inner);
struct section vocabulary_rectangle_section(struct graph *g, expression width_y, expression height_z);

/* -level tanh(rate / width): dry friction, smooth within `width` of rest. */
expression vocabulary_friction(struct graph *g, expression level, expression rate, expression width);

/*
 * Warnings about what a model may well mean otherwise: values that look like millimetres or degrees, beams
 * that are none, coordinates without inertia or load. Takes a model without complaints.
 */

void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages);

/*
 * What a model's Lua has done so far, counted in steps of Lua and not in seconds, so that a model is read or
 * refused the same way on each machine.
 *
 * Takes what happened: steps, calls, memory taken, names looked through. A step may compare, convert or hash
 * a text as long as the longest so far, which is slow where texts hold bytes 0, and may take a remainder,
 * which is slow for distant numbers; it is counted as what it then may cost. Library functions that do more
 * than one pass over their arguments are counted by what they may do at most.
 */

enum { WORK_MILLIONS = 100 }; /* of steps that a file may take while it is read */

struct work {
    double steps;
    int millions;        /* of steps that it may take: WORK_MILLIONS, or more for what comes behind reading */
    size_t longest_text; /* bytes */
    bool has_remainders; /* a source contains the operator % */
    bool has_zeros;      /* a text may hold bytes 0: Lua orders such texts piece by piece */
};

void work_add(struct work *work, double steps);
void work_add_steps(struct work *work, int count);
/* A call of a function, or its return, with `count` arguments or results. */
void work_add_call(struct work *work, int count);
void work_add_memory(struct work *work, size_t bytes);
void work_add_text(struct work *work, size_t length);
/* A text that a library function gave. */
void work_note_zeros(struct work *work, const char *text, size_t length);
bool work_is_over(const struct work *work);

/* A source that will be compiled, before that. */
void work_add_source(struct work *work, const char *source, size_t length);

/* Steps that the search for a pattern in a text of `length` bytes may take. */
double work_pattern_steps(size_t length, const char *pattern, size_t pattern_length);
/* The same for a text that is searched as it is. */
double work_search_steps(size_t length, size_t searched);

#endif
