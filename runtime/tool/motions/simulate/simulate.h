/* What this folder offers. */
#ifndef REFDYN_TOOL_SIMULATE_H
#define REFDYN_TOOL_SIMULATE_H

#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"
#include "refdyn.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/system/system.h"

/*
 * The error of a whole motion, from two runs of it at different tolerances or steps.
 *
 * Where the error of the other run is a part s of that of the judged one, their difference is |1 - s| of the
 * latter (Richardson; Hairer, Norsett and Wanner, Solving ODEs I, II.4). Fixed steps: s = (h_other/h)^p, p
 * the order of the method. Steps that are found: errors go with the tolerance, also where stability rules the
 * steps.
 */

/* Positions at the outputs of one run. */
struct track {
    const struct refdyn_model *model;
    long count;
    double *t; /* (count) [s] */
    double *q; /* (count x n) */
    double *r; /* (count x point_count x 3) [m] */
};

void track_start(struct track *track, const struct refdyn_model *model, long room);
/* The integration's state is the next output. */
void track_add(struct track *track, const struct refdyn_integrator *integrator);
/* How far the points of output i of one are from those of output j of the other, the largest; of a model
 * without points the coordinates. NaN when any is. */
double track_distance(const struct track *a, long i, const struct track *b, long j);
/* How far the motion gets from its start in the first `count` outputs. */
double track_way(const struct track *track, long count);
void track_release(struct track *track);

/* The largest of some errors, and when. */
struct peak {
    double error, t;
};

struct estimate {
    const struct refdyn_model *model;
    long count;               /* outputs that both runs have */
    const double *t;          /* (count) [s], of the judged one */
    double *distances;        /* (point_count x count) estimated error of each point [m] */
    struct peak *points;      /* (point_count) */
    struct peak *coordinates; /* (n) */
    struct peak largest; /* over all points; over the coordinates of a model without points [m, or the units
                            of the coordinates] */
    double difference;   /* of the two runs, from which it comes */
    bool is_trusted;
};

/* Error of `judged` from its difference to `other`; share: error of `other` over that of `judged`, not 1.
 * Trusted are differences that are small beside the way of the motion. estimate_release in any case. */
void estimate_make(struct estimate *estimate, const struct track *judged, const struct track *other,
                   double share);
void estimate_print(const struct estimate *estimate);
void estimate_put(const struct estimate *estimate, struct document *document);
void estimate_release(struct estimate *estimate);

/*
 * Where a motion left the limits of its joints: the farthest beyond those of position, rate and force, over
 * the outputs. Limits change nothing in the motion.
 */

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

/* The events of a motion, in order, for summaries. Events of contacts are impacts, coming to rest, and
 * leaving. */

enum event_kind { EVENT_PLAIN, EVENT_IMPACT, EVENT_RESTS, EVENT_LEAVES };

struct event_mark {
    int event; /* of the model */
    enum event_kind kind;
    double t; /* of a rest: the end of all rebounds [s] */
};

enum { EVENTS_KEPT = 500 }; /* the first ones; the rest is counted */

struct event_record {
    struct event_mark *list; /* (EVENTS_KEPT) NULL before the first event */
    long count;              /* of all events */
    bool has_ended;          /* by the event `end` */
    struct event_mark end;
    int *modes;        /* (contact_count) of the contacts at the last look, NULL: none yet */
    double t_last;     /* of the last look [s] */
    bool lacks_forces; /* at times the forces of contacts were not unique */
};

/* What a call of refdyn_integrator_step has stopped at; the status of that call, 0 in place of EVENT_ENDS. */
int events_take(struct event_record *record, const struct refdyn_integrator *integrator, int status);
void events_release(struct event_record *record);
/* Lines and members of a summary; none where the model has no events. */
void events_print(const struct event_record *record, const struct refdyn_model *model);
void events_put(const struct event_record *record, const struct refdyn_model *model,
                struct document *document);
/* On stderr: the events at which a motion stands, and the value among those they set that the model refuses.
 */
void events_print_refused(const struct refdyn_integrator *integrator, const char *fact);
/* Where a motion has failed at events: which. */
void events_print_failed(const struct refdyn_integrator *integrator);

/* Motions by methods of GSL, in a program that is built with it; in another one none can be opened. */

struct refdyn_gsl;

/* Is it one of GSL's methods? NULL is none. */
bool by_gsl_has(const char *method);
/* How such a method stays on the programme unless it is told otherwise. */
enum refdyn_stabilise by_gsl_stabilise(const char *method);

/* From now on GSL takes the integration's steps. Returns a status of the runtime; by_gsl_close in any case.
 */
int by_gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method);
/* As refdyn_integrator_step. */
int by_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps);
void by_gsl_close(struct refdyn_gsl *gsl);

/*
 * The columns of a motion, by name, and the motion as CSV: one header line, one line an output. Columns as
 * the README of this folder tells. A name that a column before has gets the kind of its column before it:
 * point_, input_, course_ ...
 */

enum { TABLE_BLOCKS = 10 }; /* of columns that are computed together: the state, points, residuals ... */

