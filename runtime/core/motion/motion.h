/*
 * Motions: what the files of this folder offer each other, the bindings and batches. Callers use refdyn.h.
 *
 * Parts, in reading order:
 *     obstacles ahead          obstacles.c           what an ordinary step may not pass: the list, the
 * nearest one one accepted step        accepted_step.c       tried, brought onto the programme, judged,
 * counted length of steps          step_control.c        from errors, or equal parts of an interval automatic
 * method         automatic_method.c    the method of the next step, by trial programme programme.c states
 * onto the rows parameters               motion_options.c      the caller's values, with the gains of the
 * step time events              time_events.c         kinks and jumps of formulas of time rows that jump
 * row_changes.c         what happens to them at events rows that fade out       fading_rows.c         the
 * step that ends where rows have become 0 singular states          singular_crossing.c   the step through a
 * state where the rows lose rank state events             state_events.c, event_zeros.c, event_actions.c
 *     kinks                    kinks.c               zeros of values without an action
 *     contacts                 contacts.c, contact_transitions.c
 *     energy                   energy.c              jumps of energy, and work
 *     the motion               integrator.c          start, outputs, and the struct of all these parts
 */
#ifndef REFDYN_MOTION_H
#define REFDYN_MOTION_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"
#include "runtime/core/methods/methods.h"

struct refdyn_motion;

/* ---- Obstacles ahead ---- */

/* What a step looks for, and the nearest obstacle that it has found. */
struct refdyn_ahead {
    double t_out;      /* the time that the caller asks for [s] */
    double h;          /* length of an ordinary step; 0: not known yet [s] */
    double least;      /* no step is shorter [s] */
    double bound;      /* end of the motion, or limit of the caller; INFINITY: none [s] */
    double time_event; /* the next one; INFINITY: none as far as the step reaches [s] */
    double stop;       /* an ordinary step ends there or earlier [s] */
    double remaining;  /* obstacle whose special step has failed; INFINITY: none [s] */
    int rank;          /* independent rows before the end of the step was completed */
    /* refdyn_obstacles_seen, for special steps */
    int (*seen)(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
};

/* A motion begins. */
void refdyn_obstacles_start(struct refdyn_motion *motion);
/* What happens where the last step ended, at the begin of the next one. Errors: those of
 * refdyn_rows_take_new and refdyn_event_actions_take. */
int refdyn_obstacles_leave(struct refdyn_motion *motion);
/* Finds the nearest obstacle on which an ordinary step may end. */
void refdyn_obstacles_find(struct refdyn_motion *motion, double t_out, struct refdyn_ahead *ahead);
/* Takes a special step if an obstacle within reach of ordinary steps of h needs one. Returns 1 if that was
 * done; then state_new at t_end is the new state. Otherwise ahead->stop leaves space for the special step. */
int refdyn_obstacles_step(struct refdyn_motion *motion, double h, struct refdyn_ahead *ahead);
/* A step is good, and its end complete: *t is where a shorter one has to end because of an obstacle in the
 * step; t_begin: no step may be taken; INFINITY: the step stands. An error refuses it. */
int refdyn_obstacles_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* A step was refused, with this status or, if that is 0, for its error. Returns the time of the obstacle that
 * may have caused this, where a shorter step should end; INFINITY: none. */
double refdyn_obstacles_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);

/* From _begin to _end, steps are special: by this method, with stages that the guide brings onto the
 * programme. */
void refdyn_special_step_begin(struct refdyn_motion *motion, enum refdyn_method method,
                               const struct refdyn_stage_guide *guide);
void refdyn_special_step_end(struct refdyn_motion *motion);

/* The nearer of the end of the motion and the caller's limit that is still ahead; INFINITY: neither is. */
double refdyn_motion_bound(const struct refdyn_motion *motion);
/* Times closer to t than this are the same time for the motion; it depends on the larger of t and t_final. */
double refdyn_motion_resolution(const struct refdyn_motion *motion, double t);

/* ---- One accepted step ---- */

/* The last failure of an evaluation or projection. `struct refdyn_failure` is written only by attempt.c. */
struct refdyn_failure {
    int cause; /* 0: none */
    double t;  /* [s] */
};

/* A step that is tried. */
struct refdyn_attempt {
    struct refdyn_ahead ahead;
    double h, t_new; /* length and end of the step to take [s] */
    double size;     /* its error, in tolerances, after refdyn_attempt_measured */
    int is_measured; /* that is known */
    int is_left;     /* the batch was to take the step and could not */
    int is_over;     /* no step is being tried */
};

/* One step towards t_out. Fixed steps never pass it, except for one through a state where the rows lose rank.
 * From state_new at t_end to the same, later. Errors: as refdyn_integrator_step. */
int refdyn_accept_step(struct refdyn_motion *motion, double t_out);

