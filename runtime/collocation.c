/*
 * Collocation methods on the constrained equations of motion: the step and its interpolant.
 *
 * Takes a state and a step h; gives the state after it, an estimate of its error, and states between. The
 * accelerations of all stages are found by Newton's iteration (Hairer and Wanner, Solving ODEs II, IV.8): the
 * eigenvalues lambda_k of a_ij part it into systems of n coordinates and their rows, each with the matrix of
 * linearise.h for g = lambda_k h. It starts from the polynomial of the step before, continued. Tangent and
 * factors serve later steps as long as the iteration converges with them. Formulas in collocation.h.
 */
#include "base/arithmetic.h"

#include "private/collocation.h"

#include <math.h>
#include <string.h>

#include "constraints/constraints.h"
#include "linear/dense.h"
#include "private/linearise.h"
#include "private/slope.h"
#include "private/step.h"

enum { ITERATIONS_MOST = 12 };

/* Newton ends when what is left changes no velocity by more than this part of the tolerance, per second:
 * errors of slow motions add up over many steps. */
static const double settled_part = 0.005;
/* Of no larger tolerance than this: what is left would excite fast modes that nothing damps. */
static const double settled_most = 1e-5;
/* Where corrections no longer fall, rounding is met, if they move no position by more than this. */
static const double stalled = 1e-11;
/* A correction must fall below this part of the one before, else a smaller step is needed. */
static const double slow = 0.5;
/* Factors are used again while each correction falls below this part of the one before. */
static const double fast = 0.1;
/* A step that is a smaller part of the time than this is none to continue. */
static const double least_part = 1e-12;
/* A vibration of more than so many radians a step is not resolved: its error is that of its size. */
static const double resolved = 10;

/* Accelerations of the last step, of this one; what they miss, later their correction, and the same in parts
 * of the matrix's eigenvectors; power at the stages. */
struct stages {
    double *last, *now, *missing, *parts, *power;
};

static struct stages stages_of(const struct refdyn_drive *drive,
                               const struct refdyn_collocation_table *table) {
    const int size = table->stages * drive->work->n;
    return (struct stages){drive->stages, drive->stages + size, drive->stages + 2 * size,
                           drive->stages + 3 * size, drive->stages + 4 * size};
}

int refdyn_collocation_room(const struct refdyn_collocation_table *table, int n) {
    return table->stages * (4 * n + 1);
}

/* Weight of node j among those that are continued, at theta. */
static double continuation(const struct refdyn_collocation_table *table, int j, double theta) {
    double value = 1;
    for (int k = table->stages - table->continued; k < table->stages; k++)
        if (k != j)
            value *= (theta - table->c[k]) / (table->c[j] - table->c[k]);
    return value;
}

/* The first guess: the polynomial of the last step, continued; without one the accelerations at the begin. */
static void guess(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n, s = table->stages;
    const size_t bytes = (size_t)n * sizeof(double);
    if (drive->tried_t < drive->t_begin) { /* the last attempt became a step */
        memcpy(stages.last, stages.now, (size_t)s * bytes);
        drive->last_h = drive->tried_h;
        if (drive->last_h <
            least_part * fabs(drive->t_begin)) /* between two times that rounding tells apart */
            drive->last_h = drive->rate = 0;
    }
    for (int i = 0; i < s; i++) {
        double *a = stages.now + i * n;
        if (drive->last_h == 0)
            memcpy(a, drive->slope + n, bytes);
        else
            memset(a, 0, bytes);
        for (int j = s - table->continued; j < s && drive->last_h > 0; j++)
            dense_add(a, continuation(table, j, 1 + table->c[i] * h / drive->last_h), stages.last + j * n, n);
    }
    drive->tried_t = drive->t_begin;
    drive->tried_h = h;
}

/* State of stage i into drive->stage. */
static void stage_state(const struct refdyn_drive *drive, const struct refdyn_collocation_table *table, int i,
                        const double *a, double h) {
    const int n = drive->work->n, s = table->stages;
    double *q = drive->stage, *qd = drive->stage + n;
    memcpy(q, drive->state, (size_t)(2 * n + 1) * sizeof *q);
    dense_add(q, h * table->c[i], drive->state + n, n);
    refdyn_add_all(q, h * h, table->aa + i * s, s, a, n, n);
    refdyn_add_all(qd, h, table->a + i * s, s, a, n, n);
}

