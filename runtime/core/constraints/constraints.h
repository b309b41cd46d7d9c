/*
 * Constraint rows: the equations at a state, accelerations under rows, projection onto the programme,
 * impulses, one-sided conditions and the rates of a motion's state. n: coordinates, m: rows.
 * Except where stated, functions read the equations or the row terms that a function above them has left in
 * the workspace, and return a status of refdyn.h.
 */
#ifndef REFDYN_CONSTRAINTS_H
#define REFDYN_CONSTRAINTS_H

#include "runtime/core/base/core.h"

/* ---- Equations and index partition ---- */

/* Returns NOT_FINITE, with the fault at the first coordinate or row whose equations are infinite or NaN;
 * otherwise OK. */
int refdyn_fault_not_finite(struct refdyn_workspace *work);
/* Writes u, v, phi, psi and k of a state into the workspace. Error: NOT_FINITE. */
int refdyn_row_terms(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/* Returns the residual of row a that counts as 0 at x (n): sum_j tol |u_aj| max(|x_j|, least), but at least
 * the rounding of its terms. */
double refdyn_allowed_residual(const struct refdyn_workspace *work, int a, double tol, double least,
                               const double *x);
/* Returns the largest coefficient of row a as a part of its size, at most 1. Both are weighted by
 * masses, but their ratio can be used in any metric. */
double refdyn_share_of_size(const struct refdyn_workspace *work, int a);
/* Returns the largest coefficient of row a; where all of them are rounding, the largest one without
 * cancellation. */
double refdyn_largest_coefficient(const struct refdyn_workspace *work, int a);
/* Checks after refdyn_row_terms whether the partition is still well conditioned. If not, evaluates the
 * equations and chooses another one. Errors: NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_watch(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/* Factors K_d, writes [K_d^-1 K_i, K_d^-1 sign right] into work->rows and P into work->P; right (m). Chooses
 * another partition where necessary. Errors: NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_update(struct refdyn_workspace *work, const double *right, double sign);
/* work->rows := P K^T = L U with full pivoting, where the columns of K^T are the rows divided by their sizes
 * at the last call of refdyn_row_sizes, in the order work->mark. Returns the number of pivots that are not 0.
 */
int refdyn_eliminate_rows(struct refdyn_workspace *work);
/* Returns the rank of the rows in the workspace. With is_off, a row counts as dependent if its independent
 * part is no larger than phi explains. Keeps the partition; overwrites work->rows. */
int refdyn_rank_of_rows(struct refdyn_workspace *work, int is_off);
/* Chooses the dependent coordinates again, after the set of rows has changed; the rank may grow. Errors:
 * NOT_FINITE, ROWS_INCONSISTENT. */
int refdyn_partition_renew(struct refdyn_workspace *work);
/* From now on the rank does not grow beyond `most`. `partition.rank_most` is written only by
 * index_partition.c; workspace.c begins with the number of rows. */
void refdyn_partition_bound_rank(struct refdyn_workspace *work, int most);

/* ---- Forces of rows that depend on each other (dependent_rows.c) ---- */

struct refdyn_dependence {
    struct refdyn_workspace *work;
    int rank;    /* number of independent rows */
    double blur; /* a sum counts as unique if null vectors change it by at most this part of its largest
                    coefficient */
};
/* Eliminates the rows u, whose force r is `force` (n), with the rank of the partition. Overwrites work->rows,
 * which the functions below read. */
void refdyn_dependence_find(struct refdyn_dependence *dependence, struct refdyn_workspace *work,
                            const double *force);
/* Returns the multiplier of a row, and the force on a coordinate of the rows that drive it; NAN where they
 * are not unique. The multiplier of a row that its author has switched off, or of a free contact, is 0. */
double refdyn_dependence_multiplier(const struct refdyn_dependence *dependence, int row);
double refdyn_dependence_drive(const struct refdyn_dependence *dependence, int coordinate);

/* ---- Projection ---- */

/* Returns the largest ratio of a residual (m) to the largest coefficient of its row. */
double refdyn_distance(const struct refdyn_workspace *work, const double *residual);
/* Factors the metric of the smallest change, L L^T, into work->reduced: M; where only rows hold coordinates
 * without mass, rows are added (smallest_change.c). Errors: NOT_FINITE, MASS_NOT_POSITIVE. */
int refdyn_factor_metric(struct refdyn_workspace *work);
/* After refdyn_factor_metric: change (n) := the smallest change in its metric with u change = -residual (m)
 * for the rows up to a level. */
void refdyn_smallest_change(struct refdyn_workspace *work, enum refdyn_row_level last, const double *residual,
                            double *change);
/* Returns the length of a change (n) in this metric. */
double refdyn_metric_length(const struct refdyn_workspace *work, const double *change);
/* Replaces z (n) by the change L^-T z, whose length in this metric is the Euclidean length of z. */
void refdyn_metric_unspread(const struct refdyn_workspace *work, double *z);
/* Like refdyn_project, for a state whose equations are already in the workspace. */
int refdyn_project_evaluated(struct refdyn_workspace *work, double t, double *q, double *qd);
/* The same for the start of a motion. Further error: ROWS_INCONSISTENT for rows that contradict those on
 * which they nearly depend. */
int refdyn_project_start(struct refdyn_workspace *work, double t, double *q, double *qd);
/* Directions to project along instead. The matrix of their products with their rows must be regular. */
struct refdyn_directions {
    const double *vectors; /* (count x n) */
    const int *rows;       /* (count) rows that the directions belong to */
    int count;
};
/* Needs the row terms of the given state in the workspace and leaves those of the new state there. Errors:
 * NOT_FINITE, NO_CONVERGENCE, ROWS_INCONSISTENT. */
int refdyn_project_along(struct refdyn_workspace *work, const struct refdyn_directions *along, double t,
                         double *q, double *qd);

/* ---- Jumps of rates by an impulse ---- */

/* After refdyn_factor_metric: work->basis := the rows of the programme up to level `last`, without contacts,
 * made orthonormal in the metric of the mass matrix. Returns the number of independent ones. */
int refdyn_spread_programme(struct refdyn_workspace *work, enum refdyn_row_level last);
/* Removes from x (n) its components along the first `count` vectors of the basis. Returns the ratio of its
 * length after to its length before. */
double refdyn_leave_rest(const struct refdyn_workspace *work, int count, double *x);
/* jump (n) := the jump of the rates by an impulse along `gradient` (n) with gradient . jump = change. The
 * rows of positions and velocities remain satisfied. Errors: NOT_FINITE, MASS_NOT_POSITIVE; EVENT_NOT_MET
 * where the rows permit no change along the gradient. */
int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump);
/* jump (n) := the jump of the rates by an impulse of the rows with u jump = change (m). Rows that depend on
 * others get no impulse. Errors: NOT_FINITE, MASS_NOT_POSITIVE. */
