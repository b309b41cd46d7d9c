/*
 * Values that a sweep derives, case by case. Reads the columns of the cases; fills the derived columns.
 *
 * All cases are one protected call. Numbers are written directly into the columns, and each text is kept
 * once, so that Lua's memory does not grow with the number of cases. Stack effects are given as (-popped,
 * +pushed).
 */
#include "gen/script/script_state.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Steps of Lua that each case may take, in addition to WORK_MILLIONS for all of them. A short formula takes
 * 200. */
enum { STEPS_OF_CASE = 2000 };

/* Indices on the stack of run_cases. */
enum { AT_FUNCTION = 1, AT_GUARD, AT_TEXTS };

struct derivation {
    const struct value *function;
    const struct case_table *given;
    struct memory *memory; /* of the columns */
    struct case_table *derived;
    long index; /* of the case */
};

static struct messages *messages_of(lua_State *L) {
    return script_of(L)->messages;
}

/* Ends the script, since the field `name` (NULL: the result) of this case is wrong. */
static _Noreturn void refuse(lua_State *L, const struct derivation *job, const char *name, const char *fact) {
    message_error(messages_of(L), job->function->place, "derive: case %ld: %s%s%s", job->index,
                  name ? name : "", name ? ": " : "", fact);
    script_stop_reported(L);
    abort(); /* not reached */
}

/* Refuses to read an unknown field of the argument. Upvalue: the job. */
static int refuse_case_field(lua_State *L) {
    const struct derivation *job = lua_touserdata(L, lua_upvalueindex(1));
    const char *name = lua_type(L, 2) == LUA_TSTRING ? script_name_at(L, 2) : luaL_typename(L, 2);
    const char **known = memory_get(script_of(L)->memory, ((size_t)job->given->width + 1) * sizeof *known);
    for (int i = 0; i < job->given->width; i++)
        known[i] = job->given->columns[i].name;
    return luaL_error(L, "derive: \"%s\" does not vary%s", name,
                      message_advice_on_name(script_of(L)->memory, name, known, job->given->width));
}

/* Refuses to write a new field of the argument. */
static int refuse_new_case_field(lua_State *L) {
    return luaL_error(
        L, "derive: \"%s\" is written to the values of a case, which are read only; return { NAME = value }",
        lua_type(L, 2) == LUA_TSTRING ? script_name_at(L, 2) : luaL_typename(L, 2));
}

/* The metatable of all arguments. (-0, +1) */
static void push_guard(lua_State *L, struct derivation *job) {
    lua_createtable(L, 0, 3);
    lua_pushcfunction(L, refuse_new_case_field);
    lua_setfield(L, -2, "__newindex");
    lua_pushlightuserdata(L, job);
    lua_pushcclosure(L, refuse_case_field, 1);
    lua_setfield(L, -2, "__index");
    lua_pushliteral(L, "the values of a case");
    lua_setfield(L, -2, "__metatable");
}

/* (-0, +1) */
static void push_value(lua_State *L, const struct case_column *column, long index) {
    const double value = column->values[index];
    if (column->kind == CASES_TEXTS)
        lua_pushstring(L, column->texts[(int)value]);
    else if (column->kind == CASES_TRUTHS)
        lua_pushboolean(L, value != 0);
    else if (column->kind == CASES_WHOLE)
        lua_pushinteger(L, (lua_Integer)value);
    else
        lua_pushnumber(L, value);
}

/* (-0, +1) */
static void push_case(lua_State *L, const struct derivation *job) {
    const struct case_table *given = job->given;
    lua_createtable(L, 0, given->width);
    for (int i = 0; i < given->width; i++) {
        push_value(L, &given->columns[i], job->index);
        lua_setfield(L, -2, given->columns[i].name);
    }
    lua_pushvalue(L, AT_GUARD);
    lua_setmetatable(L, -2);
}

