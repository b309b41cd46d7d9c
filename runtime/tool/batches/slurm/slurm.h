/* What this folder offers. */
#ifndef REFDYN_TOOL_SLURM_H
#define REFDYN_TOOL_SLURM_H

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/command_line/command_line.h"

/*
 * RUNS.h5.slurm, the folder of a batch that Slurm computes: the scripts, what each chunk has done, and a
 * record of what was submitted.
 *
 *   submitted.txt             of what batch the folder is, its chunks, its jobs; locked while a program looks
 *   chunk.sh merge.sh         what the jobs run (slurm.h)
 *   part_K.h5 part_K.h5.journal   the cases of chunk K
 *   chunk_K.txt merge.txt     what the jobs said
 *   merged                    is there once RUNS.h5 is complete
 */

/* The cases [first, end) in `count` chunks of equal length, give or take one case. */
struct chunks {
    long first, end, count;
};

/* The first case of a chunk; that of chunk number `count` is the end. */
long slurm_chunks_start(const struct chunks *chunks, long chunk);

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
char *slurm_path_from_root(const char *path);

/*
 * The programs of Slurm that a submission needs: sbatch, squeue and scancel, as PATH finds them.
 *
 * All functions complain on stderr, with what the program said.
 */

/* Submits a script of the folder with the options of sbatch `words`, blanks between (NULL: none), and one
 * more (NULL: none). The number of the job, 0: it was refused. */
long slurm_submit(const struct slurm_folder *folder, const char *words, const char *option,
                  const char *script);
/* Sets *is_running: is one of the folder's jobs still in the queue? False: the queue did not answer. */
bool slurm_ask(const struct slurm_folder *folder, bool *is_running);
void slurm_cancel(const struct slurm_folder *folder, long job);

/*
 * The scripts of a batch that Slurm computes, for people to read and to edit.
 *
 * chunk.sh is what each task of the array runs: `refdyn batch --cases A:B --resume` into the chunk's part. A
 * task that ends badly puts itself back into the queue a few times. merge.sh joins the parts when all tasks
 * have ended, or tells which are missing.
 */

/* Both, into the folder. `options` are those of the command line. False, with a complaint on stderr. */
bool slurm_scripts_write(const struct slurm_folder *folder, const struct options *options);

/* `refdyn batch`, with or without Slurm. */
extern const struct command batch_command;

#endif
