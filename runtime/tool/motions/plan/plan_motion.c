/*
 * Motions of a plan: extremes of the limits, objectives and their gradients.
 *
 * A free motion of each case locates the extremes within its steps, as `sim` does. Then copies that repeat
 * its steps provide derivatives at the times of these extremes. With the fraction s of the motion as time,
 * the derivative of an extreme is that of its value at constant s: within the motion the rate of the value
 * is zero there, and at both ends s is constant.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

enum {
    PANELS = 200,      /* of Simpson's rule for integrals over the motion */
    SCAN_OUTPUTS = 200 /* of each motion of the scan */
};

/* Times nearer to each other than this part of the motion share an output. */
static const double same_part = 1e-9;
/* Smaller excesses at the end, as a part of the limit's size, are rounding: equal bounds, which prescribe a
 * value there, leave a range without width. */
static const double end_slack = 1e-9;
/* Distance from a jump, as a part of the motion, at which the values on one side of it are taken. It is
 * larger than the changes of copies. */
static const double aside_part = 1e-4;
/* Change of a value for the derivative of the time of a jump, as a part of its range. */
static const double break_part = 1e-6;

/* ---- Points ---- */

static size_t extreme_count(const struct plan *plan) {
    return 2 * (size_t)plan->case_count * (size_t)plan->limit_count;
}

void plan_point_start(const struct plan *plan, struct plan_point *point) {
    const size_t count = (size_t)plan->count, extremes = extreme_count(plan),
                 cases = (size_t)plan->case_count;
    *point = (struct plan_point){.x = format_allocate(count, sizeof *point->x)};
    point->extremes = format_allocate(extremes + 1, sizeof *point->extremes);
    point->objectives = format_allocate(cases, sizeof *point->objectives);
    point->extreme_by = format_allocate(extremes * count + 1, sizeof *point->extreme_by);
    point->objective_by = format_allocate(cases * count, sizeof *point->objective_by);
}

void plan_point_copy(const struct plan *plan, const struct plan_point *from, struct plan_point *to) {
    const size_t count = (size_t)plan->count, extremes = extreme_count(plan),
                 cases = (size_t)plan->case_count;
    to->is_done = from->is_done;
    to->has_gradients = from->has_gradients;
    memcpy(to->x, from->x, count * sizeof *to->x);
    memcpy(to->extremes, from->extremes, extremes * sizeof *to->extremes);
    memcpy(to->objectives, from->objectives, cases * sizeof *to->objectives);
    memcpy(to->extreme_by, from->extreme_by, extremes * count * sizeof *to->extreme_by);
    memcpy(to->objective_by, from->objective_by, cases * count * sizeof *to->objective_by);
}

double plan_value_at(const struct plan *plan, int value, const double *x) {
    const struct plan_value *varied = &plan->values[value];
    return x[value] == 1 ? varied->to : varied->from + x[value] * (varied->to - varied->from);
}

/* The end of the motion of a case at x. */
static double end_at(const struct plan *plan, const double *x, int one) {
    if (plan->end_value >= 0)
        return plan_value_at(plan, plan->end_value, x);
    return plan->end_varied >= 0 ? plan->cases[one * plan->file->varied_count + plan->end_varied]
                                 : plan->t_end;
}

/* ---- Batches ---- */

/* Motions of all cases at several points; number: point x cases + case. */
struct motions {
    struct refdyn_batch batch;
    struct refdyn_batch_column *columns;
    double *values; /* (count + varied_count) x motions */
    double *ends;   /* (motions) [s] */
};

