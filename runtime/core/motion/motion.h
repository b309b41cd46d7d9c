/* The insides of an integrator. */
#ifndef REFDYN_MOTION_H
#define REFDYN_MOTION_H

#include "runtime/core/base/core.h"

#include "refdyn.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/implicit/implicit.h"
#include "runtime/core/methods/methods.h"

struct refdyn_motion;
struct refdyn_ahead;

/*
 * The parameters of a motion: the caller's, with the gains of the step in the places that the model names.
 *
 * While an integrator works, the workspace evaluates with these; the caller's own are written by events
 * alone.
 */

struct refdyn_parameters {
    double *own;     /* as work->p */
    double *callers; /* work->p while `own` are in use */
};

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout);
/* From here to _leave the workspace evaluates with the motion's parameters. */
void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
/* Inside: sets the caller's parameter at a place of p, and takes the caller's values anew. */
void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value);
/* Inside: takes the caller's values anew. */
void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_model *model);
/* The gains that the options ask for, for a step of h; INFINITY: none. */
void refdyn_parameters_set_gains(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                                 const struct refdyn_options *options, double h);

/* Keeping a motion on its programme: projections along directions that fit the method. */

/* For which matrix the directions of the linearisation were found. */
struct refdyn_programme {
    double *q;     /* (n) in the metric of M at this position, */
    int choice;    /* with partition.choices then, -1: not of M; */
    long factored; /* of a step's matrix, linear->factored then, -1: not of one */
    long aligned;  /* how often directions in the metric of M were found */
};

void refdyn_programme_lay_out(struct refdyn_programme *programme, const struct refdyn_model *model,
                              struct layout *layout);
/* The directions are to be found anew. */
void refdyn_programme_forget(struct refdyn_programme *programme);
/* Moves a state (2 n) at t onto the programme. The row terms of the state are in the workspace, at the end
 * those of the new one. Errors: those of refdyn_project. */
int refdyn_programme_meet(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                          double *state);
/* Its part for methods that do not project by their matrix: finds directions that suit the state, unless
 * those that there are do. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_programme_align(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                           const double *state);
/* Directions of a step's matrix that somebody else has factored go where this points (m x n, of all rows in
 * their order). */
double *refdyn_programme_take_directions(struct refdyn_programme *programme, struct refdyn_linear *linear);
/* Does a projection change velocities by a part of the largest that no error of a step is, and, over a time
 * h, by more than positions may? Where the rows lose rank it says nothing about velocities. Both states (2
 * n). */
int refdyn_programme_moves_velocities(const struct refdyn_step *step, const double *before,
                                      const double *after, double h);
/* The largest change of a position by a projection that is no sign of a step that went wrong. */
double refdyn_programme_moved_most(const struct refdyn_step *step);

/*
 * One-sided contacts: their modes, and the values whose zeros end a step.
 *
 * A contact has one of three modes:
 * - free: its value is the gap;
 * - resting: its row keeps the gap closed, and its value is the force of that row;
 * - touching: other contacts keep the gap closed, or nothing presses it, so that there is no force.
 *
 * To the gap of a contact that touches, and for a short time of one that has just opened, the value adds an
 * allowance for errors and rounding. Each value falls through zero where the mode changes.
 * motion.h says what happens there.
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
    double longest;        /* step so far, 0: none [s] */
    double *inside; /* (count) how far a gap may be below zero, after an importer has passed its closing;
                       else 0 */
    double
        late; /* how far beyond a contact's closing an importer may have stopped [s]; 0: motions locate it */

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

/* clang-format off */
/*
 * Events of the state: where a value of the model crosses zero, a step ends.
 *
 * Each accepted step is looked at in nine places of the method's own interpolant. Where a value has changed its sign, or a parabola
 * through three of them says that it may have been beyond zero in between, the first zero is found on the interpolant, and the step is
 * taken anew to there, until its end lies on the zero: the event is as accurate as a step. What then happens, motion.h tells.
 *
 * On which side of zero a value is, is kept: behind an event it is the one to which the crossing led, or, where an action has turned the
 * value, follows from its rate, so that what is left of it there by rounding does not count. A value that is zero at the start is an event where it leaves zero in the event's direction.
 */
