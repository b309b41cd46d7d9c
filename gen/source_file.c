/* Reads Lua files: see source_file.h. */
#include "source_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

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
    source->text = text;
    source->length = length;
    return true;
}

bool read_source_file(struct memory *memory, const char *path, struct source_file *source) {
    FILE *file = fopen(path, "rb");
    *source = (struct source_file){.path = path};
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

const char *source_path(struct memory *memory, const char *beside, const char *name) {
    const char *slash = strrchr(beside, '/');
    int folder = slash ? (int)(slash - beside) + 1 : 0;
    return memory_format(memory, "%.*s%s.lua", folder, beside, name);
}
