/* What is told of a motion: struct refdyn_statistics. */
#ifndef REFDYN_STATISTICS_H
#define REFDYN_STATISTICS_H

#include "implicit/linearisation.h"
#include "refdyn.h"

/* What the row terms in the workspace add. */
void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work);
/* An accepted step of h, with the row terms of its end in the workspace. */
void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h);
/* It was one of this method. */
void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method);
void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count);
/* A singular state was passed. */
void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing);
/* Counters that others keep. */
void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations);

#endif
