/*
 * Detects jumps and kinks of friction within a collocation step by divided differences of its accelerations.
 *
 * In: the accelerations at the start and at the stages. Out: an error that stiffness does not damp.
 */
#include "runtime/core/methods/methods.h"

#include <math.h>

/* Largest radians a step of a smooth motion: a jump or a kink anywhere in the step looks like more than 2.4.
 */
static const double smooth = 2.3;
/* Radians that represent a jump or a kink. With this value the error is that of the velocity over about ten
 * steps, several times the error of the position over h. */
static const double unresolved = 50;
/* Defect of the polynomial over the difference of order s: about the largest product of distances from s + 1
 * nodes. */
static const double missed = 0.005;
/* The polynomial follows the accelerations if its defect is below this fraction of the largest one. */
static const double followed = 0.25;
/* Rates that change by less in a step count as at rest [unit/s]: a hundredth of the smallest width of
 * friction. */
static const double at_rest = 1e-12;
/* Error, in tolerances, of a step whose defect equals that fraction. */
static const double refused = 2;

static double node(const struct refdyn_collocation_table *table, int j) {
    return j == 0 ? 0 : table->c[j - 1];
}

/* Replaces differences by those of the next order. Returns the largest, times order!/smooth^order. */
static double differ(const struct refdyn_step *step, int order, double *d) {
    const struct refdyn_collocation_table *table = step->method->table;
    const int n = step->n;
    double largest = 0;
    for (int j = 0; j + order <= table->stages; j++) {
        const double distance = node(table, j + order) - node(table, j);
        for (int i = 0; i < n; i++)
            d[j * n + i] = (d[(j + 1) * n + i] - d[j * n + i]) / distance;
        largest = fmax(largest, refdyn_step_largest_change(step, d + j * n, NULL));
    }
    for (int k = 1; k <= order; k++)
        largest *= k / smooth;
    return largest;
}

/* most (n) := the largest of `count` accelerations of each coordinate. */
static void find_most(const double *accelerations, int count, int n, double *most) {
    for (int j = 0; j < n; j++)
        most[j] = 0;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < n; j++)
            most[j] = fmax(most[j], fabs(accelerations[i * n + j]));
}

/* Returns the largest relative defect of the polynomial among coordinates whose rate changes; top (n):
 * differences of order s. */
static double largest_part_missed(const struct refdyn_step *step, const double *most, const double *top,
                                  double h) {
    double part = 0;
    for (int j = 0; j < step->n; j++)
        if (h * missed * fabs(top[j]) > at_rest * step->units[j])
            part = fmax(part, missed * fabs(top[j]) / most[j]);
    return part;
}

double refdyn_unsmooth_error(const struct refdyn_step *step, double *accelerations, double h) {
    const struct refdyn_collocation_table *table = step->method->table;
    const int s = table->stages;
    double *most = step->stage, low[2] = {0, 0}, error = table->share * h * h;
    find_most(accelerations, s + 1, step->n, most);
    for (int order = 1; order <= s - 2; order++) {
        low[0] = low[1];
        low[1] = differ(step, order, accelerations);
    }
    const double before = differ(step, s - 1, accelerations), last = differ(step, s, accelerations);
    const double high = fmax(before, last);
    if (high <= fmax(low[0], low[1]))
        return 0;
    for (int k = 1; k <= s; k++)
        error *= table->c[k - 1] * smooth / k;
    error *= high * pow(unresolved, step->method->order - 1 - s);
    const double part = largest_part_missed(step, most, accelerations, h);
    return part > followed ? fmax(error, refused * step->tolerance * part / followed) : error;
}
