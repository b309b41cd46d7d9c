/*
 * The automatic choice of a method: by trial.
 *
 * In: the accepted steps of a motion. Out: the method of the next one. There are two candidates: an explicit
 * method, and the implicit one that suits tolerance, damping and step.
 *
 * The largest rate of the linearised equations determines the stability limit of the explicit method. If many
 * of its steps would be needed before the end, the implicit method begins. The other candidate takes some
 * steps on trial if it has a chance: the implicit one if stability limits the explicit steps, the explicit
 * one if its limit lets it go half as far. The method that goes further for its counted operations continues
 * until the next trial, after a time that doubles, or when it has slowed down.
 *
 * Where forces saturate, such as friction, there is one candidate. A sliding body does not show the rate at
 * which it will stick; of all methods, the points of Radau damp that rate and see where it comes and goes.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/chain_cost.h"
#include "runtime/core/methods/methods.h"

/* Indices of the candidates. */
enum { EXPLICIT, IMPLICIT };

/* The cases named here are those of tests/suite.py. */

/* A trial has ten steps, of which four are measured. In the others the step changes from that of the method
 * before to its own; it grows by a factor of at most 5 each. Ten implicit steps cost as much as 20 to 25
 * steps of rk8, a fifth of the 130 on which they have to pay. With 100 instead, case E 2e11, which rk8 can
 * end in 132 steps, changes over and takes 1.3 times as long; with 150, case programme, fast (163 steps) does
 * not, and takes 1.5 times as long. */
enum { TRIAL_STEPS = 10, MEASURED_STEPS = 4, LOOK_STEPS = 25, FEW_STEPS = 130 };

/* |lambda| h of rk8: it is stable up to 5.97 on the imaginary and 6.40 on the negative real axis. Below half
 * of this limit, accuracy determines the step. */
static const double explicit_limit = 5;
/* Damping ratio of the fastest mode from which a method has to damp it: of a step of x radians e^(-0.2 x)
 * remains, 0.14 for ten radians, while the points of Gauss leave all of it. */
static const double damped = 0.2;
/* The tolerance above which a Rosenbrock method goes further than the points of Radau. Instructions of
 * rodas5p over those of radau9 in stiff motions (ratio 1, massless beam, elements 64, 256, reference
 * manipulator with damping, spacearm): 0.3 to 0.9 at 1e-4; 1.0 to 1.6 at 1e-6 (massless beam 0.7), where its
 * errors also add up. */
static const double loose = 1e-5;
/* Radians of the fastest mode in a step, below which the step follows it, as far as the error estimate of
 * collocation sees it; and the factor by which errors of Gauss's points add up then. Without the factor,
 * errors of 29 cases are in proportion to the tolerance, with it those of 30. */
static const double followed = 10, adds_up_followed = 5;
/* Radians of the fastest mode in a step, above which it is not excited. Without this limit the heavy tip
 * takes 80 steps at a tolerance of 1e-8, with it 65. */
static const double left_behind = 300;
/* A trial begins when a method advances by less than this part of its advance when it was chosen. It is below
 * half, so that another method can win back the cost of the trial. */
static const double slowed = 0.4;
/* Tolerance of errors of rates, accelerations and forces in explicit steps at their stability limit, relative
 * to the largest so far, over the tolerance of positions. With 20, accelerations of models/planar.lua and
 * spinup.lua are within 1e-3 at 200 to 4000 outputs; with 100, within 3e-3; without a bound, within 70. */
static const double excited = 20;
/* A step of a trial counts with the length that its error of positions alone would allow, at most this many
 * times its own. */
static const double held_back_most = 10;
/* Time of an operation over that in an emitted function: on dense matrices, which fill vector registers, and
 * in sweeps over joints. Measured by tests/bench/implicit. */
static const double dense_share = 0.4, chain_share = 0.8;

/* Operations of implicit steps with the tangent. */
static double linear_operations(const struct refdyn_motion *motion) {
    const struct refdyn_model *model = motion->work->model;
    const int n = model->n, border = model->m + model->coupling_count;
    const double tangents = (double)motion->linear.counts.tangents,
                 factorisations = (double)motion->linear.counts.factorisations,
                 solutions = (double)motion->linear.counts.solutions;
    if (!motion->linear.is_chain)
        return tangents * model->tangent_cost +
               dense_share * (factorisations * refdyn_matrix_factor_cost(n, model->m) +
                              solutions * refdyn_matrix_solve_cost(n, model->m));
    const int is_planar = motion->linear.chain.is_planar;
    return tangents * model->tangent_vectors_cost +
           chain_share * (factorisations * refdyn_chain_factor_cost(n, border, is_planar) +
                          solutions * refdyn_chain_solve_cost(n, border, is_planar));
}

