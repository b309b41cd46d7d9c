/* The functions of the module in sweep files: see script_state.h. Each gives a list of its arguments, with
 * its name as tag. */
#include "gen/read/script_state.h"
#include "gen/read/read.h"
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <string.h>

static const struct {
    const char *name, *arguments, *names;
    int count;
} functions[] = {
    {"grid", "from, to and the number of points", "from, to, count", 3},
    {"log_grid", "from, to and the number of points", "from, to, count", 3},
    {"uniform", "from and to", "from, to", 2},
    {"log_uniform", "from and to", "from, to", 2},
    {"normal", "mean and standard deviation", "mean, deviation", 2},
};

enum { FUNCTION_COUNT = sizeof functions / sizeof *functions };

/* Upvalue: number of the function. */
static int list_arguments(lua_State *L) {
    const int function = (int)lua_tointeger(L, lua_upvalueindex(1)), count = functions[function].count;
    const char *name = functions[function].name;
    script_refuse_colon(L, "rd", name);
    if (lua_gettop(L) != count)
        return luaL_error(L, "rd.%s: number of arguments is %d, %d are needed: %s", name, lua_gettop(L),
                          count, functions[function].arguments);
    for (int i = 1; i <= count; i++)
        if (lua_type(L, i) != LUA_TNUMBER)
            return luaL_error(L, "rd.%s: argument %d is of type %s, a number is needed", name, i,
                              luaL_typename(L, i));
    lua_createtable(L, count, 0);
    for (int i = 1; i <= count; i++) {
        lua_pushvalue(L, i);
        lua_rawseti(L, -2, i);
    }
    lua_pushstring(L, name);
    script_set_note(L, script_of(L)->tags, -2);
    return 1;
}

void script_add_sweep_functions(lua_State *L) {
    for (int i = 0; i < FUNCTION_COUNT; i++) {
        lua_pushinteger(L, i);
        lua_pushcclosure(L, list_arguments, 1);
        lua_setfield(L, -2, functions[i].name);
    }
}

/* Names of all that rd has in a sweep file; there is room for FUNCTION_COUNT + 2. */
static int list_names(const char **names) {
    int count = 0;
    names[count++] = SWEEP_TAG;
    for (int i = 0; i < FUNCTION_COUNT; i++)
        names[count++] = functions[i].name;
    names[count++] = "pi";
    return count;
}

bool script_is_of_sweeps(const char *name) {
    const char *names[FUNCTION_COUNT + 2];
    return text_index(name, names, list_names(names) - 1) >= 0;
}

const char *script_unknown_in_sweep(struct memory *memory, const char *name) {
    const char *names[FUNCTION_COUNT + 2], *all = "";
    const int count = list_names(names);
    const char *nearest = message_nearest_name(name, names, count);
    for (int i = 0; i < count; i++)
        all = memory_format(memory, "%s%s rd.%s", all, i ? "," : "", names[i]);
    if (module_has(memory, name) || module_makes(name))
        return memory_format(memory, "rd.%s: of model files, a sweep file has%s", name, all);
    if (nearest)
        return memory_format(memory, "rd.%s: unknown function, the nearest known one is \"%s\"", name,
                             nearest);
    return memory_format(memory, "rd.%s: unknown function, a sweep file has%s", name, all);
}

const char *sweep_file_function(int number, const char **arguments) {
    if (number < 0 || number >= FUNCTION_COUNT)
        return NULL;
    *arguments = functions[number].names;
    return functions[number].name;
}
