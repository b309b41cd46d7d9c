/*
 * Planning: the parameters of a motion that minimise an objective within limits.
 *
 *     minimise f(x) such that from <= y(t; x) <= to for all limits y, all times and all cases of for_all.
 *
 * A limit over time is several inequalities in each stretch between time events of the motion: its values at
 * both ends, and the smallest and the largest value between them, located within the steps. Their gradients
 * are derivatives of the motion at the times of these extremes (envelope theorem), by copies that repeat its
 * steps. Times keep their fractions of the motion, whose end may vary. Method: a scan of many starts, then
 * local searches from the best of them by sequential quadratic programming (SLSQP of NLopt: Kraft, DFVLR-FB
 * 88-28, 1988).
 *
 * Parts in reading order: the file; motions; gradients; values; local search; search; report; the command.
 */
#ifndef REFDYN_TOOL_PLAN_H
#define REFDYN_TOOL_PLAN_H

#include <stdbool.h>

#include "gen/script/script.h"
#include "refdyn_batch.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/scene/scene.h"

/* ---- The file (plan_file.c) ---- */

/* A value to be found. The search uses x = (value - from) / (to - from). */
struct plan_value {
    const char *name;
    struct place place;
    double from, to;
    double start; /* NAN: the file has none */
    struct refdyn_variable variable;
};

/* A value that differs between the cases in which the limits must hold. */
struct plan_varied {
    const char *name;
    struct place place;
    double *list; /* (count) */
    int count;
    struct refdyn_variable variable;
};

struct plan_limit {
    const char *name, *column;
    struct place place;
    double from, to;
    bool is_at_end; /* of the value at the end of the motion alone */
    int signal;     /* of its column among the signals of the plan */
    double size;    /* scale of its values */
};

enum plan_measure { PLAN_PARAMETER, PLAN_AT_END, PLAN_INTEGRAL, PLAN_LARGEST };

struct plan_file {
    struct plain_file plain;
    int told;           /* number of its printed messages */
    struct place place; /* of the plan */
    struct plan_value *values;
    int value_count;
    double t_end;         /* [s] */
    const char *end_name; /* the parameter that is the end of the motion; NULL: t_end */
    struct place end_place;
    enum plan_measure measure;
    const char *objective; /* a parameter, or a column */
    struct place objective_place;
    bool has_limits; /* false: all limits of the model */
    struct plan_limit *limits;
    int limit_count;
    struct plan_varied *varied;
    int varied_count;
    double starts, seed, tol, tol_rates;
    bool is_by_cobyla; /* local searches need no derivatives */
    const char *from, *method, *hold;
};

/* Returns false after errors, which it has printed. Call plan_file_release in any case. */
bool plan_file_read(struct plan_file *file, const char *path);
/* Prints the messages; false if there are errors among them. */
bool plan_file_print(struct plan_file *file);
void plan_file_release(struct plan_file *file);

/* ---- Motions (plan_motion.c) ---- */

struct plan {
    const struct options *options;
    struct scene *scene;
    struct plan_file *file;
    struct refdyn_options integration;
    struct refdyn_batch batch;         /* the motion, without its times and columns */
    struct refdyn_variable *variables; /* (count) of the values */
    struct plan_value *values;
    int count;
    struct plan_limit *limits;
    int limit_count;
    int end_parameter; /* the parameter that is the end of the motion; -1: none */
    int end_course;    /* the course that is the end, at the start; -1: none */
    double t_end;      /* the end if there is neither [s] */
    double *courses;   /* (course_count) scratch */
    int objective;     /* a value, or a signal */
    double objective_size;

    struct record_table table;   /* columns of a motion */
    struct record_table *tables; /* (threads x rooms_of_thread) of motions computed at the same time */
    int rooms_of_thread;
    struct record_integral *integrals; /* (threads x rooms_of_thread) of an objective rd.integral */
    double integral_scale;             /* the integral of its magnitude in the last motion; 0: none yet */
    int *signals;                      /* (signal_count) columns that limits and objective use */
    const char **signal_names;         /* (signal_count) */
    int signal_count;

