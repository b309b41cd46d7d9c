/*
 * The search for equilibria: balance at one place, Newton's iteration, contacts, ways past unstable states,
 * stability. equilibrium.c is the entry. `count` coordinates are not held; `row_count` rows hold.
 */
#ifndef REFDYN_STATICS_H
#define REFDYN_STATICS_H

#include "runtime/core/implicit/implicit.h"
#include "runtime/core/linear/linear.h"

/* ---- Balance: balance.c has the formulas, and defines F, K_d, P, g and H ---- */

/* The quantities at one q. */
struct place {
    double *q, *Q;   /* (n) coordinates, generalized forces */
    double *phi, *u; /* (row_count), (row_count x count) */
    double *factors; /* (rank x rank) L U of K_d^T, column by column */
    int *exchange;   /* (rank) its row exchanges */
    double *P;       /* (rank x (count - rank)) */
    double *lambda;  /* (row_count) 0 for redundant rows */
    double *g;       /* (count - rank) */
};

struct balance {
    struct refdyn_workspace *work;
    double t;                        /* [s] */
    int n, joints, count, row_count; /* joints: the coordinates before states */
    int *free;                       /* (count) coordinates not held */
    const int *rows;                 /* (row_count) rows that hold */
    int (*ask)(void *context);       /* of the options, with its context */
    void *context;
    double *size; /* (row_count) largest coefficient in units, without cancellation, over all places that were
                     read; a row whose coefficients all vanish becomes redundant */
    double *unit; /* (n) change that counts as much as 1 rad */
    double share; /* fraction of the load Q_start that does not act */
    double *Q_start; /* (n) */
    double *rates; /* (2 n + 1 + m) argument of the tangent: rates 0 except for states, accelerations 0, then
                      lambda */

    /* independent rows; their bound, because a redundant row looks independent where rows are not satisfied
     */
    int rank, rank_most;
    int *column; /* (count) places in `free`: `rank` dependent ones, then the others, ascending */
    int *row;    /* (row_count) places in `rows`: `rank` independent ones, then the others */

    struct place now, trial;
    double *H;         /* ((count - rank)^2), after refdyn_balance_factor its L U */
    double *stiffness; /* ((count - rank)^2) H before factorisation */
    double *magnitude; /* ((count - rank)^2) sum of the absolute terms of each entry */
    double *coupling;  /* ((count - rank) x rank) dependent columns of [1 P^T] T */
    int *order;        /* (count) row exchanges of the L U, or of the choice of rows */

    double *tangent, *terms;                /* scratch: (n x n), (n x max(n, m)) */
    double *scale, *y, *p;                  /* scratch: (count), (count), (row_count) */
    double *small_motion, *motion;          /* scratch, with a tangent: (2 x n x n), (2 n x 2 n) */
    double *eigenvalues;                    /* scratch: (2 x 2 n) */
    struct refdyn_rank_scratch elimination; /* with a tangent, of size 2 n */
    struct refdyn_linear linear;
};

/* Lays the arrays out; those for rows only if the model has rows and their tangent. */
void refdyn_balance_lay_out(struct balance *balance, const struct refdyn_model *model, struct layout *layout);
/* Records the failure `status` at a row (index in balance->rows) or a coordinate (index in balance->free);
 * -1: none. Returns the status. */
int refdyn_balance_fail(const struct balance *balance, int status, int row, int coordinate);

/* Sets the values of states in `rates` from a place q, where they take the place of their coordinates. */
void refdyn_balance_take_states(const struct balance *balance, const double *q);
/* Evaluates forces and rows at place->q, unless `ask` says stop. Errors: NOT_FINITE; the status of `ask`. */
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
/* Returns the largest entry of a step in units of 1 rad and `length`. */
double refdyn_balance_length(const struct balance *balance, const double *step);
void refdyn_balance_move(const struct balance *balance, double damping, const double *step, double *q);

/* ---- The search ---- */

/* Scratch of limit_points.c and downhill.c. */
struct path_room {
    double *matrix;                  /* ((n + 1)^2) */
    double *side, *scale;            /* (n + 1) */
    double *q, *q_next, *d, *d_next; /* (n) */
    int *order;                      /* (n + 1) */
};

