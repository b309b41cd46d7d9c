/*
 * Slopes of a motion: rates, accelerations, power and multipliers at a state.
 *
 * Takes a state (q, qd, work); gives qd, qdd, qd . Q_nonconservative + r . qd and lambda. Accelerations come
 * from the emitted O(n m) function where the model has one and its rows are independent, from the index
 * partition otherwise and where the rows are near losing rank: it has the condition of K, u M^-1 u^T has its
 * square. Power costs nothing unless options.balance asks for it.
 */
#include "base/arithmetic.h"

#include "private/slope.h"

#include <string.h>

#include "constraints/constraints.h"
#include "linear/dense.h"

/* Both give qdd, the power of the programme force and lambda, as struct NAME_constrained_result. */
static int by_partition(struct refdyn_drive *drive, double t, const double *q, const double *qd,
                        double *accelerated) {
    struct refdyn_workspace *work = drive->work;
    const int n = work->n;
    double *power = accelerated + n, *lambda = power + 1;
    const int status = refdyn_accelerate(work, t, q, qd, drive->options.stabilise, accelerated);
    if (status)
        return status;
    refdyn_multipliers(work, accelerated, lambda);
    *power = 0;
    for (int a = 0; a < work->m; a++)
        *power += lambda[a] * dense_dot(work->u + a * n, qd, n);
    return REFDYN_OK;
}

static void by_emitted(struct refdyn_drive *drive, double t, const double *q, const double *qd,
                       double *accelerated) {
    struct refdyn_workspace *work = drive->work;
    const struct refdyn_model *model = work->model;
    work->evaluations++;
    accelerated[model->n] = 0;
    (model->m == 0 ? model->qdd_free : model->constrained)(work->p, work->x, t, q, qd, accelerated);
}

static int has_emitted(const struct refdyn_workspace *work) {
    const struct refdyn_model *model = work->model;
    return model->m == 0 ? model->qdd_free != NULL
                         : model->constrained != NULL && work->partition.rank == model->m;
}

/* Why accelerations are not finite: the equations tell. */
static int explain(struct refdyn_drive *drive, double t, const double *q, const double *qd, double *qdd) {
    const int status = refdyn_accelerate(drive->work, t, q, qd, drive->options.stabilise, qdd);
    return status ? status : REFDYN_NOT_FINITE;
}

int refdyn_slope(struct refdyn_drive *drive, double t, const double *state, double *slope) {
    struct refdyn_workspace *work = drive->work;
    const int n = work->n;
    const double *q = state, *qd = state + n;
    double of_forces = 0;
    if (has_emitted(work) && !drive->is_passing) {
        by_emitted(drive, t, q, qd, slope + n);
        if (!refdyn_is_finite(slope + n, n))
            return explain(drive, t, q, qd, slope + n);
    } else {
        const int status = by_partition(drive, t, q, qd, slope + n);
        if (status)
            return status;
    }
    memcpy(slope, qd, (size_t)n * sizeof *slope);
    if (drive->options.balance && work->model->power)
        work->model->power(work->p, work->x, t, q, qd, &of_forces);
    slope[2 * n] = drive->options.balance ? slope[2 * n] + of_forces : 0;
    return REFDYN_OK;
}
