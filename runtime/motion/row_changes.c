/*
 * Rows that come and go at time events: see row_changes.h.
 *
 * Takes the row terms on both sides of a time event; gives the side on which a state is evaluated, and the
 * begin of the next step. Impulse: M (qd_after - qd_before) = u^T Lambda with psi_after = 0 is the projection
 * of velocities in the metric of M (theory, sect. 8.3).
 */
#include "base/arithmetic.h"

#include "motion/row_changes.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "constraints/constraints.h"
#include "linear/dense.h"
#include "motion/energy_jumps.h"

/* Coefficients that are continuous differ less across an event, as a part of the row's largest. */
static double negligible(void) {
    return sqrt(DBL_EPSILON);
}

/* The largest coefficient of each row into work->wanted, unless it is larger there. */
static void note_sizes(struct refdyn_workspace *work) {
    for (int a = 0; a < work->m; a++)
        work->wanted[a] = fmax(work->wanted[a], refdyn_largest(work->u + a * work->n, work->n, NULL));
}

/* Do the coefficients in the workspace differ from those in work->basis, as parts of the sizes? */
static int have_jumped(const struct refdyn_workspace *work) {
    const int n = work->n;
    for (int a = 0; a < work->m; a++)
        for (int j = 0; j < n; j++)
            if (fabs(work->u[a * n + j] - work->basis[a * n + j]) > negligible() * work->wanted[a])
                return 1;
    return 0;
}

/* Do the coefficients of this state jump from the left side of the event at t to its right side? A row that
 * fades out to nothing is small on both: its size is also that at the begin of the step. */
static int jump(struct refdyn_motion *motion, double t, const double *state) {
    struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    const double right = refdyn_events_right_of(&motion->events, t);
    memset(work->wanted, 0, (size_t)work->m * sizeof *work->wanted);
    if (refdyn_row_terms(work, step->t_begin, step->state, step->state + step->n))
        return 0;
    note_sizes(work);
    if (refdyn_row_terms(work, step->t_limit, state, state + step->n))
        return 0;
    note_sizes(work);
    memcpy(work->basis, work->u, (size_t)(work->m * work->n) * sizeof *work->u);
    if (refdyn_row_terms(work, right, state, state + step->n))
        return 0;
    note_sizes(work);
    return have_jumped(work);
}

void refdyn_rows_look_at_end(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const int is_event = motion->work->m > 0 && step->t_end >= step->t_limit;
    motion->rows_change = is_event && jump(motion, step->t_end, step->state_new);
}

int refdyn_rows_jump_at(struct refdyn_motion *motion, double t) {
    return jump(motion, t, motion->step.state);
}

double refdyn_rows_side_of(const struct refdyn_motion *motion, double t) {
    return motion->rows_change ? refdyn_step_inside(&motion->step, t)
                               : refdyn_events_right_of(&motion->events, t);
}

/* Onto the rows behind the event. */
static int meet_new(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const int n = step->n, row = refdyn_residuals(work).phi_row;
    const double most = fmax(refdyn_programme_moved_most(step), negligible());
    memcpy(step->side, step->state, (size_t)n * sizeof(double));
    const int status = refdyn_project_evaluated(work, step->t_begin, step->state, step->state + n);
    if (status == REFDYN_OK && refdyn_step_largest_change(step, step->state, step->side) <= most)
        return REFDYN_OK;
    work->fault = (struct refdyn_fault){.row = row, .coordinate = -1};
    return status == REFDYN_OK || status == REFDYN_NO_CONVERGENCE ? REFDYN_ROWS_UNMET : status;
}

int refdyn_rows_take_new(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    motion->rows_change = 0;
    refdyn_programme_forget(&motion->programme);
    refdyn_linear_drop_factors(&motion->linear);
    const double energy = refdyn_energy_at_begin(motion);
    int status = refdyn_equations(work, step->t_begin, step->state, step->state + step->n);
    if (!status && motion->options.stabilise == REFDYN_PROJECT) {
        status = meet_new(motion);
        refdyn_energy_has_jumped(motion, energy);
    }
    if (!status)
        status = refdyn_partition_renew(work);
    if (!status)
        status = refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
    return status;
}