/*
 * The same in parts, so that a batch may take the step: begin, then prepare, plan, take and judge until
 * is_over, when the step is accepted. After begin, these are over already: fixed steps, special steps, and a
 * begin at which events are due. Errors: as refdyn_integrator_step.
 */
int refdyn_attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt);
/* The tangent at the begin, which the steps of some methods need, unless the batch takes them. If there is
 * none, the automatic method continues with another one. */
int refdyn_attempt_prepare(struct refdyn_motion *motion);
int refdyn_attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt);
/* Errors: those of the method, for judge. */
int refdyn_attempt_take(struct refdyn_motion *motion, const struct refdyn_attempt *attempt);
/* The error of the step, as refdyn_step_largest_error. */
void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error);
/* taken: the status with which taking the step ended. */
void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken);

/* The parts of special steps: the method's attempt from t_begin to t_new, with the gains of a step of h; its
 * end on the programme, with partition, rates and work; the record of an accepted step. */
int refdyn_motion_take(struct refdyn_motion *motion, double t_new, double h);
int refdyn_motion_try(struct refdyn_motion *motion, double t_new, double h);
int refdyn_motion_complete(struct refdyn_motion *motion);
int refdyn_motion_accept(struct refdyn_motion *motion, double h);
/* The motion continues from the begin of the step, and nothing of earlier steps is kept; is_new: as in
 * refdyn_step_break_off. */
void refdyn_motion_break_off(struct refdyn_motion *motion, int is_new);
/* Are options.step_limit steps tried? */
int refdyn_step_limit_reached(const struct refdyn_motion *motion);
/* Notes that an evaluation or projection has failed at t. */
void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t);

/* `struct refdyn_statistics` is written only by attempt.c. */
void refdyn_statistics_start(struct refdyn_statistics *statistics);
/* Adds the residuals of the row terms in the workspace. */
void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work);
/* Adds an accepted step of h, with the row terms of its end in the workspace. */
void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h);
/* It was a step of this method. */
void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method);
void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count);
/* A singular state was passed. */
void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing);
/* Copies the counters of other parts. */
void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations);

/*
 * Motions whose steps a batch takes side by side: a motion halts where it would take one. Statuses in
 * addition to those of refdyn.h:
 */
enum {
    REFDYN_HALTED = 1000,
    REFDYN_LEFT_TO_MOTION /* the motion takes the step itself: it needs what the others lack, or its numbers
                             are not finite */
};

/* Steps towards t_out until the batch may take one: HALTED, and *attempt says which. Otherwise t_out is
 * reached or the motion has failed, as with refdyn_integrator_to. *attempt is over before the first call. */
int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out,
                           struct refdyn_attempt *attempt);
/* The step at which it halted was taken: OK or an error of the method. LEFT_TO_MOTION: the motion takes it
 * when it continues. */
void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt, int taken);

/* ---- The length of steps ---- */

/* `struct refdyn_step_control` is written only by step_control.c. */
struct refdyn_step_control {
    double next;                   /* adaptive: proposed step; 0: not known yet [s] */
    double cap, cap_growth;        /* after a failure: longest step [s], and its growth after each success */
    double error_last, last;       /* error and length of the last accepted step; 0: none [s] */
    double refused_error, refused; /* the same of the last attempt at this one; 0: none [s] */
    double from, to;               /* fixed: output interval in progress [s] */
    long interval_steps, interval_done; /* fixed: steps of that interval */
};

/* Smallest step from t_begin that still moves the time by a few units in its last place, also at t_out. */
double refdyn_control_least(double t_begin, double t_out);
/* Times that are nearer to t than this are the same time. */
double refdyn_time_resolution(double t);

/* Adaptive steps begin, or those of another method: with h; 0: refdyn_control_find chooses it. */
void refdyn_control_begin(struct refdyn_step_control *control, double h);
/* Chooses the first step towards t_stop if none is proposed: velocities and accelerations move no coordinate
 * by more than a small part of tol^(1/order). It does not depend on the outputs. Where nothing moves it is
 * `interval`. */
void refdyn_control_find(struct refdyn_step_control *control, const struct refdyn_step *step, double t_stop,
                         double interval);
/* After a very short step to a requested time: if the proposed step is shorter than `least`, it is dropped,
 * and the next step is chosen as at a start. */
void refdyn_control_drop(struct refdyn_step_control *control, double least);
/* No step is longer than h. */
void refdyn_control_bound(struct refdyn_step_control *control, double h);
/* The step to try: the proposed one, shortened so that it ends on t_stop or leaves more than half of itself.
 */
double refdyn_control_clip(const struct refdyn_step_control *control, double t_begin, double t_stop);
/* Proposes the next step after one of h with this error in tolerances. It was accepted; or its error was too
 * large, INFINITY where the step could not be evaluated. */
