/*
 * Rows that fade out towards a time event.
 *
 * The part of a row that no other row has may fall to 0 until the event, as the part of y in
 * x + (1 - ramp(t, 0.5, 1)) y next to a row x. Until then such rows determine the motion, but near the
 * event rounding dominates them: the rounding of phi is divided by that part, and that of
 * accelerations by its square. The motion itself is smooth. So one step of gauss12 ends at the event: its
 * last stage is 0.034 of the step before it, and nothing is evaluated nearer.
 *
 * In: the beginning of a step, and the event ahead. Out: whether rows lose rank there without a jump, and
 * that step, with its stages on the programme. The next step begins with the remaining rows.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/methods/methods.h"

/* Largest error of the step, in tolerances. The estimate is for states between its ends; the error at the end
 * is smaller by orders. */
static const double error_share = 2;
/* The same for fixed steps [rad, or length]. */
static const double error_fixed = 1e-8;
/* The event is examined from this many ordinary steps ahead, because short steps, such as those of rk4, end
 * too near it. */
static const double reach = 1024;
/* As a part of the step: nearer to its end, the polynomial is more accurate than the rows. */
static const double near_part = 0.05;

static const struct refdyn_method_definition *method(void) {
    return refdyn_method_definition(REFDYN_GAUSS12);
}

int refdyn_fading_memory_size(const struct refdyn_model *model) {
    const int may_fade = model->m > 0 && model->break_count + model->switch_count > 0;
    return may_fade ? method()->kind->memory_size(method(), model) : 0;
}

/* Is the time event at t near for steps of h, and at most half as far as when it was last examined? */
static int is_due(struct refdyn_motion *motion, double h, double t) {
    struct refdyn_fading *fading = &motion->fading;
    const double distance = t - motion->step.t_begin;
    if (t != fading->t) {
        fading->looked = INFINITY;
        fading->is_known = 0;
    }
    fading->t = t;
    if (!(distance < reach * h) || (distance > fading->looked / 2 && distance >= 2 * h))
        return 0;
    fading->looked = distance;
    return 1;
}

/* Do rows fade out towards the time event at t? The row terms in the workspace are lost. */
static int is_ahead(struct refdyn_motion *motion, double t) {
    struct refdyn_workspace *work = motion->work;
    motion->fading.rank = work->partition.rank;
    motion->fading.is_known = work->partition.rank > 0 && !refdyn_rows_jump_at(motion, t) &&
                              refdyn_rank_of_rows(work, 1) < work->partition.rank;
    return motion->fading.is_known;
}

/* Brings a stage's state (2 n) onto the programme, with all independent rows. */
static int bring(void *context, double t, double *state) {
    struct refdyn_motion *motion = context;
    struct refdyn_workspace *work = motion->work;
    const int rank = work->partition.rank;
    int status = refdyn_project(work, t, state, state + work->n, NULL);
    if (!status)
        status = refdyn_partition_update(work, work->k, 1);
    return !status && work->partition.rank != rank ? REFDYN_NO_CONVERGENCE : status;
}

void refdyn_fading_start(struct refdyn_motion *motion) {
    motion->fading = (struct refdyn_fading){.guide = {bring, NULL, motion}, .t = -INFINITY};
}

/* Is the error of the step small enough? It ends where the rows have changed. Error: NO_CONVERGENCE. */
static int judge(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    const int n = step->n;
    const double tol = motion->options.tol, most = tol > 0 ? error_share * tol : error_fixed;
    const double h = step->t_end - step->t_begin, error = refdyn_step_largest_error(step, h, h);
    motion->tried.verdict = REFDYN_TRIED_ERROR;
    motion->tried.error = tol > 0 ? error / tol : NAN;
    if (!(error <= most))
        return REFDYN_NO_CONVERGENCE;
    memset(step->rates_new, 0, refdyn_rates_bytes(step));
    memcpy(step->rates_new, step->state_new + n, (size_t)n * sizeof(double));
    refdyn_collocation_accelerations(step, 1, step->rates_new + n);
    refdyn_rows_change_at_end(motion, 1);
    motion->tried.verdict = REFDYN_TRIED_END;
    return REFDYN_OK;
}

int refdyn_fading_is_near(const struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    return refdyn_fading_is_on(motion) && step->t_end > step->t_begin &&
           refdyn_step_theta(step, t) > 1 - near_part;
}

/* ---- Its entry in the list of obstacles ---- */

double refdyn_fading_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    const double t = ahead->time_event < ahead->bound ? ahead->time_event : INFINITY;
    return motion->work->m > 0 && is_due(motion, ahead->h, t) && is_ahead(motion, t) ? t : INFINITY;
}

/* One attempt, from t_begin to t. */
static int attempt(struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    const double h = t - step->t_begin;
    refdyn_special_step_begin(motion, REFDYN_GAUSS12, &motion->fading.guide);
    int status = refdyn_motion_try(motion, t, h);
    if (!status)
        status = judge(motion);
    if (!status)
        status = refdyn_row_terms(motion->work, refdyn_rows_side_of(motion, t), step->state_new,
                                  step->state_new + step->n);
    if (status)
        return status;
    refdyn_statistics_step(&motion->statistics, motion->work, h);
    refdyn_statistics_method(&motion->statistics, step->number);
    refdyn_tried_accept(motion);
    return REFDYN_OK;
}

int refdyn_fading_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    const double t_event = *t, t_begin = motion->step.t_begin;
    const int status = attempt(motion, t_event);
    if (!status)
        return 1;
    refdyn_motion_failed(motion, status, t_event);
    refdyn_motion_refuse(motion, status);
    if (!refdyn_fading_refuse(motion))
        *t = t_begin;
    else if (!(2 * ahead->h > t_event - t_begin))
        *t = INFINITY;
    return 0;
}
