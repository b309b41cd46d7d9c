/*
 * Cubic splines through samples, as an operator of the graph.
 *
 * Input: knots and values. Result: pieces y = c0 + h (c1 + h (c2 + h c3)), h = x - knot, twice continuously
 * differentiable (natural spline: no curvature at the ends; de Boor, A Practical Guide to Splines, 1978, ch.
 * IV). Beyond the ends the spline continues as a straight line, which keeps both derivatives continuous.
 */
#include "gen/graph/graph.h"
#include "gen/base/base.h"

/* Second derivatives at the knots, from the tridiagonal system of a natural spline: zero at both ends. */
static double *knot_curvatures(struct memory *memory, const double *x, const double *y, int count) {
    double *curvature = memory_get(memory, (size_t)count * sizeof *curvature);
    double *factor = memory_get(memory, (size_t)count * sizeof *factor);
    for (int i = 1; i < count - 1; i++) {
        const double before = x[i] - x[i - 1], after = x[i + 1] - x[i];
        const double bend = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
        const double pivot = 2 * (before + after) - before * factor[i - 1];
        factor[i] = after / pivot;
        curvature[i] = (6 * bend - before * curvature[i - 1]) / pivot;
    }
    for (int i = count - 2; i > 0; i--)
        curvature[i] -= factor[i] * curvature[i + 1];
    return curvature;
}

static void set_piece(double *piece, double knot, double c0, double c1, double c2, double c3) {
    piece[0] = knot, piece[1] = c0, piece[2] = c1, piece[3] = c2, piece[4] = c3;
}

struct spline spline_through(struct memory *memory, const double *x, const double *y, int count) {
    struct spline spline = {count + 1,
                            memory_get(memory, (size_t)(count + 1) * PIECE_COLUMNS * sizeof(double))};
    const double *curvature = knot_curvatures(memory, x, y, count);
    for (int i = 0; i < count - 1; i++) {
        const double h = x[i + 1] - x[i];
        const double slope = (y[i + 1] - y[i]) / h - h * (2 * curvature[i] + curvature[i + 1]) / 6;
        set_piece(spline.pieces + PIECE_COLUMNS * (i + 1), x[i], y[i], slope, curvature[i] / 2,
                  (curvature[i + 1] - curvature[i]) / (6 * h));
    }
    const double *last = spline.pieces + PIECE_COLUMNS * (count - 1);
    const double h = x[count - 1] - x[count - 2];
    set_piece(spline.pieces, x[0], y[0], spline.pieces[PIECE_COLUMNS + 2], 0, 0);
    set_piece(spline.pieces + PIECE_COLUMNS * count, x[count - 1], y[count - 1],
              last[2] + h * (2 * last[3] + 3 * h * last[4]), 0, 0);
    return spline;
}

double spline_value(const struct spline *spline, double at, int order) {
    int low = 0, high = spline->count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (spline->pieces[PIECE_COLUMNS * middle] <= at)
            low = middle;
        else
            high = middle;
    }
    const double *c = spline->pieces + PIECE_COLUMNS * low + 1, h = at - c[-1];
    switch (order) {
    case 0:
        return c[0] + h * (c[1] + h * (c[2] + h * c[3]));
    case 1:
        return c[1] + h * (2 * c[2] + h * (3 * c[3]));
    case 2:
        return 2 * c[2] + h * (6 * c[3]);
    default:
        return 6 * c[3];
    }
}
