/*
 * Gradients of a plan: derivatives of the extremes of limits and of objectives.
 *
 * Copies that repeat the steps of a motion provide derivatives of values at given times. With the fraction s
 * of the motion as time, the derivative of an extreme is that of its value at constant s: within the motion
 * the rate of the value is zero there, and at both ends s is constant. An extreme at a time event moves with
 * it:
 *
 *     dy/dx = (dy/dx)_s + y' (dt/dx - s d(end)/dx),
 *
 * with the derivative and the rate y' on the side of the extreme, since values jump or kink there.
 *
 * An integral over the motion is a value at its end. Each copy integrates over its own steps.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* Distance from a time event, as a part of the motion or of the stretch, at which values near it are taken,
 * and at twice of which again. It is larger than the changes of copies. */
static const double aside_part = 1e-4, aside_of_stretch = 0.1;
/* Change of a value for the derivative of the time of an event, as a part of its range. */
static const double break_part = 1e-6;

/* ---- Times of events, and their derivatives ---- */

/* A motion, whose time events move with the values. */
struct placed {
    const struct motions *motions;
    int one; /* the case */
    struct plan_stretches stretches;
    double
        *rates; /* (stretches + 1) x values; derivatives of their times by the values; the last: the end's */
};

static double *rates_of(const struct plan *plan, const struct placed *placed, int boundary) {
    return placed->rates + boundary * plan->count;
}

/* The times of the boundaries with the present values of the scene. */
static void write_boundaries(const struct plan *plan, const struct placed *placed, double *times) {
    const struct scene *scene = plan->scene;
    const struct refdyn_model *model = scene->model;
    const struct plan_stretches *stretches = &placed->stretches;
    double *breaks = memory_scratch(&format_memory, ((size_t)model->break_count + 1) * sizeof *breaks);
    if (model->breaks)
        model->breaks(scene->work.p, scene->work.x, plan->batch.t, scene->q, scene->qd, breaks);
    times[0] = plan->batch.t;
    for (int i = 1; i < stretches->count; i++)
        times[i] = stretches->breaks[i] >= 0 ? breaks[stretches->breaks[i]] : stretches->t[i];
    times[stretches->count] = plan_end(plan);
}

/* By central differences: times of events are formulas. */
static void find_rates(const struct plan *plan, struct placed *placed) {
    struct refdyn_workspace *work = &plan->scene->work;
    const size_t count = (size_t)placed->stretches.count + 1;
    double *low = memory_scratch(&format_memory, count * sizeof *low),
           *high = memory_scratch(&format_memory, count * sizeof *high);
    placed->rates = memory_scratch(&format_memory, count * (size_t)plan->count * sizeof(double));
    for (int k = 0; k < plan->count; k++) {
        const struct plan_value *value = &plan->values[k];
        const enum refdyn_varied what = value->variable.what;
        if (what != REFDYN_VARIED_PARAMETER && what != REFDYN_VARIED_INPUT)
            continue;
        double *place = (what == REFDYN_VARIED_PARAMETER ? work->p : work->x) + value->variable.place;
        const double change = break_part * (value->to - value->from), now = *place;
        *place = now - change;
        refdyn_prepare(work);
        write_boundaries(plan, placed, low);
        *place = now + change;
        refdyn_prepare(work);
        write_boundaries(plan, placed, high);
        *place = now;
        refdyn_prepare(work);
        for (size_t i = 0; i < count; i++)
            rates_of(plan, placed, (int)i)[k] = (high[i] - low[i]) / (2 * change);
    }
}

/* Places the motion of a case. Returns a status of the runtime. */
static int start(struct plan *plan, const struct motions *motions, int one, struct placed *placed) {
    *placed = (struct placed){.motions = motions, .one = one};
    const int status = plan_place_in_stretches(plan, motions, one, &placed->stretches);
    if (status == REFDYN_OK)
        find_rates(plan, placed);
    return status;
}

static double end_of(const struct placed *placed) {
    return placed->motions->ends[placed->one];
}

