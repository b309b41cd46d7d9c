/*
 * The files that a command writes: opened before the work, so that what cannot be written is said first, and
 * complete under their names at the end, or not there.
 *
 * A file grows as NAME.part, which is locked: two programs never write one file. A link is followed, so that
 * it stays a link. What is no plain file (/dev/null, a pipe) is written itself. No output may be a file that
 * the command reads, or another of its outputs, under whatever name.
 */
#ifndef REFDYN_TOOL_OUTPUT_FILE_H
#define REFDYN_TOOL_OUTPUT_FILE_H

#include "system/interrupt.h"

#include <stdio.h>

struct target {
    FILE *file; /* the work writes here; NULL once it is closed */
    char *name; /* as the user gave it; "stdout" */
    char *path; /* where it will be; NULL: it is written itself */
    char *part;
    int lock;     /* of the part, kept until it has its name: nobody writes it in between; -1: none */
    bool is_used; /* by a command that came to its end: it stays, whole or in part */
    struct undo undo;
    struct target *next;
};

struct targets {
    struct target *first;
    char **spared; /* files that are read */
    int spared_count, spared_room;
    char **folders;   /* that were made for them; NULL: none */
    struct undo undo; /* of these */
};

/* No target may be this file. */
void targets_spare(struct targets *targets, const char *path);
/* Makes a folder for targets; complains on stderr when it cannot be. */
bool targets_make_folder(struct targets *targets, const char *path);
/* path NULL: stdout. NULL, with a complaint on stderr, when it cannot be written. */
struct target *target_open(struct targets *targets, const char *path);
/* From now on what is in it stays as NAME.part, whatever ends the program. */
void target_keep_part(struct target *target);
/* It does not: nothing is in it. */
void target_drop_part(struct target *target);
/* Writes a text to the disk, before anything has its name. False: not all could be written, as is told. */
bool target_write(struct target *target, const char *text, size_t length);
/* Closes it and gives it its name. Complains on stderr and returns false when not all could be written. */
bool target_finish(struct target *target);
/* Closes it and leaves NAME.part as it is. Complains when not all could be written. */
bool target_close_part(struct target *target);
/* Removes what was not finished or kept, and folders that were made for nothing. */
void targets_release(struct targets *targets);

#endif
