/*
 * One case of a batch, from its start to its end.
 *
 * Takes the batch and a worker's memory; gives the states to the batch's callbacks.
 */
#ifndef REFDYN_MOTION_OF_CASE_H
#define REFDYN_MOTION_OF_CASE_H

#include "batch/refdyn_batch.h"

/* All that one thread computes with; one block of memory. */
struct worker {
    const struct refdyn_batch *batch;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct refdyn_batch_case now;
    const struct refdyn_samples *samples; /* of the case; NULL: its inputs stay */
    double next_sample;                   /* [s] */
    double *q, *qd;                       /* (n) its start */
    int *given;                           /* (anchored_count) */
    void *statics;                        /* memory of refdyn_statics */
    size_t statics_size;
    void *memory; /* the block */
};

/* 0 or an error as refdyn_batch_run; worker_release in any case. */
int refdyn_worker_start(struct worker *worker, const struct refdyn_batch *batch, int thread);
/* Runs case `index`; 0: a callback has ended the batch. */
int refdyn_worker_run(struct worker *worker, long index);
void refdyn_worker_release(struct worker *worker);

#endif
