/* Other programs: found along PATH, started with posix_spawn, waited for, killed with the program; and a part
 * of this program in the background. */
#define _DEFAULT_SOURCE /* wait4 */
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;

static bool is_program(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && S_ISREG(status.st_mode) && access(path, X_OK) == 0;
}

char *system_process_find(const char *name) {
    const char *path = strchr(name, '/') ? "" : getenv("PATH");
    if (strchr(name, '/') && is_program(name))
        return format_text("%s", name);
    while (path && *path && *name) {
        const size_t length = strcspn(path, ":");
        char *file = length ? format_text("%.*s/%s", (int)length, path, name) : format_text("./%s", name);
        if (is_program(file))
            return file;
        path += length + (path[length] == ':');
    }
    return NULL;
}

/* Standard input, output and errors. */
static int redirect(posix_spawn_file_actions_t *actions, const char *input, const char *output,
                    const char *errors) {
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    int error =
        posix_spawn_file_actions_addopen(actions, STDIN_FILENO, input ? input : "/dev/null", O_RDONLY, 0);
    if (!error)
        error = posix_spawn_file_actions_addopen(actions, STDOUT_FILENO, output, flags, 0666);
    if (!error && errors)
        error = posix_spawn_file_actions_addopen(actions, STDERR_FILENO, errors, flags, 0666);
    if (!error && !errors)
        error = posix_spawn_file_actions_adddup2(actions, STDOUT_FILENO, STDERR_FILENO);
    return error;
}

/* With SIGPIPE as programs expect it, and in a folder as leader of a group. No signal is held. */
static int set_attributes(posix_spawnattr_t *attributes, const struct scratch *scratch,
                          const sigset_t *mask) {
    const int flags = POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | (scratch ? POSIX_SPAWN_SETPGROUP : 0);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE);
    int error = posix_spawnattr_setpgroup(attributes, 0);
    if (!error)
        error = posix_spawnattr_setsigmask(attributes, mask);
    if (!error)
        error = posix_spawnattr_setsigdefault(attributes, &defaults);
    if (!error)
        error = posix_spawnattr_setflags(attributes, (short)flags);
    return error;
}

/* This environment with TMPDIR=folder. */
static char **make_environment(const char *folder) {
    static const char name[] = "TMPDIR=";
    int count = 0, kept = 0;
    while (environ[count])
        count++;
    char **list = format_allocate((size_t)count + 2, sizeof *list);
    list[kept++] = format_text("%s%s", name, folder);
    for (int i = 0; i < count; i++)
        if (strncmp(environ[i], name, strlen(name)) != 0)
            list[kept++] = environ[i];
    return list;
}

/* ---- Programs in temporary folders ---- */

enum { RUNNING_MOST = 8 };
static volatile pid_t running[RUNNING_MOST]; /* 0: a free place */

static void replace_running(pid_t old, pid_t new) {
    for (int i = 0; i < RUNNING_MOST; i++)
        if (running[i] == old) {
            running[i] = new;
            return;
        }
}

void system_process_kill_all(void) {
    for (int i = 0; i < RUNNING_MOST; i++) {
        const pid_t leader = running[i];
        if (leader == 0)
            continue;
        kill(-leader, SIGKILL);
        while (waitpid(leader, NULL, 0) < 0 && errno == EINTR)
            continue;
        running[i] = 0;
    }
}

/* ---- Start and end ---- */

static int spawn(struct process *process, const struct scratch *scratch, const char *const *argv,
                 const posix_spawn_file_actions_t *actions) {
    posix_spawnattr_t attributes;
    sigset_t before;
    int error = posix_spawnattr_init(&attributes);
    if (error)
        return error;
    system_interrupt_hold(&before);
    error = set_attributes(&attributes, scratch, &before);
    if (!error) /* posix_spawnp does not write to argv */
        error = posix_spawnp(&process->pid, argv[0], actions, &attributes, (char *const *)argv,
                             scratch ? make_environment(scratch->path) : environ);
    if (!error && scratch)
        replace_running(0, process->pid);
    system_interrupt_release(&before);
    posix_spawnattr_destroy(&attributes);
    return error;
}

