/*
 * A sweep file in Lua, or a table of cases as CSV: the cases of a batch, and what is to be kept.
 *
 * Takes a path and the model that was read; gives the cases, the options of the motions and what to keep, or
 * complaints as FILE:LINE on stderr.
 */
#ifndef REFDYN_TOOL_SWEEP_H
#define REFDYN_TOOL_SWEEP_H

#include "batch/cases.h"
#include "batch/keep.h"
#include "command_line/options.h"

struct generation;
struct memory;

struct sweep {
    struct cases cases;
    struct keep keep;
    const char *text; /* all that the cases come from: the hash of a batch is of it */
};

/* Lives in `memory`. Options of the motions that the file tells (t_end tol method from every ...) go into
 * *options, whose own values, from the command line, win. */
enum status sweep_read(struct sweep *sweep, struct memory *memory, const char *path,
                       const struct generation *generation, struct options *options);
/* One row a case, a column for each name that varies; final states are kept. */
enum status sweep_read_table(struct sweep *sweep, struct memory *memory, const char *path,
                             const struct generation *generation, const struct options *options);

#endif
