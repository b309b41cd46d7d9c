/*
 * Equilibria on one-sided contacts: which contacts carry a load.
 *
 * With g the gaps of the contacts that take part and p their forces, an equilibrium has g >= 0, p >= 0 and
 * p g = 0. Contacts that carry are rows that hold; of the others the gaps are checked.
 */
#ifndef REFDYN_CARRYING_H
#define REFDYN_CARRYING_H

#include "statics/newton.h"

void refdyn_carrying_lay_out(struct carrying *carrying, const struct refdyn_model *model,
                             struct layout *layout);
/* Divides the rows of the options into those that always hold and those of contacts; at first no contact
 * carries. 1: there are contacts. */
int refdyn_carrying_begin(struct statics *statics);
/*
 * Finds the next set of contacts that carry from q (n) and, where `status` says that the present set has an
 * equilibrium, from its forces. Returns 1: there is a next set. 0: the present set is final, or there is no
 * other one to try; *status is then the final status. start (n): the first q, from which bodies are let down
 * onto their contacts.
 */
int refdyn_carrying_next(struct statics *statics, const double *start, double *q, int *status);
/* At the end: writes the parameters of the contacts, their gaps, and the multipliers in the order of the
 * options' rows. */
void refdyn_carrying_report(struct statics *statics, const double *q, int status);

#endif
