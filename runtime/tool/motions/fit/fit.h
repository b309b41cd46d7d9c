/*
 * Parameters from measured data: the values theta with the least
 *
 *     chi^2 = sum over all samples of ((y_model(t; theta) - y_data(t)) / sigma)^2,
 *
 * where sigma is the standard deviation of a column's noise. Method: Levenberg and Marquardt (Marquardt, J.
 * SIAM 11:431-441, 1963), with derivatives of the motion by copies that repeat its steps (Bock 1981).
 * The unknown of a positive value is its logarithm. If the start is far, the search begins with the first
 * part of the data and many starts.
 *
 * A sensor shows y_model(t) = gain y(t - delay) + offset, with y a column of the motion.
 *
 * Parts in reading order: what is asked; values; data; residuals; the start; least squares; search; report;
 * the command.
 */
#ifndef REFDYN_TOOL_FIT_H
#define REFDYN_TOOL_FIT_H

#include <stdbool.h>

#include "refdyn_batch.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/scene/scene.h"

/* ---- What is asked (fit_request.c, fit_file.c) ---- */

/* A number, or a value to be found. */
struct fit_range {
    bool is_unknown;
    double number;       /* if it is known */
    bool is_bounded;     /* has the bounds `lower` and `upper` */
    double lower, upper; /* infinite without bounds */
    bool has_start;
    double start;
};

/* Properties of a sensor are the first kinds of values. */
enum fit_kind {
    FIT_OFFSET,
    FIT_GAIN,
    FIT_DELAY,
    FIT_SENSOR_COUNT,
    FIT_OF_MODEL = FIT_SENSOR_COUNT,
    FIT_START
};
extern const char *const fit_sensor_words[FIT_SENSOR_COUNT]; /* "offset", "gain", "delay" */
extern const double fit_sensor_ideal[FIT_SENSOR_COUNT];      /* 0, 1, 0 */

/* Each `place` is the "FILE:LINE" of the entry; NULL on the command line. */
struct fit_request {
    const char *path; /* FIT.lua; NULL if the request is in options and operands */
    const char *place;
    struct fit_asked_value {
        const char *name, *place;
        struct fit_range range;
    } * values, *starts; /* starts: values at the start of each file, found for each file separately */
    int value_count, start_count;
    struct fit_asked_column {
        const char *name, *place;
        double noise;
        struct fit_range sensor[FIT_SENSOR_COUNT];
    } * columns;
    int column_count;
    struct fit_asked_data {
        const char *name; /* as written */
        const char *path;
        double weight; /* factor of its part of chi^2 */
        bool is_held_out;
    } * data;
    int data_count;
    bool needs_data; /* not with --check */
};

struct fit;

/* Reads --vary, --noise, --held-out and the operands. Reports errors. */
enum status fit_request_read(const struct options *options, struct fit_request *request);
/* Reads FIT.lua, whose path is the second operand. Reports errors with FILE:LINE. */
enum status fit_file_read(const struct options *options, struct fit_request *request);

/* ---- Values (fit_values.c) ---- */

/* A value to be found. Its unknown is u with value = exp(u) if `is_log`, otherwise value = unit u. */
struct fit_value {
    const char *name;
    enum fit_kind kind;
    struct refdyn_variable variable; /* of the motion: for FIT_OF_MODEL and FIT_START */
    int column;                      /* of the derivatives of the motion: the same */
    int signal;                      /* of a sensor */
    int data;                        /* file of FIT_START */
    double start;                    /* where the search begins */
    double lower, upper;             /* bounds; infinite if there are none */
    bool is_log;
    double unit;
    bool is_rough; /* its derivatives in the last J are differences of free motions */
};

/* A measured column. */
struct fit_signal {
    const char *name;
    double noise;                    /* standard deviation, in the unit of the column */
    int column;                      /* among the columns of a motion */
    double sensor[FIT_SENSOR_COUNT]; /* its properties where they are known */
    int value[FIT_SENSOR_COUNT];     /* numbers of the values where they are not known; -1: known */
};

/* A file of measurements. */
struct fit_data {
    const char *path, *name; /* name: as the request writes it */
    double weight;           /* factor of its part of chi^2 */
    bool is_held_out;        /* not used for the fit: its residuals validate it */
    int first_start;         /* number of the value that is its first unknown start */
    bool has_inputs;         /* `inputs` has samples of the model's inputs */
    struct inputs inputs;
    int rows;
    double *t; /* (rows) ascending [s] */
    double *y; /* (rows x signals) NaN: a gap */
};

