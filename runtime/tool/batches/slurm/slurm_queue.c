/* The programs of Slurm: see slurm.h. */
#define _GNU_SOURCE
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- A program and what it says ---- */

static bool complain(const char *program, char *said) {
    said[strcspn(said, "\n")] = '\0'; /* the first line has the cause */
    fprintf(stderr, "refdyn: %s failed%s", program, *said ? ": " : "");
    put_plain_text(stderr, said);
    fputc('\n', stderr);
    return false;
}

static bool run_into(const char *const *argv, const char *output, const char *errors) {
    struct process process;
    const int error = process_start(&process, NULL, argv, NULL, output, errors);
    if (error) {
        fprintf(stderr, "refdyn: %s cannot be started: %s\n", argv[0], strerror(error));
        return false;
    }
    if (process_wait(&process, 1) == 0 && process.result == 0)
        return true;
    char *said = read_text(errors, argv[0]);
    if (said)
        complain(argv[0], said);
    return false;
}

/* What the program prints; NULL: it failed, as is told. */
static char *run(const struct slurm_folder *folder, const char *const *argv) {
    char *output = slurm_folder_name(folder, ".%s.out", argv[0]);
    char *errors = slurm_folder_name(folder, ".%s.err", argv[0]);
    char *said = run_into(argv, output, errors) ? read_text(output, argv[0]) : NULL;
    unlink(output);
    unlink(errors);
    return said;
}

/* ---- Jobs ---- */

/* sbatch --parsable prints NUMBER or NUMBER;CLUSTER. */
static long job_number(char *said) {
    char *rest;
    const long job = strtol(said, &rest, 10);
    if (job > 0 && (*rest == ';' || *rest == '\n' || *rest == '\0'))
        return job;
    complain("sbatch printed no number of a job and", said);
    return 0;
}

long slurm_submit(const struct slurm_folder *folder, const char *words, const char *option,
                  const char *script) {
    char *copy = text_format("%s", words ? words : ""), *rest;
    char *chdir = text_format("--chdir=%s", folder->path), *path = slurm_folder_name(folder, "%s", script);
    const char **argv = allocate(strlen(copy) / 2 + 8, sizeof *argv);
    int count = 0;
    argv[count++] = "sbatch";
    for (char *word = strtok_r(copy, " \t\n", &rest); word; word = strtok_r(NULL, " \t\n", &rest))
        argv[count++] = word;
    argv[count++] = "--parsable";
    argv[count++] = chdir;
    if (option)
        argv[count++] = option;
    argv[count++] = path;
    char *said = run(folder, argv);
    return said ? job_number(said) : 0;
}

/* The user's jobs are looked through, since squeue fails for the number of a job that is forgotten. */
bool slurm_ask(const struct slurm_folder *folder, bool *is_running) {
    char *user = text_format("--user=%ld", (long)getuid());
    const char *const argv[] = {"squeue", "--noheader", "--format=%F", user, NULL};
    char *said = run(folder, argv), *at = said, *end;
    *is_running = false;
    for (long job; said && (job = strtol(at, &end, 10)) > 0; at = end)
        *is_running = *is_running || job == folder->array || job == folder->merge;
    return said != NULL;
}

void slurm_cancel(const struct slurm_folder *folder, long job) {
    char *number = text_format("%ld", job);
    const char *const argv[] = {"scancel", number, NULL};
    run(folder, argv);
}
