/*
 * Laying arrays out in one piece of memory: the same list of takes counts bytes (base NULL) and hands them
 * out.
 */
#ifndef REFDYN_LAYOUT_H
#define REFDYN_LAYOUT_H

#include <stddef.h>
#include <stdint.h>

struct layout {
    char *base; /* NULL: only count */
    size_t used;
};

/* Next array of count doubles, or of ints, which fill whole doubles, so that both stay aligned; NULL while
 * counting. More bytes than a size_t can count are SIZE_MAX, which no memory has. */
static inline double *layout_doubles(struct layout *layout, int count) {
    double *array = layout->base ? (double *)(void *)(layout->base + layout->used) : NULL;
    const size_t left = (SIZE_MAX - layout->used) / sizeof(double), wanted = (size_t)count;
    layout->used = wanted > left ? SIZE_MAX : layout->used + wanted * sizeof(double);
    return array;
}

static inline int *layout_ints(struct layout *layout, int count) {
    const int per_double = (int)(sizeof(double) / sizeof(int));
    return (int *)(void *)layout_doubles(layout, count / per_double + (count % per_double != 0));
}

static inline int layout_fits(const void *memory, size_t size, size_t needed) {
    return memory && needed < SIZE_MAX && (uintptr_t)memory % sizeof(double) == 0 && size >= needed;
}

#endif
