/* clang-format off */
/*
 * The constrained equations of motion, linearised about a state, and the matrix of a linearly implicit step: theory, sect. 8.4.
 *
 * In: the emitted `tangent` (generator's README, Derivatives) and the independent rows of the partition. Out: solutions, by L U
 * factorisation of dense matrices, or in O(n) from `tangent_vectors` (chain_sweeps.c) where that needs fewer operations.
 *
 * At the accelerations and multipliers of a state the emitted `tangent` gives K, D and f_t of M qdd - h - Q - u^T lambda and
 * G_q, G_qd and g_t of u qdd - k. Accelerations then change with positions, velocities and time by
 *     M da - u^T dlambda = -K dq - D dqd - f_t dt,   u da = -G_q dq - G_qd dqd - g_t dt,
 * and with dq = g (r_q + dqd), dqd = g (r_v + da), an implicit step needs one solution of
 *     (M + g D + g^2 K) x - g u^T lambda = -(g D + g^2 K) s + g D r_q - g f_t dt,   s = g r_v + r_q,
 *     (u + g G_qd + g^2 G_q) x           = -(g G_qd + g^2 G_q) s + g G_qd r_q - g g_t dt,
 * dq = g (x + s), dqd = x + s - r_q: there is no product with M^-1, nor one with M, in which an ill-conditioned M
 * would cost the right side digits. Only the independent rows of the partition take part.
 */
/* clang-format on */
#include "runtime/core/implicit/implicit.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* The parts of struct NAME_tangent_result that both forms have, in their order. */
static void lay_out_rows(struct refdyn_linear *linear, struct layout *layout) {
    const int n = linear->n, m = linear->m;
    linear->tangent = linear->f_t = layout_doubles(layout, n);
    linear->g_t = layout_doubles(layout, m);
    linear->G_q = layout_doubles(layout, m * n);
    linear->G_qd = layout_doubles(layout, m * n);
    linear->u = layout_doubles(layout, m * n);
}

static void lay_out_chain(struct refdyn_linear *linear, const struct refdyn_model *model, int complexes,
                          struct layout *layout) {
    const int size = refdyn_chain_result_size(model), before = linear->n + linear->m * (1 + 3 * linear->n);
    linear->diagonals = layout_doubles(layout, size);
    linear->tangent_size = before + size;
    refdyn_chain_lay_out(&linear->chain, model, complexes > 0, layout);
}

static void lay_out_matrices(struct refdyn_linear *linear, int has_tangent, int complexes,
                             struct layout *layout) {
    const int n = linear->n, m = linear->m, size = n + m;
    if (has_tangent) {
        linear->K = layout_doubles(layout, n * n);
        linear->D = layout_doubles(layout, n * n);
        linear->M = layout_doubles(layout, n * n);
        linear->tangent_size = n + m * (1 + 3 * n) + 3 * n * n;
    }
    linear->matrix = layout_doubles(layout, size * size);
    linear->complex_factors = layout_doubles(layout, 2 * complexes * size * size);
    linear->scale = layout_doubles(layout, size);
    linear->pivot = layout_ints(layout, size);
    linear->complex_pivot = layout_ints(layout, complexes * size);
}

void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct layout *layout) {
    const int n = model->n, m = model->m;
    linear->n = n;
    linear->m = m;
    linear->complexes = complexes;
    linear->is_chain = has_tangent && !model->tangent;
    linear->rows = layout_ints(layout, m);
    if (has_tangent)
        lay_out_rows(linear, layout);
    else if (m == 0)
        return;
    if (linear->is_chain)
        lay_out_chain(linear, model, complexes, layout);
    else
        lay_out_matrices(linear, has_tangent, complexes, layout);
    linear->sides = layout_doubles(layout, 2 * n);
    linear->x = layout_doubles(layout, 2 * (n + m));
    linear->directions = layout_doubles(layout, m * n);
}

void refdyn_linear_reset(struct refdyn_linear *linear) {
    linear->counts = (struct refdyn_linear_counts){0, 0, 0};
}

