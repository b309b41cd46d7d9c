/* What this folder offers. */
#ifndef REFDYN_TOOL_SCENE_H
#define REFDYN_TOOL_SCENE_H

#include <stdbool.h>

#include "gen/gen.h"
#include "refdyn.h"
#include "refdyn_batch.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/*
 * What linear rows leave free.
 *
 * Takes rows R v + B x = 0 (count x n each); gives v = basis w + drift x, w the entries of v that stay
 * independent, by elimination with full pivoting. Coordinates that no row names keep to themselves, and so do
 * the digits of soft ones beside stiff ones, which an orthonormal basis would mix.
 */

struct freedom {
    int n, rank, count;
    int *row;      /* (count) rows: the first `rank` are used, the others redundant */
    int *column;   /* (n) the first `rank` depend, in the order of elimination; then the independent ones,
                      ascending */
    double *basis; /* (n x (n - rank)) */
    double *drift; /* (n x n) */
};

/* B may be NULL: none. */
void find_freedom(struct freedom *freedom, const double *R, const double *B, int count, int n);

/*
 * Sampled inputs of a motion from a CSV file: columns `t` and names of inputs, others are passed over.
 *
 * Each value holds from its sample to the next one (zero-order hold), the first one also before, the last one
 * also after. The motion's steps end at the samples.
 */

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

/*
 * STATE.json: {"t": 0, "q": [...], "qd": [...], "inputs": {"NAME": value}, "parameters": {"NAME": value}}.
 *
 * Takes the file and the model that was read; returns the values, complete or with missing ones marked. The
 * results of `statics` and `modes` are states, too: their other keys are ignored, but `coordinates` must be
 * those of the model.
 */

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

/*
 * One model made ready to compute with: read, emitted, compiled, its parameters and inputs set.
 *
 * Values of parameters do not change the emitted C (unless --fold): --set of a parameter, and the parameters
 * of a STATE.json, are applied at run time, so that another value compiles nothing.
 */

extern const char table_input_lead[]; /* before the name of a column of an input whose name is taken */

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

/* The options of models. */
extern const struct option_rule scene_rules[];

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

/* Messages about computations that failed. */

/* Says on stderr which status of the runtime came at which time and state, of many coordinates those that are
 * at fault or largest; returns STATUS_NUMBERS. */
enum status numbers_failed(const struct scene *scene, int result, double t, const double *q,
                           const double *qd);
/* The rows that are farthest from what they ask for at a state, of which `where` tells in words; at most
 * three. */
void print_residuals(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                     const char *where);
/* The condition of the rows at a state, in words; true when they are near losing rank. */
bool print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/* Rows that say what others say, by name. */
void print_rows_left_out(const struct refdyn_model *model, const int *rows, int count);
/* The same for all rows of a workspace, once its accelerations were solved. */
void print_redundant_rows(const struct refdyn_workspace *work);

/*
 * The equations of small motions about a state at rest.
 *
 * Takes a scene, its q and t, and the coordinates that are held; gives, for x = change of the others,
 *     M x'' + D x' + K x - u^T mu = 0,   position rows: u x = 0,   velocity rows: u x' + psi_q x = 0
 * with K and D those of M qdd - h - Q - u^T lambda at qd = 0, qdd = 0 (h, quadratic in qd, then has no part
 * in K, and M none), and with phi and psi themselves: gains of stabilisation do not enter.
 */

struct linear {
    int n, m;
    int *place;      /* (n) of the coordinates not held, in q */
    double *M, *D;   /* (n x n) */
    double *K;       /* (n x n) */
    double *u;       /* (m x n) */
    double *psi_q;   /* (m x n) 0 in position rows */
    int *is_level_q; /* (m) non-zero: a position row */
    double *force;   /* (n) Q + u^T lambda: what is out of balance */
    double residual; /* the largest of these */
};

/* lambda is that of Q + u^T lambda = 0, in least squares; of lambdas that do, the smallest. Returns a status
 * of the runtime. */
int linearise(struct linear *linear, struct scene *scene, const int *held);
/* The first of the n that is out of balance by more than 1e-6 rad or m, and by more than 1e-9 rad/s^2 or
 * m/s^2 of its own; -1: none, the state is an equilibrium. */
int linear_out_of_balance(const struct linear *linear);

#endif
