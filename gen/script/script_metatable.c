/*
 * Metatables of expressions, of groups of values, and of tables for which the author calls setmetatable.
 */
#include "gen/script/script_state.h"

#include <string.h>

/* ---- expressions ---- */

static int arithmetic(lua_State *L) {
    struct graph *graph = script_of(L)->graph;
    enum operation operation = (enum operation)lua_tointeger(L, lua_upvalueindex(1));
    expression a, b;
    for (int i = 1; i <= 2; i++)
        if (!script_get_expression(L, i, i == 1 ? &a : &b))
            return luaL_error(L, "arithmetic on an expression and %s; must be a number or an expression",
                              luaL_typename(L, i));
    script_push_expression(L, operation == OP_POW ? expr_power(graph, a, b)
                                                  : expr_apply(graph, operation, a, b, EXPR_ZERO));
    return 1;
}

/* Operations of Lua that expressions do not have: the event and its message. */
static const struct {
    const char *event, *fault;
} refused_events[] = {
#define NOT_KNOWN "its value is not known while the model is read; "
#define CHOOSE NOT_KNOWN "use rd.where(rd.less(a, b), x, y) to choose during the motion"
#define COMPARISON "comparison of an expression: " CHOOSE
#define BITS " of an expression: " CHOOSE
    {"__lt", COMPARISON},
    {"__le", COMPARISON},
    {"__eq", COMPARISON},
    {"__mod", "%% of an expression: rd has no remainder; to keep an angle x between -pi and pi write "
              "rd.atan2(rd.sin(x), rd.cos(x))"},
    {"__idiv", "// of an expression: rd has no rounding; write a / b to divide"},
    {"__band", "&" BITS},
    {"__bor", "|" BITS},
    {"__bxor", "~" BITS},
    {"__bnot", "~" BITS},
    {"__shl", "<<" BITS},
    {"__shr", ">>" BITS},
    {"__concat", ".. of an expression: " NOT_KNOWN "use an option (rd.option)"},
    {"__len", "# of an expression: it is one value and has no length; only a list or a text has"},
    {"__call", "call of an expression: it is a value; write * to multiply, and call functions as rd.sin(x)"},
    {"__index", "field of an expression: it is one value and has no fields"},
    {"__newindex", "assignment to a field of an expression: it is one value and has no fields"},
#undef NOT_KNOWN
#undef CHOOSE
#undef COMPARISON
#undef BITS
};

static int refuse_event(lua_State *L) {
    return luaL_error(L, refused_events[lua_tointeger(L, lua_upvalueindex(1))].fault);
}

/* ---- groups of values ---- */

static int index_view(lua_State *L) {
    struct script *script = script_of(L);
    const struct view *view = lua_touserdata(L, 1);
    if (lua_type(L, 2) != LUA_TSTRING)
        return luaL_error(L, "index of type %s; must be a name", luaL_typename(L, 2));
    work_add(&script->work, script_names_in(script));
    struct view_result result = state_symbols_field(&script->names, *view, script_name_at(L, 2));
    script->is_reported = result.fault && result.is_reported;
    if (result.fault)
        return luaL_error(L, "%s", result.fault);
    if (result.is_view)
        script_push_view(L, result.view);
    else
        script_push_expression(L, result.expression);
    return 1;
}

static int refuse_group(lua_State *L) {
    return luaL_error(L, "a group of values in place of one; write p.NAME, s.q.NAME or s.points.NAME.x");
}

static int refuse_assignment(lua_State *L) {
    return luaL_error(L, "assignment to a field of the state or of the parameters: they are read only");
}

/* ---- metatables of authors ---- */

/* Functions that Lua calls for a table. Those that would run uncounted are refused. */
static const struct {
    const char *name;
    enum event_kind {
        EVENT_FUNCTION,
        EVENT_FIELDS,
        EVENT_REFUSED
    } kind; /* EVENT_FIELDS: a function, or a table in which Lua looks */
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

/* A table in __index becomes this function, so that a chain of such tables is a chain of calls, which are
 * counted and cannot be endless. */
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
    luaL_error(L, "setmetatable: %s is of type %s; must be a function", name, lua_typename(L, type));
}

/* Copies an event from the author's metatable at index 2 to the copy at index 3, whose items are the copied
 * values. */
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

/* Pushes the copy of the metatable at index 2, and makes it if there is none. (-0, +1) */
static void push_copy(lua_State *L) {
    struct script *script = script_of(L);
    script_get_note(L, script->events, 2);
    if (!lua_isnil(L, -1))
        return;
    lua_pop(L, 1);
    lua_createtable(L, EVENT_COUNT, 4);
    lua_pushvalue(L, 2);
    lua_setfield(L, -2, "__metatable"); /* returned by getmetatable */
    lua_rawgeti(L, LUA_REGISTRYINDEX, script->events);
    lua_pushvalue(L, 2);
    lua_rawseti(L, -2, (lua_Integer)lua_rawlen(L, -2) + 1);
    lua_pop(L, 1);
    lua_pushvalue(L, -1);
    script_set_note(L, script->events, 2);
}

int script_set_metatable(lua_State *L) {
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

void script_check_events(lua_State *L) {
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
                luaL_error(L, "setmetatable: %s was changed after the call; set it before",
                           events[event].name);
            lua_pop(L, 2);
        }
        lua_settop(L, notes);
    }
    lua_settop(L, notes - 1);
}

/* ---- the metatables of our values ---- */

/* Pushes a new metatable that the model cannot see. (-0, +1) */
static void new_metatable(lua_State *L, const char *name) {
    luaL_newmetatable(L, name);
    lua_pushstring(L, name);
    lua_setfield(L, -2, "__metatable");
}

void script_make_expressions(lua_State *L) {
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

/* Groups of values have fields and refuse everything else. */
void script_make_views(lua_State *L) {
    new_metatable(L, VIEW);
    for (int i = 0; i < EVENT_COUNT; i++) {
        if (events[i].kind == EVENT_REFUSED || strcmp(events[i].name, "__tostring") == 0)
            continue;
        lua_pushcfunction(L, i == 0 ? index_view : i == 1 ? refuse_assignment : refuse_group);
        lua_setfield(L, -2, events[i].name);
    }
    lua_pop(L, 1);
}

void script_guard_table(lua_State *L, const char *name) {
    lua_createtable(L, 0, 2);
    lua_insert(L, -2);
    lua_setfield(L, -2, "__index");
    lua_pushstring(L, name);
    lua_setfield(L, -2, "__metatable");
    lua_setmetatable(L, -2);
}

void script_refuse_colon(lua_State *L, const char *table, const char *name) {
    const int top = lua_gettop(L);
    if (lua_type(L, 1) == LUA_TTABLE && luaL_getmetafield(L, 1, "__metatable") == LUA_TSTRING &&
        strcmp(lua_tostring(L, -1), table) == 0)
        luaL_error(L, "%s:%s: the colon passes %s as first argument; write %s.%s", table, name, table, table,
                   name);
    lua_settop(L, top);
}
