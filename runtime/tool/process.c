/* Other programs: see process.h. */
#define _DEFAULT_SOURCE /* wait4 */
#include "process.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

int process_start(struct process *process, const char *const *argv, const char *input, const char *output,
                  const char *errors) {
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_t actions;
    int error = posix_spawn_file_actions_init(&actions);
    if (error)
        return error;
    error =
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, input ? input : "/dev/null", O_RDONLY, 0);
    if (!error)
        error = posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output, flags, 0666);
    if (!error && errors)
        error = posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors, flags, 0666);
    if (!error && !errors)
        error = posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    *process = (struct process){.pid = 0};
    if (!error) /* posix_spawnp does not write to argv */
        error = posix_spawnp(&process->pid, argv[0], &actions, NULL, (char *const *)argv, environ);
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

int process_wait(struct process *processes, int count) {
    for (;;) {
        int status;
        struct rusage usage;
        pid_t pid = wait4(-1, &status, 0, &usage);
        if (pid < 0 && errno == EINTR)
            continue;
        if (pid < 0)
            return -1;
        int i = find(processes, count, pid);
        if (i < 0)
            continue;
        processes[i].pid = 0;
        processes[i].result = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        processes[i].peak_kb = usage.ru_maxrss;
        return i;
    }
}
