/* Integration methods. */
#ifndef REFDYN_METHODS_H
#define REFDYN_METHODS_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"

/*
 * A step of a motion, and what a method is: facts about it, and functions that take the step and look into
 * it.
 *
 * A step goes from `state` with `rates` at t_begin to `state_new`; whoever asked for it then evaluates
 * `rates_new`. Between them lies the state at t_begin + theta (t_end - t_begin). All that changes belongs to
 * the motion and lies in this struct: methods are constant, so that several motions can be taken side by
 * side.
 */

/* How the length of the next step follows from errors: step_control.c. */
enum refdyn_controller { REFDYN_PI, REFDYN_PREDICTIVE, REFDYN_FILTER };

struct refdyn_step;
struct refdyn_method_definition;

/* What methods of one kind share. */
struct refdyn_method_kind {
    enum refdyn_controller controller;
    int is_implicit;       /* the motion has a tangent, */
    int complexes;         /* with room for so many complex matrices; */
    int begins_by_tangent; /* its tangent is that at t_begin */
    int leaves_out_work;   /* state_new has no work done, which is found by quadrature */
    int ends_at_outputs;   /* between its ends a state has a lower order */
    /* Doubles of `memory`. */
    int (*memory_size)(const struct refdyn_method_definition *method, const struct refdyn_model *model);
    /* Nothing of earlier steps is continued, and with is_new nothing that they told of the motion is kept;
     * NULL: nothing ever is. */
    void (*begin)(struct refdyn_step *step, int is_new);
    /* From `state` to `state_new`, and `error`. Errors: those of refdyn_rates, MATRIX_SINGULAR,
     * NO_CONVERGENCE; then failed_t tells where. */
    int (*take)(struct refdyn_step *step, double h);
    /* The state at theta (2 n + 1, less the work where it is left out). Errors: those of refdyn_rates. */
    int (*interpolate)(struct refdyn_step *step, double theta, double *state);
};

/* One method. */
struct refdyn_method_definition {
    const char *name;
    int order;
    int order_error;        /* of the error that the step is chosen by; 0: none, steps are fixed */
    int is_last_new;        /* the rates of its last stage are those of state_new */
    int projects_by_matrix; /* states are brought onto the programme in the metric of its real matrix */
    const struct refdyn_method_kind *kind; /* NULL: the steps are those of other methods */
    const void *table;                     /* its coefficients, in the form of the kind */
};

/* NULL outside the range. */
const struct refdyn_method_definition *refdyn_method_definition(enum refdyn_method method);

/* Stages are brought onto the programme: motion/singular_crossing.c. */
struct refdyn_stage_guide {
    int (*bring)(void *context, double t, double *state);
    void *context;
};

struct refdyn_step {
    int n; /* coordinates */
    struct refdyn_evaluation evaluation;
    struct refdyn_linear *linear;
    const struct refdyn_stage_guide *guide; /* NULL: stages are where the method puts them */
    enum refdyn_method number;              /* of the method that takes the step, */
    const struct refdyn_method_definition *method;
    double tolerance;              /* of the motion, by which iterations end; 0: at rounding */
    double t_begin, t_end;         /* of the last step that was tried [s]; equal: none from there */
    double t_limit;                /* stages are evaluated before this: the left side of a time event [s] */
    double *state, *rates;         /* (2 n + 1), (2 n + 1 + m) at its begin */
    double *state_new, *rates_new; /* at its end */
    double *stage, *side; /* room: a stage's state, and its rates or the right side of its equation */
    double *error;        /* (2 n) estimate for q, qd */
    double *units;        /* (n) changes that count as 1 rad: options.length for translations, 1 */
    double *memory;       /* the method's own */
    int has_rates_new;    /* rates_new are those of state_new, whatever the method leaves there */
    int is_met; /* whoever took the step has brought state_new onto the programme, of which row met_row
                   was off most, with the state before in `side`, and evaluated its row terms and
                   rates_new */
    int met_row;
    int is_looked_into; /* the method has evaluated what its interpolant alone needs */
    double failed_t;    /* where the last step that failed did [s] */
};

void refdyn_step_lay_out(struct refdyn_step *step, const struct refdyn_model *model, int memory_size,
                         struct layout *layout);