/* The distance from the ends of a stretch at which values are taken. */
static double aside_of(const struct plan *plan, const struct placed *placed, int stretch) {
    const double *t = placed->stretches.t;
    return fmin(aside_part * (end_of(placed) - plan->batch.t),
                aside_of_stretch * (t[stretch + 1] - t[stretch]));
}

/* The side of a time event on which an extreme of a stretch is: 1 after the event at the beginning of the
 * stretch, -1 before the one at its end; 0 for all other times. */
static int side_of(const struct plan *plan, const struct placed *placed, int stretch, double t) {
    const double *ends = placed->stretches.t + stretch, aside = aside_of(plan, placed, stretch);
    return stretch > 0 && t < ends[0] + aside ? 1 : t > ends[1] - aside ? -1 : 0;
}

/* ---- Outputs, and their derivatives ---- */

/* The outputs of the motion of a case. */
struct outputs {
    double *t; /* (count) [s] */
    int count;
    int width;  /* values of an output: the signals, and an objective rd.integral */
    double *at; /* ((count + 2) x width) */
    double *by; /* (values x (count + 2) x width) */
};

static void outputs_start(const struct plan *plan, struct outputs *outputs, size_t most) {
    *outputs = (struct outputs){.t = format_allocate_large(most + 1, sizeof *outputs->t),
                                .width = plan->signal_count + (plan->file->measure == PLAN_INTEGRAL)};
}

static void add_time(struct outputs *outputs, double t) {
    outputs->t[outputs->count++] = t;
}

/* Makes the times ascending and distinct; the last one is the end. */
static void arrange(const struct plan *plan, double end, struct outputs *outputs) {
    const double start = plan->batch.t, same = plan_same_part * (end - start);
    int kept = 0;
    qsort(outputs->t, (size_t)outputs->count, sizeof *outputs->t, format_ascending);
    for (int i = 0; i < outputs->count; i++)
        if (outputs->t[i] > (kept ? outputs->t[kept - 1] : start) + same && outputs->t[i] < end - same)
            outputs->t[kept++] = outputs->t[i];
    outputs->t[kept++] = end;
    outputs->count = kept;
}

/* The output at a time; 0 is the start. */
static int output_at(const struct plan *plan, const struct outputs *outputs, double t) {
    int low = -1, high = outputs->count - 1; /* t is above time `low`; -1: the start */
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        *(outputs->t[middle] < t ? &low : &high) = middle;
    }
    const double before = low < 0 ? plan->batch.t : outputs->t[low];
    return (t - before < outputs->t[high] - t ? low : high) + 1;
}

/* The derivative by x; NAN if there is none. */
static double derivative(const struct plan *plan, const struct outputs *outputs, int value, int row,
                         int signal) {
    const size_t width = (size_t)outputs->width, rows = (size_t)outputs->count + 2;
    const double by = outputs->by[((size_t)value * rows + (size_t)row) * width + (size_t)signal];
    return by * (plan->values[value].to - plan->values[value].from);
}

static double derivative_or_zero(struct plan *plan, double by) {
    plan->lost += isnan(by);
    return isnan(by) ? 0 : by;
}

/* The motion whose outputs are computed. */
struct computed {
    const struct plan *plan;
    double span; /* [s] */
};

static void write_values(void *context, const struct refdyn_batch_case *one, double *values) {
    plan_write_signals(((const struct computed *)context)->plan, one, values);
}

static int see_step(void *context, const struct refdyn_batch_case *one) {
    const struct computed *computed = context;
    return plan_add_step(computed->plan, one, computed->span);
}

