/*
 * What the runs of a study say: of its reference in sentences, of each method in a row of a table.
 */
#ifndef REFDYN_TOOL_FINDINGS_H
#define REFDYN_TOOL_FINDINGS_H

#include "report/study.h"

/* "rk4", "rk4, baumgarte": the stabilisation where the method has several. */
const char *series_name(const struct study *study, const struct series *series);
/* "tolerance 1e-06" or "step 0.001 s". */
const char *trial_setting(const struct trial *trial);
/* "done", or where the run stopped and why. */
const char *trial_outcome(const struct trial *trial);
/* Unit of errors. */
const char *study_unit(const struct study *study);

/* What errors are measured against. */
const char *findings_reference(const struct study *study);

enum {
    LEVEL_COUNT = 3,
    FINDING_COLUMNS = 5 + LEVEL_COUNT /* method, CPU times, slope, least error, limit of stability, stops */
};

/* What the table's times are, for a line below it. */
extern const char findings_note[];

/* What is in a column of the table for a series, or NULL: the column's head. */
const char *findings_cell(const struct study *study, const struct series *series, int column);

#endif
