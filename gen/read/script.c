/*
 * The only file that knows Lua: runs a model file in a sandbox and turns what it returns into values.
 *
 * Every entry of Lua is one protected call. Inside it a shortage of memory is a Lua error, outside it becomes
 * memory.fail again. All that Lua does is counted (work.h): by a hook at every few steps and at every call,
 * by the allocator, and by the library functions that do more. Stack effects stand beside the functions as
 * (-popped, +pushed).
 */
#include "read/script.h"
#include "read/lint.h"
#include "read/fields.h"
#include "read/local_variables.h"
#include "read/module.h"
#include "read/pool.h"
#include "read/sandbox.h"
#include "read/source_file.h"
#include "read/source_lines.h"
#include "base/text.h"
#include "read/state_symbols.h"
#include "read/work.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lua.h>
#include <lauxlib.h>
#include <lualib.h>

#define EXPRESSION "expression"
#define VIEW "view"

/* What one model may take while it is read, beside its work and memory: far beyond any sensible model. */
enum {
    STEPS_BETWEEN_CHECKS = 100,
    VALUE_BOUND = 1000000,
    ENTRY_BOUND = 10000, /* of a table: names are compared with each other */
    DEPTH_BOUND = 32,
    TEXT_MEGABYTES = 4,
    ARGUMENTS_BOUND = 250, /* of a function with `...`, which any step may copy */
    EXPRESSION_BOUND = 100000
};

struct script {
    lua_State *L;
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const char *file;
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

static struct script *script_of(lua_State *L) {
    return *(struct script **)lua_getextraspace(L);
}

/* Ends the script once it has done more than a model may. */
static void stop_at_bound(lua_State *L) {
    if (!work_is_over(&script_of(L)->work))
        return;
    lua_pushfstring(L, "more than %d million steps to read the model, a loop has no end?", WORK_MILLIONS);
    lua_error(L);
}

/* Where the Lua function that called us stands. */
static struct place current_place(lua_State *L) {
    struct script *script = script_of(L);
    struct place place = {.file = script->file};
    const char *rest;
    luaL_where(L, 1);
    source_file_place(&script->sources, lua_tostring(L, -1), &place, &rest);
    lua_pop(L, 1);
    return place;
}

/* Ends the script with a message about a bound that was passed at `place`. */
static void stop_at(lua_State *L, struct place place, const char *what, int bound) {
    message_error(script_of(L)->messages, place, "%s %d", what, bound);
    script_of(L)->is_told = true;
    lua_pushnil(L);
    lua_error(L);
}

/* The text at `index`, which is one; a name with a byte 0 would be cut there. */
static const char *name_at(lua_State *L, int index) {
    size_t length;
    const char *name = lua_tolstring(L, index, &length);
    if (strlen(name) < length)
        luaL_error(L, "name \"%s\": contains control character 0, a line of text is needed",
                   message_safe_text(script_of(L)->memory, name, length));
    return name;
}

/* Entry of the table behind `reference` for the value at `index`. (-0, +1) */
static void get_note(lua_State *L, int reference, int index) {
    index = lua_absindex(L, index);
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
    lua_pushvalue(L, index);
    lua_rawget(L, -2);
    lua_remove(L, -2);
}

/* Notes the value on top of the stack for the value at `index`. (-1, +0) */
static void set_note(lua_State *L, int reference, int index) {
    index = lua_absindex(L, index);
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference);
    lua_pushvalue(L, index);
    lua_pushvalue(L, -3);
    lua_rawset(L, -3);
    lua_pop(L, 2);
}

/* __at(number, table) in the rewritten source: remembers where the table was written. */
static int mark_table(lua_State *L) {
    lua_settop(L, 2);
    lua_pushvalue(L, 1);
    set_note(L, script_of(L)->marks, 2);
    return 1;
}

/* The table's number in `lines`, -1 for one that the model made otherwise. */
static int table_number(lua_State *L, int index) {
    struct script *script = script_of(L);
    get_note(L, script->marks, index);
    lua_Integer found = lua_isinteger(L, -1) ? lua_tointeger(L, -1) : -1;
    lua_pop(L, 1);
    return found >= 0 && found < script->lines.count ? (int)found : -1;
}

/* ---- expressions ---- */

static void push_expression(lua_State *L, expression e) {
    if (script_of(L)->graph->count > EXPRESSION_BOUND)
        stop_at(L, current_place(L), "more different expressions in the model than", EXPRESSION_BOUND);
    expression *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = e;
    luaL_setmetatable(L, EXPRESSION);
}

/* True for a number or an expression. */
static bool get_expression(lua_State *L, int index, expression *e) {
    if (lua_type(L, index) == LUA_TNUMBER) {
        *e = expr_number(script_of(L)->graph, lua_tonumber(L, index));
        return true;
    }
    const expression *handle = luaL_testudata(L, index, EXPRESSION);
    if (handle)
        *e = *handle;
    return handle;
}

static int arithmetic(lua_State *L) {
    struct graph *graph = script_of(L)->graph;
    enum operation operation = (enum operation)lua_tointeger(L, lua_upvalueindex(1));
    expression a, b;
    for (int i = 1; i <= 2; i++)
        if (!get_expression(L, i, i == 1 ? &a : &b))
            return luaL_error(L, "arithmetic on an expression and %s, a number or an expression is needed",
                              luaL_typename(L, i));
    push_expression(L, operation == OP_POW ? expr_power(graph, a, b)
                                           : expr_apply(graph, operation, a, b, expr_zero(graph)));
    return 1;
}

/* What Lua can do with a value and an expression cannot: the event, and why not. */
static const struct {
    const char *event, *fault;
} refused_events[] = {
#define NOT_KNOWN "its value is not known while the model is read, "
#define COMPARISON \
    "comparison of an expression: " NOT_KNOWN "rd.where(rd.less(a, b), x, y) chooses during the motion"
#define BITS " of an expression: " NOT_KNOWN "rd.where(rd.less(a, b), x, y) chooses during the motion"
    {"__lt", COMPARISON},
    {"__le", COMPARISON},
    {"__eq", COMPARISON},
    {"__mod",
     "%% of an expression: rd has no remainder, rd.atan2(rd.sin(x), rd.cos(x)) keeps an angle x between -pi "
     "and pi"},
    {"__idiv", "// of an expression: rd has no rounding, a / b divides"},
    {"__band", "&" BITS},
    {"__bor", "|" BITS},
    {"__bxor", "~" BITS},
    {"__bnot", "~" BITS},
    {"__shl", "<<" BITS},
    {"__shr", ">>" BITS},
    {"__concat", ".. of an expression: " NOT_KNOWN "the value of an option (rd.option) is"},
    {"__len", "# of an expression: it is one value and has no length, a list or a text has"},
    {"__call",
     "call of an expression: it is a value, * multiplies it, and functions are called as rd.sin(x)"},
    {"__index", "field of an expression: it is one value and has no fields"},
    {"__newindex", "assignment to a field of an expression: it is one value and has no fields"},
#undef NOT_KNOWN
#undef COMPARISON
#undef BITS
};

