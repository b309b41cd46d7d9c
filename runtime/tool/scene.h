/*
 * One model made ready to compute with: read, emitted, compiled, its parameters and inputs set.
 *
 * Values of parameters do not change the emitted C (unless --fold): --set of a parameter, and the parameters
 * of a STATE.json, are applied at run time, so that another value compiles nothing.
 */
#ifndef REFDYN_TOOL_SCENE_H
#define REFDYN_TOOL_SCENE_H

#include "compile.h"
#include "inputs.h"
#include "options.h"
#include "refdyn.h"
#include "state.h"

struct scene {
    struct generation generation;
    bool is_read; /* generation is to be released */
    struct compiled compiled;
    const struct refdyn_model *model;
    struct refdyn_workspace work;
    void *memory;
    struct state state;    /* as the STATE.json gave it; empty without one */
    double *q, *qd;        /* (n) the model's initial state, or the STATE.json's where it gave one */
    struct inputs *inputs; /* sampled inputs of motions, the caller's; NULL: none */
    int *given;            /* (anchored_count) anchored parameters that --set or the STATE.json gave */
};

enum {
    NEEDS_MOTION = 1,       /* equations, accelerations, energy, power */
    NEEDS_STATICS = 2,      /* Q, Q_q and what the workspace needs */
    NEEDS_STATE = 4,        /* each quantity of the equations for itself, qdd_free, energy */
    NEEDS_POINTS = 8,       /* r */
    NEEDS_POINT_RATES = 16, /* rd, C, d */
    NEEDS_ALL = 32,         /* all that the scene has */
    NEEDS_TANGENT = 64,     /* tangent */
    NEEDS_LINEAR = 128,     /* d_rows, C */
    NEEDS_DIAGONAL = 256    /* diagonals, shifted, u */
};

/* Reads the model for `gen` and `check`; messages go to stderr. */
enum status scene_read(struct scene *scene, const struct options *options);
/* The same beside a call that tells its warnings: those of a model at fault alone. */
enum status scene_read_again(struct scene *scene, const struct options *options);
/*
 * Everything: `needs` chooses what is emitted. state_path may be NULL. Anchored parameters are set from the
 * model's initial state. scene_close in any case.
 */
enum status scene_open(struct scene *scene, const struct options *options, unsigned needs,
                       const char *state_path);
void scene_close(struct scene *scene);

/* Prints the generator's messages from number `first` on. */
void print_messages(const struct generation *generation, int first);

#endif