void refdyn_control_accepted(struct refdyn_step_control *control,
                             const struct refdyn_method_definition *method, double h, double error);
void refdyn_control_refused(struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error);
/* A step of h failed: the next ones are at most a part of it. */
void refdyn_control_failed(struct refdyn_step_control *control, double h);

/* Fixed steps of at most h from t_begin to t_out, unless that interval is in progress. Error: STEP_TOO_SMALL.
 */
int refdyn_control_plan(struct refdyn_step_control *control, double h, double t_begin, double t_out);
/* Length of these steps, and the end of the next one. */
double refdyn_control_fixed(const struct refdyn_step_control *control, double *t_new);
/* It was taken. */
void refdyn_control_fixed_done(struct refdyn_step_control *control);
/* The next step begins elsewhere: a new interval. */
void refdyn_control_leave_interval(struct refdyn_step_control *control);

/* ---- The automatic method ---- */

/* `struct refdyn_automatic` is written only by automatic_method.c. */
struct refdyn_automatic {
    struct refdyn_choice found;
    int chosen;                /* candidate that won the last trial; -1: none has ended yet */
    int at;                    /* candidate on trial; -1: no trial is on */
    enum refdyn_method next;   /* method of the next step */
    long steps_left, patience; /* until the trial of this candidate ends, or the next one begins */
    int wants_spectrum;
    double marked_t, marked_operations;
};

/* Begins the first trial, at the start of a motion. */
void refdyn_automatic_start(struct refdyn_motion *motion);
/* After an accepted step: counts, judges, and asks for another method (its `next`) where that is due.
 */
void refdyn_automatic_after_step(struct refdyn_motion *motion);
/* The tolerance with which the errors of the method in use are as large as those of the others. */
double refdyn_automatic_tolerance(const struct refdyn_motion *motion);
/* After a step that could not be evaluated. Returns 1 if the automatic choice has changed to the explicit
 * method, since the tangent at the begin of the step is not finite: no smaller step changes that. */
int refdyn_automatic_after_failure(struct refdyn_motion *motion);
/* The motion continues from a time before the end of its last step, by `back` [s]. */
void refdyn_automatic_go_back(struct refdyn_motion *motion, double back);
/* Changes to the method that was asked for. */
void refdyn_automatic_take_up(struct refdyn_motion *motion);

/* ---- The programme: projections along directions that suit the method ---- */

/* The matrix for which the directions of the linearisation were computed. `struct refdyn_programme` is
 * written only by programme.c. */
struct refdyn_programme {
    double *q;     /* (n) the mass matrix at this position, */
    int choice;    /* with partition.choices of then; -1: not of M */
    long factored; /* a step's matrix, linear->factored of then; -1: not of one */
    long aligned;  /* how often directions in the metric of M were computed */
};

void refdyn_programme_lay_out(struct refdyn_programme *programme, const struct refdyn_model *model,
                              struct layout *layout);
/* The directions have to be computed again. */
void refdyn_programme_forget(struct refdyn_programme *programme);
/* Moves a state (2 n) at t onto the programme. The row terms of the state are in the workspace, afterwards
 * those of the new one. Errors: those of refdyn_project. */
int refdyn_programme_meet(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                          double *state);
/* Its part for methods that do not project by their matrix: computes directions for the state, unless the
 * present ones suit it. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_programme_align(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                           const double *state);
/* Where a batch that has factored a step's matrix writes its directions (m x n, of all rows in their order).
 */
double *refdyn_programme_take_directions(struct refdyn_programme *programme, struct refdyn_linear *linear);
/* Does a projection change velocities by a larger part of the largest than any error of a step, and, over a
 * time h, by more than positions may change? Both states (2 n). */
int refdyn_programme_moves_velocities(const struct refdyn_step *step, const double *before,
                                      const double *after, double h);
/* The largest change of a position by a projection that does not refuse the step. */
double refdyn_programme_moved_most(const struct refdyn_step *step);

/* ---- Parameters: the caller's, with the gains of the step in the places that the model names ---- */

/* While an integrator works, the workspace evaluates with `own`. Only events write the caller's parameters.
 * `struct refdyn_parameters` is written only by motion_options.c. */
struct refdyn_parameters {
    double *own;     /* as work->p */
    double *callers; /* work->p while `own` are in use */
};

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout);
/* From here to _leave the workspace evaluates with the motion's parameters. */
void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
/* Between them: sets the caller's parameter at a place of p, and copies the caller's values. */
void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value);
/* Between them: copies the caller's values. */
void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_model *model);
/* The gains that the options ask for, for a step of h; INFINITY: none. */
void refdyn_parameters_set_gains(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                                 const struct refdyn_options *options, double h);

/* ---- Time events ---- */