static int refuse_event(lua_State *L) {
    return luaL_error(L, refused_events[lua_tointeger(L, lua_upvalueindex(1))].fault);
}

/* ---- what functions see as s and p ---- */

static void push_view(lua_State *L, struct view view) {
    struct view *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = view;
    luaL_setmetatable(L, VIEW);
}

static int name_count(const struct script *script) {
    const struct declarations *declared = &script->declarations;
    return declared->option_count + declared->parameter_count + declared->input_count;
}

/* Steps to look a name up among all that there are. */
static double names_in(const struct script *script) {
    const struct model *model = script->names.model;
    const int in_model = model ? model->link_count + model->point_count + script->names.coordinate_count : 0;
    return (name_count(script) + in_model + (double)script->graph->symbol_count) / 8;
}

static int index_view(lua_State *L) {
    struct script *script = script_of(L);
    const struct view *view = lua_touserdata(L, 1);
    if (lua_type(L, 2) != LUA_TSTRING)
        return luaL_error(L, "index of type %s, a name is needed", luaL_typename(L, 2));
    work_add(&script->work, names_in(script));
    struct view_result result = state_symbols_field(&script->names, *view, name_at(L, 2));
    script->is_told = result.fault && result.is_told;
    if (result.fault)
        return luaL_error(L, "%s", result.fault);
    if (result.is_view)
        push_view(L, result.view);
    else
        push_expression(L, result.expression);
    return 1;
}

static int refuse_group(lua_State *L) {
    return luaL_error(L, "a group of values is taken for one: p.NAME, s.q.NAME or s.points.NAME.x is one");
}

static int refuse_assignment(lua_State *L) {
    return luaL_error(L, "assignment to a field of the state or of the parameters: they are read only");
}

/* ---- Lua values to plain values ---- */

static void convert(lua_State *L, int index, struct place place, int depth, struct value *value);

static int compare_texts(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* Complains about keys that are neither names nor positions, in the order of the types. */
static void refuse_keys(lua_State *L, struct place place, const bool *has_type) {
    for (int type = 0; type < LUA_NUMTYPES; type++)
        if (has_type[type])
            message_error(script_of(L)->messages, place,
                          "a table has a key of type %s, names and 1, 2, 3 ... are", lua_typename(L, type));
}

/* Counts list items and named entries; complains about what is neither. */
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
    message_error(messages, value->place, "item %d of a list is nil, lists have no gaps", gap);
    const bool is_sparse = largest / 2 > value->item_count;
    value->item_count = is_sparse ? gap - 1 : (int)largest; /* gaps become VALUE_NOTHING */
}

/* A text of the model; after a complaint with _ for what may not be in it, so that it leads to no other. */
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
        convert(L, -1, place, depth, &value->items[i]);
        lua_pop(L, 1);
    }
}

/* A name as the table has it: the table keeps its text. */
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

/* Lua's order is random; `count` names, in scratch. */
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
        struct named_value *field = &value->fields[at];
        struct place place = value->place;
        const int errors = script->messages->errors;
        lua_pushlstring(L, names[i].text, names[i].length);
        field->name = take_text(L, -1, value->place, "name");
        at += script->messages->errors == errors; /* a name that was refused is not told of again */
        lua_rawget(L, index);
        int line = source_lines_of_entry(&script->lines, table, field->name, 0);
        place.line = line > 0 ? line : place.line;
        convert(L, -1, place, depth, &field->value);
        lua_pop(L, 1);
    }
    value->field_count = at;
    memory_back(script->memory, mark);
}

static void convert_table(lua_State *L, int index, int depth, struct value *value) {
    struct script *script = script_of(L);
    int table = table_number(L, index);
    if (depth > DEPTH_BOUND)
        stop_at(L, value->place, "tables nested deeper than", DEPTH_BOUND);
    luaL_checkstack(L, 8, "tables nested too deeply");
    value->kind = VALUE_TABLE;
    if (table >= 0)
        value->place = (struct place){script->lines.tables[table].file, script->lines.tables[table].line};
    get_note(L, script->tags, index);
    if (lua_type(L, -1) == LUA_TSTRING)
        value->tag = memory_text(script->memory, lua_tostring(L, -1));
    lua_pop(L, 1);
    count_entries(L, index, value);
    if (value->item_count + value->field_count > ENTRY_BOUND && !script->has_samples)
        stop_at(L, value->place, "more entries in a table than", ENTRY_BOUND);
    convert_items(L, index, table, depth + 1, value);
    convert_fields(L, index, table, depth + 1, value);
}

/* The value at `index`, `place`: where it stands if it does not know better. (-0, +0) */
static void convert(lua_State *L, int index, struct place place, int depth, struct value *value) {
    struct script *script = script_of(L);
    index = lua_absindex(L, index);
    *value = (struct value){.place = place};
    if (++script->value_count > VALUE_BOUND)
        stop_at(L, place, "more values in the model than", VALUE_BOUND);
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
        if (get_expression(L, index, &value->expression))
            value->kind = VALUE_EXPRESSION;
        else if (luaL_testudata(L, index, VIEW))
            value->kind = VALUE_GROUP;
    }
}

/* ---- the module "refdyn" ---- */

/* A curve of an expression, or of a number. */
static int call_curve(lua_State *L) {
    struct graph *graph = script_of(L)->graph;
    expression at = expr_zero(graph);
    if (lua_gettop(L) != 1)
        return luaL_error(L, "a curve of %d values, one number or expression is needed", lua_gettop(L));
    if (!get_expression(L, 1, &at))
        return luaL_error(L, "a curve of %s, one number or expression is needed", luaL_typename(L, 1));
    push_expression(L, expr_spline(graph, (int)lua_tointeger(L, lua_upvalueindex(1)), at));
    return 1;
}

/* Pushes what a function of the module gives. (-0, +1) */
static void push_value(lua_State *L, const struct value *value) {
    if (value->kind == VALUE_EXPRESSION)
        push_expression(L, value->expression);
    else if (value->kind == VALUE_CURVE) {
        lua_pushinteger(L, value->curve);
        lua_pushcclosure(L, call_curve, 1);
    } else if (value->kind == VALUE_GROUP)
        push_view(L, (struct view){.kind = VIEW_PARAMETERS});
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
        push_value(L, &value->fields[i].value);
        lua_setfield(L, -2, value->fields[i].name);
    }
}

