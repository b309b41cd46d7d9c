/*
 * Kinks of formulas in coordinates: a motion's steps end on them, as on events without a name.
 *
 * Takes the formulas of forces, loads, energies and rows. Gives model->kinks, what changes sign at their
 * minima, maxima, absolute values and comparisons of coordinates and positions; those of rates are left to
 * the control of the steps, since friction stays near them, as are those of time alone (times_of_kinks.h).
 */
#ifndef REFDYN_GEN_STATE_KINKS_H
#define REFDYN_GEN_STATE_KINKS_H

#include "model/model.h"

void state_kinks_list(struct memory *memory, struct model *model);

#endif
