/*
 * Folders, and temporary folders in which other programs work.
 *
 * A signal that ends the program removes a temporary folder. SIGKILL leaves it: nobody holds its lock then,
 * and the next start removes it. A compiler that still runs in it comes to its own end.
 */
#define _GNU_SOURCE /* nftw */
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <libgen.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { RANDOM_LENGTH = 6, TRIES = 100, DESCRIPTORS = 8 };

bool system_make_folder(const char *path, mode_t mode, char ***made) {
    char **list = format_allocate(strlen(path) + 2, sizeof *list);
    char *part = format_text("%s", path);
    int count = 0;
    for (char *slash = strchr(part + (*part != '\0'), '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        if (mkdir(part, 0777) == 0)
            list[count++] = format_text("%s", part);
        *slash = '/';
    }
    if (mkdir(part, mode) == 0)
        list[count++] = format_text("%s", part);
    const int reason = errno;
    struct stat status;
    const bool is_there = stat(part, &status) == 0 && S_ISDIR(status.st_mode);
    if (made && is_there)
        *made = list;
    errno = reason;
    return is_there;
}

void system_unmake_folder(char **made) {
    int count = 0;
    while (made && made[count])
        count++;
    while (count > 0)
        rmdir(made[--count]); /* fails for a folder that is not empty, as it should */
}

char *system_shared_path(const char *name) {
    char *program = realpath("/proc/self/exe", NULL);
    char *real =
        program ? realpath(format_text("%s/" REFDYN_DATA_FROM_PROGRAM "/%s", dirname(program), name), NULL)
                : NULL;
    char *path = real ? format_text("%s", real) : NULL;
    free(program);
    free(real);
    return path;
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

/* Opens and locks a folder that is no link. Returns -1 if it is missing, belongs to another user, or is in
 * use; errno is EWOULDBLOCK in the last case alone. */
static int lock_folder(const char *path) {
    struct stat status, now;
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0)
        return -1;
    errno = 0;
    if (fstat(folder, &status) == 0 && status.st_uid == geteuid() && flock(folder, LOCK_EX | LOCK_NB) == 0 &&
        stat(path, &now) == 0 && now.st_ino == status.st_ino && now.st_dev == status.st_dev)
        return folder;
    const int reason = errno;
    close(folder);
    errno = reason;
    return -1;
}

void system_scratch_remove_dead(const char *parent, const char *prefix) {
    const size_t length = strlen(prefix);
    DIR *folder = opendir(parent);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        if (strncmp(entry->d_name, prefix, length) != 0 || strlen(entry->d_name) != length + RANDOM_LENGTH)
            continue;
        char *path = format_text("%s/%s", parent, entry->d_name);
        const int lock = lock_folder(path);
        if (lock >= 0) {
            remove_tree(path);
            close(lock);
        }
    }
    if (folder)
        closedir(folder);
}

/* Makes a folder and locks it. Tries again if another program removed it as abandoned before it was locked.
 */
static bool make_locked(struct scratch *scratch, const char *parent, const char *prefix) {
    for (int i = 0; i < TRIES; i++) {
        scratch->path = format_text("%s/%sXXXXXX", parent, prefix);
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

/* A signal ends the program. Its handler may not format_allocate, so that another program removes the folder.
 */
static void undo_scratch(void *what) {
    const struct scratch *scratch = what;
    system_process_kill_all();
    const pid_t remover = fork();
    if (remover == 0) {
        execl("/bin/rm", "rm", "-rf", "--", scratch->path, (char *)NULL);
        _exit(1);
    }
    while (remover > 0 && waitpid(remover, NULL, 0) < 0 && errno == EINTR)
        continue;
}

bool system_scratch_open(struct scratch *scratch, const char *parent, const char *prefix) {
    sigset_t before;
    *scratch = (struct scratch){.lock = -1};
    char *folder = realpath(parent, NULL); /* an absolute path, so that no name begins like an option */
    if (folder)
        system_scratch_remove_dead(folder, prefix);
    system_interrupt_hold(&before);
    const bool is_open = folder && make_locked(scratch, folder, prefix);
    if (is_open)
        system_undo_add(&scratch->undo, undo_scratch, scratch);
    else
        format_complain("refdyn: %s: cannot make a temporary folder: %s\n", parent, strerror(errno));
    system_interrupt_release(&before);
    free(folder);
    return is_open;
}

/* Makes and locks a folder with a certain name; repeats it if another program removes it before it is locked.
 */
static enum scratch_claim claim(struct scratch *scratch) {
    for (int i = 0; i < TRIES; i++) {
        if (mkdir(scratch->path, 0700) != 0 && errno != EEXIST)
            return SCRATCH_IMPOSSIBLE;
        scratch->lock = lock_folder(scratch->path);
        if (scratch->lock >= 0)
            return SCRATCH_CLAIMED;
        if (errno == EWOULDBLOCK)
            return SCRATCH_BUSY;
    }
    return SCRATCH_IMPOSSIBLE;
}

enum scratch_claim system_scratch_claim(struct scratch *scratch, const char *parent, const char *prefix,
                                        const char *key) {
    sigset_t before;
    *scratch =
        (struct scratch){.path = format_text("%s/%s%.*s", parent, prefix, RANDOM_LENGTH, key), .lock = -1};
    system_interrupt_hold(&before);
    const enum scratch_claim claimed = claim(scratch);
    if (claimed == SCRATCH_CLAIMED)
        system_undo_add(&scratch->undo, undo_scratch, scratch);
    else
        scratch->path = NULL;
    system_interrupt_release(&before);
    return claimed;
}

void system_scratch_close(struct scratch *scratch) {
    system_process_kill_all(); /* after a noted signal, which ends the wait for a compiler */
    remove_tree(scratch->path);
    system_undo_forget(&scratch->undo);
    close(scratch->lock);
}

const char *system_scratch_file(const struct scratch *scratch, const char *name) {
    return format_text("%s/%s", scratch->path, name);
}

bool system_scratch_write(const struct scratch *scratch, const char *name, const char *text, size_t length) {
    const char *path = system_scratch_file(scratch, name);
    FILE *file = fopen(path, "w");
    bool is_good = file && fwrite(text, 1, length, file) == length;
    is_good = file && fclose(file) == 0 && is_good;
    if (!is_good)
        format_complain("refdyn: %s: cannot be written: %s\n", path, strerror(errno));
    return is_good;
}

bool system_copy_file(const char *path, FILE *out) {
    FILE *file = fopen(path, "rb");
    for (int c; file && (c = getc(file)) != EOF;)
        putc(c, out);
    const bool is_good = file && !ferror(file);
    if (file)
        fclose(file);
    return is_good;
}

const char *system_scratch_parent(void) {
    const char *folder = getenv("TMPDIR");
    return folder && *folder ? folder : "/tmp";
}
