/*
 * One step of a collocation method, for one motion or for several side by side.
 *
 * The accelerations of all stages are found by Newton's iteration (Hairer and Wanner, Solving ODEs II, IV.8):
 * the eigenvalues lambda_k of a_ij part it into systems of n coordinates and their rows, each with the matrix
 * of linearisation.h for g = lambda_k h. It starts from the polynomial of the step before, continued; each
 * motion ends its own iteration. Formulas in collocation.h; what a file that includes this defines:
 * step_arrays.h.
 */
#ifndef REFDYN_COLLOCATION_STEP_H
#define REFDYN_COLLOCATION_STEP_H

#include "methods/collocation.h"
#include "methods/step_arrays.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linear/dense.h"

/* Of Newton's iteration; of Picard's, whose corrections may fall slowly. */
enum { ITERATIONS_MOST = 12, PICARD_MOST = 50 };

/* Newton ends when what is left changes no velocity by more than this part of the tolerance, per second:
 * errors of slow motions add up over many steps. */
static const double settled_part = 0.005;
/* Where corrections no longer fall, rounding is met, if they move no position by more than this. */
static const double stalled = 1e-11;
/* The same of a guided step: tolerances, and no less than this. Rounding is that of rows that say little at
 * the last stage, whose weight in a position is 0.003 at the points of Gauss. */
static const double stalled_guided = 30, stalled_guided_least = 1e-8;
/* The same where forces saturate, of rates: units in the last place of the largest one. */
static const double stalled_rate = 64 * DBL_EPSILON;
/* A correction must fall below this part of the one before, else a smaller step is needed. */
static const double slow = 0.5;
/* Factors are used again while each correction falls below this part of the one before. */
static const double fast = 0.1;
/* A step that is a smaller part of the time than this is none to continue. */
static const double least_part = 1e-12;
/* A vibration of more than so many radians a step is not resolved: its error is that of its size. */
static const double resolved = 10;

/* What a motion keeps from step to step, then arrays (stages x n), struct stages. */
struct collocation_memory {
    double tried_t, tried_h; /* begin and length of the last attempt; INFINITY: there is none, */
    double last_h;           /* length of the last step, 0: there is none, */
    double rate;             /* fastest vibration that the error estimate has met lately [1/s] */
    double contraction;      /* how fast the last iteration converged */
    double arrays[];
};

static inline struct collocation_memory *memory_of(const struct refdyn_step *step) {
    return (struct collocation_memory *)(void *)step->memory;
}

/* Accelerations of the last step, of this one; what they miss, later their correction, and the same in parts
 * of the matrix's eigenvectors; power at the stages. */
struct NAMED(stages) {
    LANE *last, *now, *missing, *parts, *power;
};

static inline struct NAMED(stages) NAMED(arrays_of_stages)(const struct refdyn_collocation_table *table,
                                                           const struct NAMED(arrays) * arrays) {
    LANE *first = arrays->memory;
    const int size = table->stages * arrays->n;
    return (struct NAMED(stages)){first, first + size, first + 2 * size, first + 3 * size, first + 4 * size};
}

/* What a step asks for: rates, and refdyn_linear_solve_all; without that (NULL) the accelerations are taken
 * as they come from the states, Picard's iteration. */
struct NAMED(collocation_needs) {
    NAMED(stage_rates) * find;
    void (*solve)(void *context, int count, const double *lambda, LANE *x);
    void *context;
};

/* A step that is being taken. */
struct NAMED(collocation) {
    const struct refdyn_collocation_table *table;
    struct NAMED(arrays) arrays;
    struct NAMED(stages) stages;
    const double *units; /* (n) struct refdyn_step */
    LANE h, last_h;      /* of this step, and of the one that it continues; 0: none [s] */
    int sees_missed;     /* iterations end by what the stages miss, too */
    struct NAMED(collocation_needs) needs;
};

/* ---- The first guess ---- */

/* A motion's last attempt became a step, or it did not; another one of h begins. */
static inline void begin_attempt(const struct refdyn_step *step, double h) {
    const struct refdyn_collocation_table *table = step->method->table;
    struct collocation_memory *memory = memory_of(step);
    const int size = table->stages * step->n;
    if (memory->tried_t < step->t_begin) {
        memcpy(memory->arrays, memory->arrays + size, (size_t)size * sizeof(double));
        memory->last_h = memory->tried_h;
        if (memory->last_h <
            least_part * fabs(step->t_begin)) /* between two times that rounding tells apart */
            memory->last_h = memory->rate = 0;
    }
    memory->tried_t = step->t_begin;
    memory->tried_h = h;
}

