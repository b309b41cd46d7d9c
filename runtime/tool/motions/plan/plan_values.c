/*
 * Values of a plan: extremes of the limits in each stretch of a motion, objectives, and what they say of a
 * point x.
 *
 * A free motion of each case locates the extremes within its steps, as `sim` does. The scan compares many
 * points by extremes of their outputs alone.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

enum { SCAN_OUTPUTS = 200 /* of each motion of the scan */ };

/* Smaller excesses at the end, as a part of the limit's size, are rounding: equal bounds, which prescribe a
 * value there, leave a range without width. */
static const double end_slack = 1e-9;

/* ---- A free motion ---- */

/* The bounds whose extremes the motion locates: those of limits over time, then an objective rd.largest. */
static int list_bounds(const struct plan *plan, struct record_bound *bounds, int *limit_of) {
    int count = 0;
    for (int i = 0; i < plan->limit_count; i++)
        if (!plan->limits[i].is_at_end) {
            limit_of[count] = i;
            bounds[count++] = (struct record_bound){plan->limits[i].name, plan->limits[i].column,
                                                    plan->limits[i].from, plan->limits[i].to};
        }
    if (plan->file->measure == PLAN_LARGEST) {
        limit_of[count] = -1;
        bounds[count++] =
            (struct record_bound){plan->file->objective, plan->file->objective, -INFINITY, INFINITY};
    }
    return count;
}

/* Takes the values at both ends of a stretch and the extremes between them, which have three parts. */
static void take_extremes(struct plan *plan, struct plan_point *point, int part, const double *ends,
                          const struct record_limits *limits, const int *limit_of) {
    const double same = plan_same_part * (ends[1] - ends[0]);
    const struct plan_extreme none = {NAN, NAN};
    for (int i = 0; i < limits->count; i++) {
        const struct record_limit *found = &limits->list[i];
        const struct plan_extreme begin = {found->begin, ends[0]}, end = {found->end, ends[1]},
                                  both[] = {{found->smallest, found->t_smallest},
                                            {found->largest, found->t_largest}};
        struct plan_extreme of_parts[PLAN_PARTS][2] = {
            [PLAN_BEGIN] = {begin, begin}, [PLAN_END] = {end, end}};
        for (int k = 0; k < 2; k++)
            of_parts[PLAN_WITHIN][k] =
                both[k].t > ends[0] + same && both[k].t < ends[1] - same ? both[k] : none;
        for (int k = 0; k < PLAN_PARTS; k++)
            if (limit_of[i] < 0)
                point->objectives[part + k] = of_parts[k][1];
            else
                memcpy(plan_extremes(plan, point, part + k, limit_of[i]), of_parts[k], sizeof of_parts[k]);
        if (!isfinite(found->smallest) || !isfinite(found->largest))
            plan_note_failure(plan, point, REFDYN_NOT_FINITE, limits->t);
    }
}

/* Takes the values at the end of the motion; they belong to the first part of the case. */
static void take_end(struct plan *plan, struct plan_point *point, int part, struct motion *motion) {
    struct record_table *table = &plan->tables[0];
    const double t = motion->integrator.t;
    table->integrator = &motion->integrator;
    record_table_fill(table);
    for (int i = 0; i < plan->limit_count; i++)
        if (plan->limits[i].is_at_end)
            for (int k = 0; k < 2; k++)
                plan_extremes(plan, point, part, i)[k] =
                    (struct plan_extreme){table->values[plan->signals[plan->limits[i].signal]], t};
    if (plan->file->measure == PLAN_INTEGRAL)
        point->objectives[part] = (struct plan_extreme){plan->integrals[0].value, t};
    plan->integral_scale = plan->integrals[0].size;
    if (plan->file->measure == PLAN_AT_END)
        point->objectives[part] = (struct plan_extreme){table->values[plan->signals[plan->objective]], t};
}

/* Begins an objective rd.integral. */
static void begin_integral(struct plan *plan, struct motion *motion, double end) {
    struct record_table *table = &plan->tables[0];
    if (plan->file->measure != PLAN_INTEGRAL)
        return;
    table->integrator = &motion->integrator;
    motion->record.integral = &plan->integrals[0];
    record_integral_begin(motion->record.integral, table, plan->signals[plan->objective],
                          end - motion->integrator.t, plan->integral_scale);
}

/* Adds the part of the last step up to the shown state to what the motion is compared with. */
static int pass_shown(struct motion *motion) {
    const int status = motion->record.limits ? record_limits_pass(motion->record.limits) : REFDYN_OK;
    return status == REFDYN_OK && motion->record.integral ? record_integral_pass(motion->record.integral)
                                                          : status;
}

