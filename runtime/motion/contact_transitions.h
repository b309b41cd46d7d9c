/*
 * What happens when contacts close, come to rest, exchange their forces or let go: impacts, and which
 * contacts rest afterwards.
 */
#ifndef REFDYN_CONTACT_TRANSITIONS_H
#define REFDYN_CONTACT_TRANSITIONS_H

#include "motion/motion.h"

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

#endif
