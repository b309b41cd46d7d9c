/* modelDescription.xml of an FMU. */
#ifndef REFDYN_TOOL_DESCRIPTION_H
#define REFDYN_TOOL_DESCRIPTION_H

#include "export/fmu.h"

/* After fmu_make_sources. */
void description_put_2(FILE *out, const struct fmu *fmu);
void description_put_3(FILE *out, const struct fmu *fmu);
/* sources/buildDescription.xml of FMI 3.0. */
void description_put_build(FILE *out, const struct fmu *fmu);

/* ---- Parts of both versions ---- */

/* NAME="VALUE", a blank before it. */
void put_attribute(FILE *out, const char *name, const char *value);
void put_number_attribute(FILE *out, const char *name, double value);
extern const char *const causality_names[], *const variability_names[], *const initial_names[];
/* Each unit in use, with its base units. */
void description_put_units(FILE *out, const struct fmu *fmu);
void description_put_experiment(FILE *out, const struct fmu *fmu);
void description_put_categories(FILE *out);
/* Attributes that say what an unknown depends on; nothing where that is all states and inputs. depends:
 * catalogue_dependencies. */
void description_put_dependencies(FILE *out, const struct fmu *fmu, const bool *depends,
                                  const struct catalogue_entry *entry);
bool catalogue_has_start(const struct catalogue_entry *entry);
bool catalogue_is_output(const struct catalogue_entry *entry);
bool catalogue_is_derivative(const struct catalogue_entry *entry);
/* Is it an output, a derivative or a state that initialisation computes? */
bool catalogue_is_unknown_at_start(const struct catalogue_entry *entry);

#endif