int refdyn_linear_is_at_begin(const struct refdyn_linear *linear) {
    return linear->is_at_begin;
}

void refdyn_linear_leave_begin(struct refdyn_linear *linear) {
    linear->is_at_begin = 0;
}

void refdyn_linear_drop_factors(struct refdyn_linear *linear) {
    linear->all_h = 0;
}

/* Discards factors, because the solutions of chains read the vectors as well. */
static void find_tangent(struct refdyn_linear *linear, const struct refdyn_workspace *work, double t,
                         const double *q, const double *rates) {
    const struct refdyn_model *model = work->model;
    refdyn_linear_leave_begin(linear);
    refdyn_linear_drop_factors(linear);
    (linear->is_chain ? model->tangent_vectors : model->tangent)(work->p, work->x, t, q, rates,
                                                                 linear->tangent);
}

static int take_tangent(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                        const double *q, const double *qd) {
    if (refdyn_is_finite(linear->tangent, linear->tangent_size)) {
        if (linear->is_chain)
            refdyn_chain_take(&linear->chain, linear->tangent, linear->diagonals);
        return REFDYN_OK;
    }
    const int status = refdyn_equations(work, t, q, qd);
    return status ? status : REFDYN_NOT_FINITE;
}

int refdyn_linear_evaluate(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates) {
    linear->counts.tangents++;
    find_tangent(linear, work, t, q, rates);
    return take_tangent(linear, work, t, q, rates);
}

/* Columns of K, or of D, of a chain. */
static void take_columns(struct refdyn_linear *linear, int is_damping, double *matrix) {
    const int n = linear->n;
    double *unit = linear->sides, *column = linear->sides + n;
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++)
            unit[i] = i == j;
        refdyn_chain_times(&linear->chain, NULL, is_damping ? unit : NULL, is_damping ? NULL : unit, column);
        for (int i = 0; i < n; i++)
            matrix[i * n + j] = column[i];
    }
}

void refdyn_linear_stiffness(struct refdyn_linear *linear, const struct refdyn_workspace *work, double t,
                             const double *q, const double *rates, double *K) {
    const int n = linear->n;
    find_tangent(linear, work, t, q, rates);
    if (!linear->is_chain) {
        memcpy(K, linear->K, (size_t)(n * n) * sizeof *K);
        return;
    }
    refdyn_chain_take(&linear->chain, linear->tangent, linear->diagonals);
    take_columns(linear, 0, K);
}

void refdyn_linear_damping(struct refdyn_linear *linear, double *D) {
    if (linear->is_chain)
        take_columns(linear, 1, D);
    else
        memcpy(D, linear->D, (size_t)(linear->n * linear->n) * sizeof *D);
}

int refdyn_linear_at_begin(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *rates) {
    if (linear->is_at_begin)
        return REFDYN_OK;
    const int status = refdyn_linear_evaluate(linear, work, t, q, rates);
    linear->is_at_begin = !status;
    return status;
}

/* The independent rows of the partition follow the coordinates. */
static void take_rows(struct refdyn_linear *linear, const struct refdyn_workspace *work) {
    linear->size = linear->n + work->partition.rank;
    memcpy(linear->rows, work->partition.row, (size_t)work->partition.rank * sizeof(int));
}

static struct refdyn_border border_of(const struct refdyn_linear *linear) {
    return (struct refdyn_border){linear->u, linear->G_qd, linear->G_q, linear->rows,
                                  linear->size - linear->n};
}

/* ---- Products: of both forms ---- */

static void add_product(struct refdyn_linear *linear, const double *A, const double *x, double *y) {
    if (!x)
        return;
    refdyn_times(A, linear->n, linear->n, x, linear->sides + linear->n);
    dense_add(y, 1, linear->sides + linear->n, linear->n);
}

