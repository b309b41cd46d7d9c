/* What the descriptions of both versions of FMI have in common: see export.h. */
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>

enum { DEFAULT_STEPS = 200 };

const char *const causality_names[] = {"independent", "parameter", "input", "output", "local"};
const char *const variability_names[] = {"fixed", "tunable", "discrete", "continuous"};
const char *const initial_names[] = {NULL, "exact", "approx", "calculated"};

void put_attribute(FILE *out, const char *name, const char *value) {
    fprintf(out, " %s=\"", name);
    put_xml_text(out, value);
    fputc('"', out);
}

void put_number_attribute(FILE *out, const char *name, double value) {
    fprintf(out, " %s=\"", name);
    print_number(out, value);
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

/* Is it the unit of an entry before? */
static bool is_told(const struct catalogue *catalogue, int entry) {
    for (int i = 0; i < entry; i++)
        if (catalogue->entries[i].unit &&
            strcmp(catalogue->entries[i].unit, catalogue->entries[entry].unit) == 0)
            return true;
    return false;
}

void description_put_units(FILE *out, const struct fmu *fmu) {
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

void description_put_experiment(FILE *out, const struct fmu *fmu) {
    const double from = fmu->scene->state.t;
    fputs("  <DefaultExperiment", out);
    put_number_attribute(out, "startTime", from);
    put_number_attribute(out, "stopTime", fmu->until);
    if (fmu->options.tol > 0)
        put_number_attribute(out, "tolerance", fmu->options.tol);
    put_number_attribute(out, "stepSize", (fmu->until - from) / DEFAULT_STEPS);
    fputs("/>\n", out);
}

void description_put_categories(FILE *out) {
    static const char *const names[] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                        "logStatusFatal", "logAll"};
    fputs("  <LogCategories>\n", out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(out, "    <Category name=\"%s\"/>\n", names[i]);
    fputs("  </LogCategories>\n", out);
}

/* ---- Variables ---- */

bool catalogue_has_start(const struct catalogue_entry *entry) {
    return entry->initial == INITIAL_EXACT || entry->initial == INITIAL_APPROXIMATE;
}

bool catalogue_is_output(const struct catalogue_entry *entry) {
    return entry->causality == AS_OUTPUT;
}

bool catalogue_is_derivative(const struct catalogue_entry *entry) {
    return entry->state >= 0;
}

bool catalogue_is_unknown_at_start(const struct catalogue_entry *entry) {
    const bool is_free = entry->initial == INITIAL_CALCULATED || entry->initial == INITIAL_APPROXIMATE;
    return is_free && (entry->causality == AS_OUTPUT || entry->state >= 0);
}

/* ---- Dependencies ---- */

/* What an unknown depends on. */
struct dependencies {
    FILE *out;
    char *places, *kinds;
    FILE *kinds_out;
    size_t places_size, kinds_size;
};

static void dependencies_open(struct dependencies *list) {
    list->out = text_stream(&list->places, &list->places_size);
    list->kinds_out = text_stream(&list->kinds, &list->kinds_size);
}

/* Variables are known by their place in FMI 2.0, by their value reference in FMI 3.0. */
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
    const int n = fmu->scene->model->n, row = entry->variable.index;
    for (int kind = FMU_COORDINATE; kind <= FMU_RATE; kind++)
        for (int j = 0; j < n; j++)
            if (depends[row * n + j] && (kind == FMU_COORDINATE || entry->variable.kind == FMU_VELOCITY))
                dependencies_add(list, fmu, fmu->catalogue.first[kind] + j, "dependent");
}

void description_put_dependencies(FILE *out, const struct fmu *fmu, const bool *depends,
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
