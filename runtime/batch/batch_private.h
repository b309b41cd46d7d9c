/* Private declarations of batches: lanes, which step several motions side by side; workers, which compute
 * cases. */
#ifndef REFDYN_BATCH_PRIVATE_H
#define REFDYN_BATCH_PRIVATE_H

#include "refdyn_batch.h"
#include "refdyn_lanes.h"
#include "runtime/core/motion/motion.h"

/* ---- Lanes: steps of several motions side by side, one in each lane of vectors (lanes.c) ---- */

/* Returns the largest width that fits this processor's vectors: 2, 4 or 8. */
int refdyn_lanes_widest(void);

/* One step of a motion, to be taken. */
struct lane_step {
    struct refdyn_motion *motion; /* NULL: the lane is idle */
    struct refdyn_attempt *attempt;
    const double *x;  /* inputs */
    int is_new;       /* parameters or inputs have changed since its last step */
    int needs_stages; /* a state within the step will be needed */
    int status;       /* after lanes_take: OK, NO_CONVERGENCE or LEFT_TO_MOTION */
    int is_met;       /* the end has been projected onto the programme */
};

/* Matrices of an implicit step (linearisation_lanes.inc). */
struct lanes_linear {
    double *tangent, *real, *complexes;
    int *pivots; /* of the real matrix, then of the complex ones */
};

struct lanes {
    const struct refdyn_lane_model *model;
    void *memory; /* one block */
    double *p, *x, *t, *state, *rates, *state_new, *rates_new, *stage, *side, *error, *stages;
    double *row_terms, *sizes, *directions, *mass_directions; /* for projection: lanes_meet.inc */
    double *small;                                            /* the linear system of projection */
    double *zeros, *nowhere; /* one motion's inputs and outputs of idle lanes */
    int *small_pivots;
    int has_tangent;
    struct lanes_linear linear[2]; /* the factors in use, and memory for new ones */
    double *linear_room;
    int has_factors[8]; /* by lane: factors of the last step or of an earlier one are in use */
    long aligned[8];    /* by lane: programme.aligned of its directions in the metric of M */
};

/* Allocates memory for all methods that lanes support. Errors: FUNCTION_MISSING if no function for lanes
 * computes accelerations, OTHER_VERSION, BAD_MEMORY. Call lanes_release in any case. */
int refdyn_lanes_start(struct lanes *lanes, const struct refdyn_lane_model *model);
/* Takes the steps (width) by one method; a lane always belongs to the same motion. */
void refdyn_lanes_take(struct lanes *lanes, struct lane_step *steps);
void refdyn_lanes_release(struct lanes *lanes);

/* Can lanes take steps by methods of this kind, the next step of this motion, project the end of the step?
 * Not at a time event. */
int refdyn_lanes_have_kind(const struct lanes *lanes, const struct refdyn_method_kind *kind);
int refdyn_lanes_can_take(const struct lanes *lanes, const struct refdyn_motion *motion);
int refdyn_lanes_can_meet(const struct lanes *lanes, const struct lane_step *one);
/* Asks the motion for directions in the metric of M at the end of the step. Returns 1 if they differ from
 * those of this lane. Without directions, the motion projects the end itself. */
int refdyn_lanes_align(struct lanes *lanes, struct lane_step *one, int lane);
/* Discards the factors of this lane, when its motion takes a step itself or continues with other parameters
 * or inputs. The motion keeps its own factors. */
void refdyn_lanes_forget(struct lanes *lanes, struct refdyn_motion *motion, int lane);

/* refdyn_lanes_take for one width: lanes_2.c, lanes_4.c ...; "apart": for processors with shorter vectors. */
typedef void lanes_take(struct lanes *lanes, struct lane_step *steps);
lanes_take refdyn_lanes_take_2, refdyn_lanes_take_4, refdyn_lanes_take_8, refdyn_lanes_take_4_apart,
    refdyn_lanes_take_8_apart;

/* ---- Copies of a motion, for differences: runtime/gradients ---- */

/* Change of one value of a case; REFDYN_VARIED_SAMPLES: no change. */
struct shift {
    enum refdyn_varied what;
    int place;
    double change;
    double end_change; /* of the end of the motion [s] */
};

/* The cases of a batch are copies of case `number`, which repeat its steps. */
struct refdyn_copies {
    long number;
    const struct shift *shifts;            /* by number of the copy */
    const struct refdyn_pattern *pattern;  /* NULL: the copies choose their steps */
    const struct refdyn_step_watch *watch; /* of the steps; may be NULL */
};

/* ---- Workers: one case of a batch from its start to its end (motion_of_case.c) ---- */

/* The variables and arrays of one case, in one block of memory. */
struct worker {
    const struct refdyn_batch *batch;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct refdyn_batch_case now;
    const struct refdyn_samples *samples; /* of the case; NULL: constant inputs */
    double next_sample, end;              /* the end of the motion [s] */
    double *q, *qd;                       /* (n) start of the case */
    int *given;                           /* (anchored_count) */
    void *statics;                        /* memory of refdyn_statics */
    size_t statics_size;
    void *memory;                      /* the block */
    int is_busy;                       /* has a case; set by the thread */
    int output, turns;                 /* the next of the batch's times; turns since the case began */
    struct refdyn_attempt attempt;     /* the step at which the case has halted */
    long steps_in_lanes;               /* accepted since the case began */
    int is_new;                        /* parameters or inputs have changed since the last step in lanes */
    struct refdyn_batch_result result; /* of the case so far; the thread adds to cpu_s */
};

/* State of a case: the batch ends, the case has ended, it has halted at a step. */
enum turn { TURN_LEFT, TURN_ENDED, TURN_HALTED };

/* Allocates a worker. Returns 0, or an error like refdyn_batch_run. Call worker_release in any case. */
int refdyn_worker_start(struct worker *worker, const struct refdyn_batch *batch, int room);
/* Begins case `index` and continues it until it halts at a step, ends, or a callback ends the batch. */
enum turn refdyn_worker_begin(struct worker *worker, long index);
enum turn refdyn_worker_go(struct worker *worker);
/* Reports the end of a case that has ENDED. Returns LEFT if the callback ends the batch. */
enum turn refdyn_worker_end(struct worker *worker);
/* Continues after the step at which the case halted; taken: the status of this step (motion.h). */
void refdyn_worker_judge(struct worker *worker, int taken);
void refdyn_worker_release(struct worker *worker);

#endif
