/* Copies of an instance's state: the struct and its block. */
#include "runtime/bindings/fmi/fmi.h"

#include <stdlib.h>
#include <string.h>

struct fmu_saved {
    struct fmu_instance instance; /* the copy; its pointers lead to the instance's block */
    const struct fmu_instance *of;
    char *block;
};

/* Pointers of the state must lead to the instance's memory. An instance that was opened in the memory of a
 * closed one may use its saved states. */
static int fits(const struct fmu_saved *saved, const struct fmu_instance *instance) {
    return saved && saved->of == instance && saved->instance.block == instance->block &&
           saved->instance.block_size == instance->block_size &&
           saved->instance.is_exchange == instance->is_exchange;
}

enum fmu_status fmu_save(struct fmu_instance *instance, struct fmu_saved **saved) {
    struct fmu_saved *copy = *saved ? *saved : calloc(1, sizeof *copy);
    if (copy && !copy->block)
        copy->block = malloc(instance->block_size);
    if (!copy || !copy->block) {
        free(copy);
        *saved = NULL;
        return fmu_tell(instance, FMU_ERROR, "out of memory");
    }
    copy->of = instance;
    copy->instance = *instance;
    memcpy(copy->block, instance->block, instance->block_size);
    *saved = copy;
    return FMU_OK;
}

enum fmu_status fmu_restore(struct fmu_instance *instance, const struct fmu_saved *saved) {
    if (!fits(saved, instance))
        return fmu_tell(instance, FMU_ERROR, "the state does not belong to this instance");
    const struct fmu_listener listener = instance->listener;
    const int is_logging = instance->is_logging;
    *instance = saved->instance;
    instance->listener = listener;
    instance->is_logging = is_logging;
    memcpy(instance->block, saved->block, instance->block_size);
    return FMU_OK;
}

void fmu_forget(struct fmu_saved *saved) {
    if (saved)
        free(saved->block);
    free(saved);
}
