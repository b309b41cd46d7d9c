/*
 * The search for equilibria: balance at one place, Newton's iteration, contacts, ways past unstable states,
 * stability.
 *
 * equilibrium.c is the entry. Coordinates that are not held are counted by `count`, rows that hold by
 * `row_count`.
 */
#ifndef REFDYN_STATICS_H
#define REFDYN_STATICS_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"

/*
 * ---- Balance ----
 *
 * Forces, rows and their tangent at one place (theory, sect. 8.7). In: coordinates q. Out, for the
 * coordinates that are not held and the rows that hold, F + u^T lambda = 0,   phi = 0,   F = Q(q, 0) - share
 * Q_start. Full pivoting of u divides the coordinates into dependent ones d and independent ones i. With u =
 * [K_d K_i], P = -K_d^-1 K_i,   K_d^T lambda = -F_d,   dq_d = P dq_i - K_d^-1 phi, there remain as many
 * equations g = F_i + P^T F_d = 0 as unknowns q_i, with the tangent H = [1 P^T] T [1; P],   T = d(Q + u^T
 * lambda)/dq at that lambda. Since lambda is a function of q, H is exact even where g is not 0. Without rows
 * g is F, and H is dQ/dq.
 */

/* The quantities at one q. */
struct place {
    double *q;       /* (n) */
    double *Q;       /* (n) generalized forces */
    double *phi;     /* (row_count) */
    double *u;       /* (row_count x count) */
    double *factors; /* (rank x rank) L U of K_d^T, column by column */
    int *exchange;   /* (rank) its row exchanges */
    double *P;       /* (rank x (count - rank)) */
    double *lambda;  /* (row_count) 0 for redundant rows */
    double *g;       /* (count - rank) */
};

struct balance {
    struct refdyn_workspace *work;
    double t; /* [s] */
    int n, count, row_count;
    int *free;       /* (count) coordinates not held */
    const int *rows; /* (row_count) rows that hold */
    double *size;    /* (row_count) largest coefficient in units over all places that were read: a row whose
                        coefficients all    vanish becomes redundant */
    double *unit;    /* (n) change that counts as much as 1 rad */
    double share;    /* fraction of the load Q_start that does not act */
    double *Q_start; /* (n) */
    double *rates;   /* (2 n + 1 + m) argument of the tangent: rates and accelerations 0, then lambda */

    int rank, rank_most; /* number of independent rows, and its upper bound: between corrections, where rows
                            are not satisfied, a redundant row looks independent */
    int *column;         /* (count) places in `free`: `rank` dependent ones, then the others, ascending */
    int *row;            /* (row_count) places in `rows`: `rank` independent ones, then the others */

    struct place now, trial;
    double *H;         /* ((count - rank)^2), after refdyn_balance_factor its L U */
    double *stiffness; /* ((count - rank)^2) H before factorisation */
    double *magnitude; /* ((count - rank)^2) sum of the absolute terms of each entry */
    double *coupling;  /* ((count - rank) x rank) dependent columns of [1 P^T] T */
    int *order;        /* (count) row exchanges of the L U, or of the choice of rows */

    double *tangent;      /* scratch: (n x n) */
    double *terms;        /* scratch: (n x max(n, m)) */
    double *scale, *y;    /* scratch: (count) */
    double *p;            /* scratch: (row_count) */
    double *small_motion; /* scratch, with a tangent: (2 x n x n) */
    double *motion;       /* scratch: (2 n x 2 n) */
    double *eigenvalues;  /* scratch: (2 x 2 n) */
    struct refdyn_linear linear;
};

/* Lays the arrays out; those for rows only if the model has rows and their tangent. */
void refdyn_balance_lay_out(struct balance *balance, const struct refdyn_model *model, struct layout *layout);
/* Records the failure `status` at a row (index in balance->rows) or a coordinate (index in balance->free);
 * -1: none. Returns the status. */
int refdyn_balance_fail(const struct balance *balance, int status, int row, int coordinate);

/* Evaluates forces and rows at place->q. Error: NOT_FINITE. */
int refdyn_balance_read(struct balance *balance, struct place *place);
/* Returns the distance at which row a is satisfied, in units of 1 rad and `length`. */
double refdyn_balance_distance(const struct balance *balance, const struct place *place, int a);
/* Chooses dependent coordinates and rows for a place that was read. */
void refdyn_balance_choose(struct balance *balance, const struct place *place);
/* Computes P, lambda and g of a place that was read, with the chosen coordinates. Error: NO_CONVERGENCE if
 * K_d is singular there. */