/* Gives the table itself, with a tag. */
static int tag_argument(lua_State *L, const char *tag) {
    if (lua_type(L, 1) != LUA_TTABLE)
        return luaL_error(L, "rd.%s: argument 1 is %s, a table is needed", tag, luaL_typename(L, 1));
    if (lua_gettop(L) > 1)
        return luaL_error(L, "rd.%s: number of arguments is %d, 1 is needed", tag, lua_gettop(L));
    get_note(L, script_of(L)->tags, 1);
    if (!lua_isnil(L, -1))
        return luaL_error(L, "rd.%s: argument 1 is made by rd.%s, a table of its own is needed", tag,
                          lua_tostring(L, -1));
    lua_pushstring(L, tag);
    set_note(L, script_of(L)->tags, 1);
    lua_settop(L, 1);
    return 1;
}

/* rd.model, rd.position ... */
static int tag_table(lua_State *L) {
    return tag_argument(L, lua_tostring(L, lua_upvalueindex(1)));
}

/* Upvalues: number of the function, and whether a function of that name makes tables, too (rd.tube: a section
 * or a body). */
static int call_module(lua_State *L) {
    const int function = (int)lua_tointeger(L, lua_upvalueindex(1));
    if (lua_istable(L, 1) && lua_toboolean(L, lua_upvalueindex(2)))
        return tag_argument(L, module_function_name(script_of(L)->memory, function));
    enum { MOST_ARGUMENTS = 8 };
    struct value arguments[MOST_ARGUMENTS];
    struct module_call call = {.declarations = &script_of(L)->declarations,
                               .place = current_place(L),
                               .function = function,
                               .arguments = arguments,
                               .argument_count = lua_gettop(L)};
    struct script *script = script_of(L);
    script->has_samples = module_takes_samples(call.function);
    for (int i = 0; i < call.argument_count && i < MOST_ARGUMENTS; i++)
        convert(L, i + 1, call.place, 0, &arguments[i]);
    script->has_samples = false;
    const int names = name_count(script);
    module_run(&call);
    work_add(&script->work, (1.0 + name_count(script) - names) * names_in(script));
    work_add(&script->work, module_evaluates(call.function) ? script->graph->count / 8.0 : 0);
    stop_at_bound(L);
    if (call.fault)
        return luaL_error(L, "%s", call.fault);
    push_value(L, &call.result);
    return 1;
}

static int refuse_field(lua_State *L) {
    const char *name = lua_type(L, 2) == LUA_TSTRING ? name_at(L, 2) : "?";
    return luaL_error(L, "%s", module_unknown(script_of(L)->memory, name));
}

/* Gives the table below it the function on top for fields that it lacks; nobody else can change that. (-1,
 * +0) */
static void guard_table(lua_State *L, const char *name) {
    lua_createtable(L, 0, 2);
    lua_insert(L, -2);
    lua_setfield(L, -2, "__index");
    lua_pushstring(L, name);
    lua_setfield(L, -2, "__metatable");
    lua_setmetatable(L, -2);
}

/* A field that nobody reads, such as rd.gravity, would be passed over. */
static int refuse_new_field(lua_State *L) {
    const char *name = lua_type(L, 2) == LUA_TSTRING ? name_at(L, 2) : "?";
    return luaL_error(L, "rd.%s: assignment, what rd has is read only, a local has values of your own", name);
}

/* Builds the module. (-0, +1) */
static void push_module(lua_State *L) {
    const char *tags[OWNER_COUNT + 3];
    struct memory *memory = script_of(L)->memory;
    lua_newtable(L);
    for (int i = fields_list_tags(tags) - 1; i >= 0; i--) {
        lua_pushstring(L, tags[i]);
        lua_pushcclosure(L, tag_table, 1);
        lua_setfield(L, -2, tags[i]);
    }
    for (int i = 0; i < module_function_count(); i++) {
        const char *name = module_function_name(memory, i);
        lua_pushinteger(L, i);
        lua_pushboolean(L, lua_getfield(L, -2, name) != LUA_TNIL);
        lua_remove(L, -2);
        lua_pushcclosure(L, call_module, 2);
        lua_setfield(L, -2, name);
    }
    lua_pushnumber(L, 3.14159265358979323846);
    lua_setfield(L, -2, "pi");
    lua_pushcfunction(L, refuse_field);
    guard_table(L, "rd");
    lua_getmetatable(L, -1);
    lua_pushcfunction(L, refuse_new_field);
    lua_setfield(L, -2, "__newindex");
    lua_pop(L, 1);
}

/* ---- work ---- */

/* Each call counts by its arguments, each return by its results. Any step of a function with `...` may copy
 * those. */
static void count_call(lua_State *L, lua_Debug *event) {
    lua_getinfo(L, "r", event);
    work_add_call(&script_of(L)->work, event->ntransfer);
    if (event->event == LUA_HOOKRET || !lua_getlocal(L, event, -ARGUMENTS_BOUND - 1))
        return;
    lua_pop(L, 1);
    lua_pushfstring(L, "a function is called with more than %d arguments for `...`, a table can hold them",
                    ARGUMENTS_BOUND);
    lua_error(L);
}

static void watch(lua_State *L, lua_Debug *event) {
    if (event->event != LUA_HOOKCOUNT) {
        count_call(L, event);
        return;
    }
    work_add_steps(&script_of(L)->work, STEPS_BETWEEN_CHECKS);
    stop_at_bound(L);
}

/* ---- library functions that a model may call, and what they do beyond a call ---- */

/* Also a text such as "1", which the library takes for a number. */
static bool is_number_at(lua_State *L, int index) {
    return lua_isnumber(L, index);
}

/* Number of entries from argument `first` to argument `last`, of all when these are left out. */
static double range_steps(lua_State *L, int first, int last) {
    const double from = is_number_at(L, first) ? lua_tonumber(L, first) : 1;
    const double to = is_number_at(L, last) ? lua_tonumber(L, last) : (double)lua_rawlen(L, 1);
    return to >= from ? to - from + 1 : 0;
}

static double concat_steps(lua_State *L) {
    return 4 * range_steps(L, 3, 4);
}

static double unpack_steps(lua_State *L) {
    return range_steps(L, 2, 3);
}

static double move_steps(lua_State *L) {
    return is_number_at(L, 2) && is_number_at(L, 3) ? range_steps(L, 2, 3) : 0;
}

/* Entries behind the one that is put in or taken out. */
static double shift_steps(lua_State *L) {
    const double length = (double)lua_rawlen(L, 1);
    return is_number_at(L, 2) && lua_tonumber(L, 2) < length ? length - lua_tonumber(L, 2) + 1 : 0;
}

static double pattern_work(lua_State *L) {
    size_t length;
    if (!lua_isstring(L, 1) || !lua_isstring(L, 2))
        return 0;
    const char *pattern = lua_tolstring(L, 2, &length);
    return work_pattern_steps(lua_rawlen(L, 1), pattern, length);
}

/* Each place may be replaced: by a text that is read, by an entry of a table, by what a function gives. */
static double replace_work(lua_State *L) {
    const double replacement = lua_type(L, 3) == LUA_TSTRING ? (double)lua_rawlen(L, 3) / 10 : 0;
    return pattern_work(L) + ((double)lua_rawlen(L, 1) + 1) * (8 + replacement);
}

