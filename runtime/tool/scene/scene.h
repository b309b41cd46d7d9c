/*
 * One model made ready to compute with: read, emitted, compiled, its parameters and inputs set.
 *
 * Values of parameters do not change the emitted C (unless --fold): --set of a parameter, and the parameters
 * of a STATE.json, are applied at run time, so that another value compiles nothing.
 */
#ifndef REFDYN_TOOL_SCENE_H
#define REFDYN_TOOL_SCENE_H

#include "compile/compile.h"
#include "simulate/sampled_inputs.h"
#include "command_line/options.h"
#include "text/output.h"
#include "refdyn.h"
#include "scene/state_file.h"
#include "system/output_file.h"

struct scene {
    struct generation generation;
    bool is_read; /* generation is to be released */
    int told;     /* of its messages */
    struct compiled compiled;
    const struct refdyn_model *model;
    struct refdyn_workspace work;
    struct state state;    /* as the STATE.json gave it; empty without one */
    struct values values;  /* of parameters and inputs that --set or the STATE.json gave */
    double *q, *qd;        /* (n) the model's initial state, or the STATE.json's where it gave one */
    struct inputs *inputs; /* sampled inputs of motions, the caller's; NULL: none */
    const struct refdyn_statics_result *equilibrium; /* that a motion starts from; NULL: another state */
    int *given; /* (anchored_count) anchored parameters that --set or the STATE.json gave */
    struct targets targets;
    struct target *result, *summary; /* of -o, or stdout; of --summary; NULL: none */
};

enum {
    NEEDS_MOTION = 1,        /* equations, accelerations, energy, power */
    NEEDS_STATICS = 2,       /* Q, Q_q, what the workspace needs, and a tangent where rows hold */
    NEEDS_STATE = 4,         /* each quantity of the equations for itself, qdd_free, energy */
    NEEDS_POINTS = 8,        /* r */
    NEEDS_POINT_RATES = 16,  /* rd, C, d */
    NEEDS_ALL = 32,          /* all that the scene has */
    NEEDS_TANGENT = 64,      /* tangent */
    NEEDS_LINEAR = 128,      /* d_rows, C */
    NEEDS_NO_WARNINGS = 512, /* another call has told the model's warnings */
    NEEDS_EACH_START =
        1024,          /* beside NEEDS_STATICS: what rows take from the start may be given by the cases */
    NEEDS_RESULT = 256 /* the files of -o and --summary, opened before anything is computed */
};

/* What --accelerations and --loops may be, by the enums of these names; NULL ends each list. */
extern const char *const scene_acceleration_words[], *const scene_loop_words[];

/* Reads the model alone. Its messages go to stderr: all, or beside a call that tells them those of a model at
 * fault. */
enum status scene_read(struct scene *scene, const struct options *options, bool is_telling);
/*
 * Everything: `needs` chooses what is emitted, 0 reads the model alone. state_path may be NULL. Anchored
 * parameters are set from the model's initial state. scene_close in any case.
 */
enum status scene_open(struct scene *scene, const struct options *options, unsigned needs,
                       const char *state_path);
void scene_close(struct scene *scene);
/* A command on one scene: opens it, does the work, and closes it. */
enum status scene_run(const struct options *options, unsigned needs, const char *state_path,
                      enum status (*work)(struct scene *scene, const struct options *options));

/* No target may be a file that the command has read until now: the model with all that it requires. */
void scene_spare_sources(const struct scene *scene, struct targets *targets);
/* The document, which ends here, becomes the result: STATUS_NUMBERS when a number of it is not finite. */
enum status scene_finish(struct scene *scene, struct document *document);

/* The names of the coordinates that are non-zero in `which` (n), NULL: of all; and "points": where each is.
 */
void put_coordinates(struct document *document, const char *key, const struct refdyn_model *model,
                     const int *which);
void put_positions(struct document *document, const struct scene *scene);
/* Puts "q", "qd", "t", "inputs" and "parameters" of the scene, as in a STATE.json, with the values that were
 * given. */
void put_state(struct document *document, const struct scene *scene);

enum { REFUSED_LENGTH = 400 };
/* After a call that ended with REFDYN_REFUSED in a workspace of the scene's model: writes which parameter
 * value the model refuses, as "FILE:LINE: what is wrong", into text. Returns text. */
const char *scene_refused_fact(const struct scene *scene, const struct refdyn_workspace *work,
                               char text[static REFUSED_LENGTH]);
/* Complains of the first row that is `wrong`, with `fact`; STATUS_DONE when there is none. */
enum status scene_refuse_row(struct scene *scene, bool (*wrong)(const struct row *row), const char *fact);
/* What a step of the generator ended with, after its messages. */
enum status scene_outcome(struct scene *scene, const struct options *options, enum gen_status status);

#endif
