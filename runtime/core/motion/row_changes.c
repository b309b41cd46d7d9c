/*
 * Rows that jump.
 *
 * At time events rows come and go, as x + where(t < 1, 1, 0) y does, or ask for other rates, as x - min(t, 1)
 * does; at kinks in coordinates they turn, as x - abs(y) does; events and callers set inputs and parameters
 * that rows read.
 *
 * In: the row terms on both sides of a jump. Out: the side on which a state is evaluated, and the beginning
 * of the next step. The step before the jump uses only the rows on its left side: its end is brought onto
 * them, and states inside it or at its end have their accelerations. The next step begins after the jump,
 * where rows and dependent coordinates are determined again. Positions must already meet the new rows.
 *
 * Rates jump by an impulse, as in an inelastic impact: M (qd_after - qd_before) = u^T Lambda with psi_after =
 * psi_before, with any stabilisation, the smallest change of velocities in the metric of M (theory,
 * sect. 8.3).
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* A continuous residual differs across an event by less than this part of its terms, in which coordinates and
 * rates count as at least `least_size`. */
static const double rounding = 1e-12, least_size = 1e-3;

void refdyn_rows_lay_out(struct refdyn_residuals_before *before, const struct refdyn_model *model,
                         struct layout *layout) {
    before->phi = layout_doubles(layout, model->m);
    before->psi = layout_doubles(layout, model->m);
    before->state = layout_doubles(layout, model->m > 0 ? 2 * model->n : 0);
}

/* ---- At time events ---- */

/* Continuous coefficients differ across an event by less than this part of the row's largest one. */
static double negligible(void) {
    return sqrt(DBL_EPSILON);
}

/* Raises work->wanted to the largest coefficient of each row. */
static void note_sizes(struct refdyn_workspace *work) {
    for (int a = 0; a < work->m; a++)
        work->wanted[a] = fmax(work->wanted[a], refdyn_largest_coefficient(work, a));
}

/* Do the coefficients in the workspace differ from work->basis by more than a negligible part of the sizes?
 */
static int have_jumped(const struct refdyn_workspace *work) {
    const int n = work->n;
    for (int a = 0; a < work->m; a++)
        for (int j = 0; j < n; j++)
            if (fabs(work->u[a * n + j] - work->basis[a * n + j]) > negligible() * work->wanted[a])
                return 1;
    return 0;
}

/* Does a residual differ from its value before by more than rounding? x (n): the factors in its terms. */
static int differs(const struct refdyn_workspace *work, int a, double now, double before, const double *x) {
    return !(fabs(now - before) <= refdyn_allowed_residual(work, a, rounding, least_size, x));
}

/* Do the residuals of the first `count` rows in the workspace differ from those that were noted? */
static int residuals_differ(const struct refdyn_motion *motion, int count, const double *state) {
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_residuals_before *before = &motion->before;
    for (int a = 0; a < count; a++)
        if (differs(work, a, work->phi[a], before->phi[a], state) ||
            differs(work, a, work->psi[a], before->psi[a], state + work->n))
            return 1;
    return 0;
}

/* Returns whether the coefficients of this state jump across the event at t. A row that fades out is small on
 * both sides, so its size at the beginning of the step counts, too. */
static int jump(struct refdyn_motion *motion, double t, const double *state) {
    struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    const double right = refdyn_time_events_right_of(&motion->time_events, t);
    memset(work->wanted, 0, (size_t)work->m * sizeof *work->wanted);
    if (refdyn_row_terms(work, step->t_begin, step->state, step->state + step->n))
        return 0;
    note_sizes(work);
    if (refdyn_row_terms(work, step->t_limit, state, state + step->n))
        return 0;
    note_sizes(work);
    refdyn_rows_note(motion, state);
    memcpy(work->basis, work->u, (size_t)(work->m * work->n) * sizeof *work->u);
    if (refdyn_row_terms(work, right, state, state + step->n))
        return 0;
    note_sizes(work);
    return have_jumped(work);
}

void refdyn_rows_change_at_end(struct refdyn_motion *motion, int change) {
    motion->rows_change = change;
}

void refdyn_rows_look_at_end(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const int is_event = motion->work->m > 0 && step->t_end >= step->t_limit;
    motion->rows_change = is_event && (jump(motion, step->t_end, step->state_new) ||
                                       residuals_differ(motion, motion->work->m, step->state_new));
}

int refdyn_rows_jump_at(struct refdyn_motion *motion, double t) {
    return jump(motion, t, motion->step.state);
}

/* The bodies on which contacts rest may have begun to move suddenly: contacts close or let go. */
static int take_contacts(struct refdyn_motion *motion) {
    const double energy = refdyn_energy_at_begin(motion);
    int has_rates = 0;
    const int status = refdyn_contact_transitions_take(motion, &has_rates);
    refdyn_energy_has_jumped(motion, energy);
    return status;
}

