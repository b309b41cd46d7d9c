/*
 * Motions: what the files of this folder offer each other, the bindings and batches. Callers use refdyn.h.
 *
 * Parts in reading order: obstacles ahead, one accepted step, its length, the automatic method,
 * errors of rates; the programme, the parameters; time events, rows that jump or fade out, singular states;
 * contacts, state events, kinks; energy; steps that copies repeat; the motion, the struct of all these parts.
 */
#ifndef REFDYN_MOTION_H
#define REFDYN_MOTION_H

#include "runtime/core/methods/methods.h"

#include <math.h>

struct refdyn_motion;

/* ---- Obstacles ahead: what an ordinary step may not pass (obstacles.c) ---- */

/* What a step looks for, and the nearest obstacle that it has found. */
struct refdyn_ahead {
    double t_out;      /* the time that the caller asks for [s] */
    double h, least;   /* length of an ordinary step, 0: not known yet; of the shortest one [s] */
    double bound;      /* end of the motion, or limit of the caller; INFINITY: none [s] */
    double time_event; /* the next one; INFINITY: none as far as the step reaches [s] */
    double stop;       /* an ordinary step ends there or earlier [s] */
    double remaining;  /* obstacle whose special step has failed; INFINITY: none [s] */
    int rank;          /* independent rows before the end of the step was completed */
    /* refdyn_obstacles_seen, for special steps */
    int (*seen)(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
};

/* These begin a motion; do what happens where the last step ended (errors: those of refdyn_rows_take_new and
 * refdyn_event_actions_take); and find the nearest obstacle on which an ordinary step may end. */
void refdyn_obstacles_start(struct refdyn_motion *motion);
int refdyn_obstacles_leave(struct refdyn_motion *motion);
void refdyn_obstacles_find(struct refdyn_motion *motion, double t_out, struct refdyn_ahead *ahead);
/* Takes a special step if an obstacle within reach of ordinary steps of h needs one. Returns 1 if that was
 * done; then state_new at t_end is the new state. Otherwise ahead->stop leaves space for the special step. */
int refdyn_obstacles_step(struct refdyn_motion *motion, double h, struct refdyn_ahead *ahead);
/* Examines a step whose error is small and whose end is complete. *t: a shorter step has to end there,
 * because an obstacle is in the step; t_begin: no step may be taken; INFINITY: the step is accepted. An error
 * refuses it. */
int refdyn_obstacles_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* After a step was refused, with this status or, if that is 0, for its error. Returns the time of the
 * obstacle that may have caused this, where a shorter step should end; INFINITY: none. */
double refdyn_obstacles_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);
/* The nearer of the end of the motion and the caller's limit that is still ahead; INFINITY: neither is. */
double refdyn_motion_bound(const struct refdyn_motion *motion);
/* Times closer to t than this are the same time for the motion; it depends on the larger of t and t_final. */
double refdyn_motion_resolution(const struct refdyn_motion *motion, double t);

/* ---- One accepted step (accepted_step.c) ---- */

/* A step in progress. */
struct refdyn_attempt {
    struct refdyn_ahead ahead;
    double h, t_new;      /* length and end of the step to take [s] */
    double size;          /* its error, in tolerances, if is_measured */
    int is_measured;      /* after refdyn_attempt_measured */
    int is_left, is_over; /* the batch could not take the step; no step is being tried */
};

/*
 * One step towards t_out, from state_new at t_end to the same, later. Fixed steps never pass t_out, except
 * for one through a state where the rows lose rank. *attempt is over before the first call and after each
 * step. may_halt: returns HALTED before an attempt that a batch may take; the batch calls `measured` with its
 * error, as refdyn_step_largest_error, and `judge` with the status of taking it. Errors: as
 * refdyn_integrator_step.
 */
int refdyn_accept_step(struct refdyn_motion *motion, double t_out, int may_halt,
                       struct refdyn_attempt *attempt);
/* Returns the time over which the error of a velocity counts: h, or the longest step so far. */
double refdyn_attempt_span(const struct refdyn_motion *motion, double h);
void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error);
void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken);
/* After an accepted step: calls the watch; a copy compares the step with its pattern. */
void refdyn_step_over(struct refdyn_motion *motion, const struct refdyn_attempt *attempt);
/* A time of the motion, and how many steps were tried until then. `struct refdyn_pace` is written only by
 * accepted_step.c. */
struct refdyn_pace {
    double t; /* [s] */
    long tried;
};
/* Returns whether options.step_limit steps have been tried, or would be before the end. */
int refdyn_step_limit_reached(struct refdyn_motion *motion);

/* Calls refdyn_integrator_refresh if the caller has changed inputs or parameters since they were taken. */
int refdyn_integrator_notice(struct refdyn_integrator *integrator);

/* Motions whose steps a batch takes side by side: statuses in addition to those of refdyn.h. LEFT_TO_MOTION:
 * the motion takes the step itself, because the others cannot share it or its numbers are not finite. */
enum { REFDYN_HALTED = 1000, REFDYN_LEFT_TO_MOTION };

/* Advances towards t_out until the batch may take a step, which *attempt describes, and returns HALTED.
 * Otherwise t_out is reached, the motion has taken this number of steps itself or has failed, as with
 * refdyn_integrator_step. *attempt is over before the first call. */
int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out, long steps,
                           struct refdyn_attempt *attempt);
/* Call it after taking the step at which the motion halted, with OK, LEFT_TO_MOTION or an error of the
 * method. */
void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt, int taken);

/* ---- The parts of steps (attempt.c) ---- */

/* The last failure of an evaluation or projection. `struct refdyn_failure` is written only by attempt.c. */
struct refdyn_failure {
    int cause; /* 0: none */
    double t;  /* [s] */
};
void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t);

