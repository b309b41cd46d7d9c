/*
 * The cases of a batch computed: what happens on its threads.
 */
#ifndef REFDYN_TOOL_BATCH_RUN_H
#define REFDYN_TOOL_BATCH_RUN_H

#include "batch/batch_setup.h"

/* Cases of which something is told, and the lowest of them. */
struct noted_cases {
    long count, first;
};

struct batch_count {
    long cases, failed; /* that ended in this call, well or not */
    /* that started from an equilibrium which is unstable, or which lies beyond a limit point of the load */
    struct noted_cases unstable, beyond;
    struct noted_cases far;           /* that a projection of the start has moved far */
    double cases_cpu_s;               /* of these cases: the sum of their shares */
    double cpu_started, wall_started; /* clocks when the first case began */
    double cpu_s, wall_s;             /* of all since then: threads, journal, file; by batch_time_passed */
    long steps, steps_alone;          /* all, and those that motions took themselves, outside lanes */
};

/* Where records go, and which cases have one already. */
struct batch_sink {
    void *context;
    bool (*has)(void *context, long number);
    /* Of one case at a time. False, with a complaint: it cannot be taken. */
    bool (*take)(void *context, const struct case_record *record);
};

/*
 * Computes all cases of the setup that the sink does not have, and gives it their records. Shows how far it
 * is. STATUS_FAULT when a record cannot be taken, STATUS_NUMBERS when a signal came.
 */
enum status batch_run(struct batch_setup *setup, const struct batch_sink *sink, struct batch_count *count);

/* Time of the program until now. */
void batch_time_passed(struct batch_count *count);

/* The batch of one structure without its cases, threads and callbacks. */
struct refdyn_batch batch_of_structure(const struct batch_setup *setup, const struct structure *structure);

#endif
