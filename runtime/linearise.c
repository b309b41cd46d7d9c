/*
 * The linearised equations of motion and the matrix of a linearly implicit step: see linearise.h.
 *
 * Takes the emitted `tangent` (generator's README, Derivatives) and the independent rows of the partition;
 * gives solutions by L U factorisation.
 */
#include "linearise.h"

#include <math.h>
#include <string.h>

#include "core.h"
#include "dense.h"

/* The parts of struct NAME_tangent_result, in its order. */
static void lay_out_tangent(struct refdyn_linear *linear, struct room *room) {
    const int n = linear->n, m = linear->m;
    linear->tangent = linear->K = room_doubles(room, n * n);
    linear->D = room_doubles(room, n * n);
    linear->G_q = room_doubles(room, m * n);
    linear->G_qd = room_doubles(room, m * n);
    linear->f_t = room_doubles(room, n);
    linear->g_t = room_doubles(room, m);
    linear->M = room_doubles(room, n * n);
    linear->u = room_doubles(room, m * n);
}

void refdyn_linear_lay_out(struct refdyn_linear *linear, const struct refdyn_model *model, int has_tangent,
                           int complexes, struct room *room) {
    const int n = model->n, m = model->m;
    linear->n = n;
    linear->m = m;
    if (has_tangent)
        lay_out_tangent(linear, room);
    else if (m == 0)
        return;
    linear->matrix = room_doubles(room, (n + m) * (n + m));
    linear->right = room_doubles(room, has_tangent ? (n + m) * 2 * n : 0);
    linear->right_t = room_doubles(room, n + m);
    linear->sides = room_doubles(room, 2 * n);
    linear->x = room_doubles(room, 2 * (n + m));
    linear->complex = room_doubles(room, 2 * complexes * (n + m) * (n + m));
    linear->scale = room_doubles(room, n + m);
    linear->directions = room_doubles(room, m * n);
    linear->pivot = room_ints(room, n + m);
    linear->complex_pivot = room_ints(room, complexes * (n + m));
    linear->rows = room_ints(room, m);
}

int refdyn_linear_evaluate(struct refdyn_linear *linear, struct refdyn_workspace *work, double t,
                           const double *q, const double *slope) {
    work->model->tangent(work->p, work->x, t, q, slope, linear->tangent);
    const long size = linear->u + linear->m * linear->n - linear->tangent;
    if (refdyn_is_finite(linear->tangent, (int)size))
        return REFDYN_OK;
    const int status = refdyn_equations(work, t, q, slope);
    return status ? status : REFDYN_NOT_FINITE;
}

/* The independent rows of the partition stand behind the coordinates. */
static void take_rows(struct refdyn_linear *linear, const struct refdyn_workspace *work) {
    linear->size = linear->n + work->partition.rank;
    memcpy(linear->rows, work->partition.row, (size_t)work->partition.rank * sizeof(int));
}

/* Row i of the matrix and of its right side from base + g first + g^2 second and from base, g first. */
static void fill_row(struct refdyn_linear *linear, int i, const double *restrict base,
                     const double *restrict first, const double *restrict second, double g) {
    const int n = linear->n, size = linear->size;
    double *restrict row = linear->matrix + i * size, *restrict right = linear->right + i * 2 * n;
    for (int j = 0; j < n; j++) {
        const double of_rate = g * first[j], of_step = of_rate + g * g * second[j];
        right[j] = -of_step;
        right[n + j] = of_rate;
        row[j] = base[j] + of_step;
    }
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
    const int failed = refdyn_lu_factor(linear->matrix, linear->size, linear->pivot, linear->scale);
    return failed < 0 ? REFDYN_OK : REFDYN_TANGENT_SINGULAR;
}

int refdyn_linear_factor(struct refdyn_linear *linear, const struct refdyn_workspace *work, double g) {
    const int n = linear->n;
    linear->g = g;
    take_rows(linear, work);
    for (int i = 0; i < n; i++) {
        fill_row(linear, i, linear->M + i * n, linear->D + i * n, linear->K + i * n, g);
        linear->right_t[i] = -g * linear->f_t[i];
    }
    for (int i = n; i < linear->size; i++) {
        const int a = linear->rows[i - n];
        fill_row(linear, i, linear->u + a * n, linear->G_qd + a * n, linear->G_q + a * n, g);
        linear->right_t[i] = -g * linear->g_t[a];
    }
    fill_border(linear, linear->u);
    return factor(linear);
}

/* M and u with its border. */
static int factor_mass(struct refdyn_linear *linear, const struct refdyn_workspace *work, const double *M,
                       const double *u) {
    const int n = linear->n;
    take_rows(linear, work);
    for (int i = 0; i < linear->size; i++) {
        const double *from = i < n ? M + i * n : u + linear->rows[i - n] * n;
        memcpy(linear->matrix + i * linear->size, from, (size_t)n * sizeof *from);
    }
    fill_border(linear, u);
    return factor(linear);
}

int refdyn_linear_factor_mass(struct refdyn_linear *linear, const struct refdyn_workspace *work) {
    return factor_mass(linear, work, work->M, work->u);
}

