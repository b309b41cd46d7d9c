/* Newton's method for the whole motion, its mesh, and values of the solution between the nodes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/system/system.h"

enum { ITERATIONS_MOST = 30 };
/* A correction of this size [m, rad] ends the iteration. Rounding may prevent it where modes grow fast: the
 * iteration also ends when small corrections no longer become smaller. */
static const double correction_tol = 1e-11, stagnation_tol = 1e-6, stagnation = 0.3;

/* Least effort: most corrections of a projection; damping at first [1/s], its changes and its largest value;
 * the damping of projections, which keeps the motion near its place; steps and gains of effort that end the
 * iteration [m, rad; relative]. */
enum { PROJECTIONS_MOST = 12 };
static const double damping_start = 1e-3, damping_after_success = 0.25, damping_after_failure = 8,
                    damping_most = 1e3, damping_of_projection = 10, step_tol = 1e-5,
                    step_with_effort_tol = 1e-3, effort_tol = 1e-10;
/* A projection has failed if a correction is more than so many times the one before it. */
static const double divergence = 10;

/* ---- The mesh ---- */

struct places {
    double *t;
    int count;
};

/* Adds the end of equal steps of at most `mesh` that follow the last place. */
static void add_span(struct places *places, double to, double mesh) {
    const double from = places->t[places->count - 1];
    const int steps = (int)ceil((to - from) / mesh - 1e-9);
    for (int i = 1; i <= steps; i++)
        places->t[places->count++] = i == steps ? to : from + (to - from) * i / steps;
}

/* Kinks of formulas of time are nodes. */
void realise_mesh(struct realise_motion *motion, struct realise_problem *problem, double before, double until,
                  double after, double mesh) {
    const struct scene *scene = problem->scene;
    const struct refdyn_model *model = scene->model;
    const double start = scene->state.t;
    double *breaks = format_allocate_matrix(model->break_count + 2, 1);
    int count = model->break_count;
    if (count)
        model->breaks(scene->work.p, scene->work.x, 0, scene->q, scene->qd, breaks);
    breaks[count++] = start;
    breaks[count++] = until;
    qsort(breaks, (size_t)count, sizeof *breaks, format_ascending);
    const size_t room = (size_t)((before + until - start + after) / mesh) + 2 * (size_t)count + 4;
    struct places places = {.t = format_allocate(room, sizeof *places.t), .count = 1};
    places.t[0] = start - before;
    for (int i = 0; i < count; i++)
        if (breaks[i] >= start && breaks[i] <= until && breaks[i] > places.t[places.count - 1])
            add_span(&places, breaks[i], mesh);
    if (after > 0)
        add_span(&places, until + after, mesh);
    const size_t n = (size_t)problem->n;
    *motion = (struct realise_motion){.problem = problem, .count = places.count - 1, .t = places.t};
    motion->nodes = format_allocate((size_t)places.count * 2 * n, sizeof *motion->nodes);
    motion->stages = format_allocate((size_t)motion->count * REALISE_STAGES * (size_t)problem->width,
                                     sizeof *motion->stages);
    memcpy(motion->nodes, scene->q, n * sizeof *scene->q);
}

/* ---- Newton's method ---- */

/* Rows of the first node: phi = 0 and psi = 0. */
static int find_rows(struct realise_solution *solution, struct realise_ends *ends) {
    struct realise_problem *problem = solution->motion.problem;
    const struct refdyn_workspace *work = &problem->scene->work;
    const struct refdyn_model *model = problem->scene->model;
    const int n = problem->n, rows = 2 * problem->m;
    const double *node = solution->motion.nodes;
    const int status = refdyn_equations(&problem->scene->work, solution->motion.t[0], node, node + n);
    ends->count = 0;
    memset(ends->rows, 0, (size_t)(rows * 2 * n) * sizeof *ends->rows);
    for (int i = 0; i < problem->m; i++)
        ends->count += model->rows[i].level == REFDYN_POSITION ? 2 : model->rows[i].level == REFDYN_VELOCITY;
    for (int i = 0, at = 0; i < problem->m; i++) {
        const enum refdyn_row_level level = model->rows[i].level;
        for (int rate = level != REFDYN_POSITION; rate < (level == REFDYN_ACCELERATION ? 1 : 2);
             rate++, at++) {
            for (int j = 0; j < n; j++)
                ends->rows[(rate * n + j) * ends->count + at] = work->u[i * n + j];
            ends->sides[at] = rate ? -work->psi[i] : -work->phi[i];
        }
    }
    return status;
}

