/*
 * RUNS.h5.slurm, the folder of a batch that Slurm computes: the scripts, what each chunk has done, and a
 * record of what was submitted.
 *
 *   submitted.txt             of what batch the folder is, its chunks, its jobs; locked while a program looks
 *   chunk.sh merge.sh         what the jobs run (slurm_scripts.h)
 *   part_K.h5 part_K.h5.journal   the cases of chunk K
 *   chunk_K.txt merge.txt     what the jobs said
 *   merged                    is there once RUNS.h5 is complete
 */
#ifndef REFDYN_TOOL_SLURM_FOLDER_H
#define REFDYN_TOOL_SLURM_FOLDER_H

#include "batch/journal.h"

/* The cases [first, end) in `count` chunks of equal length, give or take one case. */
struct chunks {
    long first, end, count;
};

/* The first case of a chunk; that of chunk number `count` is the end. */
long chunks_start(const struct chunks *chunks, long chunk);

struct slurm_folder {
    char *path; /* absolute */
    int file;   /* of submitted.txt, locked; -1: not open */
    struct journal_key key;
    struct chunks chunks; /* count 0: nothing was submitted yet */
    long array, merge;    /* numbers of the jobs, 0: there is none */
};

/* Opens or makes the folder of a result, and reads what was submitted. False, with a complaint on stderr;
 * slurm_folder_close in any case. */
bool slurm_folder_open(struct slurm_folder *folder, const char *result);
/* Writes submitted.txt. False, with a complaint. */
bool slurm_folder_write(struct slurm_folder *folder);
/* A file of the folder, as printf names it. */
char *slurm_folder_name(const struct slurm_folder *folder, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void slurm_folder_close(struct slurm_folder *folder);

/* The path from the root: what is not there yet has one, too. */
char *path_from_root(const char *path);

#endif
