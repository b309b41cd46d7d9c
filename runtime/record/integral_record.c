/*
 * The integral of a column over a motion, step by step.
 *
 * In: a motion after each of its steps. Out: the integral of the column on the interpolant of the steps.
 * Steps end at events, where values may jump, so that the quadrature stays just inside them. Within a step a
 * column may kink or jump where the motion has no event. There the quadrature halves its panels until they no
 * longer matter. Its panels include their ends, so that no jump is between two of them.
 */
#include "runtime/record/record.h"

#include <float.h>
#include <math.h>

enum {
    PANELS_LEAST = 100, /* of a motion: long steps do not see a peak of a column that drives nothing */
    NOISY = 6 /* generations in which errors did not fall, after which they are noise of the values */
};
/* A panel has settled when both of its formulas differ by at most this part of the integral of the magnitude.
 */
static const double settled = 1e-12;
/* Errors of noise are alike within this part. */
static const double alike = 0.05;
/* Panels are not halved below this part of the time, where their places are rounding. */
static const double shortest = 64 * DBL_EPSILON;

/* Distance of the quadrature from the ends of a step, as a part of the step or of the time. */
static const double inside = 1e-11;

/* Kronrod's extensions of Lobatto's formula, of 7 and 13 places in -1 ... 1 (Gander and Gautschi, Adaptive
 * quadrature revisited, BIT 40, 2000). The first places are the ends, and the last weight is that of the
 * middle. The shorter formula has each second place. */
enum { PAIRS = 6 };
static const double places[PAIRS] = {
    1, 0.942882415695480, 0.816496580927726, 0.641853342345781, 0.447213595499958, 0.236383199662150};
static const double weights[PAIRS + 1] = {0.0158271919734802, 0.0942738402188500, 0.155071987336585,
                                          0.188821573960182,  0.199773405226859,  0.224926465333340,
                                          0.242611071901408};
static const double weights_of_less[PAIRS / 2 + 1] = {77.0 / 1470, 432.0 / 1470, 625.0 / 1470, 672.0 / 1470};

/* The longer formula, its difference from the shorter one, and the integral of the magnitude. */
struct quadrature {
    double value, error, size;
};

/* A part of the step, and the values at its ends and its middle. */
struct panel {
    double from, to, begin, middle, end;
    struct quadrature found;
};

void record_integral_begin(struct record_integral *integral, struct record_table *table, int place,
                           double span, double scale) {
    *integral = (struct record_integral){.table = table,
                                         .place = place,
                                         .longest = span / PANELS_LEAST,
                                         .t = table->integrator->t,
                                         .scale = scale};
}

/* The value at a time of the last step. A time at which there is none keeps *status. */
static double value_at(const struct record_integral *integral, double t, int *status) {
    const int shown = record_table_look(integral->table, t);
    *status = shown ? shown : *status;
    return shown ? 0 : integral->table->values[integral->place];
}

/* Adds the values at both places of a pair; the middle is a pair without its second value. */
static void add_pair(struct quadrature *sum, int pair, double low, double high) {
    const double less = pair % 2 ? 0 : weights_of_less[pair / 2];
    sum->value += weights[pair] * (low + high);
    sum->error += (weights[pair] - less) * (low + high);
    sum->size += weights[pair] * (fabs(low) + fabs(high));
}

/* The values at both ends are known. */
static void integrate_panel(const struct record_integral *integral, struct panel *panel, int *status) {
    const double half = (panel->to - panel->from) / 2, t = panel->from + half;
    struct quadrature sum = {0, 0, 0};
    panel->middle = value_at(integral, t, status);
    add_pair(&sum, 0, panel->begin, panel->end);
    add_pair(&sum, PAIRS, panel->middle, 0);
    for (int k = 1; k < PAIRS && *status == REFDYN_OK; k++)
        add_pair(&sum, k, value_at(integral, t - places[k] * half, status),
                 value_at(integral, t + places[k] * half, status));
    panel->found = (struct quadrature){half * sum.value, half * fabs(sum.error), half * sum.size};
}

/* Do both halves of a panel have errors that add up to about its own? One jump or kink is in one half. */
static bool is_noise(double whole, double left, double right) {
    return fmin(left, right) > alike * fmax(left, right) && left + right > alike * whole;
}

/* Adds a panel, or its halves. generations: those it comes from whose halves looked like noise. */
static void add_panel(struct record_integral *integral, const struct panel *panel, int generations,
                      int *status) {
    const struct quadrature *found = &panel->found;
    const double t = panel->from + (panel->to - panel->from) / 2;
    if (*status != REFDYN_OK ||
        !(found->error > settled * (integral->scale + integral->size + found->size)) ||
        panel->to - panel->from <= shortest * fmax(fabs(panel->from), fabs(panel->to)) ||
        generations == NOISY) {
        integral->value += found->value;
        integral->size += found->size;
        return;
    }
    struct panel left = {.from = panel->from, .to = t, .begin = panel->begin, .end = panel->middle},
                 right = {.from = t, .to = panel->to, .begin = panel->middle, .end = panel->end};
    integrate_panel(integral, &left, status);
    integrate_panel(integral, &right, status);
    generations += is_noise(found->error, left.found.error, right.found.error);
    add_panel(integral, &left, generations, status);
    add_panel(integral, &right, generations, status);
}

int record_integral_pass(struct record_integral *integral) {
    struct refdyn_integrator *integrator = integral->table->integrator;
    const double t_now = integrator->t, begin = fmax(integral->t, integrator->t_begin), h = t_now - begin;
    if (!(h > 0))
        return REFDYN_OK;
    const double aside = fmin(inside * fmax(h, fmax(fabs(begin), fabs(t_now))), h / 4), first = begin + aside,
                 length = h - 2 * aside, count = ceil(h / integral->longest);
    int status = REFDYN_OK;
    struct panel panel = {.to = first, .end = value_at(integral, first, &status)};
    integral->value += aside * panel.end;
    for (int i = 1; i <= count && status == REFDYN_OK; i++) {
        panel = (struct panel){.from = panel.to, .to = first + length * (i / count), .begin = panel.end};
        panel.end = value_at(integral, panel.to, &status);
        integrate_panel(integral, &panel, &status);
        add_panel(integral, &panel, 0, &status);
    }
    integral->value += aside * panel.end;
    integral->t = t_now;
    return status == REFDYN_OK ? refdyn_integrator_look(integrator, t_now) : status;
}
