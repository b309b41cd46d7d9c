/*
 * Consistent states: the distance of a state from the programme, and its projection onto it (theory,
 * sect. 8.3).
 *
 * In: a state. Out: the state after the smallest change, in the metric M, of positions and then of velocities
 * that satisfies the rows: min dq^T M dq with u dq = -phi:   dq = -M^-1 u^T (u M^-1 u^T)^-1 phi, and the same
 * with psi for dqd (Ascher, Chin, Petzold and Reich, Mech. Struct. Mach. 23:135-157, 1995). Near the
 * programme this is Newton's iteration; from far away nearest_state.c finds the positions first.
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

#define LANES 1
#define NAMED(name) name##_of_one
#include "runtime/core/constraints/programme_distance.inc"

/* Position rows determine positions; rows up to velocity level determine velocities. */
struct level {
    enum refdyn_row_level last;
    const double *residual; /* (m) */
};

static struct level of_positions(const struct refdyn_workspace *work) {
    return (struct level){REFDYN_POSITION, work->phi};
}

static struct level of_velocities(const struct refdyn_workspace *work) {
    return (struct level){REFDYN_VELOCITY, work->psi};
}

static int has(const struct refdyn_workspace *work, struct level level, int a) {
    return work->model->rows[a].level <= level.last;
}

/* Largest residual of a level into *size; its row, -1: there is none. */
static int largest_residual(const struct refdyn_workspace *work, struct level level, double *size) {
    int row = -1;
    for (int a = 0; a < work->m; a++)
        if (has(work, level, a) && (row < 0 || fabs(level.residual[a]) > *size)) {
            *size = fabs(level.residual[a]);
            row = a;
        }
    return row;
}

struct refdyn_residual refdyn_residuals(const struct refdyn_workspace *work) {
    struct refdyn_residual largest = {.phi_row = -1, .psi_row = -1};
    if (!refdyn_is_laid_out(work))
        return largest;
    largest.phi_row = largest_residual(work, of_positions(work), &largest.phi);
    largest.psi_row = largest_residual(work, of_velocities(work), &largest.psi);
    return largest;
}

static struct level_of_one rows_of(const struct refdyn_workspace *work, struct level level) {
    return (struct level_of_one){work->n, work->m,     work->model->rows, level.last,
                                 work->u, work->sizes, level.residual};
}

static int rows_hold(const struct refdyn_workspace *work, struct level level, double tol, double least,
                     const double *x) {
    const struct level_of_one rows = rows_of(work, level);
    return rows_hold_of_one(&rows, tol, least, x);
}

int refdyn_is_consistent(struct refdyn_workspace *work, double tol, const double *q, const double *qd) {
    if (!refdyn_is_laid_out(work) || !q || !qd)
        return 0;
    refdyn_row_sizes(work);
    return rows_hold(work, of_positions(work), tol, 1, q) && rows_hold(work, of_velocities(work), tol, 1, qd);
}

/* Returns whether omitted rows contradict the others by no more than inexact lengths do. No change of the
 * coordinates could remove this contradiction. Overwrites work->rows. */
static int contradicts_little(struct refdyn_workspace *work, struct level level, const double *x) {
    const int n = work->n;
    for (int a = 0; a < work->m; a++) {
        double size = 0;
        for (int j = 0; j < n; j++)
            size += work->sizes[a * n + j] * fmax(fabs(x[j]), 1);
        if (has(work, level, a) && !(fabs(level.residual[a]) <= near * size))
            return 0;
    }
    return work->partition.rank >= 0 && work->partition.rank < work->m &&
           refdyn_rank_of_rows(work, 0) <= work->partition.rank;
}

static int is_done(struct refdyn_workspace *work, struct level level, const double *x, double *last) {
    const struct level_of_one rows = rows_of(work, level);
    const double before = *last;
    return level_is_done_of_one(&rows, x, last) || (*last > before / 2 && contradicts_little(work, level, x));
}

/* Returns whether the independent rows are satisfied compared with a residual of this size: then a redundant
 * row has it. */
static int used_rows_hold(const struct refdyn_workspace *work, double size) {
    for (int k = 0; k < work->partition.rank; k++) {
        const int a = work->partition.row[k];
        if (!(fmax(fabs(work->phi[a]), fabs(work->psi[a])) <= near * size))
            return 0;
    }
    return work->partition.rank >= 0;
}

