/*
 * First guesses for programmes realised by drives: the forces that hold a state at rest, equilibria held by
 * the drives, and a motion by steps of the implicit Euler method. Such steps damp every mode, the growing
 * ones included, so that the motion stays near the one that is searched for. The rows hold at the end of each
 * step:
 *
 *     M qdd = h + Q + B tau + u_l^T lambda,   qd = (q - q_0)/h,   qdd = (qd - qd_0)/h,
 *     phi(q, t) = 0,   psi(q, qd, t) = 0 or u qdd + v = 0.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"

enum { ITERATIONS_MOST = 12, REST_STEPS_MOST = 60 };
static const double guess_tol = 1e-8, rest_tol = 1e-9;

/* Solves A x = b of least norm (columns one after the other); b becomes x. */
static bool solve_least(double *A, double *b, int rows, int columns) {
    lapack_int rank;
    double *singular = realise_scratch(rows + columns, 1);
    return LAPACKE_dgelsd(LAPACK_COL_MAJOR, rows, columns, 1, A, rows, b, rows > columns ? rows : columns,
                          singular, 1e-13, &rank) == 0;
}

double realise_hold(struct realise_problem *problem, double t, const double *q, double *unknowns,
                    int *coordinate) {
    const int n = problem->n, free = problem->drives + problem->loops,
              inputs = problem->scene->model->input_count;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *all = realise_scratch(problem->width, 1), *rates = realise_scratch(n, 1),
           *A = realise_scratch(n, free), *b = realise_scratch(n + free, 1), largest = 0;
    struct realise_place place = {.residual = realise_scratch(n + problem->m, 1)};
    *coordinate = -1;
    if (realise_place_find(problem, t, q, rates, all, &place) != REFDYN_OK) {
        memory_back(&format_memory, mark);
        return NAN;
    }
    for (int i = 0; i < n; i++) {
        for (int d = 0; d < problem->drives; d++)
            A[d * n + i] = place.f_x[i * inputs + problem->input[d]];
        for (int l = 0; l < problem->loops; l++)
            A[(problem->drives + l) * n + i] = -place.u[problem->loop[l] * n + i];
        b[i] = -place.residual[i];
    }
    solve_least(A, b, n, free);
    memcpy(unknowns, b, (size_t)free * sizeof *b);
    memcpy(all + n, b, (size_t)free * sizeof *b);
    realise_place_find(problem, t, q, rates, all, &place);
    for (int i = 0; i < n; i++) {
        const double acceleration = fabs(place.residual[i]) / place.M[i * (n + 1)];
        if (acceleration > largest) {
            largest = acceleration;
            *coordinate = i;
        }
    }
    memory_back(&format_memory, mark);
    return largest;
}

/* ---- Steps ---- */

/* A step from `before` (2 n) to t, or with h = 0 the equilibrium near `before`. */
struct step {
    const double *before;
    double t, h;
    bool is_weak; /* of all solutions, the one with the least forces */
};

/* The largest change of a force by a coordinate: the first n of all rows and columns. */
static double largest_stiffness(const double *A, int rows, int n) {
    double largest = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            largest = fmax(largest, fabs(A[j * rows + i]));
    return largest;
}

/* Solves for the changes of q and of the forces, where the forces count as shares of the largest stiffness:
 * of all solutions, the one with the least norm then changes coordinates little. */
static bool solve_near(double *A, double *b, int rows, int n, int columns) {
    const double stiffness = largest_stiffness(A, rows, n), unit = stiffness > 0 ? stiffness : 1;
    for (int i = n * rows; i < columns * rows; i++)
        A[i] *= unit;
    if (!solve_least(A, b, rows, columns))
        return false;
    for (int j = n; j < columns; j++)
        b[j] *= unit;
    return true;
}

/* One correction of q and of the forces in unknowns[n...]; its size, NaN if it failed. */
static double correct(struct realise_problem *problem, const struct step *step, double *state,
                      double *unknowns) {
    const int n = problem->n, m = problem->m, width = problem->width,
              inputs = problem->scene->model->input_count;
    const struct refdyn_workspace *work = &problem->scene->work;
    const struct refdyn_model *model = problem->scene->model;
    const double h = step->h, by_qd = h > 0 ? 1 / h : 0, by_qdd = by_qd * by_qd;
    double *A = realise_scratch(n + m, width), *b = realise_scratch(n + m + width, 1), size = 0;
    struct realise_place place = {.residual = realise_scratch(n + m, 1)};
    for (int i = 0; i < n; i++) {
        state[n + i] = (state[i] - step->before[i]) * by_qd;
        unknowns[i] = (state[n + i] - step->before[n + i]) * by_qd;
    }
    if (h == 0)
        memset(unknowns, 0, (size_t)n * sizeof *unknowns);
    if (realise_place_find(problem, step->t, state, state + n, unknowns, &place) != REFDYN_OK)
        return NAN;
    for (int i = 0; i < n + m; i++) {
        const bool is_row = i >= n;
        const int a = is_row ? i - n : i;
        const enum refdyn_row_level level = is_row ? model->rows[a].level : REFDYN_ACCELERATION;
        for (int j = 0; j < n; j++)
            A[j * (n + m) + i] =
                !is_row ? place.K[a * n + j] + by_qd * place.D[a * n + j] + by_qdd * place.M[a * n + j]
                : level == REFDYN_POSITION ? place.u[a * n + j]
                : level == REFDYN_VELOCITY
                    ? by_qd * place.u[a * n + j]
                    : place.G_q[a * n + j] + by_qd * place.G_qd[a * n + j] + by_qdd * place.u[a * n + j];
        for (int d = 0; d < problem->drives && !is_row; d++)
            A[(n + d) * (n + m) + i] = place.f_x[a * inputs + problem->input[d]];
        for (int l = 0; l < problem->loops && !is_row; l++)
            A[(n + problem->drives + l) * (n + m) + i] = -place.u[problem->loop[l] * n + a];
        b[i] = level == REFDYN_POSITION && is_row   ? -work->phi[a]
               : level == REFDYN_VELOCITY && is_row ? -work->psi[a]
                                                    : -place.residual[i];
    }
    if (!(step->is_weak ? solve_least(A, b, n + m, width) : solve_near(A, b, n + m, n, width)))
        return NAN;
    for (int i = 0; i < n; i++) {
        state[i] += b[i];
        size = fmax(size, fabs(b[i]));
    }
    for (int i = n; i < width; i++)
        unknowns[i] += b[i];
    return isfinite(size) ? size : NAN;
}

