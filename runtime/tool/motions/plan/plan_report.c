/* The result of planning: a summary on stderr, and PLAN.json. */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* The search counts a limit as active if it is nearer to its bound than this part of its size. */
static const double active_most = 1e-6;

/* Most values in a message. */
static const int values_shown = 6;

const char *plan_values_text(const struct plan *plan, const double *x) {
    const char *text = "";
    const int shown = plan->count > values_shown ? values_shown : plan->count;
    for (int k = 0; k < shown; k++)
        text = format_text("%s%s%s = %.6g", text, k ? ", " : "", plan->values[k].name,
                           plan_value_at(plan, k, x));
    return shown < plan->count ? format_text("%s and %d more", text, plan->count - shown) : text;
}

static int case_of(const struct plan *plan, int part) {
    return part / PLAN_PARTS / plan->stretches_most;
}

/* A limit over all parts. */
struct summary_of_limit {
    double smallest, largest; /* of all parts */
    double excess, t;         /* largest excess in its size, and its time [s] */
    double multiplier;
    int one; /* the case with that excess */
};

static struct summary_of_limit summarise(const struct plan *plan, const struct plan_point *point, int limit,
                                         const double *multipliers) {
    struct summary_of_limit summary = {INFINITY, -INFINITY, -INFINITY, NAN, 0, 0};
    for (int part = 0; part < plan->part_count; part++)
        for (int side = 0; side < 2; side++) {
            const int i = 2 * (part * plan->limit_count + limit) + side;
            const double excess = plan_excess(plan, point, i);
            summary.smallest = fmin(summary.smallest, point->extremes[i].value);
            summary.largest = fmax(summary.largest, point->extremes[i].value);
            summary.multiplier += multipliers[i];
            if (excess > summary.excess) {
                summary.excess = excess;
                summary.t = point->extremes[i].t;
                summary.one = case_of(plan, part);
            }
        }
    return summary;
}

static bool is_exceeded(const struct plan_limit *limit, const struct summary_of_limit *summary) {
    return plan_is_beyond(limit, summary->smallest) || plan_is_beyond(limit, summary->largest);
}

/* ---- PLAN.json ---- */

static void put_finite(struct document *document, const char *key, double value) {
    if (isfinite(value))
        format_put_number(document, key, value);
    else
        format_put_null(document, key);
}

