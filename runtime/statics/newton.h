/*
 * Newton's iteration to the balance under a share of the load.
 *
 * Takes a start and the part of the load that acts; gives the equilibrium under it. While the load is
 * followed, a step is refused when its first correction is longer than `reach`, or a later one not half as
 * long as the one before, since Newton might then end far away. Otherwise steps are damped by the restricted
 * natural monotonicity test: a step a dq is taken when the correction that follows it, with the same tangent,
 * is at most (1 - a/4) times as long (Deuflhard, Newton Methods for Nonlinear Problems, 2004, sect. 3.3).
 */
#ifndef REFDYN_NEWTON_H
#define REFDYN_NEWTON_H

#include "constraints/one_sided.h"
#include "statics/balance.h"

/* Room of limit_points.c and downhill.c. */
struct path_room {
    double *matrix;                  /* ((n + 1)^2) */
    double *side, *scale;            /* (n + 1) */
    double *q, *q_next, *d, *d_next; /* (n) */
    int *order;                      /* (n + 1) */
};

/* Which contacts carry a load, and room to find them: carrying.c. */
struct carrying {
    int first_row;      /* of contacts */
    int programme;      /* number of rows that always hold */
    int *rows;          /* (m) first these, then those of contacts that carry */
    int *has_part;      /* (contacts) the options list its row */
    int *carries;       /* (contacts) */
    int mends;          /* changes of the set so far */
    int is_let_down;    /* the bodies were let down, which is a guess of the set */
    int is_shared;      /* it was tried to share the load with closed contacts without a force */
    int *joins;         /* (contacts) those that share it */
    double *lambda;     /* (m) of the options' rows */
    double *gap;        /* (contacts) */
    double *q;          /* (n) on the way down */
    double *stiffness;  /* (n x n) dQ/dq there */
    double size;        /* largest of stiffnesses and forces */
    double *factor;     /* (count x count) of K + mu D */
    double *held;       /* (m x count) directions of the rows that always hold */
    double *along;      /* (count) the way to these rows */
    double *d, *d_last; /* (count) steps */
    struct refdyn_one_sided problem;
};

struct statics {
    struct balance balance;
    struct carrying carrying;
    const struct refdyn_statics_options *options;
    struct refdyn_statics_result *result;
    int is_first;      /* the next Newton step is the first of its load */
    int is_following;  /* load by load without damping; else one jump with it */
    double *step;      /* (count) Newton correction of the coordinates not held */
    double *step_next; /* (count) the one that follows it */
    double *q_start;   /* (n) */
    double *q_begin;   /* (n) with contacts: before any set of them was tried */
    double *force;     /* (n) Q + u^T lambda at the end */
    struct path_room path;
};

/*
 * From q (n) on, which becomes the equilibrium under the part `load` of the load when there is one; H of it
 * stays in balance->stiffness. Errors: NOT_FINITE, NO_CONVERGENCE, TANGENT_SINGULAR, ROWS_INCONSISTENT.
 */
int refdyn_newton_solve(struct statics *statics, double load, double *q);
/* Moves q (n) onto the rows, by the smallest changes of the coordinates not held, and counts their
 * independent rows there. Errors: NOT_FINITE, NO_CONVERGENCE, ROWS_INCONSISTENT. */
int refdyn_newton_meet_rows(struct statics *statics, double *q);

#endif