int refdyn_balance_eliminate(struct balance *balance, struct place *place);
/* Computes H at `now`, after refdyn_balance_eliminate. Error: NOT_FINITE. */
int refdyn_balance_find_tangent(struct balance *balance);
/* At `now`: reduced (count - rank)^2 := [1 P^T] X [1; P]. X (count x count) is overwritten. */
void refdyn_balance_reduce(const struct balance *balance, double *X, double *reduced);
/* Factors H. A coordinate without load whose row and column of H are 0 keeps its place: its equation becomes
 * dq = 0. Error: TANGENT_SINGULAR at a coordinate that nothing holds. */
int refdyn_balance_factor(struct balance *balance);
/* step (count) := Newton's correction for g and phi of a place, with the tangent and P at `now`. */
void refdyn_balance_correct(struct balance *balance, const struct place *residual, double *step);
/* step (count) := change of the coordinates that are not held: y (count - rank) of the independent ones, P y
 * + p (rank) of the dependent ones. */
void refdyn_balance_expand(const struct balance *balance, const double *y, const double *p, double *step);
/* p (rank) := -K_d^-1 phi of a place, with K_d at `now`. */
void refdyn_balance_meet_rows(const struct balance *balance, const struct place *residual, double *p);
/* Returns F of the coordinate free[i]. */
double refdyn_balance_force(const struct balance *balance, const struct place *place, int i);
/* Returns the largest entry of a step in units of 1 rad and `length`. */
double refdyn_balance_length(const struct balance *balance, const double *step);
void refdyn_balance_move(const struct balance *balance, double damping, const double *step, double *q);

/*
 * ---- Newton's iteration ----
 *
 * In: a start and the fraction of the load that acts. Out: the equilibrium under it. While the load is
 * increased in steps, the iteration fails if its first correction is longer than `reach`, or if a later one
 * is not at most half as long as the previous one, because it might then converge to a distant equilibrium.
 * Otherwise steps are damped by the restricted natural monotonicity test: a step a dq is accepted if the
 * following correction, with the same tangent, is at most (1 - a/4) times as long (Deuflhard, Newton Methods
 * for Nonlinear Problems, 2004, sect. 3.3).
 */

/* Scratch of limit_points.c and downhill.c. */
struct path_room {
    double *matrix;                  /* ((n + 1)^2) */
    double *side, *scale;            /* (n + 1) */
    double *q, *q_next, *d, *d_next; /* (n) */
    int *order;                      /* (n + 1) */
};

/* The contacts that carry a load, and scratch to find them: carrying.c. */
struct carrying {
    int first_row;      /* first row of a contact */
    int programme;      /* number of rows that always hold */
    int *rows;          /* (m) rows that always hold, then those of contacts that carry */
    int *has_part;      /* (contacts) the options list the row */
    int *carries;       /* (contacts) */
    int mends;          /* changes of the set so far */
    int is_let_down;    /* the bodies were let down onto their contacts, which provides a guess of the set */
    int is_shared;      /* sharing the load with closed contacts without force was attempted */
    int *joins;         /* (contacts) those that share the load */
    double *lambda;     /* (m) of the options' rows */
    double *gap;        /* (contacts) */
    double *q;          /* (n) on the way down */
    double *stiffness;  /* (n x n) dQ/dq there */
    double size;        /* largest stiffness or force */
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
    int is_following;  /* the load is increased in steps without damping; 0: one jump with damping */
    double *step;      /* (count) Newton correction of the coordinates not held */
    double *step_next; /* (count) the following correction */
    double *q_start;   /* (n) */
    double *q_begin;   /* (n) with contacts: the place before the first set of them */
    double *force;     /* (n) Q + u^T lambda at the end */
    struct path_room path;
};

/*
 * Iterates from q (n), which becomes the equilibrium under the fraction `load` of the load if there is one;
 * balance->stiffness keeps its H. Errors: NOT_FINITE, NO_CONVERGENCE, TANGENT_SINGULAR, ROWS_INCONSISTENT.
 */
int refdyn_newton_solve(struct statics *statics, double load, double *q);
/* Moves q (n) onto the rows by the smallest changes of the coordinates that are not held, and determines the
 * rank of the rows there. Errors: NOT_FINITE, NO_CONVERGENCE, ROWS_INCONSISTENT. */
int refdyn_newton_meet_rows(struct statics *statics, double *q);

