/*
 * Files that a case of a batch reads, found again: samples of inputs and a STATE.json.
 */
#ifndef REFDYN_TOOL_CASE_FILES_H
#define REFDYN_TOOL_CASE_FILES_H

#include "batch/batch_setup.h"

/* Where the files may be. */
struct case_files {
    const json_t *hashes; /* by the path that the batch was given */
    const char *folder;   /* in which the batch was called; NULL: not known */
    const char *runs;     /* the file of runs */
};

/*
 * Replaces the paths in the setup's options and cases by those at which the files are now: as they are
 * written, seen from the folder of this call, from that of the batch, or from that of the file of runs. A
 * file counts when it has the content that the batch read. False, with a complaint: one is nowhere.
 */
bool case_files_find(const struct case_files *files, struct batch_setup *setup);

#endif