/* The first takes the method's attempt from t_begin to t_new, with the gains of a step of h; the second also
 * records a failure. The third completes its end on the programme, with partition, rates and work; the fourth
 * records it as accepted. */
int refdyn_motion_take(struct refdyn_motion *motion, double t_new, double h);
int refdyn_motion_try(struct refdyn_motion *motion, double t_new, double h);
int refdyn_motion_complete(struct refdyn_motion *motion);
int refdyn_motion_accept(struct refdyn_motion *motion, double h);
/* Between these two calls, steps use this method, and the guide brings their stages onto the programme. */
void refdyn_special_step_begin(struct refdyn_motion *motion, enum refdyn_method method,
                               const struct refdyn_stage_guide *guide);
void refdyn_special_step_end(struct refdyn_motion *motion);

/* `struct refdyn_statistics` is written only by attempt.c. Residuals: of the row terms in the workspace. */
void refdyn_statistics_start(struct refdyn_statistics *statistics);
void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work);
/* Adds an accepted step of h, with the row terms of its end in the workspace; that it was of this method. */
void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h);
void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method);
void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count);
void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing);
/* Copies the counters of other parts. */
void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations);

/* ---- The length of steps (step_control.c) ---- */

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

/* Begins adaptive steps, or those of another method, with h; 0: refdyn_control_find chooses it. */
void refdyn_control_begin(struct refdyn_step_control *control, double h);
/* Chooses the first step towards t_stop if none is proposed. It does not depend on the outputs. If nothing
 * moves, it is `interval`. */
void refdyn_control_find(struct refdyn_step_control *control, const struct refdyn_step *step, double t_stop,
                         double interval);
/* Drops a proposed step that is shorter than `least`, as after a very short step to a requested time; the
 * next one is chosen as at a start. The second function shortens a longer one to h. */
void refdyn_control_drop(struct refdyn_step_control *control, double least);
void refdyn_control_bound(struct refdyn_step_control *control, double h);
/* The step to try: the proposed one, shortened to end on t_stop or to leave more than half of itself. */
double refdyn_control_clip(const struct refdyn_step_control *control, double t_begin, double t_stop);
/* Both propose the next step after one of h with this error in tolerances: after an accepted step; after a
 * refused one, whose error is INFINITY if the step could not be evaluated. */
void refdyn_control_accepted(struct refdyn_step_control *control,
                             const struct refdyn_method_definition *method, double h, double error);
void refdyn_control_refused(struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error);
/* After a failed step of h: limits the next ones to a part of it. */
void refdyn_control_failed(struct refdyn_step_control *control, double h);

/* Fixed steps of at most h from t_begin to t_out, unless that interval is under way. Error: STEP_TOO_SMALL.
 */
int refdyn_control_plan(struct refdyn_step_control *control, double h, double t_begin, double t_out);
/* The first returns the length of these steps, and the end of the next one. Call the second after taking that
 * step, the third if the next one begins elsewhere. */
double refdyn_control_fixed(const struct refdyn_step_control *control, double *t_new);
void refdyn_control_fixed_done(struct refdyn_step_control *control);
void refdyn_control_leave_interval(struct refdyn_step_control *control);

/* ---- The automatic method (automatic_method.c) ---- */

/* `struct refdyn_automatic` is written only by automatic_method.c. */
struct refdyn_automatic {
    struct refdyn_choice found;
    int chosen, at;            /* winner of the last trial; candidate on trial; -1: none */
    enum refdyn_method next;   /* method of the next step */
    long steps_left, patience; /* until the trial of this candidate ends, or the next one begins */
    int wants_spectrum;
    double way;       /* sum of the steps since the last mark, as long as positions alone would allow [s] */
    double held_back; /* length that positions alone would allow the last step, over its length */
    double marked_operations;
};

/* Begins the first trial, at the start of a motion. */
void refdyn_automatic_start(struct refdyn_motion *motion);
/* After an accepted step: counts it, judges trials, and sets `next`, the method of the next step. */
void refdyn_automatic_after_step(struct refdyn_motion *motion);
/* The tolerance with which the errors of the method in use are as large as those of the others. */
double refdyn_automatic_tolerance(const struct refdyn_motion *motion);
/* After a step that could not be evaluated. Returns 1 if the automatic choice has changed to the explicit
 * method. It does so if the tangent at the beginning of the step is not finite, because no smaller step
 * changes that. */
int refdyn_automatic_after_failure(struct refdyn_motion *motion);
/* Measures the errors of rates, accelerations and forces of a completed step of h, whose error of positions
 * is `error`, if it is an explicit step near its stability limit. Returns their size in tolerances of such
 * steps, so that they excite no vibrations; 0 in other steps. */
double refdyn_automatic_error_of_rates(struct refdyn_motion *motion, double h, double error);
/* Ends the automatic choice until the next start; the second function changes the method at the beginning of
 * the step. */
void refdyn_automatic_leave(struct refdyn_motion *motion);
void refdyn_automatic_change(struct refdyn_motion *motion, enum refdyn_method method);
/* Changes to the method that `next` names. */
void refdyn_automatic_take_up(struct refdyn_motion *motion);

/* ---- Errors of rates, accelerations and forces (rate_errors.c) ---- */

enum { REFDYN_RATE_KINDS = 3 };

/* `struct refdyn_rate_errors` is written only by rate_errors.c. */
struct refdyn_rate_errors {
    /* rate, acceleration, force of the programme since the start, by unit */
    double largest[REFDYN_RATE_KINDS];
};

/* Begins with the values of the start, whose row terms are in the workspace; the second function adds those
 * of an accepted step. */
