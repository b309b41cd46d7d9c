/*
 * Local search by SLSQP of NLopt: first until no limit is exceeded, then for the least objective.
 *
 * If the start exceeds limits, the search first minimises the largest excess z under excess_i <= z. If z
 * cannot become 0, the limits contradict each other near this start. If derivatives do not exist, or if the
 * file says so, COBYLA of NLopt (Powell 1994) continues without them. A program built without NLopt says that
 * it lacks NLopt.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include <lapacke.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* An inequality is active if it is nearer to its bound than this part of its size. */
static const double active_most = 1e-6;

static int inequality_count(const struct plan *plan) {
    return 2 * plan->part_count * plan->limit_count;
}

/* ---- Multipliers ---- */

/* The gradient of the objective by x: that of the part with the largest one. */
static const double *objective_gradient(const struct plan *plan, const struct plan_point *point) {
    int worst = 0;
    for (int part = 1; part < plan->part_count; part++)
        if (point->objectives[part].value > point->objectives[worst].value)
            worst = part;
    return point->objective_by + worst * plan->count;
}

/* The gradient of an inequality, or of a bound of x, is a column of the matrix. */
struct active {
    int number; /* of the inequality; -1 - k: of a bound of x[k] */
    double sign;
    double multiplier;
};

static int list_active(const struct plan *plan, const struct plan_point *point, struct active *list) {
    int count = 0;
    for (int i = 0; i < inequality_count(plan); i++)
        if (fabs(plan_excess(plan, point, i)) < active_most)
            list[count++] = (struct active){i, i % 2 ? 1 : -1, 0};
    for (int k = 0; k < plan->count; k++)
        if (point->x[k] <= active_most || point->x[k] >= 1 - active_most)
            list[count++] = (struct active){-1 - k, point->x[k] <= active_most ? -1 : 1, 0};
    return count;
}

/* Least squares of gradient + sum of multiplier x gradient of each active inequality. */
static bool solve_multipliers(const struct plan *plan, const struct plan_point *point, struct active *list,
                              int count) {
    const int n = plan->count, rows = n > count ? n : count;
    double *A = format_allocate_matrix(n, count), *b = format_allocate_matrix(rows, 1),
           *singular = format_allocate_matrix(n + count, 1);
    const double *gradient = objective_gradient(plan, point), rank_least = 1e-9;
    lapack_int rank;
    for (int j = 0; j < count; j++)
        for (int k = 0; k < n; k++)
            A[j * n + k] = list[j].number >= 0 ? list[j].sign * point->extreme_by[list[j].number * n + k]
                                               : (k == -1 - list[j].number ? list[j].sign : 0);
    for (int k = 0; k < n; k++)
        b[k] = -gradient[k];
    if (LAPACKE_dgelsd(LAPACK_COL_MAJOR, n, count, 1, A, n, b, rows, singular, rank_least, &rank) != 0)
        return false;
    for (int j = 0; j < count; j++)
        list[j].multiplier = b[j];
    return true;
}

void plan_multipliers(const struct plan *plan, const struct plan_point *point, double *multipliers) {
    const size_t most = (size_t)inequality_count(plan) + (size_t)plan->count;
    struct active *list = format_allocate(most, sizeof *list);
    int count = list_active(plan, point, list), least = 0;
    memset(multipliers, 0, (size_t)inequality_count(plan) * sizeof *multipliers);
    /* an inequality with a negative multiplier does not act */
    while (count > 0 && point->has_gradients && solve_multipliers(plan, point, list, count)) {
        least = 0;
        for (int j = 1; j < count; j++)
            if (list[j].multiplier < list[least].multiplier)
                least = j;
        if (list[least].multiplier >= 0)
            break;
        list[least] = list[--count];
    }
    for (int j = 0; j < count; j++)
        if (list[j].number >= 0)
            multipliers[list[j].number] = fmax(list[j].multiplier, 0);
}

#ifdef REFDYN_HAS_NLOPT
#include <nlopt.h>

enum {
    EVALUATIONS_MOST = 100, /* of one run */
    IDLE_MOST = 50,         /* evaluations of a run that improve nothing */
    COBYLA_MORE = 20,       /* COBYLA may take so many times as many, since they have no gradients */
    ROUNDS_MOST = 12,
    COBYLA_ROUNDS = 40 /* along a crease each run of COBYLA moves by a part of the way only */
};

/* A run ends when x changes by less than this. A small change of the objective does not mean convergence:
 * while limits are exceeded, SLSQP may move the objective to a bound and keep it there until they hold. */
static const double x_least = 1e-9;
/* NLopt accepts points up to this excess as within the limits; half the slack of `sim`. */
static const double tolerance = 5e-10;
/* Excess of a motion that does not reach its end, so that the search returns to others. */
static const double excess_of_failure = 10;
/* First margin after a result that exceeds a limit, in the limit's size; factor of each next margin. Extremes
 * scatter by about the tolerance of the motion, because motions choose their steps. */
