/*
 * The files that a command writes.
 *
 * They are opened before the work, so that the user learns at once what cannot be written. Each grows as
 * NAME.part, which is locked, so that two programs never write one file, and gets its name when it is
 * complete. Links of this user and of root are followed and stay links; others could lead anywhere. A device,
 * such as /dev/null, is written directly.
 */
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LINKS_MOST = 40 /* as many links as Linux follows */, TRIES = 100 };

static bool refuse(const char *name, const char *fact) {
    format_plain_text(stderr, name);
    fprintf(stderr, ": output: %s\n", fact);
    return false;
}

static bool refuse_for(const char *name, const char *what) {
    return refuse(name, format_text("%s: %s", what, strerror(errno)));
}

/* ---- Where it will be ---- */

/* Returns the target of a link; NULL with errno. */
static char *follow(char *path) {
    char *text = format_allocate(PATH_MAX + 1, 1);
    if (readlink(path, text, PATH_MAX) < 0)
        return NULL;
    return *text == '/' ? text : format_text("%s/%s", dirname(path), text);
}

/* Links in these folders lead to open files, such as /dev/stdout, which have no name that could be replaced.
 */
static bool is_of_system(const char *path) {
    return strncmp(path, "/dev/", strlen("/dev/")) == 0 || strncmp(path, "/proc/", strlen("/proc/")) == 0;
}

/* A folder with the sticky bit, in which files belong to their users. */
static bool is_in_common_folder(const char *path, struct stat *folder) {
    return stat(dirname(format_text("%s", path)), folder) == 0 && (folder->st_mode & S_ISVTX);
}

static bool is_link_of_another(const char *path) {
    struct stat status;
    return lstat(path, &status) == 0 && S_ISLNK(status.st_mode) && status.st_uid != geteuid() &&
           status.st_uid != 0;
}

/* Returns whether a folder on the way to the file is another user's link in a common folder. The kernel may
 * be set to follow such links (sysctl fs.protected_symlinks). */
static bool passes_foreign_link(const char *path) {
    char *part = format_text("%s", path);
    for (char *slash = strchr(part, '/'); slash; slash = strchr(slash + 1, '/')) {
        struct stat folder;
        *slash = '\0';
        if (is_link_of_another(part) && is_in_common_folder(part, &folder))
            return true;
        *slash = '/';
    }
    return false;
}

/* Reports an error if a link of another user decides where the output goes. */
static bool check_links(const struct target *target, const char *path) {
    return !(is_link_of_another(path) || passes_foreign_link(path)) ||
           refuse(target->name, "is or passes through a link of another user; give another name");
}

/* Sets target->path, or leaves it NULL for a device, which is written directly. Returns the path; NULL, after
 * an error message, if it cannot be an output. */
static const char *find_path(struct target *target) {
    char *path = format_text("%s", target->name);
    struct stat status = {.st_mode = S_IFREG};
    bool is_good = check_links(target, path);
    for (int links = 0;
         is_good && lstat(path, &status) == 0 && S_ISLNK(status.st_mode) && !is_of_system(path); links++) {
        errno = ELOOP;
        path = links < LINKS_MOST ? follow(path) : NULL;
        is_good = path ? check_links(target, path) : refuse_for(target->name, "the link cannot be followed");
        status.st_mode = S_IFREG;
    }
    if (is_good && S_ISFIFO(status.st_mode))
        is_good = refuse(target->name, "is a named pipe; must be a file; -o /dev/stdout writes to a pipe");
    if (is_good && S_ISDIR(status.st_mode))
        is_good = refuse(target->name, "is a folder; must be a file");
    if (is_good && S_ISREG(status.st_mode))
        target->path = path;
    return is_good ? path : NULL;
}

/* Reports a file that renaming may not replace. */
static bool check_present(const struct target *target) {
    struct stat status, folder;
    if (stat(target->path, &status) != 0)
        return true;
    if (faccessat(AT_FDCWD, target->path, W_OK, AT_EACCESS) != 0)
        return refuse_for(target->name, "is there and may not be written");
    if (is_in_common_folder(target->path, &folder) && status.st_uid != geteuid() &&
        folder.st_uid != geteuid())
        return refuse(target->name, "is another user's, in a folder in which files belong to their users");
    return true;
}

