/*
 * The variables of an FMU as importers see them: names, units, roles, start values.
 *
 * Names are those of the columns of `refdyn sim`; der(NAME) is the derivative of a coordinate. Where a name
 * is taken already, it gets its kind before it, as in a CSV.
 */
#ifndef REFDYN_TOOL_CATALOGUE_H
#define REFDYN_TOOL_CATALOGUE_H

#include "fmi/variables.h"
#include "scene/scene.h"

enum causality { AS_INDEPENDENT, AS_PARAMETER, AS_INPUT, AS_OUTPUT, AS_LOCAL };
enum variability { IS_FIXED, IS_TUNABLE, IS_DISCRETE, IS_CONTINUOUS };
enum initial { INITIAL_NONE, INITIAL_EXACT, INITIAL_APPROXIMATE, INITIAL_CALCULATED };

struct catalogue_entry {
    struct fmu_variable variable;
    unsigned reference;
    const char *name, *unit, *about; /* unit NULL: none, or the model does not say */
    enum causality causality;
    enum variability variability;
    enum initial initial; /* exact, approximate: it has a start value */
    double start;
    int state; /* the entry whose derivative it is; -1: it is none */
};

struct catalogue {
    struct catalogue_entry *entries;
    int count, room;
    int first[FMU_KIND_COUNT]; /* the entry of the first variable of a kind */
};

/* Of the scene's start. */
void catalogue_make(struct catalogue *catalogue, struct scene *scene, bool has_indicators);
/* (3 points x n) Which coordinates the position of each point depends on. */
bool *catalogue_dependencies(const struct scene *scene);

#endif
