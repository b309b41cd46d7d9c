/* Motions side by side and the motion of one case. */
#ifndef REFDYN_BATCH_PRIVATE_H
#define REFDYN_BATCH_PRIVATE_H

#include "refdyn_batch.h"
#include "refdyn_lanes.h"
#include "runtime/core/motion/motion.h"

/*
 * Steps of several motions side by side, one in each lane of vectors.
 *
 * Takes motions that have halted at a step (motion.h) and the functions for lanes that were emitted
 * for their model; gives each motion the step's end, its error and, where that is small enough, its rates on
 * the programme. Methods are those of one motion (methods/..._step.h). Widths are 2, 4 and 8; the wider ones
 * are compiled for processors that have such vectors, and run on these alone. What a lane computes depends on
 * no other one.
 */

/* The widest that this processor's vectors hold: 2, 4 or 8. */
int refdyn_lanes_widest(void);

/* One step of a motion, to be taken. */
struct lane_step {
    struct refdyn_motion *motion; /* NULL: the lane rests */
    struct refdyn_attempt *attempt;
    const double *x;  /* its inputs */
    int is_new;       /* parameters or inputs have changed since its last step */
    int needs_stages; /* a state inside of the step will be asked for */
    int status;       /* behind lanes_take: OK, NO_CONVERGENCE or LEFT_TO_MOTION */
    int is_met;       /* its end has been brought onto the programme */
};

/* Matrices of an implicit step: linearisation_lanes.inc. */
struct lanes_linear {
    double *tangent, *real, *complexes;
    int *pivots, *moves; /* of the real matrix, then of the complex ones */
};

struct lanes {
    const struct refdyn_lane_model *model;
    void *memory; /* one block */
    double *p, *x, *t, *state, *rates, *state_new, *rates_new, *stage, *side, *error, *stages;
    double *row_terms, *directions, *mass_directions; /* of the programme: lanes_meet.inc */
    double *small;                                    /* its system */
    double *zeros, *nowhere;                          /* of one motion: what lanes that rest take and give */
    int *small_pivots;
    int has_tangent;
    struct lanes_linear linear[2]; /* the factors in use, and room for new ones */
    double *linear_room;
    int has_factors[8]; /* by lane: those in use are of its last step or of an earlier one */
    long aligned[8];    /* by lane: programme.aligned of its directions in the metric of M */
};

/* Room for all methods that lanes take. REFDYN_OK, FUNCTION_MISSING where no function for lanes gives
 * accelerations, OTHER_VERSION, BAD_MEMORY; lanes_release in any case. */
int refdyn_lanes_start(struct lanes *lanes, const struct refdyn_lane_model *model);
/* Takes the steps (width), each lane always of the same motion, all by one method. */
void refdyn_lanes_take(struct lanes *lanes, struct lane_step *steps);
void refdyn_lanes_release(struct lanes *lanes);

/* ---- lanes_motion.c ---- */
/* Do lanes take steps of methods of this kind? */
int refdyn_lanes_have_kind(const struct lanes *lanes, const struct refdyn_method_kind *kind);
/* Do they have what the next step of this motion takes? */
int refdyn_lanes_can_take(const struct lanes *lanes, const struct refdyn_motion *motion);
/* Do they have what its end takes? Not at a time event. */
int refdyn_lanes_can_meet(const struct lanes *lanes, const struct lane_step *one);
/* Directions in the metric of M that suit the end of the step are with the motion: 1 where they are others
 * than those of this lane. Where there are none, the end is the motion's. */
int refdyn_lanes_align(struct lanes *lanes, struct lane_step *one, int lane);
/* The motion of this lane takes a step itself, or continues with other parameters or inputs: its factors here
 * are dropped. The motion keeps its own factors. */
void refdyn_lanes_forget(struct lanes *lanes, struct refdyn_motion *motion, int lane);

/* ---- lanes_2.c, lanes_4.c ...: refdyn_lanes_take of their width; apart: for processors without such
 * vectors, which the compiler takes apart. ---- */
typedef void lanes_take(struct lanes *lanes, struct lane_step *steps);
lanes_take refdyn_lanes_take_2, refdyn_lanes_take_4, refdyn_lanes_take_8, refdyn_lanes_take_4_apart,
    refdyn_lanes_take_8_apart;

/*
 * One case of a batch, from its start to its end.
 *
 * Takes the batch and a worker's memory; gives the states to the batch's callbacks.
 */

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
/* taken: how the step at which it halted was taken (motion.h). */
void refdyn_worker_judge(struct worker *worker, int taken);
void refdyn_worker_release(struct worker *worker);

#endif
