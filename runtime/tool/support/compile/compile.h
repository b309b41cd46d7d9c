/* Compiles emitted C and loads the result: loading a model; the compiler and its runs; the cache of
 * libraries. */
#ifndef REFDYN_TOOL_COMPILE_H
#define REFDYN_TOOL_COMPILE_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/gen.h"
#include "refdyn_lanes.h"
#include "runtime/tool/support/system/system.h"

/* A compiler: its words, such as those of $CC, and the program's file. */
struct toolchain {
    const char *program;
    const char *const *words; /* NULL at the end */
};

/* The emitted files of a model. */
struct emitted {
    const char *name; /* of the model */
    const struct emitted_file *files;
    int count;
    int lanes; /* width of the files for lanes; 0 if there are none */
};

/* The folder of compiled models: $REFDYN_CACHE, or refdyn in the XDG cache folder, or a private folder in
 * $TMPDIR for a user without either. Libraries appear by a rename, so that any number of processes may share
 * one cache. compiled_cache.c says what makes it safe to load them. */
struct cache {
    const char *path; /* with links resolved */
    int folder;       /* descriptor of the folder: the folder that was checked is the folder that is used */
};

/* Which library a command should work with, if the cache does not have the optimised one. */
enum compile_tier {
    COMPILE_FIRST,     /* the first tier, at once; the optimised one is compiled in the background */
    COMPILE_ONCE,      /* the first tier alone: the work is a few calls, and probably not repeated */
    COMPILE_OPTIMISED, /* the optimised one: measurements, and work for which it pays to wait */
};

enum { LIBRARIES = 2 /* of a model: the one that was loaded first, and the optimised one after it */ };

struct compiled {
    const char *path; /* of the library in the cache */
    const struct refdyn_model *model;
    const struct refdyn_lane_model *lanes; /* NULL if there is none */
    const struct refdyn_spatial *spatial;  /* NULL if there is none */
    const char *awaited; /* file of the optimised library, which may appear; NULL if it is loaded */
    double next_look;    /* when compile_follow looks for it again: wall clock [s] */
    struct cache cache;
    void *libraries[LIBRARIES]; /* handles of dlopen; NULL if not loaded */
};

/* Without a library, as compile_release leaves it. */
extern const struct compiled compile_nothing;

/* Loads a model, compiled unless the cache has it. Programs that need the same library at the same time
 * compile it once. Files for lanes are always optimised, and so is everything if REFDYN_BACKGROUND is 0.
 * Returns false and reports on stderr if it fails. Call compile_release in any case. */
bool compile_load(struct compiled *compiled, const struct emitted *emitted, enum compile_tier tier);
/* The path at which the optimised library will appear; NULL if it is loaded. */
const char *compile_awaited_path(const struct compiled *compiled);
/* Returns the table of the optimised library once, after it has appeared; otherwise NULL. Looks for it at
 * most every 50 ms, so that it may be called often. The earlier library stays loaded, too. */
const struct refdyn_model *compile_follow(struct compiled *compiled);
void compile_release(struct compiled *compiled);

/* ---- Builds ---- */

enum build_outcome {
    BUILD_DONE,
    BUILD_REFUSED, /* by the compiler of the first tier: not reported, because $CC will report the reason */
    BUILD_FAILED   /* reported */
};

/* Compiles into the cache as KEY.so: a first tier, or optimised. */
enum build_outcome compile_build(const struct cache *cache, const char *key, const struct toolchain *chain,
                                 const struct emitted *emitted, bool is_first);
/* Calls `provide` in a process in the background, with the cache, to compile KEY.so of the model `name`. Does
 * nothing if there can be no process. If `provide` fails, the next call for this library warns, once. */
void compile_in_background(const struct cache *cache, const char *key, const char *name,
                           bool (*provide)(const struct cache *cache, void *what), void *what);

struct build_cost {
    double seconds;    /* wall clock time of compiling and linking */
    long object_bytes; /* of all objects */
    long peak_kb;      /* of the largest process */
};

/* Compiles the optimised library in a temporary folder, without looking in the cache. */
bool compile_measure(const struct emitted *emitted, struct build_cost *cost);