static double find_work(lua_State *L) {
    const bool is_plain = lua_toboolean(L, 4) && lua_isstring(L, 1) && lua_isstring(L, 2);
    return is_plain ? work_search_steps(lua_rawlen(L, 1), lua_rawlen(L, 2)) : pattern_work(L);
}

static double repeat_work(lua_State *L) {
    const double bytes = (double)lua_rawlen(L, 1) + (double)lua_rawlen(L, 3);
    return lua_tonumber(L, 2) * (1 + bytes / 32);
}

/* Of a format, and for each argument a number of 400 digits, or a text whose bytes %q writes as numbers. */
static double format_work(lua_State *L) {
    double steps = 256.0 * lua_gettop(L);
    for (int i = 1; i <= lua_gettop(L); i++)
        steps += lua_type(L, i) == LUA_TSTRING ? 4 * (double)lua_rawlen(L, i) : 0;
    return steps;
}

static double text_work(lua_State *L) {
    return (double)lua_rawlen(L, 1);
}

static double remainder_work(lua_State *L) {
    (void)L;
    return 64;
}

static bool has_no_text(lua_State *L, int index) {
    const int type = lua_type(L, index);
    const bool is_plain =
        type == LUA_TNIL || type == LUA_TBOOLEAN || type == LUA_TNUMBER || type == LUA_TSTRING;
    if (is_plain || luaL_getmetafield(L, index, "__tostring") == LUA_TNIL)
        return !is_plain;
    lua_pop(L, 1);
    return false;
}

/* tostring: the address of a table or function differs from run to run, so that its type has to do. */
static int to_text(lua_State *L) {
    luaL_checkany(L, 1);
    if (has_no_text(L, 1))
        lua_pushstring(L, luaL_typename(L, 1));
    else
        luaL_tolstring(L, 1, NULL);
    return 1;
}

static bool shows_address(const char *format) {
    while ((format = strchr(format, '%'))) {
        format += 1 + strspn(format + 1, "-+ #0123456789.");
        if (*format == 'p')
            return true;
        format += *format == '%';
    }
    return false;
}

/* string.format, which shows no addresses either. */
static void check_format(lua_State *L) {
    for (int i = 2; i <= lua_gettop(L); i++)
        if (has_no_text(L, i))
            luaL_error(L, "string.format: argument %d is of type %s, texts, numbers and booleans are shown",
                       i, luaL_typename(L, i));
    if (lua_type(L, 1) == LUA_TSTRING && shows_address(lua_tostring(L, 1)))
        luaL_error(L, "string.format: %%p shows an address, which differs from run to run");
}

static void check_length(lua_State *L, const char *name) {
    if (lua_type(L, 1) == LUA_TTABLE && luaL_getmetafield(L, 1, "__len") != LUA_TNIL)
        luaL_error(L, "table.%s: the table has __len, one without is needed", name);
}

/* Is the entry at `left` less than that at `right`? By the function at index 2, if any. (-0, +0) */
static bool is_less(lua_State *L, int left, int right) {
    work_add_call(&script_of(L)->work, 2);
    stop_at_bound(L);
    if (lua_isnil(L, 2))
        return lua_compare(L, left, right, LUA_OPLT);
    lua_pushvalue(L, 2);
    lua_pushvalue(L, left);
    lua_pushvalue(L, right);
    lua_call(L, 2, 1);
    const bool result = lua_toboolean(L, -1);
    lua_pop(L, 1);
    return result;
}

/* Merges entries first ... middle and middle + 1 ... last of table 1 into table 3. */
static void merge(lua_State *L, lua_Integer first, lua_Integer middle, lua_Integer last) {
    lua_Integer left = first, right = middle + 1;
    for (lua_Integer to = first; to <= last; to++) {
        lua_rawgeti(L, 1, left);
        lua_rawgeti(L, 1, right);
        const int top = lua_gettop(L);
        const bool takes_left = right > last || (left <= middle && !is_less(L, top, top - 1));
        lua_settop(L, takes_left ? top - 1 : top);
        lua_rawseti(L, 3, to);
        lua_settop(L, top - 2);
        left += takes_left;
        right += !takes_left;
    }
}

/* table.sort by merging: equal entries keep their order, and a contradictory order does no harm. */
static int sort_table(lua_State *L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    if (!lua_isnoneornil(L, 2))
        luaL_checktype(L, 2, LUA_TFUNCTION);
    lua_settop(L, 2);
    check_length(L, "sort");
    const lua_Integer count = (lua_Integer)lua_rawlen(L, 1);
    lua_createtable(L, (int)count, 0);
    for (lua_Integer width = 1; width < count; width *= 2) {
        for (lua_Integer first = 1; first <= count; first += 2 * width) {
            const lua_Integer last = first + 2 * width - 1 < count ? first + 2 * width - 1 : count;
            merge(L, first, first + width - 1 < last ? first + width - 1 : last, last);
        }
        for (lua_Integer i = 1; i <= count; i++) {
            lua_rawgeti(L, 3, i);
            lua_rawseti(L, 1, i);
        }
    }
    return 0;
}

static int set_metatable(lua_State *L);

/* What a model may use: nothing else of these libraries is there. */
static const struct {
    const char *name, *entries;
} libraries[] = {
    {"_G", "assert error getmetatable ipairs pairs rawequal rawget rawlen rawset require select setmetatable "
           "tonumber tostring type _VERSION"},
    {"string",
     "byte char find format gmatch gsub len lower match pack packsize rep reverse sub unpack upper"},
    {"table", "concat insert move pack remove sort unpack"},
    {"math",
     "abs acos asin atan ceil cos cosh deg exp floor fmod frexp huge ldexp log log10 max maxinteger min "
     "mininteger modf pi pow rad sin sinh sqrt tan tanh tointeger type ult"},
};

enum { LIBRARY_COUNT = sizeof libraries / sizeof *libraries, ENTRIES_MOST = 64 };

/* Entries that do more than a call: `work` counts its steps, `instead` stands for Lua's own function. */
static const struct library_entry {
    const char *library, *name;
    double (*work)(lua_State *L);
    lua_CFunction instead;
} special_entries[] = {
    {"_G", "setmetatable", NULL, set_metatable}, {"_G", "tonumber", text_work, NULL},
    {"_G", "tostring", NULL, to_text},           {"string", "find", find_work, NULL},
    {"string", "format", format_work, NULL},     {"string", "gmatch", pattern_work, NULL},
    {"string", "gsub", replace_work, NULL},      {"string", "lower", text_work, NULL},
    {"string", "match", pattern_work, NULL},     {"string", "pack", text_work, NULL},
    {"string", "packsize", text_work, NULL},     {"string", "rep", repeat_work, NULL},
    {"string", "reverse", text_work, NULL},      {"string", "unpack", text_work, NULL},
    {"string", "upper", text_work, NULL},        {"table", "concat", concat_steps, NULL},
    {"table", "insert", shift_steps, NULL},      {"table", "move", move_steps, NULL},
    {"table", "remove", shift_steps, NULL},      {"table", "sort", NULL, sort_table},
    {"table", "unpack", unpack_steps, NULL},     {"math", "fmod", remainder_work, NULL},
};