/* y (size) := [M; u] m + [D; G_qd] d + [K; G_q] k; NULL: zero. Uses the second half of linear->sides. */
static void times(struct refdyn_linear *linear, const double *m, const double *d, const double *k,
                  double *y) {
    const int n = linear->n;
    if (linear->is_chain) {
        refdyn_chain_times(&linear->chain, m, d, k, y);
    } else {
        memset(y, 0, (size_t)n * sizeof *y);
        if (m) /* M is symmetric: its rows are its columns, which are added without sums along rows */
            refdyn_add_all(y, 1, m, n, linear->M, n, n);
        add_product(linear, linear->D, d, y);
        add_product(linear, linear->K, k, y);
    }
    for (int i = n; i < linear->size; i++) {
        const int a = linear->rows[i - n] * n;
        y[i] = m ? dense_dot(linear->u + a, m, n) : 0;
        y[i] += d ? dense_dot(linear->G_qd + a, d, n) : 0;
        y[i] += k ? dense_dot(linear->G_q + a, k, n) : 0;
    }
}

/* ---- Factors: of both forms ---- */

/* base + g first + g^2 second */
static void fill_row(const double *restrict base, const double *restrict first, const double *restrict second,
                     double g, int n, double *restrict row) {
    for (int j = 0; j < n; j++)
        row[j] = base[j] + g * first[j] + g * g * second[j];
}

/* The border -u^T, and the zeros in its corner. */
static void fill_border(struct refdyn_linear *linear, const double *u) {
    const int n = linear->n, size = linear->size;
    for (int k = 0; k < size - n; k++) {
        const double *row = u + linear->rows[k] * n;
        for (int i = 0; i < n; i++)
            linear->matrix[i * size + n + k] = -row[i];
        for (int i = n; i < size; i++)
            linear->matrix[i * size + n + k] = 0;
    }
}

static int factor(struct refdyn_linear *linear) {
    const int is_regular = refdyn_lu_factor(0, linear->matrix, linear->size, linear->pivot, linear->scale);
    return is_regular ? REFDYN_OK : REFDYN_MATRIX_SINGULAR;
}

static int factor_for(struct refdyn_linear *linear, const struct refdyn_workspace *work, double g) {
    const int n = linear->n;
    linear->g = g;
    linear->factored++;
    take_rows(linear, work);
    if (linear->is_chain) {
        const struct refdyn_border border = border_of(linear);
        return refdyn_chain_factor(&linear->chain, g, &border);
    }
    for (int i = 0; i < n; i++)
        fill_row(linear->M + i * n, linear->D + i * n, linear->K + i * n, g, n,
                 linear->matrix + i * linear->size);
    for (int i = n; i < linear->size; i++) {
        const int a = linear->rows[i - n] * n;
        fill_row(linear->u + a, linear->G_qd + a, linear->G_q + a, g, n, linear->matrix + i * linear->size);
    }
    fill_border(linear, linear->u);
    return factor(linear);
}

int refdyn_linear_factor(struct refdyn_linear *linear, const struct refdyn_workspace *work, double g) {
    linear->counts.factorisations++;
    return factor_for(linear, work, g);
}

int refdyn_linear_factor_accelerations(struct refdyn_linear *linear, const struct refdyn_workspace *work) {
    return factor_for(linear, work, 0);
}

static void solve(struct refdyn_linear *linear, double *x) {
    if (linear->is_chain)
        refdyn_chain_solve(&linear->chain, x);
    else
        refdyn_lu_solve(0, linear->matrix, linear->size, linear->pivot, x);
}

/* M and u of the equations in the workspace. */
static int factor_equations(struct refdyn_linear *linear, const struct refdyn_workspace *work) {
    linear->factored++;
    take_rows(linear, work);
    for (int i = 0; i < linear->size; i++) {
        const double *from =
            i < linear->n ? work->M + i * linear->n : work->u + linear->rows[i - linear->n] * linear->n;
        memcpy(linear->matrix + i * linear->size, from, (size_t)linear->n * sizeof *from);
    }
    fill_border(linear, work->u);
    return factor(linear);
}

/* Evaluates M and u from the vectors of joints. The other parts are ignored; they may be infinite, for
 * example at the root of a force that is 0. */