static struct realise_ends start_ends(const struct realise_motion *motion) {
    const struct realise_problem *problem = motion->problem;
    const struct refdyn_model *model = problem->scene->model;
    const int n = problem->n;
    struct realise_ends ends = {.rows = realise_scratch(2 * problem->m, 2 * n),
                                .sides = realise_scratch(2 * problem->m, 1),
                                .scale = realise_scratch(2, n),
                                .unit = realise_scratch(2, n),
                                .first = realise_scratch(2, n),
                                .last = realise_scratch(2, n)};
    double step = INFINITY;
    for (int k = 0; k < motion->count; k++)
        step = fmin(step, motion->t[k + 1] - motion->t[k]);
    for (int i = 0; i < n; i++) {
        const bool is_slide = strcmp(model->coordinates[i].unit, "m") == 0;
        ends.scale[i] = is_slide && model->length > 0 ? model->length : 1;
        ends.scale[n + i] = ends.scale[i] / step;
        ends.unit[i] = ends.unit[n + i] = ends.scale[i];
    }
    return ends;
}

static struct realise_interval *start_intervals(const struct realise_motion *motion) {
    const int n = motion->problem->n, width = motion->problem->width, spare = motion->problem->spare;
    struct realise_interval *intervals =
        memory_scratch(&format_memory, (size_t)motion->count * sizeof *intervals);
    for (int k = 0; k < motion->count; k++)
        intervals[k] = (struct realise_interval){
            realise_scratch(2 * n, 2 * n), realise_scratch(2, n),
            realise_scratch(2 * n, REALISE_STAGES * spare),
            realise_scratch(REALISE_STAGES * width, 2 * n + 1 + REALISE_STAGES * spare)};
    return intervals;
}

/* What an iteration needs. */
struct iteration {
    struct realise_solution *solution;
    struct realise_interval *intervals;
    struct realise_ends ends;
    const double *first, *last;
    double *changes, *values; /* (count + 1) x 2 n, (count x 6 spare) */
};

static struct iteration start_iteration(struct realise_solution *solution, const double *last) {
    const struct realise_motion *motion = &solution->motion;
    const int size = 2 * motion->problem->n;
    double *first = realise_scratch(size, 1);
    memcpy(first, motion->problem->scene->q, (size_t)motion->problem->n * sizeof *first);
    solution->correction = INFINITY;
    solution->iterations = 0;
    return (struct iteration){.solution = solution,
                              .intervals = start_intervals(motion),
                              .ends = start_ends(motion),
                              .first = first,
                              .last = last,
                              .changes = realise_scratch(motion->count + 1, size),
                              .values =
                                  realise_scratch(motion->count, REALISE_STAGES * motion->problem->spare)};
}

/* Rows of the first node, and the wanted changes of both ends. */
static bool find_ends(struct iteration *iteration) {
    struct realise_ends *ends = &iteration->ends;
    const struct realise_motion *motion = &iteration->solution->motion;
    const int size = 2 * motion->problem->n;
    const double *end = motion->nodes + (size_t)motion->count * (size_t)size;
    for (int i = 0; i < size; i++) {
        ends->first[i] = iteration->first[i] - motion->nodes[i];
        ends->last[i] = iteration->last[i] - end[i];
    }
    return find_rows(iteration->solution, ends) == REFDYN_OK;
}

/* One correction of the motion; its largest change of a coordinate, NaN if it failed. */
static double correct(struct iteration *iteration, const struct realise_step *step) {
    struct realise_motion *motion = &iteration->solution->motion;
    const int n = motion->problem->n, size = 2 * n, free = REALISE_STAGES * motion->problem->spare;
    const double *scale = iteration->ends.scale;
    double *changes = iteration->changes, largest = 0;
    for (int k = 0; k < motion->count; k++)
        if (realise_interval_find(motion, k, &iteration->intervals[k]) != REFDYN_OK)
            return NAN;
    if (!find_ends(iteration))
        return NAN;
    if (!(step ? realise_effort_solve(motion, iteration->intervals, step, &iteration->ends, changes,
                                      iteration->values)
               : realise_chain_solve(iteration->intervals, motion->count, n, &iteration->ends, changes)))
        return NAN;
    for (int k = 0; k < motion->count; k++)
        realise_interval_change(motion, k, &iteration->intervals[k], changes + (size_t)k * (size_t)size,
                                iteration->values + (size_t)k * (size_t)free);
    for (int k = 0; k <= motion->count; k++)
        for (int i = 0; i < size; i++) {
            const double change = changes[(size_t)k * (size_t)size + (size_t)i];
            motion->nodes[(size_t)k * (size_t)size + (size_t)i] += change;
            largest = isfinite(change) ? i < n ? fmax(largest, fabs(change) / scale[i]) : largest : NAN;
        }
    return largest;
}

