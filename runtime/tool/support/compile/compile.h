/* What this folder offers. */
#ifndef REFDYN_TOOL_COMPILE_H
#define REFDYN_TOOL_COMPILE_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/gen.h"
#include "refdyn_lanes.h"
#include "runtime/tool/support/system/system.h"

/*
 * Emitted C becomes functions to call: compiled with $CC into a cache, loaded with dlopen.
 *
 * A library in the cache (compile.h) is named by the SHA-256 of all that went into it: the texts, the
 * compiler's file, size and time, the flags.
 */

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

/*
 * One build of emitted C in a folder of its own: files written, objects compiled two at a time, linked.
 */

/* The texts of runtime/refdyn_model.h and refdyn_lanes.h, put in at build time. */
extern const char refdyn_model_header[], refdyn_lanes_header[];
extern const size_t refdyn_model_header_size, refdyn_lanes_header_size;

/* What emitted C is compiled with, by every compiler, and by gcc beside that; both end with NULL. */
extern const char *const compile_flags[], *const gcc_flags[];

/* $CC: its words and the program's file. */
struct toolchain {
    const char *program;
    const char *const *words; /* end with NULL */
};

/* What the files of lanes are compiled with beside that: how many there are, and for which vectors. */
const char *const *lanes_flags(int width);

/* Complains on stderr when there is none. */
bool toolchain_find(struct toolchain *chain);
/* Is it gcc, and one that knows all of gcc_flags? clang says that it is gcc, too. */
bool toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch);

struct build {
    struct scratch scratch; /* open: all that is made lies in it */
    const char *library;    /* the linked library in it */
    bool is_gcc;            /* what compiles it */
    int lanes;              /* of files for lanes; 0: there are none */
};

/* Complains on stderr, with the compiler's own output, and returns false when it fails. cost may be NULL. */
bool build_run(struct build *build, const struct toolchain *chain, const struct emitted_file *files,
               int count, struct build_cost *cost);

/*
 * The folder of compiled models: $REFDYN_CACHE, or else refdyn in the XDG cache folder, or, for a user
 * without one, a private folder in $TMPDIR.
 *
 * What lies there is loaded and run, so it has to be this user's alone: folders that others own or may write
 * into are not taken, and of the libraries only plain files of this user that nobody else may write. Each
 * ends with the SHA-256 of what is before, so that one that was cut short or damaged is not loaded, but built
 * again. They appear by a rename: any number of processes may use one cache.
 */

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

/* Runs of a compiler: their words, and several of them at a time, in a folder whose processes end with the
 * program. */

/* One run of the compiler: the words of $CC, flags, then what it is to do; behind them a NULL. */
struct job {
    const char **argv;
    int argc, room;
    const char *source, *object, *log;
};

void job_add_word(struct job *job, const char *word);
/* words end with NULL. */
void job_add_words(struct job *job, const char *const *words);
/* Runs all jobs, two at a time; after a failure, which is told with what the compiler said, no new one is
 * started. Have all gone well? */
bool jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb);

#endif
