/*
 * Implicit steps of LANES motions: the tangent, its factors, and the kinds of methods that use them.
 *
 * Part of lanes_step.h. A step of which the tangent or a matrix is no good is left to its motion.
 */
#include "implicit/linearisation_lanes.h"
#include "methods/collocation_step.h"
#include "methods/rosenbrock_step.h"

static struct NAMED(linear) NAMED(linear_of)(const struct lanes *lanes, int number) {
    const struct refdyn_model *model = lanes->model->model;
    const struct lanes_linear *arrays = &lanes->linear[number];
    const int n = model->n, m = model->m, size = n + m;
    struct NAMED(linear)
        linear = {.n = n,
                  .m = m,
                  .size = size,
                  .real = {size, NAMED(lanes_of)(arrays->real), arrays->pivots, arrays->moves},
                  .side = NAMED(lanes_of)(lanes->linear_room),
                  .directions = NAMED(lanes_of)(lanes->directions)};
    linear.x = linear.side + n;
    linear.scale = linear.x + 2 * size;
    NAMED(set_tangent)(&linear, NAMED(lanes_of)(arrays->tangent));
    for (int k = 0; k < REFDYN_COMPLEXES_MOST; k++)
        linear.complex[k] =
            (struct NAMED(factors)){size, NAMED(lanes_of)(arrays->complexes) + k * 2 * size * size,
                                    arrays->pivots + (k + 1) * size * LANES, arrays->moves + (k + 1) * size};
    return linear;
}

/* At lanes->t; `rates` has its rates, and multipliers behind them. */
static void NAMED(find_tangent)(const struct NAMED(taking) * taking, const LANE *state, const LANE *rates,
                                struct NAMED(linear) * linear) {
    const struct lanes *lanes = taking->lanes;
    lanes->model->tangent(lanes->p, lanes->x, lanes->t, (const double *)state, (const double *)rates,
                          (double *)linear->tangent);
}

/* Steps of motions that a matrix does not serve are left to them. */
INLINE void NAMED(leave_singular)(struct NAMED(taking) * taking, MASK is_regular) {
    for (int lane = 0; lane < LANES; lane++)
        if (!is_regular[lane])
            taking->steps[lane].status = REFDYN_LEFT_TO_MOTION;
}

/* ---- Rosenbrock methods ---- */

/* What their stages and solutions are found with. */
struct NAMED(stepping) {
    struct NAMED(taking) * taking;
    struct NAMED(linear) * linear;
    struct iteration *iterations; /* of collocation; NULL: none */
};

static int NAMED(find_increment_rates)(void *context, double c, LANE *stage, LANE *rates) {
    const struct NAMED(stepping) *stepping = context;
    return NAMED(find_stage)(stepping->taking, c, stage, rates);
}

static void NAMED(solve_increment)(void *context, const LANE *right_q, const LANE *right_v, double part,
                                   LANE *dq, LANE *dqd) {
    const struct NAMED(stepping) *stepping = context;
    NAMED(solve_linear)(stepping->linear, right_q, right_v, part * stepping->taking->h, dq, dqd);
}

static void NAMED(take_by_rosenbrock)(struct NAMED(taking) * taking) {
    const struct refdyn_rosenbrock_table *table = taking->method->table;
    struct NAMED(linear) linear = NAMED(linear_of)(taking->lanes, 0);
    struct NAMED(stepping) stepping = {taking, &linear, NULL};
    const struct NAMED(rosenbrock_needs)
        needs = {NAMED(find_increment_rates), NAMED(solve_increment), &stepping};
    *NAMED(lanes_of)(taking->lanes->t) = taking->t_begin;
    NAMED(find_tangent)(taking, taking->arrays.state, taking->arrays.rates, &linear);
    NAMED(leave_singular)(taking, NAMED(factor_real)(&linear, table->gamma * taking->h));
    NAMED(take_rosenbrock)(table, &taking->arrays, taking->h, &needs);
    taking->arrays.state_new[2 * taking->n] = taking->arrays.state[2 * taking->n];
    if (taking->method->projects_by_matrix)
        NAMED(find_directions)(&linear);
    for (int lane = 0; lane < LANES; lane++)
        if (taking->steps[lane].motion) {
            struct refdyn_motion *motion = taking->steps[lane].motion;
            motion->work->evaluations += table->stages - 1;
            refdyn_linear_count(&motion->linear, 1, 1, table->stages);
            taking->lanes->has_factors[lane] = 0;
        }
}

