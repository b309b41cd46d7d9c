/*
 * Records of motions: what `sim` and the Python package do along one motion, without files and options.
 *
 * Parts in reading order: memory, writers of results; columns; conditions that end a motion; events; limits
 * of joints; the motion from output to output; messages; the summary. Messages are written to a stream of the
 * caller, one line each, and begin with "refdyn: "; warnings begin with "refdyn: warning: ".
 */
#ifndef REFDYN_RECORD_H
#define REFDYN_RECORD_H

#include <complex.h>
#include <stdbool.h>
#include <stdio.h>

#include "refdyn.h"
#include "runtime/batch/refdyn_batch.h"

/* ---- Memory, and writers ---- */

/* Memory that lasts as long as what is allocated in it. `get` returns zeroed memory; it does not return if
 * there is none. */
struct record_memory {
    void *(*get)(void *context, size_t size);
    void *context;
};

enum { RECORD_NUMBER_LENGTH = 32 };
/* The value with the fewest of 15, 16 or 17 digits that read back exactly. Returns text. */
const char *record_number(double value, char text[static RECORD_NUMBER_LENGTH]);

/* Receives a result as entries: as JSON, or as objects of Python. The key is NULL in a list. */
struct record_writer {
    void *context;
    void (*open)(void *context, const char *key, char bracket);
    void (*close)(void *context, char bracket);
    void (*number)(void *context, const char *key, double value);
    void (*whole)(void *context, const char *key, long value);
    void (*text)(void *context, const char *key, const char *text);
    void (*truth)(void *context, const char *key, bool value);
    void (*null)(void *context, const char *key);
};

void record_put_array(const struct record_writer *writer, const char *key, const double *values, int count);

/* Writes q and qd of joints, and the values of states, if there are any, as an object `states`. */
void record_put_state(const struct refdyn_model *model, const double *q, const double *qd, const char *states,
                      const struct record_writer *writer);

/* ---- Columns of a motion by name (motion_table.c) ----
 * If an earlier column already has a name, the later one is prefixed with its kind: point_, input_ ... */

/* Groups of columns that are computed together, in their order. */
enum record_block {
    RECORD_STATE, /* t, coordinates and rates */
    RECORD_POINTS,
    RECORD_RESIDUALS,
    RECORD_MULTIPLIERS,
    RECORD_ENERGY,
    RECORD_FORCES,
    RECORD_STATES, /* continuous ones */
    RECORD_INPUTS,
    RECORD_COURSES,
    RECORD_ACCELERATIONS,
    RECORD_ANGULAR,
    RECORD_CONTACTS,
    RECORD_BLOCKS /* their number */
};

/* Columns of one dataset in an HDF5 file. */
struct record_part {
    const char *path, *axis;       /* of the dataset; axis: NULL if it has only the axis of time */
    const char *const *axis_names; /* (count) along that axis; NULL without one */
    int first, count;              /* columns */
    bool is_derivative;            /* added to the columns of the motion, and not read as one of them */
};

/* What a column is, as far as errors of motions are estimated by kinds. */
enum record_kind { RECORD_OTHER, RECORD_RATE, RECORD_ACCELERATION, RECORD_FORCE, RECORD_KINDS };

struct record_table {
    struct refdyn_integrator *integrator;
    const struct refdyn_spatial *spatial; /* NULL if no point has angular columns */
    const char **names;                   /* (count) */
    const char **units;                   /* (count) NULL where the model has no unit */
    int ends[RECORD_BLOCKS];
    bool is_wanted[RECORD_BLOCKS];
    bool needs_accelerations; /* a wanted column, besides coordinates and rates */
    struct record_part *parts;
    int part_count;
    double *values; /* (count) of the last record_table_fill */
    int count, filled;
    double *scratch; /* for points, their columns and the programme force */
};

/* Prefix of accelerations if one of their names is already used, and their suffix. */
extern const char record_acceleration_lead[], record_acceleration_ending[];
/* Prefix of forces: `force_NAME` of coordinate NAME. */
extern const char record_force_lead[];
/* Precedes the name of an input's column if that name is taken. */
extern const char record_input_lead[];

/* spatial: the points whose angular velocities and accelerations have columns; NULL for none. */
void record_table_start(struct record_table *table, struct record_memory memory,
                        struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial);
