/* The generator's arena: see memory.h. */
#include "memory.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_SIZE = 1 << 18, ALIGNMENT = 16 };

struct memory_block {
    struct memory_block *next;
    size_t used, size; /* bytes of data behind the header */
};

static const size_t header_size = (sizeof(struct memory_block) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;

static struct memory_block *new_block(struct memory *memory, size_t size) {
    struct memory_block *block = NULL;
    if (memory->allowance != 0 && size < (size_t)1 << 40)
        block = malloc(header_size + size);
    if (memory->allowance > 0)
        memory->allowance--;
    if (!block)
        return NULL;
    block->next = memory->blocks;
    block->used = 0;
    block->size = size;
    memory->blocks = block;
    return block;
}

void *memory_try(struct memory *memory, size_t size) {
    struct memory_block *block = memory->blocks;
    size = (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (!block || block->size - block->used < size)
        block = new_block(memory, size > BLOCK_SIZE ? size : BLOCK_SIZE);
    if (!block)
        return NULL;
    char *data = (char *)block + header_size + block->used;
    block->used += size;
    return memset(data, 0, size);
}

void *memory_get(struct memory *memory, size_t size) {
    void *data = memory_try(memory, size);
    if (!data) {
        memory->fail(memory->context);
        abort(); /* fail does not return */
    }
    return data;
}

struct memory_mark memory_mark(const struct memory *memory) {
    return (struct memory_mark){memory->blocks, memory->blocks ? memory->blocks->used : 0};
}

/* Blocks down to `last`, which stays. */
static void free_blocks(struct memory *memory, const struct memory_block *last) {
    while (memory->blocks != last) {
        struct memory_block *next = memory->blocks->next;
        free(memory->blocks);
        memory->blocks = next;
    }
}

void memory_back(struct memory *memory, struct memory_mark mark) {
    free_blocks(memory, mark.block);
    if (mark.block)
        mark.block->used = mark.used;
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
    free_blocks(memory, NULL);
}