    int case_count;
    double *cases;      /* (case_count x varied_count) */
    int stretches_most; /* between time events of a motion */
    int part_count;     /* case_count x stretches_most x PLAN_PARTS */

    long motions;          /* computed in all, copies included */
    long lost;             /* derivatives that do not exist */
    bool has_changed_over; /* from SLSQP to COBYLA, in some search */
    struct {
        int status;                   /* of the runtime */
        double t;                     /* time reached [s] */
        char refused[REFUSED_LENGTH]; /* the parameter value that the model refuses, "" if there is none */
    } failed;                         /* of the last motion that failed */
    struct progress progress;
    struct target *reference; /* NULL: none */
    double *resumed;          /* (count) x of an earlier result; NULL: none */
};

/* A value at its time; NAN if there is none. */
struct plan_extreme {
    double value, t;
};

/* Parts of a stretch: a law with many knots may touch a limit along whole stretches, and the largest value
 * alone would change between both ends, where its gradient jumps. */
enum plan_spot { PLAN_BEGIN, PLAN_WITHIN, PLAN_END, PLAN_PARTS };

/* Results of the motions at x. Entries by part: those of case 0, then those of case 1 ... Values of a whole
 * motion belong to its first part. */
struct plan_point {
    double *x;    /* (count) each from 0 to 1 */
    bool is_done; /* all motions reach their ends */
    bool has_gradients;
    struct plan_extreme *extremes;   /* (parts x limits x 2) smallest and largest */
    struct plan_extreme *objectives; /* (parts) with the time of an objective rd.largest */
    double *extreme_by;              /* (parts x limits x 2 x count) by x */
    double *objective_by;            /* (parts x count) by x */
};

/* Times nearer to each other than this part of the motion are the same. */
static const double plan_same_part = 1e-9;

/* Motions of all cases at several points; number: point x cases + case. */
struct motions {
    struct refdyn_batch batch;
    struct refdyn_batch_column *columns;
    double *values; /* (count + varied_count) x motions */
    double *ends;   /* (motions) [s] */
};

struct plan_break {
    double t;
    int number; /* of the model's time event; -1: a sample of inputs */
};

/* Stretches of one motion. */
struct plan_stretches {
    int count;
    double *t;   /* (count + 1) from the start of the motion to its end [s] */
    int *breaks; /* (count) number of the time event at its beginning, from entry 1 on; -1: a fixed time */
};

/* Number of time events and of samples of inputs: a motion has at most one stretch more. */
int plan_break_count(const struct plan *plan);
/* Describes the motions at x (points x count), in scratch memory. Outputs are the caller's. The scene has the
 * values of the last one then. */
void plan_describe(const struct plan *plan, const double *x, int points, struct motions *motions);
/* Sets the parameters and inputs of the scene to those of a motion. */
void plan_set_values(const struct plan *plan, const struct motions *motions, int number);
/* The end of a motion with the values of the scene [s]. */
double plan_end(const struct plan *plan);
/* The latest end that a varied parameter allows; otherwise the end as it is now [s]. */
double plan_longest(const struct plan *plan);
/* Sets the scene to the start of a case's motion. Returns a status of the runtime. */
int plan_place(struct plan *plan, const struct motions *motions, int one);
/* The same, and lists the stretches in scratch memory. */
int plan_place_in_stretches(struct plan *plan, const struct motions *motions, int one,
                            struct plan_stretches *stretches);
/* Notes that a motion did not reach its end. */
void plan_note_failure(struct plan *plan, struct plan_point *point, int status, double t);
/* Writes the signals of a shown state, and after them the integral so far if the objective is one. */
void plan_write_signals(const struct plan *plan, const struct refdyn_batch_case *one, double *values);
/* Begins the integral at the start of a case that lasts for `span` [s]; adds its last step. Returns a status
 * of the runtime. */
