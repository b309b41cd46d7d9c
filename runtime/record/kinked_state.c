/*
 * A state that lies exactly on a kink or jump of forces or rows: its linear equations differ on both sides.
 *
 * In: the linear equations of a state, and the emitted values that change their sign at kinks (`event`, after
 * the events) with their gradients (`event_terms`). Out: the first kink at the state at which forces, K or D
 * differ. The state is moved to both sides along the gradient, twice: what a kink changes stays as large when
 * the distance shrinks; what is smooth shrinks with it, as with v |v| at rest.
 */
#include "runtime/record/record.h"

#include <math.h>
#include <string.h>

/* The state is on a kink if it is at most this far from it; the two distances of the moved states [rad, m,
 * rad/s, m/s]. */
static const double on_kink = 1e-9, far_side = 1e-7, near_side = 1e-8;
/* Part of the difference at far_side that remains at near_side. */
static const double persists = 0.5;
/* Rounding of an entry, relative to the largest one, and the smallest difference that is reported. */
static const double rounding = 1e-9, least_part = 0.005;

/* Forces (n), K and D (n x n) on one side. */
static int evaluate(const struct record_small_motions *motions, const struct record_algebra *algebra,
                    const double *gradient, double distance, double *out) {
    struct refdyn_workspace *work = motions->work;
    const struct refdyn_model *model = work->model;
    const int n = model->n, m = model->m, given = 2 * n + 1 + m;
    double *q = record_allocate_matrix(algebra, 1, n), *qd = record_allocate_matrix(algebra, 1, given);
    double *tangent = record_allocate_matrix(algebra, 1, n + m + 3 * (n + m) * n);
    memcpy(qd, motions->linear.given, (size_t)given * sizeof *qd);
    for (int j = 0; j < n; j++) {
        q[j] = motions->q[j] + distance * gradient[j];
        qd[j] += distance * gradient[n + j];
    }
    const int status = refdyn_equations(work, motions->t, q, qd);
    model->tangent(work->p, work->x, motions->t, q, qd, tangent);
    memcpy(out, work->f, (size_t)n * sizeof *out);
    memcpy(out + n, tangent + n + m + 3 * m * n, (size_t)(2 * n * n) * sizeof *out);
    return status;
}

/* The largest difference that persists, relative to the entry. values: those of both sides, far and near. */
static double compare(double *const *values, int first, int count) {
    double largest = 0, worst = 0;
    for (int i = first; i < first + count; i++)
        largest = fmax(largest, fmax(fabs(values[2][i]), fabs(values[3][i])));
    for (int i = first; i < first + count; i++) {
        const double far = fabs(values[0][i] - values[1][i]), near = fabs(values[2][i] - values[3][i]);
        if (near > persists * far && near > rounding * largest)
            worst = fmax(worst, near / fmax(fabs(values[2][i]), fabs(values[3][i])));
    }
    return worst;
}

/* By what part forces, K or D differ on both sides of a kink with this gradient (2 n), of length 1. */
static double find_part(const struct record_small_motions *motions, const struct record_algebra *algebra,
                        const double *gradient) {
    const int n = motions->work->model->n;
    const double distances[] = {-far_side, far_side, -near_side, near_side};
    double *values[4];
    for (int k = 0; k < 4; k++) {
        values[k] = record_allocate_matrix(algebra, 1, n + 2 * n * n);
        if (evaluate(motions, algebra, gradient, distances[k], values[k]))
            return 0;
    }
    return fmax(compare(values, 0, n), fmax(compare(values, n, n * n), compare(values, n + n * n, n * n)));
}

/* Scales the gradient of value i to length 1. Returns its length. */
static double take_gradient(const double *terms, int i, int count, int n, double *gradient) {
    double length = 0;
    for (int j = 0; j < n; j++) {
        gradient[j] = terms[count + i * n + j];
        gradient[n + j] = terms[count + (count + i) * n + j];
        length = hypot(length, hypot(gradient[j], gradient[n + j]));
    }
    for (int j = 0; j < 2 * n && length > 0; j++)
        gradient[j] /= length;
    return length;
}

struct record_kink record_find_kink(const struct record_small_motions *motions,
                                    const struct record_algebra *algebra) {
    const struct refdyn_workspace *work = motions->work;
    const struct refdyn_model *model = work->model;
    const int n = model->n, count = model->event_count + model->kink_count;
    struct record_kink found = {-1, 0};
    if (model->kink_count == 0)
        return found;
    double *values = record_allocate_matrix(algebra, 1, count),
           *gradient = record_allocate_matrix(algebra, 1, 2 * n);
    double *terms = record_allocate_matrix(
        algebra, 1, count * (1 + 2 * n) + 2 * model->event_count + model->change_count);
    model->event(work->p, work->x, motions->t, motions->q, motions->qd, values);
    model->event_terms(work->p, work->x, motions->t, motions->q, motions->qd, terms);
    for (int i = model->event_count; i < count && found.coordinate < 0; i++) {
        const double length = take_gradient(terms, i, count, n, gradient);
        if (!(length > 0 && fabs(values[i]) <= on_kink * length))
            continue;
        found.part = find_part(motions, algebra, gradient);
        for (int j = 0; j < 2 * n && found.part >= least_part; j++)
            if (found.coordinate < 0 || fabs(gradient[j]) > fabs(gradient[found.coordinate]))
                found.coordinate = j;
    }
    return found;
}

void record_print_kink(const struct record_kink *kink, const struct refdyn_model *model, FILE *out) {
    if (kink->coordinate < 0)
        return;
    fprintf(
        out,
        "refdyn: warning: the state is exactly on a kink or jump of forces or rows: the linear equations of "
        "both sides differ by %.2g %%; change %s%s slightly for one side\n",
        100 * kink->part, model->coordinates[kink->coordinate % model->n].name,
        kink->coordinate < refdyn_joint_count(model) ||
                kink->coordinate >= model->n + refdyn_joint_count(model)
            ? ""
            : "_d");
}
