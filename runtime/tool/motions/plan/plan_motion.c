/*
 * Motions of a plan: points x, batches of motions at them, where each begins and ends, and its stretches
 * between time events. One pair of extremes of a whole motion would hide all others from the search: a law
 * with many knots touches its limits in many stretches.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* ---- Points ---- */

size_t plan_extreme_count(const struct plan *plan) {
    return 2 * (size_t)plan->part_count * (size_t)plan->limit_count;
}

void plan_point_start(const struct plan *plan, struct plan_point *point) {
    const size_t count = (size_t)plan->count, extremes = plan_extreme_count(plan),
                 parts = (size_t)plan->part_count;
    *point = (struct plan_point){.x = format_allocate(count, sizeof *point->x)};
    point->extremes = format_allocate(extremes + 1, sizeof *point->extremes);
    point->objectives = format_allocate(parts, sizeof *point->objectives);
    point->extreme_by = format_allocate(extremes * count + 1, sizeof *point->extreme_by);
    point->objective_by = format_allocate(parts * count, sizeof *point->objective_by);
}

void plan_point_copy(const struct plan *plan, const struct plan_point *from, struct plan_point *to) {
    const size_t count = (size_t)plan->count, extremes = plan_extreme_count(plan),
                 parts = (size_t)plan->part_count;
    to->is_done = from->is_done;
    to->has_gradients = from->has_gradients;
    memcpy(to->x, from->x, count * sizeof *to->x);
    memcpy(to->extremes, from->extremes, extremes * sizeof *to->extremes);
    memcpy(to->objectives, from->objectives, parts * sizeof *to->objectives);
    memcpy(to->extreme_by, from->extreme_by, extremes * count * sizeof *to->extreme_by);
    memcpy(to->objective_by, from->objective_by, parts * count * sizeof *to->objective_by);
}

int plan_part(const struct plan *plan, int one, int stretch, enum plan_spot spot) {
    return PLAN_PARTS * (one * plan->stretches_most + stretch) + (int)spot;
}

struct plan_extreme *plan_extremes(const struct plan *plan, const struct plan_point *point, int part,
                                   int limit) {
    return point->extremes + 2 * (part * plan->limit_count + limit);
}

double plan_value_at(const struct plan *plan, int value, const double *x) {
    const struct plan_value *varied = &plan->values[value];
    return x[value] == 1 ? varied->to : varied->from + x[value] * (varied->to - varied->from);
}

/* ---- Batches ---- */

void plan_set_values(const struct plan *plan, const struct motions *motions, int number) {
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

double plan_longest(const struct plan *plan) {
    for (int k = 0; k < plan->count && plan->end_parameter >= 0; k++)
        if (strcmp(plan->values[k].name, plan->file->end_name) == 0)
            return plan->values[k].to;
    return plan_end(plan);
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
        plan_set_values(plan, motions, i);
        motions->ends[i] = plan_end(plan);
    }
}

void plan_write_signals(const struct plan *plan, const struct refdyn_batch_case *one, double *values) {
    struct record_table *table = &plan->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill(table);
    for (int k = 0; k < plan->signal_count; k++)
        values[k] = table->values[plan->signals[k]];
    if (plan->file->measure == PLAN_INTEGRAL)
        values[plan->signal_count] = plan->integrals[one->room].value;
}

int plan_add_step(const struct plan *plan, const struct refdyn_batch_case *one, double span) {
    struct record_table *table = &plan->tables[one->room];
    struct record_integral *integral = &plan->integrals[one->room];
    table->integrator = one->integrator;
    if (one->integrator->t > plan->batch.t)
        return record_integral_pass(integral);
    record_integral_begin(integral, table, plan->signals[plan->objective], span, plan->integral_scale);
    return REFDYN_OK;
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