/* Limits record_table_fill to the blocks with a wanted column; wanted (count). */
void record_table_want(struct record_table *table, const bool *wanted);
/* Computes the values at the integrator's state. */
void record_table_fill(struct record_table *table);
/* Looks at a time of the last step, as far as the wanted columns need it, and computes the values there.
 * Returns a status of the runtime. */
int record_table_look(struct record_table *table, double t);
/* Computes a row of results. If events set only inputs and parameters at this time, the row has their new
 * values, with the accelerations and forces that follow from them: an input holds from its row on. */
void record_table_fill_row(struct record_table *table);
/* The first column that is infinite or NaN after record_table_fill, NULL if there is none. Multipliers and
 * forces that are not unique are NaN and do not count. */
const char *record_table_not_finite(const struct record_table *table);
/* The kind of a column; multipliers are forces. */
enum record_kind record_table_kind(const struct record_table *table, int column);
/* Returns whether a column of this name may be NaN in the rows of a motion: a force that is not unique. */
bool record_may_be_open(const char *name);
/* Returns whether the column is the value of a continuous state. */
bool record_table_is_state(const struct record_table *table, int column);
/* The column with this name, -1 if there is none. */
int record_table_find(const struct record_table *table, const char *name, size_t length);
/* Writes the known units of the columns as object "units". */
void record_table_put_units(const struct record_table *table, const struct record_writer *writer);

/* ---- Conditions that end a motion (stop_conditions.c) ----
 * NAME<VALUE or NAME>VALUE ends a motion at the first time at which it holds. NAME is a column. A condition
 * is checked at accepted states and at outputs; one that holds only between them is not detected. */

struct record_stop {
    const char *text; /* as given */
    int column;
    bool is_below; /* '<' */
    double value;
};

struct record_stops {
    struct record_stop *list;
    int count;
    struct record_table table; /* of the observed integrator */
    const char *reached;       /* the condition that held, as given; NULL while none has */
    double t;                  /* the time at which it held [s] */
};

enum record_stop_fault { RECORD_STOP_READ, RECORD_STOP_NO_CONDITION, RECORD_STOP_NO_COLUMN };

/* Begins without conditions; `most` can be added. */
void record_stops_start(struct record_stops *stops, struct record_memory memory, int most,
                        struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial);
/* Adds a condition. `text` must outlive the stops. */
enum record_stop_fault record_stops_add(struct record_stops *stops, const char *text);
/* Returns whether a condition holds at the integrator's state, and notes the first one that does. */
bool record_stops_hold(struct record_stops *stops);
/* If a condition holds now, moves the integrator back to the first time at which one does. No condition held
 * at t_before, which is within the last step or at its beginning. Returns a status of the runtime. */
int record_stops_meet(struct record_stops *stops, double t_before);

/* ---- Events in order (event_record.c). Those of contacts are impact, rest and release ---- */

enum {
    RECORD_EVENTS_KEPT = 500 /* the first events; further ones are only counted */
};

enum record_event_kind { RECORD_EVENT, RECORD_IMPACT, RECORD_RESTS, RECORD_LEAVES };

struct record_mark {
    int event; /* of the model */
    enum record_event_kind kind;
    double t; /* time; for a rest, the end of all rebounds [s] */
};

struct record_events {
    struct record_mark *list; /* (RECORD_EVENTS_KEPT), NULL if the model has no events */
    int *modes;               /* (contact_count) modes of the contacts at the last call */
    double *left;             /* (contact_count) when each had last opened at the last call; NaN: never [s] */
    long count;               /* of all events */
    bool has_ended;           /* by the event `end` */
    struct record_mark end;
    double t_last;     /* time of the last call [s] */
    bool lacks_forces; /* the forces of contacts were not unique at some time */
};

/* "", "impact", "rests" or "leaves". */
const char *record_event_kind_name(enum record_event_kind kind);
void record_events_start(struct record_events *events, struct record_memory memory,
                         const struct refdyn_model *model);
/* Records the events at which refdyn_integrator_step has stopped. `status` is what it returned; returns the
 * same, but REFDYN_OK instead of REFDYN_EVENT_ENDS. */
