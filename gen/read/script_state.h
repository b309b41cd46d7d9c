/*
 * What the files that know Lua share: script.c (the sandbox and its protected calls), script_value.c,
 * script_metatable.c and script_library.c. No other file includes this header, or Lua's.
 *
 * Stack effects stand beside the functions as (-popped, +pushed).
 */
#ifndef REFDYN_GEN_SCRIPT_STATE_H
#define REFDYN_GEN_SCRIPT_STATE_H

#include "gen/read/reader.h"
#include "gen/read/read.h"

#include <lua.h>
#include <lauxlib.h>

/* Names of the metatables of our values. */
#define EXPRESSION "expression"
#define VIEW "view"

struct script {
    lua_State *L;
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const char *file;
    enum file_kind kind;
    struct pool pool;
    struct work work;
    struct declarations declarations;
    struct view_names names;
    struct source_lines lines;
    struct sources sources;
    int marks, tags; /* references of tables that give a table's number in `lines` and its tag */
    int events;      /* reference of a table that gives the copy that Lua uses of an author's metatable */
    int value_count;
    bool has_samples; /* the list that is converted may be long */
    bool is_short_of_memory, is_text_too_long;
    bool is_told;             /* the reason of an error is in messages */
    struct place error_place; /* of the innermost line of the model's files when an error arose */
    struct value result;
};

/* ---- script_value.c ---- */

struct script *script_of(lua_State *L);
/* What messages call the file: a "model", or a "sweep". */
const char *script_noun(const struct script *script);
/* Ends the script once it has done more than a file may. */
void script_stop_at_bound(lua_State *L);
/* Ends the script; messages have said why. */
void script_stop_told(lua_State *L);
/* Where the Lua function that called us stands. */
struct place script_place(lua_State *L);
/* The text at `index`, which is one; a name with a byte 0 would be cut there. */
const char *script_name_at(lua_State *L, int index);
/* Entry of the table behind `reference` for the value at `index`. (-0, +1) */
void script_get_note(lua_State *L, int reference, int index);
/* Notes the value on top of the stack for the value at `index`. (-1, +0) */
void script_set_note(lua_State *L, int reference, int index);

void script_push_expression(lua_State *L, expression e);
/* True for a number or an expression. */
bool script_get_expression(lua_State *L, int index, expression *e);
void script_push_view(lua_State *L, struct view view);
/* Options, parameters and inputs so far. */
int script_name_count(const struct script *script);
/* Steps to look a name up among all that there are. */
double script_names_in(const struct script *script);
/* The value at `index`, `place`: where it stands if it does not know better. (-0, +0) */
void script_convert(lua_State *L, int index, struct place place, int depth, struct value *value);
/* Pushes what a function of the module gives. (-0, +1) */
void script_push_value(lua_State *L, const struct value *value);

/* ---- script.c: needed by what is called behind it ---- */

/* Runs a function of C in Lua; false when an error arose, which messages tell. It finds `job` by
 * script_job, first of all, on an empty stack. */
bool script_run(struct script *script, int function(lua_State *L), void *job);
void *script_job(lua_State *L);

/* ---- script_sweep.c ---- */

/* Name of the function that makes the sweep. */
#define SWEEP_TAG "sweep"

/* Puts rd.grid and its like into the table on top of the stack. (-0, +0) */
void script_add_sweep_functions(lua_State *L);
/* What to say of a name that the module does not have in such a file. */
const char *script_unknown_in_sweep(struct memory *memory, const char *name);
/* Has the module such a function in sweep files? */
bool script_is_of_sweeps(const char *name);

/* ---- script_metatable.c ---- */

/* Make the metatables of expressions, and of groups of values. */
void script_make_expressions(lua_State *L);
void script_make_views(lua_State *L);
/* setmetatable: Lua uses a copy, which the author cannot change unseen. */
int script_set_metatable(lua_State *L);
/* Complains about events that were changed behind setmetatable, since tables do not have them. (-0, +0) */
void script_check_events(lua_State *L);
/* Gives the table below it the function on top for fields that it lacks; nobody else can change that. (-1,
 * +0) */
void script_guard_table(lua_State *L, const char *name);
/* Refuses TABLE:NAME(...): argument 1 would be the guarded table itself. (-0, +0) */
void script_refuse_colon(lua_State *L, const char *table, const char *name);

/* ---- script_library.c ---- */

/* table.sort by merging: equal entries keep their order, and a contradictory order does no harm. */
int script_sort_table(lua_State *L);
/* A table with what a model may use of one library. (-0, +1) */
void script_push_library(lua_State *L, const char *name);
/* Reading a global that nothing has set: a slip of the pen would be nil, and vanish in a formula or list. */
int script_refuse_global(lua_State *L);

#endif
