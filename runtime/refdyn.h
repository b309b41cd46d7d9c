/*
 * The runtime core: accelerations under programme constraints, consistent states, motions, equilibria.
 *
 * Takes a constant model (refdyn_model.h) and a workspace that the caller owns; gives results as arrays.
 * Needs the C library and libm alone, allocates nothing, prints nothing, keeps no state of its own: two
 * workspaces can be used in two threads. SI units and radians; generalized quantities in the order and units
 * of the coordinates; points in the ground frame; matrices row-major.
 *
 * Symbols: n coordinates q, rates qd, accelerations qdd; m constraint rows u qdd + v = 0, stabilised u qdd =
 * k; M mass matrix; f = h + Q; r = M qdd - f = u^T lambda the programme force.
 *
 * Memory: size, init, use. `memory` is aligned as malloc's and stays with the caller; it must outlive its
 * user. Status: every int function that can fail returns 0 (done), > 0 (a smaller step may help) or < 0
 * (stop).
 */
#ifndef REFDYN_H
#define REFDYN_H

#include <stddef.h>

#include "refdyn_model.h"

#ifdef __cplusplus
extern "C" {
#endif

enum refdyn_status {
    REFDYN_OK = 0,
    /* > 0: these may go away with a smaller step or another state */
    REFDYN_NOT_FINITE = 1, /* the equations gave an infinity or NaN; fault.coordinate or fault.row */
    REFDYN_MASS_NOT_POSITIVE =
        2, /* mass matrix not positive definite for the admissible motions; fault.coordinate */
    REFDYN_ROWS_INCONSISTENT = 3, /* a row depends on others but asks for something else; fault.row */
    REFDYN_NO_CONVERGENCE =
        4, /* projection, statics: largest residual at fault.row or .coordinate; or a collocation step */
    REFDYN_MATRIX_SINGULAR = 5, /* the matrix of an implicit step is singular */
    REFDYN_ROWS_UNMET = 6,      /* rows begin to act, or jump, and positions do not meet them; fault.row */
    /* < 0: stop */
    REFDYN_STEP_TOO_SMALL =
        -1, /* an adaptive step fell below the resolution of t; integrator.cause says why */
    REFDYN_TANGENT_SINGULAR = -2,   /* statics: nothing holds fault.coordinate */
    REFDYN_BAD_OPTION = -3,         /* an option is out of its range; refdyn_options_validate says which */
    REFDYN_BAD_MEMORY = -4,         /* memory is NULL, misaligned or smaller than the size asked for */
    REFDYN_FUNCTION_MISSING = -5,   /* the model lacks an emitted function that this call needs */
    REFDYN_TOO_MANY_STEPS = -6,     /* options.step_limit reached */
    REFDYN_UNKNOWN_NAME = -7,       /* no value has that name, or no emitted function reads it */
    REFDYN_BAD_VALUE = -8,          /* a value that was given is infinite or NaN */
    REFDYN_OTHER_VERSION = -9,      /* the model is of another REFDYN_MODEL_VERSION than this library */
    REFDYN_BAD_MODEL = -10,         /* the model is NULL, or a count or index in its table is out of range */
    REFDYN_BAD_ARITHMETIC = -11,    /* this library was compiled with flags that change arithmetic */
    REFDYN_EVENT_ENDS = -12,        /* a state event has ended the motion; integrator.event */
    REFDYN_EVENTS_ACCUMULATE = -13, /* state events follow without time between; integrator.event */
    REFDYN_EVENT_NOT_MET = -14, /* what an event sets is no finite number or against the rows, fault.row, or
                                   the rows let no impulse change its value; integrator.event */
    REFDYN_SLIDES = -15, /* forces jump where a formula of rates changes its sign, and lead back there */
    /* fault.row: the contact */
    REFDYN_CONTACT_INSIDE =
        -16, /* a gap is negative: the motion starts inside a contact, or the gap has jumped */
    REFDYN_CONTACT_DRIVEN = -17, /* the rows of the programme close a contact that is closed already */
    REFDYN_CONTACTS_UNMET = -18, /* no impulses or forces of the closed contacts keep them all from closing */
    REFDYN_REFUSED = -19 /* the model refuses a parameter value, such as a negative mass: work->refused */
};

/* One line for a status, without a full stop. Never NULL. */
const char *refdyn_status_text(int status);

/* Where a call failed: indices, -1 when they do not apply. */
struct refdyn_fault {
    int row;
    int coordinate;
};

/* ---- Workspace ---- */

/*
 * Index partition: K qdd = k with K = [K_d K_i], columns scaled by 1/sqrt(M_jj), rows by their largest entry.
 * The solution does not depend on it, the condition of K_d does.
 */
struct refdyn_partition {
    int *column; /* (n) coordinates: the first `rank` are dependent, in the order of elimination; then the
                    independent ones, ascending */
    int *row; /* (m) rows: the first `rank` are used, in the order of elimination; the others are redundant */
    int rank; /* independent rows, -1: not chosen yet */
    int rank_most;    /* it does not grow beyond this. An integrator lets it grow at the ends of steps alone:
                         between them, off the programme, a redundant row looks independent */
    int is_declared;  /* the dependent coordinates are the model's declared ones */
    int choices;      /* how often they were chosen since the last reset */
    int changes;      /* how often the dependent coordinates were changed since the first choice */
    double condition; /* estimate for K_d (scaled) at the last accelerations: |[1 -P]| / smallest pivot */
    double condition_chosen; /* the same when it was chosen */
    double pivot;         /* smallest pivot of K_d (scaled) at the last accelerations: 1 best, 0 singular */
    double pivot_min;     /* smallest of these since refdyn_partition_reset */
    double condition_max; /* largest condition since refdyn_partition_reset */
};

/*
 * Everything of one model instance that changes, and the room to compute in. Caller's to read; caller's to
 * write are p (then refdyn_prepare), x, rank_tol and consistency_tol; by name: refdyn_set_parameter,
 * refdyn_set_input.
 */
struct refdyn_workspace {
    const struct refdyn_model *model;
    int n, m;
    double *p; /* (parameter_count + derived_count) parameters; their defaults after init */
    double *x; /* (input_count) inputs; their defaults after init */

    double rank_tol;        /* a scaled pivot below this makes a row redundant; default sqrt(DBL_EPSILON) */
    double consistency_tol; /* redundant rows may disagree by this part of their largest term; default
                               DBL_EPSILON^(1/4) */

    /* written by refdyn_equations */
    double *equations; /* M f u v phi psi k in this order, contiguous */
    double *M;         /* (n x n) mass matrix [kg, kg m, kg m^2] */
    double *f;         /* (n) h + Q [N, N m] */
    double *u;         /* (m x n) row coefficients */
    double *v;         /* (m) u qdd + v = 0 */
    double *phi;       /* (m) residual of position rows, 0 for the others */
    double *psi;       /* (m) velocity-level residual, 0 for acceleration rows */
    double *k;         /* (m) stabilised right side */
    long evaluations;  /* of the equations, or of accelerations in one function, since init */

    /* written by refdyn_solve */
    struct refdyn_partition partition;
    struct refdyn_fault fault; /* of the last call that failed */

    int refused; /* broken rule in model->requirements, -1: none; set by refdyn_check_parameters */

    /* room to compute in; "ordered": in the order of partition.row and partition.column */
    double *rows;  /* (m x n) ordered, first rank x rank: L U of K_d^T, column by column */
    double *P;     /* (m x (n + 1)) ordered, rows n - rank + 1 apart: first rank rows [P c], qdd_d = P qdd_i +
                      c; then what that leaves of the redundant rows */
    double *scale; /* (n) sizes by which pivots are compared */
    int *exchange; /* (m) row exchanges of that elimination */
    double *mass_d;   /* (m x n) ordered, first rank rows: [M_dd M_di] */
    double *coupling; /* (m x n) M_di + M_dd P / 2 */
    double *reduced;  /* (n x n) mass matrix of the independent coordinates, or M in projection; its factor */
    double *weight;   /* (n) 1/sqrt(M_jj), of the state where the partition was chosen */
    double *row_size; /* (m) ordered largest |u_aj| weight_j */
    double *anchored; /* (anchored_count) values of the anchored parameters */
    double *side;     /* (n) ordered right side, then solution */
    double *lambda;   /* (m) ordered multipliers */
    double *basis;    /* (m x n) projection: rows in the metric M, orthonormalised */
    double *wanted;   /* (m) projection: change asked for in each row */
    double *change;   /* (2 n) projection: of q, of qd */
    double *away;     /* (7 n + m) projection from far away: states, changes, sizes of rows */
    double *emitted;  /* (n + 1 + m) what the emitted accelerations give */
    double *required; /* for each requirement 1 where it holds, else 0, and its numbers */
    int *mark;        /* (n + m) sets of coordinates, of rows */
};

/* Bytes that refdyn_workspace_init needs for this model; 0: it refuses the model. */
size_t refdyn_workspace_size(const struct refdyn_model *model);
/* Lays the workspace out in memory and sets parameters and inputs to their defaults.
 * Errors: OTHER_VERSION; BAD_MODEL, also when n, m and coupling_count are more than 15,000 in all;
 * BAD_ARITHMETIC; BAD_MEMORY; FUNCTION_MISSING when the model has neither `equations` nor all of M h Q and,
 * with rows, u v k.
 */
int refdyn_workspace_init(struct refdyn_workspace *work, const struct refdyn_model *model, void *memory,
                          size_t size);

/* These three do nothing where refdyn_workspace_init has failed. */
/* After work->p was changed: computes the derived parameters behind it. */
void refdyn_prepare(struct refdyn_workspace *work);
/* Checks the prepared values of work->p by the rules of the model: masses above 0, lengths, inertia that a
 * body can have, ranges that ascend. Motions and equilibria do this themselves when they begin, when the
 * caller has changed values, and when an event sets a parameter. Errors: REFUSED, with the rule in
 * work->refused; OTHER_VERSION, BAD_MODEL, BAD_MEMORY. */
int refdyn_check_parameters(struct refdyn_workspace *work);
/* The arguments of printf for the format model->requirements[work->refused].fact; unused ones are 0. */
void refdyn_refused_numbers(const struct refdyn_workspace *work, double numbers[REFDYN_REQUIREMENT_NUMBERS]);
/* q (n) and qd (n) at the start of a motion, from work->p. */
void refdyn_initial_state(const struct refdyn_workspace *work, double *q, double *qd);
/* Sets the anchored parameters from the state from which a motion starts, then prepares. `given`
 * (anchored_count) is non-zero for those that keep the caller's value; NULL: none. */
void refdyn_anchor(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                   const int *given);

/* ---- Names ---- */

/*
 * Set the parameter, the input or the coordinate of that name. Errors, after which nothing has changed:
 * UNKNOWN_NAME, also for a parameter that no emitted function reads; BAD_VALUE when `value` is infinite or
 * NaN; OTHER_VERSION, BAD_MODEL; BAD_MEMORY when refdyn_workspace_init has failed.
 *
 * refdyn_set_parameter computes the derived parameters, too: refdyn_prepare is not needed behind it. An
 * anchored parameter keeps the value if refdyn_anchor is told so. q (n): coordinates or rates of the caller.
 */
int refdyn_set_parameter(struct refdyn_workspace *work, const char *name, double value);
int refdyn_set_input(struct refdyn_workspace *work, const char *name, double value);
int refdyn_set_coordinate(const struct refdyn_model *model, double *q, const char *name, double value);

/* Index of a name in a table of coordinates, parameters or inputs, of a row, of a point; -1 when it is
 * absent: not to be used as an index unseen. */
int refdyn_find_name(const struct refdyn_name *names, int count, const char *name);
int refdyn_find_row(const struct refdyn_model *model, const char *name);
int refdyn_find_point(const struct refdyn_model *model, const char *name);
/* Number of rows of the programme; those of contacts follow them. */
int refdyn_programme_rows(const struct refdyn_model *model);

/* ---- Accelerations ---- */

enum refdyn_stabilise {
    REFDYN_NONE,      /* u qdd = -v */
    REFDYN_BAUMGARTE, /* u qdd = k = -v - 2 alpha psi - beta^2 phi (Baumgarte, CMAME 1:1-16, 1972) */
    REFDYN_PROJECT    /* u qdd = -v, and after each step the state is brought onto the rows */
};

/* Evaluates M f u v phi psi k at a state into the workspace. Error: NOT_FINITE (f v phi psi k; M and u are
 * looked at where they are used). */
int refdyn_equations(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/*
 * qdd (n) from the equations in the workspace: the generalized programme motion equations
 *     (M_i + P^T M_d) qdd = f_i + P^T f_d,   K qdd = k,   P = -K_d^-1 K_i
 * with the partition chosen at the first call, kept while its condition stays within ten times the value at
 * choice, and changed when it does not. Redundant rows are left out and stand in work->partition.row behind
 * `rank`. Unconstrained: M qdd = f. Errors: NOT_FINITE, MASS_NOT_POSITIVE, ROWS_INCONSISTENT.
 */
int refdyn_solve(struct refdyn_workspace *work, enum refdyn_stabilise stabilise, double *qdd);
/* Both of the above. */
int refdyn_accelerate(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                      enum refdyn_stabilise stabilise, double *qdd);
/* After refdyn_solve gave qdd at this state: the same with the digits of the emitted accelerations, where the
 * model has them and they are near it. M as it is rounded loses those of its condition: 5 of 16 for 20
 * elements. Returns 0 where the rows alone give accelerations, since M is singular: the emitted ones then
 * serve nowhere. */
int refdyn_refine(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                  enum refdyn_stabilise stabilise, double *qdd);
/* Multipliers lambda (m) of the equations in the workspace, after refdyn_solve gave qdd: K_d^T lambda = (M
 * qdd - f)_d, 0 for redundant rows. */
void refdyn_multipliers(struct refdyn_workspace *work, const double *qdd, double *lambda);
/* Programme force r (n) = u^T lambda [N, N m], = M qdd - f, with the rows in the workspace. */
void refdyn_programme_force(const struct refdyn_workspace *work, const double *lambda, double *force);
/* Forgets the partition and its record: the next refdyn_solve starts from the declared set again. */
void refdyn_partition_reset(struct refdyn_workspace *work);

/* ---- Consistent states ---- */

struct refdyn_residual {
    double phi; /* largest |phi| of the position rows, */
    int phi_row;
    double psi;  /* largest |psi| of position and velocity rows, */
    int psi_row; /* and where; -1: no such row */
};

/* Largest residuals in the workspace (of the last refdyn_equations). */
struct refdyn_residual refdyn_residuals(const struct refdyn_workspace *work);
/* True when every residual in the workspace is at most tol times the size of its row's terms, sum_j |u_j|
 * max(|q_j|, unit) and sum_j |u_j qd_j| + |u_j|: unit 1 m or 1 rad, and 1 per second. */
int refdyn_is_consistent(const struct refdyn_workspace *work, double tol, const double *q, const double *qd);
/*
 * Moves q until phi = 0, then qd until psi = 0, both by the smallest change in the metric M:
 *     dq = -M^-1 u^T (u M^-1 u^T)^-1 phi,   dqd = -M^-1 u^T (u M^-1 u^T)^-1 psi
 * by Newton (velocity rows may be nonlinear in qd). At the end the workspace holds the equations at the new
 * state. before (or NULL): residuals of the state that was given. Errors: NOT_FINITE, MASS_NOT_POSITIVE,
 * NO_CONVERGENCE, ROWS_INCONSISTENT.
 */
int refdyn_project(struct refdyn_workspace *work, double t, double *q, double *qd,
                   struct refdyn_residual *before);

/* ---- Motions ---- */

/*
 * The methods: each has a number here and a file in runtime/core/methods, which tells how to add one.
 *   auto      rk8, rodas5p, gauss12 or radau9: by trial, see motion/automatic_method.c
 *   rk4       the classical Runge-Kutta method of order 4 (Kutta 1901)
 *   rk54      Dormand and Prince 5(4) (J. Comput. Appl. Math. 6:19-26, 1980)
 *   rk8       Dormand and Prince 8(5,3) (Hairer, Norsett and Wanner, Solving ODEs I, II.10)
 *   rodas5p   Rosenbrock method of order 5(4) with the exact tangent (Steinebach, BIT 63:27, 2023)
 *   rodas6p   the same of order 6(5) (Steinebach, arXiv:2511.21252, 2025)
 *   radau9    collocation at the points of Radau, order 9, L-stable (Hairer and Wanner, Solving ODEs II)
 *   gauss12   collocation at the points of Gauss, order 12, symmetric (Butcher, Math. Comp. 18:50-64, 1964)
 *   ros34pw2  Rosenbrock method of order 3(2) (Rang and Angermann, BIT 45:761-787, 2005)
 */
#define REFDYN_METHODS(REFDYN_ENTRY)      \
    REFDYN_ENTRY(REFDYN_AUTO, automatic)  \
    REFDYN_ENTRY(REFDYN_RK4, rk4)         \
    REFDYN_ENTRY(REFDYN_RK54, rk54)       \
    REFDYN_ENTRY(REFDYN_RK8, rk8)         \
    REFDYN_ENTRY(REFDYN_RODAS5P, rodas5p) \
    REFDYN_ENTRY(REFDYN_RODAS6P, rodas6p) \
    REFDYN_ENTRY(REFDYN_RADAU9, radau9)   \
    REFDYN_ENTRY(REFDYN_GAUSS12, gauss12) \
    REFDYN_ENTRY(REFDYN_ROS34PW2, ros34pw2)

enum refdyn_method {
#define REFDYN_NUMBER(number, method) number,
    REFDYN_METHODS(REFDYN_NUMBER)
#undef REFDYN_NUMBER
        REFDYN_METHOD_COUNT
};

/* "auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"; NULL outside the
 * range. */
const char *refdyn_method_name(int method);
/* Order in the step: the error of a motion goes with its power, and about with tol where steps are found. 0
 * outside the range, as all that follow. */
int refdyn_method_order(enum refdyn_method method);
/* Is it linearly implicit or implicit, and takes the tangent? auto counts as such: it takes the tangent where
 * the model has it. */
int refdyn_method_is_implicit(enum refdyn_method method);
/* Was the tangent emitted, as `tangent` or as `tangent_vectors`? */
int refdyn_has_tangent(const struct refdyn_model *model);
/* Was all emitted that the method needs: the tangent for implicit methods but auto? */
int refdyn_can_run(const struct refdyn_model *model, enum refdyn_method method);
/* The method of that name, -1 when there is none: options of that method are refused as BAD_OPTION. */
int refdyn_method_find(const char *name);

enum refdyn_singular {
    REFDYN_STOP, /* a motion ends where its rows lose rank, if a step meets it */
    REFDYN_PASS  /* steps lead through such states where they are isolated and a branch can be followed, see
                    motion.h */
};

struct refdyn_options {
    enum refdyn_method method;
    double tol;      /* error of a step, as a change of positions in units of 1 rad and `length`; 0: steps are
                        fixed */
    double step;     /* fixed step, or first step of an adaptive method (0: found) [s] */
    double step_max; /* adaptive: largest step [s]; 0: none */
    double length;   /* translation that counts as much as 1 rad [m]; 0: that of the model */
    enum refdyn_stabilise stabilise;
    double gain_share; /* Baumgarte gains alpha = beta = gain_share / step instead of those of the rows; 0: of
                          the rows */
    enum refdyn_singular singular;
    int project_start; /* make the start consistent first */
    int balance; /* integrate the work of non-conservative and programme forces along (integrator.work_done)
                  */
    long step_limit; /* steps tried per motion; 0: none */
};

/* Defaults of a method: step 1e-3 s, Baumgarte (rk4); step found, tol 1e-6, projection (the others). */
struct refdyn_options refdyn_options_default(enum refdyn_method method);
/* The tolerance by which the iterations of radau9 and gauss12 end: tol, but no more than suits their order.
 */
double refdyn_settled_tolerance(double tol);
/* 0 or BAD_OPTION; then *fact (fact may be NULL) is a static text such as "step must be positive". */
int refdyn_options_validate(const struct refdyn_options *options, const char **fact);

enum { REFDYN_CROSSINGS_KEPT = 8 };

/* A state that was passed where the rows lose rank. */
struct refdyn_crossing {
    double t;              /* when [s] */
    double t_begin, t_end; /* of the step that led through it [s] */
    double error; /* estimate for that step: largest change of a position, and of a rate times its length
                     [rad, or `length`] */
};

struct refdyn_statistics {
    long steps; /* accepted */
    long rejected;
    long evaluations;    /* of the accelerations */
    long tangents;       /* of their derivatives */
    long factorisations; /* of the matrices of implicit steps; a complex one counts four, those that chains
                            do side by side four together */
    long solutions;      /* with their factors, counted alike */
    long steps_by[REFDYN_METHOD_COUNT]; /* accepted, by method */
    double phi_max; /* largest |phi| and |psi| over all accepted steps and outputs, the start included */
    double psi_max;
    int phi_row, psi_row; /* and in which row; -1: none */
    int partition_changes;
    double pivot_min;                   /* smallest scaled pivot of K_d, 1 without rows */
    double condition_max;               /* largest condition estimate of K_d, 1 without rows */
    double step_smallest, step_largest; /* of the accepted steps [s] */
    int crossings;                      /* states passed where the rows lose rank, */
    struct refdyn_crossing crossing[REFDYN_CROSSINGS_KEPT]; /* the first of them, */
    double crossing_error;                                  /* largest error of all */
};

/* Why a state where the rows lose rank was not passed. */
enum refdyn_refusal {
    REFDYN_NOT_REFUSED,
    REFDYN_NO_ROOM,      /* the step would have to end before: a time event, refdyn_integrator_limit,
                            refdyn_integrator_until */
    REFDYN_NO_STATE,     /* a stage or the end could not be brought onto the programme, or evaluated */
    REFDYN_OTHER_BRANCH, /* it was, but so far away that it may lie on another branch */
    REFDYN_LARGE_ERROR   /* the error is larger than a tenth of the tolerance */
};

/* One line for it, without a full stop. Never NULL. */
const char *refdyn_refusal_text(enum refdyn_refusal refusal);

/* Attempts to pass a state, since the last that succeeded; of the last one: */
struct refdyn_refused_crossing {
    int tries;
    enum refdyn_refusal why;
    double t;       /* when the rows would lose rank [s] */
    double t_begin; /* of its step [s] */
    double stretch; /* length of its step [s] */
};

/* Modes of a one-sided contact. */
enum refdyn_contact_mode {
    REFDYN_CONTACT_FREE,
    REFDYN_CONTACT_RESTING, /* its row acts, and lambda of that row is its force */
    REFDYN_CONTACT_TOUCHING /* the gap is closed without a force: other contacts keep it closed, or nothing
                               presses it */
};

enum { REFDYN_CANDIDATES = 2 };

/* What the automatic method has found. */
struct refdyn_choice {
    enum refdyn_method candidates[REFDYN_CANDIDATES]; /* explicit, implicit */
    double progress[REFDYN_CANDIDATES]; /* of the last trial: seconds of motion an operation, 0: not tried */
    double rate;                        /* largest |eigenvalue| of the linearised equations [1/s] */
    double damping;                     /* and its damping ratio: 0 undamped, from 1 on not oscillating */
};

/*
 * One motion. `refdyn_integrator_start`, `_step`, `_to`, `_look` and `_refresh` leave t, q, qd, qdd and
 * work_done of the state that was asked for, its multipliers, and its row terms in the workspace. Steps end
 * where their error allows: the state between their ends is interpolated. All is the caller's to read, q and
 * qd (contiguous) to write before `_refresh`.
 */
struct refdyn_integrator {
    struct refdyn_workspace *work;
    struct refdyn_options options;
    double t;              /* [s] */
    double t_right;        /* the same, or right of a time event there; q ... are evaluated there [s] */
    double *q;             /* (n) */
    double *qd;            /* (n) */
    double *qdd;           /* (n) */
    double *lambda;        /* (m) */
    double work_done;      /* by non-conservative and programme forces since the start [J]; 0 unless
                              options.balance */
    int is_undetermined;   /* a singular state is so near that qdd is the derivative of the step's qd, not
                              solved for */
    double t_begin, t_end; /* the last accepted step [s] */
    struct refdyn_residual start; /* residuals of the state that was given to refdyn_integrator_start */
    int start_is_off; /* that state was not on the programme: refdyn_is_consistent with sqrt(DBL_EPSILON) */
    double *start_moved; /* (n) positions after the projection of the start, less those of that state */
    int start_is_far;    /* one of these is more than 0.1 rad, or 0.1 options.length: another state on the
                            programme may be nearer */
    struct refdyn_statistics statistics;
    int solves_by_joints;        /* steps by a tangent are solved in O(n), from `tangent_vectors` */
    enum refdyn_method method;   /* in use */
    struct refdyn_choice choice; /* of REFDYN_AUTO */
    struct refdyn_refused_crossing refused; /* with REFDYN_PASS */

    /* contacts of the model, in the order of their rows, which are the last rows */
    int contact_count;
    const int *contact_mode; /* (contact_count) enum refdyn_contact_mode */
    const double
        *contact_since; /* (contact_count) when it came to rest: the end of all its rebounds; NaN: free [s] */
    int forces_are_unique; /* 0: other forces of the contacts would have the same effect */

    const int *event; /* (event_count) state events at t, where the last call has stopped */
    int event_count;

    /* when a step has failed */
    int cause;       /* status of the last failure of an evaluation or projection, 0: none */
    double failed_t; /* where it failed; work->fault says in which row or coordinate; q, qd stay the last
                        accepted state [s] */

    struct refdyn_motion *motion; /* the steps' own */
};

/* Bytes that refdyn_integrator_init needs; 0: it refuses the model or an option. */
size_t refdyn_integrator_size(const struct refdyn_model *model, const struct refdyn_options *options);
/* Errors: BAD_OPTION, BAD_MEMORY, FUNCTION_MISSING (refdyn_can_run); OTHER_VERSION, BAD_MODEL. */
int refdyn_integrator_init(struct refdyn_integrator *integrator, struct refdyn_workspace *work,
                           const struct refdyn_options *options, void *memory, size_t size);
/* Sets the state (copied) and evaluates it; clears the statistics. With options.project_start the state is
 * projected first. Calls refdyn_prepare; the gains are those that options.stabilise asks for, work->p keeps
 * the caller's. Errors: REFUSED, those of refdyn_accelerate and refdyn_project. */
int refdyn_integrator_start(struct refdyn_integrator *integrator, double t, const double *q,
                            const double *qd);
/* Goes on towards t_out by at most `steps` accepted steps; t is t_out when they were enough, the end of the
 * last one otherwise. It stops at each state event on the way that has an action, which comes with the next
 * call: what is seen is the state before. Fixed step: the interval from the last output to t_out is cut into
 * ceil(interval/step) equal steps, the i-th begins at from + i (to - from)/count. Errors: > 0 from a fixed
 * step whose evaluation failed, or a tangent at the begin of a step; STEP_TOO_SMALL, TOO_MANY_STEPS;
 * EVENT_ENDS, then t is that of the event, EVENTS_ACCUMULATE, EVENT_NOT_MET, SLIDES; REFUSED at an event that
 * sets a parameter, where work->p then has the refused value; BAD_OPTION when t_out
 * lies before t. The integrator then stays at the last accepted state, with cause and failed_t set;
 * refdyn_integrator_refresh evaluates that state again. */
int refdyn_integrator_step(struct refdyn_integrator *integrator, double t_out, long steps);
/* The motion ends at t: no step reaches beyond, and the automatic choice tries no method that cannot pay
 * before. INFINITY: not known, as at the start. */
void refdyn_integrator_until(struct refdyn_integrator *integrator, double t);
/* From now on no step reaches beyond t, until t lies behind: a time at which the caller will change inputs.
 * INFINITY: none, as at the start. */
void refdyn_integrator_limit(struct refdyn_integrator *integrator, double t);
/* Steps until t_out, through all events. Same errors. */
int refdyn_integrator_to(struct refdyn_integrator *integrator, double t_out);
/* The state at t inside the last step, t_begin <= t <= t_end, as at an output; the steps go on from its end.
 * Errors: BAD_OPTION when t lies outside; those of refdyn_accelerate and refdyn_project. */
int refdyn_integrator_look(struct refdyn_integrator *integrator, double t);
/* Programme force r (n) at the state that is seen [N, N m]; where that is undetermined M qdd - f, else as
 * refdyn_programme_force. */
void refdyn_integrator_force(struct refdyn_integrator *integrator, double *force);
/* Forces (contact_count) of the contacts at the state that is seen, along the gradients of their gaps [N
 * where the gap is in m]; 0 for contacts that do not rest. Where forces are not unique, these are the
 * smallest ones, unless one of those would pull. */
void refdyn_integrator_contact_forces(struct refdyn_integrator *integrator, double *forces);
/* After the caller has changed work->x, work->p (then refdyn_prepare) or the integrator's q, qd between
 * steps: goes on from there, with the gains that options.stabilise asks for. Errors: REFUSED, those of
 * refdyn_accelerate. */
int refdyn_integrator_refresh(struct refdyn_integrator *integrator);

/* ---- Energy balance ---- */

struct refdyn_energy {
    double kinetic, potential; /* at the last refdyn_energy_add [J] */
    double t_start, kinetic_start, potential_start, work_start;
    double largest_kinetic; /* [J] */
    double largest_change;  /* of kinetic energy, potential energy or work [J] */
    double largest_error;   /* of |change of kinetic + potential - work| [J] */
    double largest; /* largest |kinetic| + |potential| + |work| [J]; all these are differences of it */
    double unit;    /* of refdyn_energy_scale, else 0 [J] */
};

/* Kinetic and potential energy at a state into energy (2). Error: FUNCTION_MISSING. */
int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy);
/* Begins a balance at the integrator's state, adds its state at an output. Error: FUNCTION_MISSING. */
int refdyn_energy_start(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
int refdyn_energy_add(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
/* At the end of a balance: the energy that it takes to move each coordinate by its unit, 1 rad or the length,
 * against h + Q and at the mean speed of such a motion. It is not 0 for a body at rest, whose energies
 * vanish, and shows how errors of positions affect energies. The equations in the workspace are lost. */
void refdyn_energy_scale(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
/* Largest |change of kinetic + potential - work| over the largest change of kinetic, potential or work; 0
 * when nothing changed. */
double refdyn_energy_error(const struct refdyn_energy *energy);
/* Has energy changed by more than the rounding of all energies and of the scale? Otherwise
 * refdyn_energy_error is a ratio of rounding errors. */
int refdyn_energy_changes(const struct refdyn_energy *energy);

/* ---- Equilibria ---- */

/* From the start to the equilibrium. */
enum refdyn_statics_way {
    REFDYN_ALONG_LOAD, /* the load is raised; where it cannot be raised further, a jump to any equilibrium */
    REFDYN_ALONG_PATH, /* the same past limit points, where the load has to fall before it grows on */
    REFDYN_DOWNHILL    /* with the whole load to where its potential is least: a stable one */
};

struct refdyn_statics_options {
    double tol;        /* largest last Newton correction [rad, or `length`] */
    double length;     /* translation that counts as much as 1 rad [m]; 0: that of the model */
    double reach;      /* largest first correction of a load step, which is halved when it is longer [rad, or
                          `length`] */
    int iterations;    /* Newton iterations for each load */
    double load_step;  /* first part of the load that is tried, 0 < load_step <= 1 */
    double load_least; /* smallest part that is tried after failures */
    double t;          /* at which forces and rows are taken [s] */
    const int *rows;   /* (row_count) the position rows that hold; NULL: none. Others have no part */
    int row_count;
    enum refdyn_statics_way way;
};

/* How the stability of an equilibrium is judged. */
enum refdyn_stability_criterion {
    REFDYN_BY_POTENTIAL,     /* the stiffness is symmetric: does the potential have a minimum there? */
    REFDYN_BY_LINEAR_MOTION, /* the stiffness is not symmetric: does a small motion grow? */
    REFDYN_BY_SYMMETRIC_PART /* not symmetric, and the model has no finite tangent: by the symmetric part of
                                the stiffness. If it is positive, the motion cannot leave the state without
                                oscillating; oscillations may still grow */
};

struct refdyn_statics_result {
    double residual;  /* largest |Q + u^T lambda| of the coordinates not held [N, N m] */
    double phi;       /* largest |phi| of the rows that hold */
    int iterations;   /* Newton iterations in all */
    int loads;        /* load steps that converged */
    double load;      /* part of the load that was reached, 1 when done */
    int limit_points; /* that were passed */
    int is_followed;  /* 1: the load leads to this equilibrium; 0: it has a limit point before, and this is
                         another one */

    /* of an equilibrium that was found: directions, of those that rows and held coordinates leave free, */
    int unstable;                              /* in which the stiffness is negative, or modes that grow */
    int neutral;                               /* in which there is no stiffness. Both 0: it is stable */
    int has_potential;                         /* 0: the stiffness is not symmetric, as with follower loads */
    enum refdyn_stability_criterion criterion; /* by which these were counted */
    int unstable_coordinate; /* that moves most in the direction of the lowest stiffness; -1: stable, or
                                judged by linear motion */
    /* in the memory given, also after a failure; NULL: there were none */
    const double *force;  /* (n) Q + u^T lambda [N, N m] */
    const double *lambda; /* (row_count) multipliers, 0 for rows that depend on others, and for contacts that
                             do not carry */
    int is_indeterminate; /* forces of the contacts are not unique; those in `lambda` are the smallest */
    const double *contact_gap; /* (contacts of the model) gaps; NULL: no contact takes part */
};

struct refdyn_statics_options refdyn_statics_default(void);
int refdyn_statics_validate(const struct refdyn_statics_options *options, const char **fact);
/* Bytes that refdyn_statics needs; 0: it refuses the model. */
size_t refdyn_statics_size(const struct refdyn_model *model);
/*
 * Equilibrium: Q(q, qd = 0, t) + u^T lambda = 0 over the coordinates not held, phi(q, t) = 0 for the rows
 * that hold. q0 is brought onto the rows first, by the smallest change; rows may depend on others. Then
 * Newton's iteration on the same equations with
 *     Q(q) - (1 - s) Q(q0),   s from 0 to 1,
 * in place of Q, the step of s halved on failure. Where s cannot reach 1 (a limit point), damped Newton for
 * s = 1 from q0, or, REFDYN_ALONG_PATH, pseudo-arclength (Keller 1977). REFDYN_DOWNHILL: where the forces
 * lead from q0 (Nocedal and Wright, Numerical Optimization, 3.4). A coordinate without any stiffness or load
 * (its row and column of dQ/dq and its Q are 0) stays where it is. Stability: theory, sect. 8.7.
 *
 * Rows of one-sided contacts hold where the contacts carry a load: gap >= 0, force >= 0, gap times force = 0.
 * After the call, the parameters in work->p that switch these rows on say which contacts carry.
 *
 * - held (held_count): coordinates kept at their value in q; model->held and model->held_count, or others
 * - q (n): start, then the equilibrium; after a failure the last one, that under result->load
 * - hold_force (n, or NULL): -(Q + u^T lambda) at held coordinates, 0 elsewhere
 *
 * Errors: NOT_FINITE, NO_CONVERGENCE (work->fault.row where rows cannot be met, else work->fault.coordinate),
 * TANGENT_SINGULAR (work->fault.coordinate), ROWS_INCONSISTENT (work->fault.row), BAD_OPTION, also when a
 * held coordinate is none of 0 ... n - 1, or a row that holds none of 0 ... m - 1, not of position level or
 * there twice; CONTACTS_UNMET (work->fault.row), where no set of contacts carries; REFUSED; BAD_MEMORY,
 * FUNCTION_MISSING (Q, and Q_q or, with rows that hold, tangent or tangent_vectors); * OTHER_VERSION,
 * BAD_MODEL.
 */
int refdyn_statics(struct refdyn_workspace *work, const struct refdyn_statics_options *options,
                   const int *held, int held_count, double *q, double *hold_force,
                   struct refdyn_statics_result *result, void *memory, size_t size);

#ifdef __cplusplus
}
#endif

#endif