/* clang-format on */

enum { REFDYN_EVENT_SAMPLES = 8 }; /* of a step, behind its begin */

struct refdyn_state_events {
    int count; /* of values: events of the model, then kinks, which have no direction and nothing happens at
                */
    int named; /* of them, events */
    int *
        side; /* (count) of zero where each value is: -1, 1; 0: on zero, and its rate does not say where to */
    int *side_end; /* (count) the same at the end of the step that is looked at */
    int *towards;  /* (count) the side to which the last crossing that was found leads */
    int *due;      /* (due_count) those that happen at the end of the last step, ascending */
    int due_count;
    int *returns;    /* (count) short steps that have stayed at a kink which leads back: motion.h */
    int due_named;   /* of these, events */
    int is_told;     /* the caller has been told of them */
    int looks_again; /* values may have jumped: inputs, parameters, the state or formulas of time have */
    double *samples; /* ((REFDYN_EVENT_SAMPLES + 1) x count) values at the begin and in the step */
    double *sizes;   /* (count) largest |value| since the start: below a part of it, that of a kink is zero */
    double *zeros;   /* (count) what counts as zero in the step: values at its begin that are just beyond */
    double *turned;  /* (count) largest rate of a kink at which rows have turned */
    double *values;  /* (count) of the state that is looked at */
    double *rates;   /* (count) of the values before what is due happens */
    double *risen;   /* (count) largest |value| of an event since it last happened; INFINITY: it never has */
    double *terms;   /* result of event_terms */
    double *room;    /* (2 n + 1) a state in the step; (n) jump of rates */

    struct refdyn_contacts contacts; /* their values depend on their modes */

    /* the zero that is looked for: no step, or the steps so far did not end on it */
    int target, tries;
    int held;              /* kink before which the end of the step was moved back, -1: none */
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
/* Their entry in the list of obstacles. Errors of the first: NOT_FINITE; those of interpolation. */
int refdyn_state_events_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
double refdyn_state_events_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);
/* The values of a state; the second function writes values and derivatives into `values` and `terms`. Errors:
 * NOT_FINITE, those of refdyn_rates where contacts rest. */
int refdyn_state_events_values(struct refdyn_state_events *events, const struct refdyn_step *step, double t,
                               const double *state, double *values);
void refdyn_state_events_evaluate(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t, const double *state);
/* Notes that the due events have happened at t, the begin of the step or its end. `values` and `terms` must
 * be those of that state, and `risen` up to date. */
void refdyn_state_events_note_due(struct refdyn_state_events *events, const struct refdyn_step *step,
                                  double t);
int refdyn_state_events_is_due(const struct refdyn_state_events *events, int i);
/* After a step: moves its end back before kinks of positions that it passes by rounding only, so that rows
 * which turn there are still those of its begin. */
void refdyn_state_events_end_before_kinks(struct refdyn_state_events *events, struct refdyn_step *step);
/* Moves a state at t inside the step in the same way. */
void refdyn_state_events_see_before_kinks(struct refdyn_state_events *events, const struct refdyn_step *step,
                                          double t, double *state);
/* When rows have turned at the kinks that are due, and rates with them: do the rates lead back to the kink,
 * or is the motion at rest there? Otherwise they lead on to the side to which the motion has crossed. */
int refdyn_state_events_lead_back(struct refdyn_state_events *events, const struct refdyn_step *step);
/* Have so many events followed each other without time between that they will not end? */
int refdyn_state_events_accumulate(const struct refdyn_state_events *events);
/* Forces and rows that jump at a due kink must see the side to which the motion has crossed. Moves a state at
 * the begin of the step to that side of the kinks, or with side = -1 to the other side, by an amount of
 * rounding. Has it moved? */
