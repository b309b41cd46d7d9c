/*
 * The equations of motion and the rows at a state, and the distance of the state from the programme.
 *
 * In: the emitted functions of the model, one for all quantities or one for each. Out: M, f, u, v, phi, psi,
 * k in the workspace, and the row or coordinate where they are infinite or undefined.
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

#define LANES 1
#define NAMED(name) name##_of_one
#include "runtime/core/constraints/programme_distance.inc"

static void call(refdyn_function *function, const struct refdyn_workspace *work, double t, const double *q,
                 const double *qd, double *out) {
    if (function)
        function(work->p, work->x, t, q, qd, out);
}

static void note_state(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    const size_t bytes = (size_t)work->n * sizeof *q;
    work->row_evaluations++;
    work->row_state[0] = t;
    memcpy(work->row_state + 1, q, bytes);
    memcpy(work->row_state + 1 + work->n, qd, bytes);
}

/* u, v, phi, psi and k; quantities that the model lacks stay 0. */
static void call_rows(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    const struct refdyn_model *model = work->model;
    note_state(work, t, q, qd);
    if (model->row_terms) {
        model->row_terms(work->p, work->x, t, q, qd, work->u);
        return;
    }
    call(model->u, work, t, q, qd, work->u);
    call(model->v, work, t, q, qd, work->v);
    call(model->phi, work, t, q, qd, work->phi);
    call(model->psi, work, t, q, qd, work->psi);
    call(model->k, work, t, q, qd, work->k);
}

/* Evaluates each quantity by its own function. */
static void call_each(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    const struct refdyn_model *model = work->model;
    call(model->M, work, t, q, qd, work->M);
    call(model->h, work, t, q, qd, work->f);
    call(model->Q, work, t, q, qd, work->side);
    dense_add(work->f, 1, work->side, work->n);
    call_rows(work, t, q, qd);
}

int refdyn_row_terms(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    if (work->m == 0)
        return REFDYN_OK;
    if (!work->model->row_terms && !work->model->u)
        return refdyn_equations(work, t, q, qd);
    call_rows(work, t, q, qd);
    if (refdyn_is_finite(work->u, work->m * (work->n + 4)))
        return REFDYN_OK;
    const int status = refdyn_equations(work, t, q, qd);
    return status ? status : REFDYN_NOT_FINITE;
}

int refdyn_fault_not_finite(struct refdyn_workspace *work) {
    const int n = work->n, m = work->m;
    for (int i = 0; i < n; i++)
        if (!isfinite(work->f[i]) || !refdyn_is_finite(work->M + i * n, n)) {
            work->fault = (struct refdyn_fault){.row = -1, .coordinate = i};
            return REFDYN_NOT_FINITE;
        }
    for (int a = 0; a < m; a++)
        if (!refdyn_is_finite(work->u + a * n, n) ||
            !isfinite(work->v[a] + work->phi[a] + work->psi[a] + work->k[a])) {
            work->fault = (struct refdyn_fault){.row = a, .coordinate = -1};
            return REFDYN_NOT_FINITE;
        }
    return REFDYN_OK;
}

int refdyn_equations(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    if (!refdyn_is_laid_out(work) || !q || !qd)
        return refdyn_missing_status(work);
    work->evaluations++;
    if (work->model->equations) {
        note_state(work, t, q, qd);
        work->model->equations(work->p, work->x, t, q, qd, work->equations);
    } else
        call_each(work, t, q, qd);
    if (refdyn_is_finite(work->f, work->n) && refdyn_is_finite(work->v, 4 * work->m))
        return REFDYN_OK;
    return refdyn_fault_not_finite(work);
}

/* weight_j = 1/sqrt(M_jj). A coordinate without mass gets the weight of the smallest mass above rounding. */
static double weight_of(const struct refdyn_workspace *work, int j, double largest_mass) {
    const double mass = work->M[j * work->n + j], least = DBL_EPSILON * largest_mass;
    return 1 / sqrt(mass > least ? mass : least > 0 ? least : 1);
}

void refdyn_row_sizes(struct refdyn_workspace *work) {
    if (!refdyn_is_laid_out(work))
        return;
    const struct refdyn_model *model = work->model;
    const int n = work->n, m = work->m;
    const double *state = work->row_state;
    double largest_mass = 0;
    memset(work->sizes, 0, (size_t)(m * n) * sizeof *work->sizes);
    if (m > 0 && model->row_sizes)
        model->row_sizes(work->p, work->x, state[0], state + 1, state + 1 + n, work->sizes);
    for (int j = 0; j < n; j++)
        largest_mass = fmax(largest_mass, work->M[j * n + j]);
    for (int j = 0; j < n; j++)
        work->weight[j] = weight_of(work, j, largest_mass);
    for (int a = 0; a < m; a++) {
        double *size = work->sizes + a * n;
        work->row_size[a] = 0;
        for (int j = 0; j < n; j++) {
            size[j] = fmax(size[j], fabs(work->u[a * n + j]));
            work->row_size[a] = fmax(work->row_size[a], size[j] * work->weight[j]);
        }
    }
}

/* The rows in the workspace with the given residuals. */
static struct level_of_one rows_with(const struct refdyn_workspace *work, const double *residual) {
    return (struct level_of_one){
        .n = work->n, .m = work->m, .u = work->u, .sizes = work->sizes, .residual = residual};
}

double refdyn_distance(const struct refdyn_workspace *work, const double *residual) {
    const struct level_of_one rows = rows_with(work, residual);
    return distance_of_one(&rows);
}

double refdyn_allowed_residual(const struct refdyn_workspace *work, int a, double tol, double least,
                               const double *x) {
    const struct level_of_one rows = rows_with(work, NULL);
    return allowed_of_one(&rows, a, tol, least, x);
}

double refdyn_share_of_size(const struct refdyn_workspace *work, int a) {
    double largest = 0;
    for (int j = 0; j < work->n; j++)
        largest = fmax(largest, fabs(work->u[a * work->n + j]) * work->weight[j]);
    return largest < work->row_size[a] ? largest / work->row_size[a] : 1;
}

double refdyn_largest_coefficient(const struct refdyn_workspace *work, int a) {
    const struct level_of_one rows = rows_with(work, NULL);
    return largest_of_row_of_one(&rows, a);
}
