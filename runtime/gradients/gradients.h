/* Private declarations: the recorded steps of a motion, and copies that repeat them. */
#ifndef REFDYN_GRADIENTS_H
#define REFDYN_GRADIENTS_H

#include "runtime/batch/batch_private.h"

/* ---- Recorded steps (recorded_steps.c) ---- */

/* Records the steps of a motion as it takes them. */
struct recorded_steps {
    struct refdyn_step_watch watch; /* of the motion */
    struct refdyn_pattern pattern;
    int step_room, waypoint_room, place_room;
    int has_other_steps; /* the pattern's steps are no longer those of the motion */
    long aligned;        /* programme.aligned after the last step */
    long rejected;       /* attempts that were refused until then */
    double *breaks;      /* (break_count) scratch */
    int status;          /* BAD_MEMORY if a step could not be recorded */
};

/* Allocates; error: BAD_MEMORY. Call the second function in any case. */
int refdyn_recorded_start(struct recorded_steps *recorded, const struct refdyn_model *model);
void refdyn_recorded_release(struct recorded_steps *recorded);
/* After the motion: prepares the pattern for copies. Error: BAD_MEMORY. */
int refdyn_recorded_end(struct recorded_steps *recorded);
/* Halves each step of the pattern that is neither empty nor special. Error: BAD_MEMORY. */
int refdyn_recorded_refine(struct recorded_steps *recorded);

#endif
