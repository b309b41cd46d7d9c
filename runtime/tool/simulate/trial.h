/*
 * One run of a motion for `sim`: its rows, its positions at the outputs.
 */
#ifndef REFDYN_TOOL_TRIAL_H
#define REFDYN_TOOL_TRIAL_H

#include "simulate/error_estimate.h"
#include "simulate/limit_record.h"
#include "simulate/motion.h"
#include "simulate/row_sink.h"

struct trial {
    struct motion motion;
    struct stops stops;
    struct track track;
    struct limit_record limits; /* of the rows that are written */
    enum status usage; /* not STATUS_DONE: the stops are wrong, and nothing ran */
    int result;        /* status of the runtime, or MOTION_INTERRUPTED */
    bool is_started;   /* the start could be evaluated */
    const char *unfit; /* the column that is infinite or NaN, which ended it; NULL: none */
};

/* What the motion is, whatever its tolerance. */
struct task {
    struct scene *scene;
    const struct options *options;
    double until; /* where it ends unless it is stopped [s] */
    bool has_stops;
    void (*on_start)(const struct task *task, const struct motion *motion); /* may be NULL */
};

/* rows: where they go, which ends here; NULL: nowhere. trial_release in any case. */
void trial_run(struct trial *trial, const struct task *task, const struct refdyn_options *integration,
               struct row_sink *rows);
void trial_release(struct trial *trial);

#endif
