/* Batches on a cluster that Slurm manages: the folder of what was submitted; the scripts of its jobs. */
#ifndef REFDYN_TOOL_SLURM_H
#define REFDYN_TOOL_SLURM_H

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/options/options.h"

/* The folder RUNS.h5.slurm has the scripts, the results of each chunk, and a record of what was submitted. */

/* The cases [first, end) in `count` chunks, whose lengths differ by at most one case. */
struct chunks {
    long first, end, count;
};

/* The first case of a chunk; chunk number `count` starts at the end. */
long slurm_chunks_start(const struct chunks *chunks, long chunk);

struct slurm_folder {
    char *path; /* absolute */
    int file;   /* of submitted.txt, locked; -1: not open */
    struct journal_key key;
    struct chunks chunks; /* count 0: nothing has been submitted */
    long array, merge;    /* numbers of the jobs, 0 if there is none */
};

/* Opens or creates the folder of a result, and reads what was submitted. Returns false and reports errors on
 * stderr; call slurm_folder_close in any case. */
bool slurm_folder_open(struct slurm_folder *folder, const char *result);
/* Writes submitted.txt; returns false and reports the error if it cannot. */
bool slurm_folder_write(struct slurm_folder *folder);
/* The path of a file of the folder, whose name is formatted as by printf. */
char *slurm_folder_name(const struct slurm_folder *folder, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void slurm_folder_close(struct slurm_folder *folder);

/* The absolute path; the file need not exist. */
char *slurm_path_from_root(const char *path);

/* The scripts chunk.sh and merge.sh. */

/* Writes both into the folder, with the options of the command line. Returns false and reports errors on
 * stderr. */
bool slurm_scripts_write(const struct slurm_folder *folder, const struct options *options);

/* `refdyn batch`, with or without Slurm. */
extern const struct command batch_command;

#endif