static const char *full_name(lua_State *L, const struct library_entry *entry) {
    const bool is_global = strcmp(entry->library, LUA_GNAME) == 0;
    return is_global ? entry->name
                     : memory_format(script_of(L)->memory, "%s.%s", entry->library, entry->name);
}

static bool takes_numbers(const struct library_entry *entry) {
    return strcmp(entry->library, LUA_MATHLIBNAME) == 0 || strcmp(entry->name, "tonumber") == 0 ||
           strcmp(entry->name, "tostring") == 0;
}

/* A function of numbers, given an expression, would fail with a puzzle: names the function to use. */
static void check_expressions(lua_State *L, const struct library_entry *entry) {
    expression e;
    for (int i = 1; i <= lua_gettop(L); i++)
        if (lua_type(L, i) == LUA_TUSERDATA && get_expression(L, i, &e))
            luaL_error(L,
                       module_has(script_of(L)->memory, entry->name)
                           ? "%s of an expression: use rd.%s"
                           : "%s of an expression: its value is not known while the model is read",
                       full_name(L, entry), entry->name);
}

/* string.char and others may make texts with bytes 0. */
static void note_zeros(lua_State *L) {
    size_t length;
    const char *text = lua_type(L, -1) == LUA_TSTRING ? lua_tolstring(L, -1, &length) : NULL;
    if (text)
        work_note_zeros(&script_of(L)->work, text, length);
}

/* Upvalues: the entry of the table above, and the function. */
static int call_library(lua_State *L) {
    const struct library_entry *entry = lua_touserdata(L, lua_upvalueindex(1));
    struct work *work = &script_of(L)->work;
    if (takes_numbers(entry))
        check_expressions(L, entry);
    else if (strcmp(entry->library, LUA_TABLIBNAME) == 0)
        check_length(L, entry->name);
    else if (entry->work == format_work)
        check_format(L);
    work_add(work, entry->work ? entry->work(L) : 0);
    if (work_is_over(work))
        return luaL_error(L, "%s: more work than the %d million steps that a model may take while it is read",
                          full_name(L, entry), WORK_MILLIONS);
    const int count = lua_tocfunction(L, lua_upvalueindex(2))(L);
    if (count == 1 && strcmp(entry->library, LUA_STRLIBNAME) == 0)
        note_zeros(L);
    return count;
}

/* What an entry does beyond a call, if anything. */
static const struct library_entry *find_entry(struct memory *memory, const char *library, const char *name) {
    for (size_t i = 0; i < sizeof special_entries / sizeof *special_entries; i++)
        if (strcmp(special_entries[i].library, library) == 0 && strcmp(special_entries[i].name, name) == 0)
            return &special_entries[i];
    struct library_entry *plain = memory_get(memory, sizeof *plain);
    *plain = (struct library_entry){.library = library, .name = name};
    return plain;
}

/* Names of the entries of a library. */
static int list_library(struct memory *memory, const char *name, const char *known[ENTRIES_MOST]) {
    int count = 0;
    for (int i = 0; i < LIBRARY_COUNT; i++)
        for (const char *at = libraries[i].entries; strcmp(libraries[i].name, name) == 0 && *at;) {
            const size_t length = strcspn(at, " ");
            known[count++] = memory_format(memory, "%.*s", (int)length, at);
            at += length + strspn(at + length, " ");
        }
    return count;
}

/* Moves an entry of Lua's own library, at `from`, to the table that the model sees, at `to`. (-0, +0) */
static void move_entry(lua_State *L, int from, int to, const struct library_entry *entry) {
    if (lua_getfield(L, from, entry->name) != LUA_TNIL && lua_iscfunction(L, -1)) {
        if (entry->instead) {
            lua_pop(L, 1);
            lua_pushcfunction(L, entry->instead);
        }
        lua_pushlightuserdata(L, (void *)(uintptr_t)entry);
        lua_insert(L, -2);
        lua_pushcclosure(L, call_library, 2);
    }
    lua_setfield(L, to, entry->name);
}

/* ---- names that are not there ---- */

/* Upvalue: the library's name. */
static int refuse_library_field(lua_State *L) {
    struct memory *memory = script_of(L)->memory;
    const char *known[ENTRIES_MOST], *of = lua_tostring(L, lua_upvalueindex(1));
    const char *name = lua_type(L, 2) == LUA_TSTRING ? name_at(L, 2) : luaL_typename(L, 2);
    const char *nearest = message_nearest_name(name, known, list_library(memory, of, known));
    if (nearest)
        return luaL_error(L, "%s.%s: unknown function, the nearest known one is \"%s\"", of, name, nearest);
    return luaL_error(L, "%s.%s: unknown function, models/README.md names what a model can use", of, name);
}

/* Names of globals that the model has made itself, sorted, since Lua's order is random. */
static int list_own_globals(lua_State *L, const char **known, int room) {
    int count = 0;
    lua_pushnil(L);
    while (count < room && lua_next(L, 1)) {
        lua_pop(L, 1);
        if (lua_type(L, -1) == LUA_TSTRING)
            known[count++] = memory_text(script_of(L)->memory, lua_tostring(L, -1));
    }
    qsort(known, (size_t)count, sizeof *known, compare_texts);
    return count;
}

/* Of Lua, but not of a model: no other name is meant. */
static bool is_left_out(const char *name) {
    static const char *const left_out[] = {"collectgarbage", "coroutine", "debug", "dofile", "io",
                                           "load",           "loadfile",  "next",  "os",     "package",
                                           "pcall",          "print",     "utf8",  "warn",   "xpcall"};
    return text_index(name, left_out, sizeof left_out / sizeof *left_out) >= 0;
}

static const char *nearest_global(lua_State *L, const char *name) {
    enum { ROOM = 1000 };
    struct script *script = script_of(L);
    const char **known = memory_get(script->memory, 2 * ROOM * sizeof *known);
    int count = list_own_globals(L, known, ROOM);
    for (int i = 0; i < script->sources.count; i++)
        count += local_variables_list(script->memory, script->sources.list[i].text,
                                      script->sources.list[i].length, known + count, 2 * ROOM - count);
    return message_nearest_name(name, known, count);
}

