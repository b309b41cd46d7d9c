/*
 * Emitted C becomes functions to call: compiled with $CC into a cache, loaded with dlopen.
 *
 * A library in the cache (compiled_cache.h) is named by the SHA-256 of all that went into it: the texts, the
 * compiler's file, size and time, the flags.
 */
#ifndef REFDYN_TOOL_COMPILE_H
#define REFDYN_TOOL_COMPILE_H

#include "gen.h"
#include "refdyn_lanes.h"

#include <stdbool.h>

struct compiled {
    void *library;
    int file;         /* descriptor that the library was loaded from */
    const char *path; /* of the library in the cache */
    const struct refdyn_model *model;
    const struct refdyn_lane_model *lanes; /* NULL: it has none */
    const struct refdyn_spatial *spatial;  /* NULL: it has none */
};

/* Loads model `name` from its emitted files, compiled unless the cache has it; those for lanes with so many,
 * 0: there are none. Complains on stderr when it fails. */
bool compile_load(struct compiled *compiled, const char *name, const struct emitted_file *files, int count,
                  int lanes);
void compile_release(struct compiled *compiled);

struct build_cost {
    double seconds;    /* wall, objects and link */
    long object_bytes; /* all objects */
    long peak_kb;      /* largest process */
};

/* Compiles in a temporary folder, whatever the cache has. */
bool compile_measure(const struct emitted_file *files, int count, struct build_cost *cost);

#endif
