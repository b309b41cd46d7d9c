/*
 * modelDescription.xml: the part that FMI 2.0 and FMI 3.0 have in common. The other parts are in
 * model_description_fmi2.c and model_description_fmi3.c.
 *
 * From the catalogue of variables come the unit definitions, the default experiment, the log categories and
 * the dependencies of unknowns. A unit is a text such as "N s/m": symbols of the SI with their prefixes,
 * between them blanks, '*' or '.', with whole powers after '^' or directly; each '/' divides by what follows
 * it up to the next one.
 */
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/support/format/format.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Units ---- */

enum { BASE_UNIT_COUNT = 8 };

static const char *const base_unit_names[BASE_UNIT_COUNT] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

struct base_unit {
    double factor; /* one unit in base units */
    int exponents[BASE_UNIT_COUNT];
};

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

/* Finds the symbol, and the factor of its prefix; NULL if there is none. */
static const struct unit_symbol *find_prefixed(const char *name, size_t length, double *factor) {
    const struct unit_symbol *symbol = find_symbol(name, length);
    *factor = 1;
    for (int i = 0; i < PREFIXES && !symbol && length > 1; i++) {
        const struct unit_symbol *behind =
            prefixes[i].letter == *name ? find_symbol(name + 1, length - 1) : NULL;
        if (behind && behind->takes_prefix) {
            symbol = behind;
            *factor = prefixes[i].factor;
        }
    }
    return symbol;
}

/* Reads one symbol with its power at *at and advances *at. sign -1: it divides. */
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

