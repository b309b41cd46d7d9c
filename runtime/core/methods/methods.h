/*
 * Integration methods: a step of a motion, the kinds of methods, and their coefficients as data.
 *
 * README.md shows how to add a method. In arrays, n is the number of coordinates and s the number of stages.
 */
#ifndef REFDYN_METHODS_H
#define REFDYN_METHODS_H

#include "runtime/core/implicit/implicit.h"

/*
 * ---- Steps and methods ----
 *
 * A step leads from `state` with `rates` at t_begin to `state_new`, where the caller then evaluates
 * `rates_new`. Between them, theta in [0, 1] denotes the time t_begin + theta (t_end - t_begin). All
 * variables are in struct refdyn_step; methods are constant.
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
    /* Returns the number of doubles in `memory`. NULL `begin`: the methods keep nothing of earlier steps;
     * else see refdyn_step_break_off. */
    int (*memory_size)(const struct refdyn_method_definition *method, const struct refdyn_model *model);
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

/* Keeps the rates of a step on the side of kinks where it began: repeated_steps.c. */
struct refdyn_side_guard {
    /* Moves a state that is beyond a kink back to it. Returns whether it has moved. */
    int (*hold)(void *context, double t, double *state);
    void *context;
    int only_watches;      /* `hold` moves no state */
    double *state, *inner; /* (2 n + 1) scratch: a state at the kink, and one before it */
    double *rates;         /* (2 n + 1 + m) scratch */
};

struct refdyn_step {
    int n, joints; /* coordinates; those before states */
    struct refdyn_evaluation evaluation;
    struct refdyn_linear *linear;
    const struct refdyn_stage_guide *guide; /* NULL: stages are not projected */
    const struct refdyn_side_guard *guard;  /* NULL: rates are those of the state itself */
    enum refdyn_method number;              /* the method that takes the step */
    const struct refdyn_method_definition *method;
    double tolerance;      /* of the motion; 0: steps are fixed */
    double settled;        /* tolerance at which iterations end; 0: at rounding */
    int iterations, keeps; /* copies: number of iterations, 0: until settled; whether factors are kept */
    double t_begin, t_end; /* ends of the last attempted step [s]; equal: no attempt from here */
    double t_from;         /* t_begin, or the time event on whose right side t_begin is [s] */
    double t_limit;        /* stages are evaluated before this time, on the left side of a time event [s] */
    double *state, *rates; /* (2 n + 1), (2 n + 1 + m) at t_begin */
    double *state_new, *rates_new; /* the same at t_end */
    double *stage, *side; /* scratch: the state of a stage, and its rates or the right side of its equation */
    double *error;        /* (2 n) error estimate for q and qd */
    /* (n) change that counts as 1 rad: options.length for a translation, 1 for a rotation, the scale of a
     * state */
    double *units;
    double *memory;    /* private to the method */
    int has_rates_new; /* rates_new were evaluated at state_new */
    /* state_new has been projected onto the programme already: row met_row had the largest residual, `side`
     * is the state before, row terms and rates_new are evaluated */
    int is_met, met_row;
    /* rates_new are those of state_new at this time, which is right of a time event unless rows jump there
     * [s]; NAN: they are not known. `row_evaluations`: the count of the workspace when it had the row terms
     * of state_new. */
    double t_complete;
    long row_evaluations;
    int is_first;       /* no step was accepted since earlier ones were forgotten */
    int is_looked_into; /* the additional stages of the interpolant have been evaluated */
    double failed_t;    /* time at which the last failed step failed [s] */
};

void refdyn_step_lay_out(struct refdyn_step *step, const struct refdyn_model *model, int memory_size,
                         struct layout *layout);
/* Projects stages onto the programme, and computes rates by the index partition; NULL: ends this. */
void refdyn_step_guide(struct refdyn_step *step, const struct refdyn_stage_guide *guide);
/* Computes the rates of a state in the step. Beyond a kink of the guard, they continue linearly from before
 * it. Errors: those of refdyn_rates. */
int refdyn_step_rates(const struct refdyn_step *step, double t, const double *state, double *rates);
/* The method forgets earlier steps and, with is_new, all information about the motion. */
void refdyn_step_break_off(struct refdyn_step *step, int is_new);
/* Sets both ends of the step to `state` at t_begin, where a motion begins or continues; t_from: as in the
 * struct. */
void refdyn_step_place(struct refdyn_step *step, double t_from, double t_begin, const double *state);
/* The end of the last step becomes the start of the next one. If t_begin is right of a time event there, the
 * state moves on by this difference of rounding, so that many events do not add up to a delay. */