/* The argument on top of the stack must be unchanged, since a change would have no effect. (-1, +0) */
static void check_argument(lua_State *L, const struct derivation *job) {
    static const char fact[] = "the function writes to the values of the case, which are read only; return "
                               "{ NAME = value }";
    int count = 0;
    for (int i = 0; i < job->given->width; i++) {
        const char *name = job->given->columns[i].name;
        push_value(L, &job->given->columns[i], job->index);
        lua_pushstring(L, name);
        lua_rawget(L, -3);
        if (!lua_rawequal(L, -1, -2))
            refuse(L, job, name, fact);
        lua_pop(L, 2);
    }
    for (lua_pushnil(L); lua_next(L, -2); lua_pop(L, 1))
        count++;
    if (count > job->given->width)
        refuse(L, job, NULL, fact);
    lua_pop(L, 1);
}

static bool is_whole(lua_State *L) {
    const double largest = 9007199254740992; /* 2^53 */
    return lua_isinteger(L, -1) && fabs(lua_tonumber(L, -1)) <= largest;
}

/* The kind of the value on top of the stack. */
static enum case_values kind_of(lua_State *L, const struct derivation *job, const char *name) {
    const int type = lua_type(L, -1);
    if (type == LUA_TNUMBER)
        return is_whole(L) ? CASES_WHOLE : CASES_NUMBERS;
    if (type == LUA_TBOOLEAN)
        return CASES_TRUTHS;
    if (type != LUA_TSTRING)
        refuse(L, job, name,
               memory_format(script_of(L)->memory, "of type %s; must be a number, a text, true or false",
                             lua_typename(L, type)));
    return CASES_TEXTS;
}

static bool are_numbers(enum case_values kind) {
    return kind == CASES_NUMBERS || kind == CASES_WHOLE;
}

/* The names of the result on top of the stack must be texts. */
static const char *key_name(lua_State *L, const struct derivation *job) {
    if (lua_type(L, -2) != LUA_TSTRING)
        refuse(L, job, NULL, "an entry without a name; return { NAME = value }");
    return script_name_at(L, -2);
}

static int by_name(const void *a, const void *b) {
    return strcmp(((const struct case_column *)a)->name, ((const struct case_column *)b)->name);
}

/* The columns are sorted by name. */
static struct case_column *find(const struct case_table *derived, const char *name) {
    const struct case_column key = {.name = name};
    return derived->width > 0 ? bsearch(&key, derived->columns, (size_t)derived->width, sizeof key, by_name)
                              : NULL;
}

/* A derived name must not be one of those that vary. */
static void check_new_name(lua_State *L, const struct derivation *job, const char *name) {
    for (int i = 0; i < job->given->width; i++)
        if (strcmp(job->given->columns[i].name, name) == 0)
            refuse(L, job, name, "already varies; choose another name or remove it from vary");
}

/* Makes the columns from the first case's result on top of the stack. (-0, +0) */
static void make_columns(lua_State *L, const struct derivation *job) {
    struct case_table *derived = job->derived;
    int count = 0, room = 0;
    for (lua_pushnil(L); lua_next(L, -2); lua_pop(L, 1)) {
        const char *name = key_name(L, job);
        check_new_name(L, job, name);
        derived->columns = memory_room(job->memory, derived->columns, count, &room, sizeof *derived->columns);
        derived->columns[count++] = (struct case_column){.name = memory_text(job->memory, name),
                                                         .place = job->function->place,
                                                         .kind = kind_of(L, job, name)};
    }
    if (count == 0)
        refuse(L, job, NULL, "an empty table; return { NAME = value }");
    qsort(derived->columns, (size_t)count, sizeof *derived->columns, by_name);
    derived->width = count;
    for (int i = 0; i < count; i++)
        derived->columns[i].values = memory_get(job->memory, (size_t)derived->count * sizeof(double));
}

