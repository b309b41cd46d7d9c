/* The libraries of an FMU, one for each platform. */
#ifndef REFDYN_TOOL_FMU_BINARY_H
#define REFDYN_TOOL_FMU_BINARY_H

#include "export/fmu.h"

struct platform {
    const char *name;             /* as --platform gives it, and the folder of FMI 2.0 */
    const char *folder_3;         /* the folder of FMI 3.0 */
    const char *ending;           /* of the library */
    const char *compiler;         /* NULL: $CC */
    const char *package;          /* of Debian, that has the compiler */
    const char *machine;          /* what macros of $CC say where it builds for the platform */
    const char *compile_flags[4]; /* beside those of all; end with NULL */
    const char *link_flags[6];
};

/* NULL: there is none of that name. */
const struct platform *platform_find(const char *name);
/* "linux64, win64" */
const char *platform_names(void);
/* Compiles the sources and adds the library to fmu->files. What is the same in all FMUs is compiled once and
 * kept in the cache. Complains on stderr when it fails. */
bool binary_make(struct fmu *fmu, const struct platform *platform);

#endif