/* Computes the outputs. */
static void run_outputs(struct plan *plan, struct plan_point *point, const struct placed *placed,
                        struct outputs *outputs) {
    const size_t size = ((size_t)outputs->count + 2) * (size_t)outputs->width + 1;
    struct refdyn_underivable *underivable =
        memory_scratch(&format_memory, (size_t)plan->count * sizeof *underivable);
    struct refdyn_batch batch = placed->motions->batch;
    struct computed computed = {plan, end_of(placed) - plan->batch.t};
    batch.times = outputs->t;
    batch.time_count = outputs->count;
    outputs->at = format_allocate_large(size, sizeof *outputs->at);
    outputs->by = format_allocate_large(size * (size_t)plan->count, sizeof *outputs->by);
    struct refdyn_derivatives given = {.batch = &batch,
                                       .number = placed->one,
                                       .count = plan->count,
                                       .variables = plan->variables,
                                       .end_rates = rates_of(plan, placed, placed->stretches.count),
                                       .width = outputs->width,
                                       .values = write_values,
                                       .step = plan->file->measure == PLAN_INTEGRAL ? see_step : NULL,
                                       .context = &computed,
                                       .at = outputs->at,
                                       .derivatives = outputs->by,
                                       .keeps_means = 1,
                                       .underivable = underivable};
    const int status = refdyn_derivatives_run(&given);
    plan->motions += 1 + given.copies;
    if (status || given.outputs < outputs->count + 1)
        plan_note_failure(plan, point, status ? status : given.motion.status, given.motion.t);
}

static void outputs_release(struct outputs *outputs) {
    free(outputs->t);
    free(outputs->at);
    free(outputs->by);
}

/* ---- Extremes ---- */

/* Lists what the derivatives of an extreme in a stretch need. */
static void add_extreme(const struct plan *plan, const struct placed *placed, int stretch, double t,
                        struct outputs *outputs) {
    if (isnan(t))
        return;
    const int side = side_of(plan, placed, stretch, t);
    const double event = placed->stretches.t[side < 0 ? stretch + 1 : stretch],
                 aside = side * aside_of(plan, placed, stretch);
    add_time(outputs, side ? event + aside : t);
    if (side)
        add_time(outputs, event + 2 * aside);
}

/* Derivatives of an extreme at a time event: values are continued along a line from two outputs. */
static void differentiate_at_event(const struct plan *plan, const struct placed *placed,
                                   const struct outputs *outputs, int signal, int stretch, int side,
                                   double *by) {
    const int boundary = side < 0 ? stretch + 1 : stretch;
    const double t = placed->stretches.t[boundary], start = plan->batch.t,
                 part = (t - start) / (end_of(placed) - start),
                 aside = side * aside_of(plan, placed, stretch);
    const double *rates = rates_of(plan, placed, boundary),
                 *end_rates = rates_of(plan, placed, placed->stretches.count);
    const int near = output_at(plan, outputs, t + aside), far = output_at(plan, outputs, t + 2 * aside);
    const double rate =
        (outputs->at[far * outputs->width + signal] - outputs->at[near * outputs->width + signal]) / aside;
    for (int k = 0; k < plan->count; k++)
        by[k] = 2 * derivative(plan, outputs, k, near, signal) - derivative(plan, outputs, k, far, signal) +
                rate * (plan->values[k].to - plan->values[k].from) * (rates[k] - part * end_rates[k]);
}

/* Derivatives of an extreme in a stretch by x. At the end of the motion those of the last output, unless
 * values jump there. */
static void differentiate_extreme(struct plan *plan, const struct placed *placed,
                                  const struct outputs *outputs, int signal, int stretch,
                                  struct plan_extreme extreme, double *by) {
    if (isnan(extreme.t))
        return;
    const int side = side_of(plan, placed, stretch, extreme.t), row = output_at(plan, outputs, extreme.t);
    const bool is_end = side < 0 && stretch + 1 == placed->stretches.count;
    bool jumps = false;
    for (int k = 0; k < plan->count; k++) {
        by[k] = derivative(plan, outputs, k, is_end ? outputs->count : row, signal);
        jumps = jumps || isnan(by[k]);
    }
    if (side && (jumps || !is_end))
        differentiate_at_event(plan, placed, outputs, signal, stretch, side, by);
    for (int k = 0; k < plan->count; k++)
        by[k] = derivative_or_zero(plan, by[k]);
}

/* Whether the objective is the value of a column at one time. */
static bool has_extreme_objective(const struct plan *plan) {
    return plan->file->measure == PLAN_LARGEST || plan->file->measure == PLAN_AT_END;
}

/* The stretch of a part; values at the end of the motion are in the last one. */
static int stretch_of(const struct placed *placed, int part, bool is_at_end) {
    return is_at_end ? placed->stretches.count - 1 : part / PLAN_PARTS;
}

