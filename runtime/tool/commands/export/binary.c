/* Compiles the libraries of an FMU. No shell is involved, so paths may have any characters. */
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/system/system.h"

#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const struct platform platforms[] = {
    {.name = "linux64",
     .folder_3 = "x86_64-linux",
     .ending = ".so",
     .machine = "defined __linux__ && defined __x86_64__ && defined __LP64__",
     .compile_flags = {"-fPIC", "-fvisibility=hidden", NULL},
     .link_flags = {"-shared", "-s", NULL}},
    {.name = "win64",
     .folder_3 = "x86_64-windows",
     .ending = ".dll",
     .compiler = "x86_64-w64-mingw32-gcc",
     .package = "gcc-mingw-w64-x86-64",
     .compile_flags = {NULL},
     .link_flags = {"-shared", "-s", "-static", "-Wl,--no-insert-timestamp,--disable-auto-image-base", NULL}},
};
enum { PLATFORMS = sizeof platforms / sizeof *platforms };

/* The flags of compile_flags in compile.c, for the same reasons. */
static const char *const common_flags[] = {"-std=c11", "-O2", "-ffp-contract=off", "-fno-math-errno", NULL};

const struct platform *export_platform_find(const char *name) {
    for (int i = 0; i < PLATFORMS; i++)
        if (strcmp(platforms[i].name, name) == 0)
            return &platforms[i];
    return NULL;
}

const char *export_platform_names(void) {
    struct text text = {.memory = &format_memory};
    for (int i = 0; i < PLATFORMS; i++)
        text_add(&text, "%s%s", i ? ", " : "", platforms[i].name);
    return text.data;
}

/* One build in its own folder. */
struct fmu_build {
    const struct platform *platform;
    struct toolchain chain;
    struct cache cache;
    struct scratch scratch;
    bool is_gcc;
    long peak_kb;
};

static bool find_compiler(struct fmu_build *build) {
    const char *compiler = build->platform->compiler;
    if (!compiler)
        return compile_toolchain_find(&build->chain);
    const char **words = format_allocate(2, sizeof *words);
    words[0] = compiler;
    build->chain = (struct toolchain){.program = system_process_find(compiler), .words = words};
    if (!build->chain.program)
        fprintf(stderr, "refdyn: --platform %s: no %s is installed (Debian: apt install %s)\n",
                build->platform->name, compiler, build->platform->package);
    return build->chain.program;
}

/* Checks that $CC with its flags builds for the platform; otherwise reports it on stderr. */
static bool check_machine(const struct fmu_build *build) {
    const struct platform *platform = build->platform;
    if (!platform->machine)
        return true;
    const char *question = format_text("#if !(%s)\n#error of another machine\n#endif\n", platform->machine);
    const char *source = system_scratch_file(&build->scratch, "machine.c");
    struct job job = {.object = NULL};
    struct process process;
    compile_job_add_words(&job, build->chain.words);
    compile_job_add_words(&job, (const char *[]){"-fsyntax-only", source, NULL});
    if (!system_scratch_write(&build->scratch, "machine.c", question, strlen(question)))
        return false;
    const bool is_good =
        system_process_start(&process, &build->scratch, job.argv, NULL,
                             system_scratch_file(&build->scratch, "machine.log"), NULL) == 0 &&
        system_process_wait(&process, 1, NULL) == 0 && process.result == 0;
    if (!is_good)
        fprintf(stderr, "refdyn: --platform %s: $CC does not build for %s\n", platform->name,
                platform->folder_3);
    return is_good;
}

/* ---- Files ---- */

static bool write_sources(const struct fmu_build *build, const struct fmu *fmu) {
    for (int i = 0; i < carried_file_count; i++)
        if (!compile_write_carried(&build->scratch, &carried_files[i]))
            return false;
    for (int i = 0; i < fmu->sources.count; i++)
        if (!system_scratch_write(&build->scratch, fmu->sources.list[i].path, fmu->sources.list[i].text,
                                  fmu->sources.list[i].size))
            return false;
    return true;
}

/* ---- Jobs ---- */

static void begin_job(struct job *job, const struct fmu_build *build, const char *output) {
    *job = (struct job){.object = system_scratch_file(&build->scratch, output)};
    job->log = format_text("%s.log", job->object);
    compile_job_add_words(job, build->chain.words);
}

/* Emitted files are compiled without the passes of gcc that find nothing in them. */
static void object_job(struct job *job, const struct fmu_build *build, const char *path, bool is_emitted) {
    begin_job(job, build, format_text("%.*s.o", (int)strlen(path) - 2, path));
    compile_job_add_words(job, common_flags);
    compile_job_add_words(job, build->platform->compile_flags);
    if (is_emitted && build->is_gcc)
        compile_job_add_words(job, compile_gcc_flags);
    compile_job_add_words(job, (const char *[]){"-I", build->scratch.path, "-c",
                                                system_scratch_file(&build->scratch, path), "-o", job->object,
                                                NULL});
}

/* Returns whether the file is the same in all FMUs of both versions. */
static bool is_common(const char *path) {
    bool is_carried = false;
    for (int i = 0; i < carried_file_count; i++)
        is_carried |= strcmp(carried_files[i].path, path) == 0;
    return is_carried && !export_is_of_other_version(path, FMI_2) && !export_is_of_other_version(path, FMI_3);
}