/*
 * Times at which formulas of time alone have kinks or jumps. Every step ends at the next one and sees its
 * left side; the motion continues from its right side. Each side is so far from the event that no rounding of
 * a comparison matters.
 *
 * Times of piecewise linear formulas are known. Others are searched for as far as a step may reach: first a
 * change of sign between 32 samples, or more if the frequency of the functions requires it (model.pace), then
 * bisection. A sign that changes and changes back between two samples is found where a parabola through three
 * samples shows it. No step reaches beyond what was searched.
 */

/* `struct refdyn_time_events` is written only by time_events.c. */
struct refdyn_time_events {
    int count;        /* of known ones */
    double *times;    /* (count) ascending [s] */
    int next;         /* the first of them that lies ahead */
    double *switches; /* (4 switch_count) values that change sign at others, at times after a step's begin */
    double switched;  /* the last of these that was found [s] */
};

void refdyn_time_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                                struct layout *layout);
/* Computes the known ones for the present parameters and inputs; none is passed yet. t, q and qd: any. */
void refdyn_time_events_take(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd);
/* t, or the right side of a time event that is there: where functions have the values with which the motion
 * continues. */
double refdyn_time_events_right_of(const struct refdyn_time_events *events, double t);
/* Entry in the list of obstacles: the next one after the begin of the step. The step evaluates nothing after
 * it, and continues nothing across one at its begin. */
double refdyn_time_events_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);

/* ---- Rows that jump ---- */

/*
 * At time events rows come and go, as x + where(t < 1, 1, 0) y does, or ask for other rates, as x - min(t, 1)
 * does; at kinks in coordinates they turn, as x - abs(y) does; events and callers set inputs and parameters
 * that rows read.
 *
 * The step before the jump uses only the rows on its left side: its end is brought onto them, and states
 * inside it or at its end have their accelerations. The next step begins after the jump, where rows and
 * dependent coordinates are determined again. Positions must already meet the new rows. Rates jump by an
 * impulse u^T Lambda, as in an inelastic impact, so that the residuals of rates stay as they were, with any
 * stabilisation.
 */

/* Residuals before a jump. `struct refdyn_residuals_before` is written only by row_changes.c. */
struct refdyn_residuals_before {
    double *phi, *psi; /* (m) */
    double *state;     /* (2 n) they belong to this state, */
    int are_seen;      /* which the caller has seen last */
};

void refdyn_rows_lay_out(struct refdyn_residuals_before *before, const struct refdyn_model *model,
                         struct layout *layout);
/* After a step was taken: do the rows change at the time event at its end? Row terms in the workspace and
 * scratch of projections are lost. */
void refdyn_rows_look_at_end(struct refdyn_motion *motion);
/* Sets the answer: `rows_change` is written only by row_changes.c. */
void refdyn_rows_change_at_end(struct refdyn_motion *motion, int change);
/* Do coefficients of rows jump at the time event that limits the step, at the state from which it begins? The
 * workspace then holds the row terms after the event. */
int refdyn_rows_jump_at(struct refdyn_motion *motion, double t);
/* The time at which rates and rows of t, inside the last step or at its end, are evaluated. */
double refdyn_rows_side_of(const struct refdyn_motion *motion, double t);
/* If rows have changed where the last step ended: the state and rates from which the next step begins. Entry
 * in the list of obstacles, at time events. Errors: those of refdyn_project and refdyn_rates; ROWS_UNMET. */
int refdyn_rows_take_new(struct refdyn_motion *motion);

/* Notes the residuals of this state, from the row terms in the workspace: of a state before a jump; of a
 * state that the caller sees. */
void refdyn_rows_note(struct refdyn_motion *motion, const double *state);
void refdyn_rows_note_seen(struct refdyn_motion *motion, const double *state);
/* A motion starts: no state was seen before. */
void refdyn_rows_forget_seen(struct refdyn_motion *motion);
/* Have the rows jumped since the state at the begin of the step was noted? Evaluates them there. Errors:
 * NOT_FINITE. */
int refdyn_rows_have_jumped(struct refdyn_motion *motion, int *have);
/* When rows have jumped: rates at the begin of the step jump with them, and the change of energy counts as
 * work. Errors: those of refdyn_project and refdyn_impulse_of_rows; ROWS_UNMET. */
int refdyn_rows_meet(struct refdyn_motion *motion);
/* When the step begins at the state that was seen last: the caller may have set it since; otherwise it jumps
 * with its rows. Errors: those of refdyn_rows_meet. */
int refdyn_rows_meet_seen(struct refdyn_motion *motion);

/* ---- Rows that fade out ---- */

/*
 * Towards a time event, the part of a row that is its own may become smaller and smaller and is 0 from there
 * on, as the part of y in x + (1 - ramp(t, 0.5, 1)) y next to a row x.
 *
 * Until then such rows determine the motion, but near the event rounding dominates them: the rounding of phi
 * is divided by the row's own part, and that of accelerations by its square. The motion itself is smooth. So
 * one step of gauss12 ends at the event: its last stage is 0.034 of the step before it, and nothing is
 * evaluated nearer. Its stages are brought onto the programme. The next step begins with the remaining rows.
 */