/* Describes the motions at x (points x count), in scratch memory. Outputs are the caller's. */
static void describe(const struct plan *plan, const double *x, int points, struct motions *motions) {
    const int varied_count = plan->file->varied_count, count = plan->count, width = count + varied_count,
              total = points * plan->case_count;
    motions->columns = memory_scratch(&format_memory, (size_t)width * sizeof *motions->columns);
    motions->values = memory_scratch(&format_memory, (size_t)width * (size_t)total * sizeof(double));
    motions->ends = memory_scratch(&format_memory, (size_t)total * sizeof(double));
    for (int i = 0; i < total; i++) {
        const double *at = x + i / plan->case_count * count;
        const int one = i % plan->case_count;
        for (int k = 0; k < count; k++)
            motions->values[k * total + i] = plan_value_at(plan, k, at);
        for (int k = 0; k < varied_count; k++)
            motions->values[(count + k) * total + i] = plan->cases[one * varied_count + k];
        motions->ends[i] = end_at(plan, at, one);
    }
    for (int k = 0; k < width; k++) {
        const struct refdyn_variable *variable =
            k < count ? &plan->variables[k] : &plan->file->varied[k - count].variable;
        motions->columns[k] =
            (struct refdyn_batch_column){variable->what, variable->place, motions->values + k * total};
    }
    motions->batch = plan->batch;
    motions->batch.column_count = width;
    motions->batch.columns = motions->columns;
    motions->batch.ends = motions->ends;
}

static void write_signals(void *context, const struct refdyn_batch_case *one, double *values) {
    const struct plan *plan = context;
    struct record_table *table = &plan->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill(table);
    for (int k = 0; k < plan->signal_count; k++)
        values[k] = table->values[plan->signals[k]];
}