void refdyn_rate_errors_start(struct refdyn_motion *motion);
void refdyn_rate_errors_note(struct refdyn_motion *motion);
/* Returns the largest error of a completed step of h relative to the largest value of its kind, divided by
 * the tolerance; INFINITY if it cannot be evaluated. Usually costs one evaluation. */
double refdyn_rate_errors_measure(struct refdyn_motion *motion, double h, double tolerance);

/* ---- The programme: projections along directions that suit the method (programme.c) ---- */

/* The matrix of which there are directions. `struct refdyn_programme` is written only by programme.c. */
struct refdyn_programme {
    double *q;     /* (n) the mass matrix at this position, */
    int choice;    /* with partition.choices of then; -1: not of M */
    long factored; /* a step's matrix, linear->factored of then; -1: not of one */
    long aligned;  /* how often directions in the metric of M were computed */
    int is_held;   /* the present directions suit all states */
};

void refdyn_programme_lay_out(struct refdyn_programme *programme, const struct refdyn_model *model,
                              struct layout *layout);
/* Marks the directions as out of date. */
void refdyn_programme_forget(struct refdyn_programme *programme);
/* Keeps directions in the metric of M until they are forgotten, however far the motion goes; 0: no longer.
 */
void refdyn_programme_hold(struct refdyn_programme *programme, int is_held);
/* Moves a state (2 n) at t onto the programme. The workspace must have the row terms of the state; afterwards
 * it has those of the new one. Errors: those of refdyn_project. */
int refdyn_programme_meet(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                          double *state);
/* Its part for methods that do not project by their matrix: computes directions for the state, unless the
 * present ones suit it. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_programme_align(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                           const double *state);
/* Where a batch that has factored a step's matrix writes its directions (m x n, of all rows in order). */
double *refdyn_programme_take_directions(struct refdyn_programme *programme, struct refdyn_linear *linear);
/* Returns whether a projection changes velocities, relative to the largest, by more than any error of a step.
 * The change must also exceed what positions may change in a time h. Both states (2 n). */
int refdyn_programme_moves_velocities(const struct refdyn_step *step, const double *before,
                                      const double *after, double h);
/* The largest change of a position by a projection that does not refuse the step. */
double refdyn_programme_moved_most(const struct refdyn_step *step);

/* ---- Parameters: the caller's, with the gains of the step (motion_options.c) ---- */

/* While an integrator works, the workspace evaluates with `own`. Only events write the caller's parameters.
 * `struct refdyn_parameters` is written only by motion_options.c. */
struct refdyn_parameters {
    double *own, *callers; /* as work->p; work->p while `own` are in use */
    double *taken;         /* the caller's parameters, then the inputs, when they were taken */
};

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout);
/* From here to _leave the workspace evaluates with the motion's parameters. */
void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
/* Between the two calls: the first sets the caller's parameter at a place of p and copies the caller's
 * values; the second only copies them, and notes the inputs. */
void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value);
void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_workspace *work);
/* Returns the inputs (input_count) that were taken. */
double *refdyn_parameters_inputs(const struct refdyn_parameters *parameters,
                                 const struct refdyn_model *model);
/* Returns whether the caller has changed a parameter or an input since then. Call it outside the two calls.
 */
int refdyn_parameters_have_changed(const struct refdyn_parameters *parameters,
                                   const struct refdyn_workspace *work);
/* Sets the gains that the options request for a step of h; INFINITY: no gains. */
void refdyn_parameters_set_gains(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                                 const struct refdyn_options *options, double h);

/* ---- Time events: kinks and jumps of formulas of time alone (time_events.c) ---- */

/* `struct refdyn_time_events` is written only by time_events.c. */
struct refdyn_time_events {
    int count, next;  /* of known ones; the first of them that lies ahead */
    double *times;    /* (count) ascending [s] */
    double *switches; /* (4 switch_count) values whose sign changes at the other events, at times in a step */
    double switched;  /* the last of the other events that was found [s] */
};

void refdyn_time_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                                struct layout *layout);
/* Computes the known events for the present parameters and inputs; no known event counts as passed. At a
 * switch, the motion stays on the right side of it. t, q and qd: any. */
void refdyn_time_events_take(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd);
/* t, or the right side of a time event that is there: where functions have the values with which the motion
 * continues. */
double refdyn_time_events_right_of(const struct refdyn_time_events *events, double t);
/* The time near t of an event that is not a known one; INFINITY: there is none. */
double refdyn_time_events_near(struct refdyn_motion *motion, double t);
/* Entry in the list of obstacles: the next time event after the beginning of the step. The step evaluates
 * nothing after it, and does not extrapolate across a time event at its beginning. */
void refdyn_time_events_start(struct refdyn_motion *motion);
double refdyn_time_events_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);

/* Three places where a value is positive, and the values. Between them it may be below zero. */
struct refdyn_dip {
    double x[3], v[3];
};
enum { REFDYN_DIPS_MOST = 4 }; /* places that are tried in one dip */
/* Place and value of the minimum of the parabola through them; 0: no new place between them. */
int refdyn_dip_bottom(const struct refdyn_dip *dip, double *x, double *v);
/* Adds the place x, between the outer two: the three that enclose the smallest value remain. */
void refdyn_dip_narrow(struct refdyn_dip *dip, double x, double v);

/* ---- Rows that jump (row_changes.c) ---- */

/* Residuals before a jump. `struct refdyn_residuals_before` is written only by row_changes.c. */
struct refdyn_residuals_before {
    double *phi, *psi, *state; /* (m) each, of this state (2 n) */
    int are_seen;              /* the caller has seen this state last */
};

void refdyn_rows_lay_out(struct refdyn_residuals_before *before, const struct refdyn_model *model,
                         struct layout *layout);
