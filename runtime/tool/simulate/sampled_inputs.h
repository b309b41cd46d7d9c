/*
 * Sampled inputs of a motion from a CSV file: columns `t` and names of inputs, others are passed over.
 *
 * Each value holds from its sample to the next one (zero-order hold), the first one also before, the last one
 * also after. The motion's steps end at the samples.
 */
#ifndef REFDYN_TOOL_SAMPLED_INPUTS_H
#define REFDYN_TOOL_SAMPLED_INPUTS_H

#include "refdyn_batch.h"

#include <stdbool.h>

struct inputs {
    const char *path;
    struct refdyn_samples samples; /* all of the file */
    int *place;                    /* (width) as the samples have them, while they are read */
    double *rows;                  /* (room x (1 + width)) */
    int room;
    double next; /* time of the sample that lies ahead, INFINITY: none [s] */
};

/* Whether events of the model set this input, which samples then cannot. */
bool inputs_are_set_by_event(const struct refdyn_model *model, int input);
/* False, with a complaint as FILE:LINE, when the file does not have them. */
bool inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model);
/* Sets x to the values at t; ahead of it lies inputs->next. */
void inputs_set(struct inputs *inputs, double t, double *x);
#endif