/* Corrects the state until it satisfies the equations of the step; the last correction, NaN if they fail. */
static double take_step(struct realise_problem *problem, const struct step *step, double *state,
                        double *unknowns) {
    double size = INFINITY;
    for (int i = 0; i < ITERATIONS_MOST && size > guess_tol; i++) {
        const struct memory_mark mark = memory_mark(&format_memory);
        size = correct(problem, step, state, unknowns);
        memory_back(&format_memory, mark);
        if (!isfinite(size))
            return NAN;
    }
    for (int i = 0; i < problem->n; i++) {
        state[problem->n + i] = step->h > 0 ? (state[i] - step->before[i]) / step->h : 0;
        unknowns[i] = step->h > 0 ? (state[problem->n + i] - step->before[problem->n + i]) / step->h : 0;
    }
    return size;
}

bool realise_equilibrium(struct realise_problem *problem, double t, double *q) {
    const size_t n = (size_t)problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *state = realise_scratch(2, problem->n), *before = realise_scratch(2, problem->n),
           *unknowns = realise_scratch(problem->width, 1);
    memcpy(state, q, n * sizeof *q);
    memcpy(before, q, n * sizeof *q);
    double size = INFINITY;
    for (int i = 0; i < 4 && size > guess_tol; i++)
        size = take_step(problem, &(struct step){before, t, 0, false}, state, unknowns);
    memcpy(q, state, n * sizeof *q);
    memory_back(&format_memory, mark);
    return size <= guess_tol;
}

/* Fills the nodes between two nodes, and the intervals, after a step from the first to the second. */
static void fill(struct realise_motion *motion, int from, int to, const double *unknowns) {
    const int size = 2 * motion->problem->n;
    const size_t width = (size_t)motion->problem->width;
    const double *first = motion->nodes + from * size, *last = motion->nodes + to * size;
    for (int k = from + 1; k < to; k++) {
        const double part = (motion->t[k] - motion->t[from]) / (motion->t[to] - motion->t[from]);
        for (int i = 0; i < size; i++)
            motion->nodes[k * size + i] = first[i] + part * (last[i] - first[i]);
    }
    for (int i = from * REALISE_STAGES; i < to * REALISE_STAGES; i++)
        memcpy(motion->stages + (size_t)i * width, unknowns, width * sizeof *unknowns);
}

void realise_guess(struct realise_motion *motion, enum realise_guesses which, double step_least) {
    struct realise_problem *problem = motion->problem;
    const size_t size = 2 * (size_t)problem->n, width = (size_t)problem->width;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *unknowns = realise_scratch(problem->width, 1);
    int coordinate;
    realise_hold(problem, motion->t[0], motion->nodes, unknowns + problem->n, &coordinate);
    for (int k = 0, next; k < motion->count; k = next) {
        for (next = k + 1; next < motion->count && motion->t[next] - motion->t[k] < step_least;)
            next++;
        double *before = motion->nodes + (size_t)k * size, *state = motion->nodes + (size_t)next * size;
        const struct step step = {before, motion->t[next], motion->t[next] - motion->t[k],
                                  which == REALISE_WEAK};
        memcpy(state, before, size * sizeof *state);
        if (isnan(take_step(problem, &step, state, unknowns))) {
            memcpy(state, before, size * sizeof *state);
            memset(unknowns, 0, width * sizeof *unknowns);
        }
        fill(motion, k, next, unknowns);
    }
    memory_back(&format_memory, mark);
}

bool realise_rest(struct realise_problem *problem, double t, double step, double *state) {
    const int n = problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *before = realise_scratch(2, n), *unknowns = realise_scratch(problem->width, 1),
           fastest = INFINITY;
    for (int k = 0; k < REST_STEPS_MOST && fastest > rest_tol; k++, step *= 1.5) {
        memcpy(before, state, 2 * (size_t)n * sizeof *state);
        if (!(take_step(problem, &(struct step){before, t, step, false}, state, unknowns) <= guess_tol))
            break;
        fastest = 0;
        for (int i = 0; i < n; i++)
            fastest = fmax(fastest, fabs(state[n + i]));
    }
    memory_back(&format_memory, mark);
    return fastest <= rest_tol;
}
