/*
 * The tolerance of a motion from the error that the whole of it may have.
 *
 * Takes a task and the options of its method; gives the run whose estimated error is small enough, or the
 * best one where rounding is reached before. All runs together cost at most about three times the one that is
 * taken.
 */
#ifndef REFDYN_TOOL_ACCURACY_H
#define REFDYN_TOOL_ACCURACY_H

#include "simulate/trial.h"

/* A run with its rows in a file of its own. */
struct candidate {
    struct trial trial;
    FILE *rows;               /* as row_sink_numbers writes them */
    struct estimate estimate; /* of its error */
    bool has_estimate;
};

struct search {
    struct candidate *taken; /* NULL: nothing ran to its end */
    bool is_reached;
    bool is_exhausted;      /* rounding: runs no longer come nearer to each other as the tolerance falls */
    struct candidate *last; /* the run that failed or was interrupted, when nothing was taken */
    double cpu_total_s;
    long tries; /* steps of all runs */
    double difference_before,
        fall_before;                /* of the last two runs but one and their tolerances; 0: none yet */
    struct candidate candidates[2]; /* the last two runs */
};

/* search_release in any case. */
enum status search_run(struct search *search, const struct task *task,
                       const struct refdyn_options *integration);
void search_release(struct search *search);

#endif
