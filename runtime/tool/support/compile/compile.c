/*
 * Turns emitted C into a loaded library: compiles it with $CC in a temporary folder, unless the cache
 * (compiled_cache.c) has it, and loads it with dlopen. No shell is involved, so paths may have any
 * characters.
 *
 * The name of a library in the cache is the SHA-256 of all its sources: the texts, the compiler's file,
 * size and time, and the flags.
 */
#include <dlfcn.h>
#include <errno.h>
#include <sha2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "refdyn_batch.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- Runs of a compiler ---- */

enum { PROCESSES = 2 };

void compile_job_add_word(struct job *job, const char *word) {
    job->argv = memory_room(&format_memory, job->argv, job->argc + 1, &job->room, sizeof *job->argv);
    job->argv[job->argc++] = word;
}

void compile_job_add_words(struct job *job, const char *const *words) {
    for (; *words; words++)
        compile_job_add_word(job, *words);
}

static void show_log(const struct job *job) {
    fputs("refdyn: the compiler failed:", stderr);
    for (int i = 0; i < job->argc; i++)
        fprintf(stderr, " %s", job->argv[i]);
    fputc('\n', stderr);
    system_copy_file(job->log, stderr);
}

static bool start(struct process *process, const struct scratch *scratch, const struct job *job) {
    const int error = system_process_start(process, scratch, job->argv, NULL, job->log, NULL);
    if (error)
        fprintf(stderr, "refdyn: the compiler '%s' could not be started: %s\n", job->argv[0],
                strerror(error));
    return error == 0;
}

bool compile_jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb) {
    struct process running[PROCESSES] = {{.pid = 0}};
    const struct job *of[PROCESSES] = {NULL};
    bool is_good = true;
    for (int next = 0, active = 0; active > 0 || (is_good && next < count);) {
        while (is_good && next < count && active < PROCESSES) {
            int free_place = running[0].pid == 0 ? 0 : 1;
            of[free_place] = &jobs[next++];
            is_good = start(&running[free_place], scratch, of[free_place]);
            active += is_good;
        }
        int done = active ? system_process_wait(running, PROCESSES) : -1;
        if (done < 0)
            return false;
        active--;
        if (running[done].result != 0) {
            show_log(of[done]);
            is_good = false;
        }
        if (running[done].peak_kb > *peak_kb)
            *peak_kb = running[done].peak_kb;
    }
    return is_good;
}

/* ---- Builds ---- */

/* The texts of runtime/refdyn_model.h and refdyn_lanes.h, embedded at build time. */
extern const char refdyn_model_header[], refdyn_lanes_header[];
extern const size_t refdyn_model_header_size, refdyn_lanes_header_size;

/* One build of emitted C in its own folder. */
struct build {
    struct scratch scratch; /* the open folder */
    const char *library;    /* the linked library in it */
    bool is_gcc;            /* the compiler */
    int lanes;              /* width of the files for lanes; 0 if there are none */
};

/* -ffp-contract=off: a multiplication and an addition are rounded twice on every machine and by every
 * compiler, as in the generator's interpreter. -fno-math-errno: sqrt is one instruction; nothing reads errno.
 * Neither -ffast-math nor -march=native is used: the first changes results, the second breaks a cache that
 * two machines share. */
static const char *const compile_flags[] = {"-std=c11",        "-O2", "-fPIC", "-ffp-contract=off",
                                            "-fno-math-errno", NULL};

/* These passes of gcc find nothing in emitted C, which already shares common values. Without them it compiles
 * in 0.6 of the time, and the result is as fast. The search for vectors in long blocks of scalars takes -O3
 * minutes and makes them slower; loops over arrays stay vectors. */
const char *const compile_gcc_flags[] = {"-fno-tree-slp-vectorize",
                                         "-fno-tree-pre",
                                         "-fno-gcse",
                                         "-fno-rerun-cse-after-loop",
                                         "-fno-tree-dominator-opts",
                                         "-fno-tree-vrp",
                                         "-fno-code-hoisting",
                                         "-fno-schedule-insns2",
                                         "-fno-ivopts",
                                         "-fno-tree-ccp",
                                         "-fno-dse",
                                         "-fno-cprop-registers",
                                         "-fno-forward-propagate",
                                         "-fira-region=one",
                                         "-fno-lra-remat",
                                         "-fno-caller-saves",
                                         "-fno-peephole2",
                                         "-fno-ree",
                                         "-fno-tree-dse",
                                         "-fno-ipa-cp",
                                         "-fno-ipa-icf",
                                         "-fno-ipa-sra",
                                         NULL};

/* clang also defines __GNUC__ */
static const char gcc_question[] = "#if !defined(__GNUC__) || defined(__clang__)\n#error not gcc\n#endif\n";

/* The additional flags for files for lanes of this width and its vectors. */
static const char *const *lanes_flags(int width) {
    static const char *const two[] = {"-DLANES=2", NULL}, *const four[] = {"-DLANES=4", "-mavx2", NULL},
                             *const eight[] = {"-DLANES=8", "-mavx512f", NULL};
    static const char *const four_apart[] = {"-DLANES=4", NULL}, *const eight_apart[] = {"-DLANES=8", NULL};
    const bool is_apart = width > refdyn_batch_widest(); /* the compiler splits the vectors */
    return width == 8 ? is_apart ? eight_apart : eight : width == 4 ? is_apart ? four_apart : four : two;
}