void refdyn_linear_solve(struct refdyn_linear *linear, const double *r_q, const double *r_v, double dt,
                         double *dq, double *dqd) {
    const int n = linear->n;
    double *restrict sides = linear->sides;
    for (int j = 0; j < n; j++) {
        sides[j] = linear->g * r_v[j] + r_q[j];
        sides[n + j] = r_q[j];
    }
    refdyn_times(linear->right, linear->size, 2 * n, sides, linear->x);
    dense_add(linear->x, dt, linear->right_t, linear->size);
    refdyn_lu_solve(linear->matrix, linear->size, linear->pivot, linear->x);
    for (int j = 0; j < n; j++) {
        linear->x[j] += sides[j];
        dq[j] = linear->g * linear->x[j];
        dqd[j] = linear->x[j] - r_q[j];
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
        refdyn_lu_solve(linear->matrix, linear->size, linear->pivot, linear->x);
        memcpy(linear->directions + k * n, linear->x, (size_t)n * sizeof(double));
    }
}

int refdyn_linear_at_begin(struct refdyn_drive *drive) {
    if (drive->has_tangent)
        return REFDYN_OK;
    drive->statistics.tangents++;
    const int status =
        refdyn_linear_evaluate(&drive->linear, drive->work, drive->t_begin, drive->state, drive->slope);
    drive->has_tangent = !status;
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

int refdyn_linear_factor_complex(struct refdyn_linear *linear, const struct refdyn_workspace *work, int k,
                                 double re, double im) {
    take_rows(linear, work);
    const int n = linear->n, size = linear->size;
    double *real = linear->complex + k * 2 * size * size, *imaginary = real + size * size;
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
    const int failed = refdyn_complex_lu_factor(real, size, linear->complex_pivot + k * size);
    return failed < 0 ? REFDYN_OK : REFDYN_TANGENT_SINGULAR;
}

/* M x and u x */
static void times_mass(const struct refdyn_linear *linear, const double *x, double *y) {
    const int n = linear->n;
    refdyn_times(linear->M, n, n, x, y);
    for (int i = n; i < linear->size; i++)
        y[i] = dense_dot(linear->u + linear->rows[i - n] * n, x, n);
}

void refdyn_linear_solve_complex(struct refdyn_linear *linear, int k, double *re, double *im) {
    const int n = linear->n, size = linear->size;
    times_mass(linear, re, linear->x);
    times_mass(linear, im, linear->x + size);
    refdyn_complex_lu_solve(linear->complex + k * 2 * size * size, size, linear->complex_pivot + k * size,
                            linear->x);
    memcpy(re, linear->x, (size_t)n * sizeof *re);
    memcpy(im, linear->x + size, (size_t)n * sizeof *im);
}

void refdyn_linear_solve_residual(struct refdyn_linear *linear, double *x) {
    times_mass(linear, x, linear->x);
    refdyn_lu_solve(linear->matrix, linear->size, linear->pivot, linear->x);
    memcpy(x, linear->x, (size_t)linear->n * sizeof *x);
}

/* da of dq and dqd, with the factors of M and its rows: M da - u^T mu = -K dq - D dqd, u da = -G_q dq - G_qd
 * dqd */
static void change_accelerations(struct refdyn_linear *linear, const double *dq, const double *dqd,
                                 double *da) {
    const int n = linear->n;
    for (int i = 0; i < linear->size; i++) {
        const double *K = i < n ? linear->K + i * n : linear->G_q + linear->rows[i - n] * n;
        const double *D = i < n ? linear->D + i * n : linear->G_qd + linear->rows[i - n] * n;
        linear->x[i] = -dense_dot(K, dq, n) - dense_dot(D, dqd, n);
    }
    refdyn_lu_solve(linear->matrix, linear->size, linear->pivot, linear->x);
    memcpy(da, linear->x, (size_t)n * sizeof *da);
}

/* x^T A x */
static double quadratic(const double *A, const double *x, double *room, int n) {
    refdyn_times(A, n, n, x, room);
    return dense_dot(x, room, n);
}

/* Rayleigh's quotients of a shape: omega^2 = K / M, damping ratio = D / (2 sqrt(K M)). */
static void judge_shape(struct refdyn_linear *linear, const double *shape, double *rate, double *damping) {
    const int n = linear->n;
    const double m = quadratic(linear->M, shape, linear->x, n);
    const double k = fabs(quadratic(linear->K, shape, linear->x, n));
    const double d = quadratic(linear->D, shape, linear->x, n);
    const double omega = sqrt(k / m), ratio = d / (2 * sqrt(k * m));
    *rate = ratio > 1 ? omega * (ratio + sqrt(ratio * ratio - 1)) : omega;
    *damping = fmin(ratio, 1);
    if (!isfinite(*rate) || !isfinite(*damping))
        *rate = *damping = 0;
}

enum { SPECTRUM_ITERATIONS = 24, GROWTH_ITERATIONS = 12 /* even: of two parts that take turns */ };

int refdyn_linear_spectrum(struct refdyn_drive *drive, double *rate, double *damping) {
    struct refdyn_linear *linear = &drive->linear;
    const int n = linear->n;
    double *q = drive->stage, *v = drive->stage + n, *a = drive->side;
    int status = refdyn_linear_at_begin(drive);
    if (!status)
        status = factor_mass(linear, drive->work, linear->M, linear->u);
    drive->is_aligned = 0; /* the factors of a step, and the rows that they are for, are gone */
    drive->factored_h = 0;
    if (status)
        return status;
    for (int j = 0; j < n; j++) { /* some vector that is at right angles to no mode */
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
    growth = pow(growth, 1.0 / GROWTH_ITERATIONS); /* it sees what stabilised rows do, too */
    *rate = isfinite(growth) ? fmax(*rate, growth) : *rate;
    return REFDYN_OK;
}