/* `struct refdyn_fading` is written only by fading_rows.c. */
struct refdyn_fading {
    double t, looked; /* time event that was examined last, and from how far [s] */
    int is_known;     /* rows fade out towards it; */
    int rank;         /* the rank was this before */
    struct refdyn_stage_guide guide;
};

/* Doubles of a step's memory. */
int refdyn_fading_memory_size(const struct refdyn_model *model);
/* Entry in the list of obstacles. */
void refdyn_fading_start(struct refdyn_motion *motion);
double refdyn_fading_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
int refdyn_fading_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* Did the last step end at such an event? */
int refdyn_fading_is_on(const struct refdyn_motion *motion);
/* A step is refused: the partition is that of its begin again. Returns 0 if the rank is lost there already:
 * then the motion ends. */
int refdyn_fading_refuse(struct refdyn_motion *motion);
/* Is t so near the event that rows do not determine its accelerations? */
int refdyn_fading_is_near(const struct refdyn_motion *motion, double t);

/* ---- Singular states: options.singular = REFDYN_PASS (theory, sect. 8.9) ---- */

/*
 * Where the rows lose rank, K qdd = k has no unique solution. Off the programme, at a distance e from it and
 * a time s before that state, accelerations are wrong by about e/s^2. On the programme they are smooth along
 * a branch. So one step of rk8 passes that state, which lies in the widest gap between its stages. The stages
 * are first brought onto the programme; the embedded formulas estimate the error as they do elsewhere.
 */

/* `struct refdyn_singular_crossing` is written only by singular_crossing.c. */
struct refdyn_singular_crossing {
    double *unpassed;  /* state and rates before the special step, for when it is refused */
    double t;          /* when the rows lose rank [s] */
    double gap;        /* distance of the nearest stage from that time, relative to the step */
    double stretch;    /* longest step through the state that the error should allow [s]; INFINITY: unknown */
    int count, *rows;  /* (m) independent rows, in the order of the model */
    double *distance;  /* (m) of each row from the span of those before it, for reference */
    int *first, *last; /* (n) first and last of these rows that have an entry in a column */
    struct refdyn_refused_crossing refused;
    struct refdyn_stage_guide guide;
};

void refdyn_crossing_lay_out(struct refdyn_singular_crossing *crossing, const struct refdyn_model *model,
                             struct layout *layout);
/* Entry in the list of obstacles. */
void refdyn_crossing_start(struct refdyn_motion *motion);
double refdyn_crossing_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
int refdyn_crossing_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
int refdyn_crossing_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* Did the last step pass such a state? */
int refdyn_crossing_is_on(const struct refdyn_motion *motion);
/* Is t so near a state passed that rows do not determine its accelerations? */
int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t);

/* ---- Contacts: their modes, and the values whose zeros end a step ---- */

/*
 * A contact has one of three modes:
 * - free: its value is the gap;
 * - resting: its row keeps the gap closed, and its value is the force of that row;
 * - touching: other contacts keep the gap closed, or nothing presses it, so that there is no force.
 *
 * To the gap of a contact that touches, and for a short time of one that has just opened, the value adds an
 * allowance for errors and rounding. Each value falls through zero where the mode changes.
 */

struct refdyn_contacts {
    int count, first_row; /* contacts; their rows are the last ones of the model */
    int resting;          /* how many rest */
    int *event;           /* (count) of the model */
    int *mode;            /* (count) enum refdyn_contact_mode */
    double *since; /* (count) when the contact came to rest, extrapolated to the last of its rebounds [s] */
    double *reach; /* (count) error that a gap may have: the tolerance, or rounding */
    double *allowance;     /* (count) added to the gap of a contact that touches, or has just opened, */
    double *allowed_until; /* (count) until then [s] */
    int are_unique;        /* the motion determines the forces: no contact depends on others that rest */
    double tolerance;      /* of positions [rad, or options.length] */
    double longest;        /* step so far; 0: none [s] */
    double *inside; /* (count) how far a gap may be below zero, after an importer has passed its closing;
                       else 0 */
    double late; /* how far after a contact's closing an importer may have stopped [s]; 0: motions locate it
                  */

    double *rates;                        /* (2 n + 1 + m) of a state */
    double *state;                        /* (2 n + 1) */
    double *force_rates;                  /* (count) change of the forces with time, */
    double force_noise, force_rate_noise; /* and rounding of the forces and of these */

