/* Reads Lua files: see read.h. */
#include "gen/read/read.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MARK_LENGTH = 3 }; /* of the byte order mark of UTF-8, which some editors write */

static const size_t length_bound = (size_t)SOURCE_MEGABYTES << 20;

/* Does not wait for the other end of a pipe. -1, and why: not opened. */
static int open_regular(const char *path, const char **fault) {
    struct stat about;
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (file < 0 || fstat(file, &about) != 0)
        *fault = strerror(errno);
    else if (!S_ISREG(about.st_mode))
        *fault = S_ISDIR(about.st_mode) ? "it is a folder, a file is needed"
                                        : "it is no regular file, but a device, pipe or socket";
    if (file >= 0 && *fault)
        close(file);
    return *fault ? -1 : file;
}

/* Up to `room` bytes; gives how many, -1 for an error. */
static ssize_t read_all(int file, char *text, size_t room) {
    size_t length = 0;
    ssize_t count = 1;
    while (count > 0 && length < room) {
        count = read(file, text + length, room - length);
        length += count > 0 ? (size_t)count : 0;
    }
    return count < 0 ? -1 : (ssize_t)length;
}

/* A block of one byte more than the files of a model may still have: so one that is too long is seen. */
static const char *read_text(struct memory *memory, int file, size_t bound, struct source_file *source) {
    struct stat about;
    if (fstat(file, &about) == 0 && (about.st_size < 0 || (size_t)about.st_size > bound))
        return "the files of a model are longer than 4 MB";
    const size_t room = (about.st_size > 0 ? (size_t)about.st_size : bound) + 1;
    char *text = memory_try(memory, room);
    const ssize_t length = text ? read_all(file, text, room) : 0;
    if (length < 0)
        return strerror(errno);
    if ((size_t)length == room)
        return room > bound ? "the files of a model are longer than 4 MB" : "it grows while it is read";
    source->text = text;
    source->length = (size_t)length;
    return NULL;
}

/* The kind of a file that begins like no UTF-8 text, or NULL. */
static const char *foreign_format(const struct source_file *source) {
    static const struct {
        const char *lead, *fault;
        size_t length;
    } formats[] = {{"\xFF\xFE\0\0", "it is in UTF-32; save it as UTF-8", 4},
                   {"\xFF\xFE", "it is in UTF-16; save it as UTF-8", 2},
                   {"\xFE\xFF", "it is in UTF-16; save it as UTF-8", 2},
                   {"\0\0\xFE\xFF", "it is in UTF-32; save it as UTF-8", 4},
                   {"\x1F\x8B", "it is compressed; unpack it with gunzip", 2},
                   {"PK\3\4", "it is an archive; unpack it with unzip", 4}};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (source->length >= formats[i].length &&
            memcmp(source->text, formats[i].lead, formats[i].length) == 0)
            return formats[i].fault;
    const bool has_zero = source->length > 1 && (!source->text[0] || !source->text[1]);
    return has_zero ? "it is in UTF-16; save it as UTF-8" : NULL;
}

static void skip_mark(struct source_file *source) {
    if (source->length < MARK_LENGTH || memcmp(source->text, "\xEF\xBB\xBF", MARK_LENGTH) != 0)
        return;
    source->text += MARK_LENGTH;
    source->length -= MARK_LENGTH;
}

const char *source_file_add(struct memory *memory, struct sources *sources, const char *path) {
    struct source_file source = {.path = path};
    const char *fault = NULL;
    if (sources->count == SOURCES_BOUND)
        return "a model has more than 100 files";
    const int file = open_regular(path, &fault);
    if (file < 0)
        return fault;
    fault = read_text(memory, file, length_bound - sources->length, &source);
    close(file);
    if (fault)
        return fault;
    if (!source.text)
        memory->fail(memory->context);
    fault = foreign_format(&source);
    if (fault)
        return fault;
    sources->length += source.length;
    skip_mark(&source);
    sources->list =
        memory_room(memory, sources->list, sources->count, &sources->capacity, sizeof *sources->list);
    sources->list[sources->count++] = source;
    return NULL;
}

const char *source_file_path(struct memory *memory, const char *beside, const char *name) {
    const char *slash = strrchr(beside, '/');
    int folder = slash ? (int)(slash - beside) + 1 : 0;
    return memory_format(memory, "%.*s%s.lua", folder, beside, name);
}

bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest) {
    const size_t lead = strlen(SOURCE_CHUNK);
    char *end;
    if (strncmp(text, SOURCE_CHUNK, lead) != 0)
        return false;
    const long source = strtol(text + lead, &end, 10);
    if (*end != ':' || source < 0 || source >= sources->count)
        return false;
    place->file = sources->list[source].path;
    place->line = (int)strtol(end + 1, &end, 10);
    *rest = strncmp(end, ": ", 2) == 0 ? end + 2 : end;
    return true;
}
