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
 * contact_transitions.h says what happens there.
 */
#ifndef REFDYN_CONTACTS_H
#define REFDYN_CONTACTS_H

#include "base/layout.h"
#include "constraints/one_sided.h"
#include "methods/step.h"
#include "refdyn.h"

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

#endif