int refdyn_state_events_leave_kinks(struct refdyn_state_events *events, const struct refdyn_step *step,
                                    int side, double *state);
/* What is due is about to happen at the begin of the step: notes the values before, and their rates. */
void refdyn_state_events_note(struct refdyn_state_events *events, const struct refdyn_step *step);
/* It has happened: on which side values are now, and what is due since others have jumped. */
void refdyn_state_events_settle(struct refdyn_state_events *events, const struct refdyn_step *step);
/* (n) Derivatives by qd of value i, in the terms. */
static inline const double *refdyn_state_events_by_qd(const struct refdyn_state_events *events, int n,
                                                      int i) {
    return events->terms + events->count * (1 + n) + i * n;
}
/* An event may lie so far beside the time at which it would, by rounding of states [s]. */
double refdyn_state_events_blur(double t);
/* Is there something that the caller is to be told before the motion goes on? */
static inline int refdyn_state_events_wait(const struct refdyn_state_events *events) {
    return events->due_named > 0 && !events->is_told;
}

/* The lengths of steps: proposed from errors, or equal parts of an interval. */

struct refdyn_step_control {
    double next;            /* adaptive: proposed step, 0: to be found [s] */
    double cap, cap_growth; /* steps longer than this have failed lately [s], and grow to it by this factor */
    double error_last, last;            /* error norm and length of the last accepted step, 0: none [s] */
    double refused_error, refused;      /* the same of the last attempt at this one, 0: none [s] */
    double from, to;                    /* fixed: output interval in progress [s] */
    long interval_steps, interval_done; /* fixed: steps of that interval */
};

/* Smallest step from t_begin that still moves the time by a few units in its last place, also at t_out. */
double refdyn_control_least(double t_begin, double t_out);
/* Times that are nearer to t than this are the same time. */
double refdyn_time_resolution(double t);

/* Adaptive steps begin, or those of another method: with h, 0: to be found. */
void refdyn_control_begin(struct refdyn_step_control *control, double h);
/* Finds the first step towards t_stop where none is proposed: velocities and accelerations move no coordinate
 * by more than a small part of tol^(1/order). It does not depend on the outputs; where nothing moves it is
 * `interval`. */
void refdyn_control_find(struct refdyn_step_control *control, const struct refdyn_step *step, double t_stop,
                         double interval);
/* After a very short step to a requested time: if the proposed step is shorter than `least`, it is dropped,
 * and the next step is chosen as at a start. */
void refdyn_control_drop(struct refdyn_step_control *control, double least);
/* No step is longer than h. */
void refdyn_control_bound(struct refdyn_step_control *control, double h);
/* The step to try: the proposed one, shortened so that it lands on t_stop or leaves more than half of itself.
 */
double refdyn_control_clip(const struct refdyn_step_control *control, double t_begin, double t_stop);
/* Proposes the next step after one of h with this error, in tolerances: accepted; too large, or INFINITY
 * where the step could not be evaluated. */
void refdyn_control_accepted(struct refdyn_step_control *control,
                             const struct refdyn_method_definition *method, double h, double error);
void refdyn_control_refused(struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error);
/* A step of h failed: no longer one than a part of it is soon tried again. */
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

/* clang-format off */
/*
 * Time events: times at which formulas of time alone have kinks or jumps. Every step ends at the next one, sees its left side,
 * and the motion goes on from its right side, each by so much that no rounding of a comparison can matter.
 *
 * Times of piecewise linear formulas are known. Others are searched for as far as a step may reach: first a change of sign
 * between 32 samples, or more if the frequency of the functions requires it (model.pace), then bisection. A sign that changes and
 * changes back between two samples is found where a parabola through three samples shows it. No step reaches beyond what was searched.
 */
/* clang-format on */