static void note_failure(struct plan *plan, struct plan_point *point, int status, double t) {
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

/* Sets the scene to the start of a case's motion. Returns a status of the runtime. */
static int place(struct plan *plan, const struct motions *motions, int one) {
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

static struct plan_extreme *extremes_of(const struct plan *plan, const struct plan_point *point, int one,
                                        int limit) {
    return point->extremes + 2 * (one * plan->limit_count + limit);
}

/* Takes the extremes of the motion, and the values at its end. */
static void take_values(struct plan *plan, struct plan_point *point, int one, struct motion *motion,
                        const struct record_limits *limits, const int *limit_of) {
    struct record_table *table = &plan->tables[0];
    const double t = motion->integrator.t;
    table->integrator = &motion->integrator;
    record_table_fill(table);
    for (int i = 0; i < limits->count; i++) {
        const struct record_limit *found = &limits->list[i];
        const struct plan_extreme both[] = {{found->smallest, found->t_smallest},
                                            {found->largest, found->t_largest}};
        if (limit_of[i] < 0)
            point->objectives[one] = both[1];
        else
            memcpy(extremes_of(plan, point, one, limit_of[i]), both, sizeof both);
        if (!isfinite(found->smallest) || !isfinite(found->largest))
            note_failure(plan, point, REFDYN_NOT_FINITE, t);
    }
    for (int i = 0; i < plan->limit_count; i++)
        if (plan->limits[i].is_at_end)
            for (int k = 0; k < 2; k++)
                extremes_of(plan, point, one, i)[k] =
                    (struct plan_extreme){table->values[plan->signals[plan->limits[i].signal]], t};
    if (plan->file->measure == PLAN_AT_END)
        point->objectives[one] = (struct plan_extreme){table->values[plan->signals[plan->objective]], t};
}

static void run_free(struct plan *plan, struct plan_point *point, int one, double until) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const size_t most = (size_t)plan->limit_count + 1;
    struct record_bound *bounds = memory_scratch(&format_memory, most * sizeof *bounds);
    int *limit_of = memory_scratch(&format_memory, most * sizeof *limit_of);
    const int count = list_bounds(plan, bounds, limit_of);
    struct motion motion;
    struct record_limits limits;
    int status = simulate_start(&motion, plan->scene, &plan->integration, until, 0);
    record_limits_start(&limits, simulate_memory(&motion), &motion.integrator, plan->scene->compiled.spatial,
                        bounds, count);
    if (count > 0)
        motion.record.limits = &limits;
    if (status == REFDYN_OK)
        status = simulate_to(&motion, motion.record.outputs - 1, NULL);
    if (status == REFDYN_OK && record_is_stopped(&motion.record))
        status = REFDYN_EVENT_ENDS;
    if (status == REFDYN_OK)
        take_values(plan, point, one, &motion, &limits, limit_of);
    else
        note_failure(plan, point, status, motion.integrator.t);
    plan->motions++;
    simulate_release(&motion);
    memory_back(&format_memory, mark);
}

/* ---- Outputs, and their derivatives ---- */

/* The outputs of the motion of a case. */
struct outputs {
    double *t; /* (count) [s] */
    int count;
    double *at; /* ((count + 2) x signals) */
    double *by; /* (values x (count + 2) x signals); NULL without derivatives */
};

static int compare_times(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void add_time(struct outputs *outputs, double t) {
    outputs->t[outputs->count++] = t;
}

/* Lists the times at which values are needed, ascending and distinct; the last one is the end. */
static void list_times(const struct plan *plan, const struct plan_point *point, int one, double end,
                       bool with_extremes, struct outputs *outputs) {
    const double start = plan->batch.t, same = same_part * (end - start);
    int kept = 0;
    outputs->t = format_allocate_large(2 * (size_t)plan->limit_count + PANELS + 2, sizeof *outputs->t);
    outputs->count = 0;
    for (int i = 0; i < 2 * plan->limit_count && with_extremes; i++)
        add_time(outputs, extremes_of(plan, point, one, 0)[i].t);
    if (with_extremes && plan->file->measure == PLAN_LARGEST)
        add_time(outputs, point->objectives[one].t);
    for (int i = 1; i < PANELS && plan->file->measure == PLAN_INTEGRAL; i++)
        add_time(outputs, start + (end - start) * i / PANELS);
    qsort(outputs->t, (size_t)outputs->count, sizeof *outputs->t, compare_times);
    for (int i = 0; i < outputs->count; i++)
        if (outputs->t[i] > (kept ? outputs->t[kept - 1] : start) + same && outputs->t[i] < end - same)
            outputs->t[kept++] = outputs->t[i];
    outputs->t[kept++] = end;
    outputs->count = kept;
}

/* The output at a time; 0 is the start. */
static int output_at(const struct plan *plan, const struct outputs *outputs, double t) {
    int nearest = 0;
    double least = fabs(t - plan->batch.t);
    for (int i = 0; i < outputs->count; i++)
        if (fabs(t - outputs->t[i]) < least) {
            nearest = i + 1;
            least = fabs(t - outputs->t[i]);
        }
    return nearest;
}

/* The derivative by x; NAN if there is none. */
static double derivative(const struct plan *plan, const struct outputs *outputs, int value, int row,
                         int signal) {
    const size_t width = (size_t)plan->signal_count, rows = (size_t)outputs->count + 2;
    const double by = outputs->by[((size_t)value * rows + (size_t)row) * width + (size_t)signal];
    return by * (plan->values[value].to - plan->values[value].from);
}

static double derivative_or_zero(struct plan *plan, double by) {
    plan->lost += isnan(by);
    return isnan(by) ? 0 : by;
}

static void run_outputs(struct plan *plan, struct plan_point *point, const struct motions *motions, int one,
                        bool with_derivatives, struct outputs *outputs) {
    const size_t size = ((size_t)outputs->count + 2) * (size_t)plan->signal_count + 1;
    struct refdyn_underivable *underivable =
        memory_scratch(&format_memory, (size_t)plan->count * sizeof *underivable);
    struct refdyn_batch batch = motions->batch;
    batch.times = outputs->t;
    batch.time_count = outputs->count;
    outputs->at = format_allocate_large(size, sizeof *outputs->at);
    outputs->by =
        with_derivatives ? format_allocate_large(size * (size_t)plan->count, sizeof *outputs->by) : NULL;
    struct refdyn_derivatives given = {.batch = &batch,
                                       .number = one,
                                       .count = with_derivatives ? plan->count : 0,
                                       .variables = plan->variables,
                                       .end_rates = plan->end_rates,
                                       .width = plan->signal_count,
                                       .values = write_signals,
                                       .context = plan,
                                       .at = outputs->at,
                                       .derivatives = outputs->by,
                                       .underivable = underivable};
    const int status = refdyn_derivatives_run(&given);
    plan->motions += 1 + given.copies;
    if (status || given.outputs < outputs->count + 1)
        note_failure(plan, point, status ? status : given.motion.status, given.motion.t);
}

static void outputs_release(struct outputs *outputs) {
    free(outputs->t);
    free(outputs->at);
    free(outputs->by);
}

/* Simpson's rule over the outputs, and its derivatives by x unless there are none. */
static void integrate(struct plan *plan, struct plan_point *point, int one, double end,
                      const struct outputs *outputs) {
    const double span = end - plan->batch.t;
    double *by = point->objective_by + one * plan->count, sum = 0;
    for (int k = 0; k < plan->count; k++)
        by[k] = 0;
    for (int i = 0; i <= PANELS; i++) {
        const int row = output_at(plan, outputs, plan->batch.t + span * i / PANELS);
        const double weight = (i == 0 || i == PANELS ? 1 : i % 2 ? 4 : 2) / (3.0 * PANELS);
        sum += weight * outputs->at[row * plan->signal_count + plan->objective];
        for (int k = 0; k < plan->count && outputs->by; k++)
            by[k] +=
                weight * span * derivative_or_zero(plan, derivative(plan, outputs, k, row, plan->objective));
    }
    point->objectives[one] = (struct plan_extreme){span * sum, end};
    if (outputs->by && plan->end_value >= 0)
        by[plan->end_value] += sum * (plan->values[plan->end_value].to - plan->values[plan->end_value].from);
}

/* ---- Extremes where a value jumps ---- */

/* The derivative by x of the time event at t, such as the end of a programme; 0 if there is none. */
static double break_rate(const struct plan *plan, const struct motions *motions, int one, int value, double t,
                         double same) {
    const struct plan_value *varied = &plan->values[value];
    struct refdyn_workspace *work = &plan->scene->work;
    const struct refdyn_model *model = plan->scene->model;
    const double change = break_part * (varied->to - varied->from),
                 now = motions->values[value * plan->case_count + one];
    double *times = memory_scratch(&format_memory, ((size_t)model->break_count + 1) * sizeof *times);
    double *moved = memory_scratch(&format_memory, ((size_t)model->break_count + 1) * sizeof *moved);
    if (!model->breaks || varied->variable.what != REFDYN_VARIED_PARAMETER)
        return 0;
    model->breaks(work->p, work->x, t, plan->scene->q, plan->scene->qd, times);
    work->p[varied->variable.place] = now + change;
    refdyn_prepare(work);
    model->breaks(work->p, work->x, t, plan->scene->q, plan->scene->qd, moved);
    work->p[varied->variable.place] = now;
    refdyn_prepare(work);
    for (int i = 0; i < model->break_count; i++)
        if (fabs(times[i] - t) <= same)
            return (moved[i] - times[i]) / change * (varied->to - varied->from);
    return 0;
}

/* Derivatives of an extreme at a jump: those of the values on its side, plus the rate of these values times
 * the derivative of the jump's time. */
static void differentiate_jump(struct plan *plan, struct plan_point *point, const struct motions *motions,
                               int one, int signal, struct plan_extreme extreme, double *by) {
    const double start = plan->batch.t, end = motions->ends[one], span = end - start,
                 aside = aside_part * span, same = same_part * span;
    double times[5];
    struct outputs outputs = {.t = format_allocate_large(5, sizeof(double))};
    for (int i = -2; i <= 2; i++)
        times[i + 2] = extreme.t + i * aside;
    for (int i = 0; i < 5; i++)
        if (i != 2 && times[i] > start + same && times[i] < end - same)
            add_time(&outputs, times[i]);
    add_time(&outputs, end);
    run_outputs(plan, point, motions, one, true, &outputs);
    const int rows[] = {output_at(plan, &outputs, times[1]), output_at(plan, &outputs, times[3])};
    const double *at = outputs.at + signal;
    const int width = plan->signal_count;
    const bool is_after = times[3] < end - same && fabs(at[rows[1] * width] - extreme.value) <
                                                       fabs(at[rows[0] * width] - extreme.value);
    const int near = rows[is_after], far = output_at(plan, &outputs, times[is_after ? 4 : 0]);
    const double rate = (at[near * width] - at[far * width]) / (is_after ? -aside : aside);
    for (int k = 0; k < plan->count && point->is_done; k++) {
        const double scale = plan->values[k].to - plan->values[k].from,
                     moves = extreme.t >= end - same ? plan->end_rates[k] * scale
                                                     : break_rate(plan, motions, one, k, extreme.t, same),
                     with_end = plan->end_rates[k] * scale * (extreme.t - start) / span;
        by[k] = derivative(plan, &outputs, k, near, signal) + rate * (moves - with_end);
    }
    outputs_release(&outputs);
}

/* Derivatives of an extreme by x. */
static void differentiate_extreme(struct plan *plan, struct plan_point *point, const struct motions *motions,
                                  int one, const struct outputs *outputs, int signal,
                                  struct plan_extreme extreme, double *by) {
    const int row = output_at(plan, outputs, extreme.t);
    bool jumps = false;
    for (int k = 0; k < plan->count; k++) {
        by[k] = derivative(plan, outputs, k, row, signal);
        jumps = jumps || isnan(by[k]);
    }
    if (jumps)
        differentiate_jump(plan, point, motions, one, signal, extreme, by);
    for (int k = 0; k < plan->count; k++)
        by[k] = derivative_or_zero(plan, by[k]);
}

static void differentiate_case(struct plan *plan, struct plan_point *point, const struct motions *motions,
                               int one, const struct outputs *outputs) {
    for (int i = 0; i < 2 * plan->limit_count; i++)
        differentiate_extreme(plan, point, motions, one, outputs, plan->limits[i / 2].signal,
                              extremes_of(plan, point, one, 0)[i],
                              point->extreme_by + (2 * one * plan->limit_count + i) * plan->count);
    if (plan->file->measure == PLAN_INTEGRAL)
        integrate(plan, point, one, motions->ends[one], outputs);
    else if (plan->file->measure != PLAN_PARAMETER)
        differentiate_extreme(plan, point, motions, one, outputs, plan->objective, point->objectives[one],
                              point->objective_by + one * plan->count);
}

/* ---- All cases ---- */

static void evaluate_case(struct plan *plan, struct plan_point *point, const struct motions *motions,
                          int one) {
    const int status = place(plan, motions, one);
    struct outputs outputs = {.count = 0};
    if (status) {
        note_failure(plan, point, status, plan->batch.t);
        return;
    }
    run_free(plan, point, one, motions->ends[one]);
    if (!point->is_done || plan->file->measure != PLAN_INTEGRAL)
        return;
    list_times(plan, point, one, motions->ends[one], false, &outputs);
    run_outputs(plan, point, motions, one, false, &outputs);
    if (point->is_done)
        integrate(plan, point, one, motions->ends[one], &outputs);
    outputs_release(&outputs);
}

void plan_point_evaluate(struct plan *plan, struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct motions motions;
    describe(plan, point->x, 1, &motions);
    point->is_done = true;
    point->has_gradients = false;
    for (int one = 0; one < plan->case_count; one++)
        point->objectives[one] = (struct plan_extreme){
            plan->file->measure == PLAN_PARAMETER ? plan_value_at(plan, plan->objective, point->x) : NAN,
            NAN};
    for (int one = 0; one < plan->case_count && point->is_done; one++)
        evaluate_case(plan, point, &motions, one);
    memory_back(&format_memory, mark);
}

void plan_point_differentiate(struct plan *plan, struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct motions motions;
    if (point->has_gradients || !point->is_done)
        return;
    describe(plan, point->x, 1, &motions);
    for (int one = 0; one < plan->case_count; one++)
        for (int k = 0; k < plan->count; k++)
            point->objective_by[one * plan->count + k] =
                plan->file->measure == PLAN_PARAMETER && k == plan->objective
                    ? plan->values[k].to - plan->values[k].from
                    : 0;
    for (int one = 0; one < plan->case_count && plan->signal_count > 0 && point->is_done; one++) {
        struct outputs outputs;
        if (place(plan, &motions, one) != REFDYN_OK) /* break_rate reads the scene */
            break;
        list_times(plan, point, one, motions.ends[one], true, &outputs);
        run_outputs(plan, point, &motions, one, true, &outputs);
        if (point->is_done)
            differentiate_case(plan, point, &motions, one, &outputs);
        outputs_release(&outputs);
    }
    point->has_gradients = point->is_done;
    memory_back(&format_memory, mark);
}

/* ---- Judgement ---- */

double plan_excess(const struct plan *plan, const struct plan_point *point, int i) {
    const struct plan_limit *limit = &plan->limits[i / 2 % plan->limit_count];
    const double value = point->extremes[i].value;
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
    for (int one = 0; one < plan->case_count; one++)
        largest = fmax(largest, point->objectives[one].value);
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
    write_signals(scan->plan, one, values);
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
    describe(plan, x, points, &motions);
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
