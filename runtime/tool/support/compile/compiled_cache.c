/*
 * The cache of compiled libraries: finds its folder, checks it, seals and loads libraries.
 *
 * The program loads and runs the libraries in it, so only this user may own them. The cache refuses folders
 * that others own or may write into, and accepts only plain files of this user that nobody else may write.
 * Each library ends with the SHA-256 of its contents, so that a truncated or damaged one is built again
 * instead of loaded.
 */
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* The end of a sealed library: this text, the SHA-256 in hexadecimal digits, and a zero. */
static const char seal_lead[] = "refdyn seal ";

enum { SEAL_LENGTH = sizeof seal_lead - 1 + SHA256_DIGEST_STRING_LENGTH };

/* ---- Whose it is ---- */

static bool is_ours(const struct stat *status) {
    return status->st_uid == geteuid() && (status->st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

/* Whether everybody may rename the files of others in this folder above the cache: all may write to it and it
 * has no sticky bit. Other rights do no harm, because the folder of the cache and the libraries are checked
 * when they are opened. */
static const char *find_open_parent(const char *path) {
    char *parent = format_text("%s", path);
    for (char *slash; (slash = strrchr(parent, '/'));) {
        struct stat status;
        slash[slash == parent] = '\0';
        if (stat(parent, &status) != 0 || ((status.st_mode & S_IWOTH) && !(status.st_mode & S_ISVTX)))
            return parent;
        if (slash == parent)
            break;
    }
    return NULL;
}

/* What is wrong with an existing folder; NULL if nothing is. */
static const char *find_danger(const struct cache *cache) {
    struct stat status;
    if (fstat(cache->folder, &status) != 0)
        return strerror(errno);
    if (status.st_uid != geteuid())
        return "it belongs to another user, who could put code there";
    if (!is_ours(&status))
        return "others may write there (chmod go-w)";
    const char *parent = find_open_parent(cache->path);
    return parent ? format_text("everybody may rename folders in %s", parent) : NULL;
}

/* ---- Which one ---- */

/* Opens the folder and makes it if it is missing. Returns the reason if that fails; NULL if it is open. */
static const char *open_folder(struct cache *cache, const char *path, int flags) {
    if (!system_make_folder(path, 0700, NULL))
        return strerror(errno);
    cache->path = realpath(path, format_allocate(PATH_MAX, 1));
    cache->folder = cache->path ? open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC | flags) : -1;
    const char *reason = cache->folder < 0 ? strerror(errno) : find_danger(cache);
    if (reason)
        compile_cache_close(cache);
    return reason;
}

/* Tries $REFDYN_CACHE. */
static bool open_own(struct cache *cache, const char *path) {
    const char *reason = open_folder(cache, path, 0);
    if (reason)
        format_complain("refdyn: %s: cannot be the cache folder: %s; REFDYN_CACHE names another one\n", path,
                        reason);
    return !reason;
}

/* Tries refdyn in the XDG cache folder. Reports nothing if the user has no cache folder that can be written.
 */
static bool open_xdg(struct cache *cache) {
    const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    const char *path = xdg && *xdg == '/'     ? format_text("%s/refdyn", xdg)
                       : home && *home == '/' ? format_text("%s/.cache/refdyn", home)
                                              : NULL;
    if (!path)
        return false;
    const char *reason = open_folder(cache, path, 0);
    if (reason && access(path, F_OK) == 0)
        format_complain("refdyn: warning: %s cannot be the cache folder: %s; another one is used\n", path,
                        reason);
    if (!reason && access(cache->path, W_OK | X_OK) != 0)
        compile_cache_close(cache);
    return cache->folder >= 0;
}

/* For users without a home. */
static bool open_temporary(struct cache *cache) {
    const char *path = format_text("%s/refdyn-%ld", system_scratch_parent(), (long)geteuid());
    const char *reason = open_folder(cache, path, O_NOFOLLOW);
    if (reason)
        format_complain("refdyn: %s: no folder for compiled models: %s; set REFDYN_CACHE or HOME\n", path,
                        reason);
    return !reason;
}

bool compile_cache_open(struct cache *cache) {
    const char *own = getenv("REFDYN_CACHE");
    *cache = (struct cache){.folder = -1};
    if (own && *own)
        return open_own(cache, own);
    return open_xdg(cache) || open_temporary(cache);
}

void compile_cache_close(struct cache *cache) {
    if (cache->folder >= 0)
        close(cache->folder);
    cache->folder = -1;
}

/* ---- Who builds ---- */

/* Of folders in which libraries are built, and of claims. */
static const char build_prefix[] = "build-";

bool compile_cache_scratch(const struct cache *cache, struct scratch *scratch) {
    return system_scratch_open(scratch, cache->path, build_prefix);
}

void compile_cache_clean(const struct cache *cache) {
    system_scratch_remove_dead(cache->path, build_prefix);
}

/* The claim is a locked folder, named like those of builds, so that the next command removes it if its owner
 * was killed. */
bool compile_cache_claim(const struct cache *cache, const char *key, struct scratch *claimed) {
    return system_scratch_claim(claimed, cache->path, build_prefix, key) != SCRATCH_BUSY;
}

void compile_cache_unclaim(struct scratch *claimed) {
    if (claimed->path)
        system_scratch_close(claimed);
}

/* The lock of the folder itself, by a separate descriptor, which stays open until the program ends. */
void compile_cache_queue(const struct cache *cache) {
    const int folder = openat(cache->folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    while (folder >= 0 && flock(folder, LOCK_EX) != 0 && errno == EINTR)
        continue;
}

/* ---- Libraries ---- */

/* Computes the seal of the first `length` bytes of a file. Returns false if the file is shorter. */
static bool make_seal(int file, off_t length, char seal[static SEAL_LENGTH]) {
    uint8_t block[1 << 15];
    SHA2_CTX sha;
    SHA256Init(&sha);
    for (off_t at = 0; at < length;) {
        const off_t left = length - at;
        const ssize_t count =
            pread(file, block, left < (off_t)sizeof block ? (size_t)left : sizeof block, at);
        if (count <= 0)
            return false;
        SHA256Update(&sha, block, (size_t)count);
        at += count;
    }
    memcpy(seal, seal_lead, sizeof seal_lead - 1);
    SHA256End(&sha, seal + sizeof seal_lead - 1);
    return true;
}

static bool is_whole(int file, off_t size) {
    char found[SEAL_LENGTH], wanted[SEAL_LENGTH];
    const off_t length = size - SEAL_LENGTH;
    return length > 0 && pread(file, found, SEAL_LENGTH, length) == SEAL_LENGTH &&
           make_seal(file, length, wanted) && memcmp(found, wanted, SEAL_LENGTH) == 0;
}

/* A descriptor of the library after all checks; -1 if it must not be loaded. */
static int open_library(const struct cache *cache, const char *key) {
    struct stat status;
    const char *name = format_text("%s.so", key);
    const int file = openat(cache->folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode) && is_ours(&status) &&
        is_whole(file, status.st_size)) {
        compile_cache_note_use(file);
        return file;
    }
    if (file >= 0)
        close(file);
    return -1;
}

/* Loads through the descriptor of the folder, in which nobody else can replace a file. The loader treats
 * files of the same path as one library; this path contains the key. */
void *compile_cache_load(const struct cache *cache, const char *key) {
    if (!compile_cache_find(cache, key))
        return NULL;
    return dlopen(format_text("/proc/self/fd/%d/%s.so", cache->folder, key), RTLD_NOW | RTLD_LOCAL);
}

const char *compile_cache_find(const struct cache *cache, const char *key) {
    const int file = open_library(cache, key);
    if (file < 0)
        return NULL;
    close(file);
    return format_text("%s/%s.so", cache->path, key);
}

char *compile_cache_read(const struct cache *cache, const char *key, size_t *size) {
    struct stat status;
    const int file = open_library(cache, key);
    if (file < 0)
        return NULL;
    char *content = NULL;
    if (fstat(file, &status) == 0) {
        *size = (size_t)status.st_size - SEAL_LENGTH;
        content = format_allocate_large(*size, 1);
        if (pread(file, content, *size, 0) != (ssize_t)*size) {
            free(content);
            content = NULL;
        }
    }
    close(file);
    return content;
}

/* Appends the seal to the library, and makes it read-only for others. If the compiler has made a link, the
 * file to which it leads stays as it is. Returns NULL, or the reason for a failure. */
static const char *seal(const char *library) {
    char text[SEAL_LENGTH];
    struct stat status;
    const int file = open(library, O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0)
        return errno == ELOOP ? "the compiler has made a link" : strerror(errno);
    const char *reason = NULL;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_nlink != 1)
        reason = "the compiler has made a link or a device";
    else if (!make_seal(file, status.st_size, text) ||
             pwrite(file, text, SEAL_LENGTH, status.st_size) != SEAL_LENGTH ||
             fchmod(file, status.st_mode & (S_IRWXU | S_IRGRP | S_IXGRP | S_IROTH | S_IXOTH)) != 0)
        reason = strerror(errno);
    return close(file) == 0 || reason ? reason : strerror(errno);
}

bool compile_cache_add(const struct cache *cache, const char *key, const char *library) {
    const char *name = format_text("%s.so", key), *reason = seal(library);
    if (!reason && renameat(AT_FDCWD, library, cache->folder, name) != 0)
        reason = strerror(errno);
    if (reason)
        format_complain("refdyn: %s/%s: cannot be made: %s\n", cache->path, name, reason);
    else
        compile_cache_prune(cache);
    return !reason;
}

void compile_cache_drop(const struct cache *cache, const char *key) {
    unlinkat(cache->folder, format_text("%s.so", key), 0);
}
