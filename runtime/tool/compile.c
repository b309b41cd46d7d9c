/* Emitted C to a loaded library: see compile.h. What the compiler is told, the cache and loading; build.c
 * compiles. */
#include "compile.h"
#include "build.h"
#include "flags.h"
#include "output.h"

#include <dlfcn.h>
#include <errno.h>
#include <sha2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void hash_text(SHA2_CTX *sha, const char *text, size_t length) {
    uint64_t size = length; /* first, so that neighbours cannot trade letters */
    SHA256Update(sha, (const uint8_t *)&size, sizeof size);
    SHA256Update(sha, (const uint8_t *)text, length);
}

/* The compiler's file by name, size and time: a newer compiler of the same name is another one. */
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

static void hash_build(const struct toolchain *chain, const struct emitted_file *files, int count,
                       char key[SHA256_DIGEST_STRING_LENGTH]) {
    SHA2_CTX sha;
    SHA256Init(&sha);
    hash_program(&sha, chain->program);
    for (int i = 0; i < chain->word_count; i++)
        hash_text(&sha, chain->words[i], strlen(chain->words[i]));
    hash_words(&sha, compile_flags);
    hash_words(&sha, gcc_flags);
    hash_text(&sha, refdyn_model_header, refdyn_model_header_size);
    for (int i = 0; i < count; i++) {
        hash_text(&sha, files[i].name, strlen(files[i].name));
        hash_text(&sha, files[i].text, files[i].length);
    }
    SHA256End(&sha, key);
}

static bool make_folders(char *path) {
    for (char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(path, 0777); /* what is there already is fine; the last mkdir tells */
        *slash = '/';
    }
    return mkdir(path, 0777) == 0 || errno == EEXIST;
}

/* $REFDYN_CACHE, or NULL with a complaint. */
static char *own_folder(const char *own) {
    char *path = text_format("%s", own);
    if (make_folders(path))
        return path;
    fprintf(stderr, "refdyn: %s: cannot make the cache folder: %s; REFDYN_CACHE names another one\n", path,
            strerror(errno));
    free(path);
    return NULL;
}

/* In the XDG cache folder, or NULL where this user has none that can be written. */
static char *xdg_folder(void) {
    const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    char *path = NULL;
    if (xdg && *xdg == '/')
        path = text_format("%s/refdyn", xdg);
    else if (home && *home == '/')
        path = text_format("%s/.cache/refdyn", home);
    if (path && make_folders(path) && access(path, W_OK | X_OK) == 0)
        return path;
    free(path);
    return NULL;
}

/* For users without a home; nobody else may write there, since what lies there is loaded. */
static char *temporary_folder(void) {
    const char *parent = getenv("TMPDIR");
    char *path = text_format("%s/refdyn-%ld", parent && *parent ? parent : "/tmp", (long)getuid());
    struct stat status;
    if ((mkdir(path, 0700) == 0 || errno == EEXIST) && lstat(path, &status) == 0 && S_ISDIR(status.st_mode) &&
        status.st_uid == getuid() && (status.st_mode & (S_IWGRP | S_IWOTH)) == 0)
        return path;
    fprintf(stderr,
            "refdyn: no folder for compiled models, %s is not yours alone: set REFDYN_CACHE or HOME\n", path);
    free(path);
    return NULL;
}

/* The cache folder's path, or NULL with a complaint. */
static char *cache_folder(void) {
    const char *own = getenv("REFDYN_CACHE");
    if (own && *own)
        return own_folder(own);
    char *path = xdg_folder();
    return path ? path : temporary_folder();
}

static bool load(struct compiled *compiled, const char *name, const char *path) {
    compiled->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!compiled->library)
        return false;
    char *symbol = text_format("%s_model", name);
    compiled->model = dlsym(compiled->library, symbol);
    free(symbol);
    if (!compiled->model)
        compile_release(compiled);
    return compiled->model != NULL;
}

/* Builds beside `path` and renames; two processes that do so at once make the same file. */
static bool build_into(const struct toolchain *chain, const struct emitted_file *files, int count,
                       const char *folder, const char *path) {
    struct build build;
    if (!build_start(&build, folder))
        return false;
    bool is_good = build_run(&build, chain, files, count, NULL);
    if (is_good && rename(build.library, path) != 0) {
        fprintf(stderr, "refdyn: %s: cannot be made: %s\n", path, strerror(errno));
        is_good = false;
    }
    build_release(&build);
    return is_good;
}

bool compile_load(struct compiled *compiled, const char *name, const struct emitted_file *files, int count) {
    struct toolchain chain;
    *compiled = (struct compiled){.library = NULL};
    char *folder = cache_folder();
    if (!folder || !toolchain_find(&chain)) {
        free(folder);
        return false;
    }
    char key[SHA256_DIGEST_STRING_LENGTH];
    hash_build(&chain, files, count, key);
    char *path = text_format("%s/%s.so", folder, key);
    bool is_loaded = access(path, R_OK) == 0 && load(compiled, name, path);
    if (!is_loaded && build_into(&chain, files, count, folder, path)) {
        is_loaded = load(compiled, name, path);
        if (!is_loaded)
            fprintf(stderr, "refdyn: %s: cannot be loaded: %s\n", path, dlerror());
    }
    free(path);
    free(folder);
    toolchain_release(&chain);
    return is_loaded;
}

void compile_release(struct compiled *compiled) {
    if (compiled->library)
        dlclose(compiled->library);
    *compiled = (struct compiled){.library = NULL};
}

bool compile_measure(const struct emitted_file *files, int count, struct build_cost *cost) {
    const char *folder = getenv("TMPDIR");
    struct toolchain chain;
    struct build build;
    if (!toolchain_find(&chain))
        return false;
    bool is_good = build_start(&build, folder && *folder ? folder : "/tmp");
    if (is_good) {
        is_good = build_run(&build, &chain, files, count, cost);
        build_release(&build);
    }
    toolchain_release(&chain);
    return is_good;
}
