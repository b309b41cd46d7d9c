/* Compiles the module of a live page to WebAssembly: the core and the records, which are the same in all
 * pages, once; then the model. Both are kept in the cache. */
#include "runtime/tool/results/live/live.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The flags of compile_flags, for the same reasons. */
static const char *const flags[] = {"--target=wasm32-wasi",
                                    "-std=c11",
                                    "-D_POSIX_C_SOURCE=200809L",
                                    "-O2",
                                    "-ffp-contract=off",
                                    "-fno-math-errno",
                                    "-w",
                                    NULL};
/* The stack precedes the data, so that an overflow ends the module instead of changing values. 4 MiB suffice
 * for the large blocks of emitted C. */
static const char *const link_flags[] = {"--target=wasm32-wasi", "-mexec-model=reactor",
                                         "-Wl,--stack-first,-z,stack-size=4194304,--strip-all", NULL};
static const char *const question = "#include <stdio.h>\n#include <math.h>\nint question;\n";

struct module_build {
    struct toolchain chain;
    struct cache cache;
    struct scratch scratch;
    long peak_kb;
};

/* ---- The compiler ---- */

static bool report_missing(const char *what) {
    fprintf(stderr,
            "refdyn: view --live: %s; it compiles to WebAssembly with clang, lld, wasi-libc and "
            "libclang-rt-dev-wasm32 (Debian: apt install clang lld wasi-libc libclang-rt-dev-wasm32)\n",
            what);
    return false;
}

/* clang, or the compiler that REFDYN_WASM_CC names. */
static bool find_compiler(struct module_build *build) {
    const char *own = getenv("REFDYN_WASM_CC");
    const char **words = format_allocate(2, sizeof *words);
    words[0] = own && *own ? own : "clang";
    build->chain = (struct toolchain){.program = system_process_find(words[0]), .words = words};
    return build->chain.program || report_missing(format_text("no compiler '%s' is installed", words[0]));
}

static bool runs(const struct module_build *build, const struct job *job) {
    struct process process;
    return system_process_start(&process, &build->scratch, job->argv, NULL, job->log, NULL) == 0 &&
           system_process_wait(&process, 1, NULL) == 0 && process.result == 0;
}

/* Compiles and links a file with the headers of wasi-libc, so that a missing package has a clear message. */
static bool check_compiler(const struct module_build *build) {
    const char *source = system_scratch_file(&build->scratch, "question.c");
    struct job job = {.log = system_scratch_file(&build->scratch, "question.log")};
    compile_job_add_words(&job, build->chain.words);
    compile_job_add_words(&job, link_flags);
    compile_job_add_words(
        &job, (const char *[]){source, "-o", system_scratch_file(&build->scratch, "question.wasm"), NULL});
    if (!system_scratch_write(&build->scratch, "question.c", question, strlen(question)))
        return false;
    return runs(build, &job) ||
           report_missing(format_text("'%s' does not build for wasm32-wasi", build->chain.words[0]));
}

/* ---- Files and names ---- */

/* Headers of the public interface, the core, and the files of the page; not the bindings for FMUs. */
static bool is_of_module(const struct carried_file *file) {
    const char *bindings = "runtime/bindings/";
    return strncmp(file->path, bindings, strlen(bindings)) != 0;
}

static void hash_text(SHA2_CTX *sha, const char *text, size_t size) {
    SHA256Update(sha, (const uint8_t *)&size, sizeof size);
    SHA256Update(sha, (const uint8_t *)text, size);
}

static void hash_words(SHA2_CTX *sha, const char *const *words) {
    for (; *words; words++)
        hash_text(sha, *words, strlen(*words));
}

