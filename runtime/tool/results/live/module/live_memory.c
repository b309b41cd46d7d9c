/* Memory of a motion in the module of a live page. */
#include "runtime/tool/results/live/module/live_module.h"

#include <stdlib.h>

void *live_get_block(void *context, size_t size) {
    struct live *live = context;
    struct block *block = calloc(1, sizeof *block + size + sizeof(double));
    if (!block)
        abort(); /* the page shows that the module has stopped */
    block->next = live->blocks;
    live->blocks = block;
    return block->data;
}

void live_release_blocks(struct live *live) {
    while (live->blocks) {
        struct block *next = live->blocks->next;
        free(live->blocks);
        live->blocks = next;
    }
}