/* Stages are brought onto the programme from now on, and rates taken by the index partition; NULL: not. */
void refdyn_step_guide(struct refdyn_step *step, const struct refdyn_stage_guide *guide);
/* The method continues nothing of earlier steps; with is_new it keeps nothing of what they told, either. */
void refdyn_step_break_off(struct refdyn_step *step, int is_new);
/* A motion begins at `state` at t, or goes on from it: both ends of the step are there. */
void refdyn_step_place(struct refdyn_step *step, double t, const double *state);
/* The end of the last step becomes the begin of the next one, at t_begin, which is right of a time event. */
void refdyn_step_next(struct refdyn_step *step, double t_begin);
/* The step is given up: its end is its begin. */
void refdyn_step_give_up(struct refdyn_step *step);
/* Attempts the step to t_new by the method. Errors: those of the kind's `take`. */
int refdyn_step_take(struct refdyn_step *step, double t_new, double h);
/* The same, where the attempt is not the method's own, but somebody else's who writes its results. */
void refdyn_step_take_up(struct refdyn_step *step, double t_new);
/* A step that others took ended at t_end. */
void refdyn_step_end(struct refdyn_step *step, double t_end);
/* No rates are evaluated behind t; INFINITY: anywhere. */
void refdyn_step_limit(struct refdyn_step *step, double t);
/* The time at which rates at t are evaluated. */
double refdyn_step_inside(const struct refdyn_step *step, double t);
/* theta of a time between the ends. */
double refdyn_step_theta(const struct refdyn_step *step, double t);

/* The next step is one of this method, which continues nothing and keeps no factors: methods.c. */
void refdyn_method_use(enum refdyn_method method, struct refdyn_step *step);

static inline size_t refdyn_state_bytes(const struct refdyn_step *step) {
    return (size_t)(2 * step->n + 1) * sizeof(double);
}
static inline size_t refdyn_rates_bytes(const struct refdyn_step *step) {
    return (size_t)refdyn_rates_size(step->evaluation.work->model) * sizeof(double);
}

/* Largest |x_j - y_j| (n each; y NULL: 0) in the step's units; NaN where one is. */
double refdyn_step_largest_change(const struct refdyn_step *step, const double *x, const double *y);
/* Of `error`, that of positions, and of velocities times h: max(|e_q|, h |e_v|) / unit; NAN where one is. */
double refdyn_step_largest_error(const struct refdyn_step *step, double h);
/* The cubic of Hermite: state (2 n) at theta, with the given rates at the end. */
void refdyn_step_hermite(const struct refdyn_step *step, const double *rates_end, double theta,
                         double *state);

/* Collocation methods as data. */

/*
 * A step of h (theory, sect. 8.6): accelerations a_i at the times t + c_i h, so that with
 *     Q_i = q + h c_i qd + h^2 sum_j aa_ij a_j,   V_i = qd + h sum_j a_ij a_j
 * they are those of the states (Q_i, V_i); then q_new = q + h qd + h^2 sum_j bb_j a_j, qd_new = qd + h sum_j
 * b_j a_j (Hairer, Norsett and Wanner, Solving ODEs I, II.7). L_j(theta) = sum_k lagrange_jk theta^k are the
 * polynomials that are 1 at c_j and 0 at the others. The matrix a_ij is R B L, R L = 1, with a block of B
 * for each eigenvalue: lambda_k of a real one, the rows (re, -im) and (im, re) of a conjugate pair, of which
 * one is listed. L has the left eigenvectors as rows, of pairs their real parts above their imaginary ones.
 *
 * Error: d = the accelerations at the begin + sum_j e_j a_j, what the polynomial misses there, falls with
 * h^s, and d_low, of one abscissa less, with h^(s - 1). A vibration of x radians a step has d = K x^s and
 * d_low = K_low x^(s
 * - 1) times its acceleration, and an error of its position of C x^(order + 1) times its amplitude: so x =
 * ratio |d| / |d_low|,   error = share h^2 |d| x^(order - s - 1),   ratio = K_low / K, share = C / K.
 */