int refdyn_rows_take_new(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const int has_contacts = motion->state_events.contacts.resting > 0;
    if (!motion->rows_change)
        return REFDYN_OK;
    motion->rows_change = 0;
    refdyn_programme_forget(&motion->programme);
    refdyn_linear_drop_factors(&motion->linear);
    if (has_contacts) /* impulses of the programme do not hold them */
        refdyn_contact_transitions_release(motion);
    int status = refdyn_row_terms(work, step->t_limit, step->state, step->state + step->n);
    refdyn_rows_note(motion, step->state);
    if (!status)
        status = refdyn_rows_meet(motion);
    if (!status && has_contacts)
        status = take_contacts(motion);
    if (!status)
        status = refdyn_partition_renew(work);
    if (!status)
        status = refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
    return status;
}

/* ---- At any jump ---- */

void refdyn_rows_note(struct refdyn_motion *motion, const double *state) {
    const struct refdyn_workspace *work = motion->work;
    struct refdyn_residuals_before *before = &motion->before;
    before->are_seen = 0;
    if (work->m == 0)
        return;
    memcpy(before->phi, work->phi, (size_t)work->m * sizeof(double));
    memcpy(before->psi, work->psi, (size_t)work->m * sizeof(double));
    memcpy(before->state, state, (size_t)(2 * work->n) * sizeof(double));
}

void refdyn_rows_note_seen(struct refdyn_motion *motion, const double *state) {
    refdyn_rows_note(motion, state);
    motion->before.are_seen = motion->work->m > 0;
}

void refdyn_rows_forget_seen(struct refdyn_motion *motion) {
    motion->before.are_seen = 0;
}

/* work->wanted := the change that restores each residual to its value before. Returns the row with the
 * largest change. */
static int find_wanted(struct refdyn_workspace *work, const double *before, const double *now) {
    for (int a = 0; a < work->m; a++)
        work->wanted[a] = before[a] - now[a];
    int row = 0;
    refdyn_largest(work->wanted, work->m, &row);
    return row;
}

/* The row of a failure. */
static int blame(struct refdyn_workspace *work, int row, int status) {
    work->fault = (struct refdyn_fault){.row = row, .coordinate = -1};
    return status;
}

/* Do the positions of the state meet the rows? Baumgarte's gains pull in those that do not. */
static int meet_positions(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const double most = fmax(refdyn_programme_moved_most(step), negligible());
    const int row = find_wanted(work, motion->before.phi, work->phi);
    const int status = refdyn_impulse_of_rows(work, work->wanted, step->stage);
    if (status || motion->options.stabilise == REFDYN_BAUMGARTE ||
        refdyn_step_largest_change(step, step->stage, NULL) <= most)
        return status;
    return blame(work, row, REFDYN_ROWS_UNMET);
}

/* Rates jump; rows that depend on others must agree with the new rates. */
static int meet_rates(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const int n = step->n;
    double *qd = step->state + n;
    blame(work, find_wanted(work, motion->before.psi, work->psi), REFDYN_OK);
    int status = refdyn_impulse_of_rows(work, work->wanted, step->stage);
    dense_add(qd, 1, step->stage, n);
    if (!status)
        status = refdyn_row_terms(work, step->t_begin, step->state, qd);
    for (int a = 0; a < work->m && !status; a++) {
        const double size =
            2 * fabs(motion->before.psi[a]) + refdyn_allowed_residual(work, a, negligible(), 1, qd);
        if (!(fabs(work->psi[a] - motion->before.psi[a]) <= size))
            status = blame(work, a, REFDYN_ROWS_INCONSISTENT);
    }
    return status;
}

/* Projects onto the rows after the jump; this removes only the residual that the state had before it. */
static int project(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    const double most = fmax(refdyn_programme_moved_most(step), negligible());
    const int row = refdyn_residuals(work).phi_row;
    memcpy(step->side, step->state, (size_t)step->n * sizeof(double));
    const int status = refdyn_project_evaluated(work, step->t_begin, step->state, step->state + step->n);
    if (status == REFDYN_OK && refdyn_step_largest_change(step, step->state, step->side) <= most)
        return REFDYN_OK;
    return blame(work, row,
                 status == REFDYN_OK || status == REFDYN_NO_CONVERGENCE ? REFDYN_ROWS_UNMET : status);
}

int refdyn_rows_have_jumped(struct refdyn_motion *motion, int *have) {
    const struct refdyn_step *step = &motion->step;
    *have = 0;
    if (motion->work->m == 0)
        return REFDYN_OK;
    const int status = refdyn_row_terms(motion->work, step->t_begin, step->state, step->state + step->n);
    *have = !status && residuals_differ(motion, refdyn_programme_rows(motion->work->model), step->state);
    return status;
}

int refdyn_rows_meet(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    const double energy = refdyn_energy_at_begin(motion);
    int status = refdyn_equations(motion->work, step->t_begin, step->state, step->state + step->n);
    if (!status)
        status = meet_positions(motion);
    if (!status)
        status = meet_rates(motion);
    if (!status && motion->options.stabilise == REFDYN_PROJECT)
        status = project(motion);
    refdyn_energy_has_jumped(motion, energy);
    return status;
}

int refdyn_rows_meet_seen(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_residuals_before *before = &motion->before;
    const int is_that =
        before->are_seen && memcmp(before->state, step->state, (size_t)(2 * step->n) * sizeof(double)) == 0;
    int have = 0, status = REFDYN_OK;
    if (is_that)
        status = refdyn_rows_have_jumped(motion, &have);
    return status || !have ? status : refdyn_rows_meet(motion);
}
