/* One accepted step of a drive. */
#ifndef REFDYN_ADVANCE_H
#define REFDYN_ADVANCE_H

#include "../refdyn.h"

/* One step towards t_out: of fixed steps never past it, but by one that passes a state where the rows lose
 * rank. From drive->state_new at t_end to the same, later.
 * Errors: as refdyn_drive_step. */
int refdyn_advance(struct refdyn_drive *drive, double t_out);
/*
 * A step of h from drive->state with drive->slope may come near a state where the rows lose rank: *t is when,
 * INFINITY: it does not, or options.singular asks for no passing. Then tries to pass that state, with a step
 * that ends before t_bound: 1 when that was done, and state_new at t_end is the new state; 0: no other step
 * should go more than half of the way.
 */
int refdyn_pass(struct refdyn_drive *drive, double h, double t_bound, double *t);
/* Gains in work->p as options.stabilise asks, for a step of h. */
void refdyn_set_gains(struct refdyn_drive *drive, double h);
/* Does a projection change rates by a part of the largest that no error of a step is, and, over the longest
 * step so far (or h), by more than positions may? Where the rows lose rank it says nothing about rates. Both
 * states (2 n). */
int refdyn_rates_are_moved(const struct refdyn_drive *drive, const double *before, const double *after,
                           double h);
/* Moves a state (2 n) at t onto the programme along directions that fit the method. The row terms of the
 * state are in the workspace, at the end those of the new one. Errors: those of refdyn_project. */
int refdyn_meet_programme(struct refdyn_drive *drive, double t, double *state);
/* What the row terms in the workspace add to the statistics. */
void refdyn_record_residuals(struct refdyn_drive *drive);
/* Work done at the state `seen` at t_begin + theta (t_end - t_begin), by quadrature: of methods that do not
 * integrate it. Errors: those of refdyn_slope. */
int refdyn_find_work(struct refdyn_drive *drive, double theta, double *work_done);
/* An accepted step of h, and the row terms in the workspace at its end, into the statistics. */
void refdyn_accept_step(struct refdyn_drive *drive, double h);
/* Smallest step from t_begin that still moves the time by a few units in its last place. */
double refdyn_step_least(const struct refdyn_drive *drive, double t_out);
/* Are options.step_limit steps tried? */
int refdyn_step_limit_reached(const struct refdyn_drive *drive);

/* Of drive->error, that of positions, and of velocities times h: max(|e_q|, h |e_v|) / unit; NAN where one
 * is. */
double refdyn_largest_error(const struct refdyn_drive *drive, double h);

#endif
