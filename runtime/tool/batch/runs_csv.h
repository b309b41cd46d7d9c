/*
 * The runs of a batch as CSV, where one row a case is enough: its number, what varied (a start value under
 * NAME_start), its status, what was kept of its end, of its extremes and norms. The reason is the last
 * column, only where one of the cases has a reason, so that other files have only numbers, except for texts
 * that vary.
 */
#ifndef REFDYN_TOOL_RUNS_CSV_H
#define REFDYN_TOOL_RUNS_CSV_H

#include "batch/runs_file.h"

#include <stdio.h>

/* The name of the first item that a row has no place for, NULL: there is none. */
const char *runs_csv_unfit(const struct runs_layout *layout);
/* The first name that two columns would share; NULL: all names differ. */
const char *runs_csv_twice(const struct runs_layout *layout);
void runs_csv_header(const struct runs_layout *layout, bool has_reasons, FILE *out);
void runs_csv_row(const struct runs_layout *layout, bool has_reasons, const struct case_record *record,
                  FILE *out);

#endif
