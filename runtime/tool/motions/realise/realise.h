/*
 * The programme performed by drives: the motion and the drive forces tau with
 *
 *     M qdd = h + Q + B tau + u_l^T lambda,   u qdd + v = 0,
 *
 * where the rows u are those of the programme and those that close loops (u_l, with multipliers lambda). The
 * forces that realise a programme of a flexible mechanism begin before it and end after it, so that the
 * motion is the solution of a boundary value problem: at rest on the programme long before the start, at rest
 * again long after the end. Sources: Blajer and Kolodziejczyk, Multibody Syst. Dyn. 11:343-364, 2004 (servo
 * constraints); Devasia, Chen and Paden, IEEE Trans. Automat. Contr. 41:930-942, 1996 (stable inversion);
 * Seifried, Dynamics of Underactuated Multibody Systems, Springer 2014.
 *
 * More drives than rows leave a choice: the forces with the least integral of the squares of w tau over the
 * whole motion.
 *
 * Parts in reading order: six Gauss points; equations at a place; intervals; the chain of intervals; least
 * effort; the first guess; the solution; modes and cosines; checks, meshes and playback; the command.
 */
#ifndef REFDYN_TOOL_REALISE_H
#define REFDYN_TOOL_REALISE_H

#include <stdbool.h>

#include "refdyn.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"

/* A matrix of zeros, released by memory_back (base.h). */
static inline double *realise_scratch(int rows, int columns) {
    return memory_scratch(&format_memory, ((size_t)rows * (size_t)columns + 1) * sizeof(double));
}

/* ---- Six Gauss points on [0, 1] (gauss_points.c) ---- */

enum { REALISE_STAGES = 6 };

/* Weights of values at the points, for integrals of the polynomial through them. */
struct realise_gauss {
    double c[REALISE_STAGES];                        /* the points */
    double lagrange[REALISE_STAGES][REALISE_STAGES]; /* coefficients of x^k in the j-th polynomial */
    double once[REALISE_STAGES + 1][REALISE_STAGES], /* int_0^c_i, and int_0^1 in the last row */
        twice[REALISE_STAGES + 1][REALISE_STAGES];   /* the same of the integral */
};

void realise_gauss_start(struct realise_gauss *gauss);
/* Weights of the polynomial at x (order 0), of its integral from 0 to x, and of the integral of that. */
void realise_gauss_weights(const struct realise_gauss *gauss, double x, int order,
                           double weights[static REALISE_STAGES]);

/* ---- The equations at a place of the motion (place_equations.c) ---- */

/* Unknowns at a place (width): qdd (n), tau (drives), lambda (loops). */
struct realise_problem {
    struct scene *scene;
    struct realise_gauss gauss;
    int n, m, drives, loops, width;
    int spare;             /* drives beyond the rows of the programme */
    const double *weights; /* (drives) w of the effort [1/N, 1/(N m)] */
    const int *input;      /* (drives) places of tau in the inputs */
    const int *loop;       /* (loops) the rows that close loops */
    double *gains;         /* (2 m) of the rows, 0 while the problem is solved */
    double *given;         /* (2 n + 1 + m) scratch: rates, accelerations, power and multipliers */
    double *tangent;       /* scratch: the result of `tangent` */
    double *by_inputs;     /* scratch: the result of `tangent_x` */
};

/* The equations at a place and their derivatives; all but `residual` lie in the problem's scratch. */
struct realise_place {
    double *residual;                         /* (n + m) of both equations */
    const double *K, *D, *M, *G_q, *G_qd, *u; /* by q, qd, qdd; of the rows by q, qd, qdd */
    const double *f_x;                        /* (n x inputs) */
};

void realise_problem_start(struct realise_problem *problem, struct scene *scene);
/* Sets the gains of the rows to 0, which makes their right side k = -v, after the start has been placed. */
void realise_problem_release(struct realise_problem *problem);
/* Restores the gains and inputs. */
void realise_problem_end(struct realise_problem *problem);
/* Computes them. Returns a status of the runtime. */
int realise_place_find(struct realise_problem *problem, double t, const double *q, const double *qd,
                       const double *unknowns, struct realise_place *place);

/* ---- Intervals (intervals.c) ---- */

/* A motion on a mesh. */
struct realise_motion {
    struct realise_problem *problem;
    int count;      /* of intervals */
    double *t;      /* (count + 1) [s] */
    double *nodes;  /* (count + 1) x 2 n: q, qd */
    double *stages; /* (count x 6 x width) unknowns at the Gauss points */
};

/* A linearised interval: the change of the next node is Phi times that of the node, plus gap, plus Gamma
 * times free values (6 spare) where drives leave a choice. Columns one after the other. */
