/* What the program needs of the operating system: signals that end the program; files that a command writes;
 * folders; other programs; a progress bar; clocks. */
#ifndef REFDYN_TOOL_SYSTEM_H
#define REFDYN_TOOL_SYSTEM_H

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <sys/types.h>

/* Signals that end the program, after the program has undone what it began. While signals are deferred, as in
 * a motion whose rows are worth keeping, the first one is only noted; system_interrupt_finish then ends the
 * program by it. A second one acts at once. */

/* The signal that was noted while signals were deferred; 0 if there is none. */
extern volatile sig_atomic_t system_interrupted;

/* Something to undo when a signal ends the program. `call` may use async-signal-safe functions only. */
struct undo {
    void (*call)(void *what);
    void *what;
    struct undo *next;
};

/* Call it at the start of the program. */
void system_interrupt_catch(void);
void system_interrupt_defer(bool is_deferred);
/* Returns whether a signal is noted and not yet accepted. Programs that work for this one then end. */
bool system_interrupt_is_new(void);
/* Accepts the noted signal: this program has stopped its work, and programs that it starts from now on finish
 * it. */
void system_interrupt_accept(void);
/* Holds signals until system_interrupt_release, so that no signal comes between an action and the entry that
 * undoes it. `before` keeps the earlier signal mask. */
void system_interrupt_hold(sigset_t *before);
void system_interrupt_release(const sigset_t *before);
void system_undo_add(struct undo *undo, void (*call)(void *what), void *what);
/* Does nothing for an entry that was not added, or is already forgotten. */
void system_undo_forget(struct undo *undo);
/* Forgets all entries and the noted signal, in a process that has just been forked. */
void system_undo_forget_all(void);
/* Ends the program by the noted signal; returns if there is none. */
void system_interrupt_finish(void);

/* The files that a command writes. At the end they are complete under their names, or they are not there. No
 * output may be a file that the command reads, or another of its outputs, under any name. */

struct target {
    FILE *file; /* to write to; NULL once it is closed */
    char *name; /* as the user wrote it; "stdout" */
    char *path; /* the final path; NULL for a file that is written directly */
    char *part;
    int lock; /* descriptor of the part, open until the part has its final name, so that nobody else writes
                 it; -1: none */
    bool is_used; /* the command has finished with it: it stays, complete or as a part */
    struct undo undo;
    struct target *next;
};

struct targets {
    struct target *first;
    char **spared; /* paths of files that the command reads */
    int spared_count, spared_room;
    char **folders;   /* folders that were made for the targets; NULL: none */
    struct undo undo; /* for these folders */
};

/* Declares a file that the command reads: no target may be this file. Returns false if an open one is, which
 * it reports; targets that are opened later fail then. */
bool system_targets_spare(struct targets *targets, const char *path);
/* Makes a folder for targets; reports on stderr if it cannot. */
bool system_targets_make_folder(struct targets *targets, const char *path);
/* Opens a target; path NULL is stdout. Returns NULL and reports on stderr if it cannot be written. */
struct target *system_target_open(struct targets *targets, const char *path);
/* From now on the contents stay as NAME.part, however the program ends. */
void system_target_keep_part(struct target *target);
/* Reverses system_target_keep_part for a target that is still empty. */
void system_target_drop_part(struct target *target);
/* Writes a text to the disk, before any target gets its name. Returns false and reports it if not all could
 * be written. */
bool system_target_write(struct target *target, const char *text, size_t length);
/* Closes the file and gives it its final name. Returns false and reports on stderr if not all could be
 * written. */
bool system_target_finish(struct target *target);
/* Closes the file and leaves it as NAME.part. Returns false and reports it if not all could be written. */
bool system_target_close_part(struct target *target);
/* Removes targets that were neither finished nor kept, and the folders made for them. */
void system_targets_release(struct targets *targets);

/* As mkdir -p; `mode` applies to the last folder. Returns false with errno if the folder is not there at the
 * end. If made is not NULL, it becomes a list of the new folders, outermost first, NULL at the end. */
bool system_make_folder(const char *path, mode_t mode, char ***made);
/* Removes the empty folders of the list. A signal handler may call it. */
void system_unmake_folder(char **made);

/* The real path of a file or folder in share/refdyn of the build or installation that this program belongs
 * to; NULL if it is not there. */
char *system_shared_path(const char *name);

/* A temporary folder, in which other programs work. A signal that ends this program kills the programs and
 * removes the folder. After SIGKILL the folder stays until another program removes it. */
struct scratch {
    char *path;
    int lock; /* descriptor of the folder */
    struct undo undo;
};