static int evaluate_mass(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                         const double *state) {
    const size_t n = (size_t)linear->n, m = (size_t)linear->m;
    double *rates = linear->x; /* there are rows, so it is long enough */
    memset(rates, 0, (2 * n + 1 + m) * sizeof *rates);
    memcpy(rates, state + n, n * sizeof *rates);
    find_tangent(linear, work, t, state, rates);
    memset(linear->tangent, 0, (size_t)(linear->u - linear->tangent) * sizeof(double)); /* f_t to G_qd */
    refdyn_chain_keep_mass(work->model, linear->tangent, linear->diagonals);
    return take_tangent(linear, work, t, state, state + n);
}

void refdyn_linear_solve(struct refdyn_linear *linear, const double *r_q, const double *r_v, double dt,
                         double *dq, double *dqd) {
    const int n = linear->n;
    const double g = linear->g;
    double *restrict s = linear->sides, *restrict x = linear->x;
    linear->counts.solutions++;
    for (int j = 0; j < n; j++)
        s[j] = g * r_v[j] + r_q[j];
    times(linear, NULL, r_v, s, x);
    for (int i = 0; i < linear->size; i++)
        x[i] = -g * (g * x[i] + dt * (i < n ? linear->f_t[i] : linear->g_t[linear->rows[i - n]]));
    solve(linear, x);
    for (int j = 0; j < n; j++) {
        const double sum = x[j] + s[j];
        dqd[j] = sum - r_q[j];
        dq[j] = g * sum;
    }
}

struct refdyn_directions refdyn_linear_found(const struct refdyn_linear *linear) {
    return (struct refdyn_directions){linear->directions, linear->rows, linear->size - linear->n};
}

void refdyn_linear_directions(struct refdyn_linear *linear) {
    const int n = linear->n;
    for (int k = 0; k < linear->size - n; k++) {
        for (int i = 0; i < linear->size; i++)
            linear->x[i] = i == n + k;
        solve(linear, linear->x);
        memcpy(linear->directions + k * n, linear->x, (size_t)n * sizeof(double));
    }
}

static int factor_mass(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                       const double *state) {
    int status = linear->is_chain ? evaluate_mass(linear, work, t, state)
                                  : refdyn_equations(work, t, state, state + work->n);
    if (!status)
        status = linear->is_chain ? factor_for(linear, work, 0) : factor_equations(linear, work);
    return status;
}

int refdyn_linear_mass_directions(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                                  const double *state) {
    const int status = factor_mass(linear, work, t, state);
    if (!status)
        refdyn_linear_directions(linear);
    return status;
}

/* base + g first + g^2 second for the complex g = re + i im, into row and other. */
static void fill_complex_row(const double *restrict base, const double *restrict first,
                             const double *restrict second, double re, double im, int n, double *restrict row,
                             double *restrict other) {
    for (int j = 0; j < n; j++) {
        row[j] = base[j] + re * first[j] + (re * re - im * im) * second[j];
        other[j] = im * first[j] + 2 * re * im * second[j];
    }
}

/* Complex matrix k for g = re + i im. */
static int factor_complex(struct refdyn_linear *linear, int k, double re, double im) {
    const int n = linear->n, size = linear->size;
    double *real = linear->complex_factors + k * 2 * size * size, *imaginary = real + size * size;
    memset(real, 0, (size_t)(2 * size * size) * sizeof *real);
    for (int i = 0; i < n; i++)
        fill_complex_row(linear->M + i * n, linear->D + i * n, linear->K + i * n, re, im, n, real + i * size,
                         imaginary + i * size);
    for (int i = n; i < size; i++) {
        const int a = linear->rows[i - n];
        fill_complex_row(linear->u + a * n, linear->G_qd + a * n, linear->G_q + a * n, re, im, n,
                         real + i * size, imaginary + i * size);
        for (int j = 0; j < n; j++)
            real[j * size + i] = -linear->u[a * n + j];
    }
    const int is_regular = refdyn_lu_factor(1, real, size, linear->complex_pivot + k * size, linear->scale);
    return is_regular ? REFDYN_OK : REFDYN_MATRIX_SINGULAR;
}