struct refdyn_time_events {
    int count;        /* of known ones, */
    double *times;    /* (count) ascending [s] */
    int next;         /* the first of them that lies ahead */
    double *switches; /* (4 switch_count) values that change sign at others, at times after a step's begin */
    double switched;  /* the last of these that was found [s] */
};

void refdyn_time_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                                struct layout *layout);
/* The known ones for the present parameters and inputs; none is passed yet. t, q and qd: any. */
void refdyn_time_events_take(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd);
/* t, or behind a time event that is there: where functions have the values with which the motion goes on. */
double refdyn_time_events_right_of(const struct refdyn_time_events *events, double t);

/*
 * The insides of an integrator: each struct is written by the file of its name alone.
 */

/* The automatic method: automatic_method.c. */
struct refdyn_automatic {
    struct refdyn_choice found;
    int chosen;                /* candidate that won the last trial, -1: none has ended yet */
    int at;                    /* candidate on trial, -1: no trial is on */
    enum refdyn_method next;   /* method of the next step */
    long steps_left, patience; /* until the trial of this candidate ends, or the next one begins */
    int wants_spectrum;
    double marked_t, marked_operations;
};

/* Through a state where the rows lose rank: singular_crossing.c. */
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

/* Rows that fade out towards a time event: fading_rows.c. */
struct refdyn_fading {
    double t, looked; /* event that was looked at last, from how far [s], */
    int is_known;     /* and rows fade out towards it, */
    int rank;         /* which was this before */
    struct refdyn_stage_guide guide;
};

/* Residuals before a jump: row_changes.c. */
struct refdyn_residuals_before {
    double *phi, *psi; /* (m) */
    double *state;     /* (2 n) they belong to this state */
    int are_seen;      /* and the caller has seen it last */
};

/* The last failure of an evaluation or projection: accepted_step.c. */
struct refdyn_failure {
    int cause; /* 0: none */
    double t;  /* [s] */
};

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
    int rows_change;             /* at the time event where the last step ended: row_changes.c */
    double t_final;              /* end of the motion, see refdyn_integrator_until [s] */
    double t_most;               /* no step reaches beyond, see refdyn_integrator_limit [s] */
    long evaluations_before;     /* of the workspace, at the start */
};

/* ---- Obstacles ahead: obstacles.c has the list of their kinds ---- */

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
};

/* A motion begins. */
void refdyn_obstacles_start(struct refdyn_motion *motion);
/* What happens where the last step ended, at the begin of the next one. Errors: those of refdyn_rows_take_new
 * and refdyn_event_actions_take. */
int refdyn_obstacles_leave(struct refdyn_motion *motion);
/* The nearest obstacle that an ordinary step may end on. */
void refdyn_obstacles_find(struct refdyn_motion *motion, double t_out, struct refdyn_ahead *ahead);
/* Takes a special step if an obstacle demands one within reach of ordinary steps of h. Returns 1 if that was
 * done; state_new at t_end then is the new state. Otherwise ahead->stop leaves room for the special step. */
int refdyn_obstacles_step(struct refdyn_motion *motion, double h, struct refdyn_ahead *ahead);
/* A step is good, and its end complete: *t is where a shorter one has to end because of an obstacle in the
 * step; t_begin: no step may be taken; INFINITY: the step stands. An error refuses it. */
int refdyn_obstacles_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* A step was refused, with this status or, if that is 0, for its error: the obstacle that may have caused
 * this, where a shorter step should end; INFINITY: none. */
double refdyn_obstacles_cause(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, int status);

/* From _begin to _end, steps are special: by this method, with stages that the guide brings onto the
 * programme. */
void refdyn_special_step_begin(struct refdyn_motion *motion, enum refdyn_method method,
                               const struct refdyn_stage_guide *guide);
void refdyn_special_step_end(struct refdyn_motion *motion);

