/*
 * Motions of a plan: extremes of the limits in each stretch between time events, and objectives.
 *
 * A free motion of each case locates the extremes within its steps, as `sim` does. One pair of extremes of a
 * whole motion would hide all others from the search: a law with many knots touches its limits in many
 * stretches. plan_gradients.c adds the derivatives.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

enum { SCAN_OUTPUTS = 200 /* of each motion of the scan */ };

/* Smaller excesses at the end, as a part of the limit's size, are rounding: equal bounds, which prescribe a
 * value there, leave a range without width. */
static const double end_slack = 1e-9;

/* ---- Points ---- */

static size_t extreme_count(const struct plan *plan) {
    return 2 * (size_t)plan->part_count * (size_t)plan->limit_count;
}

void plan_point_start(const struct plan *plan, struct plan_point *point) {
    const size_t count = (size_t)plan->count, extremes = extreme_count(plan),
                 parts = (size_t)plan->part_count;
    *point = (struct plan_point){.x = format_allocate(count, sizeof *point->x)};
    point->extremes = format_allocate(extremes + 1, sizeof *point->extremes);
    point->objectives = format_allocate(parts, sizeof *point->objectives);
    point->extreme_by = format_allocate(extremes * count + 1, sizeof *point->extreme_by);
    point->objective_by = format_allocate(parts * count, sizeof *point->objective_by);
}

void plan_point_copy(const struct plan *plan, const struct plan_point *from, struct plan_point *to) {
    const size_t count = (size_t)plan->count, extremes = extreme_count(plan),
                 parts = (size_t)plan->part_count;
    to->is_done = from->is_done;
    to->has_gradients = from->has_gradients;
    memcpy(to->x, from->x, count * sizeof *to->x);
    memcpy(to->extremes, from->extremes, extremes * sizeof *to->extremes);
    memcpy(to->objectives, from->objectives, parts * sizeof *to->objectives);
    memcpy(to->extreme_by, from->extreme_by, extremes * count * sizeof *to->extreme_by);
    memcpy(to->objective_by, from->objective_by, parts * count * sizeof *to->objective_by);
}

double plan_value_at(const struct plan *plan, int value, const double *x) {
    const struct plan_value *varied = &plan->values[value];
    return x[value] == 1 ? varied->to : varied->from + x[value] * (varied->to - varied->from);
}

/* ---- Batches ---- */

/* Sets the parameters and inputs of the scene to those of a motion. */
static void set_values(const struct plan *plan, const struct motions *motions, int number) {
    struct refdyn_workspace *work = &plan->scene->work;
    for (int k = 0; k < motions->batch.column_count; k++) {
        const struct refdyn_batch_column *column = &motions->columns[k];
        const double value = column->values[number];
        if (column->what == REFDYN_VARIED_PARAMETER)
            work->p[column->place] = value;
        else if (column->what == REFDYN_VARIED_INPUT)
            work->x[column->place] = value;
    }
    refdyn_prepare(work);
}

double plan_end(const struct plan *plan) {
    const struct refdyn_model *model = plan->scene->model;
    const struct refdyn_workspace *work = &plan->scene->work;
    if (plan->end_parameter >= 0)
        return work->p[plan->end_parameter];
    if (plan->end_course < 0)
        return plan->t_end;
    model->course(work->p, work->x, plan->batch.t, plan->scene->q, plan->scene->qd, plan->courses);
    return plan->courses[plan->end_course];
}

void plan_describe(const struct plan *plan, const double *x, int points, struct motions *motions) {
    const int varied_count = plan->file->varied_count, count = plan->count, width = count + varied_count,
              total = points * plan->case_count, samples = plan->scene->inputs != NULL;
    motions->columns = memory_scratch(&format_memory, ((size_t)width + 1) * sizeof *motions->columns);
    motions->values = memory_scratch(&format_memory, ((size_t)width + 1) * (size_t)total * sizeof(double));
    motions->ends = memory_scratch(&format_memory, (size_t)total * sizeof(double));
    for (int i = 0; i < total; i++) {
        const double *at = x + i / plan->case_count * count;
        const int one = i % plan->case_count;
        for (int k = 0; k < count; k++)
            motions->values[k * total + i] = plan_value_at(plan, k, at);
        for (int k = 0; k < varied_count; k++)
            motions->values[(count + k) * total + i] = plan->cases[one * varied_count + k];
    }
    for (int k = 0; k < width; k++) {
        const struct refdyn_variable *variable =
            k < count ? &plan->variables[k] : &plan->file->varied[k - count].variable;
        motions->columns[k] =
            (struct refdyn_batch_column){variable->what, variable->place, motions->values + k * total};
    }
    motions->columns[width] = /* all motions have samples 0 */
        (struct refdyn_batch_column){REFDYN_VARIED_SAMPLES, 0, motions->values + width * total};
    motions->batch = plan->batch;
    motions->batch.column_count = width + samples;
    if (samples)
        motions->batch.samples = &plan->scene->inputs->samples;
    motions->batch.sample_count = samples;
    motions->batch.columns = motions->columns;
    motions->batch.ends = motions->ends;
    for (int i = 0; i < total; i++) {
        set_values(plan, motions, i);
        motions->ends[i] = plan_end(plan);
    }
}