static void put_limits(struct document *document, const struct plan *plan, const struct plan_point *point,
                       const double *multipliers) {
    format_put_open(document, "limits", '[');
    for (int i = 0; i < plan->limit_count; i++) {
        const struct plan_limit *limit = &plan->limits[i];
        const struct summary_of_limit summary = summarise(plan, point, i, multipliers);
        format_put_open(document, NULL, '{');
        format_put_text(document, "name", limit->name);
        format_put_text(document, "column", limit->column);
        if (plan->table.units[plan->signals[limit->signal]])
            format_put_text(document, "unit", plan->table.units[plan->signals[limit->signal]]);
        format_put_number(document, "smallest", summary.smallest);
        format_put_number(document, "largest", summary.largest);
        put_finite(document, "from", limit->from);
        put_finite(document, "to", limit->to);
        put_finite(document, "t", summary.t);
        format_put_truth(document, "active", summary.excess > -active_most);
        format_put_number(document, "multiplier", summary.multiplier);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_violation(struct document *document, const struct plan *plan, const struct plan_point *point,
                          const double *multipliers) {
    format_put_open(document, "violation", '{');
    for (int i = 0; i < plan->limit_count; i++) {
        const struct summary_of_limit summary = summarise(plan, point, i, multipliers);
        if (is_exceeded(&plan->limits[i], &summary))
            format_put_number(document, plan->limits[i].name, summary.excess * plan->limits[i].size);
    }
    format_put_close(document, '}');
}

/* The values of the case in which a limit is nearest to its bound. If no limit is active, and the objective
 * is a measure of a column: of the case with the largest objective. */
static void put_worst_case(struct document *document, const struct plan *plan,
                           const struct plan_point *point) {
    const int worst = plan_worst(plan, point);
    const bool is_by_objective = worst < 0 || (plan->file->measure != PLAN_PARAMETER &&
                                               plan_excess(plan, point, worst) < -active_most);
    int part = is_by_objective ? 0 : worst / 2 / plan->limit_count;
    for (int i = 0; i < plan->part_count && is_by_objective; i++)
        part = point->objectives[i].value > point->objectives[part].value ? i : part;
    format_put_open(document, "worst_case", '{');
    for (int k = 0; k < plan->file->varied_count; k++)
        format_put_number(document, plan->file->varied[k].name,
                          plan->cases[case_of(plan, part) * plan->file->varied_count + k]);
    format_put_close(document, '}');
}

/* The end of the motion of the first case. */
static double end_of(const struct plan *plan, const struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct motions motions;
    plan_describe(plan, point->x, 1, &motions);
    const double end = motions.ends[0];
    memory_back(&format_memory, mark);
    return end;
}

static enum status write(struct plan *plan, const struct plan_result *result, const double *multipliers) {
    const struct plan_point *point = &result->best;
    struct document document;
    scene_document_open(&document);
    format_put_text(&document, "name", plan->scene->model->name);
    format_put_open(&document, "parameters", '{');
    for (int k = 0; k < plan->count; k++)
        format_put_number(&document, plan->values[k].name, plan_value_at(plan, k, point->x));
    format_put_close(&document, '}');
    format_put_number(&document, "objective", plan_objective(plan, point));
    format_put_number(&document, "t_end", end_of(plan, point));
    format_put_truth(&document, "feasible", plan_is_feasible(plan, point));
    put_violation(&document, plan, point, multipliers);
    put_limits(&document, plan, point, multipliers);
    put_worst_case(&document, plan, point);
    format_put_open(&document, "starts", '[');
    for (int i = 0; i < result->searches; i++)
        put_finite(&document, NULL, result->reached[i]);
    format_put_close(&document, ']');
    format_put_text(&document, "search",
                    plan->has_changed_over || plan->file->is_by_cobyla ? "cobyla" : "slsqp");
    format_put_whole(&document, "evaluations", plan->motions);
    plan_put_motion(plan, point, &document);
    format_put_close(&document, '}');
    return scene_finish(plan->scene, &document);
}

/* ---- The summary ---- */

static void print(const struct plan *plan, const struct plan_point *point, const double *multipliers) {
    fprintf(stderr, "%-12s %.9g at %s; %ld motions\n",
            plan->file->measure == PLAN_PARAMETER ? "least" : plan->file->objective,
            plan_objective(plan, point), plan_values_text(plan, point->x), plan->motions);
    for (int i = 0; i < plan->limit_count; i++) {
        const struct summary_of_limit summary = summarise(plan, point, i, multipliers);
        const struct plan_limit *limit = &plan->limits[i];
        if (is_exceeded(limit, &summary))
            fprintf(stderr,
                    "refdyn: %s: %s: must give way by %.6g, at t = %.6g s, or the ranges of the "
                    "values must grow\n",
                    plan->scene->model->name, limit->name, summary.excess * limit->size, summary.t);
        else if (summary.excess > -active_most)
            fprintf(stderr, "active       %s at t = %.6g s; multiplier %.4g\n", limit->name, summary.t,
                    summary.multiplier);
    }
    if (plan->lost > 0)
        fprintf(
            stderr,
            "refdyn: warning: %ld derivatives do not exist, since a slight change reorders events or ends "
            "the motion; %s\n",
            plan->lost,
            plan->has_changed_over ? "COBYLA, which needs none, continued"
                                   : "the result may not be the best");
}

enum status plan_report(struct plan *plan, struct plan_result *result) {
    double *multipliers =
        format_allocate(2 * (size_t)(plan->part_count * plan->limit_count) + 1, sizeof(double));
    if (!result->has_best) {
        if (system_interrupted)
            fprintf(stderr, "refdyn: %s: interrupted before the first result\n", plan->scene->model->name);
        else
            fprintf(stderr, "refdyn: %s: no motion reaches its end; the last one fails at t = %.6g: %s%s%s\n",
                    plan->scene->model->name, plan->failed.t, refdyn_status_text(plan->failed.status),
                    *plan->failed.refused ? ": " : "", plan->failed.refused);
        return *plan->failed.refused ? STATUS_FAULT : STATUS_NUMBERS;
    }
    plan_point_differentiate(plan, &result->best);
    if (plan_is_feasible(plan, &result->best))
        plan_multipliers(plan, &result->best, multipliers);
    print(plan, &result->best, multipliers);
    enum status status = write(plan, result, multipliers);
    if (status == STATUS_DONE)
        status = plan_write_reference(plan, &result->best);
    if (system_interrupted)
        fprintf(stderr, "refdyn: %s: interrupted; this is the best so far\n", plan->scene->model->name);
    return status != STATUS_DONE                   ? status
           : plan_is_feasible(plan, &result->best) ? STATUS_DONE
                                                   : STATUS_NUMBERS;
}
