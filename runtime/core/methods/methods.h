/*
 * Integration methods: a step of a motion, the kinds of methods, and their coefficients as data.
 *
 * README.md shows how to add a method. In arrays, n is the number of coordinates and s the number of stages.
 */
#ifndef REFDYN_METHODS_H
#define REFDYN_METHODS_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"

/*
 * ---- Steps and methods ----
 *
 * A step leads from `state` with `rates` at t_begin to `state_new`, where the caller then evaluates
 * `rates_new`. Between them, theta in [0, 1] denotes the time t_begin + theta (t_end - t_begin). All
 * variables belong to the motion and are in struct refdyn_step; methods are constant, so that several motions
 * can be stepped side by side.
 */

/* Control of the step length by error estimates: step_control.c. */
enum refdyn_controller { REFDYN_PI, REFDYN_PREDICTIVE, REFDYN_FILTER };

struct refdyn_step;
struct refdyn_method_definition;

/* Properties and functions that methods of one kind share. */
struct refdyn_method_kind {
    enum refdyn_controller controller;
    int is_implicit;       /* the method needs the tangent */
    int complexes;         /* number of complex matrices that the method factors */
    int begins_by_tangent; /* the tangent is evaluated at t_begin */
    int leaves_out_work;   /* state_new lacks the work done; quadrature computes it */
    int ends_at_outputs;   /* steps end at outputs, because the interpolant has a lower order */
    /* Returns the number of doubles in `memory`. */
    int (*memory_size)(const struct refdyn_method_definition *method, const struct refdyn_model *model);
    /* Forgets the polynomials of earlier steps and, with is_new, all information about the motion. NULL: the
     * methods keep none. */
    void (*begin)(struct refdyn_step *step, int is_new);
    /* Computes `state_new` and `error` from `state`. Errors: those of refdyn_rates, MATRIX_SINGULAR,
     * NO_CONVERGENCE, with their time in failed_t. */
    int (*take)(struct refdyn_step *step, double h);
    /* Computes the state at theta (2 n + 1, or 2 n with leaves_out_work). Errors: those of refdyn_rates. */
    int (*interpolate)(struct refdyn_step *step, double theta, double *state);
};

/* One method. */
struct refdyn_method_definition {
    const char *name;
    int order;
    int order_error;        /* order of the error estimate that controls the step; 0: none, steps are fixed */
    int is_last_new;        /* the last stage is evaluated at state_new */
    int projects_by_matrix; /* states are projected onto the programme in the metric of the real matrix */
    const struct refdyn_method_kind *kind; /* NULL: `auto`, whose steps are taken by other methods */
    const void *table;                     /* coefficients, in the form of the kind */
};

/* Returns NULL if the number is no method. */
const struct refdyn_method_definition *refdyn_method_definition(enum refdyn_method method);

/* Projection of the stages onto the programme: singular_crossing.c. */
struct refdyn_stage_guide {
    int (*bring)(void *context, double t, double *state);
    /* Judges the projection of the end from `before` to `state`; NULL: judged like an ordinary step. */
    int (*follow)(void *context, const double *before, const double *state);
    void *context;
};

struct refdyn_step {
    int n; /* coordinates */
    struct refdyn_evaluation evaluation;
    struct refdyn_linear *linear;
    const struct refdyn_stage_guide *guide; /* NULL: stages are not projected */
    enum refdyn_method number;              /* the method that takes the step */
    const struct refdyn_method_definition *method;
    double tolerance;      /* tolerance at which iterations end; 0: at rounding */
    double t_begin, t_end; /* ends of the last attempted step [s]; equal: no attempt from here */
    double t_limit;        /* stages are evaluated before this time, on the left side of a time event [s] */
    double *state, *rates; /* (2 n + 1), (2 n + 1 + m) at t_begin */
    double *state_new, *rates_new; /* the same at t_end */
    double *stage, *side; /* scratch: the state of a stage, and its rates or the right side of its equation */
    double *error;        /* (2 n) error estimate for q and qd */
    double *units;  /* (n) change that counts as 1 rad: options.length for a translation, 1 for a rotation */
    double *memory; /* private to the method */
    int has_rates_new; /* rates_new were evaluated at state_new */
    int is_met;        /* state_new has been projected onto the programme already. Row met_row had the largest
                          residual;        `side` is the state before projection; row terms and rates_new are evaluated. */
    int met_row;
    int is_looked_into; /* the additional stages of the interpolant have been evaluated */
    double failed_t;    /* time at which the last failed step failed [s] */
};

void refdyn_step_lay_out(struct refdyn_step *step, const struct refdyn_model *model, int memory_size,
                         struct layout *layout);
/* From now on projects stages onto the programme and computes rates by the index partition; NULL: ends this.
 */
void refdyn_step_guide(struct refdyn_step *step, const struct refdyn_stage_guide *guide);
/* Calls `begin` of the method: it forgets earlier steps and, with is_new, all information about the motion.
 */
