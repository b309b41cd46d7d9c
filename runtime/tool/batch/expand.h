/*
 * The cases of a sweep: each point of its grids and lists, and the draws of each.
 *
 * The first name varies slowest, then the others in the order of their names, then the draws. Random numbers
 * are those of random.h by the seed, the column's name and the number of the case. A quasi-random sequence is
 * the same at each point of the grids, its dimensions are the random columns in the order of their names, and
 * a seed shifts it (modulo 1, Cranley and Patterson).
 */
#ifndef REFDYN_TOOL_EXPAND_H
#define REFDYN_TOOL_EXPAND_H

#include "read/sweep_file.h"

/* Lives in `memory`. */
void expand_cases(const struct sweep_file *file, struct memory *memory, struct case_table *cases);

#endif
