/* modelDescription.xml of FMI 2.0 (FMI 2.0.5, ch. 2.2). Other elements refer to variables by their place. */
#include "runtime/tool/commands/export/export.h"
#include "refdyn.h"

static void put_source_files(FILE *out, const struct fmu *fmu) {
    fputs("    <SourceFiles>\n", out);
    for (int i = 0; i < fmu->sources.count; i++) {
        if (!export_is_source(fmu->sources.list[i].path))
            continue;
        fputs("      <File", out);
        export_put_attribute(out, "name", fmu->sources.list[i].path);
        fputs("/>\n", out);
    }
    fputs("    </SourceFiles>\n", out);
}

static void put_type(FILE *out, const struct fmu *fmu, const char *type, const char *abilities) {
    fprintf(out, "  <%s", type);
    export_put_attribute(out, "modelIdentifier", fmu->name);
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
static void put_variable(FILE *out, const struct catalogue_entry *entry) {
    fputs("    <ScalarVariable", out);
    export_put_attribute(out, "name", entry->name);
    fprintf(out, " valueReference=\"%u\"", entry->reference);
    export_put_attribute(out, "description", entry->about);
    export_put_attribute(out, "causality", causality_names[entry->causality]);
    export_put_attribute(out, "variability", variability_names[entry->variability]);
    if (entry->causality != AS_INPUT && initial_names[entry->initial])
        export_put_attribute(out, "initial", initial_names[entry->initial]);
    fputs(">\n      <Real", out);
    if (entry->unit)
        export_put_attribute(out, "unit", entry->unit);
    if (export_catalogue_has_start(entry))
        export_put_number_attribute(out, "start", entry->start);
    if (entry->state >= 0)
        fprintf(out, " derivative=\"%d\"", entry->state + 1);
    fputs("/>\n    </ScalarVariable>\n", out);
}

/* ---- Structure ---- */

/* If `depends` is NULL, dependencies are left out. */
static void put_unknowns(FILE *out, const struct fmu *fmu, const char *list,
                         bool (*is_one)(const struct catalogue_entry *entry), const bool *depends) {
    fprintf(out, "    <%s>\n", list);
    for (int i = 0; i < fmu->catalogue.count; i++) {
        const struct catalogue_entry *entry = &fmu->catalogue.entries[i];
        if (!is_one(entry))
            continue;
        fprintf(out, "      <Unknown index=\"%d\"", i + 1);
        if (depends)
            export_description_put_dependencies(out, fmu, depends, entry);
        fputs("/>\n", out);
    }
    fprintf(out, "    </%s>\n", list);
}

static void put_structure(FILE *out, const struct fmu *fmu) {
    const bool *depends = export_catalogue_dependencies(fmu->scene);
    fputs("  <ModelStructure>\n", out);
    put_unknowns(out, fmu, "Outputs", export_catalogue_is_output, depends);
    put_unknowns(out, fmu, "Derivatives", export_catalogue_is_derivative, depends);
    put_unknowns(out, fmu, "InitialUnknowns", export_catalogue_is_unknown_at_start, NULL);
    fputs("  </ModelStructure>\n", out);
}

/* ---- The whole ---- */

void export_description_put_2(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\"", out);
    export_put_attribute(out, "modelName", fmu->name);
    export_put_attribute(out, "guid", fmu->token);
    export_put_attribute(out, "generationTool", "refdyn " REFDYN_VERSION);
    fprintf(out, " variableNamingConvention=\"flat\" numberOfEventIndicators=\"%d\">\n",
            fmu_count_indicators(fmu->scene->model));
    put_type(out, fmu, "ModelExchange",
             fmu->scene->model->event_count > 0 ? "" : " completedIntegratorStepNotNeeded=\"true\"");
    put_type(out, fmu, "CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"");
    export_description_put_units(out, fmu);
    export_description_put_categories(out);
    export_description_put_experiment(out, fmu);
    fputs("  <ModelVariables>\n", out);
    for (int i = 0; i < fmu->catalogue.count; i++)
        put_variable(out, &fmu->catalogue.entries[i]);
    fputs("  </ModelVariables>\n", out);
    put_structure(out, fmu);
    fputs("</fmiModelDescription>\n", out);
}