/* Operations counted so far. */
static double operations(const struct refdyn_motion *motion) {
    const struct refdyn_model *model = motion->work->model;
    const long evaluations = motion->work->evaluations - motion->evaluations_before;
    return (double)evaluations * model->qdd_cost + linear_operations(motion);
}

static void mark(struct refdyn_motion *motion) {
    motion->automatic.way = 0;
    motion->automatic.marked_operations = operations(motion);
}

/* The mean length of the steps since the last mark. */
static double mean_step(const struct refdyn_motion *motion, int steps) {
    return motion->automatic.way / steps;
}

static double progress(const struct refdyn_motion *motion) {
    const struct refdyn_automatic *choice = &motion->automatic;
    return choice->way / (operations(motion) - choice->marked_operations);
}

static int is_explicit(enum refdyn_method method) {
    return !refdyn_method_definition(method)->kind->is_implicit;
}

/* Progress of the method in use over the steps since the last mark. An explicit method cannot keep a step
 * beyond its limit, although a few steps do not show it. */
static double lasting_progress(const struct refdyn_motion *motion, int steps) {
    const double reach = mean_step(motion, steps) * motion->automatic.found.rate;
    return progress(motion) *
           (is_explicit(motion->step.number) && reach > explicit_limit ? explicit_limit / reach : 1);
}

/* Forces saturate, and the model has a tangent. */
static int has_one_candidate(const struct refdyn_motion *motion) {
    const struct refdyn_model *model = motion->work->model;
    return model->saturates && refdyn_has_tangent(model);
}

/* The points of Gauss keep vibrations; the others damp vibrations that are much faster than the present
 * steps. */
static enum refdyn_method implicit_for(const struct refdyn_motion *motion) {
    const struct refdyn_automatic *choice = &motion->automatic;
    const double h = motion->control.next; /* 0 at the start: unknown */
    if (has_one_candidate(motion))
        return REFDYN_RADAU9;
    if (choice->found.damping < damped && h > 0 && h * choice->found.rate < left_behind)
        return REFDYN_GAUSS12;
    return motion->options.tol > loose ? REFDYN_RODAS5P : REFDYN_RADAU9;
}

/* One of the two candidates takes the next step. */
static void use(struct refdyn_motion *motion, int candidate) {
    struct refdyn_automatic *choice = &motion->automatic;
    choice->found.candidates[IMPLICIT] = implicit_for(motion);
    choice->next = choice->found.candidates[candidate];
}

static void ask_for(struct refdyn_motion *motion, int candidate) {
    struct refdyn_automatic *choice = &motion->automatic;
    use(motion, candidate);
    choice->at = candidate;
    choice->steps_left = TRIAL_STEPS;
}

static void go_on_with(struct refdyn_motion *motion, int candidate) {
    struct refdyn_automatic *choice = &motion->automatic;
    use(motion, candidate);
    choice->patience *= choice->chosen == candidate ? 2 : 1;
    choice->chosen = candidate;
    choice->at = -1;
    choice->steps_left = choice->patience;
    mark(motion);
}

/* Too few steps of this length remain for another trial to pay; never if the end is not known. */
static int is_nearly_done(const struct refdyn_motion *motion, double step) {
    return motion->t_final - motion->step.t_end < FEW_STEPS * step;
}

/* Stability, not accuracy, limits the explicit steps since the last mark, and enough of them remain. */
static int implicit_may_pay(const struct refdyn_motion *motion, int steps) {
    const double rate = motion->automatic.found.rate;
    return mean_step(motion, steps) * rate >= explicit_limit / 2 &&
           !is_nearly_done(motion, explicit_limit / rate);
}

/* The trial has ended. An explicit method at its limit is not compared with the steps of an implicit one
 * before the trial, maybe in a transient, but with a trial that follows its own. */
