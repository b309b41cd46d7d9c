/*
 * Compiles the optimised library of a model in the background, for the next call and for motions that still
 * run.
 *
 * The process is the child of a command and has low priority. It has its own session, so that neither the end
 * of the command nor a signal from the terminal ends it. One such process compiles at a time; the others
 * wait. Nothing that it writes has a final name before it is complete, and a signal that ends it removes its
 * folders.
 */
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/system/system.h"

struct background {
    const struct toolchain *chain;
    const struct emitted *emitted;
    const char *key;
};

/* Does nothing if another program has built the library or is building it. */
static void build(void *what) {
    const struct background *background = what;
    struct cache cache;
    struct scratch claimed;
    if (!compile_cache_open(&cache))
        return;
    compile_cache_queue(&cache);
    if (!compile_cache_find(&cache, background->key) &&
        compile_cache_claim(&cache, background->key, &claimed)) {
        compile_build(&cache, background->key, background->chain, background->emitted, false);
        compile_cache_unclaim(&claimed);
    }
    compile_cache_close(&cache);
}

void compile_in_background(const struct toolchain *chain, const char *key, const struct emitted *emitted) {
    struct background background = {.chain = chain, .emitted = emitted, .key = key};
    system_process_start_background(build, &background);
}
