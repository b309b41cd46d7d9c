/* The sources of an FMU: what every one carries, the emitted model, and the values that it is exported with.
 */
#ifndef REFDYN_TOOL_FMU_SOURCES_H
#define REFDYN_TOOL_FMU_SOURCES_H

#include "export/fmu.h"

/* Fills fmu->sources, and fmu->token, which follows from all of them. */
void fmu_make_sources(struct fmu *fmu);
/* Is it a source to compile, and not a header? */
bool fmu_is_source(const char *path);

#endif