int record_events_take(struct record_events *events, const struct refdyn_integrator *integrator, int status);
/* A motion that an event has ended continues from another state; its events stay recorded. */
void record_events_resume(struct record_events *events);
/* Write lines and members of a summary, nothing if the model has no events. */
void record_events_print(const struct record_events *events, const struct refdyn_model *model, FILE *out);
void record_events_put(const struct record_events *events, const struct refdyn_model *model,
                       const struct record_writer *writer);
/* What one of two motions has, and the other has not at about the same time. */
struct record_difference {
    bool exists, is_of_other;
    struct record_mark mark;
};

/* Compares the events and contacts of two motions up to `end`: each has those of the other, at times that
 * differ by at most `most`, except for last rebounds of contacts. Returns the first that only one has. */
struct record_difference record_events_compare(const struct record_events *events,
                                               const struct record_events *other, double end, double most);
/* Write the mark of a difference as a line, and as a member of a summary (null if there is none). */
void record_difference_print(const struct record_difference *difference, const struct refdyn_model *model,
                             FILE *out);
void record_difference_put(const struct record_difference *difference, const struct refdyn_model *model,
                           const struct record_writer *writer);
/* Prints at which events the motion is, and the value set by them that the model refuses. */
void record_events_print_refused(const struct refdyn_integrator *integrator, const char *fact, FILE *out);
/* Prints the events at which a motion has failed, if any. */
void record_events_print_failed(const struct refdyn_integrator *integrator, FILE *out);

/* ---- Limits (limit_record.c): extremes and times beyond them, located within the steps ---- */

/* Bounds of a column, infinite where there is none. */
struct record_bound {
    const char *name, *column;
    double from, to;
};

/* Whether the value is beyond a bound by more than rounding. */
bool record_is_beyond(const struct record_bound *bound, double value);

struct record_limit {
    struct record_bound bound;
    int place; /* of its column */
    const char *unit;
    double smallest, t_smallest, largest, t_largest; /* extremes and their times */
    double begin, end;                               /* values at the first and the last time */
    double t_first, duration; /* first time beyond the limit, NAN: none; all of that time [s] */
    double t_open;            /* first time at which the value was not unique (NaN), NAN: none [s] */
};

struct record_limits {
    struct record_limit *list;
    int count;
    struct record_table table; /* of the observed integrator */
    double *samples;           /* of a step */
    bool is_inner;             /* values that jump at an end of a step are those within the step */
    double t;                  /* end of what has been added; -INFINITY: nothing [s] */
};

/* The bounds' names must outlive the limits. */
void record_limits_start(struct record_limits *limits, struct record_memory memory,
                         struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial,
                         const struct record_bound *bounds, int count);
/* Forgets the extremes and excesses, to begin with those of another stretch of the motion. */
void record_limits_clear(struct record_limits *limits);
/* Adds the last step, up to the shown state. Returns a status of the runtime; the integrator shows the same
 * state as before. */
int record_limits_pass(struct record_limits *limits);
/* For a motion that is known at some times alone: adds the values of the integrator's state, with straight
 * lines from those before. */
void record_limits_take(struct record_limits *limits);
/* Prints a warning for each limit that was exceeded. */
void record_limits_print(const struct record_limits *limits, FILE *out);
/* Writes list "limits" if the model has limits. */
void record_limits_put(const struct record_limits *limits, const struct record_writer *writer);

/* ---- Integral of a column (integral_record.c), on the interpolant of the steps ---- */

struct record_integral {
    struct record_table *table; /* of the observed integrator; it may serve others, too */
    int place;                  /* of the column */
    double longest;             /* panel of the quadrature [s] */
    double t;                   /* end of what has been added [s] */
    double value, size;         /* so far: the integral, and that of the magnitude */
    double scale;               /* expected size, 0: unknown; errors count relative to both */
};

/* Begins at the integrator's time, for a motion of this length [s]. */
void record_integral_begin(struct record_integral *integral, struct record_table *table, int place,
                           double span, double scale);
/* Adds the last step, up to the shown state. Returns a status of the runtime; the integrator shows the same
 * state as before. */
int record_integral_pass(struct record_integral *integral);

/* ---- The motion from start to end, output by output (motion_record.c) ---- */

/* Bounds on the work of one motion: outputs that are written as they are computed; outputs and samples that
 * are kept in memory; steps. */