struct table {
    struct refdyn_integrator *integrator;
    const struct refdyn_spatial *spatial; /* NULL: no point has angular columns */
    const char **names;                   /* (count) */
    const char **units;                   /* (count) NULL: the model does not say */
    int ends[TABLE_BLOCKS];
    bool is_wanted[TABLE_BLOCKS];
    struct motion_part *parts; /* what belongs together, as a file of HDF5 has it */
    int part_count;
    double *values; /* (count) of the last table_fill */
    int count, filled;
    double *room; /* for points, their columns and the programme force */
};

/* Before the names of accelerations where one of them is taken, and behind them. */
extern const char table_acceleration_lead[], table_acceleration_ending[];

/* spatial: of points whose angular velocities and accelerations have columns; NULL: of none. */
void table_start(struct table *table, struct refdyn_integrator *integrator,
                 const struct refdyn_spatial *spatial);
/* From now on only the blocks with a wanted column are filled: wanted (count). */
void table_want(struct table *table, const bool *wanted);
/* The values of the integrator's state. */
void table_fill(struct table *table);
void table_header(const struct table *table, FILE *out);
/* The first column that is infinite or NaN after table_fill, NULL: none. */
const char *table_not_finite(const struct table *table);
/* The units of the columns, as object "units"; those that the model does not say are not there. */
void table_put_units(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                     struct document *document);
/* A line of the values. */
void table_row(const struct table *table, FILE *out);

/*
 * Conditions that end a motion, NAME<VALUE or NAME>VALUE with NAME a column of the CSV: the time at which the
 * first of them holds.
 *
 * Takes the texts of --stop and an integrator; moves the integrator to that time. What holds between two
 * accepted states, but at neither of them nor at an output between, is not seen.
 */

struct stop {
    const char *text; /* as given */
    int column;
    bool is_below; /* '<' */
    double value;
};

struct stops {
    struct stop *list;
    int count;
    struct table table; /* of the integrator that is watched */
    struct refdyn_integrator *integrator;
    const struct stop *reached; /* NULL: none yet */
    double t;                   /* when it was [s] */
};

/* Complains as usage errors are. */
enum status stops_read(struct stops *stops, const struct options *options,
                       struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial);
/* Does one of them hold at the integration's state? Then it is the one that was reached. */
bool stops_hold(struct stops *stops);
/* None held at t_before, inside the last step or at its begin: when one holds now, moves the integrator back
 * to the first time at which one does. Returns a status of the runtime. */
int stops_meet(struct stops *stops, double t_before);

/*
 * One motion of a scene, from its start to its end, output by output: what `sim` and `report` share.
 */

enum {
    MOTION_INTERRUPTED = 1000 /* beside the runtime's statuses */,
    MOTION_TOO_SLOW,
    MOTION_NOT_WRITTEN,
    STABILISE_COUNT = 3
};

/* By enum refdyn_stabilise. */
extern const char *const stabilise_names[STABILISE_COUNT];

/* What --stabilise, --start and --singular may be; NULL ends each list. */
/* The options of motions. */
extern const struct option_rule motion_rules[];
/* "rk4, rk54, ...": all methods, or those that need no tangent. */
const char *motion_methods(bool is_explicit);
/* Those of `sim` alone, and the command on a model. */
extern const struct option_rule sim_rules[];
enum status run_sim(const struct options *options);

struct motion {
    struct scene *scene;
    struct refdyn_integrator integrator;
    const char *method;
    struct refdyn_gsl *gsl; /* takes the steps, NULL: the integration does */
    void *memory;
    struct refdyn_energy energy;
    struct event_record events;
    double *values;            /* p, then x of the scene at the start, where events change them; NULL */
    struct stops *stops;       /* conditions that end it, the caller's; NULL, as after motion_start: none */
    double from, until, every; /* [s] */
    long outputs;              /* the first one is the start */
    double cpu_s, wall_s;      /* of integration alone; since the start */
    double cpu_limit;          /* MOTION_TOO_SLOW beyond; 0, as at the start: none [s] */
    double started;
};

/* Runtime options from --method --step --tol --step-max --stabilise --singular --start; complains when they
 * do not go together. */
enum status motion_options(const struct options *options, struct refdyn_options *integration);
/* A model in the printed form has no tangent: complains when the method that was asked for needs it. */
enum status motion_fit(const struct scene *scene, const struct options *options,
                       const struct refdyn_options *integration);
/* Between outputs [s]: `every`, or where it is 0 a 200th of the motion's length `span`. */
double motion_distance(double span, double every);
/* Outputs at the multiples of `every` before the end, and at the end; the first is the start. */
long motion_count_outputs(double span, double every);
/* What a scene needs for a motion from where --from tells. */
unsigned motion_needs(const struct options *options);
/* Sets the scene's q, qd and t to the start of the motion that --from tells, and the anchored parameters from
 * it. */
enum status motion_place(struct scene *scene, const struct options *options);
/* Complains when the motion from the scene's t to --until has no length, or too many outputs. */
enum status motion_check_times(const struct scene *scene, const struct options *options);
/* Starts at the scene's state. Returns a status of the runtime; motion_release in any case, which restores.
 */
