/*
 * Cubic splines through samples, as an operation of the graph.
 *
 * Takes knots and values, gives pieces y = c0 + h (c1 + h (c2 + h c3)), h = x - knot, twice continuously
 * differentiable (natural spline: no curvature at the ends; de Boor, A Practical Guide to Splines, 1978, ch.
 * IV). Beyond the ends it goes on as a straight line, which keeps both derivatives continuous.
 */
#ifndef REFDYN_GEN_SPLINE_H
#define REFDYN_GEN_SPLINE_H

struct memory;

enum { PIECE_COLUMNS = 5, SPLINE_ORDERS = 4 }; /* knot, c0 ... c3; derivatives of order 0 to 3 */

struct spline {
    int count;      /* pieces: the line before the first knot, one from each knot on */
    double *pieces; /* (count x 5) */
};

/* knots ascending, count >= 2 */
struct spline spline_through(struct memory *memory, const double *knots, const double *values, int count);
double spline_value(const struct spline *spline, double at, int order);

#endif