void refdyn_step_break_off(struct refdyn_step *step, int is_new);
/* Sets both ends of the step to `state` at t, where a motion begins or continues. */
void refdyn_step_place(struct refdyn_step *step, double t, const double *state);
/* Makes the end of the last step the start of the next one, at t_begin, which is on the right side of a time
 * event. */
void refdyn_step_next(struct refdyn_step *step, double t_begin);
/* Discards the attempted step: its end becomes its start. */
void refdyn_step_give_up(struct refdyn_step *step);
/* Attempts the step to t_new by the method. Errors: those of the kind's `take`. */
int refdyn_step_take(struct refdyn_step *step, double t_new, double h);
/* Prepares the step to t_new for an attempt by batches, which write its results. */
void refdyn_step_take_up(struct refdyn_step *step, double t_new);
/* Sets the end of a step that batches or GSL took. */
void refdyn_step_end(struct refdyn_step *step, double t_end);
/* Permits evaluations of rates up to t only; INFINITY: at any time. */
void refdyn_step_limit(struct refdyn_step *step, double t);
/* Returns the time at which rates for time t are evaluated, inside this limit. */
double refdyn_step_inside(const struct refdyn_step *step, double t);
/* Returns theta of a time between the ends. */
double refdyn_step_theta(const struct refdyn_step *step, double t);

/* Makes this the method of the next step; it starts without earlier steps and factors. */
void refdyn_method_use(enum refdyn_method method, struct refdyn_step *step);

static inline size_t refdyn_state_bytes(const struct refdyn_step *step) {
    return (size_t)(2 * step->n + 1) * sizeof(double);
}
static inline size_t refdyn_rates_bytes(const struct refdyn_step *step) {
    return (size_t)refdyn_rates_size(step->evaluation.work->model) * sizeof(double);
}

/* Returns the largest |x_j - y_j| / unit_j (n; y NULL: 0); NaN if an entry is NaN. */
double refdyn_step_largest_change(const struct refdyn_step *step, const double *x, const double *y);
/* Returns the largest max(|e_q|, h |e_v|) / unit of `error`; NaN if an entry is NaN. */
double refdyn_step_largest_error(const struct refdyn_step *step, double h);
/* Hermite's cubic: computes the state (2 n) at theta from the ends, with the given rates at t_end. */
void refdyn_step_hermite(const struct refdyn_step *step, const double *rates_end, double theta,
                         double *state);

/*
 * ---- Collocation methods ----
 *
 * A step of h (theory, sect. 8.6): accelerations a_i at the times t + c_i h, so that with
 *     Q_i = q + h c_i qd + h^2 sum_j aa_ij a_j,   V_i = qd + h sum_j a_ij a_j
 * they are those of the states (Q_i, V_i); then q_new = q + h qd + h^2 sum_j bb_j a_j, qd_new = qd + h sum_j
 * b_j a_j (Hairer, Norsett and Wanner, Solving ODEs I, II.7). L_j(theta) = sum_k lagrange_jk theta^k are the
 * polynomials that are 1 at c_j and 0 at the others. The matrix a_ij is R B L, R L = 1, with a block of B
 * for each eigenvalue: lambda_k of a real one, the rows (re, -im) and (im, re) of a conjugate pair, of which
 * one is listed. L has the left eigenvectors as rows, of pairs their real parts above their imaginary ones.
 *
 * Error: d = acceleration at t_begin + sum_j e_j a_j, the defect of the polynomial there, decreases with h^s;
 * d_low, with one abscissa less, decreases with h^(s - 1). A vibration of x radians a step has d = K x^s and
 * d_low = K_low x^(s
 * - 1) times its acceleration, and an error of its position of C x^(order + 1) times its amplitude: so x =
 * ratio |d| / |d_low|,   error = share h^2 |d| x^(order - s - 1),   ratio = K_low / K, share = C / K.
 */
struct refdyn_collocation_table {
    int stages;
    int continued; /* number of final stages whose polynomial is extrapolated as first guess of the next step
                    */
    int eigenvalues; /* number of eigenvalues listed */
    double ratio, share;
    const double *c;        /* (s) */
    const double *a;        /* (s x s) integrals of L_j to c_i */
    const double *aa;       /* (s x s) its square */
    const double *b;        /* (s) integrals to 1 */
    const double *bb;       /* (s) their integrals to 1 */
    const double *lagrange; /* (s x s) */
    const double *e;        /* (s) -L_j(0) */
    const double *e_low;    /* (s) the same without the last abscissa */
    const double *lambda;   /* (eigenvalues x 2) real and imaginary part; a real one comes first */
    const double *left;     /* (s x s) L */
    const double *right;    /* (s x s) R */
};

/* Computes the accelerations (n) at theta from the polynomial of the last step. */
void refdyn_collocation_accelerations(const struct refdyn_step *step, double theta, double *qdd);

/* The kind of methods with such a table. A guided step iterates without matrices where none fit into memory.
 */
extern const struct refdyn_method_kind refdyn_collocation;