/* ---- Collocation methods ---- */

static int NAMED(find_stage_rates)(void *context, double c, LANE *stage, LANE *rates) {
    const struct NAMED(stepping) *stepping = context;
    for (int lane = 0; lane < LANES; lane++)
        if (stepping->iterations[lane].waits)
            stepping->taking->steps[lane].motion->work->evaluations++;
    return NAMED(find_stage)(stepping->taking, c, stage, rates);
}

/* Those that no longer iterate ask for their error. */
static void NAMED(solve_changes)(void *context, int count, const double *lambda, LANE *x) {
    const struct NAMED(stepping) *stepping = context;
    int is_iterating = 0;
    for (int lane = 0; lane < LANES; lane++)
        is_iterating |= stepping->iterations[lane].waits;
    for (int lane = 0; lane < LANES; lane++) {
        struct refdyn_motion *motion = stepping->taking->steps[lane].motion;
        if (motion && (stepping->iterations[lane].waits || !is_iterating))
            refdyn_linear_count(&motion->linear, 0, 0, refdyn_linear_weight(&motion->linear, count, lambda));
    }
    NAMED(solve_all)(stepping->linear, count, lambda, x);
}

static void NAMED(unload_stages)(const struct NAMED(taking) * taking, int lane) {
    const struct refdyn_step *step = &taking->steps[lane].motion->step;
    const struct refdyn_collocation_table *table = step->method->table;
    struct collocation_memory *memory = memory_of(step);
    const int n = taking->n, s = table->stages, size = s * n;
    const double *stages = taking->lanes->stages;
    NAMED(scatter)(memory->arrays + size, stages + size * LANES, lane, size);      /* now */
    NAMED(scatter)(memory->arrays + 4 * size, stages + 4 * size * LANES, lane, s); /* power */
}

/* The tangent in the middle of the step, or without a step before at its begin (collocation.c). */
static void NAMED(find_middle_tangent)(struct NAMED(taking) * taking,
                                       const struct NAMED(collocation) * collocation,
                                       struct NAMED(linear) * linear) {
    struct lanes *lanes = taking->lanes;
    const struct NAMED(arrays) *arrays = &taking->arrays;
    const MASK has_last = collocation->last_h > NAMED(every)(0);
    NAMED(state_between)(collocation, 0.5, arrays->stage);
    NAMED(set_stage_times)(taking, 0.5);
    *NAMED(lanes_of)(lanes->t) = NAMED(select)(has_last, *NAMED(lanes_of)(lanes->t), taking->t_begin);
    for (int i = 0; i < arrays->size; i++)
        arrays->stage[i] = NAMED(select)(has_last, arrays->stage[i], arrays->state[i]);
    NAMED(find_rates)(taking, arrays->stage, arrays->side);
    for (int i = 0; i < arrays->rates_size; i++)
        arrays->side[i] = NAMED(select)(has_last, arrays->side[i], arrays->rates[i]);
    NAMED(find_tangent)(taking, arrays->stage, arrays->side, linear);
}

static MASK NAMED(factor_all)(const struct NAMED(taking) * taking,
                              const struct refdyn_collocation_table *table, struct NAMED(linear) * linear) {
    MASK is_regular = NAMED(every)(0) == NAMED(every)(0);
    for (int k = 0; k < table->eigenvalues; k++) {
        const LANE re = taking->h * table->lambda[2 * k], im = taking->h * table->lambda[2 * k + 1];
        is_regular &= table->lambda[2 * k + 1] == 0 ? NAMED(factor_real)(linear, re)
                                                    : NAMED(factor_complex)(linear, k, re, im);
    }
    return is_regular;
}

INLINE void NAMED(copy_where)(MASK where, const LANE *from, int count, LANE *to) {
    for (int i = 0; i < count; i++)
        to[i] = NAMED(select)(where, from[i], to[i]);
}