/* Reading a global that nothing has set: a slip of the pen would be nil, and vanish in a formula or list. */
static int refuse_global(lua_State *L) {
    if (lua_type(L, 2) != LUA_TSTRING)
        return luaL_error(L, "undefined global of type %s, names are", luaL_typename(L, 2));
    const char *name = name_at(L, 2);
    if (is_left_out(name))
        return luaL_error(
            L,
            "undefined global \"%s\": a model has no such function or library, models/README.md names "
            "what it has",
            name);
    const char *nearest = nearest_global(L, name);
    if (nearest)
        return luaL_error(L, "undefined global \"%s\", the nearest known one is \"%s\"", name, nearest);
    return luaL_error(L, "undefined global \"%s\", a name that is set before is needed", name);
}

/* ---- metatables of authors ---- */

/* What Lua calls for a table. Others are refused: what they name would run or act when nothing counts it. */
static const struct {
    const char *name;
    enum event_kind {
        EVENT_FUNCTION,
        EVENT_FIELDS,
        EVENT_REFUSED
    } kind; /* EVENT_FIELDS: or a table to look in */
} events[] = {
    {"__index", EVENT_FIELDS},  {"__newindex", EVENT_FIELDS},   {"__call", EVENT_FUNCTION},
    {"__add", EVENT_FUNCTION},  {"__sub", EVENT_FUNCTION},      {"__mul", EVENT_FUNCTION},
    {"__div", EVENT_FUNCTION},  {"__mod", EVENT_FUNCTION},      {"__pow", EVENT_FUNCTION},
    {"__unm", EVENT_FUNCTION},  {"__idiv", EVENT_FUNCTION},     {"__band", EVENT_FUNCTION},
    {"__bor", EVENT_FUNCTION},  {"__bxor", EVENT_FUNCTION},     {"__bnot", EVENT_FUNCTION},
    {"__shl", EVENT_FUNCTION},  {"__shr", EVENT_FUNCTION},      {"__concat", EVENT_FUNCTION},
    {"__len", EVENT_FUNCTION},  {"__eq", EVENT_FUNCTION},       {"__lt", EVENT_FUNCTION},
    {"__le", EVENT_FUNCTION},   {"__tostring", EVENT_FUNCTION}, {"__gc", EVENT_REFUSED},
    {"__close", EVENT_REFUSED}, {"__mode", EVENT_REFUSED},      {"__metatable", EVENT_REFUSED},
    {"__pairs", EVENT_REFUSED}, {"__name", EVENT_REFUSED},
};

enum { EVENT_COUNT = sizeof events / sizeof *events };

/* A chain of tables that look in each other is a chain of calls, which are counted and cannot be endless. */
static int index_base(lua_State *L) {
    lua_settop(L, 2);
    lua_gettable(L, lua_upvalueindex(1));
    return 1;
}

static int newindex_base(lua_State *L) {
    lua_settop(L, 3);
    lua_settable(L, lua_upvalueindex(1));
    return 0;
}

static void check_event(lua_State *L, int event) {
    const char *name = events[event].name;
    const int type = lua_type(L, -1);
    if (type == LUA_TNIL || type == LUA_TFUNCTION ? events[event].kind != EVENT_REFUSED || type == LUA_TNIL
                                                  : events[event].kind == EVENT_FIELDS)
        return;
    if (events[event].kind == EVENT_REFUSED)
        luaL_error(L, "setmetatable: %s is not allowed in a model", name);
    luaL_error(L, "setmetatable: %s is of type %s, a function is needed", name, lua_typename(L, type));
}

/* Takes the event from the author's metatable at index 2 to the copy at index 3, whose items are what was
 * taken. */
static void take_event(lua_State *L, int event) {
    lua_pushstring(L, events[event].name);
    lua_rawget(L, 2);
    lua_rawgeti(L, 3, event + 1);
    const bool is_taken = lua_rawequal(L, -1, -2);
    lua_pop(L, 1);
    if (!is_taken) {
        check_event(L, event);
        lua_pushvalue(L, -1);
        lua_rawseti(L, 3, event + 1);
        if (!lua_isnil(L, -1) && !lua_isfunction(L, -1))
            lua_pushcclosure(L, event == 0 ? index_base : newindex_base, 1);
        lua_pushstring(L, events[event].name);
        lua_insert(L, -2);
        lua_rawset(L, 3);
        return;
    }
    lua_pop(L, 1);
}

/* The copy for the metatable at index 2, made when there is none. (-0, +1) */
static void push_copy(lua_State *L) {
    struct script *script = script_of(L);
    get_note(L, script->events, 2);
    if (!lua_isnil(L, -1))
        return;
    lua_pop(L, 1);
    lua_createtable(L, EVENT_COUNT, 4);
    lua_pushvalue(L, 2);
    lua_setfield(L, -2, "__metatable"); /* what getmetatable gives */
    lua_rawgeti(L, LUA_REGISTRYINDEX, script->events);
    lua_pushvalue(L, 2);
    lua_rawseti(L, -2, (lua_Integer)lua_rawlen(L, -2) + 1);
    lua_pop(L, 1);
    lua_pushvalue(L, -1);
    set_note(L, script->events, 2);
}

/* setmetatable: Lua uses a copy, which the author cannot change unseen. */
static int set_metatable(lua_State *L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    luaL_argexpected(L, lua_isnil(L, 2) || lua_istable(L, 2), 2, "nil or table");
    lua_settop(L, 2);
    if (luaL_getmetafield(L, 1, "__metatable") == LUA_TSTRING)
        return luaL_error(L, "setmetatable: the metatable of %s cannot be changed", lua_tostring(L, -1));
    lua_settop(L, 2);
    if (!lua_isnil(L, 2)) {
        work_add(&script_of(L)->work, 2 * EVENT_COUNT);
        push_copy(L);
        for (int i = 0; i < EVENT_COUNT; i++)
            take_event(L, i);
    }
    lua_setmetatable(L, 1);
    lua_settop(L, 1);
    return 1;
}

/* Complains about events that were changed behind setmetatable, since tables do not have them. (-0, +0) */
static void check_events(lua_State *L) {
    lua_settop(L, lua_gettop(L));
    lua_rawgeti(L, LUA_REGISTRYINDEX, script_of(L)->events);
    const int notes = lua_gettop(L);
    for (lua_Integer i = 1; lua_rawgeti(L, notes, i) != LUA_TNIL; i++) {
        lua_pushvalue(L, -1);
        lua_rawget(L, notes);
        for (int event = 0; event < EVENT_COUNT; event++) {
            lua_pushstring(L, events[event].name);
            lua_rawget(L, notes + 1);
            lua_rawgeti(L, notes + 2, event + 1);
            if (!lua_rawequal(L, -1, -2))
                luaL_error(L, "setmetatable: %s was changed behind it, it has to be in the metatable before",
                           events[event].name);
            lua_pop(L, 2);
        }
        lua_settop(L, notes);
    }
    lua_settop(L, notes - 1);
}

/* ---- the sandbox ---- */

static int compile_beside(lua_State *L);

