/* Paths: see reader.h. */
#include "gen/read/reader.h"
#include "gen/base/base.h"
#include "gen/graph/graph.h"

#include <math.h>

enum { ITERATIONS = 30, FINER = 16 };

static double *new_numbers(struct memory *memory, int count) {
    return memory_get(memory, ((size_t)count + 1) * sizeof(double));
}

static double speed(const struct spline splines[3], double at) {
    const double x = spline_value(&splines[0], at, 1), y = spline_value(&splines[1], at, 1),
                 z = spline_value(&splines[2], at, 1);
    return sqrt(x * x + y * y + z * z);
}

/* Length of the curve from a to b: Gauss's rule with five points. */
static double length_between(const struct spline splines[3], double a, double b) {
    static const double places[] = {0, 0.538469310105683091, 0.906179845938663993},
                        weights[] = {0.568888888888888889, 0.478628670499366468, 0.236926885056189088};
    const double middle = (a + b) / 2, half = (b - a) / 2;
    double sum = weights[0] * speed(splines, middle);
    for (int i = 1; i < 3; i++)
        sum += weights[i] *
               (speed(splines, middle - half * places[i]) + speed(splines, middle + half * places[i]));
    return half * sum;
}

static void fit(struct memory *memory, const double *knots, const double *const points[3], int count,
                struct spline splines[3]) {
    for (int axis = 0; axis < 3; axis++)
        splines[axis] = spline_through(memory, knots, points[axis], count);
}

static void measure_chords(const double *const points[3], int count, double *knots) {
    for (int i = 1; i < count; i++) {
        double square = 0;
        for (int axis = 0; axis < 3; axis++)
            square += pow(points[axis][i] - points[axis][i - 1], 2);
        knots[i] = knots[i - 1] + sqrt(square);
    }
}

/* Knots become the lengths along the spline that they define; the largest change. */
static double measure_arcs(const struct spline splines[3], int count, double *knots) {
    double before = knots[0], change = 0;
    for (int i = 1; i < count; i++) {
        const double own = knots[i];
        knots[i] = knots[i - 1] + length_between(splines, before, own);
        change = fmax(change, fabs(knots[i] - own));
        before = own;
    }
    return change;
}

struct path path_through(struct memory *memory, const double *const points[3], int count) {
    const int fine = (count - 1) * FINER + 1;
    struct path path = {.count = fine, .length = new_numbers(memory, fine)};
    double *knots = new_numbers(memory, count);
    struct spline splines[3];
    measure_chords(points, count, knots);
    fit(memory, knots, points, count, splines);
    for (int i = 0; i < ITERATIONS && measure_arcs(splines, count, knots) > 1e-14 * knots[count - 1]; i++)
        fit(memory, knots, points, count, splines);
    for (int axis = 0; axis < 3; axis++)
        path.coordinate[axis] = new_numbers(memory, fine);
    double before = 0;
    for (int i = 0; i < fine; i++) {
        const int piece = i / FINER < count - 1 ? i / FINER : count - 2;
        const double step = (knots[piece + 1] - knots[piece]) / FINER;
        const double at = i == fine - 1 ? knots[count - 1] : knots[piece] + step * (i - piece * FINER);
        path.length[i] = i > 0 ? path.length[i - 1] + length_between(splines, before, at) : 0;
        for (int axis = 0; axis < 3; axis++)
            path.coordinate[axis][i] = spline_value(&splines[axis], at, 0);
        before = at;
    }
    return path;
}