INLINE void NAMED(copy_factors)(MASK where, int is_complex, const struct NAMED(factors) * from,
                                struct NAMED(factors) * to) {
    NAMED(copy_where)(where, from->matrix, from->n * from->n * (is_complex ? 2 : 1), to->matrix);
    for (int k = 0; k < from->n; k++) {
        for (int lane = 0; lane < LANES; lane++)
            if (where[lane])
                to->pivot[k * LANES + lane] = from->pivot[k * LANES + lane];
        to->moves[k] |= from->moves[k];
    }
}

/* The new factors become those in use, of the motions that have none to keep. */
INLINE void NAMED(take_fresh)(struct lanes *lanes, const struct refdyn_collocation_table *table,
                              MASK is_fresh) {
    struct NAMED(linear) fresh = NAMED(linear_of)(lanes, 1), kept = NAMED(linear_of)(lanes, 0);
    int keeps = 0;
    for (int lane = 0; lane < LANES; lane++)
        keeps |= !is_fresh[lane] && lanes->has_factors[lane];
    if (!keeps) {
        const struct lanes_linear before = lanes->linear[0];
        lanes->linear[0] = lanes->linear[1];
        lanes->linear[1] = before;
        return;
    }
    NAMED(copy_where)(is_fresh, fresh.tangent, NAMED(tangent_size)(kept.n, kept.m), kept.tangent);
    for (int k = 0; k < table->eigenvalues; k++) {
        const int is_complex = table->lambda[2 * k + 1] != 0;
        NAMED(copy_factors)
        (is_fresh, is_complex, is_complex ? &fresh.complex[k] : &fresh.real,
         is_complex ? &kept.complex[k] : &kept.real);
    }
}

/* New factors of the motions that iterate; counts what they take. */
static void NAMED(factor_anew)(struct NAMED(taking) * taking, const struct NAMED(collocation) * collocation,
                               const struct iteration *iterations) {
    struct lanes *lanes = taking->lanes;
    const struct refdyn_collocation_table *table = collocation->table;
    struct NAMED(linear) fresh = NAMED(linear_of)(lanes, 1);
    MASK is_fresh = NAMED(every)(0) != NAMED(every)(0);
    NAMED(find_middle_tangent)(taking, collocation, &fresh);
    const MASK is_regular = NAMED(factor_all)(taking, table, &fresh);
    for (int lane = 0; lane < LANES; lane++) {
        struct lane_step *one = &taking->steps[lane];
        if (!iterations[lane].waits)
            continue;
        is_fresh[lane] = -1;
        one->motion->work->evaluations += collocation->last_h[lane] > 0;
        refdyn_linear_count(&one->motion->linear, 1,
                            refdyn_linear_weight(&one->motion->linear, table->eigenvalues, table->lambda), 0);
        if (!is_regular[lane])
            one->status = REFDYN_LEFT_TO_MOTION;
    }
    NAMED(take_fresh)(lanes, table, is_fresh);
    for (int lane = 0; lane < LANES; lane++)
        if (iterations[lane].waits) {
            lanes->has_factors[lane] = 1;
            refdyn_linear_mark_factors(&taking->steps[lane].motion->linear, taking->steps[lane].motion->work,
                                       taking->h[lane]);
        }
}

/* Corrects the accelerations of the motions that wait, by new factors where they keep none. */
static void NAMED(iterate)(struct NAMED(taking) * taking, const struct NAMED(collocation) * collocation,
                           struct iteration *iterations, const int *is_kept) {
    struct NAMED(stepping) *stepping = collocation->needs.context;
    struct iteration fresh[LANES];
    int is_wanted = 0;
    for (int lane = 0; lane < LANES; lane++) {
        if (iterations[lane].waits)
            begin_iteration(&iterations[lane], &taking->steps[lane].motion->step, taking->h[lane]);
        fresh[lane].waits = iterations[lane].waits && !is_kept[lane];
        is_wanted |= fresh[lane].waits;
    }
    if (is_wanted)
        NAMED(factor_anew)(taking, collocation, fresh);
    *stepping->linear = NAMED(linear_of)(taking->lanes, 0);
    NAMED(solve_stages)(collocation, iterations);
}

