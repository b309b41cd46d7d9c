/* Folders: see system.h. */
#define _GNU_SOURCE /* closefrom, nftw */
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { RANDOM_LENGTH = 6, TRIES = 100, DESCRIPTORS = 8 };

bool folder_make(const char *path, mode_t mode, char ***made) {
    char **list = allocate(strlen(path) + 2, sizeof *list);
    char *part = text_format("%s", path);
    int count = 0;
    for (char *slash = strchr(part + (*part != '\0'), '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        if (mkdir(part, 0777) == 0)
            list[count++] = text_format("%s", part);
        *slash = '/';
    }
    if (mkdir(part, mode) == 0)
        list[count++] = text_format("%s", part);
    const int reason = errno;
    struct stat status;
    const bool is_there = stat(part, &status) == 0 && S_ISDIR(status.st_mode);
    if (made && is_there)
        *made = list;
    errno = reason;
    return is_there;
}

void folder_unmake(char **made) {
    int count = 0;
    while (made && made[count])
        count++;
    while (count > 0)
        rmdir(made[--count]); /* fails where something is in it, as it should */
}

/* ---- Temporary folders ---- */

static int remove_entry(const char *path, const struct stat *status, int kind, struct FTW *place) {
    (void)status, (void)kind, (void)place;
    remove(path);
    return 0;
}

static void remove_tree(const char *path) {
    nftw(path, remove_entry, DESCRIPTORS, FTW_DEPTH | FTW_PHYS);
}

/* Opens a folder that is no link and takes its lock; -1: it is not there, not this user's, or in use. */
static int lock_folder(const char *path) {
    struct stat status, now;
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0)
        return -1;
    if (fstat(folder, &status) == 0 && status.st_uid == geteuid() && flock(folder, LOCK_EX | LOCK_NB) == 0 &&
        stat(path, &now) == 0 && now.st_ino == status.st_ino && now.st_dev == status.st_dev)
        return folder;
    close(folder);
    return -1;
}

static void remove_dead(const char *parent, const char *prefix) {
    const size_t length = strlen(prefix);
    DIR *folder = opendir(parent);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        if (strncmp(entry->d_name, prefix, length) != 0 || strlen(entry->d_name) != length + RANDOM_LENGTH)
            continue;
        char *path = text_format("%s/%s", parent, entry->d_name);
        const int lock = lock_folder(path);
        if (lock >= 0) {
            remove_tree(path);
            close(lock);
        }
    }
    if (folder)
        closedir(folder);
}

/* A new folder and its lock; again, when somebody took it for a dead one before it was locked. */
static bool make_locked(struct scratch *scratch, const char *parent, const char *prefix) {
    for (int i = 0; i < TRIES; i++) {
        scratch->path = text_format("%s/%sXXXXXX", parent, prefix);
        if (!mkdtemp(scratch->path))
            return false;
        scratch->lock = lock_folder(scratch->path);
        if (scratch->lock >= 0)
            return true;
        rmdir(scratch->path);
        errno = ENOLCK;
    }
    return false;
}

/* ---- The guard ---- */

/* Signals that end other processes do not end the guard. */
static void ignore_signals(void) {
    static const int ignored[] = {SIGHUP, SIGINT, SIGPIPE, SIGQUIT, SIGTERM, SIGXCPU, SIGXFSZ};
    for (size_t i = 0; i < sizeof ignored / sizeof ignored[0]; i++)
        signal(ignored[i], SIG_IGN);
}

/* Leads the group, so that its number stays taken as long as it may be killed; goes with the guard. */
static _Noreturn void sleep_forever(pid_t guard) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    closefrom(0);
    while (getppid() == guard)
        pause();
    _exit(0);
}

/* Starts the leader; its number, -1: there is none. */
static pid_t start_leader(void) {
    const pid_t guard = getpid(), leader = fork();
    if (leader == 0)
        sleep_forever(guard);
    if (leader > 0)
        setpgid(leader, leader); /* before anybody is put into it, or kills it */
    return leader;
}

