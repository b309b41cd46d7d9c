/*
 * Estimates the error of a whole motion from two runs: of positions, and of rates, accelerations and forces.
 *
 * If the error of the other run is a fraction s of the error of the judged run, the runs differ by |1 - s| of
 * the latter (Richardson; Hairer, Norsett and Wanner, Solving ODEs I, II.4). With fixed steps s =
 * (h_other/h)^p, p the order of the method. With adaptive steps errors are proportional to the tolerance,
 * also where stability limits the steps.
 */
#include "runtime/tool/motions/simulate/simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Part of the way of the motion. Runs that differ by more are not near the solution: their errors do not
 * follow the orders, or grow as in a chaotic motion. */
static const double near_part = 0.05;
/* A way shorter than this, or than so many tolerances, counts as this long: a body at rest moves by rounding,
 * and by the errors of steps [model's length, at most 1 m, and rad]. */
static const double least_way = 1e-6, least_tolerances = 2;
/* Times of events are compared to the square root of this part of the motion, or of its tolerance. */
static const double time_part = 1e-12;

void simulate_track_start(struct track *track, const struct refdyn_model *model, long room) {
    const size_t outputs = (size_t)room;
    *track = (struct track){.model = model};
    track->t = format_allocate_large(outputs, sizeof *track->t);
    track->q = format_allocate_large(outputs * (size_t)model->n, sizeof *track->q);
    track->r = format_allocate_large(outputs * 3 * (size_t)model->point_count, sizeof *track->r);
}

void simulate_track_keep(struct track *track, const struct record_table *table, long room) {
    track->table = table;
    track->values = format_allocate_large((size_t)room * (size_t)table->count, sizeof *track->values);
}

void simulate_track_add(struct track *track, const struct refdyn_integrator *integrator) {
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    const long i = track->count++;
    track->t[i] = integrator->t;
    const int joints = refdyn_joint_count(model);
    memcpy(track->q + i * model->n, integrator->q, (size_t)joints * sizeof *track->q);
    memcpy(track->q + i * model->n + joints, integrator->qd + joints,
           (size_t)(model->n - joints) * sizeof *track->q);
    if (model->point_count > 0)
        model->r(work->p, work->x, integrator->t, integrator->q, integrator->qd,
                 track->r + 3 * i * model->point_count);
    if (track->table)
        memcpy(track->values + i * track->table->count, track->table->values,
               (size_t)track->table->count * sizeof *track->values);
}

void simulate_track_release(struct track *track) {
    free(track->t);
    free(track->q);
    free(track->r);
    free(track->values);
    *track = (struct track){.count = 0};
}

/* ---- Positions ---- */

double simulate_smallest_unit(const struct refdyn_model *model) {
    return model->length > 0 ? fmin(1, model->length) : 1;
}

static long count_common(const struct track *a, const struct track *b) {
    const long most = a->count < b->count ? a->count : b->count;
    long count = 0;
    while (count < most && a->t[count] == b->t[count])
        count++;
    return count;
}

