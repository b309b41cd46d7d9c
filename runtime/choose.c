/*
 * The automatic choice of a method: by trial.
 *
 * Takes the accepted steps of a drive; gives the method of the next one. An explicit method, a Rosenbrock
 * method and a collocation method take some steps in turn, and the one that goes furthest for its counted
 * operations goes on, until the next trial: after a while that doubles, or when it has slowed down. What
 * stands no chance is not tried: an explicit method whose stability limit is too short, implicit ones where
 * it is accuracy that rules the step of the explicit one. The limit comes from the largest rate of the
 * linearised equations, whose damping chooses between the points of Gauss and Radau, too. Where forces
 * saturate, as friction, the Rosenbrock method is left out: its steps are linear, and damp the error that
 * would tell that what sticks begins to slide.
 */
#include "base/arithmetic.h"

#include "private/choose.h"

#include <float.h>
#include <math.h>

#include "linear/chain_cost.h"
#include "private/linearise.h"
#include "private/runge_kutta.h"
#include "private/step.h"

/* Places of the candidates. */
enum { EXPLICIT, ROSENBROCK, COLLOCATION };

enum {
    TRIAL_STEPS = 10,
    MEASURED_STEPS = 4,
    LOOK_STEPS = 25,
    FEW_STEPS = 200,
    FEW_STEPS_AT_LIMIT = 100,
    MANY_STEPS = 500,
    PATIENCE_FIRST = 100,
    PATIENCE_MOST = 5000
};

/* |lambda| h of rk8 on the imaginary and on the negative real axis, a little inside. */
static const double explicit_limit = 5;
static const double near_limit = 0.8;
/* Below this |lambda| h the step of an explicit method follows its accuracy. */
static const double follows_accuracy = 2;
/* Damping ratio of the fastest mode from which it has to be damped: Radau. */
static const double damped = 0.2;
/* In a motion of many steps the errors of a Rosenbrock method, which damps vibrations that nothing else damps
 * and has a lower order in stiff motions, add up to so many times those of the others; above the tolerance
 * `loose` they may be too small to be followed, and below it the factor grows with this power. */
static const double adds_up = 30, loose = 1e-4, adds_up_power = 0.75;
/* Radians of the fastest mode in a step, below which it is followed, and the factor by which errors of a
 * method that does not damp it add up. */
static const double followed = 10, adds_up_followed = 5;
/* The same factor of an explicit method that stirs up what would be damped. */
static const double stirred_up = 5;
/* Radians of the fastest mode in a step of a Rosenbrock method, above which it is not excited. */
static const double left_behind = 300;
/* Where fast modes are damped, a Rosenbrock method loses order: it has to go this much further than
 * collocation, whose errors do not grow with the steps. */
static const double reduced_order_share = 0.5;
/* A method that goes less far than this part of what it did when chosen is put on trial. */
static const double slowed = 0.4;

/* Operations on dense matrices take this part of the time that those of emitted functions do: they fill
 * vectors. */
static const double dense_share = 0.4;
/* The same of sweeps over joints. */
static const double chain_share = 0.8;
static const double cost_of_unknown = 100; /* operations a coordinate, for models that do not tell */

/* Those of implicit steps with the tangent. */
static double linear_operations(const struct refdyn_drive *drive) {
    const struct refdyn_model *model = drive->work->model;
    const int n = model->n, border = model->m + model->coupling_count;
    const double tangents = (double)drive->statistics.tangents,
                 factorisations = (double)drive->statistics.factorisations,
                 solutions = (double)drive->statistics.solutions;
    if (!drive->linear.is_chain)
        return tangents * model->tangent_cost +
               dense_share * (factorisations * refdyn_matrix_factor_cost(n, model->m) +
                              solutions * refdyn_matrix_solve_cost(n, model->m));
    const int is_planar = drive->linear.chain.is_planar;
    return tangents * model->tangent_vectors_cost +
           chain_share * (factorisations * refdyn_chain_factor_cost(n, border, is_planar) +
                          solutions * refdyn_chain_solve_cost(n, border, is_planar));
}