/* No ordinary step is longer: half of the way to an obstacle whose special step has failed [s]. */
static inline double refdyn_ahead_longest(const struct refdyn_motion *motion,
                                          const struct refdyn_ahead *ahead) {
    return (ahead->remaining - motion->step.t_begin) / 2;
}
/* The nearer of the end of the motion and the caller's limit that is still ahead; INFINITY: neither is. */
double refdyn_motion_bound(const struct refdyn_motion *motion);
/* Times closer to t than this are the same time for the motion; it depends on the larger of t and t_final. */
double refdyn_motion_resolution(const struct refdyn_motion *motion, double t);

/* Time events, as an entry of the list: the next one after the begin of the step. The step evaluates nothing
 * after it, and continues nothing across one at its begin. */
double refdyn_time_events_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);

/* ---- One accepted step of a motion ---- */

/* One step towards t_out: of fixed steps never past it, but by one that passes a state where the rows lose
 * rank. From state_new at t_end to the same, later. Errors: as refdyn_integrator_step. */
int refdyn_accept_step(struct refdyn_motion *motion, double t_out);
/*
 * The same in parts, so that somebody else may take the step: begin, then prepare, plan, take and judge until
 * is_over, when the step is accepted. Fixed steps, special steps, and a begin at which events are due, are
 * over after begin. Errors: as refdyn_integrator_step.
 */
struct refdyn_attempt {
    struct refdyn_ahead ahead;
    double h, t_new; /* length and end of the step to take [s] */
    double size;     /* its error, in tolerances, after refdyn_attempt_measured */
    int is_measured; /* that is known */
    int is_left;     /* somebody else was to take the step and could not */
    int is_over;     /* no step is being tried */
};
int refdyn_attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt);
/* What the steps of some methods begin with, unless somebody else takes them; without it the automatic method
 * goes on with another one. */
int refdyn_attempt_prepare(struct refdyn_motion *motion);
int refdyn_attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt);
/* Errors: those of the method, for judge. */
int refdyn_attempt_take(struct refdyn_motion *motion, const struct refdyn_attempt *attempt);
/* The error of what was tried, as refdyn_step_largest_error. */
void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error);
/* taken: what taking it ended with. */
void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken);

/* The parts of special steps: the method's attempt from t_begin to t_new, with the gains of a step of h; its
 * end on the programme, with partition, rates and work; the statistics of an accepted step. */
int refdyn_motion_try(struct refdyn_motion *motion, double t_new, double h);
int refdyn_motion_complete(struct refdyn_motion *motion);
int refdyn_motion_accept(struct refdyn_motion *motion, double h);
/* Are options.step_limit steps tried? */
int refdyn_step_limit_reached(const struct refdyn_motion *motion);
/* An evaluation or projection has failed at t. */
void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t);

/* The automatic method: a choice by trial. */

/* Begins the first trial; at the start of a motion. */
void refdyn_automatic_start(struct refdyn_motion *motion);
/* After an accepted step: counts, judges, and asks for another method (its `next`) where that is due.
 */
void refdyn_automatic_after_step(struct refdyn_motion *motion);
/* The tolerance that the method in use needs for an error as that of the others. */
double refdyn_automatic_tolerance(const struct refdyn_motion *motion);
/* After a step that could not be evaluated; 1: the automatic choice has gone over to the explicit method,
 * since the tangent at the begin of the step is not finite, which no smaller step changes. */
int refdyn_automatic_after_failure(struct refdyn_motion *motion);
/* The motion goes on from a time before the end of its last step, by `back` [s]. */
void refdyn_automatic_go_back(struct refdyn_motion *motion, double back);
/* Takes up the method that was asked for. */
void refdyn_automatic_take_up(struct refdyn_motion *motion);

/*
 * What happens when contacts close, come to rest, exchange their forces or let go: impacts, and which
 * contacts rest afterwards.
 */

