/* Rows: accelerations under them, projection, impulses, independent rows. */
#ifndef REFDYN_CONSTRAINTS_H
#define REFDYN_CONSTRAINTS_H

#include "runtime/core/base/core.h"

#include "refdyn.h"

/* Equations, index partition and projection: what the rest of the core calls beyond refdyn.h. */

/* NOT_FINITE with the fault at the first coordinate or row whose equations are infinite or NaN; OK when there
 * is none. */
int refdyn_fault_not_finite(struct refdyn_workspace *work);

/* u v phi psi k of a state into the workspace. Error: NOT_FINITE. */
int refdyn_row_terms(struct refdyn_workspace *work, double t, const double *q, const double *qd);

/* After refdyn_row_terms: does the partition still serve this state? Chooses another one where it does not,
 * from equations that it then evaluates. Errors: NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_watch(struct refdyn_workspace *work, double t, const double *q, const double *qd);

/* K_d factored and [K_d^-1 K_i, K_d^-1 right] into work->rows, P into work->P; right (m) is multiplied by
 * sign. Chooses and changes the partition. Errors: NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_update(struct refdyn_workspace *work, const double *right, double sign);

/* Rank of the rows in the workspace, those that depend on others by no more than phi misses counted as
 * dependent. The partition stays as it is; uses work->rows. */
int refdyn_rank_of_rows(struct refdyn_workspace *work);

/* The rows in the workspace are others than before: chooses the dependent coordinates anew; the rank may
 * grow. Errors: NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_renew(struct refdyn_workspace *work);
/* From now on the rank does not grow beyond `most`. `partition.rank_most` is written only by
 * index_partition.c and workspace.c. */
void refdyn_partition_bound_rank(struct refdyn_workspace *work, int most);

/* What is off, as one number: the largest residual (m) over the largest coefficient of its row. */
double refdyn_distance(const struct refdyn_workspace *work, const double *residual);
/*
 * With the equations in the workspace: L L^T of the metric of the smallest change into work->reduced: that of
 * M, also where only rows hold what has no mass. Errors: NOT_FINITE, MASS_NOT_POSITIVE.
 */
int refdyn_factor_metric(struct refdyn_workspace *work);
/* After refdyn_factor_metric, in its metric: change (n) := the smallest change with u change = -residual (m)
 * for the rows up to a level. */
void refdyn_smallest_change(struct refdyn_workspace *work, enum refdyn_row_level last, const double *residual,
                            double *change);
/* The length of a change (n) in the same metric. */
double refdyn_metric_length(const struct refdyn_workspace *work, const double *change);
/* z (n) := the change whose length in this metric is the Euclidean length of z. */
void refdyn_metric_unspread(const struct refdyn_workspace *work, double *z);
/* refdyn_project, with the equations of the given state already in the workspace. */
int refdyn_project_evaluated(struct refdyn_workspace *work, double t, double *q, double *qd);
/*
 * The same along given directions, of which count x count products with their rows are regular; with the row
 * terms of the given state in the workspace, at the end those of the new one. Errors: NOT_FINITE,
 * NO_CONVERGENCE, ROWS_INCONSISTENT.
 */
struct refdyn_directions {
    const double *vectors; /* (count x n) */
    const int *rows;       /* (count) that they belong to */
    int count;
};
int refdyn_project_along(struct refdyn_workspace *work, const struct refdyn_directions *along, double t,
                         double *q, double *qd);

/* Jumps of rates by an impulse. */

/* With the rows and the factor of the metric in the workspace: work->basis := the rows of the programme up to
 * level `last`, without those of contacts, made orthonormal in the metric of the mass matrix. Dependent rows
 * drop out. Returns the number of vectors. */
int refdyn_spread_programme(struct refdyn_workspace *work, enum refdyn_row_level last);
/* Removes from x (n) its parts along the first `count` vectors of the basis. Returns the ratio of its length
 * after to its length before. */
double refdyn_leave_rest(const struct refdyn_workspace *work, int count, double *x);

/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse along `gradient` (n)
 * such that gradient . jump = change, while the rows of positions and velocities go on to hold. Errors:
 * NOT_FINITE, MASS_NOT_POSITIVE; EVENT_NOT_MET where the rows let nothing change along the gradient.
 */
int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump);
/*
 * With the equations of a state in the workspace: jump (n) of its rates by an impulse of the rows, so that
 * u jump = change (m). Rows that depend on others get no impulse. Errors: NOT_FINITE, MASS_NOT_POSITIVE.
 */
int refdyn_impulse_of_rows(struct refdyn_workspace *work, const double *change, double *jump);

/* The nearest state on the programme from far away: see nearest_state.c. */

/* Is a correction (n) of positions so long that the rows are not nearly linear along it? */
int refdyn_is_far(const struct refdyn_workspace *work, const double *change);
/*
 * With the row terms of (q, qd) in the workspace and its metric factored: q := a state near the programme, at
 * the least distance that was found. Returns whether one was found; if not, q stays, and u and phi are those
 * of q. The factored metric remains that of the given q.
 */
int refdyn_nearest_state(struct refdyn_workspace *work, double t, double *q, const double *qd);

/*
 * The shortest vector that meets one-sided conditions:
 *     min |x|^2 / 2   subject to   N x >= b,   N (count x n)
 * In the metric of the mass matrix this is an impact of several contacts at once (x: change of rates) and
 * Gauss's principle of least constraint (x: change of accelerations).
 *
 * Takes the normals N and the bounds b of the conditions that take part; returns x and the multipliers p >= 0
 * of x = N^T p. x is unique. Where normals depend on each other, p is not: it is then nonzero for independent
 * normals only. Dual method of Goldfarb and Idnani (Math. Programming 27:1-33, 1983).
 */

struct refdyn_one_sided {
    int n, count;
    int *takes_part;     /* (count) the others are left out */
    double *normals;     /* (count x n) */
    double *bounds;      /* (count) b */
    double *slack;       /* (count) a condition may be violated by this */
    double *x;           /* (n) */
    double *multipliers; /* (count) p; 0 for conditions that do not act */

    /* active conditions, and N of these as an upper triangle times orthonormal rows */
    int *active, active_count;
    double *basis;    /* (count x n) */
    double *triangle; /* (count x count) column by column */
    double *share;    /* (count) */
    double *along;    /* (n) */
};

void refdyn_one_sided_lay_out(struct refdyn_one_sided *problem, int count, int n, struct layout *layout);
/* 0: no x meets all conditions. */
int refdyn_one_sided_solve(struct refdyn_one_sided *problem);
/* The shortest x with N x = b for the conditions that take part, without those that depend on others.
 * Returns how many are independent. */
int refdyn_one_sided_meet(struct refdyn_one_sided *problem);

/*
 * Rates of change of a motion's state.
 *
 * A state is q, qd and the work done, 2 n + 1 values; its rates are qd, qdd and power, and behind them the
 * multipliers lambda (m), at which tangents are taken.
 */

/* How the accelerations of a motion are evaluated. */
struct refdyn_evaluation {
    struct refdyn_workspace *work;
    enum refdyn_stabilise stabilise;
    int balance;        /* power is needed, too */
    int by_partition;   /* by the index partition, whatever was emitted */
    int has_no_inverse; /* M is singular, and what was emitted divides by zero: by the index partition */
};

static inline int refdyn_rates_size(const struct refdyn_model *model) {
    return 2 * model->n + 1 + model->m;
}

/* The rates of a state (2 n + 1) at t. Errors: those of refdyn_accelerate. */
int refdyn_rates(const struct refdyn_evaluation *evaluation, double t, const double *state, double *rates);

#endif