/* A complex operation costs four real ones; chains compute four complex ones side by side in this time. */
long refdyn_linear_weight(const struct refdyn_linear *linear, int count, const double *lambda) {
    const int is_real = lambda[1] == 0, is_one = count == 1 && is_real;
    return linear->is_chain && !is_one ? 4 : 4 * count - (is_real ? 3 : 0);
}

static int factor_all(struct refdyn_linear *linear, const struct refdyn_workspace *work, int count,
                      const double *lambda, double h) {
    int status = REFDYN_OK;
    if (lambda[1] == 0)
        status = factor_for(linear, work, h * lambda[0]);
    else
        take_rows(linear, work);
    if (linear->is_chain && !status) {
        const struct refdyn_border border = border_of(linear);
        return refdyn_chain_factor_all(&linear->chain, count, lambda, h, &border);
    }
    for (int k = lambda[1] == 0; k < count && !status; k++)
        status = factor_complex(linear, k, h * lambda[2 * k], h * lambda[2 * k + 1]);
    return status;
}

int refdyn_linear_factor_all(struct refdyn_linear *linear, const struct refdyn_workspace *work, int count,
                             const double *lambda, double h) {
    linear->counts.factorisations += refdyn_linear_weight(linear, count, lambda);
    const int status = factor_all(linear, work, count, lambda, h);
    refdyn_linear_mark_factors(linear, work, status ? 0 : h);
    return status;
}

void refdyn_linear_mark_factors(struct refdyn_linear *linear, const struct refdyn_workspace *work, double h) {
    linear->all_h = h;
    linear->all_choice = work->partition.choices;
}

void refdyn_linear_count(struct refdyn_linear *linear, long tangents, long factorisations, long solutions) {
    linear->counts.tangents += tangents;
    linear->counts.factorisations += factorisations;
    linear->counts.solutions += solutions;
}

double *refdyn_linear_take_directions(struct refdyn_linear *linear) {
    linear->size = linear->n + linear->m;
    for (int a = 0; a < linear->m; a++)
        linear->rows[a] = a;
    linear->factored++;
    return linear->directions;
}

/* Steps whose lengths differ by a smaller fraction share factors. The last two steps of a motion differ by
 * rounding only, which must not decide whether Newton's iteration reuses factors. */
static const double same_length = 1e-6;

int refdyn_linear_has_factors(const struct refdyn_linear *linear, const struct refdyn_workspace *work,
                              double h) {
    return fabs(linear->all_h - h) <= same_length * h && linear->all_choice == work->partition.choices;
}

static void solve_real(struct refdyn_linear *linear, double *x) {
    times(linear, x, NULL, NULL, linear->x);
    solve(linear, linear->x);
    memcpy(x, linear->x, (size_t)linear->n * sizeof *x);
}

static void solve_complex(struct refdyn_linear *linear, int k, double *x) {
    const int n = linear->n, size = linear->size;
    times(linear, x, NULL, NULL, linear->x);
    times(linear, x + n, NULL, NULL, linear->x + size);
    refdyn_lu_solve(1, linear->complex_factors + k * 2 * size * size, size, linear->complex_pivot + k * size,
                    linear->x);
    memcpy(x, linear->x, (size_t)n * sizeof *x);
    memcpy(x + n, linear->x + size, (size_t)n * sizeof *x);
}

void refdyn_linear_solve_all(struct refdyn_linear *linear, int count, const double *lambda, double *x) {
    const int n = linear->n, is_one = count == 1 && lambda[1] == 0;
    linear->counts.solutions += refdyn_linear_weight(linear, count, lambda);
    if (linear->is_chain && !is_one) {
        const struct refdyn_border border = border_of(linear);
        refdyn_chain_solve_all(&linear->chain, count, lambda, &border, x);
        return;
    }
    for (int k = 0; k < count; k++) {
        const int is_real = lambda[2 * k + 1] == 0;
        if (is_real)
            solve_real(linear, x);
        else
            solve_complex(linear, k, x);
        x += is_real ? n : 2 * n;
    }
}

/* da of dq and dqd, with the factors of M and its rows: M da - u^T mu = -K dq - D dqd, u da = -G_q dq - G_qd
 * dqd */