int system_process_start(struct process *process, const struct scratch *scratch, const char *const *argv,
                         const char *input, const char *output, const char *errors) {
    posix_spawn_file_actions_t actions;
    int error = posix_spawn_file_actions_init(&actions);
    if (error)
        return error;
    *process = (struct process){.pid = 0};
    error = redirect(&actions, input, output, errors);
    if (!error)
        error = spawn(process, scratch, argv, &actions);
    if (error)
        *process = (struct process){.pid = 0, .result = 127};
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

static int find(const struct process *processes, int count, pid_t pid) {
    for (int i = 0; i < count; i++)
        if (processes[i].pid == pid)
            return i;
    return -1;
}

static bool has_running(const struct process *processes, int count) {
    for (int i = 0; i < count; i++)
        if (processes[i].pid > 0)
            return true;
    return false;
}

/* Polls, because a signal that comes just before a blocking call would not end that call. */
int system_process_wait(struct process *processes, int count, struct notice *notice) {
    const struct timespec pause = {.tv_nsec = 2000000}; /* short compared with any of these programs */
    while (has_running(processes, count) && !system_interrupt_is_new()) {
        int status;
        struct rusage usage;
        sigset_t before;
        system_interrupt_hold(&before);
        const pid_t pid = wait4(-1, &status, WNOHANG, &usage);
        if (pid > 0)
            replace_running(pid, 0);
        system_interrupt_release(&before);
        const int i = pid > 0 ? find(processes, count, pid) : -1;
        if (pid < 0)
            return -1;
        if (pid == 0 && notice)
            system_notice_show(notice);
        if (pid == 0)
            nanosleep(&pause, NULL);
        if (i < 0)
            continue;
        processes[i].pid = 0;
        processes[i].result = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        processes[i].peak_kb = usage.ru_maxrss;
        return i;
    }
    return -1;
}

/* ---- Parts of this program ---- */

pid_t system_process_fork(void) {
    sigset_t before;
    system_interrupt_hold(&before);
    const pid_t pid = fork();
    if (pid == 0) {
        system_undo_forget_all();
        for (int i = 0; i < RUNNING_MOST; i++)
            running[i] = 0;
    }
    system_interrupt_release(&before);
    return pid;
}

enum { NICENESS = 5 /* a third of the share of other processes: somebody may wait for the result */ };

/* Standard descriptors lead nowhere; all others but `kept` are closed, so that locks and pipes of the program
 * end with it. */
void system_process_leave_descriptors(int kept) {
    const int nowhere = open("/dev/null", O_RDWR);
    DIR *list = opendir("/proc/self/fd");
    for (int i = STDIN_FILENO; nowhere >= 0 && i <= STDERR_FILENO; i++)
        dup2(nowhere, i);
    for (struct dirent *entry; list && (entry = readdir(list));) {
        const int file = atoi(entry->d_name);
        if (file > STDERR_FILENO && file != dirfd(list) && file != kept)
            close(file);
    }
    if (list)
        closedir(list);
}

/* A fork keeps the descriptors of this program, and with them its locks, until it closes them. The pipe lets
 * this program wait until then: reading returns when no process has the pipe open for writing. */
void system_process_start_background(void (*work)(void *what), void *what) {
    int ends[2];
    if (pipe(ends) != 0)
        return;
    const pid_t child = system_process_fork();
    if (child == 0) {
        setsid();
        setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + NICENESS);
        system_process_leave_descriptors(ends[1]);
        close(ends[1]);
        work(what);
        _exit(0);
    }
    char none;
    close(ends[1]);
    while (read(ends[0], &none, 1) < 0 && errno == EINTR)
        continue;
    close(ends[0]);
}
