/*
 * Converts Lua values to plain values and back, with the file and line of each, and keeps expressions and
 * groups of values as userdata of Lua. Stack effects are given as (-popped, +pushed).
 */
#include "gen/script/script_state.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Bounds of one model while it is read, in addition to work and memory. They are far above any real model. */
enum {
    VALUE_BOUND = 1000000,
    ENTRY_BOUND = 10000, /* entries of a table, whose names are compared with each other */
    DEPTH_BOUND = 32,
    EXPRESSION_BOUND = 100000
};

struct script *script_of(lua_State *L) {
    return *(struct script **)lua_getextraspace(L);
}

void script_stop_at_bound(lua_State *L) {
    const struct script *script = script_of(L);
    if (!work_is_over(&script->work))
        return;
    lua_pushfstring(L, "more than %d million steps to read the %s; look for a loop without an end",
                    script->work.millions, script->noun);
    lua_error(L);
}

struct place script_place(lua_State *L) {
    struct script *script = script_of(L);
    struct place place = {.file = script->file};
    const char *rest;
    luaL_where(L, 1);
    source_file_place(&script->sources, lua_tostring(L, -1), &place, &rest);
    lua_pop(L, 1);
    return place;
}

void script_stop_reported(lua_State *L) {
    script_of(L)->is_reported = true;
    lua_pushnil(L);
    lua_error(L);
}

/* Ends the script with a message about a bound that was exceeded at `place`. */
static void stop_at(lua_State *L, struct place place, int bound, const char *what) {
    message_error(script_of(L)->messages, place, "more than %d %s", bound, what);
    script_stop_reported(L);
}

const char *script_name_at(lua_State *L, int index) {
    size_t length;
    const char *name = lua_tolstring(L, index, &length);
    if (strlen(name) < length)
        luaL_error(L, "name \"%s\": contains control character 0; remove it",
                   message_safe_text(script_of(L)->memory, name, length));
    return name;
}

void script_get_note(lua_State *L, int reference, int index) {
    index = lua_absindex(L, index);
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
    lua_pushvalue(L, index);
    lua_rawget(L, -2);
    lua_remove(L, -2);
}

void script_set_note(lua_State *L, int reference, int index) {
    index = lua_absindex(L, index);
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
    lua_pushvalue(L, index);
    lua_pushvalue(L, -3);
    lua_rawset(L, -3);
    lua_pop(L, 2);
}

/* The table's number in `lines`; -1 if no constructor in the source made it. */
static int table_number(lua_State *L, int index) {
    struct script *script = script_of(L);
    script_get_note(L, script->marks, index);
    lua_Integer found = lua_isinteger(L, -1) ? lua_tointeger(L, -1) : -1;
    lua_pop(L, 1);
    return found >= 0 && found < script->lines.count ? (int)found : -1;
}

/* ---- expressions, and groups of values such as s and p ---- */

void script_push_expression(lua_State *L, expression e) {
    if (script_of(L)->graph->count > EXPRESSION_BOUND)
        stop_at(L, script_place(L), EXPRESSION_BOUND, "different expressions in the model");
    expression *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = e;
    luaL_setmetatable(L, EXPRESSION);
}

bool script_get_expression(lua_State *L, int index, expression *e) {
    if (lua_type(L, index) == LUA_TNUMBER) {
        *e = expr_number(script_of(L)->graph, lua_tonumber(L, index));
        return true;
    }
    const expression *handle = luaL_testudata(L, index, EXPRESSION);
    if (handle)
        *e = *handle;
    return handle;
}

void script_push_view(lua_State *L, struct view view) {
    struct view *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = view;
    luaL_setmetatable(L, VIEW);
}

int script_name_count(const struct script *script) {
    const struct declarations *declared = &script->declarations;
    return declared->option_count + declared->parameter_count + declared->input_count;
}

double script_names_in(const struct script *script) {
    const struct model *model = script->names.model;
    const int in_model =
        model ? model->link_count + model->point_count + model->state_count + script->names.coordinate_count
              : 0;
    return (script_name_count(script) + in_model + (double)script->graph->symbol_count) / 8;
}

/* ---- Lua values to plain values ---- */

/* Reports keys that are neither names nor positions, in the order of their types. */
static void refuse_keys(lua_State *L, struct place place, const bool *has_type) {
    for (int type = 0; type < LUA_NUMTYPES; type++)
        if (has_type[type])
            message_error(script_of(L)->messages, place,
                          "a table has a key of type %s; keys must be names or 1, 2, 3 ...",
                          lua_typename(L, type));
}