/* Makes PREFIXxxxxxx in folder `parent`, and removes folders there that dead programs have left. Reports an
 * error on stderr. */
bool system_scratch_open(struct scratch *scratch, const char *parent, const char *prefix);
/* Removes the folders PREFIXxxxxxx in `parent` that dead programs have left. */
void system_scratch_remove_dead(const char *parent, const char *prefix);
/* A temporary folder whose name follows from `key`: only one program at a time has it. */
enum scratch_claim { SCRATCH_CLAIMED, SCRATCH_BUSY /* another program has it */, SCRATCH_IMPOSSIBLE };
/* Reports nothing. scratch->path is NULL unless it is claimed; then call system_scratch_close. */
enum scratch_claim system_scratch_claim(struct scratch *scratch, const char *parent, const char *prefix,
                                        const char *key);
/* Kills programs that still run, and removes the folder. */
void system_scratch_close(struct scratch *scratch);
/* The path of a file in it. */
const char *system_scratch_file(const struct scratch *scratch, const char *name);
/* Writes a file in the folder; reports on stderr if it cannot. */
bool system_scratch_write(const struct scratch *scratch, const char *name, const char *text, size_t length);
/* Copies a file to `out`. Returns false with errno if the file cannot be read. */
bool system_copy_file(const char *path, FILE *out);
/* $TMPDIR, or /tmp. */
const char *system_scratch_parent(void);

/* Other programs, started without a shell. Each that works in a temporary folder leads a process group, so
 * that it ends with all that it has started. */

struct process {
    pid_t pid;    /* 0 if it does not run */
    int result;   /* exit status; 128 + signal if it was killed; 127 if it could not be started */
    long peak_kb; /* largest memory of the program and its children */
};

/* The file of a program, found along PATH; NULL if there is none. */
char *system_process_find(const char *name);
/* Starts argv[0], found along PATH. Its temporary files go to the folder. If the folder is NULL, the program
 * has the unchanged environment and the group of this program. Standard input is file `input` (NULL: empty),
 * standard output goes to file `output`, standard error to file `errors` (NULL: the same file). Returns 0, or
 * errno if it could not be started. */
int system_process_start(struct process *process, const struct scratch *scratch, const char *const *argv,
                         const char *input, const char *output, const char *errors);
struct notice;
/* Waits until one of the programs ends and returns its index; -1 if none runs, or a new signal is noted.
 * Meanwhile it shows the notice, which may be NULL. */
int system_process_wait(struct process *processes, int count, struct notice *notice);
/* Kills the programs in temporary folders, and waits for their ends. A signal handler may call it. */
void system_process_kill_all(void);

/* Like fork. If a signal ends the child, it removes no files and kills no programs of the parent. */
pid_t system_process_fork(void);
/* In a process that has just been forked: closes all descriptors except `kept`, and with them the locks and
 * pipes of the program. Standard descriptors lead nowhere. */
void system_process_leave_descriptors(int kept);
/* Calls `work` in a process in the background, which ends afterwards: in its own session, with low priority,
 * without descriptors, output and temporary folders of this program. Returns when it has left them. Does
 * nothing if there can be no process. */
void system_process_start_background(void (*work)(void *what), void *what);

/* A line on stderr about what the program waits for, if stderr is a terminal and the wait takes more than
 * half a second. With REFDYN_NOTICES=1 it is a separate line on any stderr, for programs that read it. */

struct notice {
    const char *what;
    double started; /* wall clock [s] */
    bool is_terminal, is_shown;
};

void system_notice_start(struct notice *notice, const char *what);
/* Call it often while waiting. */
void system_notice_show(struct notice *notice);
/* Removes the line from the terminal. */
void system_notice_end(struct notice *notice);

/* A progress bar on stderr, if stderr is a terminal or REFDYN_PROGRESS is 1, and the work takes more than a
 * second. */

struct progress {
    const char *what;
    double started, drawn; /* wall clock [s] */
    bool is_drawn, is_shown;
};

void system_progress_start(struct progress *progress, const char *what);
/* Returns whether the bar would be drawn now. Until then, other output before the bar can wait. */
bool system_progress_is_due(const struct progress *progress);
/* Draws the bar if it is due; fraction from 0 to 1. */
void system_progress_show(struct progress *progress, double fraction);
void system_progress_end(struct progress *progress);

/* Processors that this process may use. */
int system_processors(void);

/* Clocks, in seconds: wall clock; processor time of all threads of the program, and of the calling thread. */
double system_wall_seconds(void);
double system_process_cpu_seconds(void);
double system_cpu_seconds(void);

#endif