/* After a step: the first examines whether the rows change at the time event at its end, and the second sets
 * the answer. Row terms in the workspace and scratch of projections are lost. `rows_change` is written only
 * by row_changes.c. */
void refdyn_rows_look_at_end(struct refdyn_motion *motion);
void refdyn_rows_change_at_end(struct refdyn_motion *motion, int change);
/* Returns whether coefficients of rows jump at the time event that limits the step, at the state from which
 * the step begins. Afterwards the workspace has the row terms after the event. */
int refdyn_rows_jump_at(struct refdyn_motion *motion, double t);
/* Entry in the list of obstacles, at time events: if rows have changed where the last step ended, computes
 * the state and rates from which the next step begins. Errors: those of refdyn_project and refdyn_rates;
 * ROWS_UNMET. */
int refdyn_rows_take_new(struct refdyn_motion *motion);

/* Record the residuals of this state, from the row terms in the workspace: the first of a state before a
 * jump, the second of a state that the caller sees. The third, at the start of a motion: no state was seen.
 */
void refdyn_rows_note(struct refdyn_motion *motion, const double *state);
void refdyn_rows_note_seen(struct refdyn_motion *motion, const double *state);
void refdyn_rows_forget_seen(struct refdyn_motion *motion);
/* *have: whether rows have jumped since the state at the beginning of the step was recorded. Error:
 * NOT_FINITE. */
int refdyn_rows_have_jumped(struct refdyn_motion *motion, int *have);
/* After rows have jumped: makes the rates at the beginning of the step jump with them, and counts the change
 * of energy as work. Errors: those of refdyn_project and refdyn_impulse_of_rows; ROWS_UNMET. */
int refdyn_rows_meet(struct refdyn_motion *motion);
/* If the step begins at the state that the caller saw last: lets it jump with its rows, unless the caller has
 * set it since. Errors: those of refdyn_rows_meet. */
int refdyn_rows_meet_seen(struct refdyn_motion *motion);

/* ---- Rows that fade out (fading_rows.c) ---- */

/* `struct refdyn_fading` is written only by fading_rows.c. */
struct refdyn_fading {
    double t, looked;   /* time event that was examined last, and from how far [s] */
    int is_known, rank; /* rows fade out towards it; the rank was this before */
    struct refdyn_stage_guide guide;
};

/* Doubles of a step's memory. */
int refdyn_fading_memory_size(const struct refdyn_model *model);
/* Entry in the list of obstacles. */
void refdyn_fading_start(struct refdyn_motion *motion);
double refdyn_fading_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
int refdyn_fading_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* Returns whether the last step ended at an event at which rows fade out. */
int refdyn_fading_is_on(const struct refdyn_motion *motion);
/* After a refused step: restores the partition of its beginning. Returns 0 if the rank is lost there already;
 * then the motion ends. */
int refdyn_fading_refuse(struct refdyn_motion *motion);
/* Returns whether t is so near the event that rows do not determine the accelerations. */
int refdyn_fading_is_near(const struct refdyn_motion *motion, double t);

/* ---- Singular states: options.singular = REFDYN_PASS (singular_crossing.c) ---- */

/* `struct refdyn_singular_crossing` is written only by singular_crossing.c. */
struct refdyn_singular_crossing {
    double *unpassed;  /* state and rates before the special step, in case it is refused */
    double t, gap;     /* when the rows lose rank [s]; time from there to the nearest stage, in steps */
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
/* Returns whether t is so near a passed state that rows do not determine the accelerations. */
int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t);

/* ---- Contacts: their modes (state_events.c), and transitions by impacts (contact_transitions.c) ---- */

struct refdyn_contacts {
    int count, first_row; /* contacts; their rows are the last ones of the model */
    int resting;          /* how many rest */
    int *event, *mode;    /* (count) event of the model; enum refdyn_contact_mode */
    double *since;     /* (count) when it last came to rest, extrapolated to the last of its rebounds [s] */
    double *left;      /* (count) when it last opened [s]; NaN: never, in both */
    double *reach;     /* (count) error that a gap may have: the tolerance, or rounding */
    double *allowance; /* (count) added to the gap of a contact that touches, or has just opened, */
    double *allowed_until; /* (count) until then [s] */
    int are_unique;        /* the motion determines the forces: no contact depends on others that rest */
    double tolerance;      /* of positions [rad, or options.length] */
    double longest;        /* step so far; 0: none [s] */
    double *inside; /* (count) how far a gap may be below zero, where an importer has passed its closing */
    double late;    /* how far after a closing an importer may have stopped; 0: motions locate it [s] */

    double *rates, *state;                /* (2 n + 1 + m) of a state; (2 n + 1) */
    double *force_rates;                  /* (count) change of the forces with time, */
    double force_noise, force_rate_noise; /* and rounding of the forces and of these */
    double force_size;                    /* largest |force| at the beginning of a step so far */

    /* of a transition, by contact: gap, its two time derivatives (the second where all contacts are free),
     * the largest gap over coordinates, rounding of these, coefficients */
    int *is_closed, *is_at_rest;
    double *rest; /* when it comes to rest in this transition [s]; NaN: it does not */
    double *gap, *rate, *bias, *scale, *rounding, *rate_rounding, *bias_rounding, *restitution;
    double *qdd;                     /* (n) accelerations where all contacts are free */
    struct refdyn_one_sided problem; /* of impacts, and of accelerations */
};

/* A motion begins: all contacts are free, and the parameters of the workspace are set accordingly. */
void refdyn_contacts_clear(struct refdyn_contacts *contacts, struct refdyn_workspace *work, double tolerance);
/* Where forces are not unique: replaces them by the smallest forces with the same effect, unless some of
 * these would pull. `terms`: result of event_terms at the state. forces (count): in and out. */
