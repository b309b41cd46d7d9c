/*
 * What `sim` tells of a motion at its end: as text on stderr, as JSON in a file.
 */
#ifndef REFDYN_TOOL_SUMMARY_H
#define REFDYN_TOOL_SUMMARY_H

#include "simulate/trial.h"

struct summary {
    const struct trial *trial;
    const struct estimate *estimate; /* NULL: none */
    double accuracy;                 /* that was asked for, 0: none */
    double cpu_total_s;              /* of all runs that were needed */
};

void summary_print(const struct summary *summary);
/* Into the target, which is finished. Complains when not all could be written, or a number is not finite. */
enum status summary_write(const struct summary *summary, struct target *target);

#endif