static void change_accelerations(struct refdyn_linear *linear, const double *dq, const double *dqd,
                                 double *da) {
    times(linear, NULL, dqd, dq, linear->x);
    solve(linear, linear->x);
    for (int j = 0; j < linear->n; j++)
        da[j] = -linear->x[j];
}

/* Entry j of each row with the sign of a right side; rows of the partition follow the coordinates. */
static void take_column(struct refdyn_linear *linear, const double *force, const double *row, int width,
                        int j) {
    for (int i = 0; i < linear->size; i++)
        linear->x[i] = -(i < linear->n ? force[i * width + j] : row[linear->rows[i - linear->n] * width + j]);
}

void refdyn_linear_change_by(struct refdyn_linear *linear, enum refdyn_by by, int j) {
    double *unit = linear->sides;
    if (by == REFDYN_BY_T) {
        take_column(linear, linear->f_t, linear->g_t, 1, 0);
    } else if (!linear->is_chain) {
        take_column(linear, by == REFDYN_BY_Q ? linear->K : linear->D,
                    by == REFDYN_BY_Q ? linear->G_q : linear->G_qd, linear->n, j);
    } else {
        memset(unit, 0, (size_t)linear->n * sizeof *unit);
        unit[j] = -1;
        times(linear, NULL, by == REFDYN_BY_QD ? unit : NULL, by == REFDYN_BY_Q ? unit : NULL, linear->x);
    }
    solve(linear, linear->x);
}

/* x^T A x, A = M, D or K: the one of m, d and k that is x */
static double quadratic(struct refdyn_linear *linear, const double *m, const double *d, const double *k) {
    times(linear, m, d, k, linear->x);
    return dense_dot(m ? m : d ? d : k, linear->x, linear->n);
}

/* Rayleigh's quotients of a shape: omega^2 = K / M, damping ratio = D / (2 sqrt(K M)). */
static void judge_shape(struct refdyn_linear *linear, const double *shape, double *rate, double *damping) {
    const double m = quadratic(linear, shape, NULL, NULL), d = quadratic(linear, NULL, shape, NULL);
    const double k = fabs(quadratic(linear, NULL, NULL, shape));
    const double omega = sqrt(k / m), ratio = d / (2 * sqrt(k * m));
    *rate = ratio > 1 ? omega * (ratio + sqrt(ratio * ratio - 1)) : omega;
    *damping = fmin(ratio, 1);
    if (!isfinite(*rate) || !isfinite(*damping))
        *rate = *damping = 0;
}

enum { SPECTRUM_ITERATIONS = 24, GROWTH_ITERATIONS = 12 /* even: of two parts that take turns */ };

int refdyn_linear_spectrum(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *state, double *rates, double *room, double *rate, double *damping) {
    const int n = linear->n;
    double *q = room, *v = room + n, *a = rates;
    int status = refdyn_linear_at_begin(linear, work, t, state, rates);
    if (!status)
        status = factor_for(linear, work, 0);
    refdyn_linear_drop_factors(linear);
    if (status)
        return status;
    for (int j = 0; j < n; j++) { /* a vector orthogonal to no mode */
        v[j] = 1 + 0.618 * (j % 3) - 0.382 * (j % 5);
        q[j] = v[j];
    }
    double growth = 1;
    for (int i = 0; i < SPECTRUM_ITERATIONS; i++) {
        change_accelerations(linear, q, v, a);
        const double size = sqrt(dense_dot(a, a, n)), before = sqrt(dense_dot(v, v, n));
        if (i >= SPECTRUM_ITERATIONS - GROWTH_ITERATIONS && before > 0)
            growth *= size / before;
        for (int j = 0; j < n; j++) {
            q[j] = v[j] / (size > 0 ? size : 1);
            v[j] = a[j] / (size > 0 ? size : 1);
        }
    }
    judge_shape(linear, q, rate, damping);
    growth = pow(growth, 1.0 / GROWTH_ITERATIONS); /* includes the modes of stabilised rows */
    *rate = isfinite(growth) ? fmax(*rate, growth) : *rate;
    return REFDYN_OK;
}
