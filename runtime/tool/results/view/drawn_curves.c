/*
 * Traces a plane curve phi(x, y) = 0 from a place near it, by steps along the tangent, each corrected by
 * Newton's method. The module of a live page contains this file, so that it needs the C library only.
 */
#include "runtime/tool/results/view/drawn_shapes.h"

#include <math.h>

/* Steps are a hundredth of the size; at most DRAWN_CURVE_MOST each way, OPEN_MOST on an open curve. */
enum { OPEN_MOST = 150, STEPS_OF_SIZE = 100, CORRECTIONS = 4 };

static const double difference = 1e-5; /* step of a numerical derivative, relative to the size */

static void find_gradient(struct drawn_curve *curve, const double at[DRAWN_CURVE_AXES],
                          double gradient[DRAWN_CURVE_AXES]) {
    const double h = difference * curve->size;
    for (int i = 0; i < DRAWN_CURVE_AXES; i++) {
        double above[DRAWN_CURVE_AXES] = {at[0], at[1]}, below[DRAWN_CURVE_AXES] = {at[0], at[1]};
        above[i] += h;
        below[i] -= h;
        gradient[i] =
            (curve->residual(curve->context, above) - curve->residual(curve->context, below)) / (2 * h);
    }
}

/* ---- The curve ---- */

/* Moves `at` to the nearest place with phi = 0; returns false if there is none near. */
static bool correct(struct drawn_curve *curve, double at[DRAWN_CURVE_AXES]) {
    const double begin[DRAWN_CURVE_AXES] = {at[0], at[1]};
    for (int i = 0; i < CORRECTIONS; i++) {
        double g[DRAWN_CURVE_AXES];
        find_gradient(curve, at, g);
        const double phi = curve->residual(curve->context, at), square = g[0] * g[0] + g[1] * g[1];
        for (int k = 0; k < DRAWN_CURVE_AXES; k++)
            at[k] -= phi * g[k] / square;
    }
    return hypot(at[0] - begin[0], at[1] - begin[1]) < curve->size / STEPS_OF_SIZE;
}

/* Takes one step in the direction of the last one. */
static bool step(struct drawn_curve *curve, double at[DRAWN_CURVE_AXES], double way[DRAWN_CURVE_AXES]) {
    double g[DRAWN_CURVE_AXES];
    find_gradient(curve, at, g);
    const double length = hypot(g[0], g[1]), sign = -g[1] * way[0] + g[0] * way[1] < 0 ? -1 : 1;
    way[0] = -sign * g[1] / length;
    way[1] = sign * g[0] / length;
    for (int k = 0; k < DRAWN_CURVE_AXES; k++)
        at[k] += way[k] * curve->size / STEPS_OF_SIZE;
    return correct(curve, at);
}

/* Traces one side from the start, until it returns there or the curve ends. */
static void trace(struct drawn_curve *curve, int side, const double start[DRAWN_CURVE_AXES],
                  const double way_of_start[DRAWN_CURVE_AXES]) {
    double at[DRAWN_CURVE_AXES] = {start[0], start[1]},
           way[DRAWN_CURVE_AXES] = {way_of_start[0], way_of_start[1]};
    const double near = 0.6 * curve->size / STEPS_OF_SIZE;
    int count = 0;
    while (count < DRAWN_CURVE_MOST && !curve->is_closed && step(curve, at, way)) {
        curve->path[side][count][0] = at[0];
        curve->path[side][count++][1] = at[1];
        curve->is_closed = count > 2 && hypot(at[0] - start[0], at[1] - start[1]) < near;
    }
    curve->count[side] = count;
}

bool view_trace_curve(struct drawn_curve *curve, double start[DRAWN_CURVE_AXES]) {
    double g[DRAWN_CURVE_AXES];
    if (!correct(curve, start))
        return false;
    find_gradient(curve, start, g);
    trace(curve, 0, start, (const double[DRAWN_CURVE_AXES]){-g[1], g[0]});
    if (curve->is_closed)
        return true;
    trace(curve, 1, start, (const double[DRAWN_CURVE_AXES]){g[1], -g[0]});
    for (int side = 0; side < 2; side++)
        curve->count[side] = curve->count[side] < OPEN_MOST ? curve->count[side] : OPEN_MOST;
    return true;
}

int view_list_curve(const struct drawn_curve *curve, const double start[DRAWN_CURVE_AXES],
                    double places[][DRAWN_CURVE_AXES]) {
    int count = 0;
    for (int i = curve->count[1] - 1; i >= 0; i--, count++)
        for (int k = 0; k < DRAWN_CURVE_AXES; k++)
            places[count][k] = curve->path[1][i][k];
    for (int k = 0; k < DRAWN_CURVE_AXES; k++)
        places[count][k] = start[k];
    count++;
    for (int i = 0; i < curve->count[0]; i++, count++)
        for (int k = 0; k < DRAWN_CURVE_AXES; k++)
            places[count][k] = curve->path[0][i][k];
    return count;
}
