/*
 * Collocation methods on the constrained equations of motion: the step and its interpolant.
 *
 * Takes a state and a step h; gives the state after it, an estimate of its error, and states between. The
 * accelerations of all stages are found by Newton's iteration (Hairer and Wanner, Solving ODEs II, IV.8): the
 * eigenvalues lambda_k of a_ij part it into systems of n coordinates and their rows, each with the matrix of
 * linearisation.h for g = lambda_k h. It starts from the polynomial of the step before, continued. Tangent
 * and factors serve later steps as long as the iteration converges with them. Formulas in collocation.h.
 */
#include "base/arithmetic.h"

#include "methods/collocation.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "constraints/constraints.h"
#include "linear/dense.h"
#include "methods/smoothness.h"
#include "methods/step.h"

enum { ITERATIONS_MOST = 12 };

/* Newton ends when what is left changes no velocity by more than this part of the tolerance, per second:
 * errors of slow motions add up over many steps. */
static const double settled_part = 0.005;
/* Of no larger tolerance than this: what is left would excite fast modes that nothing damps. */
static const double settled_most = 1e-5;
/* Where corrections no longer fall, rounding is met, if they move no position by more than this. */
static const double stalled = 1e-11;
/* The same where forces saturate, of rates: units in the last place of the largest one. */
static const double stalled_rate = 64 * DBL_EPSILON;
/* Or what the stages miss is: of a step of at least this length [s], and of the largest acceleration. */
static const double shortest = 1e-3, small = 1e-6;
/* A correction must fall below this part of the one before, else a smaller step is needed. */
static const double slow = 0.5;
/* Factors are used again while each correction falls below this part of the one before. */
static const double fast = 0.1;
/* A step that is a smaller part of the time than this is none to continue. */
static const double least_part = 1e-12;
/* A vibration of more than so many radians a step is not resolved: its error is that of its size. */
static const double resolved = 10;

/* What is kept from step to step, then arrays (stages x n). */
struct memory {
    double tried_t, tried_h; /* begin and length of the last attempt; INFINITY: there is none, */
    double last_h;           /* length of the last step, 0: there is none, */
    double rate;             /* fastest vibration that the error estimate has met lately [1/s] */
    double contraction;      /* how fast the last iteration converged */
    double arrays[];
};

/* Accelerations of the last step, of this one; what they miss, later their correction, and the same in parts
 * of the matrix's eigenvectors; power at the stages. */
struct stages {
    double *last, *now, *missing, *parts, *power;
};

static struct memory *memory_of(const struct refdyn_step *step) {
    return (struct memory *)(void *)step->memory;
}

static const struct refdyn_collocation_table *table_of(const struct refdyn_step *step) {
    return step->method->table;
}

static struct stages stages_of(const struct refdyn_step *step) {
    double *arrays = memory_of(step)->arrays;
    const int size = table_of(step)->stages * step->n;
    return (struct stages){arrays, arrays + size, arrays + 2 * size, arrays + 3 * size, arrays + 4 * size};
}

static int memory_size(const struct refdyn_method_definition *method, const struct refdyn_model *model) {
    const struct refdyn_collocation_table *table = method->table;
    return (int)(sizeof(struct memory) / sizeof(double)) + table->stages * (4 * model->n + 1);
}

