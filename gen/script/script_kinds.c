/*
 * Kinds of files in Lua, and the functions that `rd` has in sweep, fit and plan files. Each returns the list
 * of its arguments with its name as tag.
 */
#include "gen/script/source.h"
#include "gen/script/script_state.h"

#include <string.h>

struct function {
    const char *name, *arguments, *names;
    const char *types; /* of the arguments: n number, t text, b table; those after | may be omitted */
};

static const struct function sweep_functions[] = {
    {"grid", "from, to and the number of points", "from, to, count", "nnn"},
    {"log_grid", "from, to and the number of points", "from, to, count", "nnn"},
    {"uniform", "from and to", "from, to", "nn"},
    {"log_uniform", "from and to", "from, to", "nn"},
    {"normal", "mean and standard deviation", "mean, deviation", "nn"},
};
static const struct function fit_functions[] = {
    {"free", "none", "", ""},
    {"within", "from and to, and optionally the start", "from, to, start", "nn|n"},
};
static const struct function plan_functions[] = {
    {"within", "from and to, and optionally the start", "from, to, start", "nn|n"},
    {"at_end", "a column, and optionally bounds such as { to = 0.01 }", "column, bounds", "t|b"},
    {"integral", "a column", "column", "t"},
    {"largest", "a column", "column", "t"},
};

#define COUNT(list) (int)(sizeof(list) / sizeof *(list))
enum { FUNCTIONS_MOST = 5 };

static const struct kind {
    const char *noun; /* the word for the file in messages */
    const char *tag;  /* the function that makes the result; NULL: model files have functions of their own */
    const char *form; /* example of its argument */
    const char *command; /* that runs the file */
    const struct function *functions;
    int count;
} kinds[] = {
    [FILE_MODEL] = {.noun = "model"},
    [FILE_SWEEP] = {"sweep", "sweep", "{ vary = { m = rd.grid(1, 3, 5) }, t_end = 10 }",
                    "refdyn batch MODEL.lua SWEEP.lua", sweep_functions, COUNT(sweep_functions)},
    [FILE_FIT] = {"fit", "fit",
                  "{ vary = { m = rd.free() }, noise = { psi = 1e-3 }, data = { \"run.csv\" } }",
                  "refdyn fit MODEL.lua FIT.lua", fit_functions, COUNT(fit_functions)},
    [FILE_PLAN] = {"plan", "plan", "{ vary = { T = rd.within(0.5, 2) }, t_end = \"T\", minimise = \"T\" }",
                   "refdyn plan MODEL.lua PLAN.lua", plan_functions, COUNT(plan_functions)},
};

const char *script_kind_noun(enum file_kind kind) {
    return kinds[kind].noun;
}

const char *script_kind_tag(enum file_kind kind) {
    return kinds[kind].tag;
}

const char *script_kind_form(const char *tag) {
    for (int i = 0; i < COUNT(kinds); i++)
        if (kinds[i].tag && strcmp(kinds[i].tag, tag) == 0)
            return kinds[i].form;
    return NULL;
}

static const char *type_text(char type) {
    return type == 'n' ? "a number" : type == 't' ? "a text" : "a table";
}

static bool is_of_type(lua_State *L, int index, char type) {
    return lua_type(L, index) == (type == 'n' ? LUA_TNUMBER : type == 't' ? LUA_TSTRING : LUA_TTABLE);
}

/* Upvalue: the function. */
static int list_arguments(lua_State *L) {
    const struct function *function = lua_touserdata(L, lua_upvalueindex(1));
    const char *types = function->types;
    const int count = lua_gettop(L), least = (int)strcspn(types, "|"),
              most = (int)strlen(types) - (types[least] == '|');
    script_refuse_colon(L, "rd", function->name);
    if (count < least || count > most)
        return luaL_error(L, "rd.%s: %d argument%s; must have %s%d: %s", function->name, count,
                          count == 1 ? "" : "s",
                          least < most ? memory_format(script_of(L)->memory, "%d or ", least) : "", most,
                          function->arguments);
    for (int i = 1; i <= count; i++) {
        const char type = types[i <= least ? i - 1 : i];
        if (!is_of_type(L, i, type))
            return luaL_error(L, "rd.%s: argument %d is of type %s; must be %s", function->name, i,
                              luaL_typename(L, i), type_text(type));
    }
    lua_createtable(L, count, 0);
    for (int i = 1; i <= count; i++) {
        lua_pushvalue(L, i);
        lua_rawseti(L, -2, i);
    }
    lua_pushstring(L, function->name);
    script_set_note(L, script_of(L)->tags, -2);
    return 1;
}

void script_add_kind_functions(lua_State *L) {
    const struct kind *kind = &kinds[script_of(L)->kind];
    for (int i = 0; i < kind->count; i++) {
        lua_pushlightuserdata(L, (void *)&kind->functions[i]);
        lua_pushcclosure(L, list_arguments, 1);
        lua_setfield(L, -2, kind->functions[i].name);
    }
}

/* Lists the names that rd has in files of this kind, at most FUNCTIONS_MOST + 2. */
static int list_names(const struct kind *kind, const char **names) {
    int count = 0;
    names[count++] = kind->tag;
    for (int i = 0; i < kind->count; i++)
        names[count++] = kind->functions[i].name;
    names[count++] = "pi";
    return count;
}

/* The kind of file, other than a model and `own`, in which rd has a function of this name; NULL: none. */
static const struct kind *find_kind(const struct kind *own, const char *name) {
    const char *names[FUNCTIONS_MOST + 2];
    for (int i = 0; i < COUNT(kinds); i++)
        if (kinds[i].tag && &kinds[i] != own &&
            text_index(name, names, list_names(&kinds[i], names) - 1) >= 0)
            return &kinds[i];
    return NULL;
}

const char *script_unknown_field(struct script *script, const char *name) {
    const char *names[FUNCTIONS_MOST + 2];
    struct memory *memory = script->memory;
    const struct kind *own = &kinds[script->kind], *other = find_kind(own, name);
    if (!own->tag && !other)
        return module_unknown(memory, name);
    if (!own->tag)
        return memory_format(memory, "rd.%s: belongs to %s files; run them by %s", name, other->noun,
                             other->command);
    const int count = list_names(own, names);
    if (other || module_has(memory, name) || module_makes(name))
        return memory_format(memory, "rd.%s: belongs to %s files; in a %s use one of %s", name,
                             other ? other->noun : kinds[FILE_MODEL].noun, own->noun,
                             message_names(memory, names, count));
    return memory_format(memory, "rd.%s: unknown function%s", name,
                         message_advice_on_name(memory, name, names, count));
}

const char *script_kind_function(enum file_kind kind, int number, const char **arguments) {
    if (number < 0 || number >= kinds[kind].count)
        return NULL;
    *arguments = kinds[kind].functions[number].names;
    return kinds[kind].functions[number].name;
}