struct statics {
    struct balance balance;
    struct carrying *carrying; /* the contacts that carry a load: carrying.c */
    const struct refdyn_statics_options *options;
    struct refdyn_statics_result *result;
    int is_first;              /* the next Newton step is the first of its load */
    int is_following;          /* the load is increased in steps without damping; 0: one jump with damping */
    double *step, *step_next;  /* (count) Newton correction of coordinates not held, and the following one */
    double *q_start, *q_begin; /* (n); with contacts: the place before the first set of them */
    double *force;             /* (n) Q + u^T lambda at the end */
    struct path_room path;
};

/* ---- Newton's iteration (newton.c) ---- */

/* Iterates from q (n), which becomes the equilibrium under the fraction `load` of the load if there is one;
 * balance->stiffness keeps its H. Errors: NOT_FINITE, NO_CONVERGENCE, TANGENT_SINGULAR, ROWS_INCONSISTENT. */
int refdyn_newton_solve(struct statics *statics, double load, double *q);
/* Moves q (n) onto the rows by the smallest changes of the coordinates that are not held, and determines the
 * rank of the rows there. Errors: NOT_FINITE, NO_CONVERGENCE, ROWS_INCONSISTENT. */
int refdyn_newton_meet_rows(struct statics *statics, double *q);

/* ---- Contacts (carrying.c) ---- */

struct carrying *refdyn_carrying_lay_out(const struct refdyn_model *model, struct layout *layout);
/* Divides the rows of the options into those that always hold and those of contacts; at first no contact
 * carries. Returns whether there are contacts. */
int refdyn_carrying_begin(struct statics *statics);
/* Finds the next set of contacts that carry from q (n) and, where `status` says that the present set has an
 * equilibrium, from its forces. Returns 1: there is a next set. 0: the present set is final, or there is no
 * other one to try; *status is then the final status. start (n): the first q, to let bodies down from. */
int refdyn_carrying_next(struct statics *statics, const double *start, double *q, int *status);
/* At the end: writes the parameters of the contacts, their gaps, and the multipliers in the order of the
 * options' rows. */
void refdyn_carrying_report(struct statics *statics, const double *q, int status);

/* ---- Downhill (downhill.c), and along the path past limit points (limit_points.c) ---- */

/* Goes downhill from q (n), which becomes the equilibrium. Errors: those of refdyn_newton_solve;
 * NO_CONVERGENCE also if the forces lead further after all steps. */
int refdyn_downhill_go(struct statics *statics, double *q);

void refdyn_limit_points_lay_out(struct statics *statics, const struct refdyn_model *model,
                                 struct layout *layout);
/* Follows the curve from q (n) without load to the whole load; q keeps the last equilibrium. Errors: those of
 * refdyn_newton_solve. */
int refdyn_limit_points_pass(struct statics *statics, double *q);

/* ---- Stability: growing_modes.c, stability.c ---- */

/* Computes the mass matrix and the damping of the free directions at `now` into small_motion. Overwrites
 * tangent, motion and terms. Returns 0 if the model has no tangent, or one that is not finite. */
int refdyn_growing_find_matrices(struct balance *balance);
/* Counts growing modes with these matrices, and directions without stiffness. Overwrites H. Returns 0 if the
 * eigenvalues cannot be computed. */
int refdyn_growing_count(struct balance *balance, int *unstable, int *neutral);

/* S = D V values V^T D, in arrays of a balance: the units D make the entries at most about 1; V has one
 * vector a column. */
struct spectrum {
    double *size;          /* (count - rank) D */
    double *values;        /* (count - rank) in no order */
    double *vectors;       /* (count - rank)^2 V */
    int unstable, neutral; /* values below and at 0 */
};

/* Computes the spectrum of balance->stiffness. Overwrites H, tangent and the quantities of `trial`. */
void refdyn_stability_find_spectrum(struct balance *balance, struct spectrum *spectrum);
/* y (count - rank) := direction of the smallest value. */
void refdyn_stability_lowest(const struct balance *balance, const struct spectrum *spectrum, double *y);
/* Sets unstable, neutral, has_potential, criterion and unstable_coordinate of the result, after
 * refdyn_newton_solve. */
void refdyn_stability_judge(struct balance *balance, struct refdyn_statics_result *result);

#endif