/* Newton's method. `step`: for more drives than rows; otherwise NULL. */
static enum realise_outcome correct_all(struct iteration *iteration, const struct realise_step *step) {
    struct realise_solution *solution = iteration->solution;
    const int most = step ? PROJECTIONS_MOST : ITERATIONS_MOST;
    solution->correction = INFINITY;
    for (int i = 0; i < most; i++) {
        const double before = solution->correction;
        solution->correction = correct(iteration, step);
        solution->iterations++;
        if (!isfinite(solution->correction))
            return REALISE_NOT_FINITE;
        if (step && solution->correction > divergence * before)
            return REALISE_STUCK;
        if (solution->correction <= correction_tol ||
            (solution->correction <= stagnation_tol && solution->correction > stagnation * before))
            return REALISE_SOLVED;
        if (system_interrupted)
            return REALISE_STOPPED;
    }
    return REALISE_STUCK;
}

/* Copies of nodes and stages. */
static void copy_motion(struct realise_motion *to, const struct realise_motion *from) {
    const size_t n = (size_t)from->problem->n, width = (size_t)from->problem->width,
                 count = (size_t)from->count;
    memcpy(to->nodes, from->nodes, (count + 1) * 2 * n * sizeof *to->nodes);
    memcpy(to->stages, from->stages, count * REALISE_STAGES * width * sizeof *to->stages);
}

/* The motion of least effort by the method of Levenberg and Marquardt. A projection follows each damped step,
 * so that efforts of motions that satisfy the equations are compared. The first step leads from the guess to
 * such a motion. */
static enum realise_outcome minimise(struct iteration *iteration) {
    struct realise_motion *motion = &iteration->solution->motion, best = *motion;
    const double effort = realise_effort(motion);
    const struct realise_goal goal = {.effort_unit = effort > 0 ? effort : 1,
                                      .rest = iteration->first,
                                      .unit = iteration->ends.unit,
                                      .last = iteration->last};
    double *aim = realise_scratch(2 * motion->problem->n, 1);
    const struct realise_step projection = {
        .goal = &goal, .aim = aim, .damping = damping_of_projection, .is_projection = true};
    enum realise_outcome outcome = REALISE_SOLVED;
    double merit = INFINITY, size = INFINITY, gain = INFINITY;
    struct realise_step step = {.goal = &goal, .aim = aim, .damping = damping_start};
    best.nodes = realise_scratch(motion->count + 1, 2 * motion->problem->n);
    best.stages = realise_scratch(motion->count, REALISE_STAGES * motion->problem->width);
    bool is_least = false;
    if (iteration->solution->is_refined && realise_end_find(motion, &goal, aim)) {
        outcome = correct_all(iteration, &projection);
        merit = outcome == REALISE_SOLVED ? realise_merit(motion, &goal) : INFINITY;
    }
    while (iteration->solution->iterations < iteration->solution->most && outcome == REALISE_SOLVED &&
           !is_least && step.damping <= damping_most) {
        copy_motion(&best, motion);
        size = correct(iteration, &step);
        outcome = isfinite(size) ? correct_all(iteration, &projection) : REALISE_NOT_FINITE;
        const double next = outcome == REALISE_SOLVED ? realise_merit(motion, &goal) : INFINITY;
        gain = INFINITY;
        if (outcome == REALISE_STOPPED)
            break;
        if (next < merit) {
            gain = merit - next;
            merit = next;
            step.damping *= damping_after_success;
        } else {
            copy_motion(motion, &best);
            step.damping *= damping_after_failure;
            size = isfinite(size) ? size : INFINITY;
            outcome = REALISE_SOLVED;
        }
        is_least = isfinite(merit) &&
                   (size <= step_tol || (gain <= effort_tol * merit && size <= step_with_effort_tol));
    }
    if (outcome != REALISE_SOLVED || is_least)
        return outcome;
    if (!isfinite(merit))
        return REALISE_STUCK;
    /* The effort is least if even with the largest damping no step decreases it. */
    return step.damping > damping_most ? REALISE_SOLVED : REALISE_FALLING;
}