void refdyn_contacts_spread(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                            const double *terms, double *forces);
/* A typical length of steps: the longest so far, or a guess before the first one [s]. */
double refdyn_contacts_pace(const struct refdyn_contacts *contacts);
void refdyn_contacts_lay_out(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                             struct layout *layout);
/* Replaces the gaps of contacts that are not free by their values. Errors: those of refdyn_rates. */
int refdyn_contacts_values(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                           const double *state, double *values);
/* The first function notes the size of the forces, from the multipliers (m) at the beginning of a step. The
 * second one returns whether contact k rests and pulls by more than rounding or, if is_seen (an output), by
 * more than the error of interpolation. */
void refdyn_contacts_note_forces(struct refdyn_contacts *contacts, const double *multipliers);
int refdyn_contacts_pulls(const struct refdyn_contacts *contacts, const double *multipliers, int k,
                          int is_seen);
/* Ends the allowance of contacts that have clearly opened at t; `values`: of the state, as above. */
void refdyn_contacts_end_allowances(struct refdyn_contacts *contacts, double t, double *values);
/* The time derivatives of the forces of a state, and their rounding. Errors: those of refdyn_rates. */
int refdyn_contacts_force_rates(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                                const double *state);
/* The contact of event i; -1: the event is no contact. */
int refdyn_contact_of(const struct refdyn_contacts *contacts, int event);

/*
 * The step's beginning is the start of a motion, and all contacts are free. Contacts that are closed there
 * without a rate rest or touch from the start; *is_changed: there are any. Other closed contacts are due.
 * Errors: CONTACT_INSIDE, and those of refdyn_contact_transitions_take.
 */
int refdyn_contact_transitions_start(struct refdyn_motion *motion, int *is_changed);
/*
 * Contacts that are due close or let go at the step's beginning. Changes their modes and the rates there;
 * *has_rates: rates have changed. Errors: those of refdyn_accelerate; CONTACT_DRIVEN, CONTACTS_UNMET,
 * CONTACT_INSIDE and EVENTS_ACCUMULATE, where work->fault.row is the row of a contact.
 */
int refdyn_contact_transitions_take(struct refdyn_motion *motion, int *has_rates);
/* Switches off the rows of contacts until the next transition, which must follow; their modes stay. */
void refdyn_contact_transitions_release(struct refdyn_motion *motion);

/* ---- State events (state_events.c), their zeros (event_zeros.c) and actions (event_actions.c) ---- */

enum { REFDYN_EVENT_SAMPLES = 8 }; /* of a step or of a piece of it, after its beginning */

struct refdyn_state_events {
    int count, named; /* values: events of the model, then kinks; of them, events */
    int *side;        /* (count) of zero where each value is: -1, 1; 0: on zero, and the rate is unclear */
    int *side_begin;  /* (count) the same at the beginning of the last step, */
    int *side_from, *side_end; /* and at the beginning and end of the piece that is examined */
    int *towards;              /* (count) the side to which the last crossing that was found leads */
    int *due;                  /* (due_count) those that happen at the end of the last step, ascending */
    int due_count, due_named;  /* of those due, events */
    int *passed;               /* (passed_count) kinks just after the beginning of the step, ascending */
    int passed_count;
    int *is_met;   /* (count) the kink was due at the beginning of the step */
    int *returns;  /* (count) steps that have stayed at a kink whose jump leads back */
    double *begin; /* (count) values at the beginning of the step */
    /* The piece of the step that is examined: samples `first` to `last` are new. Where they are, the values
     * there ((REFDYN_EVENT_SAMPLES + 1) x count), and the distance to the next one. */
    int first, last;
    double thetas[REFDYN_EVENT_SAMPLES + 1], *samples, apart;
    int looks;       /* places of a step in units of REFDYN_EVENT_SAMPLES, unless a frequency needs more */
    double *offsets; /* (count) what is subtracted from values: `zeros`, until a value has left zero */
    double *most;    /* (count) largest |value| in the step so far */
    double *sizes;   /* (count) largest |value| since the start: below a part of it, that of a kink is zero */
    double *zeros;   /* (count) counts as zero in the step: a value at its beginning that is just beyond */
    double *turned;  /* (count) largest rate of a kink at which rows have turned */
    double *values;  /* (count) of the state that is examined */
    double *rates;   /* (count) of the values before the due events happen */
    double *terms;   /* result of event_terms */
    double *room;    /* (2 n + 1) a state in the step; (n) jump of rates */
    /* (count) largest |value| of an event since it last happened, or of a kink since a step last began there;
     * INFINITY: never. (count) time at which a step last began at the kink [s] */
    double *risen, *visited;
    struct refdyn_contacts contacts; /* their values depend on their modes */

    /* the zero that is being located, and steps that did not end on it */
    int target, tries;
    int held;              /* kink before which the end of the step was moved back; -1: none */
    int early_tries;       /* steps to zeros that were seen in steps which were too long */
    double t_high, missed; /* the value has crossed zero before this; last distance from zero [s] */

    double t_last; /* of the last event [s], */
    int repeats;   /* and how many followed each other without time between, or with values within rounding */

    /* written only by state_events.c: the caller knows of the due events; values may have jumped from the
     * first samples */
    int is_told, looks_again;
};

void refdyn_state_events_lay_out(struct refdyn_state_events *events, const struct refdyn_model *model,
                                 struct layout *layout);
/* Call it where a motion starts at t, with known rates: sets the sides, and the events that are due there.
 * The step may begin on the right of a time event at t. Error: NOT_FINITE. */