static const char blanks[] = " \t\n";

/* $CC is the file of a program, which may contain blanks, or a command of words separated by blanks ("ccache
 * gcc"). */
bool compile_toolchain_find(struct toolchain *chain) {
    const char *command = getenv("CC");
    if (!command || command[strspn(command, blanks)] == '\0')
        command = "cc";
    char *text = format_text("%s", command), *rest = NULL;
    const char **words = format_allocate(strlen(command) / 2 + 2, sizeof *words);
    int count = 0;
    if (strchr(command, '/') && access(command, X_OK) == 0)
        words[count++] = text;
    else
        for (char *word = strtok_r(text, blanks, &rest); word; word = strtok_r(NULL, blanks, &rest))
            words[count++] = word;
    chain->words = words;
    chain->program = system_process_find(chain->words[0]);
    if (!chain->program)
        fprintf(stderr, "refdyn: no C compiler '%s' is installed; $CC names another one\n", chain->words[0]);
    return chain->program;
}

static void object_job(struct job *job, const struct toolchain *chain, const struct build *build,
                       const char *name) {
    *job = (struct job){.source = system_scratch_file(&build->scratch, name)};
    compile_job_add_words(job, chain->words);
    job->object = format_text("%.*s.o", (int)strlen(job->source) - 2, job->source);
    job->log = format_text("%s.log", job->object);
    compile_job_add_words(job, compile_flags);
    if (build->lanes &&
        gen_is_for_lanes(name)) /* for vectors these passes, which scalars do without, gain a fifth */
        compile_job_add_words(job, lanes_flags(build->lanes));
    else if (build->is_gcc)
        compile_job_add_words(job, compile_gcc_flags);
    compile_job_add_words(job, (const char *[]){"-c", job->source, "-o", job->object, NULL});
}

/* Applies to gcc only, and to a version that knows all of its flags. */
static void question_job(struct job *job, const struct toolchain *chain, const struct scratch *scratch) {
    *job = (struct job){.source = system_scratch_file(scratch, "question.c")};
    compile_job_add_words(job, chain->words);
    job->log = format_text("%s.log", job->source);
    compile_job_add_words(job, compile_gcc_flags);
    compile_job_add_words(job, (const char *[]){"-fsyntax-only", job->source, NULL});
}

static void link_job(struct job *job, const struct toolchain *chain, const struct build *build,
                     const struct job *objects, int count) {
    *job = (struct job){.log = format_text("%s.log", build->library)};
    compile_job_add_words(job, chain->words);
    compile_job_add_word(job, "-shared");
    for (int i = 0; i < count; i++)
        compile_job_add_word(job, objects[i].object);
    compile_job_add_words(job, (const char *[]){"-o", build->library, "-lm", NULL});
}

/* The compiler's output is not shown. */
bool compile_toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch) {
    struct job job;
    struct process process;
    question_job(&job, chain, scratch);
    return system_scratch_write(scratch, "question.c", gcc_question, strlen(gcc_question)) &&
           system_process_start(&process, scratch, job.argv, NULL, job.log, NULL) == 0 &&
           system_process_wait(&process, 1) == 0 && process.result == 0;
}

static long file_size(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 ? (long)status.st_size : 0;
}

static bool compile_and_link(struct build *build, const struct toolchain *chain, struct job *jobs, int count,
                             struct build_cost *cost) {
    struct job link;
    double start = system_wall_seconds();
    if (!compile_jobs_run(&build->scratch, jobs, count, &cost->peak_kb))
        return false;
    link_job(&link, chain, build, jobs, count);
    bool is_good = compile_jobs_run(&build->scratch, &link, 1, &cost->peak_kb);
    cost->seconds = system_wall_seconds() - start;
    for (int i = 0; i < count; i++)
        cost->object_bytes += file_size(jobs[i].object);
    return is_good;
}

static bool is_source(const char *name) {
    const char *dot = strrchr(name, '.');
    return dot && strcmp(dot, ".c") == 0;
}

/* Writes files, compiles objects, links them. Reports an error on stderr with the compiler's own output. cost
 * may be NULL. */
static bool build_run(struct build *build, const struct toolchain *chain, const struct emitted_file *files,
                      int count, struct build_cost *cost) {
    struct build_cost own = {.seconds = 0};
    struct job *jobs = format_allocate((size_t)count, sizeof *jobs);
    int job_count = 0;
    bool is_good = system_scratch_write(&build->scratch, "refdyn_model.h", refdyn_model_header,
                                        refdyn_model_header_size) &&
                   system_scratch_write(&build->scratch, "refdyn_lanes.h", refdyn_lanes_header,
                                        refdyn_lanes_header_size);
    build->library = system_scratch_file(&build->scratch, "model.so");
    build->is_gcc = compile_toolchain_is_gcc(chain, &build->scratch);
    for (int i = 0; i < count && is_good; i++) {
        is_good = system_scratch_write(&build->scratch, files[i].name, files[i].text, files[i].length);
        if (is_good && is_source(files[i].name))
            object_job(&jobs[job_count++], chain, build, files[i].name);
    }
    is_good = is_good && compile_and_link(build, chain, jobs, job_count, &own);
    if (cost)
        *cost = own;
    return is_good;
}

