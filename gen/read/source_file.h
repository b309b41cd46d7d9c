/* The Lua files of a model: its own, and those beside it that it requires. */
#ifndef REFDYN_GEN_SOURCE_FILE_H
#define REFDYN_GEN_SOURCE_FILE_H

#include "base/memory.h"
#include "base/message.h"

#include <stdbool.h>

/* What the files of one model may be: one file of 4 MB describes 40,000 links. */
enum { SOURCES_BOUND = 100, SOURCE_MEGABYTES = 4 };

struct source_file {
    const char *path;
    const char *text;
    size_t length;
};

struct sources {
    struct source_file *list; /* the first is the model */
    int count, capacity;
    size_t length; /* of all */
};

/* What Lua calls the files in its messages, with their number behind it. */
#define SOURCE_CHUNK "model"

/* Reads one more; NULL, or why it cannot be read. Only regular files are: others may have no end, or wait. */
const char *source_file_add(struct memory *memory, struct sources *sources, const char *path);
/* The path of NAME.lua in the folder of the file `beside`. */
const char *source_file_path(struct memory *memory, const char *beside, const char *name);
/* Takes "model0:LINE: text"; gives the place, and in `rest` the text. Leaves `place` as it is, and gives
 * false, for a text without such a lead. */
bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest);

#endif
