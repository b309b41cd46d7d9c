/* Reads Lua files: see source_file.h. */
#include "source_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARK_LENGTH = 3 }; /* of the byte order mark of UTF-8, which some editors write */

/* False when memory is short: the file has to be closed first. */
static bool read_text(struct memory *memory, FILE *file, struct source_file *source) {
    char *text = NULL;
    size_t length = 0, room = 0;
    do {
        if (length == room) {
            size_t larger = room ? 2 * room : (size_t)1 << 14;
            char *grown = memory_try(memory, larger);
            if (!grown)
                return false;
            if (room)
                memcpy(grown, text, length);
            text = grown;
            room = larger;
        }
        length += fread(text + length, 1, room - length, file);
    } while (length == room);
    const bool is_marked = length >= MARK_LENGTH && memcmp(text, "\xEF\xBB\xBF", MARK_LENGTH) == 0;
    source->text = is_marked ? text + MARK_LENGTH : text;
    source->length = is_marked ? length - MARK_LENGTH : length;
    return true;
}

static bool read_file(struct memory *memory, struct source_file *source) {
    FILE *file = fopen(source->path, "rb");
    if (!file)
        return false;
    bool is_taken = read_text(memory, file, source);
    bool is_read = !ferror(file);
    int reason = errno;
    fclose(file);
    if (!is_taken)
        memory->fail(memory->context);
    errno = reason;
    return is_read;
}

bool add_source(struct memory *memory, struct sources *sources, const char *path) {
    struct source_file source = {.path = path};
    if (!read_file(memory, &source))
        return false;
    sources->list =
        memory_room(memory, sources->list, sources->count, &sources->capacity, sizeof *sources->list);
    sources->list[sources->count++] = source;
    return true;
}

const char *source_path(struct memory *memory, const char *beside, const char *name) {
    const char *slash = strrchr(beside, '/');
    int folder = slash ? (int)(slash - beside) + 1 : 0;
    return memory_format(memory, "%.*s%s.lua", folder, beside, name);
}

struct place source_place(const struct sources *sources, const char *text, const char **rest) {
    struct place place = {.file = sources->list[0].path};
    const size_t lead = strlen(SOURCE_CHUNK);
    char *end;
    if (strncmp(text, SOURCE_CHUNK, lead) != 0)
        return place;
    const long source = strtol(text + lead, &end, 10);
    if (*end != ':' || source < 0 || source >= sources->count)
        return place;
    place.file = sources->list[source].path;
    place.line = (int)strtol(end + 1, &end, 10);
    *rest = strncmp(end, ": ", 2) == 0 ? end + 2 : end;
    return place;
}
