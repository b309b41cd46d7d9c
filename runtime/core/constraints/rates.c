/*
 * Rates of change of a motion's state.
 *
 * In: a state (q, qd, work). Out: qd, qdd, the power qd . Q_nonconservative + r . qd, and lambda.
 * Accelerations come from the emitted O(n m) function where the model has one and its rows are independent.
 * The index partition computes them otherwise, and also
 *  - where the rows are near losing rank, because its error grows with the condition of K, that of u M^-1 u^T
 * with the square;
 *  - where M is singular, for example at frames without mass that rows determine.
 * The power is computed on request only.
 */
#include "runtime/core/constraints/constraints.h"

#include <string.h>

#include "runtime/core/linear/linear.h"

/* This function and `constrained` compute qdd, the power of the programme force and lambda, laid out as
 * struct NAME_constrained_result. */
static int by_partition(const struct refdyn_evaluation *evaluation, double t, const double *q,
                        const double *qd, double *accelerated) {
    struct refdyn_workspace *work = evaluation->work;
    const int n = work->n;
    double *power = accelerated + n, *lambda = power + 1;
    const int status = refdyn_accelerate(work, t, q, qd, evaluation->stabilise, accelerated);
    if (status)
        return status;
    refdyn_multipliers(work, accelerated, lambda);
    *power = 0;
    for (int a = 0; a < work->m; a++)
        *power += lambda[a] * dense_dot(work->u + a * n, qd, n);
    return REFDYN_OK;
}

static void by_emitted(const struct refdyn_evaluation *evaluation, double t, const double *q,
                       const double *qd, double *accelerated) {
    struct refdyn_workspace *work = evaluation->work;
    const struct refdyn_model *model = work->model;
    work->evaluations++;
    accelerated[model->n] = 0;
    (model->m == 0 ? model->qdd_free : model->constrained)(work->p, work->x, t, q, qd, accelerated);
}

/* Returns whether only rows of open contacts drop out. The emitted function leaves these out itself. */
static int has_all_rows(const struct refdyn_workspace *work) {
    const struct refdyn_model *model = work->model;
    int free = 0;
    if (work->partition.rank == model->m)
        return 1;
    for (int i = 0; i < model->event_count; i++)
        free += model->events[i].contact > 0 && work->p[refdyn_contact_mode_place(model, i)] == 0;
    return work->partition.rank == model->m - free;
}

static int has_emitted(const struct refdyn_evaluation *evaluation) {
    const struct refdyn_workspace *work = evaluation->work;
    const struct refdyn_model *model = work->model;
    if (evaluation->by_partition || evaluation->has_no_inverse)
        return 0;
    return model->m == 0 ? model->qdd_free != NULL : model->constrained != NULL && has_all_rows(work);
}

/* Evaluates the equations to find out why accelerations are not finite. */
static int explain(const struct refdyn_evaluation *evaluation, double t, const double *q, const double *qd,
                   double *qdd) {
    const int status = refdyn_accelerate(evaluation->work, t, q, qd, evaluation->stabilise, qdd);
    return status ? status : REFDYN_NOT_FINITE;
}

int refdyn_rates(const struct refdyn_evaluation *evaluation, double t, const double *state, double *rates) {
    struct refdyn_workspace *work = evaluation->work;
    const int n = work->n;
    const double *q = state, *qd = state + n;
    double of_forces = 0;
    if (has_emitted(evaluation)) {
        by_emitted(evaluation, t, q, qd, rates + n);
        if (!refdyn_is_finite(rates + n, n))
            return explain(evaluation, t, q, qd, rates + n);
    } else {
        const int status = by_partition(evaluation, t, q, qd, rates + n);
        if (status)
            return status;
    }
    memcpy(rates, qd, (size_t)n * sizeof *rates);
    if (evaluation->balance && work->model->power)
        work->model->power(work->p, work->x, t, q, qd, &of_forces);
    rates[2 * n] = evaluation->balance ? rates[2 * n] + of_forces : 0;
    return REFDYN_OK;
}
