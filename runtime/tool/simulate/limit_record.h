/*
 * Where a motion left the limits of its joints: the farthest beyond those of position, rate and force, over
 * the outputs. Limits change nothing in the motion.
 */
#ifndef REFDYN_TOOL_LIMIT_RECORD_H
#define REFDYN_TOOL_LIMIT_RECORD_H

#include "scene/scene.h"
#include "text/output.h"

/* One limit: of a coordinate, its rate or its programme force. */
struct watched_limit {
    const char *coordinate, *what, *unit;
    int place; /* of the coordinate */
    double least, most;
    double value, t; /* the farthest beyond [m, rad ...; s] */
    double beyond;   /* by so much; 0: never */
};

struct limit_record {
    struct watched_limit *list;
    int count;
    bool has_forces;
    double *force; /* (n) */
};

void limits_start(struct limit_record *record, const struct scene *scene);
/* At one more output. */
void limits_add(struct limit_record *record, struct refdyn_integrator *integrator);
/* A warning for each limit that was left. */
void limits_print(const struct limit_record *record);
/* The same as list "limits", where the model has limits. */
void limits_put(const struct limit_record *record, struct document *document);
void limits_release(struct limit_record *record);

#endif