/* ---- Files that are one ---- */

static bool is_file(const char *path, const struct stat *file) {
    struct stat status;
    return path && stat(path, &status) == 0 && status.st_ino == file->st_ino && status.st_dev == file->st_dev;
}

/* Describes what this file is to the command, apart from `target` itself; NULL if it is unrelated. */
static const char *find_owner(const struct targets *targets, const struct target *target,
                              const struct stat *file) {
    for (int i = 0; i < targets->spared_count; i++)
        if (is_file(targets->spared[i], file))
            return targets->spared[i];
    for (const struct target *other = targets->first; other; other = other->next)
        if (other != target && (is_file(other->path, file) || is_file(other->part, file)))
            return other->name;
    return NULL;
}

static bool check_apart(const struct targets *targets, const struct target *target, const char *path) {
    struct stat status;
    const char *owner = stat(path, &status) == 0 ? find_owner(targets, target, &status) : NULL;
    return !owner || refuse(target->name, format_text("%s is the file %s, which this command also reads or "
                                                      "writes; give another name",
                                                      path, owner));
}

/* ---- NAME.part ---- */

/* Reports the system's error about NAME.part. The message names NAME, unless NAME.part itself is in the way.
 */
static bool refuse_part(const struct target *target) {
    const int error = errno;
    struct stat status;
    const bool is_there = lstat(target->part, &status) == 0;
    errno = error;
    return refuse_for(is_there ? target->part : target->name, "cannot be written");
}

static void remove_part(void *what) {
    const struct target *target = what;
    unlink(target->part);
}

/* Returns whether the open file still has the name. Another program may have finished it in between. */
static bool is_still(const char *path, int file) {
    struct stat status;
    return fstat(file, &status) == 0 && is_file(path, &status);
}

/* A descriptor of NAME.part, locked; -1 if it cannot be opened, which is reported. */
static int open_part(const struct target *target) {
    for (int i = 0; i < TRIES; i++) {
        struct stat status, folder;
        const int file =
            open(target->part, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY, 0666);
        if (file < 0 || fstat(file, &status) != 0) {
            refuse_part(target);
            return -1;
        }
        const bool is_plain = S_ISREG(status.st_mode) && status.st_nlink <= 1 && /* 0: meanwhile removed */
                              (status.st_uid == geteuid() || !is_in_common_folder(target->part, &folder));
        const bool is_busy = is_plain && flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
        if (is_plain && !is_busy && is_still(target->part, file))
            return file;
        close(file);
        if (is_busy || !is_plain) {
            refuse(target->name, is_busy ? "another refdyn is writing this file, wait for it or name another"
                                         : "NAME.part exists and is not a plain file of yours; remove it");
            return -1;
        }
    }
    refuse(target->name, "other programs create and remove NAME.part; give another name");
    return -1;
}

/* Empties the file, after a test that a byte can be written: a full disk is reported now. */
static bool empty_part(const struct target *target, int file) {
    if (pwrite(file, "\n", 1, 0) == 1 && ftruncate(file, 0) == 0)
        return true;
    return refuse_part(target);
}

static bool take_part(const struct targets *targets, struct target *target) {
    struct stat before;
    target->part = format_text("%s.part", target->path);
    const bool is_new = lstat(target->part, &before) != 0;
    if (!check_apart(targets, target, target->path) || !check_apart(targets, target, target->part))
        return false;
    const int file = open_part(target);
    if (file < 0)
        return false;
    /* Checks again: a file system may treat two names as one. */
    if (check_apart(targets, target, target->part) && empty_part(target, file)) {
        system_undo_add(&target->undo, remove_part, target);
        target->file = fdopen(file, "w");
        target->lock = fcntl(file, F_DUPFD_CLOEXEC, 0);
        return true;
    }
    if (is_new)
        unlink(target->part);
    close(file);
    return false;
}

/* ---- Opening ---- */

static bool open_stdout(struct target *target) {
    const int mode = fcntl(STDOUT_FILENO, F_GETFL);
    if (mode < 0 || (mode & O_ACCMODE) == O_RDONLY)
        return refuse("stdout", "is closed, -o FILE writes to a file");
    target->file = stdout;
    return true;
}

