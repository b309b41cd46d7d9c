/*
 * The only file that knows Lua: runs a model file in a sandbox and turns what it returns into values.
 *
 * Every entry of Lua is one protected call. Inside it a shortage of memory is a Lua error, outside it becomes
 * memory.fail again. Stack effects stand beside the functions as (-popped, +pushed).
 */
#include "script.h"
#include "doubts.h"
#include "fields.h"
#include "module.h"
#include "pool.h"
#include "sandbox.h"
#include "source_file.h"
#include "source_lines.h"
#include "view.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lua.h>
#include <lauxlib.h>
#include <lualib.h>

#define EXPRESSION "expression"
#define VIEW "view"

/* What one model may take while it is read: far beyond any sensible model, soon enough for an endless loop.
 */
static const size_t memory_bound = (size_t)256 << 20;
enum {
    STEPS_BETWEEN_CHECKS = 1000000,
    CHECKS_BOUND = 100,
    VALUE_BOUND = 1000000,
    DEPTH_BOUND = 32,
    SOURCES_BOUND = 100
};

struct script {
    lua_State *L;
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const char *file;
    struct pool pool;
    struct declarations declarations;
    struct view_names names;
    struct source_lines lines;
    struct sources sources;
    int marks, tags; /* references of tables that give a table's number in `lines` and its tag */
    int value_count, checks;
    bool is_short_of_memory, is_told; /* is_told: the reason of an error is in messages */
    struct value result;
};

static struct script *script_of(lua_State *L) {
    return *(struct script **)lua_getextraspace(L);
}

/* Where the Lua function that called us stands. */
static struct place current_place(lua_State *L) {
    luaL_where(L, 1);
    const char *rest, *text = lua_tostring(L, -1);
    struct place place = source_place(&script_of(L)->sources, text, &rest);
    lua_pop(L, 1);
    return place;
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
    expression *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = e;
    luaL_setmetatable(L, EXPRESSION);
}

/* True for a number or an expression. */
static bool get_expression(lua_State *L, int index, expression *e) {
    if (lua_type(L, index) == LUA_TNUMBER) {
        *e = number(script_of(L)->graph, lua_tonumber(L, index));
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
    push_expression(L, operation == OP_POW ? power(graph, a, b) : apply(graph, operation, a, b, zero(graph)));
    return 1;
}

static int refuse_comparison(lua_State *L) {
    return luaL_error(L, "comparison of an expression: its value is not known while the model is read, "
                         "rd.where(rd.less(a, b), x, y) chooses during the motion");
}

static int name_expression(lua_State *L) {
    lua_pushliteral(L, EXPRESSION);
    return 1;
}

/* ---- what functions see as s and p ---- */

static void push_view(lua_State *L, struct view view) {
    struct view *handle = lua_newuserdatauv(L, sizeof *handle, 0);
    *handle = view;
    luaL_setmetatable(L, VIEW);
}

static int index_view(lua_State *L) {
    struct script *script = script_of(L);
    const struct view *view = lua_touserdata(L, 1);
    if (lua_type(L, 2) != LUA_TSTRING)
        return luaL_error(L, "index of type %s, a name is needed", luaL_typename(L, 2));
    struct view_result result = view_field(&script->names, *view, lua_tostring(L, 2));
    if (result.fault)
        return luaL_error(L, "%s", result.fault);
    if (result.is_view)
        push_view(L, result.view);
    else
        push_expression(L, result.expression);
    return 1;
}

static int refuse_assignment(lua_State *L) {
    return luaL_error(L, "assignment to a field of the state or of the parameters: they are read only");
}

/* ---- Lua values to plain values ---- */

static void convert(lua_State *L, int index, struct place place, int depth, struct value *value);

/* Ends the script with a message about a bound that was passed at `place`. */
static void stop_at(lua_State *L, struct place place, const char *what, int bound) {
    complain(script_of(L)->messages, place, "%s %d", what, bound);
    script_of(L)->is_told = true;
    lua_pushnil(L);
    lua_error(L);
}

static int compare_names(const void *a, const void *b) {
    const struct named_value *left = a, *right = b;
    return strcmp(left->name, right->name);
}

/* Counts list items and named entries; complains about what is neither. */
static void count_entries(lua_State *L, int index, struct value *value) {
    struct messages *messages = script_of(L)->messages;
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
            complain(messages, value->place, "a table has a key of type %s, names and 1, 2, 3 ... are",
                     luaL_typename(L, -1));
        }
    }
    if (largest == value->item_count)
        return;
    int gap = 1;
    for (; lua_rawgeti(L, index, gap) != LUA_TNIL; gap++)
        lua_pop(L, 1);
    lua_pop(L, 1);
    complain(messages, value->place, "item %d of a list is nil, lists have no gaps", gap);
    value->item_count = gap - 1;
}