int refdyn_impulse_of_rows(struct refdyn_workspace *work, const double *change, double *jump);

/* ---- The nearest state on the programme from far away ---- */

/* Returns whether a correction (n) of positions is too long for the rows to be nearly linear along it. */
int refdyn_is_far(const struct refdyn_workspace *work, const double *change);
/*
 * After refdyn_factor_metric at (q, qd): q := a state near the programme, the one at the smallest distance
 * that the search has reached. Returns whether it has reached one. If not, q stays, and u and phi are those
 * of q. The factored metric remains that of the given q.
 */
int refdyn_nearest_state(struct refdyn_workspace *work, double t, double *q, const double *qd);

/* ---- One-sided conditions: min |x|^2 / 2 subject to N x >= b (one_sided.c) ---- */

struct refdyn_one_sided {
    int n, count;
    int *takes_part;     /* (count) 0: the condition is ignored */
    double *normals;     /* (count x n) N */
    double *bounds;      /* (count) b */
    double *slack;       /* (count) a condition may be violated by this */
    double *x;           /* (n) */
    double *multipliers; /* (count) p >= 0 of x = N^T p; 0 for conditions that do not act */

    /* active conditions, and N of these as an upper triangle (column by column) times orthonormal rows */
    int *active, active_count;
    double *basis, *triangle; /* (count x n), (count x count) */
    double *share, *along;    /* (count), (n) */
};

void refdyn_one_sided_lay_out(struct refdyn_one_sided *problem, int count, int n, struct layout *layout);
/* 0: no x meets all conditions. */
int refdyn_one_sided_solve(struct refdyn_one_sided *problem);
/* The shortest x with N x = b for the conditions that take part, without those that depend on others.
 * Returns how many are independent. */
int refdyn_one_sided_meet(struct refdyn_one_sided *problem);

/* ---- Rates of change of a motion's state: q, qd and the work done (2 n + 1). They are qd, qdd and power,
 * then the multipliers lambda (m) for the tangent of implicit steps ---- */

/* How the accelerations of a motion are evaluated. */
struct refdyn_evaluation {
    struct refdyn_workspace *work;
    enum refdyn_stabilise stabilise;
    int balance; /* power is needed for the energy balance */
    /* by the index partition: even if `constrained` was emitted; because M is singular there */
    int by_partition, has_no_inverse;
};

static inline int refdyn_rates_size(const struct refdyn_model *model) {
    return 2 * model->n + 1 + model->m;
}

/* Computes the rates of a state (2 n + 1) at t. Errors: those of refdyn_accelerate. */
int refdyn_rates(const struct refdyn_evaluation *evaluation, double t, const double *state, double *rates);

#endif
