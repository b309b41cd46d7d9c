/* The text of a Lua file. */
#ifndef REFDYN_GEN_SOURCE_FILE_H
#define REFDYN_GEN_SOURCE_FILE_H

#include "memory.h"

#include <stdbool.h>

struct source_file {
    const char *path;
    const char *text;
    size_t length;
};

/* False, with errno set, when the file cannot be read. */
bool read_source_file(struct memory *memory, const char *path, struct source_file *source);
/* The path of NAME.lua in the folder of the file `beside`. */
const char *source_path(struct memory *memory, const char *beside, const char *name);

#endif
