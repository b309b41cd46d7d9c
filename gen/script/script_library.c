/*
 * The part of Lua's libraries that a model may use, the work that each function counts, and messages about
 * unknown names.
 */
#include "gen/script/script_state.h"
#include "gen/script/source.h"

#include <stdlib.h>
#include <string.h>

#include <lualib.h>

/* ---- work of library functions beyond that of a call ---- */

/* Number of entries from argument `first` to argument `last`, or of all if these are omitted. (lua_isnumber
 * is also true for a text such as "1", which the library reads as a number.) */
static double range_steps(lua_State *L, int first, int last) {
    const double from = lua_isnumber(L, first) ? lua_tonumber(L, first) : 1;
    const double to = lua_isnumber(L, last) ? lua_tonumber(L, last) : (double)lua_rawlen(L, 1);
    return to >= from ? to - from + 1 : 0;
}

static double concat_steps(lua_State *L) {
    return 4 * range_steps(L, 3, 4);
}

static double unpack_steps(lua_State *L) {
    return range_steps(L, 2, 3);
}

static double move_steps(lua_State *L) {
    return lua_isnumber(L, 2) && lua_isnumber(L, 3) ? range_steps(L, 2, 3) : 0;
}

/* Entries after the one that is inserted or removed. */
static double shift_steps(lua_State *L) {
    const double length = (double)lua_rawlen(L, 1);
    return lua_isnumber(L, 2) && lua_tonumber(L, 2) < length ? length - lua_tonumber(L, 2) + 1 : 0;
}

static double pattern_work(lua_State *L) {
    size_t length;
    if (!lua_isstring(L, 1) || !lua_isstring(L, 2))
        return 0;
    const char *pattern = lua_tolstring(L, 2, &length);
    return work_pattern_steps(lua_rawlen(L, 1), pattern, length);
}

/* Each place may be replaced: by a text, an entry of a table, or the result of a function. */
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

/* For each argument, a number of up to 400 digits, or a text whose bytes %q writes as numbers. */
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

/* tostring. The address of a table or function differs from run to run, so that its type is returned. */
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

/* string.format must not show addresses either. */
static void check_format(lua_State *L) {
    for (int i = 2; i <= lua_gettop(L); i++)
        if (has_no_text(L, i))
            luaL_error(L, "string.format: argument %d is of type %s; must be a text, number or boolean", i,
                       luaL_typename(L, i));
    if (lua_type(L, 1) == LUA_TSTRING && shows_address(lua_tostring(L, 1)))
        luaL_error(L, "string.format: %%p shows an address, which differs from run to run");
}

static void check_length(lua_State *L, const char *name) {
    if (lua_type(L, 1) == LUA_TTABLE && luaL_getmetafield(L, 1, "__len") != LUA_TNIL)
        luaL_error(L, "table.%s: the table has __len; must be a table without it", name);
}