enum { RECORD_OUTPUTS_MAX = 10000000, RECORD_KEPT_MAX = 1000000, RECORD_STEPS_MAX = 1000000000 };

/* Further statuses, beyond the runtime's. */
enum { RECORD_INTERRUPTED = 1000, RECORD_TOO_SLOW, RECORD_NOT_WRITTEN };

/* The caller sets the fields up to `stops` before record_start, the others are zero. */
struct record_motion {
    struct refdyn_workspace *work;
    struct refdyn_integrator *integrator; /* initialised */
    double from, until, every;            /* [s]; until INFINITY: not known; every 0: a 200th of the motion */
    const double *q, *qd;                 /* (n) its start */
    const struct refdyn_samples *samples; /* sampled inputs; NULL: inputs are constant */
    /* takes the steps instead of the integrator, as refdyn_integrator_step; NULL: the integrator does */
    int (*step)(void *stepper, double t_out, long steps);
    void *stepper;
    struct record_stops *stops;       /* conditions that end it; the caller may set them after record_start */
    struct record_limits *limits;     /* to compare it with; as for stops, NULL: none */
    struct record_integral *integral; /* of it; as for stops, NULL: none */

    double next_sample; /* time of the next sample, INFINITY if there is none [s] */
    struct refdyn_energy energy;
    struct record_events events;
    double t_between; /* the first time at which an event sets an input between two outputs [s]; NAN: none */
    double *values;   /* p, then x at the start, if events change them; else NULL */
    long outputs;     /* their number; the first output is the start */
};

/* Asked after every few steps: a status other than 0 ends the motion. */
struct record_watch {
    int (*ask)(void *context, const struct record_motion *motion);
    void *context;
};

/* Time between outputs [s]: `every`, or if it is 0 a 200th of the length `span` of the motion. */
double record_distance(double span, double every);
/* The number of outputs: multiples of `every` from the start, and the end. */
long record_count_outputs(double span, double every);
/* Starts at q and qd. Returns a status of the runtime. Call record_restore at the end in any case. */
int record_start(struct record_motion *motion, struct record_memory memory);
/* Continues to `goal` [s], or until a condition holds or an event ends the motion. Returns a status of the
 * runtime, or what the watch returns. */
int record_advance(struct record_motion *motion, double goal, const struct record_watch *watch);
/* The same to output i, which it adds to the energy balance. */
int record_to(struct record_motion *motion, long i, const struct record_watch *watch);
bool record_is_stopped(const struct record_motion *motion);
/* Prints that inputs have changed between two outputs, so that the rows do not show when; nothing otherwise.
 */
void record_print_between(const struct record_motion *motion, FILE *out);
/* Restores the parameters and inputs of the workspace to their values at the start, which events may have
 * changed. */
void record_restore(const struct record_motion *motion);

/* ---- A finer motion (finer_options.c) ---- */

/* A hundredth of the tolerance, or half the step, of a motion that has ended. *share: the expected ratio of
 * the errors. */
struct refdyn_options record_finer_options(const struct refdyn_integrator *integrator, double *share);
/* The largest factor of the tolerance. */
extern const double record_finer_most;
/* Times as many places at which a finer motion looks for events. */
extern const int record_finer_looks;
/* The tolerance of rates in a finer motion that shows the errors of rates, accelerations and forces as well;
 * 0 with fixed steps. */
double record_finer_rates(const struct refdyn_options *options);

/* ---- Messages about failed computations, and about states (failure_messages.c) ---- */

/* Reports a status of the runtime with its time and state. Of many coordinates it shows those that failed or
 * are largest. qd may be NULL. */
void record_print_failed(const struct refdyn_workspace *work, int status, double t, const double *q,
                         const double *qd, FILE *out);
/* Prints the probable causes of a value that is infinite or not a number, if that is the status. */
void record_print_value_advice(int status, FILE *out);
/* Prints up to three rows with the largest residuals at a state, which `where` describes. */
void record_print_residuals(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                            const char *where, FILE *out);
/* Prints what helps if no state near the start satisfies the rows. */
void record_print_start_advice(FILE *out);
/* Prints the condition of the rows at a state. Returns true if they are close to losing rank. */
bool record_print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                            FILE *out);
/* Prints the names of redundant rows. */
void record_print_rows_left_out(const struct refdyn_model *model, const int *rows, int count, FILE *out);
/* The same for all rows of a workspace after its accelerations were solved at this state, with a warning of
 * those that have no slope there. */