/* Weight of node j among those that are continued, at theta. */
INLINE LANE NAMED(continuation)(const struct refdyn_collocation_table *table, int j, LANE theta) {
    LANE value = NAMED(every)(1);
    for (int k = table->stages - table->continued; k < table->stages; k++)
        if (k != j)
            value *= (theta - table->c[k]) / (table->c[j] - table->c[k]);
    return value;
}

/* y += s x */
INLINE void NAMED(add_vector)(LANE *restrict y, LANE s, const LANE *restrict x, int count) {
    for (int j = 0; j < count; j++)
        y[j] += s * x[j];
}

/* The polynomial of the last step, of last_h, continued; without one the accelerations at the begin:
 * (stages x n). */
INLINE void NAMED(guess)(const struct NAMED(collocation) * step, LANE *guessed) {
    const struct refdyn_collocation_table *table = step->table;
    const int n = step->arrays.n, s = table->stages;
    const MASK has_last = step->last_h > NAMED(every)(0);
    for (int i = 0; i < s; i++) {
        LANE *a = guessed + i * n;
        memset(a, 0, (size_t)n * sizeof *a);
        for (int j = s - table->continued; j < s; j++)
            NAMED(add_vector)
        (a, NAMED(continuation)(table, j, 1 + table->c[i] * step->h / step->last_h),
         step->stages.last + j * n, n);
        for (int j = 0; j < n; j++)
            a[j] = NAMED(select)(has_last, a[j], step->arrays.rates[n + j]);
    }
}

/* ---- Newton's iteration ---- */

/* State of stage i. */
static inline void NAMED(stage_state)(const struct NAMED(collocation) * step, int i) {
    const struct refdyn_collocation_table *table = step->table;
    const struct NAMED(arrays) *arrays = &step->arrays;
    const int n = arrays->n, s = table->stages;
    LANE *q = arrays->stage, *qd = arrays->stage + n;
    memcpy(q, arrays->state, (size_t)(2 * n + 1) * sizeof *q);
    NAMED(add_vector)(q, step->h * table->c[i], arrays->state + n, n);
    ADD_ALL(q, step->h * step->h, table->aa + i * s, s, step->stages.now, n, n);
    ADD_ALL(qd, step->h, table->a + i * s, s, step->stages.now, n, n);
}

/* What the stages' accelerations miss: a - those of their states. */
static inline int NAMED(find_missing)(const struct NAMED(collocation) * step) {
    const struct refdyn_collocation_table *table = step->table;
    const int n = step->arrays.n;
    LANE *found = step->arrays.side;
    for (int i = 0; i < table->stages; i++) {
        NAMED(stage_state)(step, i);
        const int status = step->needs.find(step->needs.context, table->c[i], step->arrays.stage, found);
        if (status)
            return status;
        step->stages.power[i] = found[2 * n];
        for (int j = 0; j < n; j++)
            step->stages.missing[i * n + j] = step->stages.now[i * n + j] - found[n + j];
    }
    return 0;
}

/* y_i = scale sum_j matrix_ij x_j of vectors, one for each stage. */
static inline void NAMED(combine_stages)(const struct NAMED(collocation) * step, double scale,
                                         const double *matrix, const LANE *x, LANE *y) {
    const int n = step->arrays.n, s = step->table->stages;
    memset(y, 0, (size_t)(s * n) * sizeof *y);
    for (int i = 0; i < s; i++)
        ADD_ALL(y + i * n, NAMED(every)(scale), matrix + i * s, s, x, n, n);
}

/* Largest entry of a vector in the units, or what is given. */
INLINE LANE NAMED(largest_change)(const struct NAMED(collocation) * step, const LANE *x, LANE largest) {
    for (int j = 0; j < step->arrays.n; j++)
        largest = NAMED(larger)(largest, NAMED(size)(x[j]) / step->units[j]);
    return largest;
}

/* Largest entry of vectors, one for each stage. */
static inline LANE NAMED(largest_of_stages)(const struct NAMED(collocation) * step, const LANE *x) {
    LANE largest = NAMED(every)(0);
    for (int i = 0; i < step->table->stages; i++)
        largest = NAMED(largest_change)(step, x + i * step->arrays.n, largest);
    return largest;
}

