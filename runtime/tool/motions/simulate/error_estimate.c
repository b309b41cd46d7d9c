/*
 * Estimates the error of a whole motion from the positions of two runs.
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
/* Times of events are compared to the square root of this part of the motion, or of its tolerance. */
static const double time_part = 1e-12;

void simulate_track_start(struct track *track, const struct refdyn_model *model, long room) {
    const size_t outputs = (size_t)room;
    *track = (struct track){.model = model};
    track->t = format_allocate_large(outputs, sizeof *track->t);
    track->q = format_allocate_large(outputs * (size_t)model->n, sizeof *track->q);
    track->r = format_allocate_large(outputs * 3 * (size_t)model->point_count, sizeof *track->r);
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
}

void simulate_track_release(struct track *track) {
    free(track->t);
    free(track->q);
    free(track->r);
    *track = (struct track){.count = 0};
}

/* ---- The estimate ---- */

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
    estimate->difference = estimate->largest.error / factor;
    estimate->is_trusted = estimate->difference <= near_part * simulate_track_way(judged, count);
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
