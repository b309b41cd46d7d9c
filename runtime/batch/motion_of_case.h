/*
 * One case of a batch, from its start to its end.
 *
 * Takes the batch and a worker's memory; gives the states to the batch's callbacks.
 */
#ifndef REFDYN_MOTION_OF_CASE_H
#define REFDYN_MOTION_OF_CASE_H

#include "batch/refdyn_batch.h"
#include "motion/lockstep.h"

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
    void *memory;                      /* the block */
    int is_busy;                       /* it has a case: set by its thread */
    int output;                        /* the next of the batch's times */
    int turns;                         /* since the case began */
    struct refdyn_attempt attempt;     /* at which it has halted */
    long steps_in_lanes;               /* since the case began: accepted */
    int is_new;                        /* its parameters or inputs have changed since a step in lanes */
    struct refdyn_batch_result result; /* of the case so far; its thread adds to cpu_s */
};

/* What a case waits for. */
enum turn { TURN_LEFT, TURN_ENDED, TURN_HALTED };

/* 0 or an error as refdyn_batch_run; worker_release in any case. */
int refdyn_worker_start(struct worker *worker, const struct refdyn_batch *batch, int room);
/* Begins case `index`, and continues it until a step is to be taken (HALTED), until it has ended, or until a
 * callback has ended the batch. */
enum turn refdyn_worker_begin(struct worker *worker, long index);
enum turn refdyn_worker_go(struct worker *worker);
/* Reports the end of a case that has ENDED: LEFT where the callback ends the batch. */
enum turn refdyn_worker_end(struct worker *worker);
/* taken: how the step at which it halted was taken (motion/lockstep.h). */
void refdyn_worker_judge(struct worker *worker, int taken);
void refdyn_worker_release(struct worker *worker);

#endif
