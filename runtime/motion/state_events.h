/* clang-format off */
/*
 * Events of the state: where a value of the model crosses zero, a step ends.
 *
 * Each accepted step is looked at in nine places of the method's own interpolant. Where a value has changed its sign, or a parabola
 * through three of them says that it may have been beyond zero in between, the first zero is found on the interpolant, and the step is
 * taken anew to there, until its end lies on the zero: the event is as accurate as a step. What then happens, event_actions.h tells.
 *
 * On which side of zero a value is, is kept: behind an event it is the one to which the crossing led, or, where an action has turned the
 * value, follows from its rate, so that what is left of it there by rounding does not count. A value that is zero at the start is an event where it leaves zero in the event's direction.
 */
/* clang-format on */
#ifndef REFDYN_STATE_EVENTS_H
#define REFDYN_STATE_EVENTS_H

#include "base/layout.h"
#include "methods/step.h"
#include "motion/contacts.h"

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
    int *returns;    /* (count) short steps that have stayed at a kink which leads back: sliding.h */
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
/*
 * A step was taken, and its end evaluated. *t_event: where a shorter one should end; t_begin: an event stands
 * there, and no step is to be taken; INFINITY: it is good, with the events that are due at its end. `least`:
 * no step is shorter [s]. Errors: NOT_FINITE; those of interpolation; EVENTS_ACCUMULATE.
 */
int refdyn_state_events_look(struct refdyn_state_events *events, struct refdyn_step *step, double least,
                             double *t_event);
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
/* The same, where the step is too long for its error: *t_event is the first zero in it, or INFINITY. */
void refdyn_state_events_look_early(struct refdyn_state_events *events, struct refdyn_step *step,
                                    double least, double *t_event);
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

#endif
