/*
 * Names that vary: which parameter, input, option, start value or files of samples of the model each of them
 * is.
 *
 * Takes columns of values under the names that a sweep or a table gives them; gives columns of cases, or
 * complaints in `messages`. A name that the model lacks may be one of another structure of it, where options
 * vary: each structure that the cases need is read, which also says whether it may be.
 */
#ifndef REFDYN_TOOL_CASE_NAMES_H
#define REFDYN_TOOL_CASE_NAMES_H

#include "batch/cases.h"
#include "command_line/options.h"
#include "gen.h"
#include "read/sweep_file.h"

struct case_names {
    struct memory *memory;
    struct messages *messages;
    const struct generation *generation; /* of the model as the command line has it */
    const struct options *options;
    const char *folder; /* of the sweep or the table, "" or with / at its end: files of samples are named from
                           there */
};

/* What the name is; a column of texts or numbers of that name may have other values than it needs. False,
 * with a complaint that calls it `path`, when it is of two kinds, or of none while no options vary. Without a
 * target: not known yet. */
bool case_names_find(const struct case_names *names, const char *path, const struct case_column *column,
                     bool options_vary, struct varied *varied);
/* Is that the name of an option? */
bool case_names_is_option(const struct case_names *names, const char *name);
/* Makes the values of the column those that the kind needs; false with a complaint. */
bool case_names_convert(const struct case_names *names, const char *path, const struct case_column *column,
                        long count, struct varied *varied);
/* Reads each structure of the cases, finds the names that are not known yet, and the files of samples. */
bool case_names_check(const struct case_names *names, const struct case_table *table, struct cases *cases);

#endif
