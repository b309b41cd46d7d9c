/* clang-format off */
/*
 * Breaks: times at which formulas of time alone have kinks or jumps. Every step ends at the next one, sees its left side, and
 * the motion goes on from its right side, each by so much that no rounding of a comparison can matter.
 *
 * Those of what is piecewise linear in time are known. Others are searched for as far as a step may reach: a change of sign
 * between 32 samples, then by bisection; one that is taken back between two samples is not seen.
 */
/* clang-format on */
#ifndef REFDYN_KINKS_H
#define REFDYN_KINKS_H

#include "../refdyn.h"

/* Times that are nearer to t than this are the same time. */
double refdyn_time_resolution(double t);
/* The known breaks for the present parameters and inputs, into drive->breaks; none is passed yet. */
void refdyn_find_breaks(struct refdyn_drive *drive);
/* t, or behind a break that is there: where functions have the values with which the motion goes on. */
double refdyn_right_of(const struct refdyn_drive *drive, double t);
/* The next break behind t_begin, INFINITY: none as far as a step of `step` (0: not known) reaches or, where
 * their times are known, the motion; sets t_limit. */
double refdyn_break_ahead(struct refdyn_drive *drive, double step, double t_out);

#endif