static double distance(const double *a, const double *b) {
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static void raise_peak(struct peak *peak, double error, double t) {
    if (!(error <= peak->error)) /* NaN counts as larger */
        *peak = (struct peak){error, t};
}

/* NaN if one of them is. */
static double larger(double a, double b) {
    return isnan(a) || a > b ? a : b;
}

double simulate_track_distance(const struct track *a, long i, const struct track *b, long j) {
    const int n = a->model->n, points = a->model->point_count;
    double largest = 0;
    for (int k = 0; k < points; k++)
        largest = larger(largest, distance(a->r + 3 * (i * points + k), b->r + 3 * (j * points + k)));
    for (int k = 0; k < n && points == 0; k++)
        largest = larger(largest, fabs(a->q[i * n + k] - b->q[j * n + k]));
    return largest;
}

double simulate_track_way(const struct track *track, long count) {
    double way = 0;
    for (long i = 0; i < count; i++)
        way = fmax(way, simulate_track_distance(track, i, track, 0));
    return way;
}

static void compare_output(struct estimate *estimate, const struct track *a, const struct track *b, long i,
                           double factor) {
    const int n = estimate->model->n, points = estimate->model->point_count;
    for (int k = 0; k < points; k++) {
        const long at = 3 * (i * points + k);
        const double error = factor * distance(a->r + at, b->r + at);
        estimate->distances[k * estimate->count + i] = error;
        raise_peak(&estimate->points[k], error, a->t[i]);
    }
    for (int j = 0; j < n; j++)
        raise_peak(&estimate->coordinates[j], factor * fabs(a->q[i * n + j] - b->q[i * n + j]), a->t[i]);
    raise_peak(&estimate->largest, factor * simulate_track_distance(a, i, b, i), a->t[i]);
}

/* ---- Rates, accelerations and forces ---- */

static bool is_alike(const struct estimate *estimate, int a, int b) {
    const char *const *units = estimate->table->units;
    return estimate->columns[a].kind == estimate->columns[b].kind &&
           (units[a] && units[b] ? strcmp(units[a], units[b]) == 0 : units[a] == units[b]);
}

/* A value that is not unique is NaN in both motions. */
static void compare_column(struct column_error *error, const double *a, const double *b, double t,
                           double factor) {
    if (isnan(*a) && isnan(*b))
        return;
    raise_peak(&error->peak, factor * fabs(*a - *b), t);
    error->scale = fmax(error->scale, fabs(*a));
}

static void compare_columns(struct estimate *estimate, const struct track *a, const struct track *b,
                            double factor) {
    const int width = a->table->count;
    estimate->table = a->table;
    estimate->columns = format_allocate((size_t)width, sizeof *estimate->columns);
    for (int k = 0; k < width; k++) {
        struct column_error *error = &estimate->columns[k];
        error->kind = record_table_kind(a->table, k);
        for (long i = 0; i < estimate->count && error->kind != RECORD_OTHER; i++)
            compare_column(error, a->values + i * width + k, b->values + i * width + k, a->t[i], factor);
    }
    for (int k = 0; k < width; k++)
        for (int j = 0; j < width; j++)
            if (is_alike(estimate, k, j))
                estimate->columns[k].scale = fmax(estimate->columns[k].scale, estimate->columns[j].scale);
}

static double relative(const struct column_error *error) {
    return error->peak.error > 0 ? error->peak.error / error->scale : 0;
}

/* The column of a kind with the largest error relative to its scale; -1 if there is none. */
static int find_worst(const struct estimate *estimate, enum record_kind kind) {
    int worst = -1;
    for (int k = 0; estimate->table && k < estimate->table->count; k++)
        if (estimate->columns[k].kind == kind &&
            (worst < 0 || relative(&estimate->columns[k]) > relative(&estimate->columns[worst])))
            worst = k;
    return worst;
}

static const char *const kind_names[] = {
    [RECORD_RATE] = "rates", [RECORD_ACCELERATION] = "accelerations", [RECORD_FORCE] = "forces"};

static void print_kinds(const struct estimate *estimate) {
    if (!estimate->table)
        fputs("  rates, accelerations and forces: no estimate; a finer motion that bounds their errors "
              "fails\n",
              stderr);
    for (enum record_kind kind = RECORD_RATE; kind < RECORD_KINDS; kind++) {
        const int k = find_worst(estimate, kind);
        if (k < 0)
            continue;
        const struct column_error *error = &estimate->columns[k];
        const char *unit = estimate->table->units[k];
        fprintf(stderr, "  %-13s %.2g %s, %.1g of the largest, in %s at t = %.6g s\n", kind_names[kind],
                error->peak.error, unit ? unit : "", relative(error), estimate->table->names[k],
                error->peak.t);
    }
}

static void put_kinds(const struct estimate *estimate, struct document *document) {
    for (enum record_kind kind = RECORD_RATE; kind < RECORD_KINDS; kind++) {
        if (!estimate->table) {
            format_put_null(document, kind_names[kind]);
            continue;
        }
        format_put_open(document, kind_names[kind], '{');
        for (int k = 0; k < estimate->table->count; k++)
            if (estimate->columns[k].kind == kind)
                format_put_number(document, estimate->table->names[k], estimate->columns[k].peak.error);
        format_put_close(document, '}');
    }
}

/* ---- The estimate ---- */

void simulate_estimate_make(struct estimate *estimate, const struct track *judged, const struct track *other,
                            double share) {
    const struct refdyn_model *model = judged->model;
    const long count = count_common(judged, other);
    const double factor = 1 / fabs(1 - share);
    *estimate = (struct estimate){.model = model, .count = count, .t = judged->t};
    estimate->distances =
        format_allocate_large((size_t)(count * model->point_count), sizeof *estimate->distances);
    estimate->points = format_allocate((size_t)model->point_count, sizeof *estimate->points);
    estimate->coordinates = format_allocate((size_t)model->n, sizeof *estimate->coordinates);
    for (long i = 0; i < count; i++)
        compare_output(estimate, judged, other, i, factor);
    if (judged->table && other->table)
        compare_columns(estimate, judged, other, factor);
    estimate->difference = estimate->largest.error / factor;
    const double least = fmax(least_way, least_tolerances * judged->tol) * simulate_smallest_unit(model);
    const double way = fmax(simulate_track_way(judged, count), least);
    estimate->is_trusted = estimate->difference <= near_part * way;
}

/* Where a value barely reaches zero, errors of times are as square roots of those of positions. */
void simulate_estimate_events(struct estimate *estimate, const struct track *judged,
                              const struct motion *motion, const struct motion *other) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const double way = simulate_track_way(judged, estimate->count);
    const double part = estimate->difference > 0 ? fmin(estimate->difference / way, 1) : 0;
    const double most =
        (integrator->t - motion->record.from) * sqrt(fmax(part, fmax(integrator->options.tol, time_part)));
    estimate->events =
        record_events_compare(&motion->record.events, &other->record.events, integrator->t, most);
    estimate->is_trusted = estimate->is_trusted && !estimate->events.exists;
}

