/*
 * One-sided contacts: their modes, and the values whose zeros end a step.
 *
 * A contact is free, and then its value is the gap; or it rests, and then its row keeps the gap closed and
 * its value is the force that this takes; or it touches without force, because other contacts keep it closed
 * or nothing presses it. Where it touches, and where it has just left without a rebound, its value is the gap
 * plus what a gap may be off. Each value falls through zero where the mode changes. contact_transitions.h
 * says what happens there.
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
    double *reach; /* (count) what a gap may be off: the tolerance, or rounding */
    double *allowance;     /* (count) added to the gap of a contact that touches, or has just opened, */
    double *allowed_until; /* (count) until then [s] */
    int are_unique;        /* forces follow from the motion: no contact depends on others that rest */
    double tolerance;      /* of positions [rad, or options.length] */
    double longest;        /* step so far, 0: none [s] */
    double *inside; /* (count) what a gap may be negative by since an importer passed its closing; 0: it did
                       not */
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
/* A motion begins: all contacts are free, and so say the parameters of the workspace. */
void refdyn_contacts_clear(struct refdyn_contacts *contacts, struct refdyn_workspace *work, double tolerance);
/* Puts the values of contacts that are not free in the place of their gaps. Errors: those of refdyn_rates. */
int refdyn_contacts_values(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                           const double *state, double *values);
/* Contacts that have opened clearly at t lose their allowance; `values`: of the state, as above. */
void refdyn_contacts_end_allowances(struct refdyn_contacts *contacts, double t, double *values);
/* How the forces of a state change with time, and what of that is rounding. Errors: those of refdyn_rates. */
int refdyn_contacts_force_rates(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                                const double *state);
/* Where forces are not unique: the smallest that do the same, unless some of these would pull. `terms` are
 * the events' at the state; forces (count), in and out. */
void refdyn_contacts_spread(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                            const double *terms, double *forces);
/* The contact of event i, -1: it is none. */
int refdyn_contact_of(const struct refdyn_contacts *contacts, int event);

#endif