static int not_converged(struct refdyn_workspace *work) {
    const struct refdyn_residual left = refdyn_residuals(work);
    work->fault =
        (struct refdyn_fault){.row = left.phi > left.psi ? left.phi_row : left.psi_row, .coordinate = -1};
    return used_rows_hold(work, fmax(left.phi, left.psi)) ? REFDYN_ROWS_INCONSISTENT : REFDYN_NO_CONVERGENCE;
}

/* x += the combination of the directions with u dx = -residual, for the rows of a level. */
static int correct_rows(struct refdyn_workspace *work, const struct refdyn_directions *along,
                        struct level level, double *x) {
    const int n = work->n;
    int *listed = work->mark, count = 0;
    for (int k = 0; k < along->count; k++)
        if (has(work, level, along->rows[k]))
            listed[count++] = k;
    for (int i = 0; i < count; i++) {
        const int row = along->rows[listed[i]];
        work->wanted[i] = -level.residual[row];
        for (int j = 0; j < count; j++)
            work->basis[i * count + j] = dense_dot(work->u + row * n, along->vectors + listed[j] * n, n);
    }
    if (!refdyn_lu_factor(0, work->basis, count, work->mark + n, work->lambda))
        return not_converged(work);
    refdyn_lu_solve(0, work->basis, count, work->mark + n, work->wanted);
    for (int j = 0; j < count; j++)
        dense_add(x, work->wanted[j], along->vectors + listed[j] * n, n);
    return REFDYN_OK;
}

static int correct_along(struct refdyn_workspace *work, const struct refdyn_directions *along, double t,
                         double *q, double *qd) {
    int status = correct_rows(work, along, of_positions(work), q);
    if (!status)
        status = correct_rows(work, along, of_velocities(work), qd);
    return status ? status : refdyn_row_terms(work, t, q, qd);
}

/* By the smallest change in the metric of the present M. */
static int correct_in_mass(struct refdyn_workspace *work, double t, double *q, double *qd) {
    const int n = work->n, status = refdyn_factor_metric(work);
    if (status)
        return status;
    refdyn_smallest_change(work, REFDYN_POSITION, work->phi, work->change);
    if (refdyn_is_far(work, work->change))
        return refdyn_nearest_state(work, t, q, qd) ? refdyn_equations(work, t, q, qd) : not_converged(work);
    refdyn_smallest_change(work, REFDYN_VELOCITY, work->psi, work->change + n);
    dense_add(q, 1, work->change, n);
    dense_add(qd, 1, work->change + n, n);
    return refdyn_equations(work, t, q, qd);
}

/* Newton's iteration. Velocities are checked after the positions have converged, because positions change
 * them. along NULL: in the metric of M. */
int refdyn_project_along(struct refdyn_workspace *work, const struct refdyn_directions *along, double t,
                         double *q, double *qd) {
    double last_phi = INFINITY, last_psi = INFINITY;
    int positions_are_done = 0;
    for (int iteration = 0; iteration <= CORRECTIONS_MOST; iteration++) {
        if (!positions_are_done)
            positions_are_done = is_done(work, of_positions(work), q, &last_phi);
        if (positions_are_done && is_done(work, of_velocities(work), qd, &last_psi))
            return REFDYN_OK;
        const int status = along ? correct_along(work, along, t, q, qd) : correct_in_mass(work, t, q, qd);
        if (status)
            return status;
    }
    return not_converged(work);
}

int refdyn_project_evaluated(struct refdyn_workspace *work, double t, double *q, double *qd) {
    return refdyn_project_along(work, NULL, t, q, qd);
}

/* No state satisfies rows that look independent by no more than their residuals explain, like those of an
 * overconstrained linkage with inexact lengths. This is also true near a singular position, but a motion
 * reaches one only after its start. */
int refdyn_project_start(struct refdyn_workspace *work, double t, double *q, double *qd) {
    const int status = refdyn_project_evaluated(work, t, q, qd);
    if (status == REFDYN_NO_CONVERGENCE && refdyn_rank_of_rows(work, 1) < refdyn_rank_of_rows(work, 0))
        return REFDYN_ROWS_INCONSISTENT;
    return status;
}

int refdyn_project(struct refdyn_workspace *work, double t, double *q, double *qd,
                   struct refdyn_residual *before) {
    const int status = refdyn_equations(work, t, q, qd);
    if (before)
        *before = refdyn_residuals(work);
    if (status)
        return status;
    refdyn_row_sizes(work);
    return refdyn_project_evaluated(work, t, q, qd);
}
