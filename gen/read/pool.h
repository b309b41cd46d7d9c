/*
 * Memory for Lua out of the generator's arena: freed pieces are kept by size and used again, everything goes
 * with the arena. So a jump out of the generator leaves nothing behind.
 */
#ifndef REFDYN_GEN_POOL_H
#define REFDYN_GEN_POOL_H

#include "base/memory.h"

enum { POOL_CLASSES = 96 };

struct pool_piece;

struct pool {
    struct memory *memory;
    struct pool_piece *free[POOL_CLASSES];
};

/* As Lua's allocator: `old` bytes at `data` become `size` bytes; NULL when memory is short or for size 0. */
void *pool_resize(struct pool *pool, void *data, size_t old, size_t size);

#endif
