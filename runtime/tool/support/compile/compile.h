/* Compiles emitted C and loads the result: loading a model; the compiler and its runs; the cache of
 * libraries. */
#ifndef REFDYN_TOOL_COMPILE_H
#define REFDYN_TOOL_COMPILE_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/gen.h"
#include "refdyn_lanes.h"
#include "runtime/tool/support/system/system.h"

struct compiled {
    void *library;
    int file;         /* descriptor that the library was loaded from */
    const char *path; /* of the library in the cache */
    const struct refdyn_model *model;
    const struct refdyn_lane_model *lanes; /* NULL if there is none */
    const struct refdyn_spatial *spatial;  /* NULL if there is none */
};

/* Loads model `name` from its emitted files, compiled unless the cache has them. `lanes` is the width of the
 * files for lanes, 0 if there are none. Returns false and reports on stderr if it fails. */
bool compile_load(struct compiled *compiled, const char *name, const struct emitted_file *files, int count,
                  int lanes);
void compile_release(struct compiled *compiled);

struct build_cost {
    double seconds;    /* wall clock time of compiling and linking */
    long object_bytes; /* of all objects */
    long peak_kb;      /* of the largest process */
};

/* Compiles in a temporary folder, without looking in the cache. */
bool compile_measure(const struct emitted_file *files, int count, struct build_cost *cost);

/* Flags for emitted C by gcc, in addition to those for all compilers; NULL at the end. */
extern const char *const compile_gcc_flags[];

/* $CC: its words and the program's file. */
struct toolchain {
    const char *program;
    const char *const *words; /* NULL at the end */
};

/* Reports on stderr if there is no compiler. */
bool compile_toolchain_find(struct toolchain *chain);
/* Returns whether it is a gcc that knows all of compile_gcc_flags. clang also claims to be gcc. */
bool compile_toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch);

/* The folder of compiled models: $REFDYN_CACHE, or refdyn in the XDG cache folder, or a private folder in
 * $TMPDIR for a user without either. Libraries appear by a rename, so that any number of processes may share
 * one cache. compiled_cache.c says what makes it safe to load them. */

struct cache {
    const char *path; /* with links resolved */
    int folder;       /* descriptor of the folder: the folder that was checked is the folder that is used */
};

/* Reports on stderr if there is no folder. Call compile_cache_close in any case. */
bool compile_cache_open(struct cache *cache);
/* Loads the library KEY.so with dlopen and sets the descriptor that it came from, to be closed after dlclose.
 * Returns NULL if it is missing, incomplete or not this user's. */
void *compile_cache_load(const struct cache *cache, const char *key, int *file);
/* The path of KEY.so for a linker, checked as for loading; NULL as above. */
const char *compile_cache_find(const struct cache *cache, const char *key);
/* Seals the library and moves it into the cache as KEY.so. Reports on stderr if it cannot. */
bool compile_cache_add(const struct cache *cache, const char *key, const char *library);
void compile_cache_close(struct cache *cache);

/* One run of the compiler: the words of $CC, flags, then its task; NULL at the end. */
struct job {
    const char **argv;
    int argc, room;
    const char *source, *object, *log;
};

/* `words` ends with NULL. */
void compile_job_add_word(struct job *job, const char *word);
void compile_job_add_words(struct job *job, const char *const *words);
/* Runs all jobs, two at a time. After a failure, which is reported with the compiler's output, no new one
 * starts. Returns whether all succeeded. */
bool compile_jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb);

#endif
