/*
 * The shortest vector that meets one-sided conditions:
 *     min |x|^2 / 2   subject to   N x >= b,   N (count x n)
 * In the metric of the mass matrix this is an impact of several contacts at once (x: change of rates) and
 * Gauss's principle of least constraint (x: change of accelerations).
 *
 * Takes the normals N and the bounds b of the conditions that take part; returns x and the multipliers p >= 0
 * of x = N^T p. x is unique. Where normals depend on each other, p is not: it is then nonzero for independent
 * normals only. Dual method of Goldfarb and Idnani (Math. Programming 27:1-33, 1983).
 */
#ifndef REFDYN_ONE_SIDED_H
#define REFDYN_ONE_SIDED_H

#include "base/layout.h"

struct refdyn_one_sided {
    int n, count;
    int *takes_part;     /* (count) the others are left out */
    double *normals;     /* (count x n) */
    double *bounds;      /* (count) b */
    double *slack;       /* (count) a condition may be violated by this */
    double *x;           /* (n) */
    double *multipliers; /* (count) p; 0 for conditions that do not act */

    /* active conditions, and N of these as an upper triangle times orthonormal rows */
    int *active, active_count;
    double *basis;    /* (count x n) */
    double *triangle; /* (count x count) column by column */
    double *share;    /* (count) */
    double *along;    /* (n) */
};

void refdyn_one_sided_lay_out(struct refdyn_one_sided *problem, int count, int n, struct layout *layout);
/* 0: no x meets all conditions. */
int refdyn_one_sided_solve(struct refdyn_one_sided *problem);
/* The shortest x with N x = b for the conditions that take part, without those that depend on others.
 * Returns how many are independent. */
int refdyn_one_sided_meet(struct refdyn_one_sided *problem);

#endif
