/* Pieces of memory by size class, see reader.h: up to 512 bytes each 16 bytes, then each power of two. */
#include "gen/read/reader.h"

#include <string.h>

enum { STEP = 16, SMALL_CLASSES = 32 };

struct pool_piece {
    struct pool_piece *next;
};

static int class_of(size_t size) {
    if (size <= (size_t)STEP * SMALL_CLASSES)
        return (int)((size + STEP - 1) / STEP) - 1;
    int index = SMALL_CLASSES;
    for (size_t room = (size_t)2 * STEP * SMALL_CLASSES; room < size; room *= 2)
        index++;
    return index;
}

static size_t class_size(int index) {
    if (index < SMALL_CLASSES)
        return (size_t)(index + 1) * STEP;
    return ((size_t)STEP * SMALL_CLASSES) << (index - SMALL_CLASSES + 1);
}

static void *take(struct pool *pool, size_t size) {
    int index = class_of(size);
    struct pool_piece *piece = pool->free[index];
    if (piece)
        pool->free[index] = piece->next;
    else
        piece = memory_try(pool->memory, class_size(index));
    return piece;
}

static void give(struct pool *pool, void *data, size_t size) {
    struct pool_piece *piece = data;
    piece->next = pool->free[class_of(size)];
    pool->free[class_of(size)] = piece;
}

void *pool_resize(struct pool *pool, void *data, size_t old, size_t size) {
    if (!data)
        return size > 0 ? take(pool, size) : NULL;
    if (size > 0 && class_of(old) == class_of(size))
        return data;
    void *moved = size > 0 ? take(pool, size) : NULL;
    if (size > 0 && !moved)
        return size > old ? NULL : data; /* Lua relies on shrinking: the piece stays where it is */
    if (moved)
        memcpy(moved, data, old < size ? old : size);
    give(pool, data, old);
    return moved;
}
