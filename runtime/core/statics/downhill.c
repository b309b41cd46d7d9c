/*
 * Downhill to a stable equilibrium.
 *
 * From a start on the rows, follows the forces under the whole load by steps
 *     y = |S|^-1 g,   S = -(H + H^T)/2,
 * where |S| has the eigenvectors of S and the absolute eigenvalues. This is Newton's step where the potential
 * is convex; it leads away from saddles and maxima (Nocedal and Wright, Numerical Optimization, 3.4). A step
 * is halved until the forces do positive work along it by the trapezoidal rule.
 */
#include "runtime/core/statics/statics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* [rad, length] Newton's iteration continues from this distance. */
static const double near = 1e-4;
/* [rad, length] Step away from a saddle or a maximum along the lowest eigenvector. */
static const double push = 0.1;
static const double part_least = 1e-6;
/* Smallest eigenvalue in units of S; softer directions are treated as this stiff. */
static const double softest = 1e-8;
/* [rad, length] A smaller step in a soft direction is rounding. */
static const double nothing = 1e-10;
enum { STEPS_MOST = 1000 };

/* Returns the largest entry of D^-1 times vector k of V. */
static double reach_of(const struct balance *b, const struct spectrum *s, int k) {
    const int left = b->count - b->rank;
    double largest = 0;
    for (int i = 0; i < left; i++)
        largest = fmax(largest, fabs(s->vectors[i * left + k]) / s->size[i]);
    return largest;
}

/* y (count - rank) = D^-1 V |values|^-1 V^T D^-1 g with S = D V values V^T D. Components at rounding level in
 * directions that nothing holds are left out. */
static void step_downhill(const struct balance *b, const struct spectrum *s, double *y) {
    const int left = b->count - b->rank;
    memset(y, 0, (size_t)left * sizeof *y);
    for (int k = 0; k < left; k++) {
        double along = 0;
        for (int i = 0; i < left; i++)
            along += s->vectors[i * left + k] * b->now.g[i] / s->size[i];
        if (fabs(s->values[k]) < softest && fabs(along) * reach_of(b, s, k) < nothing)
            continue;
        along /= fmax(fabs(s->values[k]), softest);
        for (int i = 0; i < left; i++)
            y[i] += s->vectors[i * left + k] * along / s->size[i];
    }
}

static void expand(struct statics *statics, const double *y) {
    struct balance *b = &statics->balance;
    memset(b->p, 0, (size_t)b->rank * sizeof(double));
    refdyn_balance_expand(b, y, b->p, statics->step);
}

static void shorten(struct balance *b, double *step, double scale) {
    for (int i = 0; i < b->count; i++)
        step[i] *= scale;
}

enum where { ON_THE_WAY, NEAR, THERE };

/* Computes the step from `now`. NEAR: Newton's iteration continues. THERE: this step is the last one, because
 * Newton's iteration would fail in a direction that nothing holds. */
static enum where find_step(struct statics *statics) {
    struct balance *b = &statics->balance;
    struct spectrum spectrum;
    refdyn_stability_find_spectrum(b, &spectrum);
    step_downhill(b, &spectrum, b->y);
    expand(statics, b->y);
    double length = refdyn_balance_length(b, statics->step);
    if (length <= near && spectrum.unstable == 0 && spectrum.neutral == 0)
        return NEAR;
    if (length <= near && spectrum.unstable > 0) {
        refdyn_stability_lowest(b, &spectrum, b->y);
        expand(statics, b->y);
        length = refdyn_balance_length(b, statics->step);
        shorten(b, statics->step, push / length);
    } else if (length > statics->options->reach)
        shorten(b, statics->step, statics->options->reach / length);
    return length <= statics->options->tol ? THERE : ON_THE_WAY;
}

/* g . (q - from) of `now` */
static double work_along(const struct balance *b, const double *from, const double *to) {
    double sum = 0;
    for (int i = b->rank; i < b->count; i++) {
        const int j = b->free[b->column[i]];
        sum += b->now.g[i - b->rank] * (to[j] - from[j]);
    }
    return sum;
}

static int look_at(struct balance *b, const double *q) {
    memcpy(b->now.q, q, (size_t)b->n * sizeof *q);
    int status = refdyn_balance_read(b, &b->now);
    if (!status) {
        refdyn_balance_choose(b, &b->now);
        status = refdyn_balance_eliminate(b, &b->now);
    }
    return status;
}

/* Moves q (n), which `now` was read at, by a fraction of the step along which the forces do positive work. */
static int take_step(struct statics *statics, double *q) {
    struct balance *b = &statics->balance;
    double *next = statics->path.q_next, *forces = statics->path.d, *step = statics->path.d_next;
    const size_t bytes = (size_t)b->n * sizeof *q;
    memset(forces, 0, bytes);
    for (int i = b->rank; i < b->count; i++)
        forces[b->free[b->column[i]]] = b->now.g[i - b->rank];
    memcpy(step, statics->step, (size_t)b->count * sizeof *step);
    for (double part = 1; part >= part_least; part /= 2) {
        memcpy(next, q, bytes);
        refdyn_balance_move(b, part, step, next);
        if (refdyn_newton_meet_rows(statics, next) || look_at(b, next))
            continue;
        double work = work_along(b, q, next);
        for (int j = 0; j < b->n; j++)
            work += forces[j] * (next[j] - q[j]);
        if (work > 0) {
            memcpy(q, next, bytes);
            return REFDYN_OK;
        }
    }
    return REFDYN_NO_CONVERGENCE;
}

/* Records that the forces lead further, and the coordinate that they move. */
static int no_end(const struct balance *b) {
    int at;
    refdyn_largest(b->now.g, b->count - b->rank, &at);
    return refdyn_balance_fail(b, REFDYN_NO_CONVERGENCE, -1, at < 0 ? -1 : b->column[b->rank + at]);
}

/* Evaluates forces, rows and H at q, and computes the step from there. */
static int look_on(struct statics *statics, const double *q, enum where *where) {
    struct balance *b = &statics->balance;
    int status = look_at(b, q);
    if (!status)
        status = refdyn_balance_find_tangent(b);
    if (!status)
        *where = find_step(statics);
    statics->result->iterations++;
    return status;
}

int refdyn_downhill_go(struct statics *statics, double *q) {
    struct balance *b = &statics->balance;
    enum where where = ON_THE_WAY;
    b->share = 0;
    for (int i = 0; i < STEPS_MOST && where == ON_THE_WAY; i++) {
        const int status = look_on(statics, q, &where);
        if (status)
            return status;
        if (where != ON_THE_WAY || !take_step(statics, q))
            continue;
        if (refdyn_balance_length(b, statics->path.d_next) > sqrt(DBL_EPSILON) || look_on(statics, q, &where))
            return no_end(b);
        where = THERE; /* as near as rounding permits */
    }
    if (where == ON_THE_WAY)
        return no_end(b);
    statics->is_following = 0;
    statics->result->load = 1;
    return where == NEAR ? refdyn_newton_solve(statics, 1, q) : REFDYN_OK;
}
