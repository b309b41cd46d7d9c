/*
 * Batches: many motions of one model, side by side on the cores of a machine.
 *
 * Takes what is common to all cases and columns of what differs; gives states of each case at given times
 * through callbacks or into arrays. Each case is computed for itself, alone or in a lane of vectors, so that
 * its numbers do not depend on threads, on the order of the cases or on other cases. Threads share the
 * counter of the next case and nothing else. A library of its own beside the core: it allocates, and needs
 * POSIX threads.
 */
#ifndef REFDYN_BATCH_H
#define REFDYN_BATCH_H

#include "refdyn.h"
#include "refdyn_lanes.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Samples of inputs over time: each holds until the next one (zero-order hold), the first also before, the
 * last also after. Steps of a motion end at them. */
struct refdyn_samples {
    int count, width;   /* count: at least 1 */
    const int *place;   /* (width) the model's inputs */
    const double *rows; /* (count x (1 + width)) time [s], ascending, and the values behind it */
};

/* Sets x (input_count) to the values at t and returns the time of the next sample, INFINITY: none. */
double refdyn_samples_set(const struct refdyn_samples *samples, double t, double *x);

enum refdyn_varied {
    REFDYN_VARIED_PARAMETER,
    REFDYN_VARIED_INPUT,
    REFDYN_VARIED_COORDINATE, /* start value */
    REFDYN_VARIED_RATE,       /* start rate */
    REFDYN_VARIED_SAMPLES     /* the value is the number of the samples in the batch's list */
};

struct refdyn_batch_column {
    enum refdyn_varied what;
    int place;            /* of the parameter, input or coordinate in the model's tables */
    const double *values; /* by number of the case */
};

/* The widest lanes that this processor has vectors for: 2, 4 or 8. Wider ones give the same numbers, slower.
 */
int refdyn_batch_widest(void);

/* A case that is being computed, for the callbacks: all is theirs to read. */
struct refdyn_batch_case {
    long index, number; /* its place in the list of the batch, and its number */
    int room;           /* of those that run at the same time, whose room a callback may use: 0 ... threads x
                           lanes - 1 */
    struct refdyn_integrator *integrator;
};

enum refdyn_batch_stage { REFDYN_AT_STATICS, REFDYN_AT_START, REFDYN_AT_STEPS };

struct refdyn_batch_result {
    int status;                    /* of the runtime, that ended it; 0: it came to its end; EVENT_ENDS: an
                                      event of the model has ended it, integrator->event, and its state is
                                      that which is seen */
    enum refdyn_batch_stage stage; /* where it ended */
    double t;                      /* time that was reached [s] */
    double cpu_s;     /* processor time of its thread [s]: all of it while the case computed alone, an equal
                         share while it computed side by side with the cases of other lanes. Shares add up to
                         the time of the threads without that of `end` */
    long steps_alone; /* accepted steps that its motion took itself, because lanes cannot take them or their
                         numbers were not finite; all steps if there are no lanes */
    int unstable;  /* directions in which the equilibrium that it starts from is unstable; 0: stable, or none
                    */
    int is_beyond; /* 1: that equilibrium is not the one that the growing load leads to (is_followed 0) */
};

struct refdyn_batch {
    const struct refdyn_model *model;
    /* The functions of the model for lanes: each thread takes steps of so many cases side by side. NULL: one
     * case at a time. */
    const struct refdyn_lane_model *lanes;
    struct refdyn_options options;

    /* what all cases share */
    const double *p, *x;  /* (parameter_count), (input_count); NULL: the model's values */
    const int *given;     /* (anchored_count) as refdyn_anchor takes it; NULL: none is given */
    const double *q, *qd; /* (n) start; NULL: the model's, from the parameters of each case */
    double t;             /* of the start [s] */
    int from_statics;     /* each case starts in its equilibrium, */
    const int *held;      /* (held_count) where these coordinates are held */
    int held_count;
    const struct refdyn_statics_options *statics; /* NULL: the defaults */
    const double *times; /* (time_count) ascending and behind t: where states are seen; the last is the end */
    int time_count;
    const struct refdyn_samples *samples; /* (sample_count) */
    int sample_count;

    /* the cases */
    long count;
    const long *numbers; /* (count) NULL: 0 ... count - 1 */
    int column_count;
    const struct refdyn_batch_column *columns; /* a value of theirs goes before what all share */
    int threads;                               /* at least 1 */

    /*
     * Results, each NULL where it is not wanted. Callbacks run on the threads, of different cases at the same
     * time; one that returns non-zero ends the case there without `end`, and the batch.
     *   output  a state is seen: number 0 is the start, number i stands at times[i - 1]
     *   end     the case has ended
     *   stop    asked between steps: is the batch to be left
     */
    void *context;
    int (*output)(void *context, const struct refdyn_batch_case *one, int number);
    int (*end)(void *context, const struct refdyn_batch_case *one, const struct refdyn_batch_result *result);
    int (*stop)(void *context);
    double *states; /* (count x 2 n) q and qd at the end of each case; of one that failed, where it stopped */
    int *statuses;  /* (count) */
};

/*
 * Runs all cases; `ended` (may be NULL): how many came to an end, well or not, fewer than count where a
 * callback has ended the batch. Errors, before any case: those of refdyn_workspace_init and
 * refdyn_integrator_init; BAD_OPTION for times that do not ascend, places or samples that do not exist, fewer
 * than one thread; BAD_MEMORY. Where the system gives fewer threads than asked for, these do all.
 */
int refdyn_batch_run(const struct refdyn_batch *batch, long *ended);

#ifdef __cplusplus
}
#endif

#endif
