/*
 * The scripts of a batch that Slurm computes, for people to read and to edit.
 *
 * chunk.sh is what each task of the array runs: `refdyn batch --cases A:B --resume` into the chunk's part. A
 * task that ends badly puts itself back into the queue a few times. merge.sh joins the parts when all tasks
 * have ended, or tells which are missing.
 */
#ifndef REFDYN_TOOL_SLURM_SCRIPTS_H
#define REFDYN_TOOL_SLURM_SCRIPTS_H

#include "command_line/options.h"
#include "slurm/slurm_folder.h"

/* Both, into the folder. `options` are those of the command line. False, with a complaint on stderr. */
bool slurm_scripts_write(const struct slurm_folder *folder, const struct options *options);

#endif