void plan_write_signals(void *context, const struct refdyn_batch_case *one, double *values) {
    const struct plan *plan = context;
    struct record_table *table = &plan->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill(table);
    for (int k = 0; k < plan->signal_count; k++)
        values[k] = table->values[plan->signals[k]];
}

void plan_note_failure(struct plan *plan, struct plan_point *point, int status, double t) {
    point->is_done = false;
    plan->failed.status = status;
    plan->failed.t = t;
}

/* ---- The start of a motion ---- */

struct start {
    struct scene *scene;
    int status;
};

/* Copies parameters, inputs and start into the scene, then ends the batch. */
static int take_start(void *context, const struct refdyn_batch_case *one, int number) {
    struct start *start = context;
    struct scene *scene = start->scene;
    const struct refdyn_model *model = scene->model;
    const struct refdyn_workspace *work = one->integrator->work;
    (void)number;
    memcpy(scene->work.p, work->p, (size_t)(model->parameter_count + model->derived_count) * sizeof *work->p);
    memcpy(scene->work.x, work->x, (size_t)model->input_count * sizeof *work->x);
    memcpy(scene->q, one->integrator->q, (size_t)model->n * sizeof *scene->q);
    memcpy(scene->qd, one->integrator->qd, (size_t)model->n * sizeof *scene->qd);
    start->status = REFDYN_OK;
    return 1;
}

static int note_end(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct start *start = context;
    (void)one;
    start->status = result->status;
    return 0;
}

int plan_place(struct plan *plan, const struct motions *motions, int one) {
    struct refdyn_batch batch = motions->batch;
    struct start start = {plan->scene, REFDYN_BAD_OPTION};
    const long number = one;
    const double end = motions->ends[one];
    batch.lanes = NULL;
    batch.threads = 1;
    batch.count = 1;
    batch.numbers = &number;
    batch.times = &end;
    batch.time_count = 1;
    batch.context = &start;
    batch.output = take_start;
    batch.end = note_end;
    const int status = end > batch.t ? refdyn_batch_run(&batch, NULL) : REFDYN_BAD_OPTION;
    return status ? status : start.status;
}

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

int plan_part(const struct plan *plan, int one, int stretch, enum plan_place place) {
    return PLAN_PARTS * (one * plan->stretches_most + stretch) + (int)place;
}