/* Runs the motion from stretch to stretch. */
static void run_free(struct plan *plan, struct plan_point *point, int one,
                     const struct plan_stretches *stretches) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const size_t most = (size_t)plan->limit_count + 1;
    struct record_bound *bounds = memory_scratch(&format_memory, most * sizeof *bounds);
    int *limit_of = memory_scratch(&format_memory, most * sizeof *limit_of);
    const int count = list_bounds(plan, bounds, limit_of), first = plan_part(plan, one, 0, PLAN_BEGIN);
    struct motion motion;
    struct record_limits limits;
    int status = simulate_start(&motion, plan->scene, &plan->integration, stretches->t[stretches->count], 0);
    record_limits_start(&limits, simulate_memory(&motion), &motion.integrator, plan->scene->compiled.spatial,
                        bounds, count);
    limits.is_inner = true; /* a value after a time event belongs to the next stretch */
    if (count > 0)
        motion.record.limits = &limits;
    if (status == REFDYN_OK)
        begin_integral(plan, &motion, stretches->t[stretches->count]);
    for (int i = 0; i < stretches->count && status == REFDYN_OK && point->is_done; i++) {
        record_limits_clear(&limits);
        status = simulate_advance(&motion, stretches->t[i + 1], NULL);
        if (status == REFDYN_OK && record_is_stopped(&motion.record))
            status = REFDYN_EVENT_ENDS;
        if (status == REFDYN_OK)
            status = pass_shown(&motion); /* if a step goes on beyond the stretch */
        if (status == REFDYN_OK)
            take_extremes(plan, point, first + PLAN_PARTS * i, stretches->t + i, &limits, limit_of);
    }
    if (status == REFDYN_OK && point->is_done)
        take_end(plan, point, first, &motion);
    else if (status != REFDYN_OK)
        plan_note_failure(plan, point, status, motion.integrator.t);
    plan->motions++;
    simulate_release(&motion);
    memory_back(&format_memory, mark);
}

/* ---- All cases ---- */

static void evaluate_case(struct plan *plan, struct plan_point *point, const struct motions *motions,
                          int one) {
    struct plan_stretches stretches;
    const int status = plan_place_in_stretches(plan, motions, one, &stretches);
    if (status) {
        plan_note_failure(plan, point, status, plan->batch.t);
        return;
    }
    run_free(plan, point, one, &stretches);
}

void plan_point_evaluate(struct plan *plan, struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const struct plan_extreme none = {NAN, NAN};
    struct motions motions;
    plan_describe(plan, point->x, 1, &motions);
    point->is_done = true;
    point->has_gradients = false;
    for (size_t i = 0; i < plan_extreme_count(plan); i++)
        point->extremes[i] = none;
    for (int part = 0; part < plan->part_count; part++)
        point->objectives[part] = none;
    for (int one = 0; one < plan->case_count && plan->file->measure == PLAN_PARAMETER; one++)
        point->objectives[plan_part(plan, one, 0, PLAN_BEGIN)].value =
            plan_value_at(plan, plan->objective, point->x);
    for (int one = 0; one < plan->case_count && point->is_done; one++)
        evaluate_case(plan, point, &motions, one);
    memory_back(&format_memory, mark);
}

/* ---- Judgement ---- */

double plan_excess(const struct plan *plan, const struct plan_point *point, int i) {
    const struct plan_limit *limit = &plan->limits[i / 2 % plan->limit_count];
    const double value = point->extremes[i].value;
    if (isnan(value)) /* this part has no such value */
        return -INFINITY;
    return (i % 2 ? value - limit->to : limit->from - value) / limit->size;
}

int plan_worst(const struct plan *plan, const struct plan_point *point) {
    int worst = -1;
    for (int i = 0; i < (int)plan_extreme_count(plan); i++)
        if (worst < 0 || plan_excess(plan, point, i) > plan_excess(plan, point, worst))
            worst = i;
    return worst;
}

double plan_objective(const struct plan *plan, const struct plan_point *point) {
    double largest = -INFINITY;
    for (int part = 0; part < plan->part_count; part++)
        largest = fmax(largest, point->objectives[part].value); /* of a number and NAN, the number */
    return largest;
}

bool plan_is_beyond(const struct plan_limit *limit, double value) {
    const struct record_bound bound = {limit->name, limit->column, limit->from, limit->to};
    return limit->is_at_end ? fmax(limit->from - value, value - limit->to) > end_slack * limit->size
                            : record_is_beyond(&bound, value);
}

bool plan_is_feasible(const struct plan *plan, const struct plan_point *point) {
    for (int i = 0; i < (int)plan_extreme_count(plan) && point->is_done; i++)
        if (plan_is_beyond(&plan->limits[i / 2 % plan->limit_count], point->extremes[i].value))
            return false;
    return point->is_done;
}

/* ---- The scan ---- */

struct scan {
    struct plan *plan;
    const struct motions *motions;
    double *objectives, *excesses;       /* by number of the motion */
    double *values;                      /* (rooms x (signals + 1)) */
    struct refdyn_batch_result *results; /* by number of the motion */
};

