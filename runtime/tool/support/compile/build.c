/*
 * One build of emitted C into a library, in a temporary folder: the optimised library by $CC, file by file,
 * or the first tier by one run of its compiler. No shell is involved, so paths may have any characters.
 */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* One build of emitted C in its own folder. */
struct build {
    struct scratch scratch; /* the open folder */
    const char *library;    /* the linked library in it */
    bool is_gcc;            /* the compiler */
    int lanes;              /* width of the files for lanes; 0 if there are none */
};

static void object_job(struct job *job, const struct toolchain *chain, const struct build *build,
                       const char *name) {
    *job = (struct job){.source = system_scratch_file(&build->scratch, name)};
    compile_job_add_words(job, chain->words);
    job->object = format_text("%.*s.o", (int)strlen(job->source) - 2, job->source);
    job->log = format_text("%s.log", job->object);
    compile_job_add_words(job, compile_flags);
    if (build->lanes &&
        gen_is_for_lanes(name)) /* for vectors these passes, which scalars do without, gain a fifth */
        compile_job_add_words(job, compile_lanes_flags(build->lanes));
    else if (build->is_gcc)
        compile_job_add_words(job, compile_gcc_flags);
    compile_job_add_words(job, (const char *[]){"-c", job->source, "-o", job->object, NULL});
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

static bool write_files(const struct build *build, const struct emitted *emitted) {
    bool is_good = system_scratch_write(&build->scratch, "refdyn_model.h", refdyn_model_header,
                                        refdyn_model_header_size) &&
                   system_scratch_write(&build->scratch, "refdyn_lanes.h", refdyn_lanes_header,
                                        refdyn_lanes_header_size);
    for (int i = 0; i < emitted->count && is_good; i++) {
        const struct emitted_file *file = &emitted->files[i];
        is_good = system_scratch_write(&build->scratch, file->name, file->text, file->length);
    }
    return is_good;
}

/* Makes the folders of a path inside the temporary folder. */
static bool make_folders(const struct scratch *scratch, const char *path) {
    const char *slash = strrchr(path, '/');
    if (!slash)
        return true;
    const char *folder = system_scratch_file(scratch, format_text("%.*s", (int)(slash - path), path));
    if (system_make_folder(folder, 0700, NULL))
        return true;
    format_complain("refdyn: %s: cannot be made\n", folder);
    return false;
}

bool compile_write_carried(const struct scratch *scratch, const struct carried_file *file) {
    return make_folders(scratch, file->path) &&
           system_scratch_write(scratch, file->path, file->text, file->size);
}

/* Writes files, compiles objects, links them. Reports an error on stderr with the compiler's own output. cost
 * may be NULL. */
static bool build_run(struct build *build, const struct toolchain *chain, const struct emitted *emitted,
                      struct build_cost *cost) {
    struct build_cost own = {.seconds = 0};
    struct job *jobs = format_allocate((size_t)emitted->count, sizeof *jobs);
    int job_count = 0;
    bool is_good = write_files(build, emitted);
    build->is_gcc = is_good && compile_toolchain_is_gcc(chain, &build->scratch);
    for (int i = 0; i < emitted->count && is_good; i++)
        if (is_source(emitted->files[i].name))
            object_job(&jobs[job_count++], chain, build, emitted->files[i].name);
    is_good = is_good && compile_and_link(build, chain, jobs, job_count, &own);
    if (cost)
        *cost = own;
    return is_good;
}

/* One run for all files: starting the compiler again would take as long as its work. */
static bool run_first(const struct build *build, const struct toolchain *first,
                      const struct emitted *emitted) {
    struct job job = {.log = format_text("%s.log", build->library)};
    compile_job_add_words(&job, first->words);
    for (int i = 0; i < emitted->count; i++)
        if (is_source(emitted->files[i].name))
            compile_job_add_word(&job, system_scratch_file(&build->scratch, emitted->files[i].name));
    compile_job_add_words(&job, (const char *[]){"-o", build->library, "-lm", NULL});
    return compile_job_succeeds(&build->scratch, &job, format_text("compiling %s", emitted->name));
}

static const char *library_of(const struct build *build) {
    return system_scratch_file(&build->scratch, "model.so");
}

static enum build_outcome run_tier(struct build *build, const struct toolchain *chain,
                                   const struct emitted *emitted, bool is_first) {
    if (!is_first)
        return build_run(build, chain, emitted, NULL) ? BUILD_DONE : BUILD_FAILED;
    if (!write_files(build, emitted))
        return BUILD_FAILED;
    return run_first(build, chain, emitted) ? BUILD_DONE : BUILD_REFUSED;
}

enum build_outcome compile_build(const struct cache *cache, const char *key, const struct toolchain *chain,
                                 const struct emitted *emitted, bool is_first) {
    struct build build = {.lanes = emitted->lanes};
    if (!compile_cache_scratch(cache, &build.scratch))
        return BUILD_FAILED;
    build.library = library_of(&build);
    enum build_outcome outcome = run_tier(&build, chain, emitted, is_first);
    if (outcome == BUILD_DONE && !compile_cache_add(cache, key, build.library))
        outcome = BUILD_FAILED;
    system_scratch_close(&build.scratch);
    return outcome;
}

bool compile_measure(const struct emitted *emitted, struct build_cost *cost) {
    struct toolchain chain;
    struct build build = {.lanes = 0};
    if (!compile_toolchain_find(&chain) ||
        !system_scratch_open(&build.scratch, system_scratch_parent(), "refdyn-build-"))
        return false;
    build.library = library_of(&build);
    const bool is_good = build_run(&build, &chain, emitted, cost);
    system_scratch_close(&build.scratch);
    return is_good;
}