struct plan_extreme *plan_extremes(const struct plan *plan, const struct plan_point *point, int part,
                                   int limit) {
    return point->extremes + 2 * (part * plan->limit_count + limit);
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
    if (plan->file->measure == PLAN_AT_END)
        point->objectives[part] = (struct plan_extreme){table->values[plan->signals[plan->objective]], t};
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
    for (int i = 0; i < stretches->count && status == REFDYN_OK && point->is_done; i++) {
        record_limits_clear(&limits);
        status = simulate_advance(&motion, stretches->t[i + 1], NULL);
        if (status == REFDYN_OK && record_is_stopped(&motion.record))
            status = REFDYN_EVENT_ENDS;
        if (status == REFDYN_OK && count > 0)
            status = record_limits_pass(&limits); /* if a step goes on beyond the stretch */
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

/* ---- Stretches ---- */

int plan_break_count(const struct plan *plan) {
    return plan->scene->model->break_count + (plan->scene->inputs ? plan->scene->inputs->samples.count : 0);
}

static int compare_breaks(const void *a, const void *b) {
    const double x = ((const struct plan_break *)a)->t, y = ((const struct plan_break *)b)->t;
    return (x > y) - (x < y);
}

/* Lists the time events of the placed motion, and the samples of its inputs, in order. Returns their number.
 */
static int list_breaks(const struct plan *plan, struct plan_break *list) {
    const struct scene *scene = plan->scene;
    const struct refdyn_model *model = scene->model;
    const struct refdyn_samples *samples = scene->inputs ? &scene->inputs->samples : NULL;
    const int count = plan_break_count(plan), known = model->break_count;
    double *times = memory_scratch(&format_memory, ((size_t)known + 1) * sizeof *times);
    if (model->breaks)
        model->breaks(scene->work.p, scene->work.x, plan->batch.t, scene->q, scene->qd, times);
    for (int i = 0; i < known; i++)
        list[i] = (struct plan_break){times[i], i};
    for (int i = known; i < count; i++)
        list[i] = (struct plan_break){samples->rows[(i - known) * (samples->width + 1)], -1};
    qsort(list, (size_t)count, sizeof *list, compare_breaks);
    return count;
}

/* The stretches of the placed motion, which ends at `end`. If there are too many, the last one has several.
 */
static void find_stretches(const struct plan *plan, double end, struct plan_stretches *stretches) {
    const double start = plan->batch.t, same = plan_same_part * (end - start);
    const size_t most = (size_t)plan_break_count(plan) + 2;
    struct plan_break *list = memory_scratch(&format_memory, most * sizeof *list);
    const int count = list_breaks(plan, list);
    stretches->t = memory_scratch(&format_memory, most * sizeof *stretches->t);
    stretches->breaks = memory_scratch(&format_memory, most * sizeof *stretches->breaks);
    stretches->t[0] = start;
    stretches->count = 1; /* the one that has begun */
    for (int i = 0; i < count && stretches->count < plan->stretches_most; i++)
        if (list[i].t > stretches->t[stretches->count - 1] + same && list[i].t < end - same) {
            stretches->t[stretches->count] = list[i].t;
            stretches->breaks[stretches->count++] = list[i].number;
        }
    stretches->t[stretches->count] = end;
}

int plan_place_in_stretches(struct plan *plan, const struct motions *motions, int one,
                            struct plan_stretches *stretches) {
    const int status = plan_place(plan, motions, one);
    if (status == REFDYN_OK)
        find_stretches(plan, motions->ends[one], stretches);
    return status;
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
    if (point->is_done && plan->file->measure == PLAN_INTEGRAL)
        plan_integrate(plan, point, motions, one);
}

void plan_point_evaluate(struct plan *plan, struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const struct plan_extreme none = {NAN, NAN};
    struct motions motions;
    plan_describe(plan, point->x, 1, &motions);
    point->is_done = true;
    point->has_gradients = false;
    for (size_t i = 0; i < extreme_count(plan); i++)
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
    for (int i = 0; i < (int)extreme_count(plan); i++)
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
    for (int i = 0; i < (int)extreme_count(plan) && point->is_done; i++)
        if (plan_is_beyond(&plan->limits[i / 2 % plan->limit_count], point->extremes[i].value))
            return false;
    return point->is_done;
}

/* ---- The scan ---- */

struct scan {
    struct plan *plan;
    const struct motions *motions;
    double *objectives, *excesses; /* by number of the motion */
    double *values;                /* (rooms x signals) */
};

static int see_output(void *context, const struct refdyn_batch_case *one, int number) {
    struct scan *scan = context;
    const struct plan *plan = scan->plan;
    double *values = scan->values + one->room * plan->signal_count,
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
        *objective += values[plan->objective] * (scan->motions->ends[one->number] - plan->batch.t) *
                      (number && !is_last ? 1 : 0.5) / SCAN_OUTPUTS;
    return 0;
}

static int see_end(void *context, const struct refdyn_batch_case *one,
                   const struct refdyn_batch_result *result) {
    struct scan *scan = context;
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
    scan.values = memory_scratch(&format_memory, (rooms * (size_t)plan->signal_count + 1) * sizeof(double));
    for (int i = 0; i < total; i++) {
        scan.excesses[i] = -INFINITY;
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
    motions.batch.end = see_end;
    motions.batch.stop = is_stopped;
    plan->motions += total;
    const int status = refdyn_batch_run(&motions.batch, NULL);
    join_cases(plan, scan.objectives, points, objectives);
    join_cases(plan, scan.excesses, points, excesses);
    for (int i = 0; i < points && (status || system_interrupted); i++)
        excesses[i] = INFINITY;
    memory_back(&format_memory, mark);
}
