/*
 * STATE.json: {"t": 0, "q": [...], "qd": [...], "inputs": {"NAME": value}, "parameters": {"NAME": value}}.
 *
 * Takes the file and the model that was read; returns the values, complete or with missing ones marked. The
 * results of `statics` and `modes` are states, too: their other keys are ignored, but `coordinates` must be
 * those of the model.
 */
#ifndef REFDYN_TOOL_STATE_FILE_H
#define REFDYN_TOOL_STATE_FILE_H

#include "gen.h"

#include <stdbool.h>

struct named_value {
    const char *name;
    double value;
};

/* Values that are applied at run time; later ones win. Parameters: from the STATE.json, then from --set.
 * Inputs: from --set, then from the STATE.json. */
struct values {
    struct named_value *list, *inputs; /* inputs: of --set */
    int count, input_count;
};

struct state {
    double t;
    double *q, *qd; /* (n) NULL: not given */
    struct named_value *inputs, *parameters;
    int input_count, parameter_count;
};

/* Complains on stderr with FILE:LINE and returns false when the file is not a state
 * of this model. */
bool state_read(struct state *state, const char *path, const struct generation *generation);

#endif
