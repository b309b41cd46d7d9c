/*
 * Laying arrays out in one piece of memory: the same list of takes counts bytes (base NULL) and hands them
 * out.
 */
#ifndef REFDYN_ROOM_H
#define REFDYN_ROOM_H

#include <stddef.h>
#include <stdint.h>

struct room {
    char *base; /* NULL: only count */
    size_t used;
};

/* Next array of count doubles, or of ints, which fill whole doubles, so that both stay aligned; NULL while
 * counting. */
static inline double *room_doubles(struct room *room, int count) {
    double *array = room->base ? (double *)(void *)(room->base + room->used) : NULL;
    room->used += (size_t)count * sizeof(double);
    return array;
}

static inline int *room_ints(struct room *room, int count) {
    int *array = room->base ? (int *)(void *)(room->base + room->used) : NULL;
    room->used += ((size_t)count * sizeof(int) + sizeof(double) - 1) / sizeof(double) * sizeof(double);
    return array;
}

static inline int room_fits(const void *memory, size_t size, size_t needed) {
    return memory && (uintptr_t)memory % sizeof(double) == 0 && size >= needed;
}

#endif