/* Hashes the compiler, the flags and the sources of all pages; `model` is the C of one model, or "". */
static const char *make_key(const struct module_build *build, const char *model, size_t size) {
    char *key = format_allocate(SHA256_DIGEST_STRING_LENGTH, 1);
    struct stat status = {.st_size = 0};
    SHA2_CTX sha;
    stat(build->chain.program, &status);
    const int64_t facts[] = {status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
    SHA256Init(&sha);
    hash_text(&sha, build->chain.program, strlen(build->chain.program));
    hash_text(&sha, (const char *)facts, sizeof facts);
    hash_words(&sha, flags);
    hash_words(&sha, link_flags);
    for (int i = 0; i < carried_file_count_all; i++)
        if (is_of_module(&carried_files[i])) {
            hash_text(&sha, carried_files[i].path, strlen(carried_files[i].path));
            hash_text(&sha, carried_files[i].text, carried_files[i].size);
        }
    hash_text(&sha, model, size);
    SHA256End(&sha, key);
    return key;
}

/* All texts of the model's C, one after another. */
static char *model_texts(const struct live *live, const char *own, size_t *size) {
    const struct generation *generation = &live->scene.generation;
    const struct emitted_file *files = gen_files(generation);
    char *text;
    FILE *out = format_stream(&text, size);
    for (int i = 0; i < gen_file_count(generation); i++)
        fprintf(out, "%s\n%s", files[i].name, files[i].text);
    fputs(own, out);
    fclose(out);
    return text;
}

static bool write_carried(const struct module_build *build) {
    for (int i = 0; i < carried_file_count_all; i++)
        if (is_of_module(&carried_files[i]) && !compile_write_carried(&build->scratch, &carried_files[i]))
            return false;
    return true;
}

static bool write_model(const struct module_build *build, const struct live *live, const char *own) {
    const struct generation *generation = &live->scene.generation;
    const struct emitted_file *files = gen_files(generation);
    bool is_good = system_scratch_write(&build->scratch, "live_model_text.c", own, strlen(own));
    for (int i = 0; i < gen_file_count(generation) && is_good; i++)
        is_good = system_scratch_write(&build->scratch, files[i].name, files[i].text, files[i].length);
    return is_good;
}

/* ---- Jobs ---- */

static void object_job(struct job *job, const struct module_build *build, const char *path) {
    *job = (struct job){.source = system_scratch_file(&build->scratch, path)};
    job->object = format_text("%s.o", job->source);
    job->log = format_text("%s.log", job->source);
    compile_job_add_words(job, build->chain.words);
    compile_job_add_words(job, flags);
    compile_job_add_words(
        job, (const char *[]){"-I", build->scratch.path, "-c", job->source, "-o", job->object, NULL});
}

/* Links the objects: with the C library into a module, or into one object. */
static bool link_objects(struct module_build *build, const struct job *jobs, int count, const char *common,
                         const char *result) {
    struct job job = {.object = system_scratch_file(&build->scratch, result)};
    job.log = format_text("%s.log", job.object);
    compile_job_add_words(&job, build->chain.words);
    if (common)
        compile_job_add_words(&job, link_flags);
    else
        compile_job_add_words(&job, (const char *[]){flags[0], "-r", "-nostdlib", NULL});
    for (int i = 0; i < count; i++)
        compile_job_add_word(&job, jobs[i].object);
    if (common)
        compile_job_add_word(&job, common);
    compile_job_add_words(&job, (const char *[]){"-o", job.object, NULL});
    return compile_jobs_run(&build->scratch, &job, 1, &build->peak_kb);
}

static bool ends_with_c(const char *path) {
    return text_ends_with(path, ".c");
}

static bool compile_common(struct module_build *build, const char *key) {
    struct job *jobs = format_allocate((size_t)carried_file_count_all, sizeof *jobs);
    int count = 0;
    for (int i = 0; i < carried_file_count_all; i++)
        if (is_of_module(&carried_files[i]) && ends_with_c(carried_files[i].path))
            object_job(&jobs[count++], build, carried_files[i].path);
    return compile_jobs_run(&build->scratch, jobs, count, &build->peak_kb) &&
           link_objects(build, jobs, count, NULL, "common.o") &&
           compile_cache_add(&build->cache, key, system_scratch_file(&build->scratch, "common.o"));
}

/* Writes the object that all pages share, without the seal of the cache, which the linker would refuse. */
static bool provide_common(struct module_build *build) {
    const char *key = make_key(build, "", 0);
    size_t size;
    char *object = compile_cache_read(&build->cache, key, &size);
    if (!object && compile_common(build, key))
        object = compile_cache_read(&build->cache, key, &size);
    const bool is_good = object && system_scratch_write(&build->scratch, "all_pages.o", object, size);
    free(object);
    return is_good;
}

static bool compile_module(struct module_build *build, const struct live *live, const char *own,
                           const char *key) {
    const struct generation *generation = &live->scene.generation;
    const struct emitted_file *files = gen_files(generation);
    struct job *jobs = format_allocate((size_t)gen_file_count(generation) + 1, sizeof *jobs);
    int count = 0;
    if (!check_compiler(build) || !write_carried(build) || !write_model(build, live, own) ||
        !provide_common(build))
        return false;
    object_job(&jobs[count++], build, "live_model_text.c");
    for (int i = 0; i < gen_file_count(generation); i++)
        if (ends_with_c(files[i].name))
            object_job(&jobs[count++], build, files[i].name);
    return compile_jobs_run(&build->scratch, jobs, count, &build->peak_kb) &&
           link_objects(build, jobs, count, system_scratch_file(&build->scratch, "all_pages.o"),
                        "module.wasm") &&
           compile_cache_add(&build->cache, key, system_scratch_file(&build->scratch, "module.wasm"));
}

static char *own_text(const struct live *live) {
    char *text;
    size_t size;
    FILE *out = format_stream(&text, &size);
    live_model_put(out, live);
    fclose(out);
    return text;
}

char *live_module_make(const struct live *live, size_t *size) {
    struct module_build build = {.peak_kb = 0};
    char *module = NULL;
    if (!find_compiler(&build))
        return NULL;
    if (compile_cache_open(&build.cache)) {
        size_t length;
        char *own = own_text(live), *texts = model_texts(live, own, &length);
        const char *key = make_key(&build, texts, length);
        module = compile_cache_read(&build.cache, key, size);
        if (!module && compile_cache_scratch(&build.cache, &build.scratch)) {
            if (compile_module(&build, live, own, key))
                module = compile_cache_read(&build.cache, key, size);
            system_scratch_close(&build.scratch);
        }
        free(own);
        free(texts);
    }
    compile_cache_close(&build.cache);
    return module;
}
