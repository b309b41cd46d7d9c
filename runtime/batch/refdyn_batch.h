/** @file
 * Batches: many motions of one model, side by side on the cores of a machine.
 *
 * The caller describes what all cases share, and lists what differs in columns. States of each case at given
 * times go to callbacks or into arrays. Each case is computed on its own or in a lane of vectors, so that its
 * numbers do not depend on threads, on the order of the cases or on other cases. Threads share only the
 * counter of the next case. Batches are a separate library, because they allocate and need POSIX threads.
 */
#ifndef REFDYN_BATCH_H
#define REFDYN_BATCH_H

#include "refdyn.h"
#include "refdyn_lanes.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Samples of inputs over time. Each value holds until the next sample (zero-order hold); the first also
 * holds before its time, the last after it. Steps of a motion end at the samples. */
struct refdyn_samples {
    int count;          /**< samples, at least 1 */
    int width;          /**< inputs in each sample */
    const int *place;   /**< (width) indices of the model's inputs */
    const double *rows; /**< (count x (1 + width)) time [s], ascending, followed by the values */
};

/** Sets x (input_count) to the values at t and returns the time of the next sample [s], INFINITY: none. */
double refdyn_samples_set(const struct refdyn_samples *samples, double t, double *x);

/** The kind of value that differs between cases. */
enum refdyn_varied {
    REFDYN_VARIED_PARAMETER,  /**< a parameter */
    REFDYN_VARIED_INPUT,      /**< an input */
    REFDYN_VARIED_COORDINATE, /**< the start value of a coordinate */
    REFDYN_VARIED_RATE,       /**< the start rate of a coordinate */
    REFDYN_VARIED_SAMPLES     /**< the value is an index into the samples of the batch */
};

/** A value that differs between cases. */
struct refdyn_batch_column {
    enum refdyn_varied what; /**< its kind */
    int place;               /**< index of the parameter, input or coordinate in the tables of the model */
    const double *values; /**< by number of the case; NaN of an anchored parameter leaves it to the start */
};

/** The widest lanes for which this processor has vectors: 2, 4 or 8. Wider lanes compute the same numbers
 * more slowly. */
int refdyn_batch_widest(void);

/** A case that is being computed. Callbacks may only read it, except that `step` may look. */
struct refdyn_batch_case {
    long index;  /**< place in the list of the batch */
    long number; /**< number of the case */
    int room;    /**< place among the cases that run at the same time, 0 ... threads x lanes - 1:
                      a callback may use memory of this number without a lock */
    struct refdyn_integrator *integrator; /**< its motion */
};

/** Stages of a case. */
enum refdyn_batch_stage {
    REFDYN_AT_STATICS, /**< the equilibrium */
    REFDYN_AT_START,   /**< the start of the motion */
    REFDYN_AT_STEPS    /**< the motion */
};

/** How a case ended. */
struct refdyn_batch_result {
    int status; /**< enum refdyn_status that ended it; 0: it reached its end; EVENT_ENDS: an event of
                     the model, integrator->event, ended it, and the shown state is that of the event */
    enum refdyn_batch_stage stage; /**< where it ended */
    double t;                      /**< time reached [s] */
    double cpu_s;     /**< processor time of its thread [s]: all of it while the case computed alone, an
                           equal share while it computed in lanes with other cases. The shares add up to the
                           time of the threads without the time in `end` */
    long steps_alone; /**< accepted steps that its motion took alone, because lanes cannot take them or
                           their numbers were not finite; all steps if there are no lanes */
    int unstable;     /**< directions in which the equilibrium at its start is unstable; 0: stable, or no
                           equilibrium */
    int is_beyond;    /**< 1: that equilibrium is not the one to which the growing load leads
                           (is_followed 0) */
};

/** A batch. A column takes precedence over a value that all cases share. */
struct refdyn_batch {
    const struct refdyn_model *model;      /**< the model */
    const struct refdyn_lane_model *lanes; /**< its functions for lanes: each thread takes steps of that many
                                              cases side by side. NULL: one case at a time */
    struct refdyn_options options;         /**< of all motions */

    const double *p;  /**< (parameter_count) parameters of all cases; NULL: those of the model */
    const double *x;  /**< (input_count) inputs of all cases; NULL: those of the model */
    const int *given; /**< (anchored_count) as in refdyn_anchor; NULL: none is given */
    const double *q;  /**< (n) start; NULL: that of the model, from the parameters of each case */
    const double *qd; /**< (n) start; NULL: that of the model, from the parameters of each case */
    double t;         /**< time of the start [s] */
    int from_statics; /**< 1: each case starts in its equilibrium */
    const int *held;  /**< (held_count) coordinates held in that equilibrium */
    int held_count;   /**< number of them */
    const struct refdyn_statics_options *statics; /**< of that equilibrium; NULL: the defaults */
    const double
        *times;     /**< (time_count) times of the outputs, ascending and after t; the last is the end [s] */
    int time_count; /**< number of times */
    const double *ends; /**< by number of the case: its own end [s]; its outputs keep their fractions of the
                             motion. NULL: all cases end at the last of `times` */
    const struct refdyn_samples *samples; /**< (sample_count) for columns of REFDYN_VARIED_SAMPLES */
    int sample_count;                     /**< number of samples */

    long count;                                /**< cases */
    const long *numbers;                       /**< (count) their numbers; NULL: 0 ... count - 1 */
    int column_count;                          /**< columns */
    const struct refdyn_batch_column *columns; /**< (column_count) what differs */
    int threads;                               /**< at least 1; no more than `count` are started */

