/*
 * Balance of a model at rest: forces, rows and their tangent at one place (theory, sect. 8.7).
 *
 * Takes coordinates q; gives, over the coordinates that are not held and the rows that hold,
 *     F + u^T lambda = 0,   phi = 0,   F = Q(q, 0) - share Q_start.
 * Full pivoting of u parts the coordinates into dependent ones d and others i. With u = [K_d K_i],
 *     P = -K_d^-1 K_i,   K_d^T lambda = -F_d,   dq_d = P dq_i - K_d^-1 phi,
 * there remain as many equations g = F_i + P^T F_d = 0 as unknowns q_i, with the tangent
 *     H = [1 P^T] T [1; P],   T = d(Q + u^T lambda)/dq at that lambda.
 * Since lambda follows q, H is exact where g is not 0, too. Without rows g is F, and H is dQ/dq.
 */
#ifndef REFDYN_BALANCE_H
#define REFDYN_BALANCE_H

#include "base/layout.h"
#include "implicit/linearisation.h"
#include "refdyn.h"

/* All that is known of one q. */
struct place {
    double *q;       /* (n) */
    double *Q;       /* (n) generalized forces */
    double *phi;     /* (row_count) */
    double *u;       /* (row_count x count) */
    double *factors; /* (rank x rank) L U of K_d^T, column by column */
    int *exchange;   /* (rank) its row exchanges */
    double *P;       /* (rank x (count - rank)) */
    double *lambda;  /* (row_count) 0 for rows that depend on others */
    double *g;       /* (count - rank) */
};

struct balance {
    struct refdyn_workspace *work;
    double t; /* [s] */
    int n, count, row_count;
    int *free;       /* (count) coordinates not held */
    const int *rows; /* (row_count) rows that hold */
    double *size; /* (row_count) their largest coefficients in units, of all places that were read: a row that
                     loses all of them loses its independence */
    double *unit; /* (n) change that counts as much as 1 rad */
    double share; /* of the load Q_start that is held back */
    double *Q_start; /* (n) */
    double *rates;   /* (2 n + 1 + m) rates and accelerations 0, then lambda, for the tangent */

    int rank, rank_most; /* independent rows; it does not grow beyond the second: off the rows, between
                            corrections, a row that depends on others looks independent */
    int *column;         /* (count) places in `free`: `rank` dependent ones, then the others, ascending */
    int *row;            /* (row_count) places in `rows`: `rank` independent ones, then the others */

    struct place now, trial;
    double *H;         /* ((count - rank)^2), after refdyn_balance_factor its L U */
    double *stiffness; /* ((count - rank)^2) H as it was */
    double *magnitude; /* ((count - rank)^2) sums of the sizes of the terms of each entry */
    double *coupling;  /* ((count - rank) x rank) of [1 P^T] T, dependent columns */
    int *order;        /* (count) row exchanges of the L U, or of the rows that are chosen */

    double *tangent;      /* room: (n x n) */
    double *terms;        /* room: (n x max(n, m)) */
    double *scale, *y;    /* room: (count) */
    double *p;            /* room: (row_count) */
    double *small_motion; /* room, with a tangent: (2 x n x n) */
    double *motion;       /* room: (2 n x 2 n) */
    double *eigenvalues;  /* room: (2 x 2 n) */
    struct refdyn_linear linear;
};

/* Lays the arrays out: with those for rows where the model has rows and their tangent. */
void refdyn_balance_lay_out(struct balance *balance, const struct refdyn_model *model, struct layout *layout);
/* The failure `status` of a row, an index in balance->rows, or of a coordinate, one in balance->free; -1:
 * none. */
int refdyn_balance_fail(const struct balance *balance, int status, int row, int coordinate);

/* Forces and rows at place->q. Error: NOT_FINITE. */
int refdyn_balance_read(struct balance *balance, struct place *place);
/* How far row a is off, in units of 1 rad and `length`. */
double refdyn_balance_distance(const struct balance *balance, const struct place *place, int a);
/* Dependent coordinates and rows for a place that was read. */
void refdyn_balance_choose(struct balance *balance, const struct place *place);
/* P, lambda and g of a place that was read, with the coordinates that were chosen. Error: NO_CONVERGENCE,
 * where these do not serve it. */
int refdyn_balance_eliminate(struct balance *balance, struct place *place);
/* H at `now`, after refdyn_balance_eliminate. Error: NOT_FINITE. */
int refdyn_balance_find_tangent(struct balance *balance);
/* At `now`: reduced (count - rank)^2 := [1 P^T] X [1; P]. X (count x count) is overwritten. */
void refdyn_balance_reduce(const struct balance *balance, double *X, double *reduced);
/* Its L U. A coordinate whose row and column of H are 0 and that carries no load stays: its equation becomes
 * dq = 0. Error: TANGENT_SINGULAR at a coordinate that nothing holds. */
int refdyn_balance_factor(struct balance *balance);
/* step (count): Newton's correction of what a place leaves of g and phi, with the tangent and P at `now`. */
void refdyn_balance_correct(struct balance *balance, const struct place *residual, double *step);
/* step (count) of the coordinates not held, from changes y (count - rank) of the independent ones and p
 * (rank) of the dependent ones beside P y. */
void refdyn_balance_expand(const struct balance *balance, const double *y, const double *p, double *step);
/* p (rank) := -K_d^-1 phi of a place, with K_d at `now`. */
void refdyn_balance_meet_rows(const struct balance *balance, const struct place *residual, double *p);
/* F of the coordinate free[i]. */
double refdyn_balance_force(const struct balance *balance, const struct place *place, int i);
/* Largest entry of a step in units of 1 rad and `length`. */
double refdyn_balance_length(const struct balance *balance, const double *step);
void refdyn_balance_move(const struct balance *balance, double damping, const double *step, double *q);

#endif