/* The number of the text on top of the stack among the texts of the column so far. (-0, +0) */
static int text_number(lua_State *L, const struct derivation *job, struct case_column *column) {
    lua_pushfstring(L, "%s=%s", column->name, lua_tostring(L, -1));
    lua_pushvalue(L, -1);
    int number = 0;
    if (lua_rawget(L, AT_TEXTS) == LUA_TNUMBER) {
        number = (int)lua_tointeger(L, -1);
        lua_pop(L, 2);
        return number;
    }
    lua_pop(L, 1);
    number = column->text_count;
    lua_pushinteger(L, number);
    lua_rawset(L, AT_TEXTS);
    if ((number & (number - 1)) == 0) /* the list is full: double it */
        column->texts = memory_grow(job->memory, column->texts, (size_t)number * sizeof *column->texts,
                                    ((size_t)number * 2 + 1) * sizeof *column->texts);
    column->texts[column->text_count++] = memory_text(job->memory, lua_tostring(L, -1));
    return number;
}

/* Checks that the text can be shown and stored. */
static void check_text(lua_State *L, const struct derivation *job, const char *name) {
    size_t length;
    const char *text = lua_tolstring(L, -1, &length);
    char what[80];
    snprintf(what, sizeof what, "derive: case %ld: %s", job->index, name);
    if (!message_is_one_line(messages_of(L), job->function->place, what, text, length))
        script_stop_reported(L);
}

/* Puts the value on top of the stack into its column. (-0, +0) */
static void take_value(lua_State *L, const struct derivation *job, struct case_column *column) {
    const enum case_values kind = kind_of(L, job, column->name);
    double *value = &column->values[job->index];
    if (kind != column->kind && !(are_numbers(kind) && are_numbers(column->kind)))
        refuse(L, job, column->name, "of another type than in the first case; must be of one type");
    if (kind == CASES_TEXTS) {
        check_text(L, job, column->name);
        *value = text_number(L, job, column);
        return;
    }
    column->kind = kind == column->kind ? kind : CASES_NUMBERS;
    *value = kind == CASES_TRUTHS ? lua_toboolean(L, -1) : lua_tonumber(L, -1);
    if (!isfinite(*value))
        refuse(L, job, column->name,
               memory_format(script_of(L)->memory, "value %s; must be finite", text_not_finite(*value)));
}

/* Puts the result on top of the stack into the columns. (-1, +0) */
static void take_result(lua_State *L, const struct derivation *job) {
    int count = 0;
    if (lua_type(L, -1) != LUA_TTABLE)
        refuse(L, job, NULL,
               memory_format(script_of(L)->memory,
                             "the function returns %s; must return a table such as { NAME = value }",
                             luaL_typename(L, -1)));
    if (job->index == 0)
        make_columns(L, job);
    for (lua_pushnil(L); lua_next(L, -2); lua_pop(L, 1)) {
        const char *name = key_name(L, job);
        struct case_column *column = find(job->derived, name);
        if (!column)
            refuse(L, job, name, "missing in the first case; return the same names in each case");
        take_value(L, job, column);
        count++;
    }
    if (count < job->derived->width)
        refuse(L, job, NULL, "fewer names than in the first case; return the same names in each case");
    lua_pop(L, 1);
}

static int run_cases(lua_State *L) {
    struct derivation *job = script_job(L);
    lua_rawgeti(L, LUA_REGISTRYINDEX, job->function->function);
    push_guard(L, job);
    lua_newtable(L);
    for (job->index = 0; job->index < job->given->count; job->index++) {
        push_case(L, job);
        lua_pushvalue(L, AT_FUNCTION);
        lua_pushvalue(L, -2);
        lua_call(L, 1, 1);
        take_result(L, job);
        check_argument(L, job);
    }
    script_check_events(L);
    return 0;
}

bool script_derive(struct script *script, const struct value *function, const struct case_table *given,
                   struct memory *memory, struct case_table *derived) {
    struct derivation job = {.function = function, .given = given, .memory = memory, .derived = derived};
    *derived = (struct case_table){.count = given->count};
    script->work.steps = 0;
    script->work.millions = WORK_MILLIONS + (int)((double)given->count * STEPS_OF_CASE / 1e6);
    return script_run(script, run_cases, &job);
}