int motion_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                 double until, double every);
/* After motion_start: the steps by a method of GSL. Returns a status of the runtime. */
int motion_by_gsl(struct motion *motion, const char *method);
/* How much of the way from the start to the end is done. */
double motion_fraction(const struct motion *motion);
/* Goes on to output i, or to where one of the stops is reached or an event ends it; progress may be NULL.
 * Returns a status of the runtime, MOTION_INTERRUPTED or MOTION_TOO_SLOW. */
int motion_to(struct motion *motion, long i, struct progress *progress);
bool motion_is_stopped(const struct motion *motion);
/* The scene's parameters and inputs are those of the start again, whatever events have set. */
void motion_restore(const struct motion *motion);
void motion_release(struct motion *motion);

/*
 * Where the rows of a motion go: a CSV, a file of HDF5, or a temporary file of numbers, whose rows go on into
 * one of the others when the motion is the one that was looked for.
 */

struct motion_writer;
struct row_sink;
struct task;

/* What a form does with a motion. False: it cannot be written, which the form or the end of its file tells.
 */
struct row_form {
    bool (*begin)(struct row_sink *sink, const struct table *table);
    bool (*put)(struct row_sink *sink, const struct table *table);
    bool (*end)(struct row_sink *sink);
};

struct row_sink {
    const struct row_form *form;
    FILE *file;              /* of CSV and numbers */
    const char *path;        /* of HDF5 */
    const struct task *task; /* what a file of HDF5 tells of the motion */
    struct motion_writer *writer;
    bool is_lost; /* what was written until it failed cannot be read */
};

struct row_sink row_sink_csv(FILE *file);
struct row_sink row_sink_numbers(FILE *file);
/* In motion_hdf5.c. */
struct row_sink row_sink_hdf5(const char *path, const struct task *task);

/* Before the first row; the table's integrator is at the start of the motion. */
bool row_sink_begin(struct row_sink *sink, const struct table *table);
/* The values of the table. */
bool row_sink_put(struct row_sink *sink, const struct table *table);
/* Behind the last row, whether all could be written or not. */
bool row_sink_end(struct row_sink *sink);
/* All rows of a file of numbers into another sink, from its begin to its end; `table` has their columns. */
bool row_sink_copy(FILE *numbers, struct row_sink *to, struct table *table);

/*
 * One run of a motion for `sim`: its rows, its positions at the outputs.
 */

struct trial {
    struct motion motion;
    struct stops stops;
    struct track track;
    struct limit_record limits; /* of the rows that are written */
    enum status usage;          /* not STATUS_DONE: the stops are wrong, and nothing ran */
    int result;                 /* status of the runtime, or MOTION_INTERRUPTED */
    bool is_started;            /* the start could be evaluated */
    const char *unfit;          /* the column that is infinite or NaN, which ended it; NULL: none */
};

/* What the motion is, whatever its tolerance. */
struct task {
    struct scene *scene;
    const struct options *options;
    double until; /* where it ends unless it is stopped [s] */
    bool has_stops;
    void (*on_start)(const struct task *task, const struct motion *motion); /* may be NULL */
};

/* rows: where they go, which ends here; NULL: nowhere. trial_release in any case. */
void trial_run(struct trial *trial, const struct task *task, const struct refdyn_options *integration,
               struct row_sink *rows);
void trial_release(struct trial *trial);

/*
 * The tolerance of a motion from the error that the whole of it may have.
 *
 * Takes a task and the options of its method; gives the run whose estimated error is small enough, or the
 * best one where rounding is reached before. All runs together cost at most about three times the one that is
 * taken.
 */

/* A run with its rows in a file of its own. */
struct candidate {
    struct trial trial;
    FILE *rows;               /* as row_sink_numbers writes them */
    struct estimate estimate; /* of its error */
    bool has_estimate;
};

struct search {
    struct candidate *taken; /* NULL: nothing ran to its end */
    bool is_reached;
    bool is_exhausted;      /* rounding: runs no longer come nearer to each other as the tolerance falls */
    struct candidate *last; /* the run that failed or was interrupted, when nothing was taken */
    double cpu_total_s;
    long tries; /* steps of all runs */
    double difference_before,
        fall_before;                /* of the last two runs but one and their tolerances; 0: none yet */
    struct candidate candidates[2]; /* the last two runs */
};

/* search_release in any case. */
enum status search_run(struct search *search, const struct task *task,
                       const struct refdyn_options *integration);
void search_release(struct search *search);

/*
 * What `sim` tells of a motion at its end: as text on stderr, as JSON in a file.
 */

struct summary {
    const struct trial *trial;
    const struct estimate *estimate; /* NULL: none */
    double accuracy;                 /* that was asked for, 0: none */
    double cpu_total_s;              /* of all runs that were needed */
};

void summary_print(const struct summary *summary);
/* Into the target, which is finished. Complains when not all could be written, or a number is not finite. */
enum status summary_write(const struct summary *summary, struct target *target);

#endif
