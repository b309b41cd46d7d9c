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

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
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
    qsort(breaks, (size_t)count, sizeof *breaks, ascending);
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
    const int n = motion->problem->n, width = motion->problem->width;
    struct realise_interval *intervals =
        memory_scratch(&format_memory, (size_t)motion->count * sizeof *intervals);
    for (int k = 0; k < motion->count; k++)
        intervals[k] = (struct realise_interval){realise_scratch(2 * n, 2 * n), realise_scratch(2, n),
                                                 realise_scratch(REALISE_STAGES * width, 2 * n + 1)};
    return intervals;
}

/* One correction of the motion; its largest change of a coordinate, NaN if it failed. */
static double correct(struct realise_solution *solution, struct realise_interval *intervals,
                      struct realise_ends *ends, const double *first, const double *last, double *changes) {
    struct realise_motion *motion = &solution->motion;
    const int n = motion->problem->n, size = 2 * n;
    const double *end = motion->nodes + (size_t)motion->count * (size_t)size;
    double largest = 0;
    for (int k = 0; k < motion->count; k++)
        if (realise_interval_find(motion, k, &intervals[k]) != REFDYN_OK)
            return NAN;
    if (find_rows(solution, ends) != REFDYN_OK)
        return NAN;
    for (int i = 0; i < size; i++) {
        ends->first[i] = first[i] - motion->nodes[i];
        ends->last[i] = last[i] - end[i];
    }
    if (!realise_chain_solve(intervals, motion->count, n, ends, changes))
        return NAN;
    for (int k = 0; k < motion->count; k++)
        realise_interval_change(motion, k, &intervals[k], changes + (size_t)k * (size_t)size);
    for (int k = 0; k <= motion->count; k++)
        for (int i = 0; i < size; i++) {
            const double change = changes[(size_t)k * (size_t)size + (size_t)i];
            motion->nodes[(size_t)k * (size_t)size + (size_t)i] += change;
            largest = isfinite(change) ? i < n ? fmax(largest, fabs(change) / ends->scale[i]) : largest : NAN;
        }
    return largest;
}

enum realise_outcome realise_solve(struct realise_solution *solution, const double *last) {
    const struct realise_motion *motion = &solution->motion;
    const int size = 2 * motion->problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    struct realise_ends ends = start_ends(motion);
    struct realise_interval *intervals = start_intervals(motion);
    double *first = realise_scratch(size, 1), *changes = realise_scratch(motion->count + 1, size),
           before = INFINITY;
    enum realise_outcome outcome = REALISE_STUCK;
    memcpy(first, motion->problem->scene->q, (size_t)motion->problem->n * sizeof *first);
    solution->correction = INFINITY;
    solution->iterations = 0;
    while (solution->iterations < ITERATIONS_MOST && outcome == REALISE_STUCK) {
        before = solution->correction;
        solution->correction = correct(solution, intervals, &ends, first, last, changes);
        solution->iterations++;
        if (!isfinite(solution->correction))
            outcome = REALISE_NOT_FINITE;
        else if (solution->correction <= correction_tol ||
                 (solution->correction <= stagnation_tol && solution->correction > stagnation * before))
            outcome = REALISE_SOLVED;
        else if (system_interrupted)
            outcome = REALISE_STOPPED;
    }
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