    /* of a transition, by contact */
    int *is_closed, *is_at_rest;
    double *gap, *rate; /* gap and its time derivative */
    double *bias;       /* second derivative of the gap where all contacts are free */
    double *scale;      /* largest gap over coordinates */
    double *rounding, *rate_rounding, *bias_rounding; /* of these */
    double *restitution, *qdd;       /* coefficients; (n) accelerations where all contacts are free */
    struct refdyn_one_sided problem; /* of impacts, and of accelerations */
};

void refdyn_contacts_lay_out(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                             struct layout *layout);
/* A motion begins: all contacts are free, and the parameters of the workspace are set accordingly. */
void refdyn_contacts_clear(struct refdyn_contacts *contacts, struct refdyn_workspace *work, double tolerance);
/* Replaces the gaps of contacts that are not free by their values. Errors: those of refdyn_rates. */
int refdyn_contacts_values(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                           const double *state, double *values);
/* Ends the allowance of contacts that have clearly opened at t; `values`: of the state, as above. */
void refdyn_contacts_end_allowances(struct refdyn_contacts *contacts, double t, double *values);
/* The time derivatives of the forces of a state, and their rounding. Errors: those of refdyn_rates. */
int refdyn_contacts_force_rates(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                                const double *state);
/* Where forces are not unique: replaces them by the smallest forces with the same effect, unless some of
 * these would pull. `terms`: result of event_terms at the state. forces (count): in and out. */
void refdyn_contacts_spread(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                            const double *terms, double *forces);
/* A typical length of steps: the longest so far, or a guess before the first one [s]. */
double refdyn_contacts_pace(const struct refdyn_contacts *contacts);
/* The contact of event i; -1: the event is no contact. */
int refdyn_contact_of(const struct refdyn_contacts *contacts, int event);

/*
 * Transitions: contacts close, come to rest, exchange their forces or let go, by impacts.
 *
 * Call _start when the step's begin is the start of a motion and all contacts are free. Contacts that are
 * closed there without a rate rest or touch from the start; *is_changed says whether there are any. Other
 * closed contacts are due. Errors: CONTACT_INSIDE, and those of refdyn_contact_transitions_take.
 */
int refdyn_contact_transitions_start(struct refdyn_motion *motion, int *is_changed);
/*
 * Contacts that are due close or let go at the step's begin. Changes their modes and the rates there;
 * *has_rates says whether rates have changed. Errors: those of refdyn_accelerate; CONTACT_DRIVEN,
 * CONTACTS_UNMET, CONTACT_INSIDE and EVENTS_ACCUMULATE, where work->fault.row is the row of a contact.
 */
int refdyn_contact_transitions_take(struct refdyn_motion *motion, int *has_rates);
/* Switches off the rows of contacts until the next transition, which must follow; their modes stay. */
void refdyn_contact_transitions_release(struct refdyn_motion *motion);

/* ---- State events ---- */

/*
 * Where a value of the model crosses zero, a step ends. Events of the model act there; kinks have no action.
 *
 * Each accepted step is examined in nine places of the method's own interpolant. Where a value has changed
 * its sign, or a parabola through three of them says that it may have been beyond zero in between, the first
 * zero is located on the interpolant. The step is taken again to there, until its end lies on the zero: the
 * event is as accurate as a step.
 *
 * The motion keeps on which side of zero each value is, so that rounding does not count. After an event it is
 * the side to which the crossing led. If an action has turned the value, it follows from the value's rate. A
 * value that is zero at the start is an event if it leaves zero in the event's direction.
 */

enum { REFDYN_EVENT_SAMPLES = 8 }; /* of a step, after its begin */

struct refdyn_state_events {
    int count; /* of values: events of the model, then kinks, which have no direction and no action */
    int named; /* of them, events */
    int *side; /* (count) of zero where each value is: -1, 1; 0: on zero, and its rate does not say where to
                */
    int *side_end; /* (count) the same at the end of the step that is examined */
    int *towards;  /* (count) the side to which the last crossing that was found leads */
    int *due;      /* (due_count) those that happen at the end of the last step, ascending */
    int due_count;
    int *returns;    /* (count) short steps that have stayed at a kink whose jump leads back */
    int due_named;   /* of those due, events */
    int is_told;     /* the caller knows of them; written only by state_events.c */
    int looks_again; /* values may have jumped, because inputs, parameters, the state or formulas of time
                        have; written only by state_events.c */
    double *samples; /* ((REFDYN_EVENT_SAMPLES + 1) x count) values at the begin and in the step */
    double *sizes;   /* (count) largest |value| since the start: below a part of it, that of a kink is zero */
    double *zeros;   /* (count) what counts as zero in the step: values at its begin that are just beyond */
    double *turned;  /* (count) largest rate of a kink at which rows have turned */
    double *values;  /* (count) of the state that is examined */
    double *rates;   /* (count) of the values before what is due happens */
    double *risen;   /* (count) largest |value| of an event since it last happened; INFINITY: it never has */
    double *terms;   /* result of event_terms */
    double *room;    /* (2 n + 1) a state in the step; (n) jump of rates */