static void convert_items(lua_State *L, int index, int table, int depth, struct value *value) {
    struct script *script = script_of(L);
    value->items = memory_get(script->memory, (size_t)value->item_count * sizeof *value->items);
    for (int i = 0; i < value->item_count; i++) {
        struct place place = value->place;
        int line = entry_line(&script->lines, table, NULL, i + 1);
        place.line = line > 0 ? line : place.line;
        lua_rawgeti(L, index, i + 1);
        convert(L, -1, place, depth, &value->items[i]);
        lua_pop(L, 1);
    }
}

static void convert_fields(lua_State *L, int index, int table, int depth, struct value *value) {
    struct script *script = script_of(L);
    value->fields = memory_get(script->memory, (size_t)value->field_count * sizeof *value->fields);
    int at = 0;
    lua_pushnil(L);
    while (lua_next(L, index)) {
        if (lua_type(L, -2) == LUA_TSTRING) {
            struct named_value *field = &value->fields[at++];
            struct place place = value->place;
            field->name = memory_text(script->memory, lua_tostring(L, -2));
            int line = entry_line(&script->lines, table, field->name, 0);
            place.line = line > 0 ? line : place.line;
            convert(L, -1, place, depth, &field->value);
        }
        lua_pop(L, 1);
    }
    qsort(value->fields, (size_t)value->field_count, sizeof *value->fields, compare_names);
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
        value->text = memory_text(script->memory, lua_tostring(L, index));
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
    expression at = zero(graph);
    if (lua_gettop(L) != 1 || !get_expression(L, 1, &at))
        return luaL_error(L, "a curve of %s, one number or expression is needed", luaL_typename(L, 1));
    push_expression(L, spline(graph, (int)lua_tointeger(L, lua_upvalueindex(1)), at));
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

/* Upvalues: number of the function, and the tag function of that name or nil (rd.tube: a section or a body).
 */
static int call_module(lua_State *L) {
    if (lua_istable(L, 1) && !lua_isnil(L, lua_upvalueindex(2))) {
        lua_pushvalue(L, lua_upvalueindex(2));
        lua_insert(L, 1);
        lua_call(L, lua_gettop(L) - 1, 1);
        return 1;
    }
    enum { MOST_ARGUMENTS = 8 };
    struct value arguments[MOST_ARGUMENTS];
    struct module_call call = {.declarations = &script_of(L)->declarations,
                               .place = current_place(L),
                               .function = (int)lua_tointeger(L, lua_upvalueindex(1)),
                               .arguments = arguments,
                               .argument_count = lua_gettop(L)};
    for (int i = 0; i < call.argument_count && i < MOST_ARGUMENTS; i++)
        convert(L, i + 1, call.place, 0, &arguments[i]);
    module_run(&call);
    if (call.fault)
        return luaL_error(L, "%s", call.fault);
    push_value(L, &call.result);
    return 1;
}

/* rd.model, rd.position ...: the table itself, with a tag. */
static int tag_table(lua_State *L) {
    if (lua_type(L, 1) != LUA_TTABLE)
        return luaL_error(L, "rd.%s: argument 1 is %s, a table is needed",
                          lua_tostring(L, lua_upvalueindex(1)), luaL_typename(L, 1));
    lua_settop(L, 1);
    lua_pushvalue(L, lua_upvalueindex(1));
    set_note(L, script_of(L)->tags, 1);
    return 1;
}

static int refuse_field(lua_State *L) {
    const char *name = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : "?";
    return luaL_error(L, "%s", module_unknown(script_of(L)->memory, name));
}

/* Builds the module. (-0, +1) */
static void push_module(lua_State *L) {
    const char *tags[OWNER_COUNT + 3];
    struct memory *memory = script_of(L)->memory;
    lua_newtable(L);
    for (int i = list_tags(tags) - 1; i >= 0; i--) {
        lua_pushstring(L, tags[i]);
        lua_pushcclosure(L, tag_table, 1);
        lua_setfield(L, -2, tags[i]);
    }
    for (int i = 0; i < module_function_count(); i++) {
        const char *name = module_function_name(memory, i);
        lua_pushinteger(L, i);
        lua_getfield(L, -2, name);
        lua_pushcclosure(L, call_module, 2);
        lua_setfield(L, -2, name);
    }
    lua_pushnumber(L, 3.14159265358979323846);
    lua_setfield(L, -2, "pi");
    lua_createtable(L, 0, 1);
    lua_pushcfunction(L, refuse_field);
    lua_setfield(L, -2, "__index");
    lua_setmetatable(L, -2);
}

/* ---- the sandbox ---- */

static int is_expression(lua_State *L) {
    lua_pushboolean(L, luaL_testudata(L, 1, EXPRESSION) != NULL);
    return 1;
}

static int compile_beside(lua_State *L);

static void open_sandbox(lua_State *L) {
    luaL_requiref(L, LUA_GNAME, luaopen_base, 1);
    luaL_requiref(L, LUA_STRLIBNAME, luaopen_string, 1);
    luaL_requiref(L, LUA_TABLIBNAME, luaopen_table, 1);
    luaL_requiref(L, LUA_MATHLIBNAME, luaopen_math, 1);
    lua_pop(L, 4);
    if (luaL_loadbufferx(L, sandbox_source, sizeof sandbox_source - 1, "=sandbox", "t") != LUA_OK)
        lua_error(L);
    push_module(L);
    lua_pushcfunction(L, is_expression);
    lua_pushcfunction(L, compile_beside);
    lua_call(L, 3, 0);
    if (luaL_loadbufferx(L, work_source, sizeof work_source - 1, "=sandbox", "t") != LUA_OK)
        lua_error(L);
    lua_call(L, 0, 0);
}

static void make_metatables(lua_State *L) {
    static const struct {
        const char *event;
        enum operation operation;
    } operators[] = {{"__add", OP_ADD}, {"__sub", OP_SUB}, {"__mul", OP_MUL},
                     {"__div", OP_DIV}, {"__unm", OP_NEG}, {"__pow", OP_POW}};
    static const luaL_Reg refusals[] = {{"__lt", refuse_comparison},
                                        {"__le", refuse_comparison},
                                        {"__eq", refuse_comparison},
                                        {"__tostring", name_expression},
                                        {NULL, NULL}};
    static const luaL_Reg view_events[] = {
        {"__index", index_view}, {"__newindex", refuse_assignment}, {NULL, NULL}};
    luaL_newmetatable(L, EXPRESSION);
    luaL_setfuncs(L, refusals, 0);
    for (size_t i = 0; i < sizeof operators / sizeof *operators; i++) {
        lua_pushinteger(L, (lua_Integer)operators[i].operation);
        lua_pushcclosure(L, arithmetic, 1);
        lua_setfield(L, -2, operators[i].event);
    }
    lua_pushliteral(L, EXPRESSION);
    lua_setfield(L, -2, "__metatable");
    luaL_newmetatable(L, VIEW);
    luaL_setfuncs(L, view_events, 0);
    lua_pushliteral(L, VIEW);
    lua_setfield(L, -2, "__metatable");
    lua_pop(L, 2);
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

static void count_steps(lua_State *L, lua_Debug *where) {
    if (++script_of(L)->checks < CHECKS_BOUND)
        return;
    lua_getinfo(L, "Sl", where);
    lua_pushfstring(L, "%s:%d: more than %d million steps to read the model, a loop has no end?",
                    where->short_src, where->currentline, STEPS_BETWEEN_CHECKS / 1000000 * CHECKS_BOUND);
    lua_error(L);
}

/* ---- protected calls ---- */

static void *allocate(void *context, void *data, size_t old, size_t size) {
    return pool_resize(context, data, data ? old : 0, size);
}

/* memory.fail while Lua runs. */
static void fail_in_lua(void *context) {
    struct script *script = context;
    script->is_short_of_memory = true;
    lua_pushnil(script->L);
    lua_error(script->L);
}

/* Splits "model0:LINE: text" into place and text. */
static void report(struct script *script, const char *text) {
    const struct place place = source_place(&script->sources, text, &text);
    complain(script->messages, place, "%s", text);
}

struct job {
    struct script *script;
    const struct value *function;
    struct value *result;
};

static bool run_protected(struct job *job, lua_CFunction function) {
    struct script *script = job->script;
    struct memory *memory = script->memory;
    void (*fail)(void *) = memory->fail;
    void *context = memory->context;
    memory->fail = fail_in_lua;
    memory->context = script;
    lua_pushcfunction(script->L, function);
    lua_pushlightuserdata(script->L, job);
    int status = lua_pcall(script->L, 1, 0, 0);
    memory->fail = fail;
    memory->context = context;
    if (status == LUA_OK)
        return true;
    if (script->pool.is_over_bound)
        complain(script->messages, (struct place){.file = script->file},
                 "more than %d MB of memory to read the model", (int)(memory_bound >> 20));
    else if (script->is_short_of_memory || status == LUA_ERRMEM)
        memory->fail(memory->context);
    else if (script->is_told)
        script->is_told = false;
    else if (lua_type(script->L, -1) == LUA_TSTRING)
        report(script, lua_tostring(script->L, -1));
    else
        report(script, "the model raised an error that is no text");
    lua_settop(script->L, 0);
    return false;
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
    snprintf(chunk, sizeof chunk, "=" SOURCE_CHUNK "%d", number);
    if (luaL_loadbufferx(L, source->text, source->length, chunk, "t") != LUA_OK)
        lua_error(L);
    lua_pop(L, 1);
    warn_of_doubts(script->memory, script->messages, source->path, source->text, source->length);
    mark_tables(script->memory, script->messages, source->path, source->text, source->length, &script->lines);
    if (luaL_loadbufferx(L, script->lines.text, script->lines.length, chunk, "t") != LUA_OK)
        lua_error(L);
}

/* The function of the file NAME.lua beside the model. */
static int compile_beside(lua_State *L) {
    struct script *script = script_of(L);
    const char *path = source_path(script->memory, script->file, luaL_checkstring(L, 1));
    if (!add_source(script->memory, &script->sources, path)) {
        luaL_where(L, 2);
        lua_pushfstring(L, "%srequire: no file %s.lua beside the model", lua_tostring(L, -1),
                        lua_tostring(L, 1));
        return lua_error(L);
    }
    load_source(L, script->sources.count - 1);
    return 1;
}

static int run_file(lua_State *L) {
    struct job *job = job_of(L);
    struct script *script = job->script;
    make_metatables(L);
    open_sandbox(L);
    script->marks = weak_table(L);
    script->tags = weak_table(L);
    lua_pushcfunction(L, mark_table);
    lua_setglobal(L, TABLE_MARK);
    load_source(L, 0);
    lua_sethook(L, count_steps, LUA_MASKCOUNT, STEPS_BETWEEN_CHECKS);
    lua_call(L, 0, 1);
    convert(L, -1, (struct place){.file = script->file}, 0, &script->result);
    return 0;
}

static int run_function(lua_State *L) {
    struct job *job = job_of(L);
    lua_rawgeti(L, LUA_REGISTRYINDEX, job->function->function);
    push_view(L, (struct view){.kind = VIEW_STATE});
    lua_call(L, 1, 1);
    convert(L, -1, job->function->place, 0, job->result);
    return 0;
}

/* ---- what the rest of the reader calls ---- */

static bool read_main(struct script *script) {
    if (add_source(script->memory, &script->sources, script->file))
        return true;
    complain(script->messages, (struct place){.file = script->file}, "cannot be read: %s", strerror(errno));
    return false;
}

struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages) {
    struct script *script = memory_get(memory, sizeof *script);
    *script = (struct script){.memory = memory, .graph = graph, .messages = messages, .file = request->file};
    script->pool = (struct pool){.memory = memory, .bound = memory_bound};
    declarations_start(&script->declarations, memory, graph, request, messages);
    script->names.declarations = &script->declarations;
    if (!read_main(script))
        return NULL;
    script->L = lua_newstate(allocate, &script->pool);
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

bool script_call(struct script *script, const struct value *function, struct value *result) {
    struct job job = {.script = script, .function = function, .result = result};
    return run_protected(&job, run_function);
}

void script_close(struct script *script) {
    if (script->L)
        lua_close(script->L);
    script->L = NULL;
}
