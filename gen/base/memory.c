/*
 * The generator's arena and scratch: lists of blocks from malloc, bounded in bytes and in work.
 *
 * `fail` must not return: it jumps back to gen_* or, while Lua runs, raises a Lua error. `bound` limits all
 * blocks together, so that a model that needs more is refused at the same place on each machine. `work_bound`
 * does the same for work, which is counted and not timed. `allowance` counts allocations down and fails at
 * zero, so that a test can make each one fail.
 */
#include "gen/base/base.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK_SIZE = 1 << 18,
    ALIGNMENT = 16,
    BYTES_OF_WORK = 300 /* this much scratch takes as long as one expression (measured) */
};

struct memory_block {
    struct memory_block *next;
    size_t used, size; /* bytes of data that follow the header */
};

static const size_t header_size = (sizeof(struct memory_block) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;

static struct memory_block *new_block(struct memory *memory, size_t size) {
    struct memory_block *block = NULL;
    if (memory->bound > 0 && (size > memory->bound || memory->taken > memory->bound - size)) {
        memory->is_over_bound = true;
        return NULL;
    }
    if (memory->allowance != 0)
        block = malloc(header_size + size);
    if (memory->allowance > 0)
        memory->allowance--;
    if (!block)
        return NULL;
    memory->taken += size;
    block->used = 0;
    block->size = size;
    return block;
}

/* Takes zeroed bytes from the first block of the list, or from a new one. NULL if memory is short. */
static void *take(struct memory *memory, struct memory_block **list, size_t size) {
    size = (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (!*list || (*list)->size - (*list)->used < size) {
        struct memory_block *block = new_block(memory, size > BLOCK_SIZE ? size : BLOCK_SIZE);
        if (!block)
            return NULL;
        block->next = *list;
        *list = block;
    }
    char *data = (char *)*list + header_size + (*list)->used;
    (*list)->used += size;
    return memset(data, 0, size);
}

static void *take_or_fail(struct memory *memory, struct memory_block **list, size_t size) {
    void *data = take(memory, list, size);
    if (!data) {
        memory->fail(memory->context);
        abort(); /* fail does not return */
    }
    return data;
}

void *memory_try(struct memory *memory, size_t size) {
    return take(memory, &memory->blocks, size);
}

void *memory_get(struct memory *memory, size_t size) {
    return take_or_fail(memory, &memory->blocks, size);
}

void memory_work(struct memory *memory, double amount) {
    memory->work += amount;
    if (memory->work_bound > 0 && memory->work > memory->work_bound) {
        memory->is_over_work = true;
        memory->fail(memory->context);
    }
}

void *memory_scratch(struct memory *memory, size_t size) {
    memory_work(memory, (double)size / BYTES_OF_WORK);
    return take_or_fail(memory, &memory->scratch, size);
}

struct memory_mark memory_mark(const struct memory *memory) {
    return (struct memory_mark){memory->scratch, memory->scratch ? memory->scratch->used : 0};
}

static void free_last(struct memory *memory, struct memory_block **list) {
    struct memory_block *next = (*list)->next;
    memory->taken -= (*list)->size;
    free(*list);
    *list = next;
}

/* The first block stays, so that most steps, which are small, need no call of malloc. */
void memory_back(struct memory *memory, struct memory_mark mark) {
    while (memory->scratch != mark.block && memory->scratch->next)
        free_last(memory, &memory->scratch);
    if (memory->scratch)
        memory->scratch->used = mark.block ? mark.used : 0;
}

void *memory_grow(struct memory *memory, const void *old, size_t old_size, size_t new_size) {
    void *data = memory_get(memory, new_size);
    if (old_size)
        memcpy(data, old, old_size);
    return data;
}

void *memory_room(struct memory *memory, void *list, int count, int *capacity, size_t size) {
    if (count < *capacity)
        return list;
    size_t old = (size_t)*capacity * size;
    *capacity = *capacity ? 2 * *capacity : 8;
    return memory_grow(memory, list, old, (size_t)*capacity * size);
}

char *memory_text(struct memory *memory, const char *text) {
    return memory_format(memory, "%s", text);
}

char *memory_format(struct memory *memory, const char *format, ...) {
    va_list list;
    va_start(list, format);
    int length = vsnprintf(NULL, 0, format, list);
    va_end(list);
    char *text = memory_get(memory, (size_t)length + 1);
    va_start(list, format);
    vsnprintf(text, (size_t)length + 1, format, list);
    va_end(list);
    return text;
}

void memory_release(struct memory *memory) {
    while (memory->blocks)
        free_last(memory, &memory->blocks);
    while (memory->scratch)
        free_last(memory, &memory->scratch);
}
