/*
 * Turns emitted C into a loaded library, from the cache (compiled_cache.c) if it is there.
 *
 * A library exists in up to two tiers: the optimised one, by $CC, and the first tier, by the fastest compiler
 * at hand. Both compute the same bits. While a command works with the first tier, the optimised library is
 * compiled in the background, and the command may change over to it.
 *
 * The name of a library in the cache is the SHA-256 of all its sources: the texts, the compiler's file,
 * size and time, and the flags.
 */
#include <dlfcn.h>
#include <sha2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- Names ---- */

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

/* The SHA-256 of all sources, once for both tiers. */
static const char *hash_emitted(const struct emitted *emitted) {
    char *hash = format_allocate(SHA256_DIGEST_STRING_LENGTH, 1);
    SHA2_CTX sha;
    SHA256Init(&sha);
    hash_text(&sha, refdyn_model_header, refdyn_model_header_size);
    if (emitted->lanes) {
        hash_words(&sha, compile_lanes_flags(emitted->lanes));
        hash_text(&sha, refdyn_lanes_header, refdyn_lanes_header_size);
    }
    for (int i = 0; i < emitted->count; i++) {
        hash_text(&sha, emitted->files[i].name, strlen(emitted->files[i].name));
        hash_text(&sha, emitted->files[i].text, emitted->files[i].length);
    }
    SHA256End(&sha, hash);
    return hash;
}

/* The words of a first compiler contain its flags. */
static const char *key_of(const struct toolchain *chain, bool is_first, const char *sources) {
    char *key = format_allocate(SHA256_DIGEST_STRING_LENGTH, 1);
    SHA2_CTX sha;
    SHA256Init(&sha);
    hash_program(&sha, chain->program);
    hash_words(&sha, chain->words);
    if (!is_first) {
        hash_words(&sha, compile_flags);
        hash_words(&sha, compile_gcc_flags);
    }
    hash_text(&sha, sources, strlen(sources));
    SHA256End(&sha, key);
    return key;
}

/* ---- Loading ---- */

static const double look_seconds = 0.05; /* between two looks for the optimised library */

const struct compiled compile_nothing = {.cache = {.folder = -1}};

static bool load(struct compiled *compiled, const struct emitted *emitted, const char *key) {
    void *library = compile_cache_load(&compiled->cache, key);
    if (!library)
        return false;
    compiled->path = format_text("%s/%s.so", compiled->cache.path, key);
    compiled->model = dlsym(library, format_text("%s_model", emitted->name));
    compiled->spatial = dlsym(library, format_text("%s_spatial", emitted->name));
    if (emitted->lanes)
        compiled->lanes = dlsym(library, format_text("%s_lanes_%d", emitted->name, emitted->lanes));
    if (compiled->model && (compiled->lanes || !emitted->lanes)) {
        compiled->libraries[0] = library;
        return true;
    }
    dlclose(library);
    return false;
}

static void pause_briefly(void) {
    const struct timespec pause = {.tv_nsec = 2000000}; /* short compared with a compilation */
    nanosleep(&pause, NULL);
}

/* Waits until no other program builds this library. Returns false if this program should end. */
static bool claim(struct scratch *claimed, const struct compiled *compiled, const struct emitted *emitted,
                  const char *key) {
    struct notice notice;
    system_notice_start(&notice, format_text("another refdyn is compiling %s", emitted->name));
    while (!compile_cache_claim(&compiled->cache, key, claimed) && !system_interrupt_is_new()) {
        system_notice_show(&notice);
        pause_briefly();
    }
    system_notice_end(&notice);
    return !system_interrupt_is_new();
}

static enum build_outcome report_unloadable(const struct compiled *compiled, const char *key) {
    const char *reason = dlerror();
    format_complain("refdyn: %s/%s.so: cannot be loaded: %s\n", compiled->cache.path, key,
                    reason ? reason : "it is not as it was written");
    compile_cache_drop(&compiled->cache, key);
    return BUILD_FAILED;
}

/* Loads a library, and builds it before if no other program has done so meanwhile. Drops one that cannot be
 * loaded. */
