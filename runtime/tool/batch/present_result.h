/*
 * What has the name of a batch's result already: a batch that goes on with itself neither computes again what
 * is complete nor replaces what is another's.
 */
#ifndef REFDYN_TOOL_PRESENT_RESULT_H
#define REFDYN_TOOL_PRESENT_RESULT_H

#include "batch/batch_setup.h"

enum present_result {
    PRESENT_NONE,     /* no file, or one of this batch that lacks some of the cases */
    PRESENT_COMPLETE, /* the cases [first, end) of this batch, maybe among others */
    PRESENT_OTHER     /* it cannot be read or is of another batch, as is told on stderr */
};

/* Of the file of runs `path`, by its attributes and its numbers of cases. */
enum present_result present_result(const struct batch_setup *setup, const char *path, long first, long end);

#endif
