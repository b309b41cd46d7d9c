/*
 * Planning: the parameters of a motion that minimise an objective within limits.
 *
 *     minimise f(x) such that from <= y(t; x) <= to for all limits y, all times and all cases of for_all.
 *
 * A limit over time is two inequalities: its smallest and its largest value, each located within the steps of
 * the motion. Their gradients are derivatives of the motion at the times of these extremes (envelope
 * theorem), by copies that repeat its steps. Times keep their fractions of the motion, whose end may vary.
 * Method: a scan of many starts, then local searches from the best of them by sequential quadratic
 * programming (SLSQP of NLopt: Kraft, DFVLR-FB 88-28, 1988).
 *
 * Parts in reading order: the file; motions; local search; search; report; the command.
 */
#ifndef REFDYN_TOOL_PLAN_H
#define REFDYN_TOOL_PLAN_H

#include <stdbool.h>

#include "gen/read/read.h"
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
    double starts, seed, tol;
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
    double *end_rates;                 /* (count) derivative of the end by each value */
    struct plan_value *values;
    int count;
    struct plan_limit *limits;
    int limit_count;
    int end_value;  /* the value that is the end of the motion; -1: none */
    int end_varied; /* the value of for_all that is the end; -1: none */
    double t_end;   /* the end if neither varies [s] */
    int objective;  /* a value, or a signal */
    double objective_size;

    struct record_table table;   /* columns of a motion */
    struct record_table *tables; /* (threads x rooms_of_thread) of motions computed at the same time */
    int rooms_of_thread;
    int *signals;              /* (signal_count) columns that limits and objective use */
    const char **signal_names; /* (signal_count) */
    int signal_count;

    int case_count;
    double *cases; /* (case_count x varied_count) */

    long motions; /* computed in all, copies included */
    long lost;    /* derivatives that do not exist */
    struct {
        int status; /* of the runtime */
        double t;   /* time reached [s] */
    } failed;       /* of the last motion that failed */
    struct progress progress;
};

/* A value at its time. */
struct plan_extreme {
    double value, t;
};

/* Results of the motions at x. Entries by case: those of case 0, then those of case 1 ... */
struct plan_point {
    double *x;    /* (count) each from 0 to 1 */
    bool is_done; /* all motions reach their ends */
    bool has_gradients;
    struct plan_extreme *extremes;   /* (cases x limits x 2) smallest and largest */
    struct plan_extreme *objectives; /* (cases) with the time of an objective rd.largest */
    double *extreme_by;              /* (cases x limits x 2 x count) by x */
    double *objective_by;            /* (cases x count) by x */
};

void plan_point_start(const struct plan *plan, struct plan_point *point);
void plan_point_copy(const struct plan *plan, const struct plan_point *from, struct plan_point *to);
double plan_value_at(const struct plan *plan, int value, const double *x);
/* Computes a free motion of each case at point->x. */
void plan_point_evaluate(struct plan *plan, struct plan_point *point);
/* Adds the gradients. */
void plan_point_differentiate(struct plan *plan, struct plan_point *point);
/* Inequality i, 0 to 2 x limits x cases - 1: its amount beyond the bound, divided by the limit's size;
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

enum { PLAN_SEARCHES = 5 };

struct plan_result {
    struct plan_point best;
    bool has_best;
    double reached[PLAN_SEARCHES]; /* objective of each local search; NAN: infeasible */
    int searches;
};

void plan_search(struct plan *plan, struct plan_result *result);

/* ---- Report (plan_report.c) ---- */

/* Prints the result and writes PLAN.json. */
enum status plan_report(struct plan *plan, struct plan_result *result);
/* "T = 1.25, r = 0.3" */
const char *plan_values_text(const struct plan *plan, const double *x);

extern const struct command plan_command;

#endif
