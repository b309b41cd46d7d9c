/*
 * Runs a model file in a sandbox of Lua, and calls the author's functions: the module `refdyn`, the sandbox,
 * and the protected calls.
 *
 * Lua is entered only by protected calls. Inside, a shortage of memory is a Lua error; outside it calls
 * memory.fail again. All work of Lua is counted (work_limits.c): by a hook at every hundredth step and every
 * call, by the allocator, and by library functions that do more than one pass. Stack effects are given as
 * (-popped, +pushed).
 */
#include "gen/script/script_state.h"
#include "gen/script/source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lualib.h>

/* Bounds of one model while it is read, in addition to work and memory. script_value.c has more. */
enum {
    STEPS_BETWEEN_CHECKS = 100,
    TEXT_MEGABYTES = 4,
    ARGUMENTS_BOUND = 250 /* of a function with `...`, which any step may copy */
};

/* __at(number, table) in the rewritten source records the place of the table. */
static int mark_table(lua_State *L) {
    lua_settop(L, 2);
    lua_pushvalue(L, 1);
    script_set_note(L, script_of(L)->marks, 2);
    return 1;
}

/* ---- the module "refdyn" ---- */

/* The word for the argument at `index` in messages. */
static const char *kind_at(lua_State *L, int index) {
    struct value value;
    script_convert(L, index, script_place(L), 0, &value);
    return value_kind_text(value.kind);
}

/* Example of a call that takes a table. */
static const char *form_of_tag(struct memory *memory, const char *tag) {
    const char *form = script_kind_form(tag);
    return memory_format(memory, "rd.%s %s", tag, form ? form : fields_tag_form(tag));
}

/* Returns the table itself, with a tag. */
static int tag_argument(lua_State *L, const char *tag) {
    struct memory *memory = script_of(L)->memory;
    script_refuse_colon(L, "rd", tag);
    if (lua_type(L, 1) != LUA_TTABLE)
        return luaL_error(L, "rd.%s: argument 1 is %s; must be a table, as in %s", tag, kind_at(L, 1),
                          form_of_tag(memory, tag));
    if (lua_gettop(L) > 1)
        return luaL_error(L, "rd.%s: %d arguments; must have 1, as in %s", tag, lua_gettop(L),
                          form_of_tag(memory, tag));
    script_get_note(L, script_of(L)->tags, 1);
    if (!lua_isnil(L, -1))
        return luaL_error(L, "rd.%s: argument 1 is made by rd.%s; must be a new table { ... }", tag,
                          lua_tostring(L, -1));
    lua_pushstring(L, tag);
    script_set_note(L, script_of(L)->tags, 1);
    lua_settop(L, 1);
    return 1;
}

/* rd.model, rd.position ... */
static int tag_table(lua_State *L) {
    return tag_argument(L, lua_tostring(L, lua_upvalueindex(1)));
}

/* Upvalues: number of the function, and whether the function also makes tables, as rd.tube makes a section or
 * a body. */
static int call_module(lua_State *L) {
    const int function = (int)lua_tointeger(L, lua_upvalueindex(1));
    script_refuse_colon(L, "rd", module_function_name(script_of(L)->memory, function));
    if (lua_istable(L, 1) && lua_toboolean(L, lua_upvalueindex(2)))
        return tag_argument(L, module_function_name(script_of(L)->memory, function));
    enum { MOST_ARGUMENTS = 8 };
    struct value arguments[MOST_ARGUMENTS];
    struct module_call call = {.declarations = &script_of(L)->declarations,
                               .place = script_place(L),
                               .function = function,
                               .arguments = arguments,
                               .argument_count = lua_gettop(L)};
    struct script *script = script_of(L);
    script->has_samples = module_takes_samples(call.function);
    for (int i = 0; i < call.argument_count && i < MOST_ARGUMENTS; i++)
        script_convert(L, i + 1, call.place, 0, &arguments[i]);
    script->has_samples = false;
    const int names = script_name_count(script);
    module_run(&call);
    work_add(&script->work, (1.0 + script_name_count(script) - names) * script_names_in(script));
    work_add(&script->work, module_evaluates(call.function) ? script->graph->count / 8.0 : 0);
    script_stop_at_bound(L);
    if (call.fault)
        return luaL_error(L, "%s", call.fault);
    script_push_value(L, &call.result);
    return 1;
}

