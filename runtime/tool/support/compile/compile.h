/*
 * Compiles emitted C and loads the result.
 *
 * Parts: loading a model; building a library in a temporary folder; the cache of libraries; runs of a
 * compiler.
 */
#ifndef REFDYN_TOOL_COMPILE_H
#define REFDYN_TOOL_COMPILE_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/gen.h"
#include "refdyn_lanes.h"
#include "runtime/tool/support/system/system.h"

/*
 * Emitted C becomes functions to call: it is compiled with $CC into a cache and loaded with dlopen.
 *
 * The name of a library in the cache is the SHA-256 of all its sources: the texts, the compiler's file,
 * size and time, and the flags.
 */

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

/* One build of emitted C in its own folder: writes files, compiles objects two at a time, links them. */

/* The texts of runtime/refdyn_model.h and refdyn_lanes.h, embedded at build time. */
extern const char refdyn_model_header[], refdyn_lanes_header[];
extern const size_t refdyn_model_header_size, refdyn_lanes_header_size;

/* The flags for emitted C, for all compilers and additionally for gcc; both lists end with NULL. */
extern const char *const compile_flags[], *const gcc_flags[];

/* $CC: its words and the program's file. */
struct toolchain {
    const char *program;
    const char *const *words; /* NULL at the end */
};

/* The additional flags for files for lanes of this width and its vectors. */
const char *const *compile_lanes_flags(int width);

/* Reports on stderr if there is no compiler. */
bool compile_toolchain_find(struct toolchain *chain);
/* Returns whether it is a gcc that knows all of gcc_flags. clang also claims to be gcc. */
bool compile_toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch);

struct build {
    struct scratch scratch; /* the open folder of the build */
    const char *library;    /* the linked library in it */
    bool is_gcc;            /* the compiler */
    int lanes;              /* width of the files for lanes; 0 if there are none */
};

/* Returns false and reports on stderr, with the compiler's own output, if it fails. cost may be NULL. */
bool compile_build_run(struct build *build, const struct toolchain *chain, const struct emitted_file *files,
                       int count, struct build_cost *cost);

/*
 * The folder of compiled models: $REFDYN_CACHE, or refdyn in the XDG cache folder, or a private folder in
 * $TMPDIR for a user without either.
 *
 * The program loads and runs the libraries in it, so only this user may own them. The cache refuses folders
 * that others own or may write into, and accepts only plain files of this user that nobody else may write.
 * Each library ends with the SHA-256 of its contents, so that a truncated or damaged one is built again
 * instead of loaded. Libraries appear by a rename, so that any number of processes may share one cache.
 */

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

/* Runs of a compiler: their words, and several at a time. */

/* One run of the compiler: the words of $CC, flags, then its task; NULL at the end. */
struct job {
    const char **argv;
    int argc, room;
    const char *source, *object, *log;
};

void compile_job_add_word(struct job *job, const char *word);
/* `words` ends with NULL. */
void compile_job_add_words(struct job *job, const char *const *words);
/* Runs all jobs, two at a time. After a failure, which is reported with the compiler's output, no new one
 * starts. Returns whether all succeeded. */
bool compile_jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb);

#endif
