/* The search for equilibria. */
#ifndef REFDYN_STATICS_H
#define REFDYN_STATICS_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"

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

/*
 * Newton's iteration to the balance under a share of the load.
 *
 * Takes a start and the part of the load that acts; gives the equilibrium under it. While the load is
 * followed, a step is refused when its first correction is longer than `reach`, or a later one not half as
 * long as the one before, since Newton might then end far away. Otherwise steps are damped by the restricted
 * natural monotonicity test: a step a dq is taken when the correction that follows it, with the same tangent,
 * is at most (1 - a/4) times as long (Deuflhard, Newton Methods for Nonlinear Problems, 2004, sect. 3.3).
 */

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

/*
 * Equilibria on one-sided contacts: which contacts carry a load.
 *
 * With g the gaps of the contacts that take part and p their forces, an equilibrium has g >= 0, p >= 0 and
 * p g = 0. Contacts that carry are rows that hold; of the others the gaps are checked.
 */

void refdyn_carrying_lay_out(struct carrying *carrying, const struct refdyn_model *model,
                             struct layout *layout);
/* Divides the rows of the options into those that always hold and those of contacts; at first no contact
 * carries. 1: there are contacts. */
int refdyn_carrying_begin(struct statics *statics);
/*
 * Finds the next set of contacts that carry from q (n) and, where `status` says that the present set has an
 * equilibrium, from its forces. Returns 1: there is a next set. 0: the present set is final, or there is no
 * other one to try; *status is then the final status. start (n): the first q, from which bodies are let down
 * onto their contacts.
 */
int refdyn_carrying_next(struct statics *statics, const double *start, double *q, int *status);
/* At the end: writes the parameters of the contacts, their gaps, and the multipliers in the order of the
 * options' rows. */
void refdyn_carrying_report(struct statics *statics, const double *q, int status);

/*
 * Downhill to a stable equilibrium.
 *
 * Takes a start on the rows; goes where the forces under the whole load lead, by steps
 *     y = |S|^-1 g,   S = -(H + H^T)/2,
 * with |S| of the same eigenvectors and the sizes of the eigenvalues, which is Newton's step where the
 * potential is convex and leads away from its saddles and maxima where it is not (Nocedal and Wright,
 * Numerical Optimization, 3.4). A step is halved until the forces do work along it, as the trapezoidal rule
 * tells from both ends.
 */

/* From q (n), which becomes the equilibrium. Errors: those of refdyn_newton_solve; NO_CONVERGENCE also where
 * the forces lead on and on. */
int refdyn_downhill_go(struct statics *statics, double *q);

/*
 * The equilibria under a growing and falling load, past limit points.
 *
 * Takes a start; follows the curve (q, s) of
 *     F = Q(q) - (1 - s) Q(q_start),   F + u^T lambda = 0,   phi = 0
 * by pseudo-arclength: a step h along its direction (d, sigma), then Newton on these equations and
 *     d . (q - q_predicted) + sigma (s - s_predicted) = 0,
 * whose matrix is regular at limit points, where sigma changes its sign (Keller, in: Applications of
 * Bifurcation Theory, Academic Press, 1977, 359-384). Lengths are in 1 rad, `length` and the whole load.
 */

void refdyn_limit_points_lay_out(struct statics *statics, const struct refdyn_model *model,
                                 struct layout *layout);
/* From q (n), where no load acts, until the whole load does; q keeps the last equilibrium. Errors: those of
 * refdyn_newton_solve. */
int refdyn_limit_points_pass(struct statics *statics, double *q);

/*
 * Small motions about an equilibrium, where forces have no potential.
 *
 * Takes the tangent H of the directions that the rows leave free (statics.h), and in the same coordinates y
 * the mass matrix M and the damping D = -dQ/dqd. Counts the growing modes y e^(lambda t) of
 *     M y'' + D y' + K y = 0,   K = -H
 * With the shift s and w = y'/s this equation is E z' = A z for z = (y, w). The eigenvalues of (A - s E)^-1 E
 * are 1/(lambda - s): slow modes keep their digits among fast ones, and K may be singular. `refdyn modes`
 * finds the same eigenvalues with shapes.
 */

/* Counts growing modes, and neutral directions. After refdyn_newton_solve, with the balance read at `now`;
 * changes H, tangent and terms. Returns 0 where the model has no tangent, or one that is not finite. */
int refdyn_linear_motion_count(struct balance *balance, int *unstable, int *neutral);

/*
 * Is an equilibrium stable?
 *
 * Takes the tangent H of what the rows leave free (statics.h); gives in how many directions the stiffness
 * S = -(H + H^T)/2 is negative, or zero. Where forces have a potential, H is symmetric, and an equilibrium is
 * stable where that has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on
 * masses (Sylvester). Where H is not symmetric, as with follower loads, growing modes of the linear motion
 * are counted (statics.h). Where the model has no tangent for that, S is judged nevertheless: if it is
 * positive, the motion cannot leave the state without oscillating; oscillations may still grow.
 */

/* S = D V values V^T D, in the room of a balance: D units by which its entries are at most about 1, V one
 * vector a column. */
struct spectrum {
    double *size;          /* (count - rank) D */
    double *values;        /* (count - rank) in no order */
    double *vectors;       /* (count - rank)^2 V */
    int unstable, neutral; /* values below and at 0 */
    int is_symmetric;      /* H was */
};

/* Of balance->stiffness; H, tangent and what was read of `trial` are overwritten. */
void refdyn_stability_find_spectrum(struct balance *balance, struct spectrum *spectrum);
/* y (count - rank) along the lowest of the values. */
void refdyn_stability_lowest(const struct balance *balance, const struct spectrum *spectrum, double *y);
/* After refdyn_newton_solve. Sets unstable, neutral, has_potential, criterion and unstable_coordinate of the
 * result. */
void refdyn_stability_judge(struct balance *balance, struct refdyn_statics_result *result);

#endif
