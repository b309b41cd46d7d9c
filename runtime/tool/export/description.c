/* What the descriptions of both versions of FMI have in common: see description.h. */
#include "export/description.h"
#include "export/units.h"
#include "text/escape.h"

#include <string.h>

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

void put_units(FILE *out, const struct fmu *fmu) {
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
