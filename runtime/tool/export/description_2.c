/* modelDescription.xml of FMI 2.0 (FMI 2.0.5, ch. 2.2): see description.h. Variables are known by their
 * place. */
#include "export/description.h"
#include "export/sources.h"

#include <stdlib.h>
#include <string.h>

enum { DEFAULT_STEPS = 200 };

static void put_source_files(FILE *out, const struct fmu *fmu) {
    fputs("    <SourceFiles>\n", out);
    for (int i = 0; i < fmu->sources.count; i++) {
        if (!fmu_is_source(fmu->sources.list[i].path))
            continue;
        fputs("      <File", out);
        put_attribute(out, "name", fmu->sources.list[i].path);
        fputs("/>\n", out);
    }
    fputs("    </SourceFiles>\n", out);
}

static void put_type(FILE *out, const struct fmu *fmu, const char *type, const char *abilities) {
    fprintf(out, "  <%s", type);
    put_attribute(out, "modelIdentifier", fmu->name);
    fputs(abilities, out);
    fputs(" canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\"", out);
    if (fmu->has_derivatives)
        fputs(" providesDirectionalDerivative=\"true\"", out);
    fputs(">\n", out);
    put_source_files(out, fmu);
    fprintf(out, "  </%s>\n", type);
}

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

static void put_log_categories(FILE *out) {
    static const char *const names[] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                        "logStatusFatal", "logAll"};
    fputs("  <LogCategories>\n", out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(out, "    <Category name=\"%s\"/>\n", names[i]);
    fputs("  </LogCategories>\n", out);
}

/* ---- Variables ---- */

static bool has_start_value(const struct catalogue_entry *entry) {
    return entry->initial == INITIAL_EXACT || entry->initial == INITIAL_APPROXIMATE;
}

/* Inputs have a start value, and no `initial`. */
static void put_variable(FILE *out, const struct catalogue_entry *entry) {
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
    if (has_start_value(entry))
        put_number_attribute(out, "start", entry->start);
    if (entry->state >= 0)
        fprintf(out, " derivative=\"%d\"", entry->state + 1);
    fputs("/>\n    </ScalarVariable>\n", out);
}

/* ---- Structure ---- */

/* Places (from 1) of what an unknown depends on, without derivatives where it depends on all states and
 * inputs. */
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

static void dependencies_add(struct dependencies *list, int entry, const char *kind) {
    fprintf(list->out, "%s%d", ftell(list->out) > 0 ? " " : "", entry + 1);
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
                dependencies_add(list, fmu->catalogue.first[kind] + j, "dependent");
}

/* Nothing where it depends on all. */
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
        dependencies_add(&list, fmu->catalogue.first[is_state ? kind : FMU_RATE] + entry->variable.index,
                         is_state ? "dependent" : "constant");
    dependencies_put(&list, out);
}

static void put_unknown(FILE *out, int entry) {
    fprintf(out, "      <Unknown index=\"%d\"", entry + 1);
}

static bool is_unknown_at_start(const struct catalogue_entry *entry) {
    const bool is_free = entry->initial == INITIAL_CALCULATED || entry->initial == INITIAL_APPROXIMATE;
    return is_free && (entry->causality == AS_OUTPUT || entry->state >= 0);
}

static void put_structure(FILE *out, const struct fmu *fmu) {
    const struct catalogue *catalogue = &fmu->catalogue;
    const bool *depends = catalogue_dependencies(fmu->scene);
    fputs("  <ModelStructure>\n    <Outputs>\n", out);
    for (int i = 0; i < catalogue->count; i++)
        if (catalogue->entries[i].causality == AS_OUTPUT) {
            put_unknown(out, i);
            put_dependencies(out, fmu, depends, &catalogue->entries[i]);
            fputs("/>\n", out);
        }
    fputs("    </Outputs>\n    <Derivatives>\n", out);
    for (int i = 0; i < catalogue->count; i++)
        if (catalogue->entries[i].state >= 0) {
            put_unknown(out, i);
            put_dependencies(out, fmu, depends, &catalogue->entries[i]);
            fputs("/>\n", out);
        }
    fputs("    </Derivatives>\n    <InitialUnknowns>\n", out);
    for (int i = 0; i < catalogue->count; i++)
        if (is_unknown_at_start(&catalogue->entries[i])) {
            put_unknown(out, i);
            fputs("/>\n", out);
        }
    fputs("    </InitialUnknowns>\n  </ModelStructure>\n", out);
}

/* ---- The whole ---- */

void description_put_2(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\"", out);
    put_attribute(out, "modelName", fmu->name);
    put_attribute(out, "guid", fmu->token);
    put_attribute(out, "generationTool", "refdyn " REFDYN_VERSION);
    fprintf(out, " variableNamingConvention=\"flat\" numberOfEventIndicators=\"%d\">\n",
            fmu_count_indicators(fmu->scene->model));
    put_type(out, fmu, "ModelExchange", " completedIntegratorStepNotNeeded=\"true\"");
    put_type(out, fmu, "CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"");
    put_units(out, fmu);
    put_log_categories(out);
    put_experiment(out, fmu);
    fputs("  <ModelVariables>\n", out);
    for (int i = 0; i < fmu->catalogue.count; i++)
        put_variable(out, &fmu->catalogue.entries[i]);
    fputs("  </ModelVariables>\n", out);
    put_structure(out, fmu);
    fputs("</fmiModelDescription>\n", out);
}
