/* Runs of a compiler: see compile.h. No shell is involved, so any path will do. */
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>

enum { PROCESSES = 2 };

void job_add_word(struct job *job, const char *word) {
    job->argv = memory_room(&program_memory, job->argv, job->argc + 1, &job->room, sizeof *job->argv);
    job->argv[job->argc++] = word;
}

void job_add_words(struct job *job, const char *const *words) {
    for (; *words; words++)
        job_add_word(job, *words);
}

static void show_log(const struct job *job) {
    fputs("refdyn: the compiler failed:", stderr);
    for (int i = 0; i < job->argc; i++)
        fprintf(stderr, " %s", job->argv[i]);
    fputc('\n', stderr);
    file_copy(job->log, stderr);
}

static bool start(struct process *process, const struct scratch *scratch, const struct job *job) {
    const int error = process_start(process, scratch, job->argv, NULL, job->log, NULL);
    if (error)
        fprintf(stderr, "refdyn: the compiler '%s' could not be started: %s\n", job->argv[0],
                strerror(error));
    return error == 0;
}

bool jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb) {
    struct process running[PROCESSES] = {{.pid = 0}};
    const struct job *of[PROCESSES] = {NULL};
    bool is_good = true;
    for (int next = 0, active = 0; active > 0 || (is_good && next < count);) {
        while (is_good && next < count && active < PROCESSES) {
            int free_place = running[0].pid == 0 ? 0 : 1;
            of[free_place] = &jobs[next++];
            is_good = start(&running[free_place], scratch, of[free_place]);
            active += is_good;
        }
        int done = active ? process_wait(running, PROCESSES) : -1;
        if (done < 0)
            return false;
        active--;
        if (running[done].result != 0) {
            show_log(of[done]);
            is_good = false;
        }
        if (running[done].peak_kb > *peak_kb)
            *peak_kb = running[done].peak_kb;
    }
    return is_good;
}
