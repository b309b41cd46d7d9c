/*
 * Sampled inputs of a motion from a CSV file: columns `t` and names of inputs, others are passed over.
 *
 * Each value holds from its sample to the next one (zero-order hold), the first one also before, the last one
 * also after. The motion's steps end at the samples.
 */
#ifndef REFDYN_TOOL_SAMPLED_INPUTS_H
#define REFDYN_TOOL_SAMPLED_INPUTS_H

#include "refdyn.h"

#include <stdbool.h>

struct inputs {
    const char *path;
    int width;    /* columns that are inputs */
    int *place;   /* (width) of the model's inputs */
    double *rows; /* (count x (1 + width)) time of each sample [s], ascending, and its values */
    int count, room;
    int next; /* first sample that lies ahead */
};

/* False, with a complaint as FILE:LINE, when the file does not have them. */
bool inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model);
/* Sets x to the values at t; ahead of it lies inputs_next. */
void inputs_set(struct inputs *inputs, double t, double *x);
/* Time of the next sample, INFINITY: none. */
double inputs_next(const struct inputs *inputs);

#endif
