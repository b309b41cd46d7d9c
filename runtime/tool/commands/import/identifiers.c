/* Turns names of a URDF file into identifiers of Lua and C. A valid name stays. In other names _ replaces
 * each character that is not allowed; a lead goes in front if the result is still no identifier; the number
 * of the entry follows a name that is taken. The generator decides which names C allows. */
#include "runtime/tool/commands/import/import.h"
#include "gen/base/base.h"
#include "gen/language/values.h"
#include "runtime/tool/support/format/format.h"

#include <ctype.h>
#include <string.h>

enum { LONGEST = 100 };

static const char *const lua_words[] = {
    "and",   "break", "do",  "else", "elseif", "end",    "false", "for",  "function", "goto",  "if",    "in",
    "local", "nil",   "not", "or",   "repeat", "return", "then",  "true", "until",    "while", "ground"};

static bool is_free(const char *name, bool is_of_model) {
    struct messages messages = {.memory = &format_memory};
    const struct named named = {name, {"", 0}};
    if (strlen(name) > LONGEST || text_index(name, lua_words, sizeof lua_words / sizeof *lua_words) >= 0)
        return false;
    if (is_of_model)
        names_check_model(&messages, named);
    else
        names_check(&messages, "link", &named, 1);
    return messages.errors == 0;
}

bool import_identifiers_is_free(const char *name) {
    return is_free(name, false);
}

/* Replaces each character that an identifier cannot have by _. */
static char *with_letters(const char *name) {
    char *made = format_allocate(LONGEST + 1, 1);
    for (int i = 0; *name && i < LONGEST; i++) {
        const unsigned long point = format_utf8_next(&name);
        made[i] = point < 0x80 && isalnum((int)point) ? (char)point : '_';
    }
    return made;
}

static const char *made_of(const char *name, const char *lead, bool is_of_model) {
    const char *made = is_free(name, is_of_model) ? name : with_letters(name);
    return is_free(made, is_of_model) ? made : format_text("%.20s_%.70s", lead, made);
}

const char **import_identifiers_make(const char *const *names, int count, const char *lead) {
    const char **made = format_allocate((size_t)count + 1, sizeof *made);
    for (int i = 0; i < count; i++)
        if (is_free(names[i], false))
            made[i] = names[i];
        else
            made[i] = "";
    for (int i = 0; i < count; i++) {
        const char *name = *made[i] ? made[i] : made_of(names[i], lead, false);
        while (!*made[i] && text_index(name, made, count) >= 0)
            name = format_text("%.90s_%d", name, i + 1);
        made[i] = name;
    }
    return made;
}

const char *import_identifiers_model(const char *name) {
    return made_of(name, "robot", true);
}
