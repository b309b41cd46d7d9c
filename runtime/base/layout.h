/*
 * Laying arrays out in one piece of memory: the same list of takes counts bytes (base NULL) and hands them
 * out.
 */
#ifndef REFDYN_LAYOUT_H
#define REFDYN_LAYOUT_H

#include <stddef.h>
#include <stdint.h>

struct room {
    char *base; /* NULL: only count */
    size_t used;
};

/* Next array of count doubles, or of ints, which fill whole doubles, so that both stay aligned; NULL while
 * counting. More bytes than a size_t can count are SIZE_MAX, which no memory has. */
static inline double *room_doubles(struct room *room, int count) {
    double *array = room->base ? (double *)(void *)(room->base + room->used) : NULL;
    const size_t left = (SIZE_MAX - room->used) / sizeof(double), wanted = (size_t)count;
    room->used = wanted > left ? SIZE_MAX : room->used + wanted * sizeof(double);
    return array;
}

static inline int *room_ints(struct room *room, int count) {
    const int per_double = (int)(sizeof(double) / sizeof(int));
    return (int *)(void *)room_doubles(room, count / per_double + (count % per_double != 0));
}

static inline int room_fits(const void *memory, size_t size, size_t needed) {
    return memory && needed < SIZE_MAX && (uintptr_t)memory % sizeof(double) == 0 && size >= needed;
}

#endif