int refdyn_state_events_start(struct refdyn_state_events *events, const struct refdyn_step *step, double t);
/* Call it at the beginning of a step: computes the values, and the events that are due because values have
 * jumped. Error: NOT_FINITE. */
int refdyn_state_events_begin(struct refdyn_state_events *events, const struct refdyn_step *step);
/* The values of a state; the second function writes values and derivatives into `values` and `terms`, the
 * third derivatives alone. Errors: NOT_FINITE, those of refdyn_rates where contacts rest. */
int refdyn_state_events_values(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                               const double *state, double *values);
void refdyn_state_events_evaluate(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t, const double *state);
void refdyn_state_events_evaluate_terms(struct refdyn_state_events *events, const struct refdyn_step *step,
                                        double t, const double *state);
/* The rate of value i from the terms of a state, and the rounding of value and rate; noise_at_time: without
 * the part by which rounding of the time moves the value. */
struct refdyn_assessed {
    double noise, noise_at_time, rate, rate_noise;
};
struct refdyn_assessed refdyn_state_events_assess(const struct refdyn_state_events *events,
                                                  const struct refdyn_step *step, int i, double t,
                                                  const double *state, const double *rates);
/* The first empties the list of what is due; the second adds value i; the third empties the list and forgets
 * that values may have jumped. */
void refdyn_state_events_clear_due(struct refdyn_state_events *events);
void refdyn_state_events_add_due(struct refdyn_state_events *events, int i);
void refdyn_state_events_forget(struct refdyn_state_events *events);
/* Call it at a state at t before inputs, parameters, the state or formulas of time change there, because
 * values may then jump: the next step begins by examining them again. */
void refdyn_state_events_look_again(struct refdyn_state_events *events, const struct refdyn_step *step,
                                    double t, const double *state);
/* Call them where the caller continues from a state at t, inside the last step or at its end: the first one
 * before, the second one after its changes. Events that the step has found after t have not happened. An
 * event that is due at t stays due, unless the change moves its value back to where it came from. */
void refdyn_state_events_stop(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                              const double *state);
void refdyn_state_events_go_on(struct refdyn_state_events *events, const struct refdyn_step *step);
/* The number of due events to report to the caller: each once, those that end the motion at each call. */
int refdyn_state_events_report(struct refdyn_state_events *events, int ends);
int refdyn_state_events_is_due(const struct refdyn_state_events *events, int i);
/* Returns whether a crossing to that side of zero is an event of value i. */
int refdyn_state_events_watches(const struct refdyn_step *step, int i, int side);
/* Returns whether so many events have followed each other at one time that they will not end. */
int refdyn_state_events_accumulate(const struct refdyn_state_events *events);
/* Call it before due events happen at the beginning of the step: records them, the values and their rates. */
void refdyn_state_events_note(struct refdyn_state_events *events, const struct refdyn_step *step);
/* Call it afterwards: sets the sides of the values, and what is due because other values have jumped. */
void refdyn_state_events_settle(struct refdyn_state_events *events, const struct refdyn_step *step);
/* The time by which rounding of states may move an event [s]. */
double refdyn_state_events_blur(double t);

static inline int refdyn_state_events_is_kink(const struct refdyn_state_events *events, int i) {
    return i >= events->named;
}
/* (n) Derivatives by qd of value i, in the terms. */
static inline const double *refdyn_state_events_by_qd(const struct refdyn_state_events *events, int n,
                                                      int i) {
    return events->terms + events->count * (1 + n) + i * n;
}
static inline int refdyn_sign_of(double x) {
    return (x > 0) - (x < 0);
}

/* Entry in the list of obstacles. The first function locates zeros in a step that was taken. Errors:
 * NOT_FINITE; those of interpolation. */
int refdyn_state_events_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
double refdyn_state_events_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);
/* Places in the result of event_terms: its length, and the first of the values that events set. */
int refdyn_event_terms_count(const struct refdyn_model *model);
int refdyn_event_terms_changes(const struct refdyn_model *model);

/* Before a step: takes the actions of due events at its beginning, including impacts. Then other events may
 * be due, which are reported to the caller first. Errors: EVENTS_ACCUMULATE; EVENT_NOT_MET; SLIDES, where
 * rows turn, or from refdyn_sliding_check; those of refdyn_accelerate and, where rows are met by projection,
 * of refdyn_project. */
int refdyn_event_actions_take(struct refdyn_motion *motion);
/* Opens the contacts that rest and would pull at the beginning of the step. Errors: those of
 * refdyn_contact_transitions_take and refdyn_rates. */
int refdyn_event_actions_open_contacts(struct refdyn_motion *motion);
/* Lets the motion continue from the beginning of the step without what it keeps of earlier steps; is_new: as
 * in refdyn_step_break_off. */
void refdyn_motion_break_off(struct refdyn_motion *motion, int is_new);

/* ---- The right side of an instant at which events set values (after_events.c) ---- */

/* The caller's values, which those after the events replace for a while. `struct refdyn_after` is written
 * only by after_events.c. */
struct refdyn_after {
    double *p, *x, *qdd, *lambda; /* as in the workspace and the integrator; empty without changes */
    double *terms;                /* of events */
    int is_seen;                  /* the caller sees the values after the events */
};

void refdyn_after_lay_out(struct refdyn_after *after, const struct refdyn_model *model,
                          struct layout *layout);
/* A motion begins: the caller sees no values after events. */
void refdyn_after_clear(struct refdyn_after *after);

/* ---- Kinks (kinks.c) ---- */

/* A value of kink i up to this size counts as zero; beyond it, the kink is passed. */
double refdyn_kinks_width(const struct refdyn_state_events *events, int i);
/* Changes a value by `change`: moves positions or rates (n) along its derivatives `by` (n). Returns 0 if
 * these are 0. */