void record_print_redundant_rows(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                                 FILE *out);

/* ---- Advice after a failed motion (failure_advice.c) ---- */

/* After a motion has failed with this status, prints probable causes at the last accepted state, and what to
 * do. unfit: as in record_print_failure. */
void record_print_advice(const struct record_motion *motion, int status, const char *unfit, FILE *out);

/* ---- Messages about a motion, and its summary (motion_messages.c) ---- */

enum { RECORD_STABILISE_COUNT = 3 };
/* By enum refdyn_stabilise. */
extern const char *const record_stabilise_names[RECORD_STABILISE_COUNT];
/* alpha h = beta h of --stabilise baumgarte-auto. */
extern const double record_gain_share;
/* Baumgarte gains that follow the step. */
bool record_gains_follow_step(const struct refdyn_options *options);

/* Warns of a start off the programme, of impacts and contacts that cannot happen as stated, and of redundant
 * rows. is_as_requested: the caller has asked for the start as it is. */
void record_print_start(const struct record_motion *motion, bool is_as_requested, FILE *out);
/* Warns of rows without gains. */
void record_print_gains(const struct refdyn_workspace *work, const struct refdyn_options *options, FILE *out);
/* Prints why a motion has failed with this status. unfit: the infinite or NaN column that ended it, or NULL.
 * refused: a parameter value that the model refuses, as "FILE:LINE: what is wrong". */
void record_print_failure(const struct record_motion *motion, int status, bool is_started, const char *unfit,
                          const char *refused, FILE *out);
/* Warns of rows that are not satisfied, and of energy that does not balance. */
void record_print_rows_warning(const struct refdyn_integrator *integrator, FILE *out);
void record_print_balance_warning(const struct record_motion *motion, FILE *out);

/* Warns of derivatives that do not exist: by which of the names (count), from what time, and why. */
void record_print_underivable(const struct refdyn_model *model, const char *const *names,
                              const char *const *columns, const struct refdyn_underivable *underivable,
                              int count, FILE *out);

/* What the summary has in addition to the motion. */
struct record_summary {
    const struct record_motion *motion;
    const char *method;                              /* its name */
    const struct refdyn_statics_result *equilibrium; /* the start; NULL for another one */
    double cpu_s, wall_s;
    const struct record_limits *limits;
};

/* Writes the members of a summary. */
void record_put_summary(const struct record_summary *summary, const struct record_writer *writer);

/* ---- Equilibria (equilibrium_record.c) ---- */

struct record_equilibrium {
    struct refdyn_workspace *work;
    const struct refdyn_statics_options *options;
    const struct refdyn_statics_result *result;
    const int *held;           /* (n) non-zero for held coordinates */
    const double *hold_force;  /* (n) */
    const double *q, *qd;      /* (n) the equilibrium, and rates 0 */
    const char *const *starts; /* (m) a parameter that the row reads from the start of a motion, NULL: none */
};

enum { RECORD_STABILITY_LENGTH = 64 };
/* "stable", "neutral in 1 direction", "unstable in 2 directions". Returns text. */
const char *record_stability_text(const struct refdyn_statics_result *result,
                                  char text[static RECORD_STABILITY_LENGTH]);
/* Warns of an equilibrium that is unstable or that the load does not lead to. */
void record_print_equilibrium(const struct record_equilibrium *equilibrium, FILE *out);
/* Prints why there is no equilibrium, after this status of refdyn_statics. */
void record_print_no_equilibrium(const struct record_equilibrium *equilibrium, int answer, FILE *out);
/* Prints explanations of the result that are not warnings. */
void record_print_notes(const struct record_equilibrium *equilibrium, FILE *out);
/* Writes forces, rows and stability. */
void record_put_equilibrium(const struct record_equilibrium *equilibrium, const struct record_writer *writer);

/* ---- Small motions and linear models (small_motions.c, spectrum.c, linear_model.c) ---- */

/* Memory of results and scratch, and solutions of linear equations by a library of the caller. Matrices are
 * row by row. Each function returns whether it has succeeded. */
