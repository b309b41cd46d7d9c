/*
 * Names that who writes and who reads a file of runs agree on.
 */
#ifndef REFDYN_TOOL_RUNS_FORMAT_H
#define REFDYN_TOOL_RUNS_FORMAT_H

#define RUNS_CONTENT "refdyn runs"
#define RUNS_BATCH_COUNT "batch_cases" /* of the whole batch, of which a file may have a part */
#define RUNS_KIND "kind"
#define RUNS_TARGET "target"

enum { RUNS_VERSION = 1 };

/* What of each case has a dataset at the top: the first numbers of a row. */
enum { RUNS_NUMBER, RUNS_STATUS, RUNS_STEPS, RUNS_CPU, RUNS_HEAD_COUNT };

/* By enum varied_kind. */
extern const char *const runs_kinds[];
enum { RUNS_KIND_COUNT = 6 };

#endif