static int refuse_field(lua_State *L) {
    const char *name = lua_type(L, 2) == LUA_TSTRING ? script_name_at(L, 2) : "?";
    return luaL_error(L, "%s", script_unknown_field(script_of(L), name));
}

/* A new field such as rd.gravity would have no effect. */
static int refuse_new_field(lua_State *L) {
    const char *name = lua_type(L, 2) == LUA_TSTRING ? script_name_at(L, 2) : "?";
    return luaL_error(L, "rd.%s: assignment to rd, which is read only; use a local variable", name);
}

/* rd.NAME, which marks a table with that name, in the table on top of the stack. (-0, +0) */
static void add_tag(lua_State *L, const char *name) {
    lua_pushstring(L, name);
    lua_pushcclosure(L, tag_table, 1);
    lua_setfield(L, -2, name);
}

static void add_model_functions(lua_State *L) {
    const char *tags[OWNER_COUNT + 3];
    struct memory *memory = script_of(L)->memory;
    for (int i = fields_list_tags(tags) - 1; i >= 0; i--)
        add_tag(L, tags[i]);
    for (int i = 0; i < module_function_count(); i++) {
        const char *name = module_function_name(memory, i);
        lua_pushinteger(L, i);
        lua_pushboolean(L, lua_getfield(L, -2, name) != LUA_TNIL);
        lua_remove(L, -2);
        lua_pushcclosure(L, call_module, 2);
        lua_setfield(L, -2, name);
    }
}

/* Builds the module. (-0, +1) */
static void push_module(lua_State *L) {
    const char *tag = script_kind_tag(script_of(L)->kind);
    lua_newtable(L);
    if (tag) {
        add_tag(L, tag);
        script_add_kind_functions(L);
    } else {
        add_model_functions(L);
    }
    lua_pushnumber(L, 3.14159265358979323846);
    lua_setfield(L, -2, "pi");
    lua_pushcfunction(L, refuse_field);
    script_guard_table(L, "rd");
    lua_getmetatable(L, -1);
    lua_pushcfunction(L, refuse_new_field);
    lua_setfield(L, -2, "__newindex");
    lua_pop(L, 1);
}

/* ---- work ---- */

/* Counts a call by its arguments and a return by its results. The number of arguments is bounded, since any
 * step of a function with `...` may copy them. */
static void count_call(lua_State *L, lua_Debug *event) {
    lua_getinfo(L, "r", event);
    work_add_call(&script_of(L)->work, event->ntransfer);
    if (event->event == LUA_HOOKRET || !lua_getlocal(L, event, -ARGUMENTS_BOUND - 1))
        return;
    lua_pop(L, 1);
    lua_pushfstring(L, "a function is called with more than %d arguments for `...`; pass them in a table",
                    ARGUMENTS_BOUND);
    lua_error(L);
}

static void watch(lua_State *L, lua_Debug *event) {
    if (event->event != LUA_HOOKCOUNT) {
        count_call(L, event);
        return;
    }
    work_add_steps(&script_of(L)->work, STEPS_BETWEEN_CHECKS);
    script_stop_at_bound(L);
}

/* ---- the sandbox ---- */

/*
 * The part of the sandbox that is written in Lua. Its arguments are the module, a function that compiles a
 * file in the folder of the model, a function that marks tables, and table.sort. The globals that it sets
 * become those of the model.
 *
 * `pairs` visits a table in the same order on every run: numbers upward, then names.
 */
