/* The Lua files of a model: its own, and those beside it that it requires. */
#ifndef REFDYN_GEN_SOURCE_FILE_H
#define REFDYN_GEN_SOURCE_FILE_H

#include "memory.h"
#include "message.h"

#include <stdbool.h>

struct source_file {
    const char *path;
    const char *text;
    size_t length;
};

struct sources {
    struct source_file *list; /* the first is the model */
    int count, capacity;
};

/* What Lua calls the files in its messages, with their number behind it. */
#define SOURCE_CHUNK "model"

/* Reads one more; false, with errno set, when the file cannot be read. */
bool add_source(struct memory *memory, struct sources *sources, const char *path);
/* The path of NAME.lua in the folder of the file `beside`. */
const char *source_path(struct memory *memory, const char *beside, const char *name);
/* Place of "model0:LINE: text", `rest` becomes the text; without such a lead, the model as a whole. */
struct place source_place(const struct sources *sources, const char *text, const char **rest);

#endif
