/* Turns emitted C into a loaded library: looks it up in the cache (compiled_cache.c), or builds it
 * (build_job.c). */
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"

#include <dlfcn.h>
#include <sha2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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
    hash_words(&sha, gcc_flags);
    hash_text(&sha, refdyn_model_header, refdyn_model_header_size);
    if (lanes) {
        hash_words(&sha, compile_lanes_flags(lanes));
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
        compile_build_run(&build, chain, files, count, NULL) && compile_cache_add(cache, key, build.library);
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
    const bool is_good = compile_build_run(&build, &chain, files, count, cost);
    system_scratch_close(&build.scratch);
    return is_good;
}