static void begin(struct refdyn_step *step, int is_new) {
    struct memory *memory = memory_of(step);
    memory->tried_t = INFINITY;
    memory->last_h = 0;
    if (is_new)
        memory->rate = 0;
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
static void guess(struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    struct memory *memory = memory_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n, s = table->stages;
    const size_t bytes = (size_t)n * sizeof(double);
    if (memory->tried_t < step->t_begin) { /* the last attempt became a step */
        memcpy(stages.last, stages.now, (size_t)s * bytes);
        memory->last_h = memory->tried_h;
        if (memory->last_h <
            least_part * fabs(step->t_begin)) /* between two times that rounding tells apart */
            memory->last_h = memory->rate = 0;
    }
    for (int i = 0; i < s; i++) {
        double *a = stages.now + i * n;
        if (memory->last_h == 0)
            memcpy(a, step->rates + n, bytes);
        else
            memset(a, 0, bytes);
        for (int j = s - table->continued; j < s && memory->last_h > 0; j++)
            dense_add(a, continuation(table, j, 1 + table->c[i] * h / memory->last_h), stages.last + j * n,
                      n);
    }
    memory->tried_t = step->t_begin;
    memory->tried_h = h;
}

/* State of stage i into step->stage. */
static void stage_state(const struct refdyn_step *step, int i, const double *a, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    const int n = step->n, s = table->stages;
    double *q = step->stage, *qd = step->stage + n;
    memcpy(q, step->state, (size_t)(2 * n + 1) * sizeof *q);
    dense_add(q, h * table->c[i], step->state + n, n);
    refdyn_add_all(q, h * h, table->aa + i * s, s, a, n, n);
    refdyn_add_all(qd, h, table->a + i * s, s, a, n, n);
}

/* What the stages' accelerations miss: a - those of their states. */
static int find_missing(struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n;
    for (int i = 0; i < table->stages; i++) {
        const double t = refdyn_step_inside(step, step->t_begin + table->c[i] * h);
        stage_state(step, i, stages.now, h);
        const int status = refdyn_rates(&step->evaluation, t, step->stage, step->side);
        if (status) {
            step->failed_t = t;
            return status;
        }
        stages.power[i] = step->side[2 * n];
        for (int j = 0; j < n; j++)
            stages.missing[i * n + j] = stages.now[i * n + j] - step->side[n + j];
    }
    return REFDYN_OK;
}

/* Changes of accelerations by residuals, of the first `count` eigenvalues, in their place. */
static void solve_for(struct refdyn_step *step, int count, double *x) {
    const struct refdyn_collocation_table *table = table_of(step);
    refdyn_linear_solve_all(step->linear, count, table->lambda, x);
}

/* y_i = scale sum_j matrix_ij x_j of vectors, one for each stage. */
static void combine(const struct refdyn_step *step, double scale, const double *matrix, const double *x,
                    double *y) {
    const struct refdyn_collocation_table *table = table_of(step);
    const int n = step->n, s = table->stages;
    memset(y, 0, (size_t)(s * n) * sizeof *y);
    for (int i = 0; i < s; i++)
        refdyn_add_all(y + i * n, scale, matrix + i * s, s, x, n, n);
}

/* Largest entry of vectors, one for each stage, in units of 1 rad and `length`; NaN where one is. */
static double largest_of(const struct refdyn_step *step, const double *x) {
    double largest = 0;
    for (int i = 0; i < table_of(step)->stages; i++) {
        const double size = refdyn_step_largest_change(step, x + i * step->n, NULL);
        if (!(size <= largest))
            largest = size;
        if (isnan(size))
            break;
    }
    return largest;
}

/* One Newton correction of the accelerations; returns its largest entry. */
static double correct(struct refdyn_step *step) {
    const struct refdyn_collocation_table *table = table_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n, s = table->stages;
    combine(step, -1, table->left, stages.missing, stages.parts);
    solve_for(step, table->eigenvalues, stages.parts);
    combine(step, 1, table->right, stages.parts, stages.missing);
    dense_add(stages.now, 1, stages.missing, s * n);
    return largest_of(step, stages.missing);
}

static int saturates(const struct refdyn_step *step) {
    return step->evaluation.work->model->saturates;
}

/* Time over which what is left of accelerations counts [s]: a short step where forces saturate is one that
 * friction has cut short, and its velocities last. */
static double lasting(const struct refdyn_step *step, double h) {
    return saturates(step) ? fmax(h, 1) : h;
}

double refdyn_settled_tolerance(double tol) {
    return fmin(tol, settled_most);
}

/* What iterations have still to settle: corrections of the accelerations and, where forces saturate, what the
 * stages miss, for the reason given above. */
struct unsettled {
    double correction, missed;
};

/* Corrections no longer fall: is that rounding? Where forces saturate, the matrix of what rests makes
 * corrections small that are none, so it is rounding of rates, or of stiff springs if what the stages miss is
 * small in itself. */
static int is_rounding(const struct refdyn_step *step, double h, const struct unsettled *last) {
    if (!saturates(step))
        return h * h * last->correction <= stalled;
    return h * last->correction <=
               stalled_rate * refdyn_step_largest_change(step, step->state + step->n, NULL) ||
           (h * fmax(h, shortest) * last->missed <= stalled &&
            last->missed <= small * largest_of(step, stages_of(step).now));
}

/* A value falls from one iteration to the next: is what is left of it small enough? */
static int is_settled(double now, double last, double enough) {
    const double part = now / last;
    return now * part <= enough * (1 - part);
}

/* Accelerations of all stages; the contraction tells how fast it went. */
static int solve_stages(struct refdyn_step *step, double h) {
    struct memory *memory = memory_of(step);
    const double enough = settled_part * refdyn_settled_tolerance(step->tolerance) / lasting(step, h);
    struct unsettled last = {INFINITY, INFINITY};
    memory->contraction = 0;
    for (int iteration = 0; iteration < ITERATIONS_MOST; iteration++) {
        const int status = find_missing(step, h);
        if (status)
            return status;
        struct unsettled now;
        now.missed = saturates(step) ? largest_of(step, stages_of(step).missing) : 0;
        now.correction = correct(step);
        const double part = now.correction / last.correction;
        if (now.correction == 0 || (iteration > 0 && is_settled(now.correction, last.correction, enough) &&
                                    (now.missed == 0 || is_settled(now.missed, last.missed, enough))))
            return REFDYN_OK;
        last = now;
        if (iteration > 0 && !(part < slow))
            break;
        memory->contraction = fmax(memory->contraction, part);
    }
    return is_rounding(step, h, &last) ? REFDYN_OK : REFDYN_NO_CONVERGENCE;
}

/* The state at the end. */
static void finish(struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n;
    double *q = step->state_new, *qd = q + n;
    memcpy(q, step->state, (size_t)(2 * n + 1) * sizeof *q);
    dense_add(q, h, step->state + n, n);
    refdyn_add_all(q, h * h, table->bb, table->stages, stages.now, n, n);
    refdyn_add_all(qd, h, table->b, table->stages, stages.now, n, n);
    for (int j = 0; j < table->stages; j++)
        q[2 * n] += h * table->b[j] * stages.power[j];
}

/* What the polynomial with these weights misses at the begin of the step, without what stiffness makes of it:
 * d (n, and n of room). */
static void defect(struct refdyn_step *step, const double *weights, double *d) {
    const struct refdyn_collocation_table *table = table_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n;
    memcpy(d, step->rates + n, (size_t)n * sizeof *d);
    for (int j = 0; j < table->stages; j++)
        dense_add(d, weights[j], stages.now + j * n, n);
    memset(d + n, 0, (size_t)n * sizeof *d);
    solve_for(step, 1, d);
}

/* The last stage is the end of the step, where stiff transients are damped: the next step may begin there. */
static int ends_with_stage(const struct refdyn_step *step) {
    const struct refdyn_collocation_table *table = table_of(step);
    return table->c[table->stages - 1] == 1;
}

/* That of smoothness.h. The acceleration at the begin is that of the last stage before: the equations give
 * what stiffness makes of its rounding. */
static double unsmooth_error(struct refdyn_step *step, double h) {
    const struct stages stages = stages_of(step);
    const int n = step->n, size = table_of(step)->stages * n;
    const double *first = memory_of(step)->last_h > 0 ? stages.last + size - n : step->rates + n;
    double *a = stages.missing; /* and the parts behind it */
    memcpy(a, first, (size_t)n * sizeof *a);
    memcpy(a + n, stages.now, (size_t)size * sizeof *a);
    return refdyn_unsmooth_error(step, a, h);
}

static void estimate(struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    struct memory *memory = memory_of(step);
    const int n = step->n, power = step->method->order - table->stages - 1;
    defect(step, table->e_low, step->stage);
    defect(step, table->e, step->error);
    const double low = refdyn_step_largest_change(step, step->stage, NULL);
    const double high = refdyn_step_largest_change(step, step->error, NULL);
    const double rate = low > 0 ? table->ratio * high / low / h : 0;
    memory->rate = fmax(rate, 0.9 * memory->rate);
    /* the first step may meet what it does not see: it is taken for a vibration that is not resolved */
    const double turned = memory->last_h > 0 ? fmin(memory->rate * h, resolved) : resolved;
    const double factor = h * h * table->share * pow(turned, power);
    for (int j = 0; j < n; j++) {
        step->error[j] *= factor;
        step->error[n + j] = 0;
    }
    if (saturates(step) && ends_with_stage(step))
        step->error[n] = step->units[0] * unsmooth_error(step, h) / h;
}

/* The state at t_begin + theta h of the polynomial through the accelerations as they are now. */
static void state_between(const struct refdyn_step *step, double h, double theta, double *state) {
    const struct refdyn_collocation_table *table = table_of(step);
    const struct stages stages = stages_of(step);
    const int n = step->n, s = table->stages;
    memcpy(state, step->state, (size_t)(2 * n + 1) * sizeof *state);
    dense_add(state, h * theta, step->state + n, n);
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
static int find_tangent(struct refdyn_step *step, double h) {
    if (memory_of(step)->last_h > 0) {
        state_between(step, h, 0.5, step->stage);
        const double t = refdyn_step_inside(step, step->t_begin + h / 2);
        if (!refdyn_rates(&step->evaluation, t, step->stage, step->side) &&
            !refdyn_linear_evaluate(step->linear, step->evaluation.work, t, step->stage, step->side))
            return REFDYN_OK;
    }
    return refdyn_linear_at_begin(step->linear, step->evaluation.work, step->t_begin, step->state,
                                  step->rates);
}

static int factor(struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = table_of(step);
    const int status = find_tangent(step, h);
    return status ? status
                  : refdyn_linear_factor_all(step->linear, step->evaluation.work, table->eigenvalues,
                                             table->lambda, h);
}

static int take(struct refdyn_step *step, double h) {
    const int is_kept = refdyn_linear_has_factors(step->linear, step->evaluation.work, h) &&
                        memory_of(step)->contraction <= fast;
    guess(step, h);
    int status = is_kept ? REFDYN_OK : factor(step, h);
    if (!status)
        status = solve_stages(step, h);
    if (status == REFDYN_NO_CONVERGENCE && is_kept) {
        guess(step, h);
        status = factor(step, h);
        if (!status)
            status = solve_stages(step, h);
    }
    if (status)
        return status;
    finish(step, h);
    estimate(step, h);
    return refdyn_is_finite(step->state_new, 2 * step->n) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

static int interpolate(struct refdyn_step *step, double theta, double *state) {
    state_between(step, step->t_end - step->t_begin, theta, state);
    return REFDYN_OK;
}

enum { COMPLEXES_MOST = 3 }; /* of six stages at the points of Gauss */

const struct refdyn_method_kind refdyn_collocation = {
    .controller = REFDYN_FILTER,
    .is_implicit = 1,
    .complexes = COMPLEXES_MOST,
    .ends_at_outputs = 1,
    .memory_size = memory_size,
    .begin = begin,
    .take = take,
    .interpolate = interpolate,
};