/* part: within the case */
static void differentiate_part(struct plan *plan, struct plan_point *point, const struct placed *placed,
                               int part, const struct outputs *outputs) {
    const int number = plan_part(plan, placed->one, 0, PLAN_BEGIN) + part;
    for (int i = 0; i < 2 * plan->limit_count; i++)
        differentiate_extreme(plan, placed, outputs, plan->limits[i / 2].signal,
                              stretch_of(placed, part, plan->limits[i / 2].is_at_end),
                              plan_extremes(plan, point, number, 0)[i],
                              point->extreme_by + (2 * number * plan->limit_count + i) * plan->count);
    if (has_extreme_objective(plan))
        differentiate_extreme(plan, placed, outputs, plan->objective,
                              stretch_of(placed, part, plan->file->measure == PLAN_AT_END),
                              point->objectives[number], point->objective_by + number * plan->count);
}

static void add_part(const struct plan *plan, const struct plan_point *point, const struct placed *placed,
                     int part, struct outputs *outputs) {
    const int number = plan_part(plan, placed->one, 0, PLAN_BEGIN) + part;
    for (int i = 0; i < 2 * plan->limit_count; i++)
        add_extreme(plan, placed, stretch_of(placed, part, plan->limits[i / 2].is_at_end),
                    plan_extremes(plan, point, number, 0)[i].t, outputs);
    if (has_extreme_objective(plan))
        add_extreme(plan, placed, stretch_of(placed, part, plan->file->measure == PLAN_AT_END),
                    point->objectives[number].t, outputs);
}

/* An integral is the last value of the last output. */
static void differentiate_integral(struct plan *plan, struct plan_point *point, const struct placed *placed,
                                   const struct outputs *outputs) {
    double *by = point->objective_by + plan_part(plan, placed->one, 0, PLAN_BEGIN) * plan->count;
    for (int k = 0; k < plan->count; k++)
        by[k] = derivative_or_zero(plan, derivative(plan, outputs, k, outputs->count, outputs->width - 1));
}

static void differentiate_case(struct plan *plan, struct plan_point *point, const struct placed *placed) {
    const int parts = PLAN_PARTS * placed->stretches.count;
    struct outputs outputs;
    outputs_start(plan, &outputs, (size_t)(2 * (2 * plan->limit_count + 1) * parts));
    for (int part = 0; part < parts; part++)
        add_part(plan, point, placed, part, &outputs);
    arrange(plan, end_of(placed), &outputs);
    run_outputs(plan, point, placed, &outputs);
    for (int part = 0; part < parts && point->is_done; part++)
        differentiate_part(plan, point, placed, part, &outputs);
    if (point->is_done && plan->file->measure == PLAN_INTEGRAL)
        differentiate_integral(plan, point, placed, &outputs);
    outputs_release(&outputs);
}

void plan_point_differentiate(struct plan *plan, struct plan_point *point) {
    const struct memory_mark mark = memory_mark(&format_memory);
    const size_t parts = (size_t)plan->part_count, count = (size_t)plan->count;
    struct motions motions;
    if (point->has_gradients || !point->is_done)
        return;
    plan_describe(plan, point->x, 1, &motions);
    memset(point->extreme_by, 0, 2 * parts * (size_t)plan->limit_count * count * sizeof(double));
    memset(point->objective_by, 0, parts * count * sizeof(double));
    for (int one = 0; one < plan->case_count && plan->file->measure == PLAN_PARAMETER; one++) {
        const struct plan_value *value = &plan->values[plan->objective];
        point->objective_by[plan_part(plan, one, 0, PLAN_BEGIN) * plan->count + plan->objective] =
            value->to - value->from;
    }
    for (int one = 0; one < plan->case_count && plan->signal_count > 0 && point->is_done; one++) {
        struct placed placed;
        const int status = start(plan, &motions, one, &placed);
        if (status == REFDYN_OK)
            differentiate_case(plan, point, &placed);
        else
            plan_note_failure(plan, point, status, plan->batch.t);
    }
    point->has_gradients = point->is_done;
    memory_back(&format_memory, mark);
}
