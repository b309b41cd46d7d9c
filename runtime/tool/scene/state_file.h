/*
 * STATE.json: {"t": 0, "q": [...], "qd": [...], "inputs": {"NAME": value}, "parameters": {"NAME": value}}.
 *
 * Takes the file and the model that was read; gives the values, complete or with what is missing marked.
 */
#ifndef REFDYN_TOOL_STATE_FILE_H
#define REFDYN_TOOL_STATE_FILE_H

#include "gen.h"

#include <stdbool.h>

struct named_value {
    const char *name;
    double value;
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
