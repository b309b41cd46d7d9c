/*
 * The programs of Slurm that a submission needs: sbatch, squeue and scancel, as PATH finds them.
 *
 * All functions complain on stderr, with what the program said.
 */
#ifndef REFDYN_TOOL_SLURM_QUEUE_H
#define REFDYN_TOOL_SLURM_QUEUE_H

#include "slurm/slurm_folder.h"

/* Submits a script of the folder with the options of sbatch `words`, blanks between (NULL: none), and one
 * more (NULL: none). The number of the job, 0: it was refused. */
long slurm_submit(const struct slurm_folder *folder, const char *words, const char *option,
                  const char *script);
/* Sets *is_running: is one of the folder's jobs still in the queue? False: the queue did not answer. */
bool slurm_ask(const struct slurm_folder *folder, bool *is_running);
void slurm_cancel(const struct slurm_folder *folder, long job);

#endif
