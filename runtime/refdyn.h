/** @file
 * The runtime core: accelerations under programme constraints, consistent states, motions, equilibria.
 *
 * Reads a constant model (refdyn_model.h) and works in a workspace that the caller owns; results are arrays.
 * Needs the C library and libm only, allocates nothing, prints nothing and keeps no state: two threads can
 * use two workspaces. SI units and radians; generalized quantities in the order and units of the coordinates;
 * points in the ground frame; matrices row by row.
 *
 * Symbols: n coordinates q, rates qd, accelerations qdd; m constraint rows u qdd + v = 0, stabilised
 * u qdd = k; residuals phi and psi of their positions and velocities; M mass matrix; f = h + Q;
 * r = M qdd - f = u^T lambda the programme force. Equations and sources: gen/theory.md.
 *
 * Memory: ask for the size, initialise, use. `memory` is aligned as malloc aligns it, belongs to the caller,
 * and must outlive its user.
 *
 * Status: an int function that can fail returns an enum refdyn_status: 0 (done), > 0 (a smaller step may
 * help) or < 0 (stop). The errors that a function lists have these names without REFDYN_.
 *
 * Every function checks its pointers. If one that it needs is NULL, or if the struct has not been
 * initialised, it returns BAD_MEMORY, or NOT_STARTED for an integrator, or what its comment says; functions
 * without a status then do nothing, or return 0. Arrays without entries may be NULL.
 */
#ifndef REFDYN_H
#define REFDYN_H

#include <stddef.h>

#include "refdyn_model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version ---- */

/** Major version. The three numbers are the only place where the version is written: the build, the packages,
 * the program and FMUs read it here. */
#define REFDYN_VERSION_MAJOR 0
/** Minor version. While the major version is 0, it changes when sources or binaries must be adapted. */
#define REFDYN_VERSION_MINOR 2
/** Patch version. */
#define REFDYN_VERSION_PATCH 0

/** The version as text, such as "1.2.3". */
#define REFDYN_VERSION REFDYN_VERSION_TEXT(REFDYN_VERSION_MAJOR, REFDYN_VERSION_MINOR, REFDYN_VERSION_PATCH)
/** Expands the numbers for REFDYN_VERSION. */
#define REFDYN_VERSION_TEXT(major, minor, patch) REFDYN_VERSION_JOIN(major, minor, patch)
/** Joins the numbers for REFDYN_VERSION. */
#define REFDYN_VERSION_JOIN(major, minor, patch) #major "." #minor "." #patch

/** REFDYN_VERSION of the library in use. A shared library can be newer than the header that the program was
 * compiled with. Never NULL. */
const char *refdyn_version(void);

/* ---- Status ---- */

/** What a call returns. Above 0, a smaller step or another state may help; below 0, stop. */
enum refdyn_status {
    REFDYN_OK = 0,         /**< done */
    REFDYN_NOT_FINITE = 1, /**< a value is infinite or NaN: of the given state (fault.coordinate), or of the
                                equations (fault.coordinate or fault.row); with neither, of another result,
                                such as the tangent or the value of an event */
    REFDYN_MASS_NOT_POSITIVE = 2, /**< the mass matrix is not positive definite for the admissible motions;
                                       fault.coordinate */
    REFDYN_ROWS_INCONSISTENT = 3, /**< a row depends on others but contradicts them; fault.row */
    REFDYN_NO_CONVERGENCE = 4,    /**< projection or statics: largest residual at fault.row or
                                       fault.coordinate; or a collocation step */
    REFDYN_MATRIX_SINGULAR = 5,   /**< the matrix of an implicit step is singular */
    REFDYN_ROWS_UNMET = 6, /**< rows begin to act, jump, or follow a changed parameter, and positions do not
                                satisfy them; fault.row */
    REFDYN_STEP_TOO_SMALL =
        -1, /**< an adaptive step fell below the resolution of t, or steps hardly advance t.
                 integrator.cause is the status of the last attempt; 0: its error was
                 too large, for instance where the motion goes to infinity or rows
                 become dependent */
    REFDYN_TANGENT_SINGULAR = -2, /**< statics: nothing holds fault.coordinate */
    REFDYN_BAD_OPTION = -3,       /**< an option is out of range; refdyn_options_validate says which */
    REFDYN_BAD_MEMORY = -4,       /**< memory is NULL or misaligned, or an initialisation has failed */
    REFDYN_FUNCTION_MISSING = -5, /**< the model lacks an emitted function that this call needs */
    REFDYN_TOO_MANY_STEPS = -6,   /**< more steps than options.step_limit */
    REFDYN_UNKNOWN_NAME = -7,     /**< no value has this name, or no emitted function reads it */
    REFDYN_BAD_VALUE = -8,        /**< a given value is infinite or NaN */
    REFDYN_OTHER_VERSION = -9,    /**< model and library differ in REFDYN_MODEL_VERSION */
    REFDYN_BAD_MODEL = -10,       /**< the model is NULL, or a count or index in its table is out of range */
    REFDYN_BAD_ARITHMETIC = -11,  /**< this library was compiled with flags that change arithmetic */
    REFDYN_EVENT_ENDS = -12,      /**< an event of the model ended the motion; integrator.event */
    REFDYN_EVENTS_ACCUMULATE = -13, /**< events follow each other without time between; integrator.event */
    REFDYN_EVENT_NOT_MET =
        -14,             /**< an event sets a value that is not finite or that the rows do not allow,
                              fault.row; or the rows let no impulse change the value; integrator.event */
    REFDYN_SLIDES = -15, /**< forces or rows jump where a formula changes its sign, and lead back there from
                              both sides: the motion slides along the jump or rests at it */
    REFDYN_CONTACT_INSIDE = -16, /**< a gap is negative: the motion starts inside a contact, or the gap has
                                      jumped; fault.row is the contact */
    REFDYN_CONTACT_DRIVEN = -17, /**< the programme closes a contact that is closed already; fault.row */
    REFDYN_CONTACTS_UNMET =
        -18,              /**< no impulses or forces keep all closed contacts from closing; fault.row */
    REFDYN_REFUSED = -19, /**< the model refuses a parameter value, such as a negative mass; work->refused */
    REFDYN_NOT_STARTED = -20, /**< refdyn_integrator_init or refdyn_integrator_start has failed, or was not
                                   called */
    REFDYN_BAD_TIME = -21, /**< a requested time is not finite, before integrator.t, or outside the last step;
                                a start, end or limit is NaN */
    REFDYN_MEMORY_TOO_SMALL = -22, /**< memory is smaller than the size function of the call requires */
    REFDYN_NO_DERIVATIVE = -23,    /**< no derivative by a value exists: events differ on its two sides */
    REFDYN_CONTACT_PULLS = -24     /**< a contact at rest would have to pull, because a step has missed where
                                        it opens; fault.row is the contact */
};

