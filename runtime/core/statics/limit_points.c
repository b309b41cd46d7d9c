/*
 * Equilibria past limit points by pseudo-arclength.
 *
 * Follows the equilibria under an increasing and decreasing load: the curve (q, s) of
 *     F = Q(q) - (1 - s) Q(q_start),   F + u^T lambda = 0,   phi = 0
 * by a step h along its direction (d, sigma), then Newton on these equations and
 *     d . (q - q_predicted) + sigma (s - s_predicted) = 0,
 * whose matrix is regular at limit points, where sigma changes its sign (Keller, in: Applications of
 * Bifurcation Theory, Academic Press, 1977, 359-384). Lengths are in 1 rad, `length` and the whole load.
 */
#include "runtime/core/statics/statics.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

static const double h_first = 0.02, h_least = 1e-9;
/* Ratio of the next step to this one, after few Newton iterations. */
static const double growth = 1.6;
/* Largest first correction relative to the step; largest ratio of successive corrections. */
static const double bend = 0.3, contraction = 0.5;
/* A smaller change of the load along the path counts as 0. */
static const double level = 1e-9;
/* Accuracy of points of the path, sufficient for their directions. */
static const double tol = 1e-9;
enum { ITERATIONS_MOST = 8, ITERATIONS_FEW = 3, STEPS_MOST = 10000 };

/* A point of the path and the direction of the path there. */
struct point {
    double *q, load;
    double *d, sigma; /* (count) direction of q and of the load, of length 1 */
};

void refdyn_limit_points_lay_out(struct statics *statics, const struct refdyn_model *model,
                                 struct layout *layout) {
    const int n = model->n, size = n + 1;
    struct path_room *room = &statics->path;
    room->matrix = layout_doubles(layout, size * size);
    room->side = layout_doubles(layout, size);
    room->scale = layout_doubles(layout, size);
    room->q = layout_doubles(layout, n);
    room->q_next = layout_doubles(layout, n);
    room->d = layout_doubles(layout, n);
    room->d_next = layout_doubles(layout, n);
    room->order = layout_ints(layout, size);
}

static double unit_of(const struct balance *b, int i) {
    return b->unit[b->free[i]];
}

/* (a, alpha) . (b, beta) of directions, in units */
static double product(const struct balance *balance, const struct point *a, const struct point *b) {
    double sum = a->sigma * b->sigma;
    for (int i = 0; i < balance->count; i++)
        sum += a->d[i] / unit_of(balance, i) * (b->d[i] / unit_of(balance, i));
    return sum;
}

/* dg/ds = Q_start,i + P^T Q_start,d */
static double load_on(const struct balance *b, int i) {
    const int rank = b->rank, left = b->count - rank;
    double sum = b->Q_start[b->free[b->column[rank + i]]];
    for (int k = 0; k < rank; k++)
        sum += b->now.P[k * left + i] * b->Q_start[b->free[b->column[k]]];
    return sum;
}

/* Returns whether a coordinate has neither stiffness nor load, so that it keeps its place. */
static int is_untouched(const struct balance *b, const double *matrix, int i) {
    const int left = b->count - b->rank, size = left + 1;
    double largest = fabs(b->now.g[i]);
    for (int j = 0; j < size; j++)
        largest = fmax(largest, fabs(matrix[i * size + j]));
    for (int j = 0; j < left; j++)
        largest = fmax(largest, fabs(matrix[j * size + i]));
    return largest == 0;
}