/* Operations counted so far. */
static double operations(const struct refdyn_drive *drive) {
    const struct refdyn_model *model = drive->work->model;
    const double n = model->n;
    const double qdd = model->qdd_cost > 0 ? model->qdd_cost : cost_of_unknown * n;
    return (double)(drive->work->evaluations - drive->evaluations_before) * qdd + linear_operations(drive);
}

static void mark(struct refdyn_drive *drive) {
    drive->choice.marked_t = drive->t_end;
    drive->choice.marked_operations = operations(drive);
}

static double progress(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    return (drive->t_end - choice->marked_t) / (operations(drive) - choice->marked_operations);
}

static int is_explicit(enum refdyn_method method) {
    return !refdyn_method_facts(method).is_implicit;
}

/* An explicit method cannot keep a step beyond its limit, though a few steps do not show it. */
static double lasting_progress(const struct refdyn_drive *drive, enum refdyn_method method) {
    const struct refdyn_choice *choice = &drive->choice;
    const double now = progress(drive), step = (drive->t_end - choice->marked_t) / MEASURED_STEPS;
    if (method == REFDYN_RODAS5P && choice->damping >= damped && drive->options.tol < loose)
        return now * reduced_order_share;
    if (!is_explicit(method) || !(step * choice->rate > explicit_limit))
        return now;
    return now * explicit_limit / (step * choice->rate);
}

static void ask_for(struct refdyn_drive *drive, int candidate) {
    struct refdyn_choice *choice = &drive->choice;
    choice->at = candidate;
    choice->next = choice->candidates[choice->at];
    choice->steps_left = TRIAL_STEPS;
}

static void go_on_with(struct refdyn_drive *drive, int candidate) {
    struct refdyn_choice *choice = &drive->choice;
    choice->next = choice->candidates[candidate];
    choice->patience = choice->chosen == candidate && choice->patience < PATIENCE_MOST ? 2 * choice->patience
                                                                                       : choice->patience;
    choice->changes += choice->chosen >= 0 && choice->chosen != candidate;
    choice->chosen = candidate;
    choice->at = -1;
    choice->steps_left = choice->patience;
    mark(drive);
}

static int best(const struct refdyn_choice *choice) {
    int found = 0;
    for (int i = 1; i < REFDYN_CANDIDATES; i++)
        if (choice->progress[i] > choice->progress[found])
            found = i;
    return found;
}

/* |lambda| h of the explicit method that is tried, 0 for others. */
static double reach_of_explicit(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    const double step = (drive->t_end - choice->marked_t) / MEASURED_STEPS;
    return is_explicit(choice->candidates[choice->at]) ? step * choice->rate : 0;
}

/* The explicit method's step is ruled by its accuracy: nothing else need be tried. */
static int explicit_suffices(const struct refdyn_drive *drive) {
    return is_explicit(drive->choice.candidates[drive->choice.at]) &&
           reach_of_explicit(drive) < follows_accuracy;
}

/* The motion ends (where the drive knows) before another trial would pay: in few steps at the plain
 * tolerance. At its limit an explicit method's steps say nothing of those that others could take. */
static int is_nearly_done(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    const double gone = choice->progress[best(choice)] / choice->progress[choice->at];
    const double sharper = drive->options.tol / refdyn_choose_tolerance(drive);
    const double step = (drive->t_end - choice->marked_t) / MEASURED_STEPS *
                        pow(sharper, 1.0 / refdyn_method_facts(drive->method).order_error);
    const int few = reach_of_explicit(drive) > near_limit * explicit_limit ? FEW_STEPS_AT_LIMIT : FEW_STEPS;
    return drive->t_final - drive->t_end < few * step * gone;
}

