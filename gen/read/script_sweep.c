/* The functions of `rd` in sweep files. Each returns the list of its arguments with its name as tag. */
#include "gen/read/reader.h"
#include "gen/read/script_state.h"

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
        return luaL_error(L, "rd.%s: %d argument%s; must have %d: %s", name, lua_gettop(L),
                          lua_gettop(L) == 1 ? "" : "s", count, functions[function].arguments);
    for (int i = 1; i <= count; i++)
        if (lua_type(L, i) != LUA_TNUMBER)
            return luaL_error(L, "rd.%s: argument %d is of type %s; must be a number", name, i,
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

/* Lists the names that rd has in a sweep file, at most FUNCTION_COUNT + 2. */
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
    const char *names[FUNCTION_COUNT + 2];
    const int count = list_names(names);
    if (module_has(memory, name) || module_makes(name))
        return memory_format(memory, "rd.%s: belongs to model files; in a sweep use one of %s", name,
                             message_names(memory, names, count));
    return memory_format(memory, "rd.%s: unknown function%s", name,
                         message_advice_on_name(memory, name, names, count));
}

const char *sweep_file_function(int number, const char **arguments) {
    if (number < 0 || number >= FUNCTION_COUNT)
        return NULL;
    *arguments = functions[number].names;
    return functions[number].name;
}
