/*
 * What happens where contacts close, come to rest, exchange their forces or let go: impacts, and which
 * contacts rest from then on.
 */
#ifndef REFDYN_CONTACT_TRANSITIONS_H
#define REFDYN_CONTACT_TRANSITIONS_H

#include "motion/motion.h"

/*
 * The step's begin is the start of a motion, and all contacts are free. Contacts that are closed there, with
 * no rate, rest or touch from the start; *is_changed says so. Others that are closed are due. Errors:
 * CONTACT_INSIDE, and those of refdyn_contact_transitions_take.
 */
int refdyn_contact_transitions_start(struct refdyn_motion *motion, int *is_changed);
/*
 * Contacts that are due close or let go at the step's begin: changes the rates there (*has_rates) and the
 * modes. Errors: those of refdyn_accelerate; CONTACT_DRIVEN, CONTACTS_UNMET, CONTACT_INSIDE,
 * EVENTS_ACCUMULATE; then work->fault.row is that of a contact.
 */
int refdyn_contact_transitions_take(struct refdyn_motion *motion, int *has_rates);

/* The rows of contacts do not act until the next transition, which has to follow; their modes stay. */
void refdyn_contact_transitions_release(struct refdyn_motion *motion);

#endif
