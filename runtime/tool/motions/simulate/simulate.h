/* Simulation: one motion of a scene, from its options to its file and its summary. Parts: error of a motion;
 * columns; motion; rows; trial; accuracy; summary. */
#ifndef REFDYN_TOOL_SIMULATE_H
#define REFDYN_TOOL_SIMULATE_H

#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"
#include "refdyn.h"
#include "runtime/record/record.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/system/system.h"

/* Error of a whole motion, from two runs of it at different tolerances or steps. */

/* Positions at the outputs of one run, and all columns if their errors are estimated. */
struct track {
    const struct refdyn_model *model;
    double tol; /* tolerance of the run; 0 with fixed steps */
    long count;
    double *t;                        /* (count) [s] */
    double *q;                        /* (count x n) */
    double *r;                        /* (count x point_count x 3) [m] */
    const struct record_table *table; /* whose columns are kept; NULL: none */
    double *values;                   /* (count x columns) */
};

void simulate_track_start(struct track *track, const struct refdyn_model *model, long room);
/* Keeps the columns of the table, which is filled before each output is added. */
void simulate_track_keep(struct track *track, const struct record_table *table, long room);
/* Adds the integrator's state as the next output. */
void simulate_track_add(struct track *track, const struct refdyn_integrator *integrator);
/* The largest distance between the points of output i of one run and output j of the other; without points,
 * between their coordinates. NaN if any of them is. */
double simulate_track_distance(const struct track *a, long i, const struct track *b, long j);
/* The largest distance from the start in the first `count` outputs. */
double simulate_track_way(const struct track *track, long count);
void simulate_track_release(struct track *track);
/* The tolerance applies to 1 rad and to the model's length: the smaller one [rad, m]. */
double simulate_smallest_unit(const struct refdyn_model *model);

struct motion;

/* The largest of some errors, and when. */
struct peak {
    double error, t;
};

/* The estimated error of a rate, acceleration or force. */
struct column_error {
    enum record_kind kind; /* OTHER: no error is estimated */
    struct peak peak;
    double scale; /* largest value in the same unit of this kind */
};

struct estimate {
    const struct refdyn_model *model;
    long count;               /* outputs that both runs share */
    const double *t;          /* (count) times of the judged run [s] */
    double *distances;        /* (point_count x count) estimated error of each point [m] */
    struct peak *points;      /* (point_count) */
    struct peak *coordinates; /* (n) */
    struct peak largest;      /* over all points [m]; without points, over the coordinates [their units] */
    const struct record_table *table; /* of the columns; NULL: their errors are not estimated */
    struct column_error *columns;     /* (columns) */
    double difference;                /* between the two runs, before scaling */
    struct record_difference events;  /* in which the other run differs */
    bool is_trusted;
};

/* Estimates the error of `judged` from its difference to `other`; share: error of `other` divided by that of
 * `judged`, not 1. An estimate is trusted if the difference is small compared with the way of the motion.
 * Call simulate_estimate_release in any case. */
void simulate_estimate_make(struct estimate *estimate, const struct track *judged, const struct track *other,
                            double share);
/* Compares the events and contacts of both runs as well; the estimate is not trusted if they differ. */
void simulate_estimate_events(struct estimate *estimate, const struct track *judged,
                              const struct motion *motion, const struct motion *other);
void simulate_estimate_print(const struct estimate *estimate);
void simulate_estimate_put(const struct estimate *estimate, struct document *document);
void simulate_estimate_release(struct estimate *estimate);

/* Returns whether it is one of GSL's methods; false for NULL. */
bool simulate_gsl_has(const char *method);

/* Columns of a motion (record.h), and the motion as CSV: a header line, then a line an output. */

/* record_table_start with memory of the program. */
void simulate_table_start(struct record_table *table, struct refdyn_integrator *integrator,
                          const struct refdyn_spatial *spatial);
/* record_limits_start with the limits of the model. */
void simulate_limits_start(struct record_limits *limits, struct record_memory memory,
                           const struct scene *scene, struct refdyn_integrator *integrator);
void simulate_table_header(const struct record_table *table, FILE *out);
/* Writes the values as a line. */
void simulate_table_row(const struct record_table *table, FILE *out);

/* Reads --stop; reports errors as wrong usage. */
enum status simulate_stops_read(struct record_stops *stops, const struct options *options,
                                struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial);

/* Motion of a scene from start to end, output by output, for `sim` and `report`. */

/* The options of motions. */
extern const struct option_rule simulate_rules[];
/* "rk4, rk54, ...": all methods, or those that need no tangent. */
const char *simulate_methods(bool is_explicit);
/* Those of `sim` alone, and the command on a model. */
extern const struct option_rule simulate_sim_rules[];
enum status simulate_run(const struct options *options);