static const double margin_first = 4e-9, margin_grows = 8;
/* Weight of the excess in comparisons of points that exceed limits by little. */
static const double merit_weight = 100;
/* The excess is minimised again if the last run has reduced it to less than this part. */
static const double excess_falls = 0.9;
/* After a run without convergence, the radius of the next is smaller by this factor; it grows if it held the
 * last run, which it did if some change was within this part of it. */
static const double radius_falls = 0.2, radius_grows = 3, at_radius = 1e-6;
/* A run that ends farther than this from its best x has lost its way. */
static const double near_most = 1e-4;
/* Rounds end when the best point within the limits is worse than others by less than this part. */
static const double round_gain = 1e-8;

bool plan_has_optimiser(void) {
    return true;
}

enum what { MINIMISE_OBJECTIVE, MINIMISE_EXCESS, MINIMISE_LARGEST_OBJECTIVE };

/* What one search minimises. Its last unknown is z unless the objective is plain. */
struct problem {
    struct plan *plan;
    struct plan_point *point; /* the last one that was evaluated */
    struct plan_point *kept;  /* the best one within the limits */
    bool has_kept;
    double *near, merit; /* x of the best one for `what`, the excess included */
    int idle;            /* evaluations since it was found */
    double radius;       /* largest change of each x in a run */
    nlopt_opt optimiser;
    bool is_by_cobyla; /* else by SLSQP */
    enum what what;
    double margin;         /* by which limits are tightened */
    double objective_size; /* the objective is divided by it */
    bool is_new;           /* no point was evaluated yet */
};

static int unknown_count(const struct problem *problem) {
    return problem->plan->count + (problem->what != MINIMISE_OBJECTIVE);
}

static double worst_excess(const struct plan *plan, const struct plan_point *point) {
    const int worst = plan_worst(plan, point);
    return worst < 0 ? 0 : fmax(plan_excess(plan, point, worst), 0);
}

/* Keeps the point if it is the best one so far. */
static void keep(struct problem *problem) {
    const struct plan *plan = problem->plan;
    const struct plan_point *point = problem->point;
    if (!point->is_done)
        return;
    const double objective = plan_objective(plan, point), excess = worst_excess(plan, point),
                 merit = problem->what == MINIMISE_EXCESS
                             ? excess
                             : objective / problem->objective_size + merit_weight * excess;
    if (merit < problem->merit) {
        problem->idle = 0;
        problem->merit = merit;
        memcpy(problem->near, point->x, (size_t)plan->count * sizeof *point->x);
    }
    if (plan_is_feasible(plan, point) &&
        (!problem->has_kept || objective < plan_objective(plan, problem->kept))) {
        plan_point_copy(plan, point, problem->kept);
        problem->has_kept = true;
    }
}

static int evaluations_factor(const struct problem *problem) {
    return problem->is_by_cobyla ? COBYLA_MORE : 1;
}

/* Evaluates the motions at x unless that is the last point. */
static const struct plan_point *evaluate(struct problem *problem, const double *x, bool with_gradients) {
    struct plan *plan = problem->plan;
    struct plan_point *point = problem->point;
    const size_t bytes = (size_t)plan->count * sizeof *x;
    if ((system_interrupted || problem->idle > IDLE_MOST * evaluations_factor(problem)) && problem->optimiser)
        nlopt_force_stop(problem->optimiser);
    if (problem->is_new || memcmp(point->x, x, bytes) != 0) {
        problem->idle++;
        memcpy(point->x, x, bytes);
        plan_point_evaluate(plan, point);
        problem->is_new = false;
        keep(problem);
    }
    if (with_gradients && point->is_done)
        plan_point_differentiate(plan, point);
    return point;
}

static double minimised(unsigned count, const double *x, double *gradient, void *context) {
    struct problem *problem = context;
    const struct plan *plan = problem->plan;
    const bool has_z = problem->what != MINIMISE_OBJECTIVE;
    if (gradient)
        memset(gradient, 0, count * sizeof *gradient);
    if (has_z) {
        if (gradient)
            gradient[count - 1] = 1;
        return x[count - 1];
    }
    const struct plan_point *point = evaluate(problem, x, gradient != NULL);
    if (gradient && point->has_gradients)
        for (int k = 0; k < plan->count; k++)
            gradient[k] = objective_gradient(plan, point)[k] / problem->objective_size;
    return point->is_done ? plan_objective(plan, point) / problem->objective_size : excess_of_failure;
}

