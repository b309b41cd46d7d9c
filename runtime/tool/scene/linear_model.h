/*
 * The equations of small motions about a state at rest.
 *
 * Takes a scene, its q and t, and the coordinates that are held; gives, for x = change of the others,
 *     M x'' + D x' + K x - u^T mu = 0,   position rows: u x = 0,   velocity rows: u x' + psi_q x = 0
 * with K and D those of M qdd - h - Q - u^T lambda at qd = 0, qdd = 0 (h, quadratic in qd, then has no part
 * in K, and M none), and with phi and psi themselves: gains of stabilisation do not enter.
 */
#ifndef REFDYN_TOOL_LINEAR_MODEL_H
#define REFDYN_TOOL_LINEAR_MODEL_H

#include "scene/scene.h"

struct linear {
    int n, m;
    int *place;      /* (n) of the coordinates not held, in q */
    double *M, *D;   /* (n x n) */
    double *K;       /* (n x n) */
    double *u;       /* (m x n) */
    double *psi_q;   /* (m x n) 0 in position rows */
    int *is_level_q; /* (m) non-zero: a position row */
    double *force;   /* (n) Q + u^T lambda: what is out of balance */
    double residual; /* the largest of these */
};

/* lambda is that of Q + u^T lambda = 0, in least squares; of lambdas that do, the smallest. Returns a status
 * of the runtime. */
int linearise(struct linear *linear, struct scene *scene, const int *held);
/* The first of the n that is out of balance by more than 1e-6 rad or m, and by more than 1e-9 rad/s^2 or
 * m/s^2 of its own; -1: none, the state is an equilibrium. */
int linear_out_of_balance(const struct linear *linear);

#endif