struct motion {
    struct scene *scene;
    struct refdyn_integrator integrator;
    struct record_motion record;
    struct memory arena; /* of the record */
    const char *method;
    struct refdyn_gsl *gsl; /* takes the steps; NULL if the integrator does */
    void *memory;
    double cpu_s, wall_s; /* CPU time of integration alone; wall time since the start */
    double cpu_limit; /* simulate_to returns RECORD_TOO_SLOW beyond it; 0, the default, for no limit [s] */
    double started, began;     /* wall time; CPU time at which simulate_to began [s] */
    struct progress *progress; /* shown while simulate_to runs; may be NULL */
};

/* Runtime options from --method --step --tol --step-max --stabilise --singular --start; reports combinations
 * that exclude each other. */
enum status simulate_options(const struct options *options, struct refdyn_options *integration);
/* Reports a --tol-rates that fixed steps cannot keep, or that is not below 1. */
enum status simulate_check_tol_rates(const struct options *options, bool is_fixed);
/* Reports a --lanes that is no lane width. */
enum status simulate_check_lanes(const struct options *options);
/* A command that searches among motions of a scene, which it computes in lanes: checks the options, opens the
 * scene, lets `work` search, and closes it. */
enum status simulate_run_search(struct options *options,
                                enum status (*work)(struct scene *scene, const struct options *options,
                                                    const struct refdyn_options *integration, void *context),
                                void *context);
/* Reports an error if the chosen method needs the exact tangent, which a model in the printed form lacks. */
enum status simulate_fit(const struct scene *scene, const struct options *options,
                         const struct refdyn_options *integration);
/* What a scene needs for a motion with the start of --from. */
unsigned simulate_needs(const struct options *options);
/* Sets the scene's q, qd and t to the start that --from selects, and computes the anchored parameters from
 * it. */
enum status simulate_place(struct scene *scene, const struct options *options);
/* Reports an error if the number of this option requires more than `most` outputs, steps or other things:
 * `count` of them; `what` is their name in the plural. */
enum status simulate_check_count(const struct options *options, const char *name, double count,
                                 const char *what, double most);
/* Reports an error if --step or --step-max divides a motion of this length [s] into too many steps. */
enum status simulate_check_steps(const struct options *options, double span);
/* Reports an error if the motion from the scene's t to --until has no length, too many steps, or more than
 * `most` outputs. */
enum status simulate_check_times(const struct scene *scene, const struct options *options, double most);
/* Starts at the scene's state. Returns a status of the runtime; call simulate_release in any case, which also
 * restores the parameters and inputs of the scene. */
int simulate_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                   double until, double every);
/* Memory that lasts as long as the motion; NULL: as the program. */
struct record_memory simulate_memory(struct motion *motion);
/* Lets a method of GSL take the steps. Call it after simulate_start. Returns a status of the runtime. */
int simulate_by_gsl(struct motion *motion, const char *method);
/* The completed fraction of the motion, 0 to 1. */
double simulate_fraction(const struct motion *motion);
/* Continues to t, and stops and returns as simulate_to. */
int simulate_advance(struct motion *motion, double t, struct progress *progress);
/* Continues to output i, or until a stop holds or an event ends the motion; progress may be NULL. Returns a
 * status of the runtime, RECORD_INTERRUPTED or RECORD_TOO_SLOW. */
int simulate_to(struct motion *motion, long i, struct progress *progress);
void simulate_release(struct motion *motion);

/* Rows: written as CSV, as HDF5, or as numbers in a temporary file, which are copied to one of the other
 * forms once their motion has been chosen. */

struct row_sink {
    const struct row_form *form; /* the functions of one of the forms */
    FILE *file;                  /* for CSV and numbers */
    const char *path;            /* for HDF5 */
    const struct task *task;     /* described in the HDF5 file */
    struct motion_writer *writer;
    bool is_lost; /* writing failed, and what was written cannot be read */
};

struct row_sink simulate_row_sink_csv(FILE *file);
struct row_sink simulate_row_sink_hdf5(const char *path, const struct task *task);

/* Rows as numbers, from which they are copied later. */
struct row_sink simulate_row_sink_numbers(FILE *file);
/* Begin, add a row and end; false if writing has failed. */
bool simulate_row_sink_begin(struct row_sink *sink, const struct record_table *table);
bool simulate_row_sink_put(struct row_sink *sink, const struct record_table *table);
bool simulate_row_sink_end(struct row_sink *sink);
/* Copies all rows of a file of numbers into another sink, including its beginning and end; `table` has their
 * columns.
 */
bool simulate_row_sink_copy(FILE *numbers, struct row_sink *to, struct record_table *table);

/* Trial: one run of a motion for `sim`, with its rows and its positions at the outputs. */

struct trial {
    struct motion motion;
    struct record_stops stops;
    struct record_table table;
    struct track track;
    struct record_limits limits; /* of the run whose rows are written */
    enum status usage;           /* STATUS_DONE unless --stop was wrong and nothing ran */
    int result;                  /* status of the runtime, or RECORD_INTERRUPTED */
    bool is_started;             /* the start could be evaluated */
    const char *unfit;           /* the infinite or NaN column that ended it, or NULL */
};

