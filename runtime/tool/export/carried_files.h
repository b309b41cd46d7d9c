/* The sources that every FMU carries: the core of the runtime and the layer of runtime/fmi, put in at build
 * time. */
#ifndef REFDYN_TOOL_CARRIED_FILES_H
#define REFDYN_TOOL_CARRIED_FILES_H

#include <stddef.h>

struct carried_file {
    const char *path; /* under runtime/, as sources include it */
    const char *text;
    size_t size;
};

extern const struct carried_file carried_files[];
extern const int carried_file_count;

#endif