/* Writes inequality number i of the limits. */
static double limit_excess(const struct problem *problem, const struct plan_point *point, int i,
                           double *gradient) {
    const struct plan *plan = problem->plan;
    const struct plan_limit *limit = &plan->limits[i / 2 % plan->limit_count];
    const double excess = point->is_done ? plan_excess(plan, point, i) : excess_of_failure;
    for (int k = 0; k < plan->count && gradient && point->has_gradients; k++)
        gradient[k] = (i % 2 ? 1 : -1) * point->extreme_by[i * plan->count + k] / limit->size;
    return fmax(excess, -excess_of_failure) + problem->margin;
}

static void inequalities(unsigned rows, double *result, unsigned count, const double *x, double *gradient,
                         void *context) {
    struct problem *problem = context;
    const struct plan *plan = problem->plan;
    const int limits = inequality_count(plan);
    const double z = x[count - 1];
    const struct plan_point *point = evaluate(problem, x, gradient != NULL);
    if (gradient)
        memset(gradient, 0, rows * count * sizeof *gradient);
    for (int i = 0; i < (int)rows; i++) {
        double *row = gradient ? gradient + (size_t)i * count : NULL;
        if (i < limits) {
            const bool has_z = problem->what == MINIMISE_EXCESS;
            result[i] = limit_excess(problem, point, i, row) - (has_z ? z : 0);
            if (row && has_z)
                row[count - 1] = -1;
            continue;
        }
        const int part = i - limits;
        const double value = point->objectives[part].value;
        result[i] = !point->is_done ? excess_of_failure
                    : isnan(value)  ? -excess_of_failure
                                    : value / problem->objective_size - z;
        if (point->is_done && isnan(value)) /* this part has no objective */
            continue;
        for (int k = 0; k < plan->count && row && point->has_gradients; k++)
            row[k] = point->objective_by[part * plan->count + k] / problem->objective_size;
        if (row)
            row[count - 1] = -1;
    }
}

static void set_bounds(const struct problem *problem, double *lower, double *upper) {
    const int count = problem->plan->count;
    for (int k = 0; k < count; k++) {
        lower[k] = fmax(problem->point->x[k] - problem->radius, 0);
        upper[k] = fmin(problem->point->x[k] + problem->radius, 1);
    }
    if (problem->what == MINIMISE_OBJECTIVE)
        return;
    lower[count] = problem->what == MINIMISE_EXCESS ? 0 : -HUGE_VAL;
    upper[count] = HUGE_VAL;
}

static double first_z(const struct problem *problem) {
    const struct plan *plan = problem->plan;
    return problem->what == MINIMISE_EXCESS ? worst_excess(plan, problem->point)
                                            : plan_objective(plan, problem->point) / problem->objective_size;
}

/* Whether x is as good as the best point. */
static bool is_near(const struct problem *problem, const double *x) {
    for (int k = 0; k < problem->plan->count; k++)
        if (fabs(x[k] - problem->near[k]) > near_most)
            return false;
    return true;
}

/* Begins a run from the point, with its merit. */
static void begin(struct problem *problem, enum what what) {
    const double size = fabs(plan_objective(problem->plan, problem->point));
    problem->what = what;
    problem->objective_size = size > DBL_EPSILON ? size : 1;
    problem->merit = INFINITY;
    problem->idle = 0;
    keep(problem);
}

/* Runs NLopt from the point, which becomes the best point of the run: that of NLopt satisfies all
 * inequalities, and is the start if a run that ends by rounding misses them by little. Returns whether it has
 * converged. */
static bool run(struct problem *problem, enum what what) {
    struct plan *plan = problem->plan;
    begin(problem, what);
    const unsigned count = (unsigned)unknown_count(problem);
    const int limits = inequality_count(plan),
              rows = limits + (problem->what == MINIMISE_LARGEST_OBJECTIVE ? plan->part_count : 0);
    double *x = format_allocate(count, sizeof *x), *lower = format_allocate(count, sizeof *x),
           *upper = format_allocate(count, sizeof *x),
           *tolerances = format_allocate((size_t)rows + 1, sizeof *x), least;
    memcpy(x, problem->point->x, (size_t)plan->count * sizeof *x);
    if (problem->what != MINIMISE_OBJECTIVE)
        x[count - 1] = first_z(problem);
    for (int i = 0; i < rows; i++)
        tolerances[i] = tolerance;
    set_bounds(problem, lower, upper);
    nlopt_opt optimiser = nlopt_create(problem->is_by_cobyla ? NLOPT_LN_COBYLA : NLOPT_LD_SLSQP, count);
    problem->optimiser = optimiser;
    nlopt_set_lower_bounds(optimiser, lower);
    nlopt_set_upper_bounds(optimiser, upper);
    nlopt_set_min_objective(optimiser, minimised, problem);
    if (rows > 0)
        nlopt_add_inequality_mconstraint(optimiser, (unsigned)rows, inequalities, problem, tolerances);
    nlopt_set_xtol_abs1(optimiser, x_least);
    nlopt_set_maxeval(optimiser, EVALUATIONS_MOST * evaluations_factor(problem));
    if (problem->what == MINIMISE_EXCESS)
        nlopt_set_stopval(optimiser, 0);
    const nlopt_result result = nlopt_optimize(optimiser, x, &least);
    nlopt_destroy(optimiser);
    problem->optimiser = NULL;
    const bool has_converged =
        result > 0 && result != NLOPT_MAXEVAL_REACHED && is_near(problem, problem->point->x);
    evaluate(problem, problem->near, false);
    return has_converged;
}