/* Factors [H dg/ds; d sigma] at `now`; d of the independent coordinates, per unit^2. */
static int factor(struct statics *statics, const struct point *along) {
    struct balance *b = &statics->balance;
    struct path_room *room = &statics->path;
    refdyn_balance_choose(b, &b->now);
    int status = refdyn_balance_eliminate(b, &b->now);
    if (!status)
        status = refdyn_balance_find_tangent(b);
    if (status)
        return status;
    const int left = b->count - b->rank, size = left + 1;
    for (int i = 0; i < left; i++) {
        memcpy(room->matrix + i * size, b->H + i * left, (size_t)left * sizeof(double));
        room->matrix[i * size + left] = load_on(b, i);
    }
    for (int i = 0; i < left; i++)
        if (is_untouched(b, room->matrix, i))
            room->matrix[i * size + i] = 1;
    for (int i = 0; i < left; i++) {
        const int at = b->column[b->rank + i];
        room->matrix[left * size + i] = along->d[at] / (unit_of(b, at) * unit_of(b, at));
    }
    room->matrix[left * size + left] = along->sigma;
    return refdyn_lu_factor(0, room->matrix, size, room->order, room->scale) ? REFDYN_OK
                                                                             : REFDYN_NO_CONVERGENCE;
}

/* Computes the direction at `now` with the same sense as the previous one. */
static int find_direction(struct statics *statics, const struct point *before, struct point *next) {
    struct balance *b = &statics->balance;
    struct path_room *room = &statics->path;
    const int status = factor(statics, before);
    if (status)
        return status;
    const int left = b->count - b->rank;
    memset(room->side, 0, (size_t)left * sizeof(double));
    memset(b->p, 0, (size_t)b->rank * sizeof(double));
    room->side[left] = 1;
    refdyn_lu_solve(0, room->matrix, left + 1, room->order, room->side);
    refdyn_balance_expand(b, room->side, b->p, next->d);
    next->sigma = room->side[left];
    const double length = sqrt(product(b, next, next));
    const double scale = (product(b, next, before) < 0 ? -1 : 1) / length;
    for (int i = 0; i < b->count; i++)
        next->d[i] *= scale;
    next->sigma *= scale;
    return length > 0 && length < INFINITY ? REFDYN_OK : REFDYN_NO_CONVERGENCE;
}

/* Residual of the last equation: the distance of (q, load) at `now` from the plane across the step. */
static double off_plane(const struct balance *b, const struct point *from, double h, double load) {
    double sum = from->sigma * (load - (from->load + h * from->sigma));
    for (int i = b->rank; i < b->count; i++) {
        const int at = b->column[i], j = b->free[at];
        sum += from->d[at] / (b->unit[j] * b->unit[j]) * (b->now.q[j] - (from->q[j] + h * from->d[at]));
    }
    return sum;
}

/* Makes one Newton correction of `now` and *load; returns its length. */
static int correct(struct statics *statics, const struct point *from, double h, double *load,
                   double *length) {
    struct balance *b = &statics->balance;
    struct path_room *room = &statics->path;
    b->share = 1 - *load;
    int status = refdyn_balance_read(b, &b->now);
    if (!status)
        status = factor(statics, from);
    if (status)
        return status;
    const int left = b->count - b->rank;
    refdyn_balance_meet_rows(b, &b->now, b->p);
    for (int i = 0; i < left; i++)
        room->side[i] = -b->now.g[i] - dense_dot(b->coupling + i * b->rank, b->p, b->rank);
    room->side[left] = -off_plane(b, from, h, *load);
    refdyn_lu_solve(0, room->matrix, left + 1, room->order, room->side);
    refdyn_balance_expand(b, room->side, b->p, statics->step);
    refdyn_balance_move(b, 1, statics->step, b->now.q);
    *load += room->side[left];
    *length = fmax(refdyn_balance_length(b, statics->step), fabs(room->side[left]));
    return isfinite(*length) ? REFDYN_OK : REFDYN_NO_CONVERGENCE;
}

