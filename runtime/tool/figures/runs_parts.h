/*
 * The parts of a figure of runs. All of them are false, with a complaint, when the file cannot be read.
 */
#ifndef REFDYN_TOOL_RUNS_PARTS_H
#define REFDYN_TOOL_RUNS_PARTS_H

#include "figures/runs_charts.h"

/* How a number of each case depends on what varied: over two quantities a map of the means of the cases
 * there, over one a curve. Of extremes the one at `place` of the axis. */
bool response_add(struct runs_charts *figure, const struct kept_item *item, int place);
/* Percentiles of a history over time; cases that have no number there take no part. */
bool bands_add(struct runs_charts *figure, const struct kept_item *item);
/* Heads: how many cases failed and why, and which have the largest extremes. */
bool worst_add(struct runs_charts *figure);

#endif