static enum build_outcome provide(struct compiled *compiled, const struct emitted *emitted,
                                  const struct toolchain *chain, const char *key, bool is_first) {
    struct scratch claimed;
    if (load(compiled, emitted, key))
        return BUILD_DONE;
    if (!claim(&claimed, compiled, emitted, key))
        return BUILD_FAILED;
    bool is_loaded = load(compiled, emitted, key);
    enum build_outcome outcome = BUILD_DONE;
    if (!is_loaded)
        outcome = compile_build(&compiled->cache, key, chain, emitted, is_first);
    is_loaded = is_loaded || (outcome == BUILD_DONE && load(compiled, emitted, key));
    compile_cache_unclaim(&claimed);
    return outcome == BUILD_DONE && !is_loaded ? report_unloadable(compiled, key) : outcome;
}

/* The optimised library, for a process in the background. */
struct optimised {
    const struct toolchain *chain;
    const struct emitted *emitted;
    const char *key;
};

static bool provide_optimised(const struct cache *cache, void *what) {
    const struct optimised *optimised = what;
    struct compiled compiled = {.cache = *cache};
    return provide(&compiled, optimised->emitted, optimised->chain, optimised->key, false) == BUILD_DONE;
}

/* Loads the optimised library if it is there, otherwise the first tier; or builds what the tier says. */
static bool load_or_build(struct compiled *compiled, const struct emitted *emitted, enum compile_tier tier) {
    struct toolchain chain, first;
    if (!compile_toolchain_find(&chain))
        return false;
    const char *sources = hash_emitted(emitted), *key = key_of(&chain, false, sources);
    enum build_outcome outcome = BUILD_REFUSED;
    if (load(compiled, emitted, key))
        return true;
    if (tier != COMPILE_OPTIMISED && !emitted->lanes && compile_toolchain_first(&first, &chain))
        outcome = provide(compiled, emitted, &first, key_of(&first, true, sources), true);
    if (outcome == BUILD_REFUSED)
        return provide(compiled, emitted, &chain, key, false) == BUILD_DONE;
    if (outcome != BUILD_DONE)
        return false;
    compiled->awaited = format_text("%s.so", key);
    struct optimised optimised = {.chain = &chain, .emitted = emitted, .key = key};
    if (tier == COMPILE_FIRST)
        compile_in_background(&compiled->cache, key, emitted->name, provide_optimised, &optimised);
    return true;
}

/* Reads REFDYN_BACKGROUND: 0 leaves the optimised tier alone. */
static bool choose_tier(enum compile_tier *tier) {
    const char *text = getenv("REFDYN_BACKGROUND");
    if (text && strcmp(text, "0") == 0)
        *tier = COMPILE_OPTIMISED;
    if (!text || !*text || strcmp(text, "0") == 0 || strcmp(text, "1") == 0)
        return true;
    format_complain("refdyn: REFDYN_BACKGROUND: '%s': must be 0 or 1\n", text);
    return false;
}

bool compile_load(struct compiled *compiled, const struct emitted *emitted, enum compile_tier tier) {
    *compiled = compile_nothing;
    if (!choose_tier(&tier) || !compile_cache_open(&compiled->cache))
        return false;
    compile_cache_clean(&compiled->cache);
    return load_or_build(compiled, emitted, tier);
}

const char *compile_awaited_path(const struct compiled *compiled) {
    return compiled->awaited ? format_text("%s/%s", compiled->cache.path, compiled->awaited) : NULL;
}

const struct refdyn_model *compile_follow(struct compiled *compiled) {
    const double now = compiled->awaited ? system_wall_seconds() : 0;
    if (now < compiled->next_look || !compiled->awaited)
        return NULL;
    compiled->next_look = now + look_seconds;
    if (faccessat(compiled->cache.folder, compiled->awaited, R_OK, 0) != 0)
        return NULL;
    const char *key = format_text("%.*s", (int)strlen(compiled->awaited) - 3, compiled->awaited);
    compiled->awaited = NULL;
    void *library = compile_cache_load(&compiled->cache, key);
    compiled->libraries[1] = library;
    return library ? dlsym(library, format_text("%s_model", compiled->model->name)) : NULL;
}

void compile_release(struct compiled *compiled) {
    for (int i = 0; i < LIBRARIES; i++)
        if (compiled->libraries[i])
            dlclose(compiled->libraries[i]);
    if (compiled->cache.path)
        compile_cache_close(&compiled->cache);
    *compiled = compile_nothing;
}