/* Counts list items and named entries, and reports other entries. */
static void count_entries(lua_State *L, int index, struct value *value) {
    struct messages *messages = script_of(L)->messages;
    bool has_type[LUA_NUMTYPES] = {false}; /* of keys that are refused */
    lua_Integer largest = 0;
    lua_pushnil(L);
    while (lua_next(L, index)) {
        lua_pop(L, 1);
        if (lua_type(L, -1) == LUA_TSTRING) {
            value->field_count++;
        } else if (lua_isinteger(L, -1) && lua_tointeger(L, -1) > 0) {
            value->item_count++;
            largest = lua_tointeger(L, -1) > largest ? lua_tointeger(L, -1) : largest;
        } else {
            has_type[lua_type(L, -1)] = true;
        }
    }
    refuse_keys(L, value->place, has_type);
    if (largest == value->item_count)
        return;
    int gap = 1;
    for (; lua_rawgeti(L, index, gap) != LUA_TNIL; gap++)
        lua_pop(L, 1);
    lua_pop(L, 1);
    message_error(messages, value->place, "item %d of a list is nil; lists must have no gaps", gap);
    const bool is_sparse = largest / 2 > value->item_count;
    value->item_count = is_sparse ? gap - 1 : (int)largest; /* gaps become VALUE_NOTHING */
}

/* A text of the model. If it has an error, each character but letters and digits becomes _, so that no
 * further error follows. */
static const char *take_text(lua_State *L, int index, struct place place, const char *kind) {
    struct script *script = script_of(L);
    size_t length;
    const char *text = lua_tolstring(L, index, &length);
    const char *safe = message_safe_text(script->memory, text, length);
    char *taken = memory_text(script->memory, safe);
    if (message_is_one_line(script->messages, place, memory_format(script->memory, "%s \"%s\"", kind, safe),
                            text, length))
        return safe;
    for (char *c = taken; *c; c++)
        *c = (char)(isalnum((unsigned char)*c) ? *c : '_');
    return taken;
}

static void convert_items(lua_State *L, int index, int table, int depth, struct value *value) {
    struct script *script = script_of(L);
    value->items = memory_get(script->memory, (size_t)value->item_count * sizeof *value->items);
    for (int i = 0; i < value->item_count; i++) {
        struct place place = value->place;
        int line = source_lines_of_entry(&script->lines, table, NULL, i + 1);
        place.line = line > 0 ? line : place.line;
        lua_rawgeti(L, index, i + 1);
        script_convert(L, -1, place, depth, &value->items[i]);
        lua_pop(L, 1);
    }
}

/* A name in a Lua table, which owns its text. */
struct raw_name {
    const char *text;
    size_t length;
};

static int compare_raw_names(const void *a, const void *b) {
    const struct raw_name *left = a, *right = b;
    const int order =
        memcmp(left->text, right->text, left->length < right->length ? left->length : right->length);
    return order ? order : (left->length > right->length) - (left->length < right->length);
}

/* The `count` names of a table, sorted, since Lua's order is random; in scratch. */
static struct raw_name *sorted_names(lua_State *L, int index, int count) {
    struct raw_name *names = memory_scratch(script_of(L)->memory, ((size_t)count + 1) * sizeof *names);
    int at = 0;
    lua_pushnil(L);
    while (lua_next(L, index)) {
        lua_pop(L, 1);
        if (lua_type(L, -1) != LUA_TSTRING)
            continue;
        names[at].text = lua_tolstring(L, -1, &names[at].length);
        at++;
    }
    qsort(names, (size_t)count, sizeof *names, compare_raw_names);
    return names;
}

static void convert_fields(lua_State *L, int index, int table, int depth, struct value *value) {
    struct script *script = script_of(L);
    const struct memory_mark mark = memory_mark(script->memory);
    const struct raw_name *names = sorted_names(L, index, value->field_count);
    value->fields = memory_get(script->memory, (size_t)value->field_count * sizeof *value->fields);
    int at = 0;
    for (int i = 0; i < value->field_count; i++) {
        struct value_field *field = &value->fields[at];
        struct place place = value->place;
        const int errors = script->messages->errors;
        lua_pushlstring(L, names[i].text, names[i].length);
        field->name = take_text(L, -1, value->place, "name");
        at += script->messages->errors == errors; /* leaves out a name that was reported */
        lua_rawget(L, index);
        int line = source_lines_of_entry(&script->lines, table, field->name, 0);
        place.line = line > 0 ? line : place.line;
        script_convert(L, -1, place, depth, &field->value);
        lua_pop(L, 1);
    }
    value->field_count = at;
    memory_back(script->memory, mark);
}