static int see_step(void *context, const struct refdyn_batch_case *one) {
    const struct scan *scan = context;
    return plan_add_step(scan->plan, one, scan->motions->ends[one->number] - scan->plan->batch.t);
}

static int see_output(void *context, const struct refdyn_batch_case *one, int number) {
    struct scan *scan = context;
    const struct plan *plan = scan->plan;
    double *values = scan->values + one->room * (plan->signal_count + 1),
           *objective = &scan->objectives[one->number];
    const enum plan_measure measure = plan->file->measure;
    const bool is_last = number == SCAN_OUTPUTS;
    plan_write_signals(scan->plan, one, values);
    for (int i = 0; i < plan->limit_count; i++) {
        const struct plan_limit *limit = &plan->limits[i];
        const double value = values[limit->signal],
                     excess = fmax(limit->from - value, value - limit->to) / limit->size;
        if (is_last || !limit->is_at_end)
            scan->excesses[one->number] = fmax(scan->excesses[one->number], excess);
    }
    if (measure == PLAN_AT_END)
        *objective = values[plan->objective];
    else if (measure == PLAN_LARGEST)
        *objective = number ? fmax(*objective, values[plan->objective]) : values[plan->objective];
    else if (measure == PLAN_INTEGRAL)
        *objective = values[plan->signal_count];
    return 0;
}

static int see_end(void *context, const struct refdyn_batch_case *one,
                   const struct refdyn_batch_result *result) {
    struct scan *scan = context;
    scan->results[one->number] = *result;
    if (result->status)
        scan->excesses[one->number] = INFINITY;
    return 0;
}

static int is_stopped(void *context) {
    (void)context;
    return system_interrupted != 0;
}

/* The largest value of all cases, for each point. */
static void join_cases(const struct plan *plan, const double *of_motions, int points, double *of_points) {
    for (int i = 0; i < points; i++) {
        of_points[i] = -INFINITY;
        for (int one = 0; one < plan->case_count; one++) {
            const double value = of_motions[i * plan->case_count + one];
            of_points[i] = isnan(value) ? INFINITY : fmax(of_points[i], value);
        }
    }
}

/* Keeps the reason of the last failure, for the case that no motion reaches its end. */
static void note_failures(struct plan *plan, const struct scan *scan, int count) {
    struct refdyn_workspace *work = &plan->scene->work;
    int last = count - 1;
    while (last >= 0 && scan->results[last].status == REFDYN_OK)
        last--;
    if (last < 0)
        return;
    plan->failed.status = scan->results[last].status;
    plan->failed.t = scan->results[last].t;
    plan_set_values(plan, scan->motions, last);
    if (refdyn_check_parameters(work) == REFDYN_REFUSED)
        scene_refused_fact(plan->scene, work, plan->failed.refused);
}

void plan_scan(struct plan *plan, const double *x, int points, double *objectives, double *excesses) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const int total = points * plan->case_count;
    const size_t rooms = (size_t)(plan->batch.threads * plan->rooms_of_thread);
    struct motions motions;
    double times[SCAN_OUTPUTS];
    plan_describe(plan, x, points, &motions);
    struct scan scan = {.plan = plan, .motions = &motions};
    scan.objectives = memory_scratch(&format_memory, (size_t)total * sizeof(double));
    scan.excesses = memory_scratch(&format_memory, (size_t)total * sizeof(double));
    scan.values = memory_scratch(&format_memory, rooms * ((size_t)plan->signal_count + 1) * sizeof(double));
    scan.results = memory_scratch(&format_memory, (size_t)total * sizeof *scan.results);
    for (int i = 0; i < total; i++) {
        scan.excesses[i] = -INFINITY;
        scan.results[i] = (struct refdyn_batch_result){.status = REFDYN_OK};
        scan.objectives[i] =
            plan->file->measure == PLAN_PARAMETER
                ? plan_value_at(plan, plan->objective, x + i / plan->case_count * plan->count)
                : 0;
    }
    for (int i = 0; i < SCAN_OUTPUTS; i++)
        times[i] = plan->batch.t + (motions.ends[0] - plan->batch.t) * (i + 1) / SCAN_OUTPUTS;
    motions.batch.times = times;
    motions.batch.time_count = SCAN_OUTPUTS;
    motions.batch.count = total;
    motions.batch.context = &scan;
    motions.batch.output = see_output;
    motions.batch.step = plan->file->measure == PLAN_INTEGRAL ? see_step : NULL;
    motions.batch.end = see_end;
    motions.batch.stop = is_stopped;
    plan->motions += total;
    const int status = refdyn_batch_run(&motions.batch, NULL);
    note_failures(plan, &scan, total);
    join_cases(plan, scan.objectives, points, objectives);
    join_cases(plan, scan.excesses, points, excesses);
    for (int i = 0; i < points && (status || system_interrupted); i++)
        excesses[i] = INFINITY;
    memory_back(&format_memory, mark);
}
