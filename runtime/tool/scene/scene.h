/* One model made ready to compute with, and the parts that several commands share: sampled inputs;
 * STATE.json; the scene; repetition by --watch; messages about failures. */
#ifndef REFDYN_TOOL_SCENE_H
#define REFDYN_TOOL_SCENE_H

#include <stdbool.h>

#include "gen/gen.h"
#include "refdyn.h"
#include "refdyn_batch.h"
#include "runtime/record/record.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* Sampled inputs of a motion from a CSV file, columns `t` and names of inputs, or from a motion as HDF5. Each
 * value holds from its sample to the next one (zero-order hold); the first one also before, the last one also
 * after. */

struct inputs {
    const char *path;
    struct refdyn_samples samples; /* all samples of the file */
    int *place;                    /* (width) columns as the samples have them, while they are read */
    double *rows;                  /* (room x (1 + width)) */
    int room;
    double next; /* time of the next sample, INFINITY if there is none [s] */
};

/* Returns whether events of the model set this input; samples cannot set it then. */
bool scene_inputs_are_set_by_event(const struct refdyn_model *model, int input);
/* Returns false and reports the error as FILE:LINE if the file does not have them. */
bool scene_inputs_read(struct inputs *inputs, const char *path, const struct refdyn_model *model);
/* Sets x to the values at t, and inputs->next. */
void scene_inputs_set(struct inputs *inputs, double t, double *x);

/* STATE.json: {"t": 0, "q": [...], "qd": [...], "inputs": {"NAME": value}, "parameters": {"NAME": value}}.
 * Reading returns all values that the file gives. */

struct named_value {
    const char *name;
    double value;
};

/* Values that are set at run time; later ones win. Parameters: from the STATE.json, then from --parameters,
 * then from --set. Inputs: from --set, then from the STATE.json. */
struct values {
    struct named_value *list, *inputs; /* inputs: of --set */
    int count, input_count;
};

struct state {
    double t;
    double *q, *qd, *qdd; /* (n) NULL if not given; only `eval` reads qdd */
    struct named_value *states, *inputs, *parameters;
    int state_count, input_count, parameter_count;
    struct named_value *found; /* of --parameters: parameters, inputs and start values */
    int found_count;
};

/* Returns false and reports errors with FILE:LINE if the file is not a state of this model. */
bool scene_state_read(struct state *state, const char *path, const struct generation *generation,
                      bool takes_accelerations);
/* Reads the object `values` of a FIT.json into state->found. Returns false and reports errors with FILE:LINE.
 */
bool scene_found_read(struct state *state, const char *path, const struct generation *generation);

/* One model made ready to compute with: read, emitted, compiled, its parameters and inputs set. */

struct scene {
    struct generation generation;
    bool is_read; /* the generation must be released */
    int told;     /* how many of its messages were printed */
    struct compiled compiled;
    const struct refdyn_model *model;
    struct refdyn_workspace work;
    struct state state;    /* from the STATE.json; empty without one */
    struct values values;  /* of parameters and inputs, from --set or the STATE.json */
    double *q, *qd;        /* (n) from the STATE.json, or the model's initial state */
    struct inputs *inputs; /* sampled inputs of a motion, owned by the caller; NULL if there are none */
    const struct refdyn_statics_result
        *equilibrium; /* the equilibrium that a motion starts from; NULL for another start */
    int *given;       /* (anchored_count) non-zero: --set or the STATE.json gave this anchored parameter */
    struct targets targets;
    struct target *result, *summary; /* of -o, or stdout; of --summary, or NULL */
};