/* One Newton correction of the accelerations of the motions that wait for it; its largest entry. */
INLINE LANE NAMED(correct)(const struct NAMED(collocation) * step, MASK waits) {
    const struct refdyn_collocation_table *table = step->table;
    const struct NAMED(stages) *stages = &step->stages;
    const int n = step->arrays.n, s = table->stages;
    if (step->needs.solve) {
        NAMED(combine_stages)(step, -1, table->left, stages->missing, stages->parts);
        step->needs.solve(step->needs.context, table->eigenvalues, table->lambda, stages->parts);
        NAMED(combine_stages)(step, 1, table->right, stages->parts, stages->missing);
    }
    for (int j = 0; j < s * n && !step->needs.solve; j++)
        stages->missing[j] = -stages->missing[j];
    for (int j = 0; j < s * n; j++)
        stages->now[j] = NAMED(select)(waits, stages->now[j] + stages->missing[j], stages->now[j]);
    return NAMED(largest_of_stages)(step, stages->missing);
}

/* What iterations have still to settle: corrections of the accelerations and, where forces saturate, what the
 * stages miss: the matrix of what rests makes corrections small of what is not. */
struct unsettled {
    double correction, missed;
};

/* The iteration of one motion. */
struct iteration {
    int waits;  /* for another correction */
    int status; /* OK, NO_CONVERGENCE */
    int most;   /* corrections */
    double enough;
    double rounding; /* a correction that no longer falls is rounding below this */
    struct unsettled last;
    double contraction;
};

static inline void begin_iteration(struct iteration *iteration, const struct refdyn_step *step, double h) {
    const double guided = fmax(stalled_guided * step->tolerance, stalled_guided_least);
    *iteration = (struct iteration){.waits = 1,
                                    .most = ITERATIONS_MOST,
                                    .enough = settled_part * refdyn_settled_tolerance(step->tolerance) / h,
                                    .rounding = (step->guide ? guided : stalled) / (h * h),
                                    .last = {INFINITY, INFINITY}};
}

/* Where forces saturate: a short step is one that friction has cut short, and its velocities last; what is
 * rounding, the rates tell. */
static inline void begin_with_friction(struct iteration *iteration, const struct refdyn_step *step,
                                       double h) {
    iteration->enough *= fmin(h, 1);
    iteration->rounding = stalled_rate * refdyn_step_largest_change(step, step->state + step->n, NULL) / h;
}

/* A value falls from one iteration to the next: is what is left of it small enough? */
static inline int has_settled(double now, double last, double enough) {
    const double part = now / last;
    return now * part <= enough * (1 - part);
}

/* Correction number `count` was made. */
static inline void judge_correction(struct iteration *iteration, int count, struct unsettled now) {
    const struct unsettled last = iteration->last;
    const double part = now.correction / last.correction;
    const int is_slow = count > 0 && !(part < slow),
              is_settled = now.correction == 0 ||
                           (count > 0 && has_settled(now.correction, last.correction, iteration->enough) &&
                            (now.missed == 0 || has_settled(now.missed, last.missed, iteration->enough)));
    if (!is_settled && !is_slow)
        iteration->contraction = fmax(iteration->contraction, part);
    iteration->last = now;
    iteration->waits = !is_settled && !is_slow && count + 1 < iteration->most;
    if (!iteration->waits)
        iteration->status =
            is_settled || now.correction <= iteration->rounding ? REFDYN_OK : REFDYN_NO_CONVERGENCE;
}

/* Accelerations of all stages of the motions that wait. Returns the status of rates that fail. */
static inline int NAMED(solve_stages)(const struct NAMED(collocation) * step, struct iteration *iterations) {
    for (int count = 0;; count++) {
        MASK waits;
        int is_waiting = 0;
        for (int lane = 0; lane < LANES; lane++) {
            OF_LANE(waits, lane) = iterations[lane].waits ? -1 : 0;
            is_waiting |= iterations[lane].waits;
        }
        if (!is_waiting)
            return 0;
        const int status = NAMED(find_missing)(step);
        if (status)
            return status;
        LANE missed = NAMED(every)(0);
        if (step->sees_missed)
            missed = NAMED(largest_of_stages)(step, step->stages.missing);
        LANE correction = NAMED(correct)(step, waits);
        for (int lane = 0; lane < LANES; lane++)
            if (iterations[lane].waits)
                judge_correction(&iterations[lane], count,
                                 (struct unsettled){OF_LANE(correction, lane), OF_LANE(missed, lane)});
    }
}