/* ---- Libraries ---- */

static void hash_text(SHA2_CTX *sha, const char *text, size_t length) {
    uint64_t size = length; /* the length comes first, so that neighbouring texts cannot exchange letters */
    SHA256Update(sha, (const uint8_t *)&size, sizeof size);
    SHA256Update(sha, (const uint8_t *)text, length);
}

/* Identifies the compiler's file by name, size and time, so that a newer compiler of the same name counts as
 * another. */
static void hash_program(SHA2_CTX *sha, const char *path) {
    struct stat status;
    hash_text(sha, path, strlen(path));
    if (stat(path, &status) != 0)
        return;
    int64_t facts[] = {status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
    hash_text(sha, (const char *)facts, sizeof facts);
}

static void hash_words(SHA2_CTX *sha, const char *const *words) {
    for (; *words; words++)
        hash_text(sha, *words, strlen(*words));
}

static void hash_build(const struct toolchain *chain, const struct emitted_file *files, int count, int lanes,
                       char key[SHA256_DIGEST_STRING_LENGTH]) {
    SHA2_CTX sha;
    SHA256Init(&sha);
    hash_program(&sha, chain->program);
    hash_words(&sha, chain->words);
    hash_words(&sha, compile_flags);
    hash_words(&sha, compile_gcc_flags);
    hash_text(&sha, refdyn_model_header, refdyn_model_header_size);
    if (lanes) {
        hash_words(&sha, lanes_flags(lanes));
        hash_text(&sha, refdyn_lanes_header, refdyn_lanes_header_size);
    }
    for (int i = 0; i < count; i++) {
        hash_text(&sha, files[i].name, strlen(files[i].name));
        hash_text(&sha, files[i].text, files[i].length);
    }
    SHA256End(&sha, key);
}

static bool load(struct compiled *compiled, const char *name, const struct cache *cache, const char *key,
                 int lanes) {
    compiled->library = compile_cache_load(cache, key, &compiled->file);
    if (!compiled->library)
        return false;
    compiled->path = format_text("%s/%s.so", cache->path, key);
    compiled->model = dlsym(compiled->library, format_text("%s_model", name));
    compiled->spatial = dlsym(compiled->library, format_text("%s_spatial", name));
    if (lanes)
        compiled->lanes = dlsym(compiled->library, format_text("%s_lanes_%d", name, lanes));
    if (!compiled->model || (lanes && !compiled->lanes))
        compile_release(compiled);
    return compiled->model;
}

static bool build_into(const struct toolchain *chain, const struct emitted_file *files, int count, int lanes,
                       const struct cache *cache, const char *key) {
    struct build build = {.lanes = lanes};
    if (!system_scratch_open(&build.scratch, cache->path, "build-"))
        return false;
    const bool is_good =
        build_run(&build, chain, files, count, NULL) && compile_cache_add(cache, key, build.library);
    system_scratch_close(&build.scratch);
    return is_good;
}

static bool load_or_build(struct compiled *compiled, const char *name, const struct cache *cache,
                          const struct toolchain *chain, const struct emitted_file *files, int count,
                          int lanes) {
    char key[SHA256_DIGEST_STRING_LENGTH];
    hash_build(chain, files, count, lanes, key);
    if (load(compiled, name, cache, key, lanes))
        return true;
    if (!build_into(chain, files, count, lanes, cache, key))
        return false;
    if (load(compiled, name, cache, key, lanes))
        return true;
    const char *reason = dlerror();
    fprintf(stderr, "refdyn: %s/%s.so: cannot be loaded: %s\n", cache->path, key,
            reason ? reason : "it is not as it was written");
    return false;
}

bool compile_load(struct compiled *compiled, const char *name, const struct emitted_file *files, int count,
                  int lanes) {
    struct toolchain chain;
    struct cache cache;
    *compiled = (struct compiled){.file = -1};
    const bool is_loaded = compile_cache_open(&cache) && compile_toolchain_find(&chain) &&
                           load_or_build(compiled, name, &cache, &chain, files, count, lanes);
    compile_cache_close(&cache);
    return is_loaded;
}

void compile_release(struct compiled *compiled) {
    if (compiled->library) {
        dlclose(compiled->library);
        close(compiled->file);
    }
    *compiled = (struct compiled){.file = -1};
}

bool compile_measure(const struct emitted_file *files, int count, struct build_cost *cost) {
    struct toolchain chain;
    struct build build = {.lanes = 0};
    if (!compile_toolchain_find(&chain) ||
        !system_scratch_open(&build.scratch, system_scratch_parent(), "refdyn-build-"))
        return false;
    const bool is_good = build_run(&build, &chain, files, count, cost);
    system_scratch_close(&build.scratch);
    return is_good;
}