/* Whether the objective is the largest of several values that depend on x in different ways. */
static bool has_several_objectives(const struct plan *plan) {
    const enum plan_measure measure = plan->file->measure;
    return measure != PLAN_PARAMETER && (measure == PLAN_LARGEST ? plan->part_count : plan->case_count) > 1;
}

/* Minimises the largest excess. Runs that end while it falls begin again, without what they have learnt about
 * its curvature. */
static void enter(struct problem *problem) {
    const struct plan *plan = problem->plan;
    const struct plan_point *point = problem->point;
    double before = INFINITY;
    for (int i = 0; i < ROUNDS_MOST && point->is_done && !plan_is_feasible(plan, point) &&
                    worst_excess(plan, point) < excess_falls * before && !system_interrupted;
         i++) {
        before = worst_excess(plan, point);
        run(problem, MINIMISE_EXCESS);
    }
}

/* Whether the radius of the last run, from x on, has kept the point from going on. */
static bool is_held(const struct problem *problem, const double *x) {
    for (int k = 0; k < problem->plan->count; k++) {
        const double now = problem->point->x[k];
        if (fabs(now - x[k]) >= problem->radius * (1 - at_radius) && now > 0 && now < 1)
            return true;
    }
    return false;
}

/* Rounds until the best point within the limits is as good as the best one overall: with growing margins, and
 * with a smaller radius after a run that lost its way. Near the least value of a limit, such as a vibration,
 * SLSQP believes in far too long steps. At a kink the simplex of COBYLA becomes flat: its runs begin again
 * while they gain something. */
static void run_rounds(struct problem *problem) {
    struct plan *plan = problem->plan;
    struct plan_point *point = problem->point;
    const size_t bytes = (size_t)plan->count * sizeof *point->x;
    double *start = format_allocate((size_t)plan->count, sizeof *start), radius = 1;
    const int most = problem->is_by_cobyla ? COBYLA_ROUNDS : ROUNDS_MOST;
    for (int i = 0; i < most && point->is_done && !system_interrupted; i++) {
        problem->radius = 1;
        enter(problem);
        if (!point->is_done || worst_excess(plan, point) > active_most)
            return;
        problem->radius = radius;
        memcpy(start, point->x, bytes);
        const double before = plan_objective(plan, point);
        const bool has_converged =
            run(problem, has_several_objectives(plan) ? MINIMISE_LARGEST_OBJECTIVE : MINIMISE_OBJECTIVE);
        const bool is_kept =
            problem->has_kept &&
            plan_objective(plan, problem->kept) / problem->objective_size <= problem->merit + round_gain;
        if (!has_converged)
            radius *= radius_falls;
        else if (is_held(problem, start))
            radius = fmin(radius * radius_grows, 1);
        else if (is_kept && !(problem->is_by_cobyla &&
                              plan_objective(plan, point) < before - round_gain * problem->objective_size))
            return;
        if (!is_kept)
            problem->margin = problem->margin > 0 ? margin_grows * problem->margin : margin_first;
    }
}

void plan_improve(struct plan *plan, struct plan_point *point) {
    struct plan_point kept;
    struct problem problem = {.plan = plan, .point = point, .kept = &kept, .is_new = true};
    plan_point_start(plan, &kept);
    problem.near = format_allocate((size_t)plan->count, sizeof *problem.near);
    problem.merit = INFINITY;
    problem.objective_size = problem.radius = 1;
    const long lost = plan->lost;
    evaluate(&problem, point->x, false);
    problem.is_by_cobyla = plan->file->is_by_cobyla;
    run_rounds(&problem);
    if (plan->lost > lost && !problem.is_by_cobyla) {
        problem.is_by_cobyla = plan->has_changed_over = true;
        run_rounds(&problem);
    }
    if (problem.has_kept)
        plan_point_copy(plan, &kept, point);
}

#else

bool plan_has_optimiser(void) {
    return false;
}

void plan_improve(struct plan *plan, struct plan_point *point) {
    plan_point_evaluate(plan, point);
}

#endif
