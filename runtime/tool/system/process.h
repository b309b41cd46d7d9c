/*
 * Other programs, without a shell: started in the group of a temporary folder, waited for with what they
 * used.
 */
#ifndef REFDYN_TOOL_PROCESS_H
#define REFDYN_TOOL_PROCESS_H

#include "system/temporary_folder.h"

#include <sys/types.h>

struct process {
    pid_t pid;    /* 0: not running */
    int result;   /* exit status; 128 + signal when killed; 127 when it could not be started */
    long peak_kb; /* largest memory of it and its children */
};

/* The file of a program as PATH finds it; NULL: there is none. */
char *process_find(const char *name);
/*
 * Starts argv[0], found along PATH; its own temporary files go to the folder. Without a folder (NULL) it has
 * this program's environment as it is, and its group. Standard input is file `input`
 * (NULL: empty), standard output goes to file `output`, standard error to file `errors` (NULL: to the same).
 * Returns 0, or errno when it could not be started.
 */
int process_start(struct process *process, const struct scratch *scratch, const char *const *argv,
                  const char *input, const char *output, const char *errors);
/* Waits until one of the running ones ends and returns its index, -1 when none runs or a new signal was
 * noted. */
int process_wait(struct process *processes, int count);

#endif
