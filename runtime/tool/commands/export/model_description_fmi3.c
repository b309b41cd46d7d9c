/*
 * modelDescription.xml and buildDescription.xml of FMI 3.0 (FMI 3.0.2, ch. 2.4 and 2.5). Other elements refer
 * to variables by their value references; event indicators are variables.
 */
#include "runtime/tool/commands/export/export.h"
#include "refdyn.h"

static void put_type(FILE *out, const struct fmu *fmu, const char *type, const char *abilities) {
    fprintf(out, "  <%s", type);
    export_put_attribute(out, "modelIdentifier", fmu->name);
    fputs(abilities, out);
    fputs(" canGetAndSetFMUState=\"true\"", out);
    if (!fmu->why_no_derivatives)
        fputs(" providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\"", out);
    fputs("/>\n", out);
}

/* Inputs have a start value, and no `initial`. */
static void put_variable(FILE *out, const struct fmu *fmu, const struct catalogue_entry *entry) {
    fputs("    <Float64", out);
    export_put_attribute(out, "name", entry->name);
    fprintf(out, " valueReference=\"%u\"", entry->reference);
    export_put_attribute(out, "description", entry->about);
    export_put_attribute(out, "causality", causality_names[entry->causality]);
    export_put_attribute(out, "variability", variability_names[entry->variability]);
    if (entry->causality != AS_INPUT && initial_names[entry->initial])
        export_put_attribute(out, "initial", initial_names[entry->initial]);
    if (entry->unit)
        export_put_attribute(out, "unit", entry->unit);
    if (export_catalogue_has_start(entry))
        export_put_number_attribute(out, "start", entry->start);
    if (entry->state >= 0)
        fprintf(out, " derivative=\"%u\"", fmu->catalogue.entries[entry->state].reference);
    fputs("/>\n", out);
}

static bool is_indicator(const struct catalogue_entry *entry) {
    return entry->variable.kind == FMU_INDICATOR;
}

/* If `depends` is NULL, dependencies are left out. */
static void put_unknowns(FILE *out, const struct fmu *fmu, const char *element,
                         bool (*is_one)(const struct catalogue_entry *entry), const bool *depends) {
    for (int i = 0; i < fmu->catalogue.count; i++) {
        const struct catalogue_entry *entry = &fmu->catalogue.entries[i];
        if (!is_one(entry))
            continue;
        fprintf(out, "    <%s valueReference=\"%u\"", element, entry->reference);
        if (depends)
            export_description_put_dependencies(out, fmu, depends, entry);
        fputs("/>\n", out);
    }
}

static void put_structure(FILE *out, const struct fmu *fmu) {
    const bool *depends = export_catalogue_dependencies(fmu->scene);
    fputs("  <ModelStructure>\n", out);
    put_unknowns(out, fmu, "Output", export_catalogue_is_output, depends);
    put_unknowns(out, fmu, "ContinuousStateDerivative", export_catalogue_is_derivative, depends);
    put_unknowns(out, fmu, "InitialUnknown", export_catalogue_is_unknown_at_start, NULL);
    put_unknowns(out, fmu, "EventIndicator", is_indicator, NULL);
    fputs("  </ModelStructure>\n", out);
}

void export_description_put_3(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\"", out);
    export_put_attribute(out, "modelName", fmu->name);
    export_put_attribute(out, "instantiationToken", fmu->token);
    export_put_attribute(out, "generationTool", "refdyn " REFDYN_VERSION);
    fputs(" variableNamingConvention=\"flat\">\n", out);
    put_type(out, fmu, "ModelExchange",
             fmu->scene->model->event_count > 0 ? " needsCompletedIntegratorStep=\"true\"" : "");
    put_type(out, fmu, "CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"");
    export_description_put_units(out, fmu);
    export_description_put_categories(out);
    export_description_put_experiment(out, fmu);
    fputs("  <ModelVariables>\n", out);
    for (int i = 0; i < fmu->catalogue.count; i++)
        put_variable(out, fmu, &fmu->catalogue.entries[i]);
    fputs("  </ModelVariables>\n", out);
    put_structure(out, fmu);
    fputs("</fmiModelDescription>\n", out);
}

void export_description_put_build(FILE *out, const struct fmu *fmu) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
          "  <BuildConfiguration",
          out);
    export_put_attribute(out, "modelIdentifier", fmu->name);
    fputs(">\n    <SourceFileSet language=\"C11\">\n", out);
    for (int i = 0; i < fmu->sources.count; i++) {
        if (!export_is_source(fmu->sources.list[i].path))
            continue;
        fputs("      <SourceFile", out);
        export_put_attribute(out, "name", fmu->sources.list[i].path);
        fputs("/>\n", out);
    }
    fputs("      <IncludeDirectory name=\".\"/>\n    </SourceFileSet>\n"
          "    <Library name=\"m\" external=\"true\" description=\"C mathematics, where it is a library\"/>\n"
          "  </BuildConfiguration>\n</fmiBuildDescription>\n",
          out);
}