int plan_add_step(const struct plan *plan, const struct refdyn_batch_case *one, double span);
/* Number of extremes, which is that of inequalities. */
size_t plan_extreme_count(const struct plan *plan);
/* The number of a part. */
int plan_part(const struct plan *plan, int one, int stretch, enum plan_spot spot);
/* The smallest and the largest value of a limit in a part. */
struct plan_extreme *plan_extremes(const struct plan *plan, const struct plan_point *point, int part,
                                   int limit);

void plan_point_start(const struct plan *plan, struct plan_point *point);
void plan_point_copy(const struct plan *plan, const struct plan_point *from, struct plan_point *to);
double plan_value_at(const struct plan *plan, int value, const double *x);

/* ---- Gradients (plan_gradients.c) ---- */

/* Adds the gradients. */
void plan_point_differentiate(struct plan *plan, struct plan_point *point);

/* ---- Values (plan_values.c) ---- */

/* Computes a free motion of each case at point->x. */
void plan_point_evaluate(struct plan *plan, struct plan_point *point);
/* Inequality i, 0 to 2 x limits x parts - 1: its amount beyond the bound, divided by the limit's size;
 * -INFINITY without a bound. */
double plan_excess(const struct plan *plan, const struct plan_point *point, int i);
/* The inequality with the largest excess, -1 if there are no limits. */
int plan_worst(const struct plan *plan, const struct plan_point *point);
/* The largest objective of all cases. */
double plan_objective(const struct plan *plan, const struct plan_point *point);
/* Whether the value is beyond the limit by more than rounding; for limits of the model by the rule of `sim`.
 */
bool plan_is_beyond(const struct plan_limit *limit, double value);
/* Whether no limit is exceeded. */
bool plan_is_feasible(const struct plan *plan, const struct plan_point *point);
/* Objectives and largest excesses of many x (points x count) from outputs alone; INFINITY for a motion that
 * fails. */
void plan_scan(struct plan *plan, const double *x, int points, double *objectives, double *excesses);

/* ---- Local search (plan_local.c) ---- */

/* Returns whether the program has NLopt. */
bool plan_has_optimiser(void);
/* Improves the point, first until no limit is exceeded. */
void plan_improve(struct plan *plan, struct plan_point *point);
/* The multiplier of each inequality at a point with gradients: the objective changes by minus this for each
 * unit by which the limit is relaxed. */
void plan_multipliers(const struct plan *plan, const struct plan_point *point, double *multipliers);

/* ---- Search (plan_search.c) ---- */

enum {
    PLAN_SEARCHES = 5,      /* local searches */
    PLAN_SEARCHES_MOST = 10 /* while no search has ended within the limits */
};

struct plan_result {
    struct plan_point best;
    bool has_best;
    double reached[PLAN_SEARCHES_MOST]; /* objective of each local search; NAN: infeasible */
    int searches;
};

void plan_search(struct plan *plan, struct plan_result *result);

/* ---- The motion of a plan, and an earlier plan (plan_results.c) ---- */

/* Opens the file of --reference, if there is one. */
enum status plan_reference_open(struct plan *plan);
/* Writes the motion of the plan to it. */
enum status plan_write_reference(struct plan *plan, const struct plan_point *point);
/* Writes the columns of the limits over the motion as `motion`. */
void plan_put_motion(struct plan *plan, const struct plan_point *point, struct document *document);
/* Reads the values of the earlier result at -o, from which the search then begins. */
enum status plan_resume(struct plan *plan);

/* ---- Report (plan_report.c) ---- */

/* Prints the result and writes PLAN.json. */
enum status plan_report(struct plan *plan, struct plan_result *result);
/* "T = 1.25, r = 0.3"; of many values the first ones. */
const char *plan_values_text(const struct plan *plan, const double *x);

extern const struct command plan_command;

#endif