/* ---- What all FMUs have in common ---- */

static void hash_text(SHA2_CTX *sha, const char *text, size_t size) {
    SHA256Update(sha, (const uint8_t *)text, size + 1); /* including the zero at the end */
}

static void hash_words(SHA2_CTX *sha, const char *const *words) {
    for (; *words; words++)
        hash_text(sha, *words, strlen(*words));
}

/* Hashes the compiler, the flags, and the source files and headers. */
static const char *make_key(const struct fmu_build *build) {
    char *key = format_allocate(SHA256_DIGEST_STRING_LENGTH, 1);
    SHA2_CTX sha;
    struct stat status = {.st_size = 0};
    stat(build->chain.program, &status);
    const int64_t facts[] = {status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
    SHA256Init(&sha);
    hash_words(&sha, build->chain.words);
    SHA256Update(&sha, (const uint8_t *)facts, sizeof facts);
    hash_words(&sha, common_flags);
    hash_words(&sha, build->platform->compile_flags);
    for (int i = 0; i < carried_file_count; i++) {
        if (!is_common(carried_files[i].path))
            continue;
        hash_text(&sha, carried_files[i].path, strlen(carried_files[i].path));
        hash_text(&sha, carried_files[i].text, carried_files[i].size);
    }
    SHA256End(&sha, key);
    return key;
}

/* Compiles all of them into one object. */
static bool compile_common(struct fmu_build *build, const char *key) {
    struct job *jobs = format_allocate((size_t)carried_file_count, sizeof *jobs), link;
    int count = 0;
    for (int i = 0; i < carried_file_count; i++)
        if (export_is_source(carried_files[i].path) && is_common(carried_files[i].path))
            object_job(&jobs[count++], build, carried_files[i].path, false);
    begin_job(&link, build, "common.o");
    compile_job_add_words(&link, (const char *[]){"-r", "-nostdlib", "-o", link.object, NULL});
    for (int i = 0; i < count; i++)
        compile_job_add_word(&link, jobs[i].object);
    return compile_jobs_run(&build->scratch, jobs, count, &build->peak_kb) &&
           compile_jobs_run(&build->scratch, &link, 1, &build->peak_kb) &&
           compile_cache_add(&build->cache, key, link.object);
}

/* The path of the common object in the cache; NULL after a reported error. */
static const char *common_object(struct fmu_build *build) {
    const char *key = make_key(build);
    const char *path = compile_cache_find(&build->cache, key);
    if (!path && compile_common(build, key))
        path = compile_cache_find(&build->cache, key);
    return path;
}

/* ---- The library ---- */

static bool link_library(struct fmu_build *build, const char *common, const struct job *jobs, int count,
                         const char *name) {
    struct job link;
    begin_job(&link, build, name);
    compile_job_add_words(&link, build->platform->link_flags);
    for (int i = 0; i < count; i++)
        compile_job_add_word(&link, jobs[i].object);
    compile_job_add_words(&link, (const char *[]){common, "-o", link.object, "-lm", NULL});
    return compile_jobs_run(&build->scratch, &link, 1, &build->peak_kb);
}

static bool compile_library(struct fmu_build *build, const struct fmu *fmu, const char *name) {
    const char *common = common_object(build);
    struct job *jobs = format_allocate((size_t)fmu->sources.count, sizeof *jobs);
    int count = 0;
    for (int i = 0; i < fmu->sources.count; i++) {
        const char *path = fmu->sources.list[i].path;
        if (export_is_source(path) && !is_common(path))
            object_job(&jobs[count++], build, path, true);
    }
    return common && compile_jobs_run(&build->scratch, jobs, count, &build->peak_kb) &&
           link_library(build, common, jobs, count, name);
}

static bool add_library(struct fmu *fmu, const struct fmu_build *build, const char *name) {
    char *text;
    size_t size;
    const struct platform *platform = build->platform;
    FILE *out = format_stream(&text, &size);
    const bool is_good = system_copy_file(system_scratch_file(&build->scratch, name), out);
    fclose(out);
    const char *folder = fmu->version == FMI_2 ? platform->name : platform->folder_3;
    if (is_good)
        export_files_add(&fmu->files, format_text("binaries/%s/%s", folder, name), text, size);
    return is_good;
}

bool export_binary_make(struct fmu *fmu, const struct platform *platform) {
    struct fmu_build build = {.platform = platform};
    const char *name = format_text("%s%s", fmu->name, platform->ending);
    bool is_good = compile_cache_open(&build.cache) && find_compiler(&build);
    const bool is_open = is_good && compile_cache_scratch(&build.cache, &build.scratch);
    is_good = is_open && check_machine(&build) && write_sources(&build, fmu);
    build.is_gcc = is_good && compile_toolchain_is_gcc(&build.chain, &build.scratch);
    is_good = is_good && compile_library(&build, fmu, name) && add_library(fmu, &build, name);
    if (is_open)
        system_scratch_close(&build.scratch);
    compile_cache_close(&build.cache);
    return is_good;
}