/*
 * ---- Rosenbrock methods ----
 *
 * A step of h from (t, y) with J = df/dy and f_t = df/dt there, in the form without products of matrices and
 * vectors (Hairer and Wanner, Solving ODEs II, 2nd ed., IV.7): (I / (h gamma) - J) U_i = f(t + alpha_i h, y +
 * sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_sum_i h f_t y_new = y + sum_j b_j U_j,   error = sum_j e_j U_j
 * with j < i in the sums over a and c. Between the ends of the step, 0 <= theta <= 1,
 *     y(t + theta h) = (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + theta (K_3 + ...))))
 *     K_k = sum_j interpolant_kj U_j
 * or Hermite's cubic if interpolant_terms is 0. The stages beyond `stages` have the same form with b = e = 0;
 * they are evaluated only when a step is interpolated. `all` is stages + interpolant_stages. A W-method keeps
 * its order with any matrix for J and any vector for f_t, zeros included.
 */
struct refdyn_rosenbrock_table {
    int stages;
    int interpolant_stages;
    int order_error;       /* of the embedded formula, whose weights are b - e */
    int order_interpolant; /* of y(t + theta h) */
    int interpolant_terms; /* 0: the cubic of Hermite */
    int is_w_method;
    double gamma;
    const double *a;           /* (all x all) strictly lower triangle, of U_j */
    const double *c;           /* (all x all) strictly lower triangle, of U_j / h */
    const double *alpha;       /* (all) the times of the stages, in steps */
    const double *gamma_sum;   /* (all) of h f_t */
    const double *b;           /* (all) */
    const double *e;           /* (all) */
    const double *interpolant; /* (interpolant_terms x all) */
};

/* The kind of methods with such a table; steps leave out the work. */
extern const struct refdyn_method_kind refdyn_rosenbrock;

/*
 * ---- Explicit Runge-Kutta methods ----
 *
 * Butcher tableau: Y_s = y + h sum_j a_sj f(t + c_j h, Y_j), y_new = y + h sum_s b_s f_s.
 *
 * Between the ends of the step, 0 <= theta <= 1 (Hairer, Norsett and Wanner, Solving ODEs I, 2nd ed., II.6),
 *     y(t + theta h) = y + h sum_s w_s(theta) f_s,   w_s(theta) = sum_k interpolant_sk theta^(k + 1)
 * over `all` = stages + interpolant_stages rates; those beyond `stages` are evaluated only when a step is
 * interpolated.
 *
 * With two embedded formulas, E = h |sum e_s f_s| and E_low = h |sum e_low_s f_s| are combined to the error
 * E^2 / sqrt(E^2 + E_low^2 / 100). For rk8 this decreases with h^8, E with h^6 and E_low with h^4 (II.10).
 */
struct refdyn_tableau {
    int stages;
    int interpolant_stages;
    int order_error;             /* of the embedded formula; 0: none, the step is fixed */
    int order_error_low;         /* of a second embedded formula; 0: none */
    int order_interpolant;       /* of y(t + theta h) */
    int degree;                  /* of w_s */
    const double *a;             /* (stages x stages) strictly lower triangle */
    const double *b;             /* (stages) */
    const double *c;             /* (stages) */
    const double *e;             /* (stages) b minus the embedded formula's b */
    const double *e_low;         /* (stages) the same of the second one */
    const double *interpolant_a; /* (interpolant_stages x all) rows of a for these stages */
    const double *interpolant_c; /* (interpolant_stages) */
    const double *interpolant;   /* (all x degree) */
};

/* The kind of methods with a tableau. */
extern const struct refdyn_method_kind refdyn_explicit;

/* Computes the derivative of qd (n) of the interpolant at theta. A state must have been interpolated in this
 * step. */
void refdyn_explicit_accelerations(const struct refdyn_step *step, double theta, double *qdd);

/*
 * ---- Jumps and kinks of friction within a collocation step ----
 *
 * Returns the error of the positions after a step of h, in the step's units, where friction causes a jump or
 * a kink of the accelerations; 0 where they are smooth. The test uses their divided differences d_k over
 * theta = 0, c_1 ... c_s, of orders k = s - 3 ... s. A vibration of x radians a step has x^k/k! times its
 * acceleration, alternately with sine and cosine, so that with X > x max(s! d_s/X^s, (s - 1)!
 * d_(s-1)/X^(s-1)) < max((s - 2)! d_(s-2)/X^(s-2), (s - 3)! d_(s-3)/X^(s-3)). Otherwise the error is that of
 * a vibration that the step does not resolve: with x radians a step it is share c_1 ... c_s h^2 d_s x^(order
 * - 1 - s), by the formulas above with K = c_1 ... c_s / s!. The differences are not multiplied by the matrix
 * of the step: in a step that begins at rest, it would damp the sign that sliding has begun.
 *
 * Where the polynomial misses a large part of the accelerations, the error exceeds the tolerance of the step,
 * so that no step continues beyond a layer of friction that it has passed unnoticed.
 *
 * accelerations ((s + 1) x n): at theta = 0 and at the stages; overwritten.
 */
double refdyn_unsmooth_error(const struct refdyn_step *step, double *accelerations, double h);

#endif