/* A motion regardless of its tolerance. */
struct task {
    struct scene *scene;
    const struct options *options;
    double until; /* end of the motion unless a stop ends it [s] */
    bool has_stops;
    bool has_estimate; /* the errors of all columns will be estimated: keeps these columns */
    void (*on_start)(const struct task *task, const struct motion *motion); /* may be NULL */
};

/* Runs the motion and completes `rows`, which may be NULL. Call simulate_trial_release in any case. */
void simulate_trial_run(struct trial *trial, const struct task *task,
                        const struct refdyn_options *integration, struct row_sink *rows);
void simulate_trial_release(struct trial *trial);

/* Accuracy: finds the tolerance at which the whole motion has at most a given error. The result is the run
 * whose estimated error is small enough, or the best run if rounding is reached before. */

/* A run with its rows in a separate file. */
struct candidate {
    struct trial trial;
    FILE *rows;               /* as numbers */
    struct estimate estimate; /* estimated error of the run */
    bool has_estimate;
};

enum { SEARCH_CANDIDATES = 3 };

struct search {
    struct candidate *taken; /* the chosen run; NULL if no run reached its end */
    bool is_reached;
    bool is_exhausted;      /* rounding: runs no longer approach each other as the tolerance falls */
    struct candidate *last; /* the last run, which failed or was interrupted if `taken` is NULL */
    double cpu_total_s;
    double difference_before,
        fall_before; /* of the two runs before, and of their tolerances; 0 if there were none */
    struct candidate candidates[SEARCH_CANDIDATES]; /* the last two runs, the chosen one and a looser one */
};

/* Call simulate_search_release in any case. */
enum status simulate_search_run(struct search *search, const struct task *task,
                                const struct refdyn_options *integration);
void simulate_search_release(struct search *search);

/* Derivatives: --derivatives, columns d_COLUMN_by_NAME (motion_derivatives.c). */

struct motion_derivatives {
    const char *option; /* whose names these are, for messages */
    const char **names; /* (count) as given */
    struct refdyn_variable *variables;
    int count;
    int width, rows;                        /* columns of the motion; rows that `values` has */
    double *values;                         /* (count x rows x width) */
    struct refdyn_underivable *underivable; /* (count) */
    long copies;                            /* motions computed in addition to the nominal one */
    double cpu_s, part;                     /* of all [s]; of the copies, in nominal motions */
};

/* Finds the value that a name of --derivatives denotes. Returns the number of its meanings in the model; if
 * it is 1, sets *variable, which may be NULL. */
int simulate_derivatives_find(const struct refdyn_model *model, const char *name,
                              struct refdyn_variable *variable);
/* Finds the values of derivatives->names; reports unknown names. */
enum status simulate_derivatives_name(struct motion_derivatives *derivatives, const struct scene *scene,
                                      const struct options *options);
/* Describes the motion of a scene as a batch, without its times and columns; an equilibrium at its start is
 * found again for each value. Reports values that this equilibrium sets. */
enum status simulate_derivatives_batch(const struct motion_derivatives *derivatives, struct scene *scene,
                                       const struct options *options,
                                       const struct refdyn_options *integration, struct refdyn_batch *batch);
/* Finds the values that --derivatives names; reports unknown names. */
enum status simulate_derivatives_read(struct motion_derivatives *derivatives, const struct scene *scene,
                                      const struct options *options);
/* Computes the derivatives of a motion that has reached its end; reports those that do not exist. Call
 * simulate_derivatives_release in any case. */
enum status simulate_derivatives_run(struct motion_derivatives *derivatives, struct trial *trial,
                                     const struct task *task, const struct refdyn_options *integration);
/* Copies the rows of the motion and its derivatives into a sink, including its beginning and end. */
bool simulate_derivatives_write(const struct motion_derivatives *derivatives, struct trial *trial,
                                FILE *numbers, struct row_sink *to);
void simulate_derivatives_release(struct motion_derivatives *derivatives);
/* Adds `derivatives` to a summary: names, number of further motions, CPU time [s]. */
void simulate_derivatives_put(const struct motion_derivatives *derivatives, struct document *document);

/* Summary of a motion: text on stderr, JSON in a file. */

struct summary {
    const struct trial *trial;
    const struct estimate *estimate;              /* may be NULL */
    const struct motion_derivatives *derivatives; /* may be NULL, or empty */
    double accuracy;                              /* requested by --accuracy, else 0 */
    double cpu_total_s;                           /* of all runs together */
};

void simulate_summary_print(const struct summary *summary);
/* Writes and completes the target; reports an error if it cannot, or if a number is not finite. */
enum status simulate_summary_write(const struct summary *summary, struct target *target);

#endif