struct fit {
    const struct options *options;
    struct fit_request request;
    struct scene *scene;
    struct refdyn_options integration;
    struct motion motion;        /* whose columns are compared with the data */
    struct record_table table;   /* its columns */
    struct record_table *tables; /* (threads x rooms_of_thread) of motions computed at the same time */
    int rooms_of_thread;
    struct motion_derivatives variables; /* the values as variables of the motion */
    struct refdyn_batch batch;           /* the motion, without times and columns */
    struct fit_value *values;            /* (all_count) those of the model, of sensors, of starts */
    int count;                           /* values that the fit finds */
    int all_count; /* with the starts of held-out files, which are found after the fit */
    struct fit_signal *signals;
    int signal_count;
    int asked; /* the first signals: those of --noise; with --check all other columns follow */
    struct fit_data *data;
    int data_count;
    long motions;   /* computed in all, copies included */
    int end_status; /* of the last motion: a status of the runtime, the time reached [s], its steps */
    double end_t;
    long end_steps;
    int lost; /* residuals without a derivative in the last evaluation of J */
    struct progress progress;
};

/* Finds in the model what the request names. `fit` has its request, scene, motion and table. Reports errors.
 */
enum status fit_values_find(struct fit *fit);
bool fit_is_of_state(const struct refdyn_variable *variable);
double fit_value_of(const struct fit_value *value, double unknown);
double fit_unknown_of(const struct fit_value *value, double number);
/* The properties of a sensor. */
struct fit_sensor {
    double is[FIT_SENSOR_COUNT];
};
struct fit_sensor fit_sensor_of(const struct fit *fit, int signal, const double *unknowns);
/* Whether the search changes the gain or the offset of the signal. */
bool fit_sensor_is_scaled(const struct fit *fit, int signal);
/* "--noise", or "noise" in FIT.lua: where the request says it. */
const char *fit_option_text(const struct fit *fit, const char *name);

/* ---- Data (fit_data.c) ---- */

/* Reads the files of measurements. Reports errors with FILE:LINE. */
enum status fit_data_read(struct fit *fit);
/* Keeps every k-th measurement of each column, so that no column has more than `most`. */
void fit_data_thin(const struct fit *fit, const struct fit_data *data, int most, struct fit_data *thin);

/* Rows of zeros at the times of outputs until --until, for all columns, in place of data. */
enum status fit_data_imagine(struct fit *fit);

/* ---- Residuals (fit_residuals.c) ---- */

enum fit_outcome {
    FIT_DONE,
    FIT_FAILED, /* the motion does not reach the end of the data */
    FIT_STUCK,  /* no step decreases chi^2, but the derivatives predict one that does */
    FIT_STOPPED /* by a signal */
};

/* Rows of a file up to time `until`. */
int fit_rows_until(const struct fit_data *data, double until);
/* Residuals of the files up to `until`: those used for the fit, or those held out. */
int fit_residual_count(const struct fit *fit, bool is_held_out, double until);
/* Residuals r of the motions used for the fit, and, unless J is NULL, their derivatives J (values x apart) by
 * the unknowns. */
enum fit_outcome fit_residuals(struct fit *fit, double until, const double *unknowns, double *r, double *J,
                               size_t apart);
/* Residuals of one file, and their derivatives J (count x rows) by the unknowns from number `first` on. */
enum fit_outcome fit_file_residuals(struct fit *fit, const struct fit_data *data, const double *unknowns,
                                    int first, int count, double *r, double *J);
int fit_file_residual_count(const struct fit *fit, const struct fit_data *data, double until);
/* The motion's values (rows x signals) of a file. */
enum fit_outcome fit_motion_values(struct fit *fit, const struct fit_data *data, const double *unknowns,
                                   double *values);
/* Sets the ranges (2 n + signals) of coordinates, rates and signals in the motion of a file, unless this
 * motion fails. */
void fit_motion_ranges(struct fit *fit, const struct fit_data *data, const double *unknowns, double *ranges);
/* chi^2 of many candidates (candidates x values) up to `until`; INFINITY for a motion that fails. */
enum fit_outcome fit_try_candidates(struct fit *fit, double until, const double *unknowns, int candidates,
                                    double *chi2);

/* Has a signal arrived? */
int fit_is_stopped(void *context);

/* ---- Derivatives by free motions (fit_free_motions.c) ---- */