/* What the stages' accelerations miss: a - those of their states. */
static int find_missing(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n;
    for (int i = 0; i < table->stages; i++) {
        const double t = fmin(drive->t_begin + table->c[i] * h, drive->t_limit);
        stage_state(drive, table, i, stages.now, h);
        const int status = refdyn_slope(drive, t, drive->stage, drive->side);
        if (status) {
            drive->failed_t = t;
            return status;
        }
        stages.power[i] = drive->side[2 * n];
        for (int j = 0; j < n; j++)
            stages.missing[i * n + j] = stages.now[i * n + j] - drive->side[n + j];
    }
    return REFDYN_OK;
}

/* A real eigenvalue, which comes first, has the matrix of a Rosenbrock step. */
static int is_real(const struct refdyn_collocation_table *table, int k) {
    return table->lambda[2 * k + 1] == 0;
}

/* What the first `count` eigenvalues count beside a real one: complex operations are four real ones; those of
 * chains, side by side, take the time of four together. */
static int weight_of(const struct refdyn_drive *drive, const struct refdyn_collocation_table *table,
                     int count) {
    const int is_one = count == 1 && is_real(table, 0);
    return drive->linear.is_chain && !is_one ? 4 : 4 * count - (is_real(table, 0) ? 3 : 0);
}

/* Changes of accelerations by residuals, of the first `count` eigenvalues, in their place. */
static void solve_for(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, int count,
                      double *x) {
    drive->statistics.solutions += weight_of(drive, table, count);
    refdyn_linear_solve_all(&drive->linear, count, table->lambda, x);
}

/* y_i = scale sum_j matrix_ij x_j of vectors, one for each stage. */
static void combine(const struct refdyn_drive *drive, const struct refdyn_collocation_table *table,
                    double scale, const double *matrix, const double *x, double *y) {
    const int n = drive->work->n, s = table->stages;
    memset(y, 0, (size_t)(s * n) * sizeof *y);
    for (int i = 0; i < s; i++)
        refdyn_add_all(y + i * n, scale, matrix + i * s, s, x, n, n);
}

/* One Newton correction of the accelerations; returns its largest entry, in units of 1 rad and `length`. */
static double correct(struct refdyn_drive *drive, const struct refdyn_collocation_table *table) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n, s = table->stages;
    double largest = 0;
    combine(drive, table, -1, table->left, stages.missing, stages.parts);
    solve_for(drive, table, table->eigenvalues, stages.parts);
    combine(drive, table, 1, table->right, stages.parts, stages.missing);
    dense_add(stages.now, 1, stages.missing, s * n);
    for (int i = 0; i < s; i++) {
        const double size = refdyn_largest_change(drive, stages.missing + i * n, NULL);
        if (!(size <= largest))
            largest = size;
        if (isnan(size))
            break;
    }
    return largest;
}

double refdyn_settled_tolerance(double tol) {
    return fmin(tol, settled_most);
}

/* Accelerations of all stages; drive->contraction tells how fast it went. */
static int solve_stages(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    const double enough = settled_part * refdyn_settled_tolerance(drive->options.tol) / h;
    double last = INFINITY;
    drive->contraction = 0;
    for (int iteration = 0; iteration < ITERATIONS_MOST; iteration++) {
        const int status = find_missing(drive, table, h);
        if (status)
            return status;
        const double now = correct(drive, table), part = now / last;
        if (now == 0 || (iteration > 0 && now * part <= enough * (1 - part)))
            return REFDYN_OK;
        if (iteration > 0 && !(part < slow)) {
            last = now;
            break;
        }
        drive->contraction = fmax(drive->contraction, part);
        last = now;
    }
    return h * h * last <= stalled ? REFDYN_OK : REFDYN_NO_CONVERGENCE;
}

/* The state at the end. */
static void finish(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n;
    double *q = drive->state_new, *qd = q + n;
    memcpy(q, drive->state, (size_t)(2 * n + 1) * sizeof *q);
    dense_add(q, h, drive->state + n, n);
    refdyn_add_all(q, h * h, table->bb, table->stages, stages.now, n, n);
    refdyn_add_all(qd, h, table->b, table->stages, stages.now, n, n);
    for (int j = 0; j < table->stages; j++)
        q[2 * n] += h * table->b[j] * stages.power[j];
}

/* What the polynomial with these weights misses at the begin of the step, without what stiffness makes of it:
 * d (n, and n of room). */