static bool open_itself(struct target *target, const char *path) {
    const int link = is_of_system(path) ? 0 : O_NOFOLLOW;
    const int file = open(path, O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY | link);
    target->file = file < 0 ? NULL : fdopen(file, "w");
    return target->file || refuse_for(target->name, "cannot be written");
}

static bool open_target(const struct targets *targets, struct target *target, const char *path) {
    if (!path)
        return open_stdout(target);
    const char *found = find_path(target);
    if (!found)
        return false;
    if (!target->path)
        return open_itself(target, found);
    if (!check_present(target))
        return false;
    sigset_t before;
    system_interrupt_hold(
        &before); /* no signal comes between the creation of the file and the entry that undoes it */
    const bool is_taken = take_part(targets, target);
    system_interrupt_release(&before);
    return is_taken;
}

struct target *system_target_open(struct targets *targets, const char *path) {
    struct target *target = format_allocate(1, sizeof *target);
    *target = (struct target){.name = format_text("%s", path ? path : "stdout"), .lock = -1};
    if (open_target(targets, target, path) && target->file) {
        target->next = targets->first;
        targets->first = target;
        return target;
    }
    return NULL;
}

bool system_targets_spare(struct targets *targets, const char *path) {
    bool is_apart = true;
    targets->spared = memory_room(&format_memory, targets->spared, targets->spared_count,
                                  &targets->spared_room, sizeof *targets->spared);
    targets->spared[targets->spared_count++] = format_text("%s", path);
    for (const struct target *target = targets->first; target && is_apart; target = target->next)
        is_apart = !target->path || check_apart(targets, target, target->path);
    return is_apart;
}

/* Called when a signal ends the program. */
static void remove_folders(void *what) {
    const struct targets *targets = what;
    system_unmake_folder(targets->folders);
}

bool system_targets_make_folder(struct targets *targets, const char *path) {
    sigset_t before;
    system_interrupt_hold(&before);
    const bool is_made = system_make_folder(path, 0777, &targets->folders);
    if (is_made)
        system_undo_add(&targets->undo, remove_folders, targets);
    system_interrupt_release(&before);
    if (!is_made)
        return refuse_for(*path ? path : "''", "the folder cannot be made");
    return faccessat(AT_FDCWD, path, W_OK | X_OK, AT_EACCESS) == 0 ||
           refuse_for(path, "the folder cannot be written into");
}

/* ---- The end ---- */

void system_target_keep_part(struct target *target) {
    target->is_used = true;
    system_undo_forget(&target->undo);
}

void system_target_drop_part(struct target *target) {
    target->is_used = false;
}

static bool refuse_rest(const struct target *target) {
    return refuse_for(target->part ? target->part : target->name, "not all could be written");
}

bool system_target_write(struct target *target, const char *text, size_t length) {
    const bool is_good = fwrite(text, 1, length, target->file) == length && fflush(target->file) == 0;
    return is_good || refuse_rest(target);
}

/* Closes the file. stdout stays open. */
static bool close_file(struct target *target) {
    bool is_good = !ferror(target->file);
    is_good = fflush(target->file) == 0 && is_good;
    if (target->file != stdout)
        is_good = fclose(target->file) == 0 && is_good;
    target->file = NULL;
    return is_good || refuse_rest(target);
}

bool system_target_close_part(struct target *target) {
    system_target_keep_part(target);
    return close_file(target);
}

bool system_target_finish(struct target *target) {
    if (!close_file(target))
        return false;
    if (target->path && rename(target->part, target->path) != 0)
        return refuse_for(target->name, "cannot be made");
    system_target_keep_part(target);
    return true;
}

static void release(struct target *target) {
    if (!target->is_used && target->lock >= 0)
        unlink(target->part);
    system_undo_forget(&target->undo);
    if (target->file && target->file != stdout)
        fclose(target->file);
    if (target->lock >= 0)
        close(target->lock);
}

void system_targets_release(struct targets *targets) {
    for (struct target *target = targets->first; target; target = target->next)
        release(target);
    system_undo_forget(&targets->undo);
    system_unmake_folder(targets->folders);
    *targets = (struct targets){.first = NULL};
}
