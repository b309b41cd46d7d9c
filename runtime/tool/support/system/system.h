/* What this folder offers. */
#ifndef REFDYN_TOOL_SYSTEM_H
#define REFDYN_TOOL_SYSTEM_H

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <sys/types.h>
#include <time.h>

/*
 * Signals that end the program: SIGHUP, SIGINT, SIGPIPE, SIGQUIT, SIGTERM, SIGXCPU, SIGXFSZ.
 *
 * Each ends the program at once, after what was begun is undone. While signals are deferred, as in a motion
 * whose rows are worth keeping, the first one is only noted; interrupt_finish ends the program by it. A
 * second one acts at once. Signals that the caller had ignored stay ignored, but for SIGCHLD, without
 * which compilers and converters would end unseen.
 */

/* The signal that was noted while signals were deferred, 0: none. */
extern volatile sig_atomic_t interrupted;

/* Something to be undone when a signal ends the program; `call` may use async-signal-safe functions alone. */
struct undo {
    void (*call)(void *what);
    void *what;
    struct undo *next;
};

/* At the start of the program. */
void interrupt_catch(void);
void interrupt_defer(bool is_deferred);
/* Whether one was noted and not yet accepted: what works for the program ends. */
bool interrupt_is_new(void);
/* It ended what it had to; what works from now on brings things in order. */
void interrupt_accept(void);
/* Until interrupt_release signals wait, so that what is begun and the way to undo it are one; `before` keeps
 * what waited before. */
void interrupt_hold(sigset_t *before);
void interrupt_release(const sigset_t *before);
void undo_add(struct undo *undo, void (*call)(void *what), void *what);
/* One that was not added, or is forgotten already, is no matter. */
void undo_forget(struct undo *undo);
/* Ends the program by the signal that was noted; returns when there was none. */
void interrupt_finish(void);

/*
 * The files that a command writes: opened before the work, so that what cannot be written is said first, and
 * complete under their names at the end, or not there.
 *
 * A file grows as NAME.part, which is locked: two programs never write one file. A link is followed, so that
 * it stays a link. What is no plain file (/dev/null, a pipe) is written itself. No output may be a file that
 * the command reads, or another of its outputs, under whatever name.
 */

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

/*
 * Folders: made with all that lead to them, and temporary ones in which other programs work.
 */

/* mkdir -p: `mode` is that of the last one. False with errno when it is not there at the end. made, unless
 * NULL, becomes a list of those that were made, outermost first, which ends with NULL. */
bool folder_make(const char *path, mode_t mode, char ***made);
/* Removes those of the list that are empty; a signal's handler may call it. */
void folder_unmake(char **made);

/*
 * A temporary folder, in which other programs work. A lock shows that it is in use. A signal that ends this
 * program kills the programs and removes the folder. After SIGKILL the folder stays, without its lock, until
 * the next start removes it.
 */
struct scratch {
    char *path;
    int lock; /* descriptor of the folder */
    struct undo undo;
};

/* Makes PREFIXxxxxxx in folder `parent`, and removes folders there that dead programs have left. Reports an
 * error on stderr. */
bool scratch_open(struct scratch *scratch, const char *parent, const char *prefix);
/* Kills programs that still run, and removes the folder. */
void scratch_close(struct scratch *scratch);
/* The path of a file in it. */
const char *scratch_file(const struct scratch *scratch, const char *name);
/* Writes a file in it; complains on stderr when it cannot. */
bool scratch_write(const struct scratch *scratch, const char *name, const char *text, size_t length);
/* What a file holds goes to `out`. False with errno when it cannot be read. */
bool file_copy(const char *path, FILE *out);
/* $TMPDIR, or /tmp. */
const char *scratch_parent(void);

/*
 * Other programs, started without a shell. The wait for them returns what they used. Each program that works
 * in a temporary folder leads a process group, so that it ends with all that it has started.
 */

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
/* Kills the programs in temporary folders, and waits for their ends. A signal handler may call it. */
void process_kill_all(void);

/*
 * A progress bar on stderr, when that is a terminal and the work takes over a second.
 */

struct progress {
    const char *what;
    double started, drawn; /* wall seconds */
    bool is_terminal, is_shown;
};

void progress_start(struct progress *progress, const char *what);
/* Would it be drawn now? Then what stands before the bar is worth being written. */
bool progress_is_due(const struct progress *progress);
/* Draws it where it is due. fraction: 0 to 1 */
void progress_show(struct progress *progress, double fraction);
void progress_end(struct progress *progress);

/* Clocks, in seconds. */

static inline double clock_seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline double wall_seconds(void) {
    return clock_seconds(CLOCK_MONOTONIC);
}

/* Processor time of all threads of the program. */
static inline double process_cpu_seconds(void) {
    return clock_seconds(CLOCK_PROCESS_CPUTIME_ID);
}

/* Of the calling thread alone. */
static inline double cpu_seconds(void) {
    return clock_seconds(CLOCK_THREAD_CPUTIME_ID);
}

#endif