int refdyn_kinks_move_along(const double *by, int n, double change, double *positions);
/* Returns whether rows may turn at value i, as they may at kinks of positions. The terms are those of any
 * state. */
int refdyn_kinks_may_turn_rows(const struct refdyn_state_events *events, const struct refdyn_step *step,
                               int i);
/* `struct refdyn_kink_guard` is written only by kinks.c. */
struct refdyn_kink_guard {
    struct refdyn_side_guard side; /* of steps near kinks */
    int is_watched;                /* the motion is recorded */
    int sees_beyond;               /* its stages were beyond kinks */
};

void refdyn_kinks_lay_out(struct refdyn_kink_guard *guard, const struct refdyn_model *model,
                          struct layout *layout);
void refdyn_kinks_clear(struct refdyn_motion *motion);
/* The stages of the next attempts are held before kinks, or not. */
void refdyn_kinks_guard(struct refdyn_motion *motion, int are_held);
/* The recorded motion, from its start on: watches whether stages are beyond kinks. The second function
 * returns whether they were since the last call. */
void refdyn_kinks_watch(struct refdyn_motion *motion);
int refdyn_kinks_saw_beyond(struct refdyn_motion *motion);
/* After a step that passes kinks of positions by rounding alone: moves its end back before them, so that rows
 * that turn there are still as at its beginning. The second function moves a state at t in the step; with
 * all_kinks also back before kinks at which rows do not turn. */
void refdyn_kinks_end_before(struct refdyn_state_events *events, struct refdyn_step *step);
void refdyn_kinks_see_before(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                             double *state, int all_kinks);
/* Moves a state at the beginning of the step to the side of the due kinks to which their crossings lead, or
 * for side -1 to the other one. Returns whether it has moved. */
int refdyn_kinks_leave(struct refdyn_state_events *events, const struct refdyn_step *step, int side,
                       double *state);
/* Call it after rows have turned at due kinks: returns whether the new rates lead back to one of them. */
int refdyn_kinks_lead_back(struct refdyn_state_events *events, const struct refdyn_step *step);

/* ---- Motions that make no progress (sliding.c) ---- */

/* `struct refdyn_idle` is written only by sliding.c. */
struct refdyn_idle {
    double t;  /* the motion has progressed until then [s] */
    int count; /* steps that have begun since without progress */
};

/* Call it where a motion starts, after refdyn_state_events_start: a start on a jump moves to the side to
 * which the motion leads. Errors: those of refdyn_rates. */
int refdyn_sliding_start(struct refdyn_motion *motion);
/* Call it before the motion passes kinks that are due. */
void refdyn_sliding_note_due(struct refdyn_state_events *events);
/* Call it at the beginning of a step, with the values there. Returns SLIDES if the value of a kink and its
 * rate are zero, or after many steps that have stayed at a kink, if the jump there leads back to itself. */
int refdyn_sliding_check(struct refdyn_motion *motion);
/* Call it after a step has failed with this status. Where it begins at a jump, STEP_TOO_SMALL and
 * NO_CONVERGENCE become SLIDES if the jump leads back to itself, and OK if the motion crosses the jump, which
 * is then due. */
int refdyn_sliding_resolve(struct refdyn_motion *motion, int status, double t_out);
/* The first function begins a motion. Call the second one at the beginning of each step: after many steps
 * that hardly advance the time, it returns SLIDES if formulas have kinks, else STEP_TOO_SMALL. */
void refdyn_idle_start(struct refdyn_motion *motion);
int refdyn_idle_check(struct refdyn_motion *motion, double t_out);

/* ---- Energy (energy.c) ---- */

/* Kinetic and potential energy at the beginning of the step [J]; 0 if no balance is requested. */
double refdyn_energy_at_begin(const struct refdyn_motion *motion);
/* After the state at the beginning of the step has jumped from one of this energy: counts the difference as
 * work. */
void refdyn_energy_has_jumped(struct refdyn_motion *motion, double before);
/* Work done at theta of the step that was taken, by quadrature. Errors: those of refdyn_rates. */
int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done);

/* After an adaptive step with this error of its state, in tolerances: computes the work again if the state is
 * exact and the step too long for its work. State and rates stay as they are; scratch of the step does not.
 */
void refdyn_resolve_work(struct refdyn_motion *motion, double error);

/* ---- Steps that copies of a motion repeat (repeated_steps.c) ---- */

/* A point of the recorded motion whose time each copy finds: the start, or the end of a step. */
struct refdyn_waypoint {
    double t;                     /* [s] */
    int is_fixed;                 /* an output, a sample or the end: the same time in each copy */
    int is_switch;                /* a time event that is not among the known ones */
    int first_break, break_count; /* in `places`: indices of known time events */
    int first_due, due_count;     /* in `places`: state events and kinks that are due, ascending */
    int has_kinks;                /* kinks are due */
};

struct refdyn_repeated_step {
    double t; /* end [s] */
    enum refdyn_method method;
    int waypoint;          /* where it ends; -1: nowhere */
    int is_empty;          /* no step: events became due when others acted */
    int is_special;        /* through a singular state, or to rows that fade out */
    int is_cut;            /* an attempt to take a longer step was refused */
    int sees_beyond;       /* stages were beyond kinks */
    int aligns;            /* directions in the metric of M are computed at its end */
    int iterations, keeps; /* as in struct refdyn_step */
};

/* The steps of a motion. The first waypoint is the start. */
struct refdyn_pattern {
    struct refdyn_repeated_step *steps; /* (step_count) */
    struct refdyn_waypoint *waypoints;  /* (waypoint_count) */
    int *places;
    int step_count, waypoint_count, place_count;
};