/*
 * Call it when the step's begin is the start of a motion and all contacts are free. Contacts that are closed
 * there without a rate rest or touch from the start; *is_changed says whether there are any. Other closed
 * contacts are due. Errors: CONTACT_INSIDE, and those of refdyn_contact_transitions_take.
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

/*
 * Where a value that is positive at three places may be below zero between them.
 *
 * The parabola through the three places shows where the value is smallest. The search for a zero evaluates it
 * there, and the new place replaces one of the three.
 */

/* Three places and the values there, with the sign that makes them positive. */
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

/* Energy by which a state jumps, at impacts and where rows begin to act: it counts as work. */

/* Kinetic and potential energy at the begin of the step [J]; 0 where no balance is asked for. */
double refdyn_energy_at_begin(const struct refdyn_motion *motion);
/* The state at the begin of the step has jumped from one of this energy. */
void refdyn_energy_has_jumped(struct refdyn_motion *motion, double before);

/* What happens at events of the state: impacts, rates, inputs and parameters that they set. */

/*
 * Before a step: what is due happens at its begin, and the motion goes on from there. Then other events may
 * be due, of which the caller is told first. Errors: EVENTS_ACCUMULATE; EVENT_NOT_MET; SLIDES; those of
 * refdyn_accelerate and, where rows are met by projection, of refdyn_project.
 */
int refdyn_event_actions_take(struct refdyn_motion *motion);

/*
 * Rows that fade out towards a time event: their own part becomes smaller and smaller and is 0 from there on,
 * as that of y in x + (1 - ramp(t, 0.5, 1)) y beside x.
 *
 * Until then they determine the motion, but the nearer the event the less their numbers tell: what rounding
 * leaves of phi is divided by their own part, and what it leaves of accelerations by its square. The motion
 * itself is smooth. So one step of gauss12 ends at the event: its last stage lies 0.034 of the step before
 * it, and nothing is evaluated nearer. Its stages are brought onto the programme. Behind the event the next
 * step begins with the rows that are left (motion.h).
 */

/* Doubles of a step's memory. */
int refdyn_fading_memory_size(const struct refdyn_model *model);
/* Their entry in the list of obstacles. */
void refdyn_fading_start(struct refdyn_motion *motion);
double refdyn_fading_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
int refdyn_fading_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* Was the last step one that ends at such an event? */
static inline int refdyn_fading_is_on(const struct refdyn_motion *motion) {
    return motion->step.guide == &motion->fading.guide;
}
/* An ordinary step was taken: has it lost rows that fade out towards an event that it did not begin behind?
 */
int refdyn_fading_lost_rows(const struct refdyn_motion *motion);
/* A step is refused: the partition is that of its begin again. Returns 0 where the rank is lost there
 * already: then the motion ends. */
int refdyn_fading_refuse(struct refdyn_motion *motion);
/* Does t lie so near the event that its accelerations are not to be had from the rows? */
int refdyn_fading_is_near(const struct refdyn_motion *motion, double t);

/*
 * Motions whose steps are taken side by side by somebody else (batch/lanes.h): a motion halts where it would
 * take one.
 */

/* Beside the statuses of refdyn.h. */
enum {
    REFDYN_HALTED = 1000,
    REFDYN_LEFT_TO_MOTION /* the motion takes the step itself: it needs what the others lack, or its numbers
                             are not finite */
};

/*
 * Steps towards t_out until one is to be taken that others may take: HALTED, and *attempt tells which.
 * Otherwise t_out is reached or the motion has failed, as refdyn_integrator_to tells it. *attempt is over
 * before the first call.
 */
int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out,
                           struct refdyn_attempt *attempt);
/* The step at which it halted was taken: OK or an error of the method. LEFT_TO_MOTION: the motion takes it
 * when it goes on. */
void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt, int taken);