/* ---- Compilers ---- */

/* The texts of runtime/refdyn_model.h and refdyn_lanes.h, embedded at build time. */
extern const char refdyn_model_header[], refdyn_lanes_header[];
extern const size_t refdyn_model_header_size, refdyn_lanes_header_size;

/* Sources of the runtime that the program carries, embedded at build time: first those in every FMU, the core
 * and runtime/bindings/fmi, then those of the modules of live pages. */
struct carried_file {
    const char *path; /* under runtime/, as sources include it */
    const char *text;
    size_t size;
};

extern const struct carried_file carried_files[];
extern const int carried_file_count /* in every FMU */, carried_file_count_all;

/* Writes a carried file into the folder, under its path. Returns false and reports on stderr if it cannot. */
bool compile_write_carried(const struct scratch *scratch, const struct carried_file *file);

/* Flags for all optimised builds of emitted C; NULL at the end. */
extern const char *const compile_flags[];
/* The additional flags for files for lanes of this width and its vectors. */
const char *const *compile_lanes_flags(int width);
/* Flags for emitted C by gcc, in addition to those for all compilers; NULL at the end. */
extern const char *const compile_gcc_flags[];

/* $CC. Reports on stderr if there is no compiler. */
bool compile_toolchain_find(struct toolchain *chain);
/* The compiler of the first tier, with its flags as words. Returns false if there is none, or if $CC has
 * several words, which may change the bits of the results. */
bool compile_toolchain_first(struct toolchain *first, const struct toolchain *chain);
/* Returns whether it is a gcc that knows all of compile_gcc_flags. clang also claims to be gcc. */
bool compile_toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch);

/* ---- The cache ---- */

/* Reports on stderr if there is no folder. Call compile_cache_close in any case. */
bool compile_cache_open(struct cache *cache);
/* Loads the library KEY.so with dlopen. Returns NULL if it is missing, incomplete or not this user's. */
void *compile_cache_load(const struct cache *cache, const char *key);
/* The path of KEY.so for a linker, checked as for loading; NULL as above. */
const char *compile_cache_find(const struct cache *cache, const char *key);
/* The content of KEY.so without its seal, checked as for loading, in heap memory; NULL as above. */
char *compile_cache_read(const struct cache *cache, const char *key, size_t *size);
/* Seals the library and moves it into the cache as KEY.so. Reports on stderr if it cannot. */
bool compile_cache_add(const struct cache *cache, const char *key, const char *library);
/* Removes KEY.so. */
void compile_cache_drop(const struct cache *cache, const char *key);
void compile_cache_close(struct cache *cache);
/* Makes a temporary folder in the cache, in which a library is built. Reports an error on stderr. */
bool compile_cache_scratch(const struct cache *cache, struct scratch *scratch);
/* Removes folders of builds that were killed. */
void compile_cache_clean(const struct cache *cache);
/* Marks the library as used today; `library` is its descriptor. */
void compile_cache_note_use(int library);
/* Removes libraries that were not used for 60 days, and the least recently used ones beyond 1 GiB. */
void compile_cache_prune(const struct cache *cache);
/* Claims the build of KEY.so: returns false while another program builds it. If the cache cannot be written,
 * every program may claim it. */
bool compile_cache_claim(const struct cache *cache, const char *key, struct scratch *claimed);
void compile_cache_unclaim(struct scratch *claimed);
/* Waits for the lock of the cache, which this program then holds until it ends: one program works at a time.
 */
void compile_cache_queue(const struct cache *cache);

/* One run of the compiler: the words of $CC, flags, then its task; NULL at the end. */
struct job {
    const char **argv;
    int argc, room;
    const char *source, *object, *log;
};

/* `words` ends with NULL. */
void compile_job_add_word(struct job *job, const char *word);
void compile_job_add_words(struct job *job, const char *const *words);
/* Runs one job and returns whether it succeeded, without a message. `what` is the notice of a long wait. */
bool compile_job_succeeds(const struct scratch *scratch, const struct job *job, const char *what);
/* Runs all jobs, two at a time. After a failure, which is reported with the compiler's output, no new one
 * starts. Returns whether all succeeded. */
bool compile_jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb);

#endif