enum {
    NEEDS_MOTION = 1,  /* equations, accelerations, energy, power */
    NEEDS_STATICS = 2, /* Q, Q_q, the quantities of the workspace, and a tangent if rows hold */
    NEEDS_STATE = 4,   /* each quantity of the equations, qdd_free, energy; inverse dynamics at a given qdd */
    NEEDS_POINTS = 8,  /* r */
    NEEDS_POINT_RATES = 16,  /* rd, C, d */
    NEEDS_ALL = 32,          /* all quantities of the scene */
    NEEDS_TANGENT = 64,      /* tangent */
    NEEDS_LINEAR = 128,      /* d_rows, C */
    NEEDS_NO_WARNINGS = 512, /* another call has printed the model's warnings */
    NEEDS_EACH_START =
        1024, /* with NEEDS_STATICS: the cases may give the values that rows read from the start */
    NEEDS_OPTIMISED = 2048, /* the optimised library from the start: COMPILE_OPTIMISED */
    NEEDS_ONCE = 4096,      /* a few calls: COMPILE_ONCE */
    NEEDS_OUTPUTS = 8192,   /* derivatives of points and courses, and of the motion by inputs */
    NEEDS_DRIVES = 16384,   /* the tangent as matrices, and by the inputs */
    NEEDS_RESULT = 256      /* the files of -o and --summary, opened before the computation */
};

/* The options that this folder reads. */
extern const struct option_rule scene_rules[];

/* Reads the model. Prints all its messages, or, unless is_telling, only those of a model that cannot be read.
 */
enum status scene_read(struct scene *scene, const struct options *options, bool is_telling);
/* Opens a scene. `needs` chooses the emitted quantities; 0 only reads the model. state_path may be NULL.
 * Anchored parameters are set from the model's initial state. Call scene_close in any case. */
enum status scene_open(struct scene *scene, const struct options *options, unsigned needs,
                       const char *state_path);
void scene_close(struct scene *scene);
/* Sets parameters, inputs and start values (NAME, NAME_d) of an open scene, and what follows from them. Names
 * that the model lacks have no effect. Reports values that the model refuses. */
enum status scene_set_values(struct scene *scene, struct named_value *values, int count);
/* Opens a scene, calls `work`, and closes it. */
enum status scene_run(const struct options *options, unsigned needs, const char *state_path,
                      enum status (*work)(struct scene *scene, const struct options *options));

/* Protects the model and all files that it requires: no target may be one of them. */
void scene_spare_sources(const struct scene *scene, struct targets *targets);
/* Opens the document of a result and its object, with the version of the program under the key `refdyn`. */
void scene_document_open(struct document *document);
/* Ends the document and makes it the result. Returns STATUS_NUMBERS if one of its numbers is not finite. */
enum status scene_finish(struct scene *scene, struct document *document);

/* Puts the names of the coordinates for which `which` (n) is non-zero, of all if it is NULL; and "points"
 * with their positions. */
void scene_put_coordinates(struct document *document, const char *key, const struct refdyn_model *model,
                           const int *which);
void scene_put_positions(struct document *document, const struct scene *scene);
/* Puts "q", "qd", "t", "inputs" and "parameters" of the scene, as in a STATE.json, with the given values. */
void scene_put_state(struct document *document, const struct scene *scene);

enum { REFUSED_LENGTH = 400 };
/* After REFDYN_REFUSED in a workspace of the scene's model, writes which parameter value the model refuses,
 * as "FILE:LINE: what is wrong", into text. Returns text. */
const char *scene_refused_fact(const struct scene *scene, const struct refdyn_workspace *work,
                               char text[static REFUSED_LENGTH]);
/* Reports `fact` about a row, with its place; returns STATUS_FAULT. */
enum status scene_refuse(struct scene *scene, const struct row *row, const char *fact);
/* Reports the first row that is `wrong`, with `fact`; returns STATUS_DONE if there is none. */
enum status scene_refuse_row(struct scene *scene, bool (*wrong)(const struct row *row), const char *fact);
/* Prints the messages of a step of the generator and returns the exit status. */
enum status scene_outcome(struct scene *scene, const struct options *options, enum gen_status status);

/* --watch: runs a command in a separate process, and again whenever one of its files is saved: the model
 * (NULL if there is none), what it requires, and `files` (count). Returns only for wrong usage, or if it
 * cannot start a process; a signal ends it. */
enum status scene_watch(const struct options *options, const char *model, const char *const *files, int count,
                        enum status (*run)(const struct options *options));

/* A writer of entries of records into a JSON document. */
struct record_writer scene_writer(struct document *document);

/* Messages about failed computations. */

/* Reports a status of the runtime with its time and state. Of many coordinates it shows those that failed or
 * are largest. Returns STATUS_NUMBERS. */
enum status scene_numbers_failed(const struct scene *scene, int result, double t, const double *q,
                                 const double *qd);

#endif