    struct refdyn_contacts contacts; /* their values depend on their modes */

    /* the zero that is being located: no step, or the steps so far did not end on it */
    int target, tries;
    int held;              /* kink before which the end of the step was moved back; -1: none */
    int early_tries;       /* steps to zeros that were seen in steps which were too long */
    double t_high, missed; /* the value has crossed zero before this; last distance from zero [s] */

    double t_last; /* of the last event [s], */
    int repeats;   /* and how many followed each other without time between, or with values within rounding */
};

void refdyn_state_events_lay_out(struct refdyn_state_events *events, const struct refdyn_model *model,
                                 struct layout *layout);
/* A motion starts at the step's begin, whose rates are known: sides, and events that are due there. Errors:
 * NOT_FINITE. */
int refdyn_state_events_start(struct refdyn_state_events *events, const struct refdyn_step *step);
/* The begin of a step: values at it, and events that are due since values have jumped. Errors: NOT_FINITE. */
int refdyn_state_events_begin(struct refdyn_state_events *events, const struct refdyn_step *step);
/* The values of a state; the second function writes values and derivatives into `values` and `terms`, the
 * third derivatives alone. Errors: NOT_FINITE, those of refdyn_rates where contacts rest. */
int refdyn_state_events_values(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                               const double *state, double *values);
void refdyn_state_events_evaluate(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t, const double *state);
void refdyn_state_events_evaluate_terms(struct refdyn_state_events *events, const struct refdyn_step *step,
                                        double t, const double *state);
/* The rate of value i from the terms of a state, and the rounding of value and rate. */
struct refdyn_assessed {
    double noise, rate, rate_noise;
};
struct refdyn_assessed refdyn_state_events_assess(const struct refdyn_state_events *events,
                                                  const struct refdyn_step *step, int i, double t,
                                                  const double *state, const double *rates);
/* Nothing is due; value i is, too. */
void refdyn_state_events_clear_due(struct refdyn_state_events *events);
void refdyn_state_events_add_due(struct refdyn_state_events *events, int i);
/* Nothing is due, and values have not jumped. */
void refdyn_state_events_forget(struct refdyn_state_events *events);
/* Values may have jumped: the next step begins with another look at them. */
void refdyn_state_events_look_again(struct refdyn_state_events *events);
/* How many of the due events the caller is to know of: each once, those that end the motion at each call. */
int refdyn_state_events_report(struct refdyn_state_events *events, int ends);
/* Notes that the due events have happened at t, the begin of the step or its end. `values` and `terms` must
 * be those of that state, and `risen` up to date. */
void refdyn_state_events_note_due(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t);
int refdyn_state_events_is_due(const struct refdyn_state_events *events, int i);
/* Is a crossing to that side of zero an event of value i? */
int refdyn_state_events_watches(const struct refdyn_step *step, int i, int side);
/* Have so many events followed each other without time between that they will not end? */
int refdyn_state_events_accumulate(const struct refdyn_state_events *events);
/* What is due is about to happen at the begin of the step: notes the values before, and their rates. */
void refdyn_state_events_note(struct refdyn_state_events *events, const struct refdyn_step *step);
/* It has happened: on which side values are now, and what is due since others have jumped. */
void refdyn_state_events_settle(struct refdyn_state_events *events, const struct refdyn_step *step);
/* By so much rounding of states may move an event [s]. */
double refdyn_state_events_blur(double t);

static inline int refdyn_state_events_is_kink(const struct refdyn_state_events *events, int i) {
    return i >= events->named;
}
/* (n) Derivatives by qd of value i, in the terms. */
static inline const double *refdyn_state_events_by_qd(const struct refdyn_state_events *events, int n,
                                                      int i) {
    return events->terms + events->count * (1 + n) + i * n;
}
/* Does the caller have to know of events before the motion continues? */
static inline int refdyn_state_events_wait(const struct refdyn_state_events *events) {
    return events->due_named > 0 && !events->is_told;
}
static inline int refdyn_sign_of(double x) {
    return (x > 0) - (x < 0);
}

/* Entry in the list of obstacles. The first function locates zeros in a step that was taken. Errors:
 * NOT_FINITE; those of interpolation. */
int refdyn_state_events_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
double refdyn_state_events_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);
/* Before a step: what is due happens at its begin, impacts among it, and the motion continues from there.
 * Then other events may be due, which the caller has to know first. Errors: EVENTS_ACCUMULATE; EVENT_NOT_MET;
 * SLIDES; those of refdyn_accelerate and, where rows are met by projection, of refdyn_project. */
int refdyn_event_actions_take(struct refdyn_motion *motion);