static void judge(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    double *gone = choice->found.progress;
    gone[choice->at] = lasting_progress(motion, MEASURED_STEPS);
    const int winner = gone[IMPLICIT] > gone[EXPLICIT] ? IMPLICIT : EXPLICIT;
    if (choice->at == EXPLICIT && winner == EXPLICIT && implicit_may_pay(motion, MEASURED_STEPS))
        ask_for(motion, IMPLICIT);
    else
        go_on_with(motion, winner);
}

/* Evaluations of a step: those of its stages, and that of its end. */
static int evaluations_of_explicit(void) {
    const struct refdyn_tableau *tableau = refdyn_method_definition(REFDYN_RK8)->table;
    return tableau->stages + 1;
}

/* At its limit it goes less than half as far as the implicit method in use. */
static int explicit_is_hopeless(const struct refdyn_motion *motion) {
    const struct refdyn_choice *found = &motion->automatic.found;
    const double per_step = evaluations_of_explicit() * motion->work->model->qdd_cost;
    return found->rate > 0 && per_step > 0 &&
           explicit_limit / found->rate / per_step < found->progress[IMPLICIT] / 2;
}

/* Tries the candidate that is not in use, unless it has no chance at the rate that was just computed. */
static void try_the_other(struct refdyn_motion *motion) {
    const int chosen = motion->automatic.chosen;
    if (chosen == EXPLICIT ? implicit_may_pay(motion, LOOK_STEPS) : !explicit_is_hopeless(motion))
        ask_for(motion, chosen == EXPLICIT ? IMPLICIT : EXPLICIT);
    else
        go_on_with(motion, chosen);
}

/* The fastest mode is undamped, and the steps are short enough to follow it. */
static int follows_vibrations(const struct refdyn_motion *motion) {
    const struct refdyn_automatic *choice = &motion->automatic;
    return choice->found.damping < damped && motion->control.last * choice->found.rate < followed;
}

double refdyn_automatic_tolerance(const struct refdyn_motion *motion) {
    const double tol = motion->options.tol;
    const int adds_up = motion->options.method == REFDYN_AUTO && motion->step.number == REFDYN_GAUSS12 &&
                        follows_vibrations(motion);
    return adds_up ? fmax(tol / adds_up_followed, DBL_EPSILON) : tol;
}

/* Do errors of rates count in steps of this length? At the stability limit of an explicit method, fast modes
 * that errors have excited do not decay, and positions hardly show them. */
static int rates_count(const struct refdyn_motion *motion, double step) {
    return is_explicit(motion->step.number) && step * motion->automatic.found.rate >= explicit_limit / 2;
}

double refdyn_automatic_error_of_rates(struct refdyn_motion *motion, double h, double error) {
    struct refdyn_automatic *choice = &motion->automatic;
    const double longest = choice->at >= 0 ? held_back_most : 1;
    choice->held_back = 1;
    if (motion->options.method != REFDYN_AUTO || has_one_candidate(motion) ||
        !rates_count(motion, longest * h))
        return 0;
    const double own = refdyn_rate_errors_measure(motion, h, excited * motion->options.tol),
                 order = motion->step.method->order_error + 1,
                 factor = fmin(pow(own / fmax(error, DBL_MIN), 1 / order), longest);
    if (!(own > error) || !rates_count(motion, factor * h))
        return 0;
    choice->held_back = factor;
    return own;
}

void refdyn_automatic_start(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    *choice = (struct refdyn_automatic){.found.candidates = {REFDYN_RK8, REFDYN_RADAU9},
                                        .chosen = -1,
                                        .patience = FEW_STEPS,
                                        .held_back = 1,
                                        .wants_spectrum = !has_one_candidate(motion)};
    mark(motion);
    ask_for(motion, has_one_candidate(motion) ? IMPLICIT : EXPLICIT);
}

/* Does the chosen method still advance as when it was chosen? If not, the rates are computed and a trial of
 * the other one begins; the last steps measure the method in use. */
static void look(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    double *gone = choice->found.progress;
    const double now = lasting_progress(motion, LOOK_STEPS);
    const int is_due = choice->steps_left <= 0, is_slow = now < slowed * gone[choice->chosen],
              is_at_limit = gone[IMPLICIT] == 0 && implicit_may_pay(motion, LOOK_STEPS);
    if ((is_due || is_slow || is_at_limit) && !is_nearly_done(motion, mean_step(motion, LOOK_STEPS))) {
        choice->wants_spectrum = 1;
        gone[EXPLICIT] = gone[IMPLICIT] = 0;
        gone[choice->chosen] = now;
    } else {
        mark(motion);
        choice->steps_left = is_due ? choice->patience : choice->steps_left;
    }
}

