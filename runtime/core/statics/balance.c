/*
 * Balance of a model at rest: forces, rows and their tangent at one place (theory, sect. 8.7).
 *
 * In: coordinates q. Out, for the coordinates that are not held and the rows that hold,
 *     F + u^T lambda = 0,   phi = 0,   F = Q(q, 0) - share Q_start.
 * Full pivoting of u divides the coordinates into dependent ones d and independent ones i. With u = [K_d
 * K_i], P = -K_d^-1 K_i,   K_d^T lambda = -F_d,   dq_d = P dq_i - K_d^-1 phi, there remain as many equations
 * g = F_i + P^T F_d = 0 as unknowns q_i, with the tangent H = [1 P^T] T [1; P],   T = d(Q + u^T lambda)/dq at
 * that lambda. Since lambda is a function of q, H is exact even where g is not 0. Without rows g is F, and H
 * is dQ/dq.
 */
#include "runtime/core/statics/statics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Where rows are not satisfied, a redundant row looks independent by some times the distance, up to the
 * second value. */
static const double misses = 10, misses_most = 1e-3;
/* Rounding of a sum, relative to the sum of its absolute terms. */
static const double rounding = 8 * DBL_EPSILON;

/* ---- Memory ---- */

static void lay_out_place(struct place *place, int n, int m, struct layout *layout) {
    place->q = layout_doubles(layout, n);
    place->Q = layout_doubles(layout, n);
    place->g = layout_doubles(layout, n);
    place->phi = layout_doubles(layout, m);
    place->u = layout_doubles(layout, m * n);
    place->factors = layout_doubles(layout, m * m);
    place->P = layout_doubles(layout, m * n);
    place->lambda = layout_doubles(layout, m);
    place->exchange = layout_ints(layout, m);
}

void refdyn_balance_lay_out(struct balance *b, const struct refdyn_model *model, struct layout *layout) {
    const int has_rows = model->m > 0 && refdyn_has_tangent(model), n = model->n, m = has_rows ? model->m : 0;
    b->n = n;
    b->joints = refdyn_joint_count(model);
    b->free = layout_ints(layout, n);
    b->column = layout_ints(layout, n);
    b->row = layout_ints(layout, m);
    b->order = layout_ints(layout, n);
    b->unit = layout_doubles(layout, n);
    b->size = layout_doubles(layout, m);
    b->Q_start = layout_doubles(layout, n);
    b->rates = layout_doubles(layout, 2 * n + 1 + model->m);
    lay_out_place(&b->now, n, m, layout);
    lay_out_place(&b->trial, n, m, layout);
    b->H = layout_doubles(layout, n * n);
    b->stiffness = layout_doubles(layout, n * n);
    b->tangent = layout_doubles(layout, n * n);
    b->magnitude = layout_doubles(layout, n * n);
    b->terms = layout_doubles(layout, has_rows ? n * (n > m ? n : m) : 0);
    b->coupling = layout_doubles(layout, m * n);
    b->scale = layout_doubles(layout, n);
    b->y = layout_doubles(layout, n);
    b->p = layout_doubles(layout, m);
    if (!refdyn_has_tangent(model))
        return;
    b->small_motion = layout_doubles(layout, 2 * n * n);
    b->motion = layout_doubles(layout, 4 * n * n);
    b->eigenvalues = layout_doubles(layout, 4 * n);
    b->elimination.factors = layout_doubles(layout, 4 * n * n);
    b->elimination.scale = layout_doubles(layout, 2 * n);
    b->elimination.pivot = layout_ints(layout, 2 * n);
    b->elimination.order = layout_ints(layout, 2 * n);
    refdyn_linear_lay_out(&b->linear, model, 1, 0, layout);
}

int refdyn_balance_fail(const struct balance *b, int status, int row, int coordinate) {
    b->work->fault = (struct refdyn_fault){.row = row < 0 ? -1 : b->rows[row],
                                           .coordinate = coordinate < 0 ? -1 : b->free[coordinate]};
    return status;
}

/* ---- Forces and rows ---- */

static int read_forces(struct balance *b, struct place *place) {
    struct refdyn_workspace *work = b->work;
    work->model->Q(work->p, work->x, b->t, place->q, b->rates, place->Q);
    for (int j = 0; j < b->n; j++)
        if (!isfinite(place->Q[j])) {
            work->fault = (struct refdyn_fault){.row = -1, .coordinate = j};
            return REFDYN_NOT_FINITE;
        }
    return REFDYN_OK;
}

