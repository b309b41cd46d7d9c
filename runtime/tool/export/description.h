/* modelDescription.xml of an FMU. */
#ifndef REFDYN_TOOL_DESCRIPTION_H
#define REFDYN_TOOL_DESCRIPTION_H

#include "export/fmu.h"

/* After fmu_make_sources. */
void description_put_2(FILE *out, const struct fmu *fmu);

/* ---- Parts of both versions ---- */

/* NAME="VALUE", a blank before it. */
void put_attribute(FILE *out, const char *name, const char *value);
void put_number_attribute(FILE *out, const char *name, double value);
/* <Unit> of each unit in use, with its base units; `place` is how deep it stands. */
void put_units(FILE *out, const struct fmu *fmu);
extern const char *const causality_names[], *const variability_names[], *const initial_names[];

#endif