/** One line of text for a status, without a full stop. Never NULL. */
const char *refdyn_status_text(int status);

/** Where a call failed. */
struct refdyn_fault {
    int row;        /**< index of the row, -1: not of a row */
    int coordinate; /**< index of the coordinate, -1: not of a coordinate */
};

/* ---- Workspace ---- */

/**
 * Index partition: K qdd = k with K = [K_d K_i], columns scaled by 1/sqrt(M_jj), rows by their largest entry.
 * The solution does not depend on the partition; the condition of K_d does.
 */
struct refdyn_partition {
    int *column; /**< (n) coordinates: the first `rank` are dependent, in the order of elimination; then the
                      independent ones, ascending */
    int *row; /**< (m) rows: the first `rank` are used, in the order of elimination; the others are redundant
               */
    int rank; /**< independent rows, -1: not chosen yet */
    int rank_most;   /**< upper bound of the rank. An integrator raises it at the ends of steps only: within a
                          step, off the programme, a redundant row looks independent */
    int is_declared; /**< 1: the dependent coordinates are those that the model declares */
    int choices;     /**< number of choices since the last reset */
    int changes;     /**< number of changes of the dependent coordinates since the first choice */
    double condition; /**< estimate for scaled K_d at the last accelerations: |[1 -P]| / smallest pivot */
    double condition_chosen; /**< the same at the time of the choice */
    double share_chosen;     /**< the same for the largest share of a kept row in an omitted one, in units of
                                their sizes; at least 1 */
    double pivot;         /**< smallest pivot of scaled K_d at the last accelerations: 1 best, 0 singular */
    double pivot_min;     /**< smallest pivot since refdyn_partition_reset */
    double condition_max; /**< largest condition since refdyn_partition_reset */
};

/**
 * All values of one model instance that change, and scratch memory.
 *
 * The caller may read all fields and may write p (then call refdyn_prepare), x, rank_tol and consistency_tol.
 * refdyn_set_parameter and refdyn_set_input set values by name.
 */
struct refdyn_workspace {
    unsigned long long seal;          /**< private: says whether refdyn_workspace_init has seen this struct */
    const struct refdyn_model *model; /**< the model */
    int n;                            /**< its coordinates */
    int m;                            /**< its constraint rows */
    double *p; /**< (parameter_count + derived_count) parameters; their defaults after init */
    double *x; /**< (input_count) inputs; their defaults after init */

    double rank_tol;        /**< a scaled pivot below this makes a row redundant; default sqrt(DBL_EPSILON) */
    double consistency_tol; /**< allowed contradiction of redundant rows, relative to their largest term;
                               default DBL_EPSILON^(1/4) */

    double *equations;    /**< results of refdyn_equations: M f u v phi psi k, contiguous in this order */
    double *M;            /**< (n x n) mass matrix [kg, kg m, kg m^2] */
    double *f;            /**< (n) h + Q [N, N m] */
    double *u;            /**< (m x n) row coefficients */
    double *v;            /**< (m) u qdd + v = 0 */
    double *phi;          /**< (m) residual of position rows, 0 for the others */
    double *psi;          /**< (m) velocity-level residual, 0 for acceleration rows */
    double *k;            /**< (m) stabilised right side */
    long evaluations;     /**< number of evaluations of equations or accelerations since init */
    long row_evaluations; /**< number of times that u v phi psi k have been written since init */

    struct refdyn_partition partition; /**< result of refdyn_solve */
    struct refdyn_fault fault;         /**< of the last call that failed */

    int refused; /**< broken rule in model->requirements, -1: none; set by refdyn_check_parameters */

    double *rows;     /**< (m x n) scratch, ordered by partition.row and partition.column as all that says
                         "ordered";     first rank x rank: L U of K_d^T, column by column */
    double *P;        /**< (m x (n + 1)) scratch, ordered, rows n - rank + 1 apart: first rank rows [P c] with
                           qdd_d = P qdd_i + c; then the remainders of the redundant rows */
    double *scale;    /**< (n) scratch: sizes by which pivots are compared */
    int *exchange;    /**< (m) scratch: row exchanges of the elimination */
    double *mass_d;   /**< (m x n) scratch, ordered, first rank rows: [M_dd M_di] */
    double *coupling; /**< (m x n) scratch: M_di + M_dd P / 2 */
    double *reduced; /**< (n x n) scratch: mass matrix of the independent coordinates, or M in projection; its
                          factor */
    double *weight;  /**< (n) 1/sqrt(M_jj) at the last call of refdyn_row_sizes */
    double *row_state; /**< (1 + 2 n) t, q and qd to which u, v, phi, psi and k belong */
    double *sizes;     /**< (m x n) coefficients of the rows without cancellation, at least |u|, at the last
                          call of refdyn_row_sizes */
    double *row_size;  /**< (m) largest size_j weight_j of each row */
    double *anchored;  /**< (anchored_count) values of the anchored parameters */
    double *side;      /**< (n) scratch, ordered: right side, then solution */
    double *lambda;    /**< (m) scratch, ordered: multipliers */
    double *basis;     /**< (m x n) scratch of projection: rows in the metric M, orthonormalised */
    double *wanted;    /**< (m) scratch of projection: requested change of each row */
    double *change;    /**< (2 n) scratch of projection: change of q, of qd */
    double *away;      /**< (7 n + m) scratch of projection from far away: states, changes, sizes of rows */
    double *emitted;   /**< (n + 1 + m) result of the emitted accelerations */
    double *required;  /**< for each requirement 1 if it is met, else 0, and its numbers */
    int *mark;         /**< (n + m) scratch: sets of coordinates and of rows */
};