/*
 * Rows that jump. At time events they come and go, as x + where(t < 1, 1, 0) y does, or ask for other rates,
 * as x - min(t, 1) does; at kinks in coordinates they turn, as x - abs(y) does; events and callers set inputs
 * and parameters that rows read.
 *
 * The step before the jump uses only the rows on its left side: its end is brought onto them, and states that
 * are seen inside it or at its end have their accelerations. The next step begins after the jump, where rows
 * and dependent coordinates are determined again. Positions must already meet the new rows. Rates jump by an
 * impulse u^T Lambda, as in an inelastic impact, so that the residuals of rates stay as they were, with any
 * stabilisation.
 */

void refdyn_rows_lay_out(struct refdyn_residuals_before *before, const struct refdyn_model *model,
                         struct layout *layout);
/* After a step was taken: do the rows change at the time event at its end? Row terms in the workspace and
 * room of projections are lost. */
void refdyn_rows_look_at_end(struct refdyn_motion *motion);
/* Do coefficients of rows jump at the time event that limits the step, at the state from which it begins? The
 * workspace then holds the row terms after the event. */
int refdyn_rows_jump_at(struct refdyn_motion *motion, double t);
/* The time at which rates and rows of t, inside the last step or at its end, are evaluated. */
double refdyn_rows_side_of(const struct refdyn_motion *motion, double t);
/* The next step begins where rows have changed: its state and rates. Errors: those of refdyn_project and
 * refdyn_rates; ROWS_UNMET. */
int refdyn_rows_take_new(struct refdyn_motion *motion);
/* The same if rows have changed where the last step ended: part of the entry of time events in the list of
 * obstacles. */
int refdyn_rows_leave_event(struct refdyn_motion *motion);

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

/*
 * Through a state where the rows lose rank: options.singular = REFDYN_PASS (theory, sect. 8.9).
 *
 * There K qdd = k has no unique solution, and off the programme, at a distance e from it and a time s before
 * that state, accelerations are wrong by about e/s^2. On the programme they are smooth along a branch. So one
 * step of rk8 is laid over that state whose stages are first brought onto the programme, with the state in
 * the widest gap between its stages; its embedded formulas tell its error as they do elsewhere.
 */

void refdyn_crossing_lay_out(struct refdyn_singular_crossing *crossing, const struct refdyn_model *model,
                             struct layout *layout);
/* Their entry in the list of obstacles. */
void refdyn_crossing_start(struct refdyn_motion *motion);
double refdyn_crossing_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead);
int refdyn_crossing_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
int refdyn_crossing_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t);
/* Was the last step one through such a state? */
static inline int refdyn_crossing_is_on(const struct refdyn_motion *motion) {
    return motion->step.guide == &motion->crossing.guide;
}
/* Is a state (2 n) on the branch that was followed, after a projection? NO_CONVERGENCE: it was moved so far
 * that it may not be. */
int refdyn_crossing_follow(struct refdyn_motion *motion, const double *before, const double *state);
/* Does t lie so near a state passed that its accelerations are not to be had from the rows? */
int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t);

/*
 * Jumps of forces that lead back to themselves, as Coulomb's friction by a sign, or a relay on a rate: a
 * motion slides along such a jump, where the formulas say nothing (Filippov, Differential Equations with
 * Discontinuous Righthand Sides, 1988, ch. 1), and steps go to and fro without end.
 */

/* Before a step whose begin motion.h knows: SLIDES where so many short steps have stayed at such a jump
 * that it is not left. */
int refdyn_sliding_look(struct refdyn_motion *motion);

/* What is told of a motion: struct refdyn_statistics. */

/* What the row terms in the workspace add. */
void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work);
/* An accepted step of h, with the row terms of its end in the workspace. */
void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h);
/* It was one of this method. */
void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method);
void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count);
/* A singular state was passed. */
void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing);
/* Counters that others keep. */
void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations);

/* Work of forces on a motion whose method does not integrate it. */

/* Work done at theta of the step that was taken, by quadrature. Errors: those of refdyn_rates. */
int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done);

#endif
