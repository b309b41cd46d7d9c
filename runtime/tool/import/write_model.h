/*
 * A robot as a Lua model that a person would write: see models/README.md.
 */
#ifndef REFDYN_TOOL_WRITE_MODEL_H
#define REFDYN_TOOL_WRITE_MODEL_H

#include "import/flexible.h"

#include <stdio.h>

struct model_choice {
    const char *source;    /* name of the file that the robot is from */
    bool is_floating;      /* the root moves freely */
    bool has_drives;       /* an input at each joint with one coordinate that follows no other */
    double friction_width; /* rate over which dry friction turns its sign; 0: friction is left out */
    const struct beam_choice *beam;
    const struct flexible *flexible; /* (flexible_count) links that are beams */
    int flexible_count;
};

void write_model(const struct robot *robot, const struct model_choice *choice, FILE *out);

#endif