static const char sandbox_source[] =
    "local rd, compile_neighbour, mark_table, sort = ...\n"
    "local each, type, error, rawget, match = next, type, error, rawget, string.match\n"
    "\n"
    "local function sorted_keys(t)\n"
    "  local keys, names = {}, {}\n"
    "  for key in each, t do\n"
    "    local kind = type(key)\n"
    "    if kind ~= 'number' and kind ~= 'string' then\n"
    "      error('pairs: a key of type ' .. kind .. '; keys must be numbers or names', 0)\n"
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
    "  if kind == 'userdata' then error('pairs: an expression or a group of values; must be a table', 0) "
    "end\n"
    "  if kind ~= 'table' then error('pairs: ' .. kind .. '; must be a table', 0) end\n"
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
    "    error('require: not a name; write \"refdyn\", or the name without .lua of a file in the folder of "
    "'\n"
    "      .. 'the model', 0)\n"
    "  end\n"
    "  if loaded[name] == nil then\n"
    "    local run = compile_neighbour(name)\n"
    "    loaded[name] = false\n"
    "    local result, more = run(mark_table)\n"
    "    if more ~= nil then error('require: \"' .. name .. '\" returns two values; must return one', 0) "
    "end\n"
    "    loaded[name] = result == nil and true or result\n"
    "  elseif not loaded[name] then\n"
    "    error('require: \"' .. name .. '\" requires itself, directly or through other files', 0)\n"
    "  end\n"
    "  return loaded[name]\n"
    "end\n";

static int compile_neighbour(lua_State *L);

/* Opens Lua's libraries in tables that the model never sees, and runs our part of the sandbox in Lua. */
static void open_originals(lua_State *L) {
    luaL_requiref(L, LUA_GNAME, luaopen_base, 1);
    luaL_requiref(L, LUA_STRLIBNAME, luaopen_string, 1);
    luaL_requiref(L, LUA_TABLIBNAME, luaopen_table, 1);
    luaL_requiref(L, LUA_MATHLIBNAME, luaopen_math, 1);
    lua_pop(L, 4);
    if (luaL_loadbufferx(L, sandbox_source, sizeof sandbox_source - 1, "=sandbox", "t") != LUA_OK)
        lua_error(L);
    push_module(L);
    lua_pushcfunction(L, compile_neighbour);
    lua_pushcfunction(L, mark_table);
    lua_pushcfunction(L, script_sort_table);
    lua_call(L, 4, 0);
}