/*
 * ---- Contacts ----
 *
 * Finds the contacts that carry a load.
 *
 * With g the gaps of the contacts that take part and p their forces, an equilibrium has g >= 0, p >= 0 and
 * p g = 0. The row of a contact that carries holds; the gaps of the others are checked.
 */

void refdyn_carrying_lay_out(struct carrying *carrying, const struct refdyn_model *model,
                             struct layout *layout);
/* Divides the rows of the options into those that always hold and those of contacts; at first no contact
 * carries. Returns whether there are contacts. */
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
 * ---- Downhill to a stable equilibrium ----
 *
 * From a start on the rows, follows the forces under the whole load by steps
 *     y = |S|^-1 g,   S = -(H + H^T)/2,
 * where |S| has the eigenvectors of S and the absolute eigenvalues. This is Newton's step where the potential
 * is convex; it leads away from saddles and maxima (Nocedal and Wright, Numerical Optimization, 3.4). A step
 * is halved until the forces do positive work along it by the trapezoidal rule.
 */

/* Goes downhill from q (n), which becomes the equilibrium. Errors: those of refdyn_newton_solve;
 * NO_CONVERGENCE also if the forces lead further after all steps. */
int refdyn_downhill_go(struct statics *statics, double *q);

/*
 * ---- Limit points ----
 *
 * Follows the equilibria under an increasing and decreasing load: the curve (q, s) of
 *     F = Q(q) - (1 - s) Q(q_start),   F + u^T lambda = 0,   phi = 0
 * by pseudo-arclength: a step h along its direction (d, sigma), then Newton on these equations and
 *     d . (q - q_predicted) + sigma (s - s_predicted) = 0,
 * whose matrix is regular at limit points, where sigma changes its sign (Keller, in: Applications of
 * Bifurcation Theory, Academic Press, 1977, 359-384). Lengths are in 1 rad, `length` and the whole load.
 */

void refdyn_limit_points_lay_out(struct statics *statics, const struct refdyn_model *model,
                                 struct layout *layout);
/* Follows the curve from q (n) without load to the whole load; q keeps the last equilibrium. Errors: those of
 * refdyn_newton_solve. */
int refdyn_limit_points_pass(struct statics *statics, double *q);

/*
 * ---- Small motions, for forces without a potential ----
 *
 * In: the tangent H of the free directions, and in the same coordinates y the mass matrix M and the damping
 * D = -dQ/dqd. Out: the number of growing modes y e^(lambda t) of
 *     M y'' + D y' + K y = 0,   K = -H
 * With the shift s and w = y'/s this equation is E z' = A z for z = (y, w). The eigenvalues of (A - s E)^-1 E
 * are 1/(lambda - s): slow modes keep their digits among fast ones, and K may be singular. `refdyn modes`
 * computes the same eigenvalues together with shapes.
 */

/* Counts growing modes and neutral directions, after refdyn_newton_solve with the balance at `now`.
 * Overwrites H, tangent and terms. Returns 0 if the model has no tangent, or one that is not finite. */
int refdyn_linear_motion_count(struct balance *balance, int *unstable, int *neutral);

/*
 * ---- Stability ----
 *
 * In: the tangent H of the free directions. Out: the numbers of directions in which the stiffness
 * S = -(H + H^T)/2 is negative, or zero. Where forces have a potential, H is symmetric, and an equilibrium is
 * stable where that has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on
 * masses (Sylvester). Where H is not symmetric, as with follower loads, the growing modes of the small motion
 * are counted. Without a tangent for them, S is used: if it is positive, the motion cannot leave the state
 * without oscillating; oscillations may still grow.
 */

/* S = D V values V^T D, in arrays of a balance: the units D make the entries at most about 1; V has one
 * vector a column. */
struct spectrum {
    double *size;          /* (count - rank) D */
    double *values;        /* (count - rank) in no order */
    double *vectors;       /* (count - rank)^2 V */
    int unstable, neutral; /* values below and at 0 */
    int is_symmetric;      /* H was symmetric */
};

/* Computes the spectrum of balance->stiffness. Overwrites H, tangent and the quantities of `trial`. */
void refdyn_stability_find_spectrum(struct balance *balance, struct spectrum *spectrum);
/* y (count - rank) := direction of the smallest value. */
void refdyn_stability_lowest(const struct balance *balance, const struct spectrum *spectrum, double *y);
/* Sets unstable, neutral, has_potential, criterion and unstable_coordinate of the result, after
 * refdyn_newton_solve. */
void refdyn_stability_judge(struct balance *balance, struct refdyn_statics_result *result);

#endif