    void *context; /**< first argument of the callbacks */
    /** Called for each shown state: number 0 is the start, number i the state at times[i - 1]. NULL: not
     * needed. Callbacks run on the threads, for different cases at the same time. A callback that returns
     * non-zero ends its case without `end`, and the batch. */
    int (*output)(void *context, const struct refdyn_batch_case *one, int number);
    /** Called at the start of each case and after each of its steps. It may call refdyn_integrator_look
     * within the step, and must then show the earlier state again. An output within a step comes between two
     * calls, of which the first is for the part of the step before it. A status other than 0 ends the case
     * with this status. NULL: not needed. */
    int (*step)(void *context, const struct refdyn_batch_case *one);
    /** Called when a case has ended. NULL: not needed. */
    int (*end)(void *context, const struct refdyn_batch_case *one, const struct refdyn_batch_result *result);
    /** Called between steps: returns non-zero to end the batch. NULL: not needed. */
    int (*stop)(void *context);
    const struct refdyn_copies *copies; /**< private to refdyn_derivatives_run; NULL */
    double
        *states; /**< (count x 2 n) q and qd at the end of each case, or where it failed; NULL: not needed */
    int *statuses; /**< (count) enum refdyn_status of each case; NULL: not needed */
};

/**
 * Runs all cases. `ended` (or NULL) receives the number of cases that ended, successfully or not; it is less
 * than count if a callback ended the batch. If the system provides fewer threads than requested, these
 * compute all cases.
 *
 * Errors, before any case: those of refdyn_workspace_init and refdyn_integrator_init; BAD_OPTION for times
 * that do not ascend, places, values or samples that do not exist, fewer than one thread; BAD_MEMORY, also if
 * `batch` is NULL.
 */
int refdyn_batch_run(const struct refdyn_batch *batch, long *ended);

/* ---- Derivatives of a motion ---- */

/** A value by which a motion is differentiated. For an input with samples, a constant is added to all
 * samples. A start value or rate changes along the rows: the start of the changed motion is the nearest state
 * on the programme. */
struct refdyn_variable {
    enum refdyn_varied what; /**< its kind, not REFDYN_VARIED_SAMPLES */
    int place;               /**< index of the parameter, input or coordinate in the tables of the model */
};

/** Why a motion has no derivative by a variable, or none at some outputs. */
struct refdyn_underivable {
    int status; /**< 0: derivatives exist at all outputs. NO_DERIVATIVE: when the variable changes slightly,
                     events happen in another order, or on one side only. Otherwise the enum refdyn_status
                     with which a changed motion has failed */
    double t;   /**< time of that event or failure, or of the first output that is missing because of it:
                     outputs from there on have NaN [s] */
    double change;   /**< change of the variable, signed, with which this happened */
    int event;       /**< of the model; -1: a kink of formulas, or a time event */
    int is_at_start; /**< 1: the event is at the start of the motion */
    long jumps;      /**< values that are NaN because they jump at the time of their output */
    double t_jump;   /**< the first such time [s] */
    long bends;      /**< values that are NaN because they have different slopes above and below the value of
                          the variable, as at a kink or jump of a formula or a contact that just touches */
    double t_bend;   /**< time of the first of them [s] */
    int column;      /**< its column; the next three describe the last of them in this column */
    double t_slopes; /**< its time [s] */
    double above;    /**< its slope above the value of the variable */
    double below;    /**< its slope below it */
};

/**
 * Derivatives of a motion at its outputs, by parameters, inputs and start values.
 *
 * The motion chooses its steps; then copies with one value changed repeat them, side by side in lanes and on
 * threads, and central differences are formed (Bock 1981; runtime/core/motion/repeated_steps.c). It works
 * with each method, with rows, projections, events and impacts. Where an event of the model ends the motion,
 * the last output is the state at that event, and its derivatives include the change of its time.
 */
struct refdyn_derivatives {
    const struct refdyn_batch *batch; /**< the motion. `count`, `output`, `end`, `states` and `statuses` are
                                           not read */
    long number;                      /**< number of the case in the columns of the batch */
    int count;                        /**< variables */
    const struct refdyn_variable *variables; /**< (count) */
    int width;                               /**< values of an output */
    /** Writes the values (width) of the shown state, which are to be differentiated. Calls come from several
     * threads, for cases with different `room`. NULL: q and qd; width is then 2 n. */
    void (*values)(void *context, const struct refdyn_batch_case *one, double *values);
    void *context; /**< first argument of `values` */
    /** As that of a batch, for the motion and each copy, with the same `context`. NULL: not needed. */
    int (*step)(void *context, const struct refdyn_batch_case *one);
    /** (count) derivative of the motion's end by each variable [s]: outputs keep their fractions of the
     * motion. NULL: the end is fixed. */
    const double *end_rates;
    int keeps_means; /**< 1: values with different slopes above and below keep their mean, as a search needs
                        it; they are not looked for */

    double *at;          /**< ((time_count + 2) x width) values of the motion; NULL: not needed */
    double *derivatives; /**< (count x (time_count + 2) x width) */
    struct refdyn_underivable *underivable; /**< (count) */

    struct refdyn_batch_result
        motion;   /**< result: how the motion ended. If it failed, there are no derivatives */
    int outputs;  /**< result: outputs of the motion, including the start and an event that ended it */
    double cpu_s; /**< result: processor time of the motion, of which `copies_cpu_s` is a multiple [s] */
    double copies_cpu_s; /**< result: processor time of the copies [s] */
    long copies;         /**< result: copies that were computed */
};

/** Computes the derivatives. Errors: those of refdyn_batch_run; the status of the motion, except
 * EVENT_ENDS, if it failed. */
int refdyn_derivatives_run(struct refdyn_derivatives *derivatives);

#ifdef __cplusplus
}
#endif

#endif
