/*
 * Where a value that is positive at three places may be below zero between them.
 *
 * The parabola through the three places shows where the value is smallest. The search for a zero evaluates it
 * there, and the new place replaces one of the three.
 */
#ifndef REFDYN_DIPS_H
#define REFDYN_DIPS_H

/* Three places and the values there, with the sign that makes them positive. */
struct dip {
    double x[3], v[3];
};

enum { DIPS_MOST = 4 }; /* places that are tried in one dip */

/* Place and value of the minimum of the parabola through them; 0: no new place between them. */
static inline int dip_bottom(const struct dip *dip, double *x, double *v) {
    const double left = (dip->v[1] - dip->v[0]) / (dip->x[1] - dip->x[0]);
    const double right = (dip->v[2] - dip->v[1]) / (dip->x[2] - dip->x[1]);
    const double curvature = (right - left) / (dip->x[2] - dip->x[0]);
    const double middle = (dip->x[0] + dip->x[1]) / 2;
    if (!(curvature > 0))
        return 0;
    *x = middle - left / (2 * curvature);
    *v = dip->v[0] + (*x - dip->x[0]) * (left + curvature * (*x - dip->x[1]));
    return *x > dip->x[0] && *x < dip->x[2] && *x != dip->x[1];
}

/* Adds the place x, between the outer two: the three that enclose the smallest value remain. */
static inline void dip_narrow(struct dip *dip, double x, double v) {
    const int is_left = x < dip->x[1], is_lower = v < dip->v[1];
    const int kept = is_lower ? (is_left ? 2 : 0) : (is_left ? 0 : 2);
    dip->x[kept] = is_lower ? dip->x[1] : x;
    dip->v[kept] = is_lower ? dip->v[1] : v;
    if (is_lower) {
        dip->x[1] = x;
        dip->v[1] = v;
    }
}

#endif