/* ---- The state at the end, its error, and between ---- */

static inline void NAMED(finish)(const struct NAMED(collocation) * step) {
    const struct refdyn_collocation_table *table = step->table;
    const struct NAMED(arrays) *arrays = &step->arrays;
    const int n = arrays->n;
    LANE *q = arrays->state_new, *qd = q + n;
    memcpy(q, arrays->state, (size_t)(2 * n + 1) * sizeof *q);
    NAMED(add_vector)(q, step->h, arrays->state + n, n);
    ADD_ALL(q, step->h * step->h, table->bb, table->stages, step->stages.now, n, n);
    ADD_ALL(qd, step->h, table->b, table->stages, step->stages.now, n, n);
    for (int j = 0; j < table->stages; j++)
        q[2 * n] += step->h * table->b[j] * step->stages.power[j];
}

/* What the polynomial with these weights misses at the begin of the step, without what stiffness makes of it:
 * d (n, and n of room). Returns its largest entry. */
static inline LANE NAMED(defect)(const struct NAMED(collocation) * step, const double *weights, LANE *d) {
    const int n = step->arrays.n;
    memcpy(d, step->arrays.rates + n, (size_t)n * sizeof *d);
    for (int j = 0; j < step->table->stages; j++)
        NAMED(add_vector)(d, NAMED(every)(weights[j]), step->stages.now + j * n, n);
    memset(d + n, 0, (size_t)n * sizeof *d);
    if (step->needs.solve)
        step->needs.solve(step->needs.context, 1, step->table->lambda, d);
    return NAMED(largest_change)(step, d, NAMED(every)(0));
}

/* By what the defect of a motion, `high` beside `low` of one abscissa less, is multiplied to be its error. */
static inline double error_factor(const struct refdyn_step *step, double h, double low, double high) {
    const struct refdyn_collocation_table *table = step->method->table;
    struct collocation_memory *memory = memory_of(step);
    const int power = step->method->order - table->stages - 1;
    const double rate = low > 0 ? table->ratio * high / low / h : 0;
    memory->rate = fmax(rate, 0.9 * memory->rate);
    /* the first step may meet what it does not see: it is taken for a vibration that is not resolved */
    const double turned = memory->last_h > 0 ? fmin(memory->rate * h, resolved) : resolved;
    return h * h * table->share * pow(turned, power);
}

/* Of motions, which may be NULL. */
static inline void NAMED(estimate_by_defect)(const struct NAMED(collocation) * step,
                                             const struct refdyn_step *const *motions) {
    const int n = step->arrays.n;
    LANE *error = step->arrays.error, h = step->h, factor = NAMED(every)(0),
         low = NAMED(defect)(step, step->table->e_low, step->arrays.stage),
         high = NAMED(defect)(step, step->table->e, error);
    for (int lane = 0; lane < LANES; lane++)
        if (motions[lane])
            OF_LANE(factor, lane) =
                error_factor(motions[lane], OF_LANE(h, lane), OF_LANE(low, lane), OF_LANE(high, lane));
    for (int j = 0; j < n; j++) {
        error[j] *= factor;
        error[n + j] = NAMED(every)(0);
    }
}

/* The state at t_begin + theta h of the polynomial through the accelerations as they are now. */
static inline void NAMED(state_between)(const struct NAMED(collocation) * step, double theta, LANE *state) {
    const struct refdyn_collocation_table *table = step->table;
    const int n = step->arrays.n, s = table->stages;
    const LANE h = step->h;
    memcpy(state, step->arrays.state, (size_t)(2 * n + 1) * sizeof *state);
    NAMED(add_vector)(state, h * theta, step->arrays.state + n, n);
    for (int j = 0; j < s; j++) {
        double once = 0, twice = 0;
        for (int k = s - 1; k >= 0; k--) {
            once = (once + table->lagrange[j * s + k] / (k + 1)) * theta;
            twice = (twice + table->lagrange[j * s + k] / ((k + 1) * (k + 2))) * theta;
        }
        NAMED(add_vector)(state, h * h * theta * twice, step->stages.now + j * n, n);
        NAMED(add_vector)(state + n, h * once, step->stages.now + j * n, n);
        state[2 * n] += h * once * step->stages.power[j];
    }
}

#endif