/* Writes the values of an output of a case, in its room; context: the fit. */
typedef void fit_writer(void *context, const struct refdyn_batch_case *one, double *values);
/* Writes those derivatives (variables x size) of the motion `batch` that copies do not have. In: from where
 * on they are missing, the changes of the variables, and the outputs `at` (size) of the motion. Adds the
 * motions to fit->motions. */
void fit_free_derivatives(struct fit *fit, const struct refdyn_batch *batch, fit_writer *write,
                          const struct refdyn_underivable *underivable, const double *changes,
                          const double *at, double *derivatives, size_t size);

/* ---- The start (fit_start.c) ---- */

/* Chooses the units of values without bounds: of an offset, the range of the data of its column; of a start,
 * its size, or the range of the coordinate or rate in the data or in the motion, whichever is largest. Ranges
 * of the motion grow with the ratio of the data to the motion. */
void fit_start_scale(struct fit *fit);
/* Reports a column whose data look like another unit, or like the data of another column, and times that look
 * like another unit, compared with the motion of the start. */
enum status fit_start_compare(struct fit *fit, const double *from);

/* ---- Least squares (least_squares.c) ---- */

/* A problem of least squares with bounds. */
struct least_squares {
    int count, rows;             /* unknowns, residuals */
    const double *lower, *upper; /* (count) bounds of the unknowns */
    double step_most;            /* largest change of an unknown in one step */
    double decrease_least;       /* ends when the derivatives predict a smaller decrease of chi^2 */
    bool takes_last;             /* also takes this last step if it decreases chi^2 */
    int rounds_most;
    enum fit_outcome (*residuals)(void *context, const double *u, double *r, double *J);
    void *context;
    double *u;   /* (count) in: the start; out: the solution */
    double *r;   /* (rows) at the solution */
    double *J;   /* (count x rows) at the solution */
    double chi2; /* at the solution */
    int rounds;
};

enum fit_outcome least_squares_solve(struct least_squares *problem);

/* ---- Search (fit_search.c) ---- */

struct fit_solution {
    enum fit_outcome outcome;
    double *u; /* (values) unknowns */
    double *r; /* (rows) */
    double *J; /* (values x rows) */
    int rows;
    double chi2;
    int starts; /* starts that the search tried */
};

/* Finds the values; `from` (values) are the unknowns of the start. */
void fit_search(struct fit *fit, const double *from, struct fit_solution *solution);
/* Residuals r of the held-out files, after a search for their unknown starts. `u` (all_count). */
enum fit_outcome fit_validate(struct fit *fit, double *u, double *r);

/* ---- Report (fit_report.c) ---- */

/* How well the data determine the values, from the derivatives J of the residuals. */
struct fit_certainty {
    int count;
    double *covariance;   /* (count x count) of the values */
    double *singular;     /* (count) of J by the unknowns, descending */
    double *relative;     /* (count) of J with columns of length 1, descending */
    double *directions;   /* (count x count) rows: unknowns of each of `relative` */
    const char ***groups; /* lists of names that the data do not determine, each ended by NULL; NULL at the
                             end */
    int group_count;
    bool is_dependent; /* columns of J depend on each other, as far as rounding shows */
};

void fit_certainty_find(const struct fit *fit, const struct fit_solution *solution,
                        struct fit_certainty *certainty);
/* "m_base and m_col": the names of a group. */
const char *fit_group_text(const char *const *names);
/* Puts standard errors, covariance and correlations of the values. */
void fit_put_errors(struct document *document, const struct fit *fit, const struct fit_certainty *certainty);
/* Puts singular values, and what is not identifiable. */
void fit_put_groups(struct document *document, const struct fit_certainty *certainty);
/* Reports why the last motion failed, or that a signal ended the search; returns STATUS_NUMBERS. */
enum status fit_report_outcome(const struct fit *fit, enum fit_outcome outcome);
/* Puts data and model over time (fit_series.c); u (all_count). */
void fit_put_series(struct document *document, struct fit *fit, const double *u);
/* Writes FIT.json. */
enum status fit_report_write(struct fit *fit, const struct fit_solution *solution,
                             const struct fit_certainty *certainty);
void fit_report_print(struct fit *fit, const struct fit_solution *solution,
                      const struct fit_certainty *certainty);

/* ---- Before data exist (fit_check.c) ---- */

/* Adds all further columns to the signals, with noise still to be set. */
void fit_check_add_columns(struct fit *fit);
/* `fit --check`: how well columns would determine the values, and which further column would help most. */
enum status fit_check(struct fit *fit, const double *from);

extern const struct command fit_command;

#endif