/* Computes the next point after a step h; returns the number of corrections. */
static int find_next(struct statics *statics, const struct point *from, double h, struct point *next,
                     int *iterations) {
    struct balance *b = &statics->balance;
    double length = INFINITY, allowed = bend * h;
    memcpy(b->now.q, from->q, (size_t)b->n * sizeof(double));
    refdyn_balance_move(b, h, from->d, b->now.q);
    next->load = from->load + h * from->sigma;
    for (*iterations = 0; *iterations < ITERATIONS_MOST && length > tol; ++*iterations) {
        const int status = correct(statics, from, h, &next->load, &length);
        statics->result->iterations++;
        if (status)
            return status;
        if (length > fmax(allowed, tol))
            return REFDYN_NO_CONVERGENCE;
        allowed = contraction * length;
    }
    if (length > tol)
        return REFDYN_NO_CONVERGENCE;
    memcpy(next->q, b->now.q, (size_t)b->n * sizeof(double));
    b->share = 1 - next->load;
    const int status = refdyn_balance_read(b, &b->now);
    return status ? status : find_direction(statics, from, next);
}

/* The load reaches 1 between two points: iterates from the interpolated place. */
static int end_between(struct statics *statics, const struct point *from, const struct point *to, double *q) {
    const int n = statics->balance.n;
    const double part = (1 - from->load) / (to->load - from->load);
    double *start = statics->q_start;
    for (int j = 0; j < n; j++)
        start[j] = from->q[j] + part * (to->q[j] - from->q[j]);
    const int status = refdyn_newton_solve(statics, 1, start);
    if (!status)
        memcpy(q, start, (size_t)n * sizeof *q);
    return status;
}

static void swap_points(struct point *a, struct point *b) {
    const struct point kept = *a;
    *a = *b;
    *b = kept;
}

static void record(struct statics *statics, const struct point *from, const struct point *to) {
    struct refdyn_statics_result *result = statics->result;
    result->loads++;
    result->load = to->load;
    result->limit_points += from->sigma * to->sigma < 0;
}

/*
 * Computes the direction at the start, towards an increasing load. The search starts from the direction of
 * the load, because the load cannot increase at a start that is itself a limit point, such as a horizontal
 * pendulum.
 */
static int begin(struct statics *statics, struct point *start, struct point *first) {
    struct balance *b = &statics->balance;
    b->share = 1;
    memcpy(b->now.q, start->q, (size_t)b->n * sizeof(double));
    memcpy(first->q, start->q, (size_t)b->n * sizeof(double));
    int status = refdyn_balance_read(b, &b->now);
    refdyn_balance_choose(b, &b->now);
    if (!status)
        status = refdyn_balance_eliminate(b, &b->now);
    if (status)
        return status;
    for (int i = 0; i < b->count - b->rank; i++)
        b->y[i] = load_on(b, i);
    memset(b->p, 0, (size_t)b->rank * sizeof(double));
    refdyn_balance_expand(b, b->y, b->p, start->d);
    start->sigma = 1;
    status = find_direction(statics, start, first);
    for (int i = 0; i < b->count && first->sigma < -level; i++)
        first->d[i] = -first->d[i];
    first->sigma = first->sigma < -level ? -first->sigma : first->sigma;
    return status;
}

int refdyn_limit_points_pass(struct statics *statics, double *q) {
    struct path_room *room = &statics->path;
    const size_t bytes = (size_t)statics->balance.n * sizeof *q;
    struct point now = {.q = room->q, .d = room->d}, next = {.q = room->q_next, .d = room->d_next};
    double h = h_first;
    int iterations;
    memcpy(now.q, q, bytes);
    int status = begin(statics, &now, &next);
    swap_points(&now, &next);
    for (int i = 0; i < STEPS_MOST && h >= h_least; i++) {
        status = find_next(statics, &now, h, &next, &iterations);
        if (!status && next.load >= 1 && now.load < 1) {
            status = end_between(statics, &now, &next, q);
            if (!status)
                return REFDYN_OK;
        }
        if (status) {
            h /= 2;
            continue;
        }
        record(statics, &now, &next);
        swap_points(&now, &next);
        memcpy(q, now.q, bytes);
        if (iterations <= ITERATIONS_FEW)
            h = fmin(growth * h, statics->options->reach);
    }
    return status ? status : REFDYN_NO_CONVERGENCE;
}
