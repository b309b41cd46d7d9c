/* Clocks, in seconds. */
#ifndef REFDYN_TOOL_TIMING_H
#define REFDYN_TOOL_TIMING_H

#include <time.h>

static inline double clock_seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline double wall_seconds(void) {
    return clock_seconds(CLOCK_MONOTONIC);
}

/* Processor time of all threads of the program. */
static inline double process_cpu_seconds(void) {
    return clock_seconds(CLOCK_PROCESS_CPUTIME_ID);
}

/* Of the calling thread alone. */
static inline double cpu_seconds(void) {
    return clock_seconds(CLOCK_THREAD_CPUTIME_ID);
}

#endif