static void convert_table(lua_State *L, int index, int depth, struct value *value) {
    struct script *script = script_of(L);
    int table = table_number(L, index);
    if (depth > DEPTH_BOUND)
        stop_at(L, value->place, DEPTH_BOUND, "tables nested in each other");
    luaL_checkstack(L, 8, "tables nested too deeply");
    value->kind = VALUE_TABLE;
    if (table >= 0)
        value->place = source_lines_of_table(&script->lines, table);
    script_get_note(L, script->tags, index);
    if (lua_type(L, -1) == LUA_TSTRING)
        value->tag = memory_text(script->memory, lua_tostring(L, -1));
    lua_pop(L, 1);
    count_entries(L, index, value);
    if (value->item_count + value->field_count > ENTRY_BOUND && !script->has_samples)
        stop_at(L, value->place, ENTRY_BOUND, "entries in a table");
    convert_items(L, index, table, depth + 1, value);
    convert_fields(L, index, table, depth + 1, value);
}

void script_convert(lua_State *L, int index, struct place place, int depth, struct value *value) {
    struct script *script = script_of(L);
    index = lua_absindex(L, index);
    *value = (struct value){.place = place};
    if (++script->value_count > VALUE_BOUND)
        stop_at(L, place, VALUE_BOUND, memory_format(script->memory, "values in the %s", script->noun));
    switch (lua_type(L, index)) {
    case LUA_TNUMBER:
        value->kind = VALUE_NUMBER;
        value->number = lua_tonumber(L, index);
        value->is_whole = lua_isinteger(L, index);
        break;
    case LUA_TSTRING:
        value->kind = VALUE_TEXT;
        value->text = take_text(L, index, place, "text");
        break;
    case LUA_TBOOLEAN:
        value->kind = VALUE_BOOLEAN;
        value->truth = lua_toboolean(L, index);
        break;
    case LUA_TFUNCTION:
        value->kind = VALUE_FUNCTION;
        lua_pushvalue(L, index);
        value->function = luaL_ref(L, LUA_REGISTRYINDEX);
        break;
    case LUA_TTABLE:
        convert_table(L, index, depth, value);
        break;
    default:
        if (script_get_expression(L, index, &value->expression))
            value->kind = VALUE_EXPRESSION;
        else if (luaL_testudata(L, index, VIEW))
            value->kind = VALUE_GROUP;
    }
}

/* ---- plain values to Lua values ---- */

/* A curve of an expression, or of a number. */
static int call_curve(lua_State *L) {
    struct graph *graph = script_of(L)->graph;
    expression at = EXPR_ZERO;
    if (lua_gettop(L) != 1)
        return luaL_error(L, "a curve of %d values; must be of one number or expression", lua_gettop(L));
    if (!script_get_expression(L, 1, &at))
        return luaL_error(L, "a curve of %s; must be of one number or expression", luaL_typename(L, 1));
    script_push_expression(L, expr_spline(graph, (int)lua_tointeger(L, lua_upvalueindex(1)), at));
    return 1;
}

void script_push_value(lua_State *L, const struct value *value) {
    if (value->kind == VALUE_EXPRESSION)
        script_push_expression(L, value->expression);
    else if (value->kind == VALUE_CURVE) {
        lua_pushinteger(L, value->curve);
        lua_pushcclosure(L, call_curve, 1);
    } else if (value->kind == VALUE_GROUP)
        script_push_view(L, view_of_parameters);
    else if (value->kind == VALUE_TEXT)
        lua_pushstring(L, value->text);
    else if (value->kind == VALUE_BOOLEAN)
        lua_pushboolean(L, value->truth);
    else if (value->kind == VALUE_NUMBER && value->is_whole)
        lua_pushinteger(L, (lua_Integer)value->number);
    else if (value->kind == VALUE_NUMBER)
        lua_pushnumber(L, value->number);
    else
        lua_createtable(L, 0, value->field_count);
    for (int i = 0; i < value->field_count; i++) {
        script_push_value(L, &value->fields[i].value);
        lua_setfield(L, -2, value->fields[i].name);
    }
}
