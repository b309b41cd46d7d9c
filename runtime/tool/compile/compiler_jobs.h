/* Runs of a compiler: their words, and several of them at a time, in a folder whose processes end with the
 * program. */
#ifndef REFDYN_TOOL_COMPILER_JOBS_H
#define REFDYN_TOOL_COMPILER_JOBS_H

#include "system/temporary_folder.h"

/* One run of the compiler: the words of $CC, flags, then what it is to do; behind them a NULL. */
struct job {
    const char **argv;
    int argc, room;
    const char *source, *object, *log;
};

void job_add_word(struct job *job, const char *word);
/* words end with NULL. */
void job_add_words(struct job *job, const char *const *words);
/* Runs all jobs, two at a time; after a failure, which is told with what the compiler said, no new one is
 * started. Have all gone well? */
bool jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb);

#endif
