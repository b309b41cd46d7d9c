/*
 * Memory of the generator: one arena a run.
 *
 * Takes sizes, gives zeroed memory that lives until memory_release, and scratch, a stack beside it.
 * A request that cannot be met calls `fail`, which must not return (it jumps back to gen_* or, while Lua
 * runs, raises a Lua error); no caller checks for NULL. `bound` is what all blocks together may take, so that
 * a model that wants more is refused at the same place on each machine, and `work_bound` the same for work,
 * which is counted, not timed. `allowance` counts allocations down and fails at zero, so that a test can fail
 * each one.
 */
#ifndef REFDYN_GEN_MEMORY_H
#define REFDYN_GEN_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

struct memory_block;

struct memory {
    struct memory_block *blocks, *scratch;
    size_t taken, bound;         /* bytes of all blocks, and how many they may be; 0: no bound */
    bool is_over_bound;          /* a request was refused because of the bound */
    double work, work_bound;     /* operations so far, and how many they may be; 0: no bound */
    bool is_over_work;           /* `fail` was called because of that bound */
    long allowance;              /* blocks that may still be taken from malloc; negative: no limit */
    void (*fail)(void *context); /* called when memory is short; does not return */
    void *context;
};

void *memory_get(struct memory *memory, size_t size);
/* The same, but NULL when memory is short: for Lua, which wants to be told. */
void *memory_try(struct memory *memory, size_t size);
/* Counts work: 1 is as much as to make one expression. */
void memory_work(struct memory *memory, double amount);
/* Zeroed scratch: of one step, which gives back at its end what was taken since its mark. Its bytes count as
 * work, since the step goes through them. */
void *memory_scratch(struct memory *memory, size_t size);
struct memory_mark {
    struct memory_block *block;
    size_t used;
};
struct memory_mark memory_mark(const struct memory *memory);
void memory_back(struct memory *memory, struct memory_mark mark);
/* A larger copy of `old`; the old one stays until release. */
void *memory_grow(struct memory *memory, const void *old, size_t old_size, size_t new_size);
/* Room for one more entry behind the `count` of a list with entries of `size` bytes: the list, or a larger
 * copy. */
void *memory_room(struct memory *memory, void *list, int count, int *capacity, size_t size);
char *memory_text(struct memory *memory, const char *text);
char *memory_format(struct memory *memory, const char *format, ...) __attribute__((format(printf, 2, 3)));
void memory_release(struct memory *memory);

#endif