/* Lua's own libraries in tables that the model never sees, and our functions in Lua beside them. */
static void open_originals(lua_State *L) {
    luaL_requiref(L, LUA_GNAME, luaopen_base, 1);
    luaL_requiref(L, LUA_STRLIBNAME, luaopen_string, 1);
    luaL_requiref(L, LUA_TABLIBNAME, luaopen_table, 1);
    luaL_requiref(L, LUA_MATHLIBNAME, luaopen_math, 1);
    lua_pop(L, 4);
    if (luaL_loadbufferx(L, sandbox_source, sizeof sandbox_source - 1, "=sandbox", "t") != LUA_OK)
        lua_error(L);
    push_module(L);
    lua_pushcfunction(L, compile_beside);
    lua_pushcfunction(L, mark_table);
    lua_pushcfunction(L, sort_table);
    lua_call(L, 4, 0);
}

/* A table with what a model may use of one library. (-0, +1) */
static void push_library(lua_State *L, const char *name) {
    struct memory *memory = script_of(L)->memory;
    const char *entries[ENTRIES_MOST];
    lua_getglobal(L, name);
    lua_newtable(L);
    for (int i = list_library(memory, name, entries) - 1; i >= 0; i--)
        move_entry(L, lua_gettop(L) - 1, lua_gettop(L), find_entry(memory, name, entries[i]));
    lua_pushstring(L, name);
    lua_pushcclosure(L, refuse_library_field, 1);
    guard_table(L, name);
    lua_remove(L, -2);
}

static void open_sandbox(lua_State *L) {
    static const char *const names[] = {LUA_STRLIBNAME, LUA_TABLIBNAME, LUA_MATHLIBNAME};
    open_originals(L);
    push_library(L, LUA_GNAME);
    lua_pushvalue(L, -1);
    lua_setfield(L, -2, LUA_GNAME);
    for (int i = 0; i < 3; i++) {
        push_library(L, names[i]);
        lua_setfield(L, -2, names[i]);
    }
    lua_pushcfunction(L, refuse_global);
    guard_table(L, "the globals");
    lua_pushliteral(L, "");
    lua_getmetatable(L, -1);
    lua_getfield(L, -3, LUA_STRLIBNAME);
    lua_setfield(L, -2, "__index");
    lua_pushliteral(L, "texts");
    lua_setfield(L, -2, "__metatable");
    lua_pop(L, 2);
    lua_rawseti(L, LUA_REGISTRYINDEX, LUA_RIDX_GLOBALS);
}

/* The metatable of our values: closures over a number, for refusals and for arithmetic. (-0, +1) */
static void new_metatable(lua_State *L, const char *name) {
    luaL_newmetatable(L, name);
    lua_pushstring(L, name);
    lua_setfield(L, -2, "__metatable");
}

static void make_expressions(lua_State *L) {
    static const struct {
        const char *event;
        enum operation operation;
    } operators[] = {{"__add", OP_ADD}, {"__sub", OP_SUB}, {"__mul", OP_MUL},
                     {"__div", OP_DIV}, {"__unm", OP_NEG}, {"__pow", OP_POW}};
    new_metatable(L, EXPRESSION);
    for (size_t i = 0; i < sizeof refused_events / sizeof *refused_events; i++) {
        lua_pushinteger(L, (lua_Integer)i);
        lua_pushcclosure(L, refuse_event, 1);
        lua_setfield(L, -2, refused_events[i].event);
    }
    for (size_t i = 0; i < sizeof operators / sizeof *operators; i++) {
        lua_pushinteger(L, (lua_Integer)operators[i].operation);
        lua_pushcclosure(L, arithmetic, 1);
        lua_setfield(L, -2, operators[i].event);
    }
    lua_pop(L, 1);
}

/* Nothing but their fields is of use. */
static void make_views(lua_State *L) {
    new_metatable(L, VIEW);
    for (int i = 0; i < EVENT_COUNT; i++) {
        if (events[i].kind == EVENT_REFUSED || strcmp(events[i].name, "__tostring") == 0)
            continue;
        lua_pushcfunction(L, i == 0 ? index_view : i == 1 ? refuse_assignment : refuse_group);
        lua_setfield(L, -2, events[i].name);
    }
    lua_pop(L, 1);
}

/* A table whose keys do not keep tables alive. */
static int weak_table(lua_State *L) {
    lua_newtable(L);
    lua_createtable(L, 0, 1);
    lua_pushliteral(L, "k");
    lua_setfield(L, -2, "__mode");
    lua_setmetatable(L, -2);
    return luaL_ref(L, LUA_REGISTRYINDEX);
}

/* ---- protected calls ---- */

/* Lua tells what a new piece is for in place of its old size. */
static void *allocate(void *context, void *data, size_t old, size_t size) {
    struct script *script = context;
    work_add_memory(&script->work, size);
    if (!data && old == LUA_TSTRING) {
        work_add_text(&script->work, size);
        script->is_text_too_long = size > (size_t)TEXT_MEGABYTES << 20;
        if (script->is_text_too_long)
            return NULL;
    }
    void *piece = pool_resize(&script->pool, data, data ? old : 0, size);
    if (!piece && size > 0) /* Lua now looks for unused memory in all of it */
        work_add_memory(&script->work, script->memory->taken);
    return piece;
}

/* memory.fail while Lua runs. */
static void fail_in_lua(void *context) {
    struct script *script = context;
    script->is_short_of_memory = true;
    lua_pushnil(script->L);
    lua_error(script->L);
}

/* What Lua's own message leaves open. */
static const char *hint_for(const char *text) {
    if (strncmp(text, "bad 'for' ", 10) == 0 && strstr(text, "got " EXPRESSION))
        return ": its value is not known while the model is read, that of an option (rd.option) is";
    if (strncmp(text, "C stack overflow", 16) == 0)
        return ": calls, parentheses, tables or blocks are nested too deep";
    return "";
}

/*
 * Where an error arose: the place that its text begins with, else the innermost line of the model's files.
 * Texts of our own Lua lose the place there.
 */
static void report(struct script *script, const char *text, size_t length) {
    struct place place = script->error_place;
    const char *rest = text;
    if (!source_file_place(&script->sources, text, &place, &rest) && strncmp(text, "sandbox:", 8) == 0) {
        rest = strchr(text + 8, ':');
        rest = rest ? rest + 2 : text;
    }
    const char *safe = message_safe_text(script->memory, rest, length - (size_t)(rest - text));
    message_error(script->messages, place, "%s%s", safe, hint_for(safe));
}

/* Lua calls it with an error before it leaves the functions that were running. */
static int note_place(lua_State *L) {
    struct script *script = script_of(L);
    lua_Debug frame;
    const char *rest;
    script->error_place = (struct place){.file = script->file};
    for (int level = 0; lua_getstack(L, level, &frame); level++) {
        lua_getinfo(L, "Sl", &frame);
        if (!source_file_place(&script->sources,
                               memory_format(script->memory, "%s:%d", frame.short_src, frame.currentline),
                               &script->error_place, &rest))
            continue;
        break;
    }
    return 1;
}

