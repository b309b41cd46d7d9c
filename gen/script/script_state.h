/*
 * Shared by the files script*.c, the only ones that include this header and Lua's. Stack effects are given as
 * (-popped, +pushed).
 */
#ifndef REFDYN_GEN_SCRIPT_STATE_H
#define REFDYN_GEN_SCRIPT_STATE_H

#include "gen/script/source.h"

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
    const char *noun; /* the word for the file in messages */
    struct pool pool;
    struct work work;
    struct declarations declarations;
    struct view_names names;
    struct source_lines lines;
    struct sources sources;
    int marks, tags; /* references of Lua tables: from a table to its number in `lines`, and to its tag */
    int events;      /* the same from an author's metatable to the copy that Lua uses */
    int value_count;
    bool has_samples; /* the list that is being converted may be long */
    bool is_short_of_memory, is_text_too_long;
    bool is_reported;         /* the reason of an error is in messages */
    struct place error_place; /* the innermost line of the model's files when an error arose */
    struct value result;
};

/* ---- script_value.c: Lua values and plain values ---- */

struct script *script_of(lua_State *L);
/* Ends the script once it has done more than a file may. */
void script_stop_at_bound(lua_State *L);
/* Ends the script after an error that is in messages. */
void script_stop_reported(lua_State *L);
/* The line of the Lua function that called us. */
struct place script_place(lua_State *L);
/* The text at `index`, which must be a text. A byte 0 in it is an error, since C would cut the name there. */
const char *script_name_at(lua_State *L, int index);
/* Pushes the entry for the value at `index` in the table of `reference`. (-0, +1) */
void script_get_note(lua_State *L, int reference, int index);
/* Sets this entry to the value on top of the stack. (-1, +0) */
void script_set_note(lua_State *L, int reference, int index);

void script_push_expression(lua_State *L, expression e);
/* True for a number or an expression. */
bool script_get_expression(lua_State *L, int index, expression *e);
void script_push_view(lua_State *L, struct view view);
/* Number of options, parameters and inputs so far. */
int script_name_count(const struct script *script);
/* Steps of a look-up of a name among all names. */
double script_names_in(const struct script *script);
/* Converts the value at `index`. `place` is its line unless it is a marked table. (-0, +0) */
void script_convert(lua_State *L, int index, struct place place, int depth, struct value *value);
/* Pushes the result of a function of the module. (-0, +1) */
void script_push_value(lua_State *L, const struct value *value);

/* ---- script.c: protected calls ---- */

/* Runs a function of C in Lua. False after an error, which is in messages. The function must first call
 * script_job, which returns `job` and leaves an empty stack. */
bool script_run(struct script *script, int function(lua_State *L), void *job);
void *script_job(lua_State *L);

/* ---- script_kinds.c: kinds of files, and the functions of sweep, fit and plan files ---- */

/* Example of the argument of this function; NULL if no kind of file has it. */
const char *script_kind_form(const char *tag);
/* Puts rd.grid and the other functions of the kind of file into the table on top of the stack. (-0, +0) */
void script_add_kind_functions(lua_State *L);
/* The error message for a name that the module does not have in this file. */
const char *script_unknown_field(struct script *script, const char *name);

/* ---- script_metatable.c: expressions, groups of values and authors' tables ---- */

/* The metatables of expressions and of groups of values. */
void script_make_expressions(lua_State *L);
void script_make_views(lua_State *L);
/* setmetatable. Lua uses a copy of the metatable, which the author cannot change unnoticed. */
int script_set_metatable(lua_State *L);
/* Reports events that were changed after setmetatable, which has no effect. (-0, +0) */
void script_check_events(lua_State *L);
/* Makes the function on top of the stack answer for missing fields of the table below it. The model cannot
 * change this. (-1, +0) */
void script_guard_table(lua_State *L, const char *name);
/* Refuses TABLE:NAME(...), whose argument 1 would be the guarded table itself. (-0, +0) */
void script_refuse_colon(lua_State *L, const char *table, const char *name);

/* ---- script_library.c: what a model may use of Lua's libraries ---- */

/* table.sort by merging. Equal entries keep their order, and a contradictory order function does no harm. */
int script_sort_table(lua_State *L);
/* Pushes a table of the functions of one library that a model may use. (-0, +1) */
void script_push_library(lua_State *L, const char *name);
/* Refuses to read a global that is not set. A misspelled name would be nil and vanish in a list. */
int script_refuse_global(lua_State *L);

#endif
