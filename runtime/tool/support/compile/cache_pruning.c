/*
 * Keeps the cache of compiled libraries small: removes libraries that no command has loaded for a long time,
 * and the least recently used ones of a cache that is too large.
 *
 * The time of the last change of a library's file is the time of its last use, within a day. A library that a
 * running program has loaded stays in memory after its file is removed.
 */
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    DAY = 24 * 60 * 60,      /* [s] */
    LONGEST_UNUSED = 60,     /* days for which an unused library stays */
    LARGEST_CACHE = 1 << 30, /* bytes of all libraries */
};

struct cached_library {
    char name[256]; /* more than a key and ".so" */
    time_t used;
    off_t size;
};

void compile_cache_note_use(int library) {
    struct stat status;
    if (fstat(library, &status) == 0 && status.st_mtime + DAY < time(NULL))
        futimens(library, NULL);
}

/* Whether it is a library; then also its last use and its size. */
static bool look_at_library(const struct cache *cache, const char *name, struct cached_library *library) {
    struct stat status;
    const size_t length = strlen(name);
    if (length < 4 || length >= sizeof library->name || strcmp(name + length - 3, ".so") != 0 ||
        fstatat(cache->folder, name, &status, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(status.st_mode))
        return false;
    memcpy(library->name, name, length + 1);
    library->used = status.st_mtime;
    library->size = status.st_size;
    return true;
}

/* Lists the libraries in the folder. */
static int list_libraries(const struct cache *cache, struct memory *memory, struct cached_library **list) {
    int count = 0, capacity = 0;
    DIR *folder = opendir(cache->path);
    for (const struct dirent *entry; folder && (entry = readdir(folder));) {
        *list = memory_room(memory, *list, count, &capacity, sizeof **list);
        count += look_at_library(cache, entry->d_name, &(*list)[count]);
    }
    if (folder)
        closedir(folder);
    return count;
}

/* The most recently used library first. */
static int compare_use(const void *left, const void *right) {
    const struct cached_library *a = left, *b = right;
    return (a->used < b->used) - (a->used > b->used);
}

void compile_cache_prune(const struct cache *cache) {
    struct memory memory = format_arena_start();
    struct cached_library *list = NULL;
    const int count = list_libraries(cache, &memory, &list);
    const time_t oldest = time(NULL) - (time_t)LONGEST_UNUSED * DAY;
    off_t total = 0;
    if (count > 1)
        qsort(list, (size_t)count, sizeof *list, compare_use);
    for (int i = 0; i < count; i++) {
        total += list[i].size;
        if (i > 0 && (list[i].used < oldest || total > LARGEST_CACHE))
            unlinkat(cache->folder, list[i].name, 0);
    }
    memory_release(&memory);
}
