/*
 * Equilibria on one-sided contacts: which contacts carry.
 *
 * With g the gaps of the contacts that have a part and p their forces, an equilibrium has g >= 0, p >= 0, p g
 * = 0. Contacts that carry are rows that hold; the others are watched.
 */
#ifndef REFDYN_CARRYING_H
#define REFDYN_CARRYING_H

#include "statics/newton.h"

void refdyn_carrying_lay_out(struct carrying *carrying, const struct refdyn_model *model,
                             struct layout *layout);
/* Parts the rows of the options into those that hold in any case and those of contacts; at first none
 * carries. 1: there are contacts. */
int refdyn_carrying_begin(struct statics *statics);
/*
 * The next set of contacts that carry, by q (n) and, where `status` is that of an equilibrium under the
 * present set, by its forces: 1. 0: this set stands, or there is no other one to try; *status is then that of
 * the whole. start (n): q before all of it, from which bodies are let down onto their contacts.
 */
int refdyn_carrying_next(struct statics *statics, const double *start, double *q, int *status);
/* At the end: parameters of the contacts, gaps, and multipliers in the order of the options' rows. */
void refdyn_carrying_report(struct statics *statics, const double *q, int status);

#endif
