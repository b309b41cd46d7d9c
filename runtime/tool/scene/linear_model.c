/* Linearises the equations of motion about a state at rest, with the multipliers that balance it best. */
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* [rad, m] and [rad/s^2, m/s^2]; equilibria from statics are balanced much better */
static const double distance_tol = 1e-6;
static const double acceleration_tol = 1e-9;

/* d_rows begins with psi_q and psi_qd. Derivatives by t, inputs and parameters, then k and phi follow. */
static size_t rows_room(const struct refdyn_model *model) {
    size_t variables = 2 * (size_t)model->n + 1 + (size_t)model->input_count + (size_t)model->parameter_count;
    return 3 * (size_t)model->m * variables;
}

static void call(const struct scene *scene, refdyn_function *function, const double *qd, double *out) {
    function(scene->work.p, scene->work.x, scene->state.t, scene->q, qd, out);
}

static double *part_of(const struct linear *linear, const double *whole, int rows, int stride,
                       const int *row_place) {
    double *part = format_allocate_matrix(rows, linear->n);
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < linear->n; j++)
            part[i * linear->n + j] = whole[(row_place ? row_place[i] : i) * stride + linear->place[j]];
    return part;
}

/* Minimises |Q + u^T lambda| in units of sqrt(M_jj), in which the runtime also measures rows. */
static int find_multipliers(const struct linear *linear, const double *Q, double *lambda) {
    const int n = linear->n, m = linear->m, larger = n > m ? n : m;
    double *A = format_allocate_matrix(n, m), *b = format_allocate_matrix(larger, 1);
    double *size = format_allocate_matrix(m, 1), *singular = format_allocate_matrix(larger, 1);
    lapack_int rank;
    for (int j = 0; j < n; j++)
        b[j] = -Q[linear->place[j]] / sqrt(linear->M[j * n + j]);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            A[j * m + i] = linear->u[i * n + j] / sqrt(linear->M[j * n + j]);
            size[i] = fmax(size[i], fabs(A[j * m + i]));
        }
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n && size[i] > 0; j++)
            A[j * m + i] /= size[i];
    lapack_int info =
        LAPACKE_dgelsd(LAPACK_ROW_MAJOR, n, m, 1, A, m, b, 1, singular, sqrt(DBL_EPSILON), &rank);
    for (int i = 0; i < m; i++)
        lambda[i] = size[i] > 0 ? b[i] / size[i] : 0;
    return info == 0 ? REFDYN_OK : REFDYN_NOT_FINITE;
}

static void find_residual(struct linear *linear, const double *Q, const double *lambda) {
    linear->force = format_allocate_matrix(linear->n, 1);
    for (int j = 0; j < linear->n; j++) {
        linear->force[j] = Q[linear->place[j]];
        for (int i = 0; i < linear->m; i++)
            linear->force[j] += linear->u[i * linear->n + j] * lambda[i];
        linear->residual = fmax(linear->residual, fabs(linear->force[j]));
    }
}

static void choose_places(struct linear *linear, struct scene *scene, const int *held) {
    *linear = (struct linear){.m = scene->model->m};
    linear->place = format_allocate((size_t)scene->model->n, sizeof *linear->place);
    linear->is_level_q = format_allocate((size_t)linear->m, sizeof *linear->is_level_q);
    for (int j = 0; j < scene->model->n; j++)
        if (!held[j])
            linear->place[linear->n++] = j;
    for (int i = 0; i < linear->m; i++)
        linear->is_level_q[i] = scene->model->rows[i].level == REFDYN_POSITION;
}

/* Returns REFDYN_NOT_FINITE, with the fault at the first row of K and D, or of psi_q, that is infinite or
 * NaN. */
static int check_finite(const struct linear *linear, struct refdyn_fault *fault) {
    const int n = linear->n;
    for (int i = n * n - 1; i >= 0; i--)
        if (!isfinite(linear->K[i]) || !isfinite(linear->D[i]))
            fault->coordinate = linear->place[i / n];
    for (int i = linear->m * n - 1; i >= 0; i--)
        if (!isfinite(linear->psi_q[i]))
            fault->row = i / n;
    return fault->coordinate < 0 && fault->row < 0 ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Computes K, D and psi_q over the free coordinates. rest (2 n + 1 + m): rates, accelerations and power,
 * which are 0, and lambda. */
static int finish(struct linear *linear, struct scene *scene, const double *rest) {
    const int n = linear->n, m = linear->m, all = scene->model->n;
    double *tangent = format_allocate_matrix(1, all + m + 3 * (all + m) * all); /* f_t g_t G_q G_qd u K D M */
    double *rows = format_allocate(rows_room(scene->model), sizeof *rows);      /* psi_q psi_qd ... */
    call(scene, scene->model->tangent, rest, tangent);
    if (m)
        call(scene, scene->model->d_rows, scene->qd, rows);
    const double *K = tangent + all + m * (1 + 3 * all);
    linear->K = part_of(linear, K, n, all, linear->place);
    linear->D = part_of(linear, K + all * all, n, all, linear->place);
    linear->psi_q = part_of(linear, rows, m, all, NULL);
    for (int i = 0; i < m; i++)
        if (linear->is_level_q[i])
            memset(linear->psi_q + i * n, 0, (size_t)n * sizeof(double));
    return check_finite(linear, &scene->work.fault);
}

/* Coordinates are measured in 1/sqrt(M_jj). */
static int check_mass(const struct linear *linear, struct scene *scene) {
    for (int j = 0; j < linear->n; j++)
        if (!(linear->M[j * (linear->n + 1)] > 0)) {
            scene->work.fault.coordinate = linear->place[j];
            return REFDYN_MASS_NOT_POSITIVE;
        }
    return REFDYN_OK;
}

int scene_linearise(struct linear *linear, struct scene *scene, const int *held) {
    const int all = scene->model->n;
    choose_places(linear, scene, held);
    int status = refdyn_equations(&scene->work, scene->state.t, scene->q, scene->qd);
    if (status != REFDYN_OK)
        return status;
    scene->work.fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
    double *Q = format_allocate_matrix(all, 1), *rest = format_allocate_matrix(1, 2 * all + 1 + linear->m);
    double *lambda = rest + 2 * all + 1;
    call(scene, scene->model->Q, scene->qd, Q);
    linear->M = part_of(linear, scene->work.M, linear->n, all, linear->place);
    linear->u = part_of(linear, scene->work.u, linear->m, all, NULL);
    status = check_mass(linear, scene);
    if (status == REFDYN_OK && linear->m && linear->n)
        status = find_multipliers(linear, Q, lambda);
    if (status == REFDYN_OK)
        status = finish(linear, scene, rest);
    find_residual(linear, Q, lambda);
    return status;
}

int scene_linear_out_of_balance(const struct linear *linear) {
    for (int j = 0; j < linear->n; j++) {
        const double *row = linear->K + j * linear->n;
        double stiffness = 0, force = fabs(linear->force[j]);
        for (int i = 0; i < linear->n; i++)
            stiffness = fmax(stiffness, fabs(row[i]));
        if (force > distance_tol * stiffness && force > acceleration_tol * linear->M[j * (linear->n + 1)])
            return j;
    }
    return -1;
}
