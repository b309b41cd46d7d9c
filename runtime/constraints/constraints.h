/* Equations, index partition and projection: what the rest of the core calls beyond refdyn.h. */
#ifndef REFDYN_CONSTRAINTS_H
#define REFDYN_CONSTRAINTS_H

#include "refdyn.h"

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

#endif
