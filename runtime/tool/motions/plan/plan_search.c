/*
 * The search for a plan: a scan of many starts by a Halton sequence, then local searches from the best ones.
 * The best starts are those within the limits, by objective; if there are none, those of least excess. The
 * excess also has local minima, so further searches follow while none has ended within the limits.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/random/random.h"
#include "runtime/tool/support/system/system.h"

/* Starts of local searches differ by at least this part of some range. */
static const double apart_least = 0.1;

/* The first start is the one of the file; values without a start are in the middle of their ranges. */
static void make_starts(const struct plan *plan, double *x, int starts) {
    random_halton(plan->count, (long)plan->file->seed, starts, x);
    for (int k = 0; k < plan->count; k++) {
        const struct plan_value *value = &plan->values[k];
        x[k] = isnan(value->start) ? 0.5 : (value->start - value->from) / (value->to - value->from);
    }
}

static bool is_better(double objective, double excess, double other_objective, double other_excess) {
    if (excess <= 0 && other_excess <= 0)
        return objective < other_objective;
    return excess < other_excess;
}

static bool is_near(const struct plan *plan, const double *a, const double *b) {
    for (int k = 0; k < plan->count; k++)
        if (fabs(a[k] - b[k]) > apart_least)
            return false;
    return true;
}

/* Chooses starts of local searches that differ enough from each other; returns their number. */
static int choose(const struct plan *plan, const double *x, const double *objectives, const double *excesses,
                  int starts, int *chosen) {
    bool *is_out = format_allocate((size_t)starts, sizeof *is_out);
    int count = 0;
    while (count < PLAN_SEARCHES_MOST) {
        int best = -1;
        for (int i = 0; i < starts; i++)
            if (!is_out[i] && !isinf(excesses[i] == -INFINITY ? 0 : excesses[i]) &&
                (best < 0 || is_better(objectives[i], excesses[i], objectives[best], excesses[best])))
                best = i;
        if (best < 0)
            break;
        chosen[count++] = best;
        for (int i = 0; i < starts; i++)
            is_out[i] = is_out[i] || is_near(plan, x + i * plan->count, x + best * plan->count);
    }
    return count;
}

static double worst_excess(const struct plan *plan, const struct plan_point *point) {
    const int worst = plan_worst(plan, point);
    return !point->is_done ? INFINITY : worst < 0 ? -INFINITY : plan_excess(plan, point, worst);
}

/* Excesses below the slack of `sim` count as 0. */
static double counted_excess(const struct plan *plan, const struct plan_point *point) {
    return plan_is_feasible(plan, point) ? 0 : worst_excess(plan, point);
}

static void keep_best(const struct plan *plan, const struct plan_point *point, struct plan_result *result) {
    const bool is_first = !result->has_best;
    if (!point->is_done)
        return;
    if (is_first || is_better(plan_objective(plan, point), counted_excess(plan, point),
                              plan_objective(plan, &result->best), counted_excess(plan, &result->best)))
        plan_point_copy(plan, point, &result->best);
    result->has_best = true;
}

/* The number of searches from `count` starts. */
static int search_count(const struct plan *plan, const struct plan_result *result, int count) {
    const bool is_found = result->has_best && plan_is_feasible(plan, &result->best);
    return is_found && count > PLAN_SEARCHES ? PLAN_SEARCHES : count;
}

static void print_scan(const struct plan *plan, const double *x, const double *objectives,
                       const double *excesses, int starts, int best) {
    int feasible = 0;
    for (int i = 0; i < starts; i++)
        feasible += excesses[i] <= 0;
    fprintf(stderr, "scan         %d starts, %d within the limits", starts, feasible);
    if (best >= 0)
        fprintf(stderr, "; best %s: %.6g", plan_values_text(plan, x + best * plan->count), objectives[best]);
    fputc('\n', stderr);
}

static void print_search(const struct plan *plan, const struct plan_point *point, const char *name) {
    if (!point->is_done && system_interrupted)
        return;
    if (!point->is_done)
        fprintf(stderr, "%-12s the motion fails at t = %.6g: %s\n", name, plan->failed.t,
                refdyn_status_text(plan->failed.status));
    else if (plan_is_feasible(plan, point))
        fprintf(stderr, "%-12s %.9g at %s\n", name, plan_objective(plan, point),
                plan_values_text(plan, point->x));
    else
        fprintf(stderr, "%-12s %s exceeds its limit by %.3g at %s\n", name,
                plan->limits[plan_worst(plan, point) / 2 % plan->limit_count].name,
                worst_excess(plan, point) *
                    plan->limits[plan_worst(plan, point) / 2 % plan->limit_count].size,
                plan_values_text(plan, point->x));
}

void plan_search(struct plan *plan, struct plan_result *result) {
    const int starts = (int)plan->file->starts;
    double *x = format_allocate_matrix(starts, plan->count), *objectives = format_allocate_matrix(starts, 1),
           *excesses = format_allocate_matrix(starts, 1);
    int chosen[PLAN_SEARCHES_MOST];
    struct plan_point point;
    plan_point_start(plan, &point);
    plan_point_start(plan, &result->best);
    make_starts(plan, x, starts);
    plan_scan(plan, x, starts, objectives, excesses);
    const int count = choose(plan, x, objectives, excesses, starts, chosen);
    print_scan(plan, x, objectives, excesses, starts, count > 0 ? chosen[0] : -1);
    if (plan->resumed) {
        memcpy(point.x, plan->resumed, (size_t)plan->count * sizeof *x);
        plan_improve(plan, &point);
        keep_best(plan, &point, result);
        print_search(plan, &point, "resume");
    }
    for (int i = 0; i < search_count(plan, result, count) && !system_interrupted; i++) {
        memcpy(point.x, x + chosen[i] * plan->count, (size_t)plan->count * sizeof *x);
        plan_improve(plan, &point);
        keep_best(plan, &point, result);
        result->reached[result->searches++] =
            plan_is_feasible(plan, &point) ? plan_objective(plan, &point) : NAN;
        print_search(plan, &point, format_text("search %d", i + 1));
        system_progress_show(&plan->progress, fmin((i + 1.0) / search_count(plan, result, count), 1));
    }
}
