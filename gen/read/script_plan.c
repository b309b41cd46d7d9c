/* The functions of `rd` in plan files. Each returns the list of its arguments with its name as tag. */
#include "gen/read/reader.h"
#include "gen/read/script_state.h"

#include <string.h>

static const struct {
    const char *name, *form;
    const char *types; /* of the arguments: n number, t text, b table; those after | may be omitted */
} functions[] = {
    {"within", "rd.within(0.5, 2) or, with a start, rd.within(0.5, 2, 1)", "nn|n"},
    {"at_end", "rd.at_end(\"E_z\", { to = 0.01 })", "t|b"},
    {"integral", "rd.integral(\"power\")", "t"},
    {"largest", "rd.largest(\"E_z\")", "t"},
};

enum { FUNCTION_COUNT = sizeof functions / sizeof *functions };

static const char *type_text(char type) {
    return type == 'n' ? "a number" : type == 't' ? "a text" : "a table";
}

static bool is_of_type(lua_State *L, int index, char type) {
    const int found = lua_type(L, index);
    return found == (type == 'n' ? LUA_TNUMBER : type == 't' ? LUA_TSTRING : LUA_TTABLE);
}

/* Upvalue: number of the function. */
static int list_arguments(lua_State *L) {
    const int function = (int)lua_tointeger(L, lua_upvalueindex(1));
    const char *name = functions[function].name, *types = functions[function].types;
    const int count = lua_gettop(L), least = (int)strcspn(types, "|"),
              most = (int)strlen(types) - (types[least] == '|');
    script_refuse_colon(L, "rd", name);
    if (count < least || count > most)
        return luaL_error(L, "rd.%s: %d argument%s; must be as in %s", name, count, count == 1 ? "" : "s",
                          functions[function].form);
    for (int i = 0; i < count; i++) {
        const char type = types[i < least ? i : i + 1];
        if (!is_of_type(L, i + 1, type))
            return luaL_error(L, "rd.%s: argument %d is of type %s; must be %s, as in %s", name, i + 1,
                              luaL_typename(L, i + 1), type_text(type), functions[function].form);
    }
    lua_createtable(L, count, 0);
    for (int i = 1; i <= count; i++) {
        lua_pushvalue(L, i);
        lua_rawseti(L, -2, i);
    }
    lua_pushstring(L, name);
    script_set_note(L, script_of(L)->tags, -2);
    return 1;
}

void script_add_plan_functions(lua_State *L) {
    for (int i = 0; i < FUNCTION_COUNT; i++) {
        lua_pushinteger(L, i);
        lua_pushcclosure(L, list_arguments, 1);
        lua_setfield(L, -2, functions[i].name);
    }
}

/* Lists the names that rd has in a plan file, at most FUNCTION_COUNT + 2. */
static int list_names(const char **names) {
    int count = 0;
    names[count++] = PLAN_TAG;
    for (int i = 0; i < FUNCTION_COUNT; i++)
        names[count++] = functions[i].name;
    names[count++] = "pi";
    return count;
}

bool script_is_of_plans(const char *name) {
    const char *names[FUNCTION_COUNT + 2];
    return text_index(name, names, list_names(names) - 1) >= 0;
}

const char *script_unknown_in_plan(struct memory *memory, const char *name) {
    const char *names[FUNCTION_COUNT + 2];
    const int count = list_names(names);
    if (module_has(memory, name) || module_makes(name))
        return memory_format(memory, "rd.%s: belongs to model files; in a plan use one of %s", name,
                             message_names(memory, names, count));
    return memory_format(memory, "rd.%s: unknown function%s", name,
                         message_advice_on_name(memory, name, names, count));
}
