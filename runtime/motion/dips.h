/*
 * Where a value that is positive at three places may be below zero between them.
 *
 * The parabola through the places shows where it is smallest; whoever looks for a zero evaluates it there,
 * and the new place takes the part of one of the three.
 */
#ifndef REFDYN_DIPS_H
#define REFDYN_DIPS_H

/* Three places and what a value is there, times its side of zero. */
struct dip {
    double x[3], v[3];
};

enum { DIPS_MOST = 4 }; /* places where a value may have been beyond zero */

/* Where the parabola through them is smallest, and how small; 0: it has no such place. */
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

/* A place in the middle or next to it, which takes the other one's part. */
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