static int read_rows(struct balance *b, struct place *place) {
    const struct refdyn_workspace *work = b->work;
    const int status = refdyn_row_terms(b->work, b->t, place->q, b->rates);
    if (status)
        return status;
    refdyn_row_sizes(b->work);
    for (int a = 0; a < b->row_count; a++) {
        const double *u = work->u + b->rows[a] * b->n;
        place->phi[a] = work->phi[b->rows[a]];
        if (!refdyn_is_finite(u, b->n))
            return refdyn_balance_fail(b, REFDYN_NOT_FINITE, a, -1);
        for (int j = 0; j < b->count; j++) {
            place->u[a * b->count + j] = u[b->free[j]];
            b->size[a] = fmax(b->size[a], work->sizes[b->rows[a] * b->n + b->free[j]] * b->unit[b->free[j]]);
        }
    }
    return REFDYN_OK;
}

void refdyn_balance_take_states(const struct balance *b, const double *q) {
    memcpy(b->rates + b->joints, q + b->joints, (size_t)(b->n - b->joints) * sizeof *q);
}

int refdyn_balance_read(struct balance *b, struct place *place) {
    refdyn_balance_take_states(b, place->q);
    int status = b->ask ? b->ask(b->context) : REFDYN_OK;
    if (!status)
        status = read_forces(b, place);
    return status || b->row_count == 0 ? status : read_rows(b, place);
}

/* F of the coordinate free[i]. */
static double force_of(const struct balance *b, const struct place *place, int i) {
    const int j = b->free[i];
    return place->Q[j] - b->share * b->Q_start[j];
}

double refdyn_balance_distance(const struct balance *b, const struct place *place, int a) {
    return fabs(place->phi[a]) / (b->size[a] > 0 ? b->size[a] : 1);
}

/* ---- Elimination of the rows ---- */

static void swap_int(int *a, int *b) {
    const int kept = *a;
    *a = *b;
    *b = kept;
}

/* Writes the rows in units of their sizes, the columns of K^T, into `terms`. Returns the largest distance of
 * a row. */
static double scale_rows(struct balance *b, const struct place *place) {
    double farthest = 0;
    for (int a = 0; a < b->row_count; a++) {
        for (int j = 0; j < b->count; j++)
            b->terms[a * b->count + j] =
                b->size[a] > 0 ? place->u[a * b->count + j] * b->unit[b->free[j]] / b->size[a] : 0;
        farthest = fmax(farthest, refdyn_balance_distance(b, place, a));
    }
    return farthest;
}

/* Like the index partition (theory, sect. 8.1), with units in place of masses. */
void refdyn_balance_choose(struct balance *b, const struct place *place) {
    for (int j = 0; j < b->count; j++) {
        b->column[j] = j;
        b->scale[j] = 1;
    }
    b->rank = 0;
    if (b->row_count == 0)
        return;
    const double least = b->work->rank_tol + fmin(misses * scale_rows(b, place), misses_most);
    for (int a = 0; a < b->row_count; a++)
        b->row[a] = a;
    const int most = refdyn_eliminate(b->terms, b->count, b->row_count, b->order, b->row, b->scale);
    for (int k = 0; k < most; k++)
        swap_int(&b->column[k], &b->column[b->order[k]]);
    while (b->rank < most && b->rank < b->rank_most &&
           1 > least * fabs(b->terms[b->rank * b->count + b->rank]))
        b->rank++;
    refdyn_sort(b->column + b->rank, b->count - b->rank);
    refdyn_sort(b->row + b->rank, b->row_count - b->rank);
}

/* L U = K_d^T; 0: a pivot is zero. */
static int factor_dependent(struct balance *b, struct place *place) {
    const int rank = b->rank;
    for (int a = 0; a < rank; a++)
        for (int k = 0; k < rank; k++)
            place->factors[a * rank + k] = place->u[b->row[a] * b->count + b->column[k]];
    for (int k = 0; k < rank; k++)
        b->scale[k] = b->unit[b->free[b->column[k]]];
    return refdyn_eliminate(place->factors, rank, rank, place->exchange, NULL, b->scale) == rank;
}

/* P = -K_d^-1 K_i */
static void find_P(const struct balance *b, struct place *place) {
    const int rank = b->rank, left = b->count - rank;
    for (int a = 0; a < rank; a++)
        for (int i = 0; i < left; i++)
            place->P[a * left + i] = -place->u[b->row[a] * b->count + b->column[rank + i]];
    refdyn_lu_solve_transposed(place->factors, rank, place->exchange, place->P, left, left);
}

