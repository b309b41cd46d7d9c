/*
 * modelDescription.xml of FMI 2.0 (FMI 2.0.5, ch. 2.2) and of FMI 3.0 (FMI 3.0.2, ch. 2.4), and
 * buildDescription.xml (ch. 2.5).
 *
 * From the catalogue of variables come the unit definitions, the default experiment, the log categories and
 * the dependencies of unknowns. A unit is a text such as "N s/m": symbols of the SI with their prefixes,
 * between them blanks, '*' or '.', with whole powers after '^' or directly; each '/' divides by what follows
 * it up to the next one.
 */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "refdyn.h"
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/support/format/format.h"

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

static const char *const causality_names[] = {"independent", "parameter", "input", "output", "local"};
static const char *const variability_names[] = {"fixed", "tunable", "discrete", "continuous"};
static const char *const initial_names[] = {NULL, "exact", "approx", "calculated"};

static void put_attribute(FILE *out, const char *name, const char *value) {
    fprintf(out, " %s=\"", name);
    format_xml_text(out, value);
    fputc('"', out);
}

static void put_number_attribute(FILE *out, const char *name, double value) {
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
        put_number_attribute(out, "factor", base.factor);
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

static void put_units(FILE *out, const struct fmu *fmu) {
    const struct catalogue *catalogue = &fmu->catalogue;
    fputs("  <UnitDefinitions>\n", out);
    for (int i = 0; i < catalogue->count; i++) {
        const char *unit = catalogue->entries[i].unit;
        if (!unit || is_told(catalogue, i))
            continue;
        fputs("    <Unit", out);
        put_attribute(out, "name", unit);
        put_base_unit(out, unit);
    }
    fputs("  </UnitDefinitions>\n", out);
}

/* ---- Experiment, messages ---- */

static void put_experiment(FILE *out, const struct fmu *fmu) {
    const double from = fmu->scene->state.t;
    fputs("  <DefaultExperiment", out);
    put_number_attribute(out, "startTime", from);
    put_number_attribute(out, "stopTime", fmu->until);
    if (fmu->options.tol > 0)
        put_number_attribute(out, "tolerance", fmu->options.tol);
    put_number_attribute(out, "stepSize", (fmu->until - from) / DEFAULT_STEPS);
    fputs("/>\n", out);
}

static void put_categories(FILE *out) {
    static const char *const names[] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                        "logStatusFatal", "logAll"};
    fputs("  <LogCategories>\n", out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(out, "    <Category name=\"%s\"/>\n", names[i]);
    fputs("  </LogCategories>\n", out);
}

/* ---- Variables ---- */

static bool has_start(const struct catalogue_entry *entry) {
    return entry->initial == INITIAL_EXACT || entry->initial == INITIAL_APPROXIMATE;
}

static bool is_output(const struct catalogue_entry *entry) {
    return entry->causality == AS_OUTPUT;
}

static bool is_derivative(const struct catalogue_entry *entry) {
    return entry->state >= 0;
}

static bool is_unknown_at_start(const struct catalogue_entry *entry) {
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
    put_attribute(out, "dependencies", list->places);
    put_attribute(out, "dependenciesKind", list->kinds);
    free(list->places);
    free(list->kinds);
}

static void add_position_dependencies(struct dependencies *list, const struct fmu *fmu, const bool *depends,
                                      const struct catalogue_entry *entry) {
    const int n = fmu->scene->model->n, joints = refdyn_joint_count(fmu->scene->model),
              row = entry->variable.index;
    for (int kind = FMU_COORDINATE; kind <= FMU_RATE; kind++)
        for (int j = 0; j < joints; j++)
            if (depends[row * n + j] && (kind == FMU_COORDINATE || entry->variable.kind == FMU_VELOCITY))
                dependencies_add(list, fmu, fmu->catalogue.first[kind] + j, "dependent");
}

static void put_dependencies(FILE *out, const struct fmu *fmu, const bool *depends,
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

/* modelDescription.xml of FMI 2.0 (FMI 2.0.5, ch. 2.2). Other elements refer to variables by their place. */

static void put_source_files(FILE *out, const struct fmu *fmu) {
    fputs("    <SourceFiles>\n", out);
    for (int i = 0; i < fmu->sources.count; i++) {
        if (!export_is_source(fmu->sources.list[i].path))
            continue;
        fputs("      <File", out);
        put_attribute(out, "name", fmu->sources.list[i].path);
        fputs("/>\n", out);
    }
    fputs("    </SourceFiles>\n", out);
}

static void put_type_2(FILE *out, const struct fmu *fmu, const char *type, const char *abilities) {
    fprintf(out, "  <%s", type);
    put_attribute(out, "modelIdentifier", fmu->name);
    fputs(abilities, out);
    fputs(" canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\"", out);
    if (!fmu->why_no_derivatives)
        fputs(" providesDirectionalDerivative=\"true\"", out);
    fputs(">\n", out);
    put_source_files(out, fmu);
    fprintf(out, "  </%s>\n", type);
}

/* ---- Variables ---- */

/* Inputs have a start value, and no `initial`. */
static void put_variable_2(FILE *out, const struct catalogue_entry *entry) {
    fputs("    <ScalarVariable", out);
    put_attribute(out, "name", entry->name);
    fprintf(out, " valueReference=\"%u\"", entry->reference);
    put_attribute(out, "description", entry->about);
    put_attribute(out, "causality", causality_names[entry->causality]);
    put_attribute(out, "variability", variability_names[entry->variability]);
    if (entry->causality != AS_INPUT && initial_names[entry->initial])
        put_attribute(out, "initial", initial_names[entry->initial]);
    fputs(">\n      <Real", out);
    if (entry->unit)
        put_attribute(out, "unit", entry->unit);
    if (has_start(entry))
        put_number_attribute(out, "start", entry->start);
    if (entry->state >= 0)
        fprintf(out, " derivative=\"%d\"", entry->state + 1);
    fputs("/>\n    </ScalarVariable>\n", out);
}

/* ---- Structure ---- */

/* If `depends` is NULL, dependencies are left out. */
static void put_unknowns_2(FILE *out, const struct fmu *fmu, const char *list,
                           bool (*is_one)(const struct catalogue_entry *entry), const bool *depends) {
    fprintf(out, "    <%s>\n", list);
    for (int i = 0; i < fmu->catalogue.count; i++) {
        const struct catalogue_entry *entry = &fmu->catalogue.entries[i];
        if (!is_one(entry))
            continue;
        fprintf(out, "      <Unknown index=\"%d\"", i + 1);
        if (depends)
            put_dependencies(out, fmu, depends, entry);
        fputs("/>\n", out);
    }
    fprintf(out, "    </%s>\n", list);
}

static void put_structure_2(FILE *out, const struct fmu *fmu) {
    const bool *depends = export_catalogue_dependencies(fmu->scene);
    fputs("  <ModelStructure>\n", out);
    put_unknowns_2(out, fmu, "Outputs", is_output, depends);
    put_unknowns_2(out, fmu, "Derivatives", is_derivative, depends);
    put_unknowns_2(out, fmu, "InitialUnknowns", is_unknown_at_start, NULL);
    fputs("  </ModelStructure>\n", out);
}

/* ---- The whole ---- */

void export_description_put_2(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\"", out);
    put_attribute(out, "modelName", fmu->name);
    put_attribute(out, "guid", fmu->token);
    put_attribute(out, "generationTool", "refdyn " REFDYN_VERSION);
    fprintf(out, " variableNamingConvention=\"flat\" numberOfEventIndicators=\"%d\">\n",
            fmu_count_indicators(fmu->scene->model));
    put_type_2(out, fmu, "ModelExchange",
               fmu->scene->model->event_count > 0 ? "" : " completedIntegratorStepNotNeeded=\"true\"");
    put_type_2(out, fmu, "CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"");
    put_units(out, fmu);
    put_categories(out);
    put_experiment(out, fmu);
    fputs("  <ModelVariables>\n", out);
    for (int i = 0; i < fmu->catalogue.count; i++)
        put_variable_2(out, &fmu->catalogue.entries[i]);
    fputs("  </ModelVariables>\n", out);
    put_structure_2(out, fmu);
    fputs("</fmiModelDescription>\n", out);
}

/*
 * modelDescription.xml and buildDescription.xml of FMI 3.0 (FMI 3.0.2, ch. 2.4 and 2.5). Other elements refer
 * to variables by their value references; event indicators are variables.
 */

static void put_type_3(FILE *out, const struct fmu *fmu, const char *type, const char *abilities) {
    fprintf(out, "  <%s", type);
    put_attribute(out, "modelIdentifier", fmu->name);
    fputs(abilities, out);
    fputs(" canGetAndSetFMUState=\"true\"", out);
    if (!fmu->why_no_derivatives)
        fputs(" providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\"", out);
    fputs("/>\n", out);
}

/* Inputs have a start value, and no `initial`. */
static void put_variable_3(FILE *out, const struct fmu *fmu, const struct catalogue_entry *entry) {
    fputs("    <Float64", out);
    put_attribute(out, "name", entry->name);
    fprintf(out, " valueReference=\"%u\"", entry->reference);
    put_attribute(out, "description", entry->about);
    put_attribute(out, "causality", causality_names[entry->causality]);
    put_attribute(out, "variability", variability_names[entry->variability]);
    if (entry->causality != AS_INPUT && initial_names[entry->initial])
        put_attribute(out, "initial", initial_names[entry->initial]);
    if (entry->unit)
        put_attribute(out, "unit", entry->unit);
    if (has_start(entry))
        put_number_attribute(out, "start", entry->start);
    if (entry->state >= 0)
        fprintf(out, " derivative=\"%u\"", fmu->catalogue.entries[entry->state].reference);
    fputs("/>\n", out);
}

static bool is_indicator(const struct catalogue_entry *entry) {
    return entry->variable.kind == FMU_INDICATOR;
}

/* If `depends` is NULL, dependencies are left out. */
static void put_unknowns_3(FILE *out, const struct fmu *fmu, const char *element,
                           bool (*is_one)(const struct catalogue_entry *entry), const bool *depends) {
    for (int i = 0; i < fmu->catalogue.count; i++) {
        const struct catalogue_entry *entry = &fmu->catalogue.entries[i];
        if (!is_one(entry))
            continue;
        fprintf(out, "    <%s valueReference=\"%u\"", element, entry->reference);
        if (depends)
            put_dependencies(out, fmu, depends, entry);
        fputs("/>\n", out);
    }
}

static void put_structure_3(FILE *out, const struct fmu *fmu) {
    const bool *depends = export_catalogue_dependencies(fmu->scene);
    fputs("  <ModelStructure>\n", out);
    put_unknowns_3(out, fmu, "Output", is_output, depends);
    put_unknowns_3(out, fmu, "ContinuousStateDerivative", is_derivative, depends);
    put_unknowns_3(out, fmu, "InitialUnknown", is_unknown_at_start, NULL);
    put_unknowns_3(out, fmu, "EventIndicator", is_indicator, NULL);
    fputs("  </ModelStructure>\n", out);
}

void export_description_put_3(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\"", out);
    put_attribute(out, "modelName", fmu->name);
    put_attribute(out, "instantiationToken", fmu->token);
    put_attribute(out, "generationTool", "refdyn " REFDYN_VERSION);
    fputs(" variableNamingConvention=\"flat\">\n", out);
    put_type_3(out, fmu, "ModelExchange",
               fmu->scene->model->event_count > 0 ? " needsCompletedIntegratorStep=\"true\"" : "");
    put_type_3(out, fmu, "CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"");
    put_units(out, fmu);
    put_categories(out);
    put_experiment(out, fmu);
    fputs("  <ModelVariables>\n", out);
    for (int i = 0; i < fmu->catalogue.count; i++)
        put_variable_3(out, fmu, &fmu->catalogue.entries[i]);
    fputs("  </ModelVariables>\n", out);
    put_structure_3(out, fmu);
    fputs("</fmiModelDescription>\n", out);
}

void export_description_put_build(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
          "  <BuildConfiguration",
          out);
    put_attribute(out, "modelIdentifier", fmu->name);
    fputs(">\n    <SourceFileSet language=\"C11\">\n", out);
    for (int i = 0; i < fmu->sources.count; i++) {
        if (!export_is_source(fmu->sources.list[i].path))
            continue;
        fputs("      <SourceFile", out);
        put_attribute(out, "name", fmu->sources.list[i].path);
        fputs("/>\n", out);
    }
    fputs("      <IncludeDirectory name=\".\"/>\n    </SourceFileSet>\n"
          "    <Library name=\"m\" external=\"true\" description=\"C mathematics, where it is a library\"/>\n"
          "  </BuildConfiguration>\n</fmiBuildDescription>\n",
          out);
}