struct record_algebra {
    struct record_memory memory;
    void *context;
    /* columns := matrix^-1 columns, or matrix^-T columns; both (size x size). */
    bool (*solve)(void *context, int size, const double *matrix, bool is_transposed, double *columns);
    /* Eigenvalues of T, with left and right vectors (size x size) in columns as LAPACK's dgeev writes them:
     * real and imaginary part of a pair in two columns, the one with positive imaginary part first.
     * Overwrites T. */
    bool (*eigen)(void *context, int size, double *T, double *re, double *im, double *left, double *right);
    /* The smallest x (columns) that minimises |A x - b|. Singular values below tol times the largest count as
     * 0. Overwrites A and b. */
    bool (*least_squares)(void *context, int rows, int columns, double *A, double *b, double tol, double *x);
};

/* Memory from `algebra` for `count` entries, and for a matrix. */
void *record_allocate(const struct record_algebra *algebra, size_t count, size_t size);
double *record_allocate_matrix(const struct record_algebra *algebra, int rows, int columns);
/* out (rows x columns) += factor * left (rows x inner) * right (inner x columns) */
void record_add_product(double *out, double factor, const double *left, const double *right, int rows,
                        int inner, int columns);
/* left * right */
double *record_product(const struct record_algebra *algebra, const double *left, const double *right,
                       int rows, int inner, int columns);
/* left^T right, both n rows */
double *record_product_of_columns(const struct record_algebra *algebra, const double *left, int left_columns,
                                  const double *right, int columns, int n);
/* Returns whether a symmetric matrix (n x n) has a Cholesky factor, which overwrites it. */
bool record_factor(double *matrix, int n);
/* columns (n x count) := matrix^-1 columns, with the factor of record_factor. */
void record_solve_factored(const double *factor, int n, double *columns, int count);

/* Solutions v = basis w + drift x of rows R v + B x = 0 (count x n, count x width), where w are the
 * independent entries of v, by elimination with full pivoting. Coordinates that occur in no row stay
 * separate, and soft coordinates keep their digits, which an orthonormal basis would mix with stiff ones. */
struct record_freedom {
    const struct record_algebra *algebra;
    int n, width, rank, count;
    int *row;      /* (count) rows: the first `rank` are used, the others redundant */
    int *column;   /* (n) the first `rank` are dependent, in the order of elimination; then the independent
                      ones, ascending */
    int free;      /* number of independent columns: n - rank, or less after record_freedom_drop */
    double *basis; /* (n x free) */
    double *drift; /* (n x width) */
};

void record_find_freedom(struct record_freedom *freedom, const struct record_algebra *algebra,
                         const double *R, int count, int n, const double *B, int width);

/* Leaves out the last `count` independent columns, whose changes have no effect. */
void record_freedom_drop(struct record_freedom *freedom, int count);

/* The equations of motion for x, a small change of the coordinates that are not held, with the accelerations
 * and multipliers of the state (theory, sect. 7.6). At rest: M x'' + D x' + K x - u^T mu = 0,
 *     position rows: u x = 0,   velocity rows: u x' + psi_q x = 0 */
struct record_linear {
    int n, m;
    int states;         /* number of continuous states, the last coordinates: x' is their value, and x
                           has no effect */
    int *place;         /* (n) of the coordinates not held, in q */
    double *M, *D, *K;  /* (n x n) */
    double *u, *psi_q;  /* (m x n) */
    double *G_q, *G_qd; /* (m x n) derivatives of u qdd - k */
    enum refdyn_row_level *level; /* (m) */
    double *given;                /* (3 n + 1 + m, all coordinates) qd, qdd, power, lambda of the state */
    double *force;                /* (n) h + Q + u^T lambda - M qdd, the unbalanced force */
    double residual;              /* the largest of these */
};

/* Spectrum of small motions x = shape e^(eigenvalue t) (theory, sect. 8.10). Each occurs once: of a conjugate
 * pair, the one with positive imaginary part. */

struct record_mode {
    double complex eigenvalue;   /* [1/s]; parts within rounding are exactly 0 */
    const double complex *shape; /* (n) the largest entry is 1 */
};