/* K_d^T lambda = -F_d */
static void find_lambda(struct balance *b, struct place *place) {
    for (int k = 0; k < b->rank; k++)
        b->p[k] = -force_of(b, place, b->column[k]);
    refdyn_lu_solve(0, place->factors, b->rank, place->exchange, b->p);
    for (int a = 0; a < b->row_count; a++)
        place->lambda[b->row[a]] = a < b->rank ? b->p[a] : 0;
}

/* g = F_i + P^T F_d; a sum at rounding level becomes 0. */
static void find_g(const struct balance *b, struct place *place) {
    const int rank = b->rank, left = b->count - rank;
    for (int i = 0; i < left; i++) {
        double sum = force_of(b, place, b->column[rank + i]), size = fabs(sum);
        for (int k = 0; k < rank; k++) {
            const double term = place->P[k * left + i] * force_of(b, place, b->column[k]);
            sum += term;
            size += fabs(term);
        }
        place->g[i] = rank > 0 && fabs(sum) <= rounding * size ? 0 : sum;
    }
}

int refdyn_balance_eliminate(struct balance *b, struct place *place) {
    if (b->rank > 0 && !factor_dependent(b, place))
        return refdyn_balance_fail(b, REFDYN_NO_CONVERGENCE, b->row[0], -1);
    find_P(b, place);
    find_lambda(b, place);
    find_g(b, place);
    return REFDYN_OK;
}

/* ---- Tangent ---- */

/* Returns the largest off-diagonal entry of T (n x n) in units; the diagonal contains the springs of the
 * joints. */
static double largest_coupling(const struct balance *b) {
    double largest = 0;
    for (int i = 0; i < b->n; i++)
        for (int j = 0; j < b->n; j++)
            if (i != j)
                largest = fmax(largest, fabs(b->tangent[i * b->n + j]) * b->unit[i] * b->unit[j]);
    return largest;
}

/*
 * T (n x n) of the equations is a sum over all links, whereas Q_q is exact for each entry. Where no force i
 * depends on a coordinate j, rounding of the sum would look like a stiffness of the coordinate.
 */
static void drop_rounding_of_forces(struct balance *b) {
    struct refdyn_workspace *work = b->work;
    const int n = b->n;
    const double least = rounding * largest_coupling(b);
    work->model->Q_q(work->p, work->x, b->t, b->now.q, b->rates, b->H);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (b->H[i * n + j] == 0 && fabs(b->tangent[i * n + j]) * b->unit[i] * b->unit[j] <= least)
                b->tangent[i * n + j] = 0;
}

/* K with the derivatives by states, which are columns of D, in their columns. */
static void find_stiffness(struct balance *b, double *K) {
    const int n = b->n;
    refdyn_linear_stiffness(&b->linear, b->work, b->t, b->now.q, b->rates, K);
    if (b->joints == n)
        return;
    refdyn_linear_damping(&b->linear, b->H);
    for (int i = 0; i < n; i++)
        for (int j = b->joints; j < n; j++)
            K[i * n + j] = b->H[i * n + j];
}

/* Writes T for the coordinates that are not held into b->tangent, row by row. */
static int find_T(struct balance *b) {
    struct refdyn_workspace *work = b->work;
    const int n = b->n, count = b->count;
    refdyn_balance_take_states(b, b->now.q);
    for (int a = 0; a < b->row_count; a++)
        b->rates[2 * n + 1 + b->rows[a]] = b->now.lambda[a];
    if (b->row_count > 0)
        find_stiffness(b, b->tangent);
    else
        work->model->Q_q(work->p, work->x, b->t, b->now.q, b->rates, b->tangent);
    if (b->row_count > 0 && work->model->Q_q)
        drop_rounding_of_forces(b);
    for (int i = 0; i < count; i++) {
        const double *row = b->tangent + b->free[i] * n;
        if (!refdyn_is_finite(row, n))
            return refdyn_balance_fail(b, REFDYN_NOT_FINITE, -1, i);
        for (int j = 0; j < count; j++)
            b->tangent[i * count + j] = b->row_count > 0 ? -row[b->free[j]] : row[b->free[j]];
    }
    return REFDYN_OK;
}

static double part_of(double x, int is_size) {
    return is_size ? fabs(x) : x;
}

/*
 * H := [1 P^T] T [1; P]; coupling := its dependent columns [1 P^T] T (NULL if not needed). Overwrites T.
 * is_size: with the absolute values of all factors.
 */