/* `struct refdyn_repetition` is written only by repeated_steps.c. */
struct refdyn_repetition {
    const struct refdyn_pattern *pattern; /* NULL: the motion chooses its steps */
    int status;                           /* why the copy has left the pattern; 0: it has not */
    double t_failed;                      /* when [s] */
    int next, from, to;                   /* step; last waypoint; next waypoint of time, -1: not known */
    double t_from, t_to;                  /* own times of these waypoints [s] */
    double t_start, stretch;              /* start; length of the copy relative to the recorded motion */
    int is_additional;                    /* the next step is not in the pattern */
    double *breaks;                       /* (break_count) scratch: own times of known time events [s] */
};

void refdyn_repetition_lay_out(struct refdyn_repetition *repetition, const struct refdyn_model *model,
                               struct layout *layout);
/* The first function lets a motion choose its steps; after the second it repeats a pattern from its start.
 * t_final: the end of the recorded motion; call refdyn_integrator_until before, which sets the copy's. */
void refdyn_repetition_clear(struct refdyn_motion *motion);
void refdyn_repetition_start(struct refdyn_motion *motion, const struct refdyn_pattern *pattern,
                             double t_final);
/* Before and after each step. The second compares its events with those of the pattern; the first refuses the
 * next step if they differ, with NO_DERIVATIVE. They do nothing in a motion that chooses its steps. */
int refdyn_repetition_begin_step(struct refdyn_motion *motion);
void refdyn_repetition_end_step(struct refdyn_motion *motion);
/* Plans the next step, or takes it if it is special; error: as above. */
int refdyn_repetition_plan(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt);
/* Call it if the copy could not take a step; status: why. */
void refdyn_repetition_fail(struct refdyn_motion *motion, int status);
/* The known time events at t: writes their indices into `places` (break_count) and returns their number.
 * times (break_count): scratch. */
int refdyn_pattern_breaks(const struct refdyn_motion *motion, double t, double *times, int *places);

/* Called at the start, with ahead NULL; after each accepted step; and where events are due without one. */
struct refdyn_step_watch {
    void (*note)(void *context, struct refdyn_motion *motion, const struct refdyn_ahead *ahead);
    void *context;
};

/* ---- The motion: start, outputs (integrator.c) ---- */

struct refdyn_motion {
    struct refdyn_workspace *work;
    struct refdyn_options options;
    struct refdyn_parameters parameters;
    struct refdyn_linear linear;
    struct refdyn_step step;
    struct refdyn_step_control control;
    struct refdyn_time_events time_events;
    struct refdyn_state_events state_events;
    struct refdyn_kink_guard kink_guard;
    struct refdyn_after after;
    struct refdyn_idle idle;
    struct refdyn_programme programme;
    struct refdyn_automatic automatic;
    struct refdyn_rate_errors rate_errors;
    struct refdyn_singular_crossing crossing;
    struct refdyn_fading fading;
    struct refdyn_residuals_before before;
    struct refdyn_repetition repetition;
    const struct refdyn_step_watch *watch; /* NULL: nobody watches */
    struct refdyn_statistics statistics;
    struct refdyn_failure failure;
    struct refdyn_pace pace;
    enum refdyn_method ordinary; /* method of ordinary steps, while a special step is on */
    int rows_change;             /* at the time event where the last step ended */
    double t_final, t_most;      /* end of the motion and limit: refdyn_integrator_until, _limit [s] */
    long evaluations_before;     /* of the workspace, at the start */
    int is_started;              /* refdyn_integrator_start has succeeded */
};

/* Does the motion repeat the steps of another one? */
static inline int refdyn_repeats(const struct refdyn_motion *motion) {
    return motion->repetition.pattern != NULL;
}

/* Adaptive steps of most methods reach beyond outputs, where their interpolants provide the state. Their
 * errors are those of positions alone. */
static inline int refdyn_steps_end_at_outputs(const struct refdyn_motion *motion) {
    return motion->options.tol == 0 || motion->options.tol_rates > 0 ||
           motion->step.method->kind->ends_at_outputs;
}

/* The judgement of the next step may need its error estimate. */
static inline int refdyn_rate_errors_may_count(const struct refdyn_motion *motion) {
    return motion->options.tol_rates > 0 || motion->options.method == REFDYN_AUTO;
}

/* Returns whether refdyn_integrator_init has succeeded. */
static inline int refdyn_integrator_is_laid_out(const struct refdyn_integrator *integrator) {
    return integrator && integrator->seal == REFDYN_SEAL && integrator->motion;
}

/* Returns OK, or NOT_STARTED before a successful start. */
static inline int refdyn_integrator_status(const struct refdyn_integrator *integrator) {
    return refdyn_integrator_is_laid_out(integrator) && integrator->motion->is_started ? REFDYN_OK
                                                                                       : REFDYN_NOT_STARTED;
}

/* Like refdyn_integrator_look, at any time in the last step, also after the shown state. */
int refdyn_integrator_show(struct refdyn_integrator *integrator, double t);

/* The time at which rates, rows and energies of t, inside the last step or at its end, are evaluated. */
static inline double refdyn_rows_side_of(const struct refdyn_motion *motion, double t) {
    return motion->rows_change
               ? refdyn_step_inside(&motion->step, t)
               : fmax(refdyn_time_events_right_of(&motion->time_events, t), motion->step.t_begin);
}

/* The longest ordinary step: half of the way to an obstacle whose special step has failed [s]. */
static inline double refdyn_ahead_longest(const struct refdyn_motion *motion,
                                          const struct refdyn_ahead *ahead) {
    return (ahead->remaining - motion->step.t_begin) / 2;
}

#endif