struct record_spectrum {
    const struct record_algebra *algebra;
    struct record_mode *modes; /* by |eigenvalue|, ascending; a growing one before a decaying one */
    int count;
    const int *redundant; /* (redundant_count) rows that depend on others, or have no effect at rest */
    int redundant_count;
};

/* A kink or jump of forces or rows at a state (kinked_state.c). */
struct record_kink {
    int coordinate; /* place in q, or n + place in qd, that moves the state off it; -1: there is none */
    double part;    /* by which forces, stiffness or damping differ on both sides */
};

/* Small motions about q at t, with qd = 0. */
struct record_small_motions {
    struct refdyn_workspace *work;
    double t;
    const double *q, *qd; /* (n) qd is 0 */
    const int *held;      /* (n) non-zero for held coordinates */
    bool accelerates;     /* the accelerations of the state are those of its motion; otherwise they are 0, and
                             the multipliers balance the forces as well as they can */
    const double *given;  /* used as linear.given without change; NULL: found as above */
    struct record_linear linear;
    struct record_spectrum spectrum;
    struct record_kink kink;
    double phi; /* largest |phi| */
    double *C;  /* (points x 3 x n) */
};

/* Returns a status of the runtime. The model must have a tangent and, with rows, d_rows. */
int record_find_spectrum(struct record_spectrum *spectrum, const struct record_linear *linear,
                         const struct record_algebra *algebra);
/* The first coordinate whose force (n, of the free ones) is out of balance by more than 1e-6 rad or m, and by
 * an acceleration of more than 1e-9 rad/s^2 or m/s^2; -1 if there is none. */
int record_find_unbalanced(const struct record_linear *linear, const double *force);
/* Finds `linear` from the first fields of `motions`. Returns a status of the runtime. */
int record_linearise(struct record_small_motions *motions, const struct record_algebra *algebra);
/* The kink at the state of `motions` after record_linearise. Evaluates the equations at other states. */
struct record_kink record_find_kink(const struct record_small_motions *motions,
                                    const struct record_algebra *algebra);
/* Warns of it, if there is one. */
void record_print_kink(const struct record_kink *kink, const struct refdyn_model *model, FILE *out);
/* The same, and then the spectrum and all other fields. */
int record_find_small_motions(struct record_small_motions *motions, const struct record_algebra *algebra);
/* Damping ratio; -1 for growth without oscillation, 0 for an eigenvalue 0. */
double record_damping_of(const struct record_mode *mode);
/* Frequency [Hz]. */
double record_frequency_of(const struct record_mode *mode);
/* Warns of redundant rows, and of a state that is off the programme or not an equilibrium. */
void record_print_small_motions(const struct record_small_motions *motions, FILE *out);
/* Writes phi, residual, unstable and the first `count` modes. */
void record_put_small_motions(const struct record_small_motions *motions, int count,
                              const struct record_writer *writer);

/*
 * The linear model about a state, which may move: with changes s of the independent coordinates, then of the
 * independent rates, and x of the inputs,
 *     s' = A s + B x + rate,   change of the outputs = C s + D x
 * The rows act without stabilisation. Outputs: r, rd and rdd of each point, then the courses.
 */
struct record_linear_model {
    struct record_small_motions motions; /* its first fields are given, as for record_find_small_motions */
    bool moves_held; /* held coordinates may move, while the forces that hold them stay as they are */
    int size, position_count; /* states; those that are coordinates */
    int *state;               /* (size) coordinate of each state */
    int output_count;
    double *A, *B, *C, *D;       /* (size x size), (size x inputs), (outputs x size), (outputs x inputs) */
    double *rate;                /* (size) */
    double complex *eigenvalues; /* (size) by size, ascending; of A */
    int moved_row;               /* a position or velocity row that an input moves: then no linear model */
    int moving_input;            /* exists, and only these two are set; otherwise -1 */
};

/* Returns a status of the runtime. The model must have tangent, d_rows with rows, tangent_x with inputs, C
 * and the blocks q and qd of d_points with points, and the blocks q, qd and x of d_course with courses.
 * Leaves the gains of all rows 0. */
int record_find_linear_model(struct record_linear_model *model, const struct record_algebra *algebra);
/* Writes states, inputs, outputs, A, B, C, D, rate, q, qd, t and eigenvalues. */
void record_put_linear_model(const struct record_linear_model *model, const struct record_writer *writer);

#endif