static void print_warning(const struct estimate *estimate) {
    fputs("refdyn: warning: the estimated error is not reliable: ", stderr);
    if (!estimate->events.exists) {
        fputs("a finer run takes another path (--tol or --step too large, or chaos)\n", stderr);
        return;
    }
    fputs("a finer run differs in its events, first in", stderr);
    record_difference_print(&estimate->events, estimate->model, stderr);
    fprintf(stderr, ", which %s; a smaller --step-max, --step or --tol may show all\n",
            estimate->events.is_of_other ? "this motion misses" : "it lacks");
}

void simulate_estimate_print(const struct estimate *estimate) {
    const struct refdyn_model *model = estimate->model;
    fprintf(stderr, "error        %.2g estimated, largest at t = %.6g s\n", estimate->largest.error,
            estimate->largest.t);
    for (int k = 0; k < model->point_count; k++)
        fprintf(stderr, "  %-10s %.2g m at t = %.6g s\n", model->points[k], estimate->points[k].error,
                estimate->points[k].t);
    for (int j = 0; j < model->n; j++)
        fprintf(stderr, "  %-10s %.2g %s at t = %.6g s\n", model->coordinates[j].name,
                estimate->coordinates[j].error, model->coordinates[j].unit, estimate->coordinates[j].t);
    print_kinds(estimate);
    if (!estimate->is_trusted)
        print_warning(estimate);
}

void simulate_estimate_put(const struct estimate *estimate, struct document *document) {
    const struct refdyn_model *model = estimate->model;
    format_put_open(document, "error", '{');
    format_put_array(document, "t", estimate->t, (int)estimate->count);
    format_put_open(document, "points", '{');
    for (int k = 0; k < model->point_count; k++)
        format_put_array(document, model->points[k], estimate->distances + k * estimate->count,
                         (int)estimate->count);
    format_put_close(document, '}');
    format_put_open(document, "coordinates", '{');
    for (int j = 0; j < model->n; j++)
        format_put_number(document, model->coordinates[j].name, estimate->coordinates[j].error);
    format_put_close(document, '}');
    put_kinds(estimate, document);
    format_put_number(document, "largest", estimate->largest.error);
    format_put_number(document, "largest_t", estimate->largest.t);
    format_put_truth(document, "is_trusted", estimate->is_trusted);
    format_put_close(document, '}');
    const struct record_writer writer = scene_writer(document);
    if (estimate->events.exists)
        record_difference_put(&estimate->events, model, &writer);
}

void simulate_estimate_release(struct estimate *estimate) {
    free(estimate->distances);
    *estimate = (struct estimate){.count = 0};
}
