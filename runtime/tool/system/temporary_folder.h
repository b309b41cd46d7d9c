/*
 * Folders: made with all that lead to them, and temporary ones in which other programs work.
 */
#ifndef REFDYN_TOOL_TEMPORARY_FOLDER_H
#define REFDYN_TOOL_TEMPORARY_FOLDER_H

#include "system/interrupt.h"

#include <stdbool.h>
#include <stdio.h>
#include <sys/types.h>

/* mkdir -p: `mode` is that of the last one. False with errno when it is not there at the end. made, unless
 * NULL, becomes a list of those that were made, outermost first, which ends with NULL. */
bool folder_make(const char *path, mode_t mode, char ***made);
/* Removes those of the list that are empty; a signal's handler may call it. */
void folder_unmake(char **made);

/*
 * A temporary folder, and a group of processes that work in it. A guard, a process of its own, waits for the
 * end of this one, whatever ends it: then it kills the group and removes the folder. A lock on the folder
 * tells others that it is in use; folders that nobody has locked are what a guard that was killed, too, has
 * left.
 */
struct scratch {
    char *path;
    pid_t group; /* of the processes: a process that only sleeps leads it */
    pid_t guard;
    int lock, life; /* descriptors: of the folder, and the end of a connection with the guard */
    struct undo undo;
};

/* Makes PREFIXxxxxxx in folder `parent`, and removes what is left of dead ones there. Complains on stderr. */
bool scratch_open(struct scratch *scratch, const char *parent, const char *prefix);
/* Kills what still runs in it and removes it. */
void scratch_close(struct scratch *scratch);
/* The path of a file in it. */
const char *scratch_file(const struct scratch *scratch, const char *name);
/* Writes a file in it; complains on stderr when it cannot. */
bool scratch_write(const struct scratch *scratch, const char *name, const char *text, size_t length);
/* What a file holds goes to `out`. False with errno when it cannot be read. */
bool file_copy(const char *path, FILE *out);
/* $TMPDIR, or /tmp. */
const char *scratch_parent(void);

#endif