/* Points of Gauss keep vibrations, those of Radau damp what the steps, as they are now, leave far behind. */
static enum refdyn_method collocation_for(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    return choice->damping < damped && drive->step_next * choice->rate < left_behind ? REFDYN_GAUSS12
                                                                                     : REFDYN_RADAU9;
}

/* Is there a candidate behind the one that is tried, and another method? */
static int has_another(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    choice->candidates[COLLOCATION] = collocation_for(drive);
    return choice->at < COLLOCATION && choice->candidates[choice->at] != choice->candidates[choice->at + 1];
}

static void judge(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    choice->progress[choice->at] = lasting_progress(drive, choice->candidates[choice->at]);
    if (explicit_suffices(drive)) {
        go_on_with(drive, choice->at);
    } else if (is_nearly_done(drive)) {
        choice->is_short = drive->statistics.steps < FEW_STEPS; /* too short for errors to add up, too */
        go_on_with(drive, best(choice));
    } else if (has_another(drive)) {
        ask_for(drive, choice->at + 1);
    } else {
        go_on_with(drive, best(choice));
    }
}

/* Of a step: those of its stages, and that of its end. */
static int slopes_of_explicit(void) {
    return refdyn_method_facts(REFDYN_RK8).tableau->stages + 1;
}

/* `now`: how far the present method goes. */
static void begin_trial(struct refdyn_drive *drive, double now) {
    struct refdyn_choice *choice = &drive->choice;
    choice->wants_spectrum = 1;
    for (int i = 0; i < REFDYN_CANDIDATES; i++)
        choice->progress[i] = 0;
    const double per_step = slopes_of_explicit() * drive->work->model->qdd_cost;
    const int is_hopeless = choice->chosen > 0 && choice->rate > 0 && per_step > 0 &&
                            explicit_limit / choice->rate / per_step < now / 2;
    ask_for(drive, is_hopeless ? ROSENBROCK : EXPLICIT);
}

/* The fastest mode is undamped, and the steps are short enough to follow it. */
static int follows_vibrations(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    return choice->damping < damped && drive->step_last * choice->rate < followed;
}

/* An explicit method at its limit, of modes that are damped: its steps are as many for any tolerance, and
 * what it stirs up of the fastest mode has the tolerance's size. */
static int damps_at_limit(const struct refdyn_drive *drive) {
    const struct refdyn_choice *choice = &drive->choice;
    return choice->damping >= damped && drive->step_last * choice->rate > near_limit * explicit_limit;
}

double refdyn_choose_tolerance(const struct refdyn_drive *drive) {
    const double tol = drive->options.tol;
    if (drive->options.method == REFDYN_AUTO && drive->method == REFDYN_GAUSS12 && follows_vibrations(drive))
        return tol / adds_up_followed;
    if (drive->options.method == REFDYN_AUTO && is_explicit(drive->method) && damps_at_limit(drive))
        return tol / stirred_up;
    if (drive->options.method != REFDYN_AUTO || drive->method != REFDYN_RODAS5P || drive->choice.is_short ||
        !(tol < loose))
        return tol;
    return fmax(tol / fmin(pow(loose / tol, adds_up_power), adds_up), DBL_EPSILON);
}

void refdyn_choose_start(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    const enum refdyn_method rosenbrock = drive->work->model->saturates ? REFDYN_RADAU9 : REFDYN_RODAS5P;
    *choice = (struct refdyn_choice){.candidates = {REFDYN_RK8, rosenbrock, REFDYN_GAUSS12},
                                     .chosen = -1,
                                     .patience = PATIENCE_FIRST,
                                     .wants_spectrum = 1};
    mark(drive);
    ask_for(drive, EXPLICIT);
}

/* Few steps as the last ones are left, so that no trial pays. */
static int ends_soon(const struct refdyn_drive *drive) {
    return drive->t_final - drive->t_end < FEW_STEPS * (drive->t_end - drive->choice.marked_t) / LOOK_STEPS;
}