/* Returns false if a part of the text is no known unit. */
static bool unit_in_base(const char *unit, struct base_unit *base) {
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

/* ---- Parts of both versions ---- */

enum { DEFAULT_STEPS = 200 };

const char *const causality_names[] = {"independent", "parameter", "input", "output", "local"};
const char *const variability_names[] = {"fixed", "tunable", "discrete", "continuous"};
const char *const initial_names[] = {NULL, "exact", "approx", "calculated"};

void export_put_attribute(FILE *out, const char *name, const char *value) {
    fprintf(out, " %s=\"", name);
    format_xml_text(out, value);
    fputc('"', out);
}

void export_put_number_attribute(FILE *out, const char *name, double value) {
    fprintf(out, " %s=\"", name);
    format_number(out, value);
    fputc('"', out);
}

static void put_base_unit(FILE *out, const char *unit) {
    struct base_unit base;
    if (!unit_in_base(unit, &base)) {
        fputs("/>\n", out);
        return;
    }
    fputs("><BaseUnit", out);
    for (int i = 0; i < BASE_UNIT_COUNT; i++)
        if (base.exponents[i])
            fprintf(out, " %s=\"%d\"", base_unit_names[i], base.exponents[i]);
    if (base.factor != 1)
        export_put_number_attribute(out, "factor", base.factor);
    fputs("/></Unit>\n", out);
}

/* Returns whether an earlier entry has the same unit. */
static bool is_told(const struct catalogue *catalogue, int entry) {
    for (int i = 0; i < entry; i++)
        if (catalogue->entries[i].unit &&
            strcmp(catalogue->entries[i].unit, catalogue->entries[entry].unit) == 0)
            return true;
    return false;
}

void export_description_put_units(FILE *out, const struct fmu *fmu) {
    const struct catalogue *catalogue = &fmu->catalogue;
    fputs("  <UnitDefinitions>\n", out);
    for (int i = 0; i < catalogue->count; i++) {
        const char *unit = catalogue->entries[i].unit;
        if (!unit || is_told(catalogue, i))
            continue;
        fputs("    <Unit", out);
        export_put_attribute(out, "name", unit);
        put_base_unit(out, unit);
    }
    fputs("  </UnitDefinitions>\n", out);
}

/* ---- Experiment, messages ---- */

void export_description_put_experiment(FILE *out, const struct fmu *fmu) {
    const double from = fmu->scene->state.t;
    fputs("  <DefaultExperiment", out);
    export_put_number_attribute(out, "startTime", from);
    export_put_number_attribute(out, "stopTime", fmu->until);
    if (fmu->options.tol > 0)
        export_put_number_attribute(out, "tolerance", fmu->options.tol);
    export_put_number_attribute(out, "stepSize", (fmu->until - from) / DEFAULT_STEPS);
    fputs("/>\n", out);
}

void export_description_put_categories(FILE *out) {
    static const char *const names[] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                        "logStatusFatal", "logAll"};
    fputs("  <LogCategories>\n", out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(out, "    <Category name=\"%s\"/>\n", names[i]);
    fputs("  </LogCategories>\n", out);
}

/* ---- Variables ---- */

bool export_catalogue_has_start(const struct catalogue_entry *entry) {
    return entry->initial == INITIAL_EXACT || entry->initial == INITIAL_APPROXIMATE;
}

bool export_catalogue_is_output(const struct catalogue_entry *entry) {
    return entry->causality == AS_OUTPUT;
}

bool export_catalogue_is_derivative(const struct catalogue_entry *entry) {
    return entry->state >= 0;
}

bool export_catalogue_is_unknown_at_start(const struct catalogue_entry *entry) {
    const bool is_free = entry->initial == INITIAL_CALCULATED || entry->initial == INITIAL_APPROXIMATE;
    return is_free && (entry->causality == AS_OUTPUT || entry->state >= 0);
}

/* ---- Dependencies ---- */

/* The list of variables that an unknown depends on. */
struct dependencies {
    FILE *out;
    char *places, *kinds;
    FILE *kinds_out;
    size_t places_size, kinds_size;
};

static void dependencies_open(struct dependencies *list) {
    list->out = format_stream(&list->places, &list->places_size);
    list->kinds_out = format_stream(&list->kinds, &list->kinds_size);
}

/* FMI 2.0 refers to variables by their place, FMI 3.0 by their value reference. */
static void dependencies_add(struct dependencies *list, const struct fmu *fmu, int entry, const char *kind) {
    const unsigned known =
        fmu->version == FMI_2 ? (unsigned)entry + 1 : fmu->catalogue.entries[entry].reference;
    fprintf(list->out, "%s%u", ftell(list->out) > 0 ? " " : "", known);
    fprintf(list->kinds_out, "%s%s", ftell(list->kinds_out) > 0 ? " " : "", kind);
}

static void dependencies_put(struct dependencies *list, FILE *out) {
    fclose(list->out);
    fclose(list->kinds_out);
    export_put_attribute(out, "dependencies", list->places);
    export_put_attribute(out, "dependenciesKind", list->kinds);
    free(list->places);
    free(list->kinds);
}

static void add_position_dependencies(struct dependencies *list, const struct fmu *fmu, const bool *depends,
                                      const struct catalogue_entry *entry) {
    const int n = fmu->scene->model->n, row = entry->variable.index;
    for (int kind = FMU_COORDINATE; kind <= FMU_RATE; kind++)
        for (int j = 0; j < n; j++)
            if (depends[row * n + j] && (kind == FMU_COORDINATE || entry->variable.kind == FMU_VELOCITY))
                dependencies_add(list, fmu, fmu->catalogue.first[kind] + j, "dependent");
}

void export_description_put_dependencies(FILE *out, const struct fmu *fmu, const bool *depends,
                                         const struct catalogue_entry *entry) {
    struct dependencies list;
    const enum fmu_kind kind = entry->variable.kind;
    const bool is_state = kind == FMU_COORDINATE || kind == FMU_RATE;
    const bool is_point = kind == FMU_POSITION || kind == FMU_VELOCITY;
    if (!is_state && !is_point && kind != FMU_COORDINATE_CHANGE)
        return;
    dependencies_open(&list);
    if (is_point)
        add_position_dependencies(&list, fmu, depends, entry);
    else
        dependencies_add(&list, fmu, fmu->catalogue.first[is_state ? kind : FMU_RATE] + entry->variable.index,
                         is_state ? "dependent" : "constant");
    dependencies_put(&list, out);
}
