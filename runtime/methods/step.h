/*
 * A step of a motion, and what a method is: facts about it, and functions that take the step and look into
 * it.
 *
 * A step goes from `state` with `rates` at t_begin to `state_new`; whoever asked for it then evaluates
 * `rates_new`. Between them lies the state at t_begin + theta (t_end - t_begin). All that changes belongs to
 * the motion and lies in this struct: methods are constant, so that several motions can be taken side by
 * side.
 */
#ifndef REFDYN_STEP_H
#define REFDYN_STEP_H

#include "base/layout.h"
#include "constraints/rates.h"
#include "implicit/linearisation.h"
#include "refdyn.h"

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

#endif