/* Whether the entry at `left` is less than that at `right`, by the function at index 2 if any. (-0, +0) */
static bool is_less(lua_State *L, int left, int right) {
    work_add_call(&script_of(L)->work, 2);
    script_stop_at_bound(L);
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

int script_sort_table(lua_State *L) {
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

/* ---- the functions that a model may use ---- */

static const struct {
    const char *name, *entries;
} libraries[] = {
    {"_G", "assert error getmetatable ipairs pairs rawequal rawget rawlen rawset require select setmetatable "
           "tonumber tostring type _VERSION"},
    {"string", "byte char find format gmatch gsub len lower match rep reverse sub upper"},
    {"table", "concat insert move pack remove sort unpack"},
    {"math",
     "abs acos asin atan ceil cos cosh deg exp floor fmod frexp huge ldexp log log10 max maxinteger min "
     "mininteger modf pi pow rad sin sinh sqrt tan tanh tointeger type ult"},
};

enum { LIBRARY_COUNT = sizeof libraries / sizeof *libraries, ENTRIES_MOST = 64 };

/* Functions that do more than one pass over their arguments: `work` returns the steps, and `instead` replaces
 * Lua's function. */
static const struct library_entry {
    const char *library, *name;
    double (*work)(lua_State *L);
    lua_CFunction instead;
} special_entries[] = {
    {"_G", "setmetatable", NULL, script_set_metatable},
    {"_G", "tonumber", text_work, NULL},
    {"_G", "tostring", NULL, to_text},
    {"string", "find", find_work, NULL},
    {"string", "format", format_work, NULL},
    {"string", "gmatch", pattern_work, NULL},
    {"string", "gsub", replace_work, NULL},
    {"string", "lower", text_work, NULL},
    {"string", "match", pattern_work, NULL},
    {"string", "rep", repeat_work, NULL},
    {"string", "reverse", text_work, NULL},
    {"string", "upper", text_work, NULL},
    {"table", "concat", concat_steps, NULL},
    {"table", "insert", shift_steps, NULL},
    {"table", "move", move_steps, NULL},
    {"table", "remove", shift_steps, NULL},
    {"table", "sort", NULL, script_sort_table},
    {"table", "unpack", unpack_steps, NULL},
    {"math", "fmod", remainder_work, NULL},
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

/* A function of numbers would fail on an expression with a message that does not help. Names the one to use.
 */
static void check_expressions(lua_State *L, const struct library_entry *entry) {
    expression e;
    for (int i = 1; i <= lua_gettop(L); i++)
        if (lua_type(L, i) == LUA_TUSERDATA && script_get_expression(L, i, &e))
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
    script_refuse_colon(L, entry->library, entry->name);
    if (takes_numbers(entry))
        check_expressions(L, entry);
    else if (strcmp(entry->library, LUA_TABLIBNAME) == 0)
        check_length(L, entry->name);
    else if (entry->work == format_work)
        check_format(L);
    work_add(work, entry->work ? entry->work(L) : 0);
    if (work_is_over(work))
        return luaL_error(L, "%s: more than the %d million steps that reading a %s may take",
                          full_name(L, entry), work->millions, script_of(L)->noun);
    const int count = lua_tocfunction(L, lua_upvalueindex(2))(L);
    if (count == 1 && strcmp(entry->library, LUA_STRLIBNAME) == 0)
        note_zeros(L);
    return count;
}

static const struct library_entry *find_entry(struct memory *memory, const char *library, const char *name) {
    for (size_t i = 0; i < sizeof special_entries / sizeof *special_entries; i++)
        if (strcmp(special_entries[i].library, library) == 0 && strcmp(special_entries[i].name, name) == 0)
            return &special_entries[i];
    struct library_entry *plain = memory_get(memory, sizeof *plain);
    *plain = (struct library_entry){.library = library, .name = name};
    return plain;
}

/* Lists the names of the entries of a library. */
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

/* ---- unknown names ---- */

/* Upvalue: the library's name. */
static int refuse_library_field(lua_State *L) {
    struct memory *memory = script_of(L)->memory;
    const char *known[ENTRIES_MOST], *of = lua_tostring(L, lua_upvalueindex(1));
    const char *name = lua_type(L, 2) == LUA_TSTRING ? script_name_at(L, 2) : luaL_typename(L, 2);
    const char *nearest = message_nearest_name(name, known, list_library(memory, of, known));
    if (nearest)
        return luaL_error(L, "%s.%s: unknown function; did you mean \"%s\"?", of, name, nearest);
    return luaL_error(L, "%s.%s: unknown function; models/README.md lists the functions", of, name);
}

static int compare_texts(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* Lists the globals that the model has set, sorted, since Lua's order is random. */
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

/* Whether the name is a function or library of Lua that models do not have. */
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

/* What to write in place of a name of other languages or without its prefix, or NULL. */
static const char *meant_global(struct memory *memory, const char *name) {
    static const char *const others[][2] = {
        {"refdyn", "\"refdyn\" in quotation marks"},
        {"rd", "local rd = require \"refdyn\" before it"},
        {"s", "function(s), since s is the argument of a model's functions"},
        {"True", "true"},
        {"False", "false"},
        {"None", "nil"},
        {"null", "nil"},
        {"NULL", "nil"}};
    static const char *const of_state[] = {"t", "q", "qd", "qdd", "points", "axes", "inputs", "start"};
    const char *entries[ENTRIES_MOST];
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (strcmp(name, others[i][0]) == 0)
            return others[i][1];
    if (text_index(name, of_state, sizeof of_state / sizeof *of_state) >= 0)
        return memory_format(memory, "s.%s, a field of the state s", name);
    if (module_has(memory, name) || module_makes(name) || strcmp(name, "pi") == 0)
        return memory_format(memory, "rd.%s", name);
    if (text_index(name, entries, list_library(memory, LUA_MATHLIBNAME, entries)) >= 0)
        return memory_format(memory, "math.%s", name);
    return NULL;
}

int script_refuse_global(lua_State *L) {
    if (lua_type(L, 2) != LUA_TSTRING)
        return luaL_error(L, "undefined global of type %s; must be a name", luaL_typename(L, 2));
    const char *name = script_name_at(L, 2);
    if (is_left_out(name))
        return luaL_error(
            L, "undefined global \"%s\": not available in a %s; models/README.md lists the functions", name,
            script_of(L)->noun);
    const char *meant = meant_global(script_of(L)->memory, name);
    if (meant)
        return luaL_error(L, "undefined global \"%s\"; write %s", name, meant);
    const char *nearest = nearest_global(L, name);
    if (nearest)
        return luaL_error(L, "undefined global \"%s\"; did you mean \"%s\"?", name, nearest);
    return luaL_error(L, "undefined global \"%s\"; set it before it is read", name);
}

void script_push_library(lua_State *L, const char *name) {
    struct memory *memory = script_of(L)->memory;
    const char *entries[ENTRIES_MOST];
    lua_getglobal(L, name);
    lua_newtable(L);
    for (int i = list_library(memory, name, entries) - 1; i >= 0; i--)
        move_entry(L, lua_gettop(L) - 1, lua_gettop(L), find_entry(memory, name, entries[i]));
    lua_pushstring(L, name);
    lua_pushcclosure(L, refuse_library_field, 1);
    script_guard_table(L, name);
    lua_remove(L, -2);
}