/* Gauss's points may have been chosen in a transient whose vibrations are much faster than the present steps.
 */
static void damp_what_is_left_behind(struct refdyn_motion *motion) {
    if (motion->step.number == REFDYN_GAUSS12)
        use(motion, IMPLICIT);
}

/* Back to the only candidate, after steps of rk8 from a state where the tangent is not finite. */
static void go_back_to_it(struct refdyn_motion *motion) {
    if (motion->automatic.steps_left <= 0)
        ask_for(motion, IMPLICIT);
}

void refdyn_automatic_after_step(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    if (motion->options.method != REFDYN_AUTO || !refdyn_has_tangent(motion->work->model))
        return;
    choice->way += choice->held_back * (motion->step.t_end - motion->step.t_begin);
    choice->held_back = 1;
    choice->steps_left--;
    if (has_one_candidate(motion)) {
        go_back_to_it(motion);
        return;
    }
    damp_what_is_left_behind(motion);
    if (choice->at >= 0 && choice->steps_left == MEASURED_STEPS)
        mark(motion);
    if (choice->at >= 0 && choice->steps_left == 0)
        judge(motion);
    else if (choice->at < 0 && (choice->steps_left <= 0 || choice->steps_left % LOOK_STEPS == 0))
        look(motion);
}

/* The first step of a method after another one. */
static double first_step(const struct refdyn_motion *motion, enum refdyn_method method) {
    const double rate = motion->automatic.found.rate, h = motion->control.next;
    return is_explicit(method) && rate > 0 ? fmin(h, explicit_limit / rate) : h;
}

/* An explicit method would take so many steps until the end that the motion does not begin with it. */
static int is_too_long_for_explicit(const struct refdyn_motion *motion) {
    return isfinite(motion->t_final) && motion->automatic.found.rate > 0 &&
           !is_nearly_done(motion, 2 * explicit_limit / motion->automatic.found.rate);
}

/* Computes the rates of the linearised equations. If the tangent is not finite, as at a root of 0, they are
 * unknown and the explicit method continues. */
static void look_at_rates(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    struct refdyn_step *step = &motion->step;
    choice->wants_spectrum = 0;
    memcpy(step->side, step->rates, refdyn_rates_bytes(step));
    const int status =
        refdyn_linear_spectrum(&motion->linear, motion->work, step->t_begin, step->state, step->side,
                               step->stage, &choice->found.rate, &choice->found.damping);
    refdyn_programme_forget(&motion->programme);
    if (status) {
        choice->found.rate = choice->found.damping = 0;
        ask_for(motion, EXPLICIT);
        return;
    }
    if (choice->chosen >= 0)
        try_the_other(motion);
    else if (is_too_long_for_explicit(motion))
        ask_for(motion, IMPLICIT);
}

static void begin_with(struct refdyn_motion *motion, enum refdyn_method method) {
    refdyn_method_use(method, &motion->step);
    refdyn_control_begin(&motion->control, first_step(motion, method));
    refdyn_programme_forget(&motion->programme);
}

void refdyn_automatic_take_up(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    if (motion->options.method != REFDYN_AUTO)
        return;
    if (choice->wants_spectrum && refdyn_has_tangent(motion->work->model))
        look_at_rates(motion);
    if (choice->next != motion->step.number)
        begin_with(motion, choice->next);
}

void refdyn_automatic_leave(struct refdyn_motion *motion) {
    if (motion->options.method == REFDYN_AUTO)
        motion->options.method = motion->step.number;
}

void refdyn_automatic_change(struct refdyn_motion *motion, enum refdyn_method method) {
    begin_with(motion, method);
}

int refdyn_automatic_after_failure(struct refdyn_motion *motion) {
    struct refdyn_automatic *choice = &motion->automatic;
    const struct refdyn_step *step = &motion->step;
    if (motion->options.method != REFDYN_AUTO || is_explicit(step->number) ||
        !refdyn_linear_at_begin(&motion->linear, motion->work, step->t_begin, step->state, step->rates))
        return 0;
    ask_for(motion, EXPLICIT);
    begin_with(motion, choice->next);
    return 1;
}