struct realise_interval {
    double *Phi;      /* (2 n x 2 n) */
    double *gap;      /* (2 n) */
    double *Gamma;    /* (2 n x 6 spare) */
    double *by_state; /* (6 width x (2 n + 1 + 6 spare)) changes of the unknowns by the node, in addition, and
                         by the free values */
};

/* The state (2 n) within interval k at its part x, from 0 to 1. once, twice (6): the weights there. */
void realise_interval_state(const struct realise_motion *motion, int k, double x, const double *once,
                            const double *twice, double *state);
/* Linearises interval k about the motion. Returns a status of the runtime. */
int realise_interval_find(struct realise_motion *motion, int k, struct realise_interval *interval);
/* Changes the unknowns of interval k by the change (2 n) of its node and by its free values (6 spare). */
void realise_interval_change(struct realise_motion *motion, int k, const struct realise_interval *interval,
                             const double *change, const double *values);

/* ---- The chain of intervals (interval_chain.c) ---- */

/* What closes the chain: rows for the first node, and the states that both ends come close to. */
struct realise_ends {
    int count;            /* of rows */
    double *rows;         /* (count x 2 n) columns one after the other */
    double *sides;        /* (count) */
    double *scale;        /* (2 n) by which states are divided */
    double *unit;         /* (2 n) in which the distances of the ends count */
    double *first, *last; /* (2 n) wanted changes of the ends */
};

/* Computes the changes (count + 1) x 2 n of the nodes. False if the equations are singular. */
bool realise_chain_solve(const struct realise_interval *intervals, int count, int n,
                         const struct realise_ends *ends, double *changes);

/* ---- Least effort (least_effort.c) ---- */

/* What a motion of least effort comes close to. */
struct realise_goal {
    double effort_unit; /* in which the effort counts, that of the first guess */
    const double *rest; /* (2 n) the start */
    const double *unit; /* (2 n) in which distances from the start count */
    const double *last; /* (3 n) coordinates, rates and accelerations of an end that goes on */
};

struct realise_step {
    const struct realise_goal *goal;
    double damping; /* of the squares of the scaled changes [1/s] */
    double *aim;    /* (2 n) residuals of the end that a step predicts, and the next projection restores */
    bool is_projection; /* to a motion that satisfies the equations, with the least change of forces */
};

/* Computes the changes (count + 1) x 2 n of the nodes, and the free values (count x 6 spare) of the
 * intervals, for the least effort of the linearised motion. False if the equations are singular. */
bool realise_effort_solve(const struct realise_motion *motion, const struct realise_interval *intervals,
                          const struct realise_step *step, const struct realise_ends *ends, double *changes,
                          double *values);
/* The residuals (2 n) of the end. False if the equations fail. */
bool realise_end_find(const struct realise_motion *motion, const struct realise_goal *goal,
                      double *residuals);
/* The effort relative to its unit, and the squares of the distances of both ends from their goals with their
 * weights. */
double realise_merit(const struct realise_motion *motion, const struct realise_goal *goal);
/* The integral of the sum of (w tau)^2. */
double realise_effort(const struct realise_motion *motion);

/* ---- The first guess (damped_motion.c) ---- */

/* Finds the drive forces and multipliers (drives + loops) that hold the start at rest; returns the largest
 * remaining acceleration, and its coordinate. */
double realise_hold(struct realise_problem *problem, double t, const double *q, double *unknowns,
                    int *coordinate);
/* Solves for an equilibrium on the position rows, held by the drives, from q. Returns whether there is one.
 */
bool realise_equilibrium(struct realise_problem *problem, double t, double *q);
/* Of the motions that more drives than rows allow: the one with the least changes of coordinates, or of
 * forces, in each step. */
enum realise_guesses { REALISE_NEAR, REALISE_WEAK, REALISE_GUESSES };
/* Fills the motion with steps of the implicit Euler method from the first node, of at least `step_least`: the
 * method damps a growing mode if the step is longer than 2/growth. */
void realise_guess(struct realise_motion *motion, enum realise_guesses which, double step_least);
/* Continues such a motion at its last time until it rests; the state (2 n) changes. False if it does not. */
bool realise_rest(struct realise_problem *problem, double t, double step, double *state);

/* ---- The solution (solution.c) ---- */

/* REALISE_FALLING: the effort still decreases when no further correction is allowed. */
enum realise_outcome { REALISE_SOLVED, REALISE_STUCK, REALISE_FALLING, REALISE_NOT_FINITE, REALISE_STOPPED };

struct realise_solution {
    struct realise_motion motion;
    int iterations;    /* of Newton's method */
    double correction; /* the last one [m, rad] */
    int most;          /* iterations towards the least effort */
    bool is_refined;   /* the guess is the least effort of a coarser mesh */
};

/* Starts a motion on a mesh with steps of at most `mesh`, from `before` ahead of the scene's start to `after`
 * past `until`. Its first node is the scene's state. */
