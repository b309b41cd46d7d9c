/*
 * The structures of a batch: its cases sorted by their options, and for each such group the model that is
 * compiled for it, with what varies in places of that model.
 */
#ifndef REFDYN_TOOL_STRUCTURES_H
#define REFDYN_TOOL_STRUCTURES_H

#include "batch/cases.h"
#include "refdyn_batch.h"
#include "scene/scene.h"

struct structure {
    struct options options; /* of the command, and the values of the options that vary */
    struct scene scene;
    unsigned needs; /* of the scene */
    bool is_open;   /* the scene is to be closed */
    long example;   /* a case of it */
    long *numbers;  /* (count) of its cases that are computed, ascending */
    long count;
    struct refdyn_batch_column *columns; /* what varies and the model has */
    struct refdyn_samples *samples;      /* of the files of inputs */
    int column_count, sample_count;
    int *held; /* (held_count) coordinates that statics holds */
    int held_count;
    struct refdyn_statics_options statics;
};

/* Each is a compiled library with what was read of its model, all open at once. */
enum { STRUCTURES_MOST = 512 };

struct structures {
    struct structure *list;
    int count, room;
};

/* Sorts all cases, of which [first, end) are computed: what is kept of a case, and where, is the same for all
 * ranges. Complains of too many structures. */
enum status structures_sort(struct structures *structures, struct memory *memory, const struct cases *cases,
                            long first, long end, const struct options *options);
/*
 * Generates, compiles and loads all of them, several at the same time; then finds what varies in each.
 * Complains of what a structure lacks. structures_close in any case.
 */
enum status structures_open(struct structures *structures, struct memory *memory, const struct cases *cases,
                            const struct refdyn_options *integration, int threads);
void structures_close(struct structures *structures);

#endif
