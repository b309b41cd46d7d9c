/*
 * The folder of compiled models: $REFDYN_CACHE, or else refdyn in the XDG cache folder, or, for a user
 * without one, a private folder in $TMPDIR.
 *
 * What lies there is loaded and run, so it has to be this user's alone: folders that others own or may write
 * into are not taken, and of the libraries only plain files of this user that nobody else may write. Each
 * ends with the SHA-256 of what is before, so that one that was cut short or damaged is not loaded, but built
 * again. They appear by a rename: any number of processes may use one cache.
 */
#ifndef REFDYN_TOOL_COMPILED_CACHE_H
#define REFDYN_TOOL_COMPILED_CACHE_H

#include <stdbool.h>

struct cache {
    const char *path; /* without links */
    int folder;       /* its descriptor: what was checked is what is used */
};

/* Complains on stderr when there is none; cache_close in any case. */
bool cache_open(struct cache *cache);
/* The library KEY.so, as dlopen gives it, and the descriptor that it came from, to be closed after dlclose;
 * NULL: it is not there, not whole or not this user's. */
void *cache_load(const struct cache *cache, const char *key, int *file);
/* The path of KEY.so, checked as for loading, for a linker to read; NULL: as above. */
const char *cache_find(const struct cache *cache, const char *key);
/* Seals the library and moves it into the cache as KEY.so. Complains on stderr when it cannot. */
bool cache_add(const struct cache *cache, const char *key, const char *library);
void cache_close(struct cache *cache);

#endif