/* An error that is no text, or memory. */
static void report_error(struct script *script, int status) {
    lua_State *L = script->L;
    size_t length;
    const char *text = lua_tolstring(L, -1, &length); /* also of a number */
    if (script->is_text_too_long)
        message_error(script->messages, (struct place){.file = script->file},
                      "a text of more than %d MB, shorter ones are needed", TEXT_MEGABYTES);
    else if (script->is_short_of_memory || status == LUA_ERRMEM)
        script->memory->fail(script->memory->context);
    else if (text)
        report(script, text, length);
    else if (!script->is_told)
        message_error(script->messages, script->error_place,
                      "error(...) with a value of type %s, a text is needed", luaL_typename(L, -1));
    script->is_told = false;
}

struct job {
    struct script *script;
    const struct value *function;
    const char *name; /* of the function */
    struct value *result;
};

static bool run_protected(struct job *job, lua_CFunction function) {
    struct script *script = job->script;
    struct memory *memory = script->memory;
    void (*fail)(void *) = memory->fail;
    void *context = memory->context;
    memory->fail = fail_in_lua;
    memory->context = script;
    lua_pushcfunction(script->L, note_place);
    lua_pushcfunction(script->L, function);
    lua_pushlightuserdata(script->L, job);
    const int status = lua_pcall(script->L, 1, 0, 1);
    memory->fail = fail;
    memory->context = context;
    if (status != LUA_OK)
        report_error(script, status);
    lua_settop(script->L, 0);
    return status == LUA_OK;
}

static struct job *job_of(lua_State *L) {
    struct job *job = lua_touserdata(L, 1);
    lua_settop(L, 0);
    return job;
}

/* Pushes the compiled source; the source as written goes first, so that syntax errors show it. (-0, +1) */
static void load_source(lua_State *L, int number) {
    struct script *script = script_of(L);
    const struct source_file *source = &script->sources.list[number];
    char chunk[32];
    work_add_source(&script->work, source->text, source->length);
    stop_at_bound(L);
    snprintf(chunk, sizeof chunk, "=" SOURCE_CHUNK "%d", number);
    if (luaL_loadbufferx(L, source->text, source->length, chunk, "t") != LUA_OK)
        lua_error(L);
    lua_pop(L, 1);
    lint_source(script->memory, script->messages, source->path, source->text, source->length);
    source_lines_mark_tables(script->memory, script->messages, source->path, source->text, source->length,
                             &script->lines);
    if (luaL_loadbufferx(L, script->lines.text, script->lines.length, chunk, "t") != LUA_OK)
        lua_error(L);
}

/* The function of the file NAME.lua beside the model. */
static int compile_beside(lua_State *L) {
    struct script *script = script_of(L);
    const char *name = luaL_checkstring(L, 1);
    const char *fault = source_file_add(script->memory, &script->sources,
                                        source_file_path(script->memory, script->file, name));
    if (fault) {
        lua_settop(L, 0);
        return luaL_error(L, "require: %s.lua beside the model cannot be read: %s", name, fault);
    }
    load_source(L, script->sources.count - 1);
    return 1;
}

/* The one value on the stack, nil when there is none. */
static void convert_result(lua_State *L, struct place place, const char *what, struct value *result) {
    const int count = lua_gettop(L);
    if (count > 1)
        message_error(script_of(L)->messages, place, "%s %d values, one is needed", what, count);
    lua_settop(L, 1);
    convert(L, 1, place, 0, result);
}

static int run_file(lua_State *L) {
    struct job *job = job_of(L);
    struct script *script = job->script;
    make_expressions(L);
    make_views(L);
    open_sandbox(L);
    script->marks = weak_table(L);
    script->tags = weak_table(L);
    lua_newtable(L);
    script->events = luaL_ref(L, LUA_REGISTRYINDEX);
    load_source(L, 0);
    lua_sethook(L, watch, LUA_MASKCOUNT | LUA_MASKCALL | LUA_MASKRET, STEPS_BETWEEN_CHECKS);
    lua_pushcfunction(L, mark_table);
    lua_call(L, 1, LUA_MULTRET);
    check_events(L);
    convert_result(L, (struct place){.file = script->file}, "the file returns", &script->result);
    return 0;
}

static int run_function(lua_State *L) {
    struct job *job = job_of(L);
    lua_rawgeti(L, LUA_REGISTRYINDEX, job->function->function);
    push_view(L, (struct view){.kind = VIEW_STATE});
    lua_call(L, 1, LUA_MULTRET);
    check_events(L);
    const char *what = memory_format(job->script->memory, "%s: the function gives", job->name);
    convert_result(L, job->function->place, what, job->result);
    return 0;
}

/* ---- what the rest of the reader calls ---- */

static bool read_main(struct script *script) {
    const char *fault = source_file_add(script->memory, &script->sources, script->file);
    if (fault)
        message_error(script->messages, (struct place){.file = script->file}, "cannot be read: %s", fault);
    return !fault;
}

/* Values of --set are texts of the model, too. */
static bool check_settings(const struct read_request *request, struct messages *messages) {
    bool are_lines = true;
    for (int i = 0; i < request->setting_count; i++) {
        const struct setting *setting = &request->settings[i];
        const char *shown = message_safe_text(messages->memory, setting->value, strlen(setting->value));
        const char *what = memory_format(messages->memory, "--set %s \"%s\"", setting->name, shown);
        are_lines &= message_is_one_line(messages, (struct place){.file = request->file}, what,
                                         setting->value, strlen(setting->value));
    }
    return are_lines;
}

struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages) {
    struct script *script = memory_get(memory, sizeof *script);
    *script = (struct script){.memory = memory, .graph = graph, .messages = messages, .file = request->file};
    script->pool = (struct pool){.memory = memory};
    declarations_start(&script->declarations, memory, graph, request, messages);
    script->names.declarations = &script->declarations;
    if (!check_settings(request, messages) || !read_main(script))
        return NULL;
    script->L = lua_newstate(allocate, script);
    if (!script->L)
        memory->fail(memory->context);
    *(struct script **)lua_getextraspace(script->L) = script;
    struct job job = {.script = script};
    return run_protected(&job, run_file) ? script : NULL;
}

const struct value *script_result(const struct script *script) {
    return &script->result;
}

const struct sources *script_sources(const struct script *script) {
    return &script->sources;
}

struct declarations *script_declarations(struct script *script) {
    return &script->declarations;
}

struct messages *script_messages(struct script *script) {
    return script->messages;
}

void script_set_names(struct script *script, struct model *model, const char *const *coordinates,
                      int coordinate_count) {
    script->names.model = model;
    script->names.coordinates = coordinates;
    script->names.coordinate_count = coordinate_count;
}

bool script_call(struct script *script, const struct value *function, const char *name,
                 struct value *result) {
    struct job job = {.script = script, .function = function, .name = name, .result = result};
    return run_protected(&job, run_function);
}