/* Does the chosen method still do what it was chosen for? */
static void look(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    const double now = progress(drive);
    const int is_due = choice->steps_left <= 0, is_slow = now < slowed * choice->progress[choice->chosen];
    if ((is_due || is_slow) && !ends_soon(drive)) {
        begin_trial(drive, now);
    } else {
        mark(drive);
        choice->steps_left = is_due ? choice->patience : choice->steps_left;
    }
}

/* Gauss's points were chosen in a transient whose vibrations the steps have left behind by now. */
static void damp_what_is_left_behind(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    if (drive->method != REFDYN_GAUSS12 || collocation_for(drive) == REFDYN_GAUSS12)
        return;
    choice->candidates[COLLOCATION] = REFDYN_RADAU9;
    choice->next = REFDYN_RADAU9;
}

void refdyn_choose_after_step(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    drive->statistics.steps_by[drive->method]++;
    if (drive->options.method != REFDYN_AUTO || !refdyn_has_tangent(drive->work->model))
        return;
    choice->steps_left--;
    damp_what_is_left_behind(drive);
    if (choice->at >= 0 && choice->steps_left == MEASURED_STEPS)
        mark(drive);
    if (choice->at >= 0 && choice->steps_left == 0)
        judge(drive);
    else if (choice->at < 0 && (choice->steps_left <= 0 || choice->steps_left % LOOK_STEPS == 0))
        look(drive);
}

/* Step that a method begins with after another one. */
static double first_step(const struct refdyn_drive *drive, enum refdyn_method method) {
    const double rate = drive->choice.rate, h = drive->step_next;
    return is_explicit(method) && rate > 0 ? fmin(h, explicit_limit / rate) : h;
}

/* So many steps of an explicit method until the end that it is not worth beginning with it. */
static int is_too_long_for_explicit(const struct refdyn_drive *drive) {
    const double steps = (drive->t_final - drive->t_end) * drive->choice.rate / explicit_limit;
    return isfinite(steps) && steps > MANY_STEPS;
}

/* The rates of the linearised equations. Where the tangent is not finite, as at a root of 0, they are unknown
 * and the explicit method goes on. */
static void look_at_rates(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    choice->wants_spectrum = 0;
    if (refdyn_linear_spectrum(drive, &choice->rate, &choice->damping)) {
        choice->rate = choice->damping = 0;
        ask_for(drive, EXPLICIT);
        return;
    }
    if (choice->at > 0 || (choice->chosen < 0 && is_too_long_for_explicit(drive)))
        ask_for(drive, ROSENBROCK);
}

static void begin_with(struct refdyn_drive *drive, enum refdyn_method method) {
    drive->method = method;
    drive->step_next = first_step(drive, method);
    drive->is_aligned = 0;
    drive->factored_h = drive->last_h = drive->rate = 0;
    drive->tried_t = INFINITY;
    drive->error_last = 1;
    drive->step_last = drive->refused_h = 0;
    drive->step_cap = INFINITY;
    drive->cap_growth = 1;
}

void refdyn_choose_take_up(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    if (drive->options.method != REFDYN_AUTO)
        return;
    if (choice->wants_spectrum && refdyn_has_tangent(drive->work->model))
        look_at_rates(drive);
    if (choice->next != drive->method)
        begin_with(drive, choice->next);
}

int refdyn_choose_after_failure(struct refdyn_drive *drive) {
    struct refdyn_choice *choice = &drive->choice;
    if (drive->options.method != REFDYN_AUTO || is_explicit(drive->method) || !refdyn_linear_at_begin(drive))
        return 0;
    ask_for(drive, EXPLICIT);
    begin_with(drive, choice->next);
    return 1;
}

void refdyn_choose_go_back(struct refdyn_drive *drive, double back) {
    drive->choice.marked_t -= back;
}
