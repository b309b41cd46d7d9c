/*
 * Events of the state: the quantities by which an integrator finds and meets them.
 *
 * Takes the events and kinks of the model, gives the results `event`, their values e, and `event_terms`: with
 *     de/dt = rate + by_rate qdd
 * the rate at qdd = 0, the derivatives by coordinates and rates, the coefficients of restitution and what
 * events set, one after another.
 */
#ifndef REFDYN_GEN_EVENT_TERMS_H
#define REFDYN_GEN_EVENT_TERMS_H

#include "quantities/quantities.h"

void event_terms_build_values(struct derivation *d, struct function *f);
void event_terms_build(struct derivation *d, struct function *f);

#endif
