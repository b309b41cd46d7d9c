/*
 * The parts of a step that ordinary and special steps share: an attempt, its end on the programme, its
 * record.
 *
 * In: the state at t_begin, and the end that was planned. Out: the state and the rates at t_end, or a
 * failure; counters of the motion. accepted_step.c takes ordinary steps, singular_crossing.c and
 * fading_rows.c special ones.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"

void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t) {
    motion->failure = (struct refdyn_failure){cause, t};
}

/* ---- Special steps ---- */

static void follow_with(struct refdyn_motion *motion, enum refdyn_method method,
                        const struct refdyn_stage_guide *guide) {
    refdyn_method_use(method, &motion->step);
    refdyn_step_guide(&motion->step, guide);
    refdyn_programme_forget(&motion->programme);
}

void refdyn_special_step_begin(struct refdyn_motion *motion, enum refdyn_method method,
                               const struct refdyn_stage_guide *guide) {
    motion->ordinary = motion->step.number;
    follow_with(motion, method, guide);
}

void refdyn_special_step_end(struct refdyn_motion *motion) {
    if (motion->step.guide)
        follow_with(motion, motion->ordinary, NULL);
}

/* ---- Fading rows at the end of a step ---- */

int refdyn_fading_is_on(const struct refdyn_motion *motion) {
    return motion->step.guide == &motion->fading.guide;
}

static int has_lost_rows(const struct refdyn_motion *motion) {
    const struct refdyn_fading *fading = &motion->fading;
    return fading->is_known && motion->step.t_begin < fading->t &&
           motion->work->partition.rank < fading->rank;
}

int refdyn_fading_refuse(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_workspace *work = motion->work;
    refdyn_rows_change_at_end(motion, 0);
    if (refdyn_fading_is_on(motion))
        refdyn_special_step_end(motion);
    if (refdyn_equations(work, step->t_begin, step->state, step->state + step->n) ||
        refdyn_partition_renew(work))
        return 0;
    work->fault = (struct refdyn_fault){.row = work->partition.row[work->m - 1], .coordinate = -1};
    return work->partition.rank >= motion->fading.rank;
}

/* ---- The end of a step ---- */

/* The projection has moved the state far: the fault is at a row, and at a coordinate or -1. */
static int is_far_off(struct refdyn_motion *motion, int row, int coordinate) {
    motion->tried.verdict = REFDYN_TRIED_BRANCH;
    motion->work->fault = (struct refdyn_fault){.row = row, .coordinate = coordinate};
    return REFDYN_NO_CONVERGENCE;
}

/* Judges a projection from `before`: near a singular position the nearest state on the programme may be on
 * another branch, so a long way refuses the step. */
static int judge_projection(struct refdyn_motion *motion, const double *before, int row) {
    const struct refdyn_step *step = &motion->step;
    const int is_adaptive = motion->options.tol > 0;
    const double most = is_adaptive ? refdyn_programme_moved_most(step) : INFINITY;
    const double longest = fmax(step->t_end - step->t_begin, motion->statistics.step_largest);
    for (int j = 0; j < step->n; j++)
        if (!(fabs(step->state_new[j] - before[j]) <= most * step->units[j]))
            return is_far_off(motion, row, j);
    if (is_adaptive && refdyn_programme_moves_velocities(step, before, step->state_new, longest))
        return is_far_off(motion, row, -1);
    return REFDYN_OK;
}

/* Brings the new state onto the programme; the state before is in step->side afterwards. */
static int meet_programme_nearby(struct refdyn_motion *motion, double t_new) {
    struct refdyn_step *step = &motion->step;
    const struct refdyn_stage_guide *guide = step->guide;
    const int row = refdyn_residuals(motion->work).phi_row;
    memcpy(step->side, step->state_new, (size_t)(2 * step->n) * sizeof(double));
    const int status = refdyn_programme_meet(&motion->programme, step, t_new, step->state_new);
    if (status)
        return status;
    if (guide && guide->follow)
        return guide->follow(guide->context, step->side, step->state_new);
    return judge_projection(motion, step->side, row);
}

/* Row terms, and projection if the options ask for it. *is_known: rates_new are those of the state. */
static int meet_end(struct refdyn_motion *motion, double t, int *is_known) {
    struct refdyn_step *step = &motion->step;
    const int is_guided = step->guide && step->guide->follow;
    const int is_projected =
        motion->work->m > 0 && (motion->options.stabilise == REFDYN_PROJECT || is_guided);
    *is_known = step->is_met || (step->has_rates_new && step->t_end < step->t_limit);
    if (step->is_met)
        return is_projected ? judge_projection(motion, step->side, step->met_row) : REFDYN_OK;
    int status = refdyn_row_terms(motion->work, t, step->state_new, step->state_new + step->n);
    if (status || !is_projected)
        return status;
    status = meet_programme_nearby(motion, t);
    *is_known =
        *is_known && memcmp(step->side, step->state_new, (size_t)(2 * step->n) * sizeof *step->side) == 0;
    return status;
}

