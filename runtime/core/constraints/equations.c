/*
 * The equations of motion and the rows at a state, and the distance of the state from the programme.
 *
 * In: the emitted functions of the model, one for all quantities or one for each. Out: M, f, u, v, phi, psi,
 * k in the workspace, and the row or coordinate where they are infinite or undefined.
 */
#include "runtime/core/constraints/constraints.h"

#include <math.h>

#include "runtime/core/linear/linear.h"

#define LANES 1
#define NAMED(name) name##_of_one
#include "runtime/core/constraints/programme_distance.inc"

static void call(refdyn_function *function, const struct refdyn_workspace *work, double t, const double *q,
                 const double *qd, double *out) {
    if (function)
        function(work->p, work->x, t, q, qd, out);
}

/* u, v, phi, psi and k; quantities that the model lacks stay 0. */
static void call_rows(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    const struct refdyn_model *model = work->model;
    work->row_evaluations++;
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
    work->evaluations++;
    if (work->model->equations) {
        work->row_evaluations++;
        work->model->equations(work->p, work->x, t, q, qd, work->equations);
    } else
        call_each(work, t, q, qd);
    if (refdyn_is_finite(work->f, work->n) && refdyn_is_finite(work->v, 4 * work->m))
        return REFDYN_OK;
    return refdyn_fault_not_finite(work);
}

double refdyn_distance(const struct refdyn_workspace *work, const double *residual) {
    const struct level_of_one rows = {.n = work->n, .m = work->m, .u = work->u, .residual = residual};
    return distance_of_one(&rows);
}