enum realise_outcome realise_solve(struct realise_solution *solution, const double *last) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct iteration iteration = start_iteration(solution, last);
    const enum realise_outcome outcome =
        solution->motion.problem->spare > 0 ? minimise(&iteration) : correct_all(&iteration, NULL);
    memory_back(&format_memory, mark);
    return outcome;
}

/* ---- Values between the nodes ---- */

static int find_interval(const struct realise_motion *motion, double t) {
    int low = 0, high = motion->count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (motion->t[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    return low;
}

void realise_state(const struct realise_motion *motion, double t, double *state, double *tau) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width, k = find_interval(motion, t);
    const double x = (t - motion->t[k]) / (motion->t[k + 1] - motion->t[k]);
    const double *stage = motion->stages + (size_t)k * REALISE_STAGES * (size_t)width;
    double value[REALISE_STAGES], once[REALISE_STAGES], twice[REALISE_STAGES];
    realise_gauss_weights(&problem->gauss, x, 0, value);
    realise_gauss_weights(&problem->gauss, x, 1, once);
    realise_gauss_weights(&problem->gauss, x, 2, twice);
    realise_interval_state(motion, k, x, once, twice, state);
    for (int d = 0; d < problem->drives; d++) {
        tau[d] = 0;
        for (int j = 0; j < REALISE_STAGES; j++)
            tau[d] += value[j] * stage[j * width + n + d];
    }
}

/* Adds the integrals of the drive forces over a part of interval k. */
static void add_integrals(const struct realise_motion *motion, int k, double from, double to, double *sums) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width;
    const double h = motion->t[k + 1] - motion->t[k];
    const double *stage = motion->stages + (size_t)k * REALISE_STAGES * (size_t)width;
    double low[REALISE_STAGES], high[REALISE_STAGES];
    realise_gauss_weights(&problem->gauss, (from - motion->t[k]) / h, 1, low);
    realise_gauss_weights(&problem->gauss, (to - motion->t[k]) / h, 1, high);
    for (int d = 0; d < problem->drives; d++)
        for (int j = 0; j < REALISE_STAGES; j++)
            sums[d] += h * (high[j] - low[j]) * stage[j * width + n + d];
}

void realise_means(const struct realise_motion *motion, double t, double length, double *means) {
    const double end = fmin(t + length, motion->t[motion->count]);
    int k = find_interval(motion, t);
    memset(means, 0, (size_t)motion->problem->drives * sizeof *means);
    for (double from = t; from < end && k < motion->count; k++) {
        const double to = fmin(end, motion->t[k + 1]);
        add_integrals(motion, k, from, to, means);
        from = to;
    }
    for (int d = 0; d < motion->problem->drives; d++)
        means[d] /= end - t;
}

void realise_refine(struct realise_motion *fine, const struct realise_motion *coarse) {
    const struct realise_problem *problem = coarse->problem;
    const int n = problem->n, width = problem->width;
    const size_t size = 2 * (size_t)n;
    *fine = (struct realise_motion){.problem = coarse->problem, .count = 2 * coarse->count};
    fine->t = format_allocate((size_t)fine->count + 1, sizeof *fine->t);
    fine->nodes = format_allocate(((size_t)fine->count + 1) * size, sizeof *fine->nodes);
    fine->stages =
        format_allocate((size_t)fine->count * REALISE_STAGES * (size_t)width, sizeof *fine->stages);
    double *tau = format_allocate_matrix(problem->drives, 1);
    for (int k = 0; k <= fine->count; k++) {
        const int i = k / 2;
        fine->t[k] = k % 2 ? (coarse->t[i] + coarse->t[i + 1]) / 2 : coarse->t[i];
        realise_state(coarse, fine->t[k], fine->nodes + (size_t)k * size, tau);
    }
    for (int k = 0; k < fine->count; k++)
        for (int i = 0; i < REALISE_STAGES; i++) {
            double weights[REALISE_STAGES];
            double *out = fine->stages + ((size_t)k * REALISE_STAGES + (size_t)i) * (size_t)width;
            const double *stage = coarse->stages + (size_t)(k / 2) * REALISE_STAGES * (size_t)width;
            realise_gauss_weights(&problem->gauss, (problem->gauss.c[i] + k % 2) / 2, 0, weights);
            for (int a = 0; a < width; a++)
                for (int j = 0; j < REALISE_STAGES; j++)
                    out[a] += weights[j] * stage[j * width + a];
        }
}
