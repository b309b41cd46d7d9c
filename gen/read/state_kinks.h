/*
 * Kinks of formulas in coordinates and rates: a motion's steps end on them, as on events without a name.
 *
 * Takes the formulas of forces, loads, energies and rows. Gives model->kinks, what changes sign at their
 * minima, maxima, absolute values and comparisons of coordinates, positions and rates; those of time alone
 * are others (times_of_kinks.h).
 */
#ifndef REFDYN_GEN_STATE_KINKS_H
#define REFDYN_GEN_STATE_KINKS_H

#include "model/model.h"

void state_kinks_list(struct memory *memory, struct model *model);

#endif