struct refdyn_collocation_table {
    int stages;
    int continued; /* the last so many accelerations of a step are continued as the next one's first guess */
    int eigenvalues; /* listed */
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

/* Accelerations (n) at theta of the polynomial of the step that was taken. */
void refdyn_collocation_accelerations(const struct refdyn_step *step, double theta, double *qdd);

/* Methods whose table is one of these. A guided step finds its stages without matrices where there is no room
 * for them. */
extern const struct refdyn_method_kind refdyn_collocation;

/* Rosenbrock methods as data, in the form without products of matrices and vectors. */

/*
 * A step of h from (t, y) with J = df/dy and f_t = df/dt there (Hairer and Wanner, Solving ODEs II, 2nd ed.,
 * IV.7):
 *     (I / (h gamma) - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_sum_i h f_t
 *     y_new = y + sum_j b_j U_j,   error = sum_j e_j U_j
 * with j < i in the sums over a and c. Between the ends of the step, 0 <= theta <= 1,
 *     y(t + theta h) = (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + theta (K_3 + ...))))
 *     K_k = sum_j interpolant_kj U_j
 * and without such terms the cubic of Hermite.
 *
 * The stages beyond `stages` serve this interpolation alone: they are of the same form, b and e are zero
 * there, and a step that nobody looks into does not need them. `all` is stages + interpolant_stages.
 *
 * A W-method keeps its order with any matrix in place of J and any vector in place of f_t, zeros among them.
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

/* Methods whose table is one of these; the step leaves out the work. */
extern const struct refdyn_method_kind refdyn_rosenbrock;

/* Explicit Runge-Kutta methods as data. */

/*
 * Butcher tableau: Y_s = y + h sum_j a_sj f(t + c_j h, Y_j), y_new = y + h sum_s b_s f_s.
 *
 * Between the ends of the step, 0 <= theta <= 1 (Hairer, Norsett and Wanner, Solving ODEs I, 2nd ed., II.6),
 *     y(t + theta h) = y + h sum_s w_s(theta) f_s,   w_s(theta) = sum_k interpolant_sk theta^(k + 1)
 * over `all` = stages + interpolant_stages rates: those beyond `stages` serve the interpolant alone, and a
 * step that nobody looks into does not need them.
 *
 * With two embedded formulas, E = h |sum e_s f_s| and E_low = h |sum e_low_s f_s| count as the error
 * E^2 / sqrt(E^2 + E_low^2 / 100); for rk8 it falls with h^8, E with h^6 and E_low with h^4 (II.10).
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
    const double *interpolant_a; /* (interpolant_stages x all) their rows of a */
    const double *interpolant_c; /* (interpolant_stages) */
    const double *interpolant;   /* (all x degree) */
};

/* Methods whose table is a tableau. */
extern const struct refdyn_method_kind refdyn_explicit;

/* Derivative of qd (n) of the interpolant at theta, once a state was interpolated in that step. */
void refdyn_explicit_accelerations(const struct refdyn_step *step, double theta, double *qdd);

/* Does the polynomial of a collocation step follow its accelerations? */

/*
 * The error of a step of h in its positions, in the step's units, where friction makes a jump or a kink of
 * its accelerations; 0: they are smooth. Told by their divided differences d_k over theta = 0, c_1 ... c_s,
 * of orders k = s - 3 ... s. Those of a vibration of x radians a step are x^k/k! times its acceleration, with
 * sines and cosines in turn, so that with X > x
 *     max(s! d_s/X^s, (s - 1)! d_(s-1)/X^(s-1)) < max((s - 2)! d_(s-2)/X^(s-2), (s - 3)! d_(s-3)/X^(s-3)).
 * Where that is not so, the error is that of a vibration that the step does not resolve: with so many radians
 * x it is share c_1 ... c_s h^2 d_s x^(order - 1 - s): methods.h, where K = c_1 ... c_s / s!. No matrix
 * of the step stands before the differences, which in a step that begins in rest would damp what tells that
 * sliding has begun.
 *
 * Where the polynomial misses a good part of the accelerations the error is more than the tolerance of the
 * step: no step goes on from beyond a layer of friction that it has not met.
 *
 * accelerations ((s + 1) x n): at theta = 0 and at the stages; they are lost.
 */
double refdyn_unsmooth_error(const struct refdyn_step *step, double *accelerations, double h);

#endif