int refdyn_motion_complete(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    struct refdyn_step *step = &motion->step;
    motion->tried.verdict = REFDYN_TRIED_END;
    refdyn_kinks_end_before(&motion->state_events, step);
    refdyn_rows_look_at_end(motion);
    const double t = refdyn_rows_side_of(motion, step->t_end);
    int is_known, status = meet_end(motion, t, &is_known);
    refdyn_partition_bound_rank(work, work->m);
    if (!status)
        status = refdyn_partition_watch(work, t, step->state_new, step->state_new + step->n);
    refdyn_partition_bound_rank(work, work->partition.rank);
    if (!status && has_lost_rows(motion)) {
        status = REFDYN_ROWS_INCONSISTENT;
        refdyn_fading_refuse(motion);
    }
    if (!status && step->is_met)
        work->evaluations++; /* the batch that took the step has evaluated them */
    if (!status && !is_known)
        status = refdyn_step_rates(step, t, step->state_new, step->rates_new);
    refdyn_partition_bound_rank(work, work->partition.rank);
    if (status) {
        refdyn_motion_failed(motion, status, step->t_end);
        refdyn_rows_change_at_end(motion, 0);
    } else if (!step->guard || step->guard->only_watches)
        refdyn_step_complete(step, t);
    return status;
}

int refdyn_motion_accept(struct refdyn_motion *motion, double h) {
    struct refdyn_step *step = &motion->step;
    refdyn_statistics_step(&motion->statistics, motion->work, h);
    refdyn_statistics_method(&motion->statistics, step->number);
    refdyn_rate_errors_note(motion);
    refdyn_automatic_after_step(motion);
    motion->tried.verdict = REFDYN_TRIED_WORK;
    const int status = motion->options.balance && step->method->kind->leaves_out_work
                           ? refdyn_find_work_done(step, 1, step->state_new + 2 * step->n)
                           : REFDYN_OK;
    if (!status)
        refdyn_tried_accept(motion);
    return status;
}

void refdyn_motion_refuse(struct refdyn_motion *motion, int status) {
    refdyn_statistics_rejected(&motion->statistics, 1);
    refdyn_tried_end(motion, status);
}

int refdyn_motion_take(struct refdyn_motion *motion, double t_new, double h) {
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options, h);
    return refdyn_step_take(&motion->step, t_new, h);
}

int refdyn_motion_try(struct refdyn_motion *motion, double t_new, double h) {
    refdyn_tried_begin(motion, refdyn_tried_kind(motion), motion->step.number, h);
    const int status = refdyn_motion_take(motion, t_new, h);
    if (status)
        refdyn_motion_failed(motion, status, motion->step.failed_t);
    return status;
}

/* ---- Statistics ---- */

void refdyn_statistics_start(struct refdyn_statistics *statistics) {
    *statistics = (struct refdyn_statistics){.phi_row = -1, .psi_row = -1};
}

void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work) {
    const struct refdyn_residual now = refdyn_residuals(work);
    if (now.phi_row >= 0 && (statistics->phi_row < 0 || now.phi > statistics->phi_max)) {
        statistics->phi_max = now.phi;
        statistics->phi_row = now.phi_row;
    }
    if (now.psi_row >= 0 && (statistics->psi_row < 0 || now.psi > statistics->psi_max)) {
        statistics->psi_max = now.psi;
        statistics->psi_row = now.psi_row;
    }
}

void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h) {
    statistics->step_smallest = statistics->steps ? fmin(statistics->step_smallest, h) : h;
    statistics->step_largest = fmax(statistics->step_largest, h);
    statistics->steps++;
    refdyn_statistics_residuals(statistics, work);
}

void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method) {
    statistics->steps_by[method]++;
}

void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count) {
    statistics->rejected += count;
}

void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing) {
    if (statistics->crossings < REFDYN_CROSSINGS_KEPT)
        statistics->crossing[statistics->crossings] = crossing;
    statistics->crossings++;
    statistics->crossing_error = fmax(statistics->crossing_error, crossing.error);
}

void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations) {
    statistics->evaluations = evaluations;
    statistics->tangents = counts->tangents;
    statistics->factorisations = counts->factorisations;
    statistics->solutions = counts->solutions;
    statistics->partition_changes = work->partition.changes;
    statistics->pivot_min = work->partition.pivot_min;
    statistics->condition_max = work->partition.condition_max;
}
