/*
 * What the runs of a study say, in plain sentences and figures.
 */
#ifndef REFDYN_TOOL_FINDINGS_H
#define REFDYN_TOOL_FINDINGS_H

#include "study.h"

enum { LEVEL_COUNT = 3 };

/* Errors at which methods are compared. */
extern const double finding_levels[LEVEL_COUNT];

/* "rk4", "rk4, baumgarte": the stabilisation where the method has several. In heap memory. */
char *series_name(const struct study *study, const struct series *series);
/* "tolerance 1e-06" or "step 0.001 s", for a sentence. In heap memory. */
char *trial_setting(const struct trial *trial);
/* "done", or where the run stopped and why. In heap memory. */
char *trial_outcome(const struct trial *trial);
/* Unit of errors. */
const char *study_unit(const struct study *study);
/* Least-squares slope of log error over log setting, of the settled runs above the floor; *count: how many.
 * NaN for fewer than three. */
double series_slope(const struct study *study, const struct series *series, int *count);
/* The quickest run with at most this error; NULL: none, or the level is below the floor. */
const struct trial *series_quickest(const struct study *study, const struct series *series, double level);

/* One sentence a line, in heap memory: what is the same on every machine, and what the clock said. */
char *findings_lasting(const struct study *study);
char *findings_times(const struct study *study);

#endif
