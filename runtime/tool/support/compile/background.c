/*
 * Compiles the optimised library of a model in the background, for the next call and for motions that still
 * run.
 *
 * The process is the child of a command and has low priority. It has its own session, so that neither the end
 * of the command nor a signal from the terminal ends it. One such process compiles at a time; the others
 * wait. Nothing that it writes has a final name before it is complete, and a signal that ends it removes its
 * folders. Nobody reads its messages: those of a failure stay in the cache as KEY.failed, and the next
 * command shows them. The empty file then stays until a compilation succeeds, so that the user learns of the
 * failure once.
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

struct background {
    const char *key;
    bool (*provide)(const struct cache *cache, void *what);
    void *what;
};

static const char *failure_name(const char *key) {
    return format_text("%s.failed", key);
}

static void copy_rest(FILE *from, FILE *to) {
    for (int c; (c = getc(from)) != EOF;)
        putc(c, to);
}

/* Copies the messages into the cache, unless it has earlier ones. */
static void keep_failure(const struct cache *cache, const char *key, FILE *said) {
    const int file =
        openat(cache->folder, failure_name(key), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    FILE *out = file < 0 ? NULL : fdopen(file, "w");
    rewind(said);
    if (out) {
        copy_rest(said, out);
        fclose(out);
    }
}

/* Shows the messages of an earlier process, and empties their file. */
static void show_failure(const struct cache *cache, const char *key, const char *name) {
    struct stat status;
    const int file = openat(cache->folder, failure_name(key), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    FILE *said = file < 0 ? NULL : fdopen(file, "r+");
    if (!said)
        return;
    if (flock(file, LOCK_EX) == 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
        status.st_size > 0) {
        fprintf(stderr,
                "refdyn: warning: %s: the compilation of optimised functions in the background has failed; "
                "slower ones are used\n",
                name);
        copy_rest(said, stderr);
        if (ftruncate(file, 0) != 0)
            unlinkat(cache->folder, failure_name(key), 0);
    }
    fclose(said);
}

static void build(void *what) {
    const struct background *background = what;
    struct cache cache;
    FILE *said = tmpfile();
    unsetenv("REFDYN_NOTICES"); /* it is for programs that read the messages at once */
    if (said)
        dup2(fileno(said), STDERR_FILENO);
    if (!compile_cache_open(&cache))
        return;
    compile_cache_queue(&cache);
    if (background->provide(&cache, background->what))
        unlinkat(cache.folder, failure_name(background->key), 0);
    else if (said)
        keep_failure(&cache, background->key, said);
    compile_cache_close(&cache);
}

void compile_in_background(const struct cache *cache, const char *key, const char *name,
                           bool (*provide)(const struct cache *cache, void *what), void *what) {
    struct background background = {key, provide, what};
    show_failure(cache, key, name);
    system_process_start_background(build, &background);
}