static void open_sandbox(lua_State *L) {
    static const char *const names[] = {LUA_STRLIBNAME, LUA_TABLIBNAME, LUA_MATHLIBNAME};
    open_originals(L);
    script_push_library(L, LUA_GNAME);
    lua_pushvalue(L, -1);
    lua_setfield(L, -2, LUA_GNAME);
    for (int i = 0; i < 3; i++) {
        script_push_library(L, names[i]);
        lua_setfield(L, -2, names[i]);
    }
    lua_pushcfunction(L, script_refuse_global);
    script_guard_table(L, "the globals");
    lua_pushliteral(L, "");
    lua_getmetatable(L, -1);
    lua_getfield(L, -3, LUA_STRLIBNAME);
    lua_setfield(L, -2, "__index");
    lua_pushliteral(L, "texts");
    lua_setfield(L, -2, "__metatable");
    lua_pop(L, 2);
    lua_rawseti(L, LUA_REGISTRYINDEX, LUA_RIDX_GLOBALS);
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

/* For a new piece, Lua passes its purpose in place of the old size. */
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
    if (!piece && size > 0) /* Lua now searches all its memory for unused pieces */
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

/* Advice to follow a message of Lua. */
static const char *hint_for(const char *text) {
    if (strncmp(text, "bad 'for' ", 10) == 0 && strstr(text, "got " EXPRESSION))
        return "; its value is not known while the model is read; use an option (rd.option)";
    if (strncmp(text, "C stack overflow", 16) == 0)
        return ": calls, parentheses, tables or blocks are nested too deeply";
    if (strncmp(text, "stack overflow", 14) == 0)
        return ": a function calls itself endlessly; add a case in which it returns without the call";
    return lint_advice(text);
}

/* The bracket that a file leaves open, as a text to follow a message; "" if there is none. */
static const char *open_bracket_of(const struct script *script, const char *path, const char *text) {
    for (int i = 0; i < script->sources.count; i++) {
        const struct source_file *source = &script->sources.list[i];
        if (strcmp(source->path, path) == 0)
            return lint_open_bracket(script->memory, text, source->text, source->length);
    }
    return "";
}

/* Reports an error at the place with which its text begins, or else at the innermost line of the model's
 * files. A place in our own Lua is removed. */
static void report(struct script *script, const char *text, size_t length) {
    struct place place = script->error_place;
    const char *rest = text;
    if (!source_file_place(&script->sources, text, &place, &rest) && strncmp(text, "sandbox:", 8) == 0) {
        rest = strchr(text + 8, ':');
        rest = rest ? rest + 2 : text;
    }
    const char *safe = message_safe_text(script->memory, rest, length - (size_t)(rest - text));
    const char *hint = text_ends_with(safe, "near <eof>") ? open_bracket_of(script, place.file, safe) : "";
    message_error(script->messages, place, "%s%s", safe, *hint ? hint : hint_for(safe));
}

/* Records the place of an error. Lua calls it before it leaves the functions that were running. */
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

/* Reports an error of any kind: a text, another value, or a shortage of memory. */
static void report_error(struct script *script, int status) {
    lua_State *L = script->L;
    size_t length;
    const char *text = lua_tolstring(L, -1, &length); /* also of a number */
    if (script->is_text_too_long)
        message_error(script->messages, (struct place){.file = script->file},
                      "a text of more than %d MB; texts must be shorter", TEXT_MEGABYTES);
    else if (script->is_short_of_memory || status == LUA_ERRMEM)
        script->memory->fail(script->memory->context);
    else if (text)
        report(script, text, length);
    else if (!script->is_reported)
        message_error(script->messages, script->error_place,
                      "error(...) with a value of type %s; must be a text", luaL_typename(L, -1));
    script->is_reported = false;
}

struct job {
    struct script *script;
    const struct value *function;
    const char *name; /* of the function */
    struct value *result;
};

bool script_run(struct script *script, int function(lua_State *L), void *job) {
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

void *script_job(lua_State *L) {
    void *job = lua_touserdata(L, 1);
    lua_settop(L, 0);
    return job;
}

/* Pushes the compiled source. The source as written is compiled first, so that syntax errors show it. (-0,
 * +1)
 */
static void load_source(lua_State *L, int number) {
    struct script *script = script_of(L);
    const struct source_file *source = &script->sources.list[number];
    char chunk[32];
    work_add_source(&script->work, source->text, source->length);
    script_stop_at_bound(L);
    snprintf(chunk, sizeof chunk, "=" SOURCE_CHUNK "%d", number);
    if (!lint_characters(script->memory, script->messages, source->path, source->text, source->length))
        script_stop_reported(L);
    if (luaL_loadbufferx(L, source->text, source->length, chunk, "t") != LUA_OK)
        lua_error(L);
    lua_pop(L, 1);
    lint_source(script->memory, script->messages, source->path, source->text, source->length);
    source_lines_mark_tables(script->memory, script->messages, source->path, source->text, source->length,
                             &script->lines);
    if (luaL_loadbufferx(L, script->lines.text, script->lines.length, chunk, "t") != LUA_OK)
        lua_error(L);
}

static bool is_module_misspelt(const char *name) {
    static const char *const known[] = {"refdyn"};
    return strcmp(name, "rd") == 0 || message_nearest_name(name, known, 1);
}

/* Returns the function of the file NAME.lua in the folder of the model. */
static int compile_neighbour(lua_State *L) {
    struct script *script = script_of(L);
    const char *name = luaL_checkstring(L, 1);
    const char *fault = source_file_add(script->memory, &script->sources,
                                        source_file_path(script->memory, script->file, name));
    if (fault) {
        lua_settop(L, 0);
        return luaL_error(L, "require: %s.lua in the folder of the model cannot be read: %s%s", name, fault,
                          is_module_misspelt(name) ? "; did you mean \"refdyn\"?" : "");
    }
    load_source(L, script->sources.count - 1);
    return 1;
}

/* Converts the only value on the stack, nil if there is none. */
static void convert_result(lua_State *L, struct place place, const char *what, struct value *result) {
    const int count = lua_gettop(L);
    if (count > 1)
        message_error(script_of(L)->messages, place, "%s %d values; must return one", what, count);
    lua_settop(L, 1);
    script_convert(L, 1, place, 0, result);
}

static int run_file(lua_State *L) {
    const struct job *job = script_job(L);
    struct script *script = job->script;
    script_make_expressions(L);
    script_make_views(L);
    open_sandbox(L);
    script->marks = weak_table(L);
    script->tags = weak_table(L);
    lua_newtable(L);
    script->events = luaL_ref(L, LUA_REGISTRYINDEX);
    load_source(L, 0);
    lua_sethook(L, watch, LUA_MASKCOUNT | LUA_MASKCALL | LUA_MASKRET, STEPS_BETWEEN_CHECKS);
    lua_pushcfunction(L, mark_table);
    lua_call(L, 1, LUA_MULTRET);
    script_check_events(L);
    convert_result(L, (struct place){.file = script->file}, "the file returns", &script->result);
    return 0;
}

static int run_function(lua_State *L) {
    const struct job *job = script_job(L);
    lua_rawgeti(L, LUA_REGISTRYINDEX, job->function->function);
    script_push_view(L, view_of_state);
    lua_call(L, 1, LUA_MULTRET);
    script_check_events(L);
    const char *what = memory_format(job->script->memory, "%s: the function returns", job->name);
    convert_result(L, job->function->place, what, job->result);
    return 0;
}

/* ---- interface to the reader ---- */

/* Whether the file is XML, such as the URDF file of a robot. */
static bool is_xml(const struct source_file *source) {
    size_t start = 0;
    while (start < source->length && memchr(" \t\r\n", source->text[start], 4))
        start++;
    return (start < source->length && source->text[start] == '<') || text_ends_with(source->path, ".urdf") ||
           text_ends_with(source->path, ".xml");
}

/* Whether the file contains motions: it has the signature of HDF5 or begins with the column t. */
static bool is_motion(const struct source_file *source) {
    static const char hdf5[] = "\x89HDF\r\n\x1a\n", csv[] = "t,";
    return (source->length >= sizeof hdf5 - 1 && memcmp(source->text, hdf5, sizeof hdf5 - 1) == 0) ||
           (source->length >= sizeof csv - 1 && memcmp(source->text, csv, sizeof csv - 1) == 0);
}

static bool read_main(struct script *script) {
    const struct place place = {.file = script->file};
    const char *fault = source_file_add(script->memory, &script->sources, script->file);
    if (fault) {
        message_error(script->messages, place, "cannot be read: %s", fault);
        return false;
    }
    const struct source_file *source = &script->sources.list[0];
    if (is_xml(source))
        message_error(script->messages, place,
                      "is XML and not a model in Lua; convert a URDF file by `refdyn import`");
    else if (is_motion(source))
        message_error(script->messages, place, "contains motions; name a model in Lua");
    else
        return true;
    return false;
}

/* Values of --set become texts of the model. */
static bool check_settings(const struct read_request *request, struct messages *messages) {
    bool are_lines = true;
    for (int i = 0; i < request->setting_count; i++) {
        const struct setting *setting = &request->settings[i];
        const char *shown = message_safe_text(messages->memory, setting->value, strlen(setting->value));
        const char *what =
            memory_format(messages->memory, "%s %s \"%s\"", setting_source(setting), setting->name, shown);
        are_lines &= message_is_one_line(messages, (struct place){.file = request->file}, what,
                                         setting->value, strlen(setting->value));
    }
    return are_lines;
}

struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages) {
    struct script *script = memory_get(memory, sizeof *script);
    *script = (struct script){.memory = memory, .graph = graph, .messages = messages, .file = request->file};
    script->kind = request->kind;
    script->noun = script_kind_noun(request->kind);
    script->has_samples = request->kind == FILE_SWEEP; /* a list may have a value for each case */
    script->work.millions = WORK_MILLIONS;
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
    return script_run(script, run_file, &job) ? script : NULL;
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

void script_declare_states(struct script *script, bool declares_states) {
    script->names.declares_states = declares_states;
}

bool script_call(struct script *script, const struct value *function, const char *name,
                 struct value *result) {
    struct job job = {.script = script, .function = function, .name = name, .result = result};
    return script_run(script, run_function, &job);
}