void realise_mesh(struct realise_motion *motion, struct realise_problem *problem, double before, double until,
                  double after, double mesh);
/* Solves from the guess in the motion. `last` (3 n): the coordinates, rates and accelerations that the end
 * comes close to. */
enum realise_outcome realise_solve(struct realise_solution *solution, const double *last);
/* The same motion on a mesh of half the steps, as a guess. */
void realise_refine(struct realise_motion *fine, const struct realise_motion *coarse);
/* The state (2 n) and drive forces (drives) of the motion at a time within its mesh. */
void realise_state(const struct realise_motion *motion, double t, double *state, double *tau);
/* Means of the drive forces (drives) from t to t + length. */
void realise_means(const struct realise_motion *motion, double t, double length, double *means);

/* ---- Modes and cosines (internal_modes.c) ---- */

struct realise_modes {
    int growing, centre, decaying;
    bool vibrates;           /* a centre mode oscillates */
    double slowest, fastest; /* growth, 0 if nothing grows [1/s] */
    double *cosines;         /* (m - loops) between the programme's rows and the drives, in the metric M^-1 */
    int cosine_count;
};

/* Those of the internal motions about the start, held by `unknowns` (drives + loops). False if the equations
 * have no modes. */
bool realise_modes_find(struct realise_problem *problem, double t, const double *q, const double *unknowns,
                        struct realise_modes *modes);

/* ---- The drive forces of a programme (realise.c) ---- */

/* The path of --from, NULL if it is no STATE.json. `--from held` starts at the equilibrium on the programme
 * that the drives hold. */
const char *realise_state_path(const struct options *options);
/* What a scene needs in addition to simulate_needs. */
enum { REALISE_NEEDS = NEEDS_POINT_RATES | NEEDS_DRIVES };
/* Opens the scene without the programme, in which the forces are played back. `needs`: how it is compiled. */
enum status realise_open_played(struct scene *played, const struct options *options, unsigned needs);
/* Refuses a model with too few drives or without smooth motions. */
enum status realise_check_model(const struct scene *scene);
/* The times for which the drives act before the start and after the end, from the options [s]; 0 where they
 * follow from the growth of modes. `before` is rounded up to a multiple of `every`, the time between outputs.
 * Reports an error if a programme of this length [s] has too many outputs. */
enum status realise_tails(const struct options *options, double length, double every, double *before,
                          double *after);

/* A programme that drives perform. */
struct realise_work {
    const struct options *options;
    struct scene *scene;
    struct realise_problem problem;
    struct realise_modes modes;
    struct realise_solution solution;
    double before, after, until, mesh, every;
    double *hold;       /* (drives + loops) forces that hold the start */
    double *last;       /* (3 n) coordinates, rates and accelerations that the end comes close to */
    int iterations;     /* on the first mesh */
    double mesh_change; /* of the drive forces, relative, to the mesh that comes closest */
    double *peak;       /* (drives) */
    double *means;      /* (cells x drives) over the outputs' cells */
    int cells;
    double playback; /* largest error of the motion played back from rest [m, rad] */
    double cpu_s;    /* of the solution */
};

static inline const struct model *realise_model(const struct realise_work *work) {
    return &work->scene->generation.model;
}

/* Finds motion and forces, from the start that the options select, and plays the forces back with the options
 * of `integration`. `played`: the scene without the programme, NULL: opens it once the forces are found.
 * Reports errors on stderr. */
enum status realise_find(struct realise_work *work, struct scene *scene, struct scene *played,
                         const struct options *options, const struct refdyn_options *integration);

/* Receives the motion. `begin` has its table before the first row, `put` each row, with the drive forces as
 * means over their cells. Both return a status of the runtime, or RECORD_NOT_WRITTEN. */
struct realise_rows {
    const double *times; /* (count) of the rows */
    int count;
    void *context;
    int (*begin)(void *context, struct record_table *table);
    int (*put)(void *context, struct record_table *table, int number);
};

/* Passes the motion to `rows` at their times. `limits`, if not NULL, is started and compared with the rows.
 */
enum status realise_show(struct realise_work *work, const struct realise_rows *rows,
                         struct record_limits *limits);

/* A number of the report. */
struct realise_number {
    const char *name, *unit;
    double value;
};

/* The numbers of the report of a model, in the program's memory; returns how many there are. Without `work`
 * they have only names and units. */
int realise_list_numbers(const struct model *model, const struct realise_work *work,
                         struct realise_number **numbers);

/* ---- The command (realise_command.c) ---- */

extern const struct option_rule realise_rules[];
/* Reports options that --realise excludes, or that need it. */
enum status realise_check_options(const struct options *options);
enum status realise_run(const struct options *options);

#endif