/* Once more with new factors, where those that were kept did not do. */
static void NAMED(iterate_again)(struct NAMED(taking) * taking, const struct NAMED(collocation) * collocation,
                                 struct iteration *iterations, int *is_kept) {
    const int count = collocation->table->stages * taking->n;
    MASK again = NAMED(every)(0) != NAMED(every)(0);
    int is_wanted = 0;
    for (int lane = 0; lane < LANES; lane++) {
        const int fails = is_kept[lane] && iterations[lane].status == REFDYN_NO_CONVERGENCE;
        again[lane] = fails ? -1 : 0;
        is_wanted |= fails;
    }
    if (!is_wanted)
        return;
    NAMED(guess)(collocation, collocation->stages.missing);
    NAMED(copy_where)(again, collocation->stages.missing, count, collocation->stages.now);
    for (int lane = 0; lane < LANES; lane++) {
        iterations[lane].waits = again[lane] != 0;
        is_kept[lane] &= !iterations[lane].waits;
    }
    NAMED(iterate)(taking, collocation, iterations, is_kept);
}

/* What each motion keeps of its last step. */
static LANE NAMED(load_stages)(struct NAMED(taking) * taking, struct iteration *iterations, int *is_kept) {
    struct lanes *lanes = taking->lanes;
    LANE last_h = NAMED(every)(0);
    for (int lane = 0; lane < LANES; lane++) {
        struct refdyn_motion *motion = taking->steps[lane].motion;
        iterations[lane] = (struct iteration){.waits = motion != NULL};
        is_kept[lane] = 0;
        if (!motion)
            continue;
        const struct refdyn_step *step = &motion->step;
        const struct refdyn_collocation_table *table = step->method->table;
        const double h = taking->h[lane];
        is_kept[lane] = lanes->has_factors[lane] &&
                        refdyn_linear_has_factors(&motion->linear, motion->work, h) &&
                        memory_of(step)->contraction <= fast;
        begin_attempt(step, h);
        last_h[lane] = memory_of(step)->last_h;
        NAMED(gather)(lanes->stages, memory_of(step)->arrays, lane, table->stages * step->n);
    }
    return last_h;
}

/* Sets how each iteration ended, and lists the motions whose step has a meaningful error. */
static void NAMED(conclude)(struct NAMED(taking) * taking, const struct iteration *iterations,
                            const struct refdyn_step **motions) {
    for (int lane = 0; lane < LANES; lane++) {
        struct lane_step *one = &taking->steps[lane];
        motions[lane] = NULL;
        if (!one->motion)
            continue;
        memory_of(&one->motion->step)->contraction = iterations[lane].contraction;
        if (!one->status)
            one->status =
                isfinite(iterations[lane].last.correction) ? iterations[lane].status : REFDYN_LEFT_TO_MOTION;
        motions[lane] = one->status ? NULL : &one->motion->step;
    }
}

static void NAMED(take_by_collocation)(struct NAMED(taking) * taking) {
    struct NAMED(linear) linear;
    struct iteration iterations[LANES];
    int is_kept[LANES];
    const struct refdyn_step *motions[LANES];
    struct NAMED(stepping) stepping = {taking, &linear, iterations};
    struct NAMED(collocation)
        collocation = {.table = taking->method->table,
                       .arrays = taking->arrays,
                       .units = NULL,
                       .h = taking->h,
                       .needs = {NAMED(find_stage_rates), NAMED(solve_changes), &stepping}};
    collocation.stages = NAMED(arrays_of_stages)(collocation.table, &collocation.arrays);
    collocation.last_h = NAMED(load_stages)(taking, iterations, is_kept);
    for (int lane = 0; lane < LANES; lane++) {
        const struct refdyn_motion *motion = taking->steps[lane].motion;
        collocation.units = motion ? motion->step.units : collocation.units;
    }
    NAMED(guess)(&collocation, collocation.stages.now);
    NAMED(iterate)(taking, &collocation, iterations, is_kept);
    NAMED(iterate_again)(taking, &collocation, iterations, is_kept);
    if (taking->method->projects_by_matrix)
        NAMED(find_directions)(&linear);
    NAMED(finish)(&collocation);
    NAMED(conclude)(taking, iterations, motions);
    NAMED(estimate_by_defect)(&collocation, motions);
}
