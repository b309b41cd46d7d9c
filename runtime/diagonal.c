/*
 * Solutions with M + g D + g^2 K, K and D diagonal: see diagonal.h.
 *
 * Takes the emitted `diagonals` and `shifted` (refdyn_model.h) at the begin of a step; gives what a stage of
 * it solves for.
 */
#include "base/arithmetic.h"

#include "private/diagonal.h"

#include <math.h>
#include <string.h>

#include "linear/dense.h"

/* Are there rows that may be stabilised? */
static int has_gains(const struct refdyn_model *model) {
    for (int i = 0; i < 2 * model->m && model->gains; i++)
        if (model->gains[i] >= 0)
            return 1;
    return 0;
}

void refdyn_diagonal_lay_out(struct refdyn_diagonal *diagonal, const struct refdyn_model *model,
                             struct room *room) {
    const int n = model->n, m = model->m;
    diagonal->stiffness = room_doubles(room, 2 * n);
    diagonal->damping = diagonal->stiffness + n;
    diagonal->q = room_doubles(room, n);
    diagonal->qd = room_doubles(room, 3 * n + 1 + m);
    diagonal->f = diagonal->qd + n;
    diagonal->k = diagonal->f + n + 1;
    diagonal->s = diagonal->k + m;
    diagonal->u = room_doubles(room, m * n);
    diagonal->has_gains = has_gains(model);
}

/* What stabilises row a: 2 alpha (0) or beta^2 (1). */
static double gain(const struct refdyn_workspace *work, int a, int which) {
    const int place = work->model->gains ? work->model->gains[2 * a + which] : -1;
    return place < 0 ? 0 : work->p[place];
}

int refdyn_diagonal_evaluate(struct refdyn_diagonal *diagonal, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd) {
    const int n = work->n;
    diagonal->work = work;
    diagonal->t = t;
    memcpy(diagonal->q, q, (size_t)n * sizeof *q);
    memcpy(diagonal->qd, qd, (size_t)n * sizeof *qd);
    work->model->diagonals(work->p, work->x, t, diagonal->q, diagonal->qd, diagonal->stiffness);
    if (diagonal->has_gains)
        work->model->u(work->p, work->x, t, diagonal->q, diagonal->qd, diagonal->u);
    if (!refdyn_is_finite(diagonal->stiffness, 2 * n) ||
        !refdyn_is_finite(diagonal->u, diagonal->has_gains ? work->m * n : 0))
        return REFDYN_NOT_FINITE;
    for (int j = 0; j < 2 * n; j++)
        diagonal->stiffness[j] = fmax(0, diagonal->stiffness[j]);
    return REFDYN_OK;
}

void refdyn_diagonal_factor(struct refdyn_diagonal *diagonal, double g) {
    diagonal->g = g;
    for (int j = 0; j < diagonal->work->n; j++)
        diagonal->s[j] = g * (diagonal->damping[j] + g * diagonal->stiffness[j]);
}

static void solve(struct refdyn_diagonal *diagonal, double *x) {
    const struct refdyn_workspace *work = diagonal->work;
    work->model->shifted(work->p, work->x, diagonal->t, diagonal->q, diagonal->qd, x);
}

/* Right sides of the rows. */
static void stabilise(struct refdyn_diagonal *diagonal, const double *r_q, const double *r_v) {
    const struct refdyn_workspace *work = diagonal->work;
    const int n = work->n;
    const double g = diagonal->g;
    memset(diagonal->k, 0, (size_t)work->m * sizeof *diagonal->k);
    for (int a = 0; a < work->m && diagonal->has_gains; a++) {
        const double rate = g * gain(work, a, 0), both = rate + g * g * gain(work, a, 1);
        const double along_q = dense_dot(diagonal->u + a * n, r_q, n),
                     along_v = dense_dot(diagonal->u + a * n, r_v, n);
        diagonal->k[a] = (rate * along_q - both * (g * along_v + along_q)) / (1 + both);
    }
}

void refdyn_diagonal_solve(struct refdyn_diagonal *diagonal, const double *r_q, const double *r_v, double *dq,
                           double *dqd) {
    const struct refdyn_workspace *work = diagonal->work;
    const double g = diagonal->g;
    for (int j = 0; j < work->n; j++)
        diagonal->f[j] = -g * (diagonal->s[j] * r_v[j] + g * diagonal->stiffness[j] * r_q[j]);
    stabilise(diagonal, r_q, r_v);
    solve(diagonal, dqd);
    for (int j = 0; j < work->n; j++) {
        dqd[j] += g * r_v[j];
        dq[j] = g * (r_q[j] + dqd[j]);
    }
}

void refdyn_diagonal_direction(struct refdyn_diagonal *diagonal, int a, double *z) {
    const struct refdyn_workspace *work = diagonal->work;
    memset(diagonal->f, 0, (size_t)work->n * sizeof *diagonal->f);
    for (int b = 0; b < work->m; b++)
        diagonal->k[b] = a == b;
    solve(diagonal, z);
}
