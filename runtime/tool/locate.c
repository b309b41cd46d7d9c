/* Lines in a JSON text: see locate.h. One walk over the letters with the depth and the key at depth 1. */
#include "locate.h"

#include <stdbool.h>
#include <string.h>

struct walk {
    const char *at;
    int line, depth;
    bool is_inside; /* in the value of the wanted key */
    int element;    /* of the array at depth 2 */
};

static const char *end_of_string(const char *quote) {
    const char *at = quote + 1;
    while (*at && *at != '"')
        at += *at == '\\' && at[1] ? 2 : 1;
    return at;
}

/* Whether the string at `quote` is this key of an object. */
static bool is_key(const char *quote, const char *key) {
    const char *end = end_of_string(quote);
    size_t length = (size_t)(end - quote) - 1;
    if (strlen(key) != length || strncmp(quote + 1, key, length) != 0 || !*end)
        return false;
    return end[1 + strspn(end + 1, " \t\r\n")] == ':';
}

static bool at_string(struct walk *walk, const char *key, const char *member, int index) {
    if (walk->depth == 1) {
        walk->is_inside = is_key(walk->at, key) || (walk->is_inside && !is_key(walk->at, key));
        if (walk->is_inside && !member && index < 0)
            return true;
    }
    bool found = walk->depth == 2 && walk->is_inside && member && is_key(walk->at, member);
    if (!found)
        walk->at = end_of_string(walk->at);
    return found;
}

static void step(struct walk *walk) {
    char c = *walk->at;
    walk->line += c == '\n';
    walk->depth += (c == '{' || c == '[') - (c == '}' || c == ']');
    if (c == ',' && walk->depth == 2)
        walk->element++;
    if (walk->depth == 1) {
        walk->element = 0;
        if (c == ',')
            walk->is_inside = false;
    }
}

int locate_line(const char *text, const char *key, const char *member, int index) {
    struct walk walk = {.at = text, .line = 1};
    for (; *walk.at; walk.at++) {
        if (*walk.at == '"' && at_string(&walk, key, member, index))
            return walk.line;
        bool is_value = !strchr(" \t\r\n[,", *walk.at);
        if (index >= 0 && walk.is_inside && walk.depth == 2 && walk.element == index && is_value)
            return walk.line;
        step(&walk);
    }
    return 1;
}