/* The connection ends when the last one that holds its other end is gone. */
static _Noreturn void keep_watch(const char *path, int connection) {
    char nothing;
    setpgid(0, 0);
    ignore_signals();
    const pid_t group = start_leader();
    if (write(connection, &group, sizeof group) < 0)
        errno = 0; /* the program is gone, which is seen next */
    dup2(connection, STDIN_FILENO);
    closefrom(STDIN_FILENO + 1);
    while (read(STDIN_FILENO, &nothing, 1) < 0 && errno == EINTR)
        continue;
    if (group > 0) {
        kill(-group, SIGKILL);
        waitpid(group, NULL, 0);
    }
    remove_tree(path);
    _exit(0);
}

/* What the guard has started as leader of the group; -1: it is gone or could not. */
static pid_t read_group(int connection) {
    pid_t group = -1;
    ssize_t length;
    while ((length = read(connection, &group, sizeof group)) < 0 && errno == EINTR)
        continue;
    return length == sizeof group ? group : -1;
}

/* The guard comes first, so that nothing else is ever without it. */
static bool start_guard(struct scratch *scratch) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return false;
    scratch->life = ends[0];
    scratch->guard = fork();
    if (scratch->guard == 0)
        keep_watch(scratch->path, ends[1]);
    close(ends[1]);
    scratch->group = scratch->guard > 0 ? read_group(scratch->life) : -1;
    if (scratch->guard > 0 && scratch->group < 0)
        errno = EAGAIN; /* as fork said in the guard */
    return scratch->group > 0;
}

/* When a signal ends the program. */
static void undo_scratch(void *what) {
    struct scratch *scratch = what;
    close(scratch->life);
    while (waitpid(scratch->guard, NULL, 0) < 0 && errno == EINTR)
        continue;
}

/* The guard alone, or the empty folder. */
static void give_up(struct scratch *scratch) {
    if (scratch->guard > 0)
        undo_scratch(scratch);
    else if (scratch->life >= 0)
        close(scratch->life);
    if (scratch->lock >= 0) {
        rmdir(scratch->path);
        close(scratch->lock);
    }
}

bool scratch_open(struct scratch *scratch, const char *parent, const char *prefix) {
    sigset_t before;
    *scratch = (struct scratch){.lock = -1, .life = -1};
    char *folder = realpath(parent, NULL); /* from the root on: no name of it begins like an option */
    if (folder)
        remove_dead(folder, prefix);
    interrupt_hold(&before);
    const bool is_open = folder && make_locked(scratch, folder, prefix) && start_guard(scratch);
    if (is_open)
        undo_add(&scratch->undo, undo_scratch, scratch);
    else {
        fprintf(stderr, "refdyn: %s: cannot make a temporary folder: %s\n", parent, strerror(errno));
        give_up(scratch);
    }
    interrupt_release(&before);
    free(folder);
    return is_open;
}

void scratch_close(struct scratch *scratch) {
    undo_forget(&scratch->undo);
    undo_scratch(scratch);
    close(scratch->lock);
}

const char *scratch_file(const struct scratch *scratch, const char *name) {
    return text_format("%s/%s", scratch->path, name);
}

bool scratch_write(const struct scratch *scratch, const char *name, const char *text, size_t length) {
    const char *path = scratch_file(scratch, name);
    FILE *file = fopen(path, "w");
    bool is_good = file && fwrite(text, 1, length, file) == length;
    is_good = file && fclose(file) == 0 && is_good;
    if (!is_good)
        fprintf(stderr, "refdyn: %s: cannot be written: %s\n", path, strerror(errno));
    return is_good;
}

bool file_copy(const char *path, FILE *out) {
    FILE *file = fopen(path, "rb");
    for (int c; file && (c = getc(file)) != EOF;)
        putc(c, out);
    const bool is_good = file && !ferror(file);
    if (file)
        fclose(file);
    return is_good;
}

const char *scratch_parent(void) {
    const char *folder = getenv("TMPDIR");
    return folder && *folder ? folder : "/tmp";
}