static void reduce(const struct balance *b, int is_size, double *T, double *H, double *coupling) {
    const int count = b->count, rank = b->rank, left = count - rank;
    const double *P = b->now.P;
    const int *d = b->column, *independent = b->column + rank;
    for (int r = 0; r < count && rank > 0; r++)
        for (int i = 0; i < left; i++)
            for (int k = 0; k < rank; k++)
                T[r * count + independent[i]] += part_of(P[k * left + i], is_size) * T[r * count + d[k]];
    for (int i = 0; i < left; i++) {
        double *row = T + independent[i] * count;
        for (int k = 0; k < rank; k++)
            dense_add(row, part_of(P[k * left + i], is_size), T + d[k] * count, count);
        for (int j = 0; j < left; j++)
            H[i * left + j] = row[independent[j]];
        for (int k = 0; k < rank && coupling; k++)
            coupling[i * rank + k] = row[d[k]];
    }
}

void refdyn_balance_reduce(const struct balance *b, double *X, double *reduced) {
    reduce(b, 0, X, reduced, NULL);
}

/* Sets entries at rounding level to 0. */
static void drop_rounding(const struct balance *b) {
    const int left = b->count - b->rank;
    for (int i = 0; i < left * left; i++)
        if (fabs(b->H[i]) <= rounding * b->magnitude[i])
            b->H[i] = 0;
}

int refdyn_balance_find_tangent(struct balance *b) {
    const int count = b->count, left = count - b->rank, status = find_T(b);
    if (status)
        return status;
    for (int i = 0; i < count * count && b->rank > 0; i++)
        b->terms[i] = fabs(b->tangent[i]);
    if (b->rank > 0)
        reduce(b, 1, b->terms, b->magnitude, NULL);
    reduce(b, 0, b->tangent, b->H, b->coupling);
    for (int i = 0; i < left * left && b->rank == 0; i++)
        b->magnitude[i] = fabs(b->H[i]);
    drop_rounding(b);
    memcpy(b->stiffness, b->H, (size_t)(left * left) * sizeof(double));
    return REFDYN_OK;
}

static void leave_free_ones(struct balance *b) {
    const int left = b->count - b->rank;
    for (int i = 0; i < left; i++) {
        double largest = fabs(b->now.g[i]);
        for (int j = 0; j < left; j++)
            largest = fmax(largest, fmax(fabs(b->H[i * left + j]), fabs(b->H[j * left + i])));
        if (largest == 0)
            b->H[i * left + i] = 1;
    }
}

/*
 * L U, because follower forces make H unsymmetric. A column without a pivot above the rounding of its row's
 * largest entry belongs to a coordinate that nothing holds.
 */
int refdyn_balance_factor(struct balance *b) {
    const int left = b->count - b->rank;
    leave_free_ones(b);
    int failed = -1;
    refdyn_lu_factor(0, b->H, left, b->order, b->scale);
    for (int k = left - 1; k >= 0; k--)
        if (!(b->scale[k] > left * DBL_EPSILON * fabs(b->H[k * left + k]))) /* the inverse pivot */
            failed = k;
    return failed < 0 ? REFDYN_OK
                      : refdyn_balance_fail(b, REFDYN_TANGENT_SINGULAR, -1, b->column[b->rank + failed]);
}

/* ---- Corrections ---- */

void refdyn_balance_meet_rows(const struct balance *b, const struct place *residual, double *p) {
    for (int k = 0; k < b->rank; k++)
        p[k] = -residual->phi[b->row[k]];
    refdyn_lu_solve_transposed(b->now.factors, b->rank, b->now.exchange, p, 1, 1);
}

void refdyn_balance_expand(const struct balance *b, const double *y, const double *p, double *step) {
    const int rank = b->rank, left = b->count - rank;
    for (int k = 0; k < rank; k++)
        step[b->column[k]] = p[k] + dense_dot(b->now.P + k * left, y, left);
    for (int i = 0; i < left; i++)
        step[b->column[rank + i]] = y[i];
}

void refdyn_balance_correct(struct balance *b, const struct place *residual, double *step) {
    const int rank = b->rank, left = b->count - rank;
    refdyn_balance_meet_rows(b, residual, b->p);
    for (int i = 0; i < left; i++)
        b->y[i] = -residual->g[i];
    for (int i = 0; i < left && rank > 0; i++)
        b->y[i] -= dense_dot(b->coupling + i * rank, b->p, rank);
    refdyn_lu_solve(0, b->H, left, b->order, b->y);
    refdyn_balance_expand(b, b->y, b->p, step);
}

double refdyn_balance_length(const struct balance *b, const double *step) {
    double largest = 0;
    for (int i = 0; i < b->count; i++) {
        const double size = fabs(step[i]) / b->unit[b->free[i]];
        if (!(size <= largest))
            largest = size;
    }
    return largest;
}

void refdyn_balance_move(const struct balance *b, double damping, const double *step, double *q) {
    for (int i = 0; i < b->count; i++)
        q[b->free[i]] += damping * step[i];
}