/** Bytes that refdyn_workspace_init needs for this model; 0 if the model is refused. */
size_t refdyn_workspace_size(const struct refdyn_model *model);
/** Lays the workspace out in memory and sets parameters and inputs to their defaults.
 *
 * Errors: OTHER_VERSION; BAD_MODEL, also if n, m and coupling_count exceed 15,000 in all; BAD_ARITHMETIC;
 * BAD_MEMORY, MEMORY_TOO_SMALL; FUNCTION_MISSING if the model has neither `equations` nor all of M h Q and,
 * with rows, u v k.
 */
int refdyn_workspace_init(struct refdyn_workspace *work, const struct refdyn_model *model, void *memory,
                          size_t size);

/** Continues with another compilation of the same model, such as an optimised one: later calls evaluate its
 * functions. All values stay; equal arithmetic makes the results equal to the bit. For a workspace with an
 * integrator call refdyn_integrator_exchange_model. Afterwards nothing refers to the old table.
 *
 * Errors, after which nothing has changed: BAD_MODEL if the tables differ in name, hash or sizes, or if the
 * new one lacks a function that the old one has; OTHER_VERSION; BAD_MEMORY if refdyn_workspace_init failed.
 */
int refdyn_exchange_model(struct refdyn_workspace *work, const struct refdyn_model *model);

/** Recomputes the derived parameters. Call it after changing work->p. Does nothing if refdyn_workspace_init
 * failed. */
void refdyn_prepare(struct refdyn_workspace *work);
/** Checks the prepared values of work->p by the rules of the model: positive masses, lengths, inertia that a
 * body can have, ranges that ascend. Motions and equilibria check them when they begin, when the caller has
 * changed values, and when an event sets a parameter.
 *
 * Errors: REFUSED, with the rule in work->refused; OTHER_VERSION, BAD_MODEL, BAD_MEMORY. */
int refdyn_check_parameters(struct refdyn_workspace *work);
/** Writes the arguments of printf for the format model->requirements[work->refused].fact; unused ones are 0.
 */
void refdyn_refused_numbers(const struct refdyn_workspace *work, double numbers[REFDYN_REQUIREMENT_NUMBERS]);
/** Computes q (n) and qd (n) at the start of a motion from work->p. Does nothing if refdyn_workspace_init
 * failed. */
void refdyn_initial_state(const struct refdyn_workspace *work, double *q, double *qd);
/** Sets the anchored parameters from the state at which a motion starts, then prepares. `given`
 * (anchored_count) is non-zero for parameters that keep the caller's value; NULL: none. Does nothing if
 * refdyn_workspace_init failed. */
void refdyn_anchor(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                   const int *given);

/* ---- Names ---- */

/** Sets the parameter with this name and recomputes the derived parameters; refdyn_prepare is not needed. An
 * anchored parameter keeps the value only if `given` of refdyn_anchor marks it.
 *
 * Errors, after which nothing has changed: UNKNOWN_NAME, also for a parameter that no emitted function reads;
 * BAD_VALUE if `value` is infinite or NaN; OTHER_VERSION, BAD_MODEL; BAD_MEMORY if refdyn_workspace_init
 * failed. */
int refdyn_set_parameter(struct refdyn_workspace *work, const char *name, double value);
/** Sets the input with this name. Errors as in refdyn_set_parameter. */
int refdyn_set_input(struct refdyn_workspace *work, const char *name, double value);
/** Sets the coordinate with this name in q (n), which are coordinates or rates of the caller. A state is a
 * rate. Errors as in refdyn_set_parameter. */
int refdyn_set_coordinate(const struct refdyn_model *model, double *q, const char *name, double value);

/** Returns the index of a name in a table of coordinates, parameters or inputs, -1 if it is unknown: check
 * before using it as an index. */
int refdyn_find_name(const struct refdyn_name *names, int count, const char *name);
/** Returns the index of a row, -1 if the name is unknown. */
int refdyn_find_row(const struct refdyn_model *model, const char *name);
/** Returns the index of a point, -1 if the name is unknown. */
int refdyn_find_point(const struct refdyn_model *model, const char *name);
/** Returns the place of the parameter with this index in `given` of refdyn_anchor, -1 if the parameter is not
 * anchored. */
int refdyn_find_anchored(const struct refdyn_model *model, int parameter);
/** Number of coordinates of joints. Continuous states of controllers follow them as coordinates whose value z
 * is in qd and whose z' is in qdd; their q is the integral of z and has no meaning. */
int refdyn_joint_count(const struct refdyn_model *model);
/** Number of rows of the programme. Rows of contacts follow them. */
int refdyn_programme_rows(const struct refdyn_model *model);

/* ---- Accelerations ---- */

/** How a motion stays on its rows. */
enum refdyn_stabilise {
    REFDYN_NONE,      /**< u qdd = -v */
    REFDYN_BAUMGARTE, /**< u qdd = k = -v - 2 alpha psi - beta^2 phi (Baumgarte, CMAME 1:1-16, 1972) */
    REFDYN_PROJECT    /**< u qdd = -v, and after each step the state is projected onto the rows */
};

/** Evaluates M f u v phi psi k at a state into the workspace. Error: NOT_FINITE (in f v phi psi k; M and u
 * are checked where they are used). */