/* Three places where a value is positive, and the values: may it be below zero between them? */
struct dip {
    double x[3], v[3];
};

enum { DIPS_MOST = 4 }; /* places that are tried in one dip */

/* Place and value of the minimum of the parabola through them; 0: no new place between them. */
static inline int dip_bottom(const struct dip *dip, double *x, double *v) {
    const double left = (dip->v[1] - dip->v[0]) / (dip->x[1] - dip->x[0]);
    const double right = (dip->v[2] - dip->v[1]) / (dip->x[2] - dip->x[1]);
    const double curvature = (right - left) / (dip->x[2] - dip->x[0]);
    const double middle = (dip->x[0] + dip->x[1]) / 2;
    if (!(curvature > 0))
        return 0;
    *x = middle - left / (2 * curvature);
    *v = dip->v[0] + (*x - dip->x[0]) * (left + curvature * (*x - dip->x[1]));
    return *x > dip->x[0] && *x < dip->x[2] && *x != dip->x[1];
}

/* Adds the place x, between the outer two: the three that enclose the smallest value remain. */
static inline void dip_narrow(struct dip *dip, double x, double v) {
    const int is_left = x < dip->x[1], is_lower = v < dip->v[1];
    const int kept = is_lower ? (is_left ? 2 : 0) : (is_left ? 0 : 2);
    dip->x[kept] = is_lower ? dip->x[1] : x;
    dip->v[kept] = is_lower ? dip->v[1] : v;
    if (is_lower) {
        dip->x[1] = x;
        dip->v[1] = v;
    }
}

/* ---- Kinks ---- */

/* The value of kink i up to which it counts as zero: a kink is passed beyond it. */
double refdyn_kinks_width(const struct refdyn_state_events *events, int i);
/* May rows turn at value i? They may at kinks of positions. The terms are those of any state. */
int refdyn_kinks_may_turn_rows(const struct refdyn_state_events *events, const struct refdyn_step *step,
                               int i);
/* After a step: moves its end back before kinks of positions that it passes by rounding only, so that rows
 * which turn there are still those of its begin. */
void refdyn_kinks_end_before(struct refdyn_state_events *events, struct refdyn_step *step);
/* Moves a state at t inside the step in the same way. */
void refdyn_kinks_see_before(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state);
/* Forces and rows that jump at a due kink must see the side to which the motion has crossed. Moves a state at
 * the begin of the step to that side of the kinks, or with side = -1 to the other side, by an amount of
 * rounding. Has it moved? */
int refdyn_kinks_leave(struct refdyn_state_events *events, const struct refdyn_step *step, int side,
                       double *state);
/* When rows have turned at the kinks that are due, and rates with them: do the rates lead back to the kink,
 * or is the motion at rest there? Otherwise they lead on to the side to which the motion has crossed. */
int refdyn_kinks_lead_back(struct refdyn_state_events *events, const struct refdyn_step *step);
/* Before a step: SLIDES if many short steps in a row have stayed at a jump of forces that leads back to
 * itself.
 */
int refdyn_kinks_check_sliding(struct refdyn_motion *motion);

/* ---- Energy ---- */

/* Kinetic and potential energy at the begin of the step [J]; 0 where no balance is asked for. */
double refdyn_energy_at_begin(const struct refdyn_motion *motion);
/* The state at the begin of the step has jumped from one of this energy: the difference counts as work. */
void refdyn_energy_has_jumped(struct refdyn_motion *motion, double before);
/* Work done at theta of the step that was taken, by quadrature. Errors: those of refdyn_rates. */
int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done);

/* ---- The motion ---- */

struct refdyn_motion {
    struct refdyn_workspace *work;
    struct refdyn_options options;
    struct refdyn_parameters parameters;
    struct refdyn_linear linear;
    struct refdyn_step step;
    struct refdyn_step_control control;
    struct refdyn_time_events time_events;
    struct refdyn_state_events state_events;
    struct refdyn_programme programme;
    struct refdyn_automatic automatic;
    struct refdyn_singular_crossing crossing;
    struct refdyn_fading fading;
    struct refdyn_residuals_before before;
    struct refdyn_statistics statistics;
    struct refdyn_failure failure;
    enum refdyn_method ordinary; /* method of ordinary steps, while a special step is on */
    int rows_change;             /* at the time event where the last step ended */
    double t_final;              /* end of the motion, see refdyn_integrator_until [s] */
    double t_most;               /* no step reaches beyond, see refdyn_integrator_limit [s] */
    long evaluations_before;     /* of the workspace, at the start */
};

/* No ordinary step is longer: half of the way to an obstacle whose special step has failed [s]. */
static inline double refdyn_ahead_longest(const struct refdyn_motion *motion,
                                          const struct refdyn_ahead *ahead) {
    return (ahead->remaining - motion->step.t_begin) / 2;
}

#endif