static void defect(struct refdyn_drive *drive, const struct refdyn_collocation_table *table,
                   const double *weights, double *d) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n;
    memcpy(d, drive->slope + n, (size_t)n * sizeof *d);
    for (int j = 0; j < table->stages; j++)
        dense_add(d, weights[j], stages.now + j * n, n);
    memset(d + n, 0, (size_t)n * sizeof *d);
    solve_for(drive, table, 1, d);
}

static void estimate(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    const int n = drive->work->n, power = table->order - table->stages - 1;
    defect(drive, table, table->e_low, drive->stage);
    defect(drive, table, table->e, drive->error);
    const double low = refdyn_largest_change(drive, drive->stage, NULL);
    const double high = refdyn_largest_change(drive, drive->error, NULL);
    const double rate = low > 0 ? table->ratio * high / low / h : 0;
    drive->rate = fmax(rate, 0.9 * drive->rate);
    /* the first step may meet what it does not see: it is taken for a vibration that is not resolved */
    const double turned = drive->last_h > 0 ? fmin(drive->rate * h, resolved) : resolved;
    const double factor = h * h * table->share * pow(turned, power);
    for (int j = 0; j < n; j++) {
        drive->error[j] *= factor;
        drive->error[n + j] = 0;
    }
}

/* The state at t_begin + theta h of the polynomial through the accelerations as they are now. */
static void state_between(const struct refdyn_drive *drive, const struct refdyn_collocation_table *table,
                          double h, double theta, double *state) {
    const struct stages stages = stages_of(drive, table);
    const int n = drive->work->n, s = table->stages;
    memcpy(state, drive->state, (size_t)(2 * n + 1) * sizeof *state);
    dense_add(state, h * theta, drive->state + n, n);
    for (int j = 0; j < s; j++) {
        double once = 0, twice = 0;
        for (int k = s - 1; k >= 0; k--) {
            once = (once + table->lagrange[j * s + k] / (k + 1)) * theta;
            twice = (twice + table->lagrange[j * s + k] / ((k + 1) * (k + 2))) * theta;
        }
        dense_add(state, h * h * theta * twice, stages.now + j * n, n);
        dense_add(state + n, h * once, stages.now + j * n, n);
        state[2 * n] += h * once * stages.power[j];
    }
}

/* The tangent in the middle of the step, where the first guess puts it, suits all stages; without a guess, or
 * where that state is no good, at the begin. */
static int find_tangent(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    if (drive->last_h > 0) {
        state_between(drive, table, h, 0.5, drive->stage);
        drive->has_tangent = 0;
        drive->statistics.tangents++;
        const double t = fmin(drive->t_begin + h / 2, drive->t_limit);
        if (!refdyn_slope(drive, t, drive->stage, drive->side) &&
            !refdyn_linear_evaluate(&drive->linear, drive->work, t, drive->stage, drive->side))
            return REFDYN_OK;
    }
    return refdyn_linear_at_begin(drive);
}

static int factor(struct refdyn_drive *drive, const struct refdyn_collocation_table *table, double h) {
    int status = find_tangent(drive, table, h);
    if (!status) {
        drive->statistics.factorisations += weight_of(drive, table, table->eigenvalues);
        status = refdyn_linear_factor_all(&drive->linear, drive->work, table->eigenvalues, table->lambda, h);
    }
    drive->factored_h = status ? 0 : h;
    drive->factored_choice = drive->work->partition.choices;
    if (is_real(table, 0))
        drive->is_aligned = 0;
    return status;
}

int refdyn_collocation_step(struct refdyn_drive *drive, double h) {
    const struct refdyn_collocation_table *table = refdyn_method_facts(drive->method).collocation;
    const int is_kept = drive->factored_h == h && drive->contraction <= fast &&
                        drive->factored_choice == drive->work->partition.choices;
    drive->failed_t = drive->t_begin;
    guess(drive, table, h);
    int status = is_kept ? REFDYN_OK : factor(drive, table, h);
    if (!status)
        status = solve_stages(drive, table, h);
    if (status == REFDYN_NO_CONVERGENCE && is_kept) {
        guess(drive, table, h);
        status = factor(drive, table, h);
        if (!status)
            status = solve_stages(drive, table, h);
    }
    if (status)
        return status;
    finish(drive, table, h);
    estimate(drive, table, h);
    return refdyn_is_finite(drive->state_new, 2 * drive->work->n) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

int refdyn_collocation_interpolate(struct refdyn_drive *drive, double theta, double *state) {
    state_between(drive, refdyn_method_facts(drive->method).collocation, drive->t_end - drive->t_begin, theta,
                  state);
    return REFDYN_OK;
}