void refdyn_step_next(struct refdyn_step *step, double t_begin);
/* Discards the attempted step: its end becomes its start. */
void refdyn_step_give_up(struct refdyn_step *step);
/* Attempts the step to t_new by the method. Errors: those of the kind's `take`. */
int refdyn_step_take(struct refdyn_step *step, double t_new, double h);
/* Prepares the step to t_new for an attempt by batches, which write its results. */
void refdyn_step_take_up(struct refdyn_step *step, double t_new);
/* Sets the end of a step that batches or GSL took. */
void refdyn_step_end(struct refdyn_step *step, double t_end);
/* Notes that the end is complete: rates_new and row terms in the workspace are those of state_new at t. */
void refdyn_step_complete(struct refdyn_step *step, double t);
/* Permits evaluations of rates up to t only; INFINITY: at any time. */
void refdyn_step_limit(struct refdyn_step *step, double t);
/* Returns the time at which rates for time t are evaluated, inside this limit. */
double refdyn_step_inside(const struct refdyn_step *step, double t);
/* Returns whether t lies before the end of a step that was taken. At a time event, t may lie left of the
 * step's beginning. */
int refdyn_step_is_inside(const struct refdyn_step *step, double t);
/* Returns the end as callers see it: before the first attempt from a time event, the time of the event. */
double refdyn_step_seen_end(const struct refdyn_step *step);
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
/* The same for the coordinates or rates of joints alone. */
double refdyn_step_largest_move(const struct refdyn_step *step, const double *x, const double *y);
/* Returns the largest max(|e_q|, h |e_v|) / unit of `error`; NaN if an entry is NaN. That of a state, whose
 * error is |e_v|, is divided by `span`, which is h or a longer time over which the caller counts errors. */
double refdyn_step_largest_error(const struct refdyn_step *step, double h, double span);
/* Hermite's cubic: computes the state (2 n) at theta from the ends, with the given rates at t_end. */
void refdyn_step_hermite(const struct refdyn_step *step, const double *rates_end, double theta,
                         double *state);

/* ---- Collocation methods: collocation.c has the formulas ---- */

struct refdyn_collocation_table {
    int stages;
    int continued;   /* final stages whose polynomial is extrapolated as first guess of the next step */
    int eigenvalues; /* number of eigenvalues listed */
    double ratio, share;
    const double *c;            /* (s) */
    const double *a, *aa;       /* (s x s) integrals of L_j to c_i; its square */
    const double *b, *bb;       /* (s) integrals to 1, and their integrals */
    const double *lagrange;     /* (s x s) */
    const double *e, *e_low;    /* (s) -L_j(0); the same without the last abscissa */
    const double *lambda;       /* (eigenvalues x 2) real and imaginary part; a real one comes first */
    const double *left, *right; /* (s x s) L, R */
};
/* Computes the accelerations (n) at theta from the polynomial of the last step. */
void refdyn_collocation_accelerations(const struct refdyn_step *step, double theta, double *qdd);
/* Number of iterations of the last step; whether it has kept factors of an earlier one. */
int refdyn_collocation_iterations(const struct refdyn_step *step, int *keeps);
/* A guided step iterates without matrices where none fit into memory. */
extern const struct refdyn_method_kind refdyn_collocation;

/* ---- Rosenbrock methods: rosenbrock.c has the formulas. `all` is stages + interpolant_stages ---- */

struct refdyn_rosenbrock_table {
    int stages, interpolant_stages;
    int order_error;       /* of the embedded formula, whose weights are b - e */
    int order_interpolant; /* of y(t + theta h) */
    int interpolant_terms; /* 0: the cubic of Hermite */
    int is_w_method;
    double gamma;
    const double *a, *c;       /* (all x all) strictly lower triangles, of U_j and of U_j / h */
    const double *alpha;       /* (all) the times of the stages, in steps */
    const double *gamma_sum;   /* (all) of h f_t */
    const double *b, *e;       /* (all) */
    const double *interpolant; /* (interpolant_terms x all) */
};
/* Steps leave out the work. */
extern const struct refdyn_method_kind refdyn_rosenbrock;

/* ---- Explicit Runge-Kutta methods: runge_kutta.c has the formulas. `all` as above ---- */

struct refdyn_tableau {
    int stages, interpolant_stages;
    int order_error;             /* of the embedded formula; 0: none, the step is fixed */
    int order_error_low;         /* of a second embedded formula; 0: none */
    int order_interpolant;       /* of y(t + theta h) */
    int degree;                  /* of w_s */
    const double *a;             /* (stages x stages) strictly lower triangle */
    const double *b, *c;         /* (stages) */
    const double *e, *e_low;     /* (stages) b minus that of the embedded formula, and of the second one */
    const double *interpolant_a; /* (interpolant_stages x all) rows of a for these stages */
    const double *interpolant_c; /* (interpolant_stages) */
    const double *interpolant;   /* (all x degree) */
};

extern const struct refdyn_method_kind refdyn_explicit;
/* The derivative of qd (n) of the interpolant at theta, after a state was interpolated in this step. */
void refdyn_explicit_accelerations(const struct refdyn_step *step, double theta, double *qdd);

#endif
