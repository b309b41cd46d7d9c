/*
 * Units: see export.h. Symbols of the SI with their prefixes, apart by blanks, '*' or '.', with whole powers
 * behind '^' or at once; each '/' divides by what follows it up to the next one.
 */
#include "runtime/tool/commands/export/export.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const base_unit_names[BASE_UNIT_COUNT] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

struct unit_symbol {
    const char *name;
    double factor;
    int exponents[BASE_UNIT_COUNT];
    bool takes_prefix;
};

static const struct unit_symbol symbols[] = {
    {"kg", 1, {1}, false},
    {"m", 1, {0, 1}, true},
    {"s", 1, {0, 0, 1}, true},
    {"A", 1, {0, 0, 0, 1}, true},
    {"K", 1, {0, 0, 0, 0, 1}, true},
    {"mol", 1, {0, 0, 0, 0, 0, 1}, true},
    {"cd", 1, {0, 0, 0, 0, 0, 0, 1}, true},
    {"rad", 1, {0, 0, 0, 0, 0, 0, 0, 1}, true},
    {"deg", 0.017453292519943295, {0, 0, 0, 0, 0, 0, 0, 1}, false},
    {"g", 1e-3, {1}, true},
    {"t", 1e3, {1}, false},
    {"min", 60, {0, 0, 1}, false},
    {"h", 3600, {0, 0, 1}, false},
    {"Hz", 1, {0, 0, -1}, true},
    {"N", 1, {1, 1, -2}, true},
    {"Pa", 1, {1, -1, -2}, true},
    {"bar", 1e5, {1, -1, -2}, true},
    {"J", 1, {1, 2, -2}, true},
    {"W", 1, {1, 2, -3}, true},
    {"C", 1, {0, 0, 1, 1}, true},
    {"V", 1, {1, 2, -3, -1}, true},
    {"Ohm", 1, {1, 2, -3, -2}, true},
    {"F", 1, {-1, -2, 4, 2}, true},
    {"H", 1, {1, 2, -2, -2}, true},
    {"Wb", 1, {1, 2, -2, -1}, true},
    {"T", 1, {1, 0, -2, -1}, true},
    {"l", 1e-3, {0, 3}, true},
    {"1", 1, {0}, false},
    {"-", 1, {0}, false},
    {"%", 1e-2, {0}, false},
};

static const struct {
    char letter;
    double factor;
} prefixes[] = {{'n', 1e-9}, {'u', 1e-6}, {'m', 1e-3}, {'c', 1e-2}, {'d', 1e-1},
                {'h', 1e2},  {'k', 1e3},  {'M', 1e6},  {'G', 1e9}};

enum { SYMBOLS = sizeof symbols / sizeof *symbols, PREFIXES = sizeof prefixes / sizeof *prefixes };

static const struct unit_symbol *find_symbol(const char *name, size_t length) {
    for (int i = 0; i < SYMBOLS; i++)
        if (strlen(symbols[i].name) == length && strncmp(symbols[i].name, name, length) == 0)
            return &symbols[i];
    return NULL;
}

/* The symbol with the factor of its prefix; NULL: it is none. */
static const struct unit_symbol *find_prefixed(const char *name, size_t length, double *factor) {
    const struct unit_symbol *symbol = find_symbol(name, length);
    *factor = 1;
    for (int i = 0; i < PREFIXES && !symbol && length > 1; i++) {
        const struct unit_symbol *behind = prefixes[i].letter == *name ? find_symbol(name + 1, length - 1) : NULL;
        if (behind && behind->takes_prefix) {
            symbol = behind;
            *factor = prefixes[i].factor;
        }
    }
    return symbol;
}

/* One symbol with its power at *at, which then stands behind it; sign -1: it divides. */
static bool take_symbol(const char **at, int sign, struct base_unit *base) {
    const char *name = *at;
    size_t length = 0;
    double prefix;
    while (isalpha((unsigned char)name[length]) || (length == 0 && strchr("1-%", *name)))
        length++;
    const struct unit_symbol *symbol = find_prefixed(name, length, &prefix);
    if (!symbol)
        return false;
    char *end = (char *)name + length;
    long power = 1;
    if (*end == '^' || (isdigit((unsigned char)*end) && *name != '1')) {
        const char *digits = *end == '^' ? end + 1 : end;
        power = strtol(digits, &end, 10);
        if (end == digits || labs(power) > 9)
            return false;
    }
    base->factor *= pow(prefix * symbol->factor, (double)(sign * power));
    for (int i = 0; i < BASE_UNIT_COUNT; i++)
        base->exponents[i] += sign * (int)power * symbol->exponents[i];
    *at = end;
    return true;
}

bool unit_in_base(const char *unit, struct base_unit *base) {
    int sign = 1;
    *base = (struct base_unit){.factor = 1};
    for (const char *at = unit; *at;) {
        if (*at == '/')
            sign = -1;
        if (strchr(" */.", *at))
            at++;
        else if (!take_symbol(&at, sign, base))
            return false;
    }
    return *unit != '\0';
}