int refdyn_equations(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/**
 * Computes qdd (n) from the equations in the workspace, by the generalized programme motion equations:
 *
 *     (M_i + P^T M_d) qdd = f_i + P^T f_d,   K qdd = k,   P = -K_d^-1 K_i.
 *
 * The partition is chosen at the first call, kept while its condition stays within ten times the value at the
 * choice, and changed otherwise. Redundant rows are left out; they follow the first `rank` entries of
 * work->partition.row. Without rows: M qdd = f.
 *
 * Errors: NOT_FINITE, MASS_NOT_POSITIVE, ROWS_INCONSISTENT.
 */
int refdyn_solve(struct refdyn_workspace *work, enum refdyn_stabilise stabilise, double *qdd);
/** refdyn_equations, then refdyn_solve, with the errors of both. */
int refdyn_accelerate(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                      enum refdyn_stabilise stabilise, double *qdd);
/** Refines qdd after refdyn_solve at this state, with the emitted accelerations if the model has them and
 * they are near. The rounded M loses as many digits as its condition has: 5 of 16 for 20 elements.
 *
 * Returns 0 if the rows alone determine accelerations, since M is singular; emitted accelerations are then
 * not usable. */
int refdyn_refine(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                  enum refdyn_stabilise stabilise, double *qdd);
/** Computes the multipliers lambda (m) of the equations in the workspace from the qdd of refdyn_solve:
 * K_d^T lambda = (M qdd - f)_d, 0 for redundant rows. */
void refdyn_multipliers(struct refdyn_workspace *work, const double *qdd, double *lambda);
/** Computes the programme force r (n) = u^T lambda = M qdd - f with the rows in the workspace [N, N m]. */
void refdyn_programme_force(const struct refdyn_workspace *work, const double *lambda, double *force);
/** Forgets the partition and its record: the next refdyn_solve starts from the declared set again. */
void refdyn_partition_reset(struct refdyn_workspace *work);

/* ---- Consistent states ---- */

/** Computes sizes, weight and row_size of the rows in the workspace: their coefficients without cancellation,
 * by which a row that is rounding alone is recognised. Where the model has no row_sizes they are |u|. */
void refdyn_row_sizes(struct refdyn_workspace *work);

/** Largest residuals of a state. */
struct refdyn_residual {
    double phi;  /**< largest |phi| of the position rows */
    int phi_row; /**< its row, -1: there is no such row */
    double psi;  /**< largest |psi| of position and velocity rows */
    int psi_row; /**< its row, -1: there is no such row */
};

/** Largest residuals in the workspace (of the last refdyn_equations). */
struct refdyn_residual refdyn_residuals(const struct refdyn_workspace *work);
/** Returns whether every residual in the workspace is at most tol times the size of its row's terms,
 * sum_j |u_j| max(|q_j|, unit) and sum_j |u_j| max(|qd_j|, unit), with unit 1 m or 1 rad, and 1 per second,
 * or at most their rounding. Computes the sizes of the rows. */
int refdyn_is_consistent(struct refdyn_workspace *work, double tol, const double *q, const double *qd);
/**
 * Moves q until phi = 0, then qd until psi = 0, each by the smallest change in the metric M:
 *
 *     dq = -M^-1 u^T (u M^-1 u^T)^-1 phi,   dqd = -M^-1 u^T (u M^-1 u^T)^-1 psi
 *
 * by Newton's method (velocity rows may be nonlinear in qd). Afterwards the workspace has the equations at
 * the new state. `before` (or NULL) receives the residuals of the given state.
 *
 * Errors: NOT_FINITE, MASS_NOT_POSITIVE, NO_CONVERGENCE, ROWS_INCONSISTENT.
 */
int refdyn_project(struct refdyn_workspace *work, double t, double *q, double *qd,
                   struct refdyn_residual *before);

/* ---- Motions ---- */

/** The methods: number and name of the definition. Each has a file in runtime/core/methods, whose page shows
 * how to add one. */
#define REFDYN_METHODS(REFDYN_ENTRY)                                                                     \
    /** rk8, rodas5p, gauss12 or radau9, chosen by trial steps */                                        \
    REFDYN_ENTRY(REFDYN_AUTO, automatic)                                                                 \
    /** the classical Runge-Kutta method of order 4 (Kutta 1901) */                                      \
    REFDYN_ENTRY(REFDYN_RK4, rk4)                                                                        \
    /** Dormand and Prince 5(4) (J. Comput. Appl. Math. 6:19-26, 1980) */                                \
    REFDYN_ENTRY(REFDYN_RK54, rk54)                                                                      \
    /** Dormand and Prince 8(5,3) (Hairer, Norsett and Wanner, Solving ODEs I, II.10) */                 \
    REFDYN_ENTRY(REFDYN_RK8, rk8)                                                                        \
    /** Rosenbrock method of order 5(4) with the exact tangent (Steinebach, BIT 63:27, 2023) */          \
    REFDYN_ENTRY(REFDYN_RODAS5P, rodas5p)                                                                \
    /** Rosenbrock method of order 6(5) with the exact tangent (Steinebach, arXiv:2511.21252, 2025) */   \
    REFDYN_ENTRY(REFDYN_RODAS6P, rodas6p)                                                                \
    /** collocation at the points of Radau, order 9, L-stable (Hairer and Wanner, Solving ODEs II) */    \
    REFDYN_ENTRY(REFDYN_RADAU9, radau9)                                                                  \
    /** collocation at the points of Gauss, order 12, symmetric (Butcher, Math. Comp. 18:50-64, 1964) */ \
    REFDYN_ENTRY(REFDYN_GAUSS12, gauss12)                                                                \
    /** Rosenbrock method of order 3(2) (Rang and Angermann, BIT 45:761-787, 2005) */                    \
    REFDYN_ENTRY(REFDYN_ROS34PW2, ros34pw2)

/** An enumerator of enum refdyn_method. */
#define REFDYN_NUMBER(number, method) number,
/** The methods by number. */
enum refdyn_method {
    REFDYN_METHODS(REFDYN_NUMBER) REFDYN_METHOD_COUNT /**< number of methods */
};
#undef REFDYN_NUMBER

/** The name of a method as on the command line, such as "rk8"; NULL outside the range. */
const char *refdyn_method_name(int method);
/** Order in the step: the error of a motion is proportional to this power of the step, and with adaptive
 * steps about proportional to tol. 0 outside the range. */
int refdyn_method_order(enum refdyn_method method);
/** Returns whether the method is implicit or linearly implicit and uses the tangent. True for REFDYN_AUTO,
 * which uses the tangent if the model has it; 0 outside the range. */
int refdyn_method_is_implicit(enum refdyn_method method);
/** Returns whether the tangent was emitted, as `tangent` or as `tangent_vectors`. */
int refdyn_has_tangent(const struct refdyn_model *model);
/** Returns whether the model has all functions that the method needs: the tangent for implicit methods except
 * REFDYN_AUTO. 0 outside the range. */
int refdyn_can_run(const struct refdyn_model *model, enum refdyn_method method);
/** The method with this name, -1 if there is none; options with that method are refused as BAD_OPTION. */
int refdyn_method_find(const char *name);

/** What a motion does where its rows lose rank. */
enum refdyn_singular {
    REFDYN_STOP, /**< it ends if a step meets such a state */
    REFDYN_PASS  /**< steps lead through isolated states of this kind if a branch can be followed */
};

/** Options of a motion. */
struct refdyn_options {
    enum refdyn_method method; /**< the integration method */
    double tol;       /**< local error tolerance of adaptive steps, as a change of positions in units of
                           1 rad and `length`; 0: fixed steps */
    double tol_rates; /**< adaptive steps: local error tolerance of rates, accelerations and forces of the
                          programme, relative to the largest of each kind so far, in addition to `tol`. Steps
                          end at the requested times; 0: their errors do not count */
    double step;      /**< fixed step, or first step of an adaptive method (0: chosen) [s] */
    double step_max;  /**< largest adaptive step [s]; 0: no bound */
    double length;    /**< translation that counts as much as 1 rad [m]; 0: that of the model */
    enum refdyn_stabilise stabilise; /**< how the motion stays on its rows */
    double gain_share; /**< Baumgarte gains alpha = beta = gain_share / step; 0: the gains of the rows */
    enum refdyn_singular singular; /**< what happens where rows lose rank */
    int project_start;             /**< 1: make the start consistent first */
    int balance;                   /**< 1: integrate the work of non-conservative and programme forces
                                        (integrator.work_done) */
    long step_limit;               /**< largest number of steps tried since the start, accepted and rejected
                                        ones; 0: no limit. A motion with refdyn_integrator_until also ends if
                                        10,000 steps show that it would need more */
    int event_looks;               /**< events are looked for in so many times as many places of each step as
                                        usual; 0: 1 */
};

/** Defaults of a method: step 1e-3 s and Baumgarte for rk4; adaptive steps, tol 1e-6 and projection for the
 * others. */
struct refdyn_options refdyn_options_default(enum refdyn_method method);
/** The tolerance at which the iterations of radau9 and gauss12 end: tol, but at most a value that suits their
 * order. */
double refdyn_settled_tolerance(double tol);
/** Returns 0 or BAD_OPTION; then *fact (fact may be NULL) is a static text such as "step must be positive".
 * Options that are NULL are BAD_OPTION, too. */
int refdyn_options_validate(const struct refdyn_options *options, const char **fact);

/** Sizes for crossings. */
enum {
    REFDYN_CROSSINGS_KEPT = 8 /**< number of crossings that the statistics list */
};

/** A state where the rows lose rank, and that a step has passed. */
struct refdyn_crossing {
    double t;       /**< its time [s] */
    double t_begin; /**< beginning of the step that led through it [s] */
    double t_end;   /**< end of that step [s] */
    double error;   /**< estimate for that step: largest change of a position, and of a rate times its length
                         [rad, or `length`] */
};

/** Counters and extremes of a motion. */
struct refdyn_statistics {
    long steps;          /**< accepted steps */
    long rejected;       /**< rejected steps */
    long evaluations;    /**< evaluations of the accelerations */
    long tangents;       /**< evaluations of their derivatives */
    long factorisations; /**< factorisations of the matrices of implicit steps. A complex one counts four;
                            four that chains compute side by side count four together */
    long solutions;      /**< solutions with these factors, counted in the same way */
    long steps_by[REFDYN_METHOD_COUNT]; /**< accepted steps by method */
    double phi_max;        /**< largest |phi| over all accepted steps and outputs, including the start */
    double psi_max;        /**< largest |psi| over the same */
    int phi_row;           /**< row of phi_max, -1: none */
    int psi_row;           /**< row of psi_max, -1: none */
    int partition_changes; /**< changes of the dependent coordinates */
    double pivot_min;      /**< smallest scaled pivot of K_d, 1 without rows */
    double condition_max;  /**< largest condition estimate of K_d, 1 without rows */
    double step_smallest;  /**< shortest accepted step [s] */
    double step_largest;   /**< longest accepted step [s] */
    int crossings;         /**< passed states where the rows lose rank */
    struct refdyn_crossing crossing[REFDYN_CROSSINGS_KEPT]; /**< the first of them */
    double crossing_error; /**< largest error of all of them [rad, or `length`] */
};

/** Why a state where the rows lose rank was not passed. */
enum refdyn_refusal {
    REFDYN_NOT_REFUSED,  /**< no attempt failed */
    REFDYN_NO_ROOM,      /**< the step would have to end earlier: at a time event, refdyn_integrator_limit or
                              refdyn_integrator_until */
    REFDYN_NO_STATE,     /**< a stage or the end could not be projected onto the programme, or evaluated */
    REFDYN_OTHER_BRANCH, /**< the projected state is so far away that it may be on another branch */
    REFDYN_LARGE_ERROR   /**< the error is larger than a tenth of the tolerance */
};

/** One line of text for a refusal, without a full stop. Never NULL. */
const char *refdyn_refusal_text(enum refdyn_refusal refusal);

/** Failed attempts to pass a singular state since the last success. */
struct refdyn_refused_crossing {
    int tries;               /**< number of attempts */
    enum refdyn_refusal why; /**< reason of the last one */
    double t;                /**< when the rows would lose rank [s] */
    double t_begin;          /**< beginning of the last attempted step [s] */
    double stretch;          /**< its length [s] */
};

/** Modes of a one-sided contact. */
enum refdyn_contact_mode {
    REFDYN_CONTACT_FREE,    /**< the gap is open */
    REFDYN_CONTACT_RESTING, /**< its row acts, and lambda of that row is its force */
    REFDYN_CONTACT_TOUCHING /**< the gap is closed without a force: other contacts keep it closed, or nothing
                                 presses it */
};

/** Sizes for the automatic method. */
enum {
    REFDYN_CANDIDATES = 2 /**< methods that the automatic choice compares */
};

/** State of the automatic choice of a method. */
struct refdyn_choice {
    enum refdyn_method candidates[REFDYN_CANDIDATES]; /**< explicit, implicit */
    double
        progress[REFDYN_CANDIDATES]; /**< seconds of motion per operation in the last trial, 0: not tried */
    double rate;                     /**< largest |eigenvalue| of the linearised equations [1/s] */
    double damping;                  /**< its damping ratio: 0 undamped, at least 1 without oscillation */
};

/**
 * One motion.
 *
 * After refdyn_integrator_start, _step, _to, _look and _refresh, t, q, qd, qdd, lambda and work_done belong
 * to the requested state, and the workspace has its row terms. Steps end where their error allows; the states
 * between their ends are interpolated. The caller may read all fields, and may write q and qd (contiguous)
 * before refdyn_integrator_refresh.
 *
 * Until refdyn_integrator_start has succeeded, all calls that need a motion return NOT_STARTED and change
 * nothing.
 */
struct refdyn_integrator {
    unsigned long long seal;       /**< private: says whether refdyn_integrator_init has seen this struct */
    struct refdyn_workspace *work; /**< the model instance */
    struct refdyn_options options; /**< as given */
    double t;                      /**< time of the state [s] */
    double t_right;      /**< the same, or just after a time event at t, so that formulas of time have the
                              values that follow [s] */
    double *q;           /**< (n) coordinates [m, rad] */
    double *qd;          /**< (n) rates [m/s, rad/s] */
    double *qdd;         /**< (n) accelerations [m/s^2, rad/s^2] */
    double *lambda;      /**< (m) multipliers */
    double work_done;    /**< by non-conservative and programme forces since the start [J]; inside a step as
                              accurate as its interpolant; 0 unless options.balance */
    int is_undetermined; /**< 1: a singular state is so near that qdd is the derivative of the interpolated
                              qd instead of a solution of the equations */
    double t_begin;      /**< beginning of the last accepted step [s] */
    double t_end;        /**< end of the last accepted step [s] */
    struct refdyn_residual start; /**< residuals of the state given to refdyn_integrator_start */
    int start_is_off;             /**< 1: that state was off the programme: refdyn_is_consistent with
                                       sqrt(DBL_EPSILON) */
    double *start_moved;          /**< (n) change of the positions by the projection of the start [m, rad] */
    int start_is_far; /**< 1: one of these exceeds 0.1 rad, or 0.1 options.length: another state on the
                           programme may be nearer */
    struct refdyn_statistics statistics; /**< since the start */
    int solves_by_joints;                /**< 1: implicit steps are solved in O(n), from `tangent_vectors` */
    enum refdyn_method method;           /**< method in use */
    struct refdyn_choice choice;         /**< of REFDYN_AUTO */
    struct refdyn_refused_crossing refused; /**< with REFDYN_PASS */

    int contact_count; /**< contacts of the model, in the order of their rows, which are the last rows */
    const int *contact_mode;     /**< (contact_count) enum refdyn_contact_mode */
    const double *contact_since; /**< (contact_count) when it last came to rest: the end of all its rebounds;
                                    NaN: never [s] */
    const double *contact_left;  /**< (contact_count) when it last opened; NaN: never [s] */
    int forces_are_unique;       /**< 0: other forces of the contacts would have the same effect */

    const int *event; /**< (event_count) events of the model at t, where the last call stopped */
    int event_count;  /**< number of them */

    int cause; /**< status of the last failed evaluation or projection, 0: none, or only errors of steps */
    double failed_t; /**< its time [s]; work->fault has the row or coordinate. q and qd stay the last accepted
                          state */

    struct refdyn_motion *motion; /**< private; NULL: refdyn_integrator_init has failed */
};

/** Bytes that refdyn_integrator_init needs; 0 if the model or an option is refused. */
size_t refdyn_integrator_size(const struct refdyn_model *model, const struct refdyn_options *options);
/** Lays the integrator out in memory. Errors: BAD_OPTION, BAD_MEMORY, MEMORY_TOO_SMALL, FUNCTION_MISSING
 * (refdyn_can_run); OTHER_VERSION, BAD_MODEL. */
int refdyn_integrator_init(struct refdyn_integrator *integrator, struct refdyn_workspace *work,
                           const struct refdyn_options *options, void *memory, size_t size);
/** Copies the state, evaluates it and clears the statistics. With options.project_start it first projects the
 * state. Calls refdyn_prepare. The gains are those that options.stabilise requests; work->p keeps the
 * caller's. Errors: BAD_TIME if t is not finite; NOT_FINITE, REFUSED, those of refdyn_accelerate and
 * refdyn_project; NOT_STARTED if refdyn_integrator_init has failed. */
int refdyn_integrator_start(struct refdyn_integrator *integrator, double t, const double *q,
                            const double *qd);
/** Advances towards t_out by at most `steps` accepted steps. Afterwards t is t_out, or the end of the last
 * step if they were too few. Rejected steps do not count here; options.step_limit bounds accepted and
 * rejected steps together, from the start of the motion. Without it a call may try many steps, but it ends:
 * with STEP_TOO_SMALL or SLIDES if steps hardly advance t. The call stops at each state event on the way and
 * shows the state before it; the next call starts with the action of the event. With a fixed step, the
 * interval from the last output to t_out is divided into ceil(interval/step) equal steps; the i-th begins at
 * from + i (to - from)/count.
 *
 * Errors: > 0 from a fixed step whose evaluation failed, or a tangent at the beginning of a step;
 * STEP_TOO_SMALL, TOO_MANY_STEPS; EVENT_ENDS, at the time of the event; EVENTS_ACCUMULATE, EVENT_NOT_MET,
 * SLIDES; REFUSED at an event that sets a parameter, where work->p then has the refused value; BAD_TIME if
 * t_out is before t; NOT_STARTED; those of refdyn_integrator_refresh if the caller has changed inputs or
 * parameters. The integrator then stays at the last accepted state, with cause and failed_t set;
 * refdyn_integrator_refresh evaluates that state again. */
int refdyn_integrator_step(struct refdyn_integrator *integrator, double t_out, long steps);
/** Sets the end of the motion: no step leads across t, and the automatic choice tries no method that cannot
 * pay off before. A call with a later t_out continues beyond t. INFINITY: not known, as at the start. Errors:
 * NOT_STARTED; BAD_TIME if t is NaN. */
int refdyn_integrator_until(struct refdyn_integrator *integrator, double t);
/** Sets a time at which the caller will change inputs: no step reaches beyond t until the motion has passed
 * it. INFINITY: none, as at the start. Errors: NOT_STARTED; BAD_TIME if t is NaN. */
int refdyn_integrator_limit(struct refdyn_integrator *integrator, double t);
/** Advances to t_out through all events. Errors as in refdyn_integrator_step. */
int refdyn_integrator_to(struct refdyn_integrator *integrator, double t_out);
/** Shows the state at t in the last step, t_begin <= t <= t_end within rounding, as at an output. The next
 * step continues from the end of the last one. Errors: BAD_TIME if t is outside; those of refdyn_accelerate
 * and refdyn_project; NOT_STARTED. */
int refdyn_integrator_look(struct refdyn_integrator *integrator, double t);
/** The same without accelerations and multipliers: qdd and lambda keep other values until the next call of
 * refdyn_integrator_look, _step or _to. Errors: BAD_TIME; those of refdyn_project; NOT_STARTED. */
int refdyn_integrator_look_at_state(struct refdyn_integrator *integrator, double t);
/** Looks beyond events that are due at the shown state, if they set inputs and parameters alone: work->x,
 * work->p, qdd and lambda become those with which the motion continues. Returns whether they do; then call
 * refdyn_integrator_see_before, which restores them, before the motion continues. */
int refdyn_integrator_see_after(struct refdyn_integrator *integrator);
/** Restores work->x, work->p, qdd and lambda as they were before refdyn_integrator_see_after. Does nothing if
 * that call has returned 0. */
void refdyn_integrator_see_before(struct refdyn_integrator *integrator);
/** Computes the multipliers (m) of the rows at the shown state: NaN for each that is not unique, because its
 * row depends on others or its gradient is 0, or if is_undetermined; 0 for free contacts. Error: NOT_STARTED.
 */
int refdyn_integrator_multipliers(struct refdyn_integrator *integrator, double *lambda);
/** Computes the forces (n) on the coordinates at the shown state [N, N m]: on a coordinate that rows drive or
 * lock (refdyn_row.driven) the force of these rows alone, NaN if it is not unique; on all others the
 * programme force r = u^T lambda, or M qdd - f if is_undetermined. Error: NOT_STARTED. */
int refdyn_integrator_force(struct refdyn_integrator *integrator, double *force);
/** Computes the forces (contact_count) of the contacts at the shown state, along the gradients of their gaps
 * [N for a gap in m]; 0 for contacts that do not rest. If forces are not unique, these are the smallest ones,
 * unless one of them would pull. Error: NOT_STARTED. */
int refdyn_integrator_contact_forces(struct refdyn_integrator *integrator, double *forces);
/** Continues from changed values: evaluates the shown state again. Events that the last step has found
 * after that state have not happened. Call it after changing the integrator's q and qd between steps.
 * After changes of work->x or work->p (then refdyn_prepare), the next call that advances the motion does the
 * same; call it to have the accelerations before that. The gains are those that options.stabilise requests.
 * Errors: NOT_FINITE, REFUSED, those of refdyn_accelerate; NOT_STARTED. */
int refdyn_integrator_refresh(struct refdyn_integrator *integrator);

/** refdyn_exchange_model for a motion: its next step evaluates the functions of the other table. Call it
 * between any two calls of the motion, also before the start. Each integrator of a workspace needs its own
 * call. Errors: those of refdyn_exchange_model; NOT_STARTED if refdyn_integrator_init has failed. */
int refdyn_integrator_exchange_model(struct refdyn_integrator *integrator, const struct refdyn_model *model);

/* ---- Energy balance ---- */

/** An energy balance. */
struct refdyn_energy {
    double kinetic;         /**< kinetic energy at the last refdyn_energy_add [J] */
    double potential;       /**< potential energy there [J] */
    double t_start;         /**< start of the balance [s] */
    double kinetic_start;   /**< kinetic energy at the start [J] */
    double potential_start; /**< potential energy at the start [J] */
    double work_start;      /**< work_done at the start [J] */
    double largest_kinetic; /**< largest kinetic energy [J] */
    double largest_change;  /**< largest change of kinetic energy, potential energy or work [J] */
    double largest_error;   /**< largest |change of kinetic + potential - work| at the end of a step [J] */
    double largest; /**< largest |kinetic| + |potential| + |work| [J]; all others are differences of it */
    double unit;    /**< result of refdyn_energy_scale, else 0 [J] */
};

/** Computes kinetic and potential energy at a state into energy (2) [J]. Error: FUNCTION_MISSING. */
int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy);
/** Begins a balance at the integrator's state. Errors: FUNCTION_MISSING, NOT_STARTED. */
int refdyn_energy_start(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
/** Adds the integrator's state at an output to the balance, and compares energy and work at the end of the
 * last step. Errors: FUNCTION_MISSING, NOT_STARTED. */
int refdyn_energy_add(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
/** At the end of a balance: computes the energy that moves each coordinate by its unit, 1 rad or the length,
 * against h + Q and at the mean speed of such a motion. It is not 0 for a body at rest, whose energies
 * vanish, and shows how errors of positions affect energies. Overwrites the equations in the workspace.
 * Errors, with energy->unit 0: those of refdyn_equations, NOT_STARTED. */
int refdyn_energy_scale(struct refdyn_energy *energy, const struct refdyn_integrator *integrator);
/** Largest |change of kinetic + potential - work| relative to the largest change of kinetic energy, potential
 * energy or work; 0 if nothing changed. */
double refdyn_energy_error(const struct refdyn_energy *energy);
/** Returns whether energy has changed by more than the rounding of all energies and of the scale. Otherwise
 * refdyn_energy_error is a ratio of rounding errors. */
int refdyn_energy_changes(const struct refdyn_energy *energy);

/* ---- Equilibria ---- */

/** The way from the start to the equilibrium. */
enum refdyn_statics_way {
    REFDYN_ALONG_LOAD, /**< the load grows; where it cannot, a jump to any equilibrium */
    REFDYN_ALONG_PATH, /**< the same past limit points, where the load falls before it grows again */
    REFDYN_DOWNHILL    /**< with the whole load to where its potential is least: a stable equilibrium */
};

/** Options of statics. */
struct refdyn_statics_options {
    double tol;     /**< largest last Newton correction [rad, or `length`] */
    double length;  /**< translation that counts as much as 1 rad [m]; 0: that of the model */
    double reach;   /**< largest first correction of a load step; a step with a longer one is halved [rad, or
                         `length`] */
    int iterations; /**< largest number of Newton iterations for each load */
    double load_step;  /**< first load step as a part of the load, 0 < load_step <= 1 */
    double load_least; /**< smallest load step after failures */
    double t;          /**< time at which forces and rows are evaluated [s] */
    const int *rows;   /**< (row_count) position rows that hold; NULL: none. The others have no effect */
    int row_count;     /**< number of these rows */
    enum refdyn_statics_way way; /**< the way from the start to the equilibrium */
    /** Asked before each evaluation, NULL: never. Once it returns a status other than 0, it must repeat it;
     * statics then fails soon, with this status or another one. */
    int (*ask)(void *context);
    void *context; /**< of ask */
};

/** How the stability of an equilibrium is judged. */
enum refdyn_stability_criterion {
    REFDYN_BY_POTENTIAL,     /**< the stiffness is symmetric: has the potential a minimum there? */
    REFDYN_BY_LINEAR_MOTION, /**< the stiffness is not symmetric, or a damper or a state can add energy: does
                                a small motion grow? */
    REFDYN_BY_SYMMETRIC_PART /**< not symmetric, and the model has no finite tangent: by the symmetric part of
                                the stiffness. If it is positive, the motion cannot leave the state without
                                  oscillating; oscillations may still grow */
};

/** Result of statics. */
struct refdyn_statics_result {
    double residual;  /**< largest |Q + u^T lambda| of the coordinates not held [N, N m] */
    double phi;       /**< largest |phi| of the rows that hold */
    int iterations;   /**< Newton iterations in all */
    int loads;        /**< load steps that converged */
    double load;      /**< part of the load that was reached, 1 when done */
    int limit_points; /**< limit points that were passed */
    int is_followed;  /**< 1: the load leads to this equilibrium; 0: it has a limit point before, and this is
                         another  equilibrium */

    int unstable; /**< directions, of those that rows and held coordinates leave free, in which the stiffness
                     is negative, or modes that grow */
    int neutral;  /**< such directions without stiffness. Stable if both numbers are 0 */
    int has_potential; /**< 0: the stiffness is not symmetric, as with follower loads */
    enum refdyn_stability_criterion criterion; /**< by which these were counted */
    int unstable_coordinate; /**< the coordinate that moves most in the direction of the lowest stiffness; -1:
                                  stable, or judged by the linear motion */

    const double *force;  /**< (n) Q + u^T lambda [N, N m], in the given memory, also after a failure; NULL:
                               not computed, as the next two */
    const double *lambda; /**< (row_count) multipliers, 0 for rows that depend on others and for contacts
                               without a load */
    int is_indeterminate; /**< 1: forces of the contacts are not unique; `lambda` has the smallest ones */
    const double *contact_gap; /**< (contacts of the model) gaps; NULL: no contact takes part */
};

/** Moves the values of states from the rates qd to q, where refdyn_statics reads and writes them. */
void refdyn_enter_statics(const struct refdyn_model *model, double *q, const double *qd);
/** Moves them back to qd, whose other rates become 0, and sets the coordinates of states to 0. */
void refdyn_leave_statics(const struct refdyn_model *model, double *q, double *qd);
/** Default options of statics. */
struct refdyn_statics_options refdyn_statics_default(void);
/** Returns 0 or BAD_OPTION; then *fact (fact may be NULL) is a static text that says what must be true. */
int refdyn_statics_validate(const struct refdyn_statics_options *options, const char **fact);
/** Bytes that refdyn_statics needs; 0 if the model is refused. */
size_t refdyn_statics_size(const struct refdyn_model *model);
/**
 * Computes an equilibrium: Q(q, qd = 0, t) + u^T lambda = 0 over the coordinates not held, phi(q, t) = 0 for
 * the rows that hold, z' = 0 for states z.
 *
 * First q0 is projected onto the rows by the smallest change; rows may depend on others. Then Newton's
 * iteration solves the same equations with
 *
 *     Q(q) - (1 - s) Q(q0),   s from 0 to 1
 *
 * in place of Q. The step of s is halved on failure. If s cannot reach 1 (a limit point), damped Newton
 * follows for s = 1 from q0 or, with REFDYN_ALONG_PATH, pseudo-arclength (Keller 1977). REFDYN_DOWNHILL goes
 * where the forces lead from q0 (Nocedal and Wright, Numerical Optimization, 3.4). A coordinate without
 * stiffness and load (its row and column of dQ/dq and its Q are 0) stays where it is. Stability: theory,
 * sect. 8.7.
 *
 * Rows of one-sided contacts hold where the contacts carry a load: gap >= 0, force >= 0, gap times force = 0.
 * Afterwards the parameters in work->p that switch these rows on say which contacts carry.
 *
 * - held (held_count): coordinates kept at their value in q; model->held and model->held_count, or others
 * - q (n): start, then the equilibrium, with the values of states in place of their coordinates
 *   (refdyn_enter_statics); after a failure the last equilibrium, of the load result->load
 * - hold_force (n, or NULL): -(Q + u^T lambda) at held coordinates, 0 elsewhere [N, N m]
 *
 * Errors: NOT_FINITE; NO_CONVERGENCE (work->fault.row if rows cannot be satisfied, else
 * work->fault.coordinate); TANGENT_SINGULAR (work->fault.coordinate); ROWS_INCONSISTENT (work->fault.row);
 * BAD_OPTION, also if a held coordinate is not in 0 ... n - 1, or if a row that holds is not in 0 ... m - 1,
 * is not of position level or is given twice; CONTACTS_UNMET (work->fault.row) if no set of contacts carries;
 * REFUSED; BAD_MEMORY, MEMORY_TOO_SMALL; FUNCTION_MISSING (Q, and Q_q or, with rows that hold, tangent or
 * tangent_vectors); OTHER_VERSION, BAD_MODEL.
 */
int refdyn_statics(struct refdyn_workspace *work, const struct refdyn_statics_options *options,
                   const int *held, int held_count, double *q, double *hold_force,
                   struct refdyn_statics_result *result, void *memory, size_t size);

#ifdef __cplusplus
}
#endif

#endif
