/*
 * --watch: repeats a command whenever one of the files that it reads is saved: the model, the files that it
 * requires, and those that the command names, such as runs or inputs.
 *
 * Each repetition is a process, which first reports the files of the model. Errors in the model end the
 * process, and watching continues. A repetition that still computes when a file changes is ended.
 */
#include "runtime/tool/scene/scene.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { PIPE_BLOCK = 4096 };

/* Between two looks at the files: short for somebody who looks at the result, long for the processor. */
static const struct timespec look_pause = {.tv_nsec = 20000000};

struct watched_file {
    const char *path;
    struct stat status; /* when its change was last noticed; all zero if it was missing */
};

struct watch {
    const struct options *options;
    const char *model; /* NULL if there is none */
    struct watched_file *files;
    int count, room;
    const char *changed;  /* path of the file that changed last */
    volatile pid_t child; /* 0: none runs */
    int reports; /* descriptor of the child's paths, each with a zero at its end; -1 after the last */
    char *paths; /* received and incomplete */
    size_t length, path_room; /* of paths */
    struct undo undo;
};

/* ---- Files ---- */

/* A file that is missing or empty is being written: it counts as unchanged until it is there. */
static bool has_changed(const struct watched_file *file, struct stat *now) {
    return stat(file->path, now) == 0 && now->st_size > 0 &&
           (now->st_ino != file->status.st_ino || now->st_size != file->status.st_size ||
            now->st_mtim.tv_sec != file->status.st_mtim.tv_sec ||
            now->st_mtim.tv_nsec != file->status.st_mtim.tv_nsec);
}

static bool look(struct watch *watch) {
    bool is_any = false;
    for (int i = 0; i < watch->count; i++) {
        struct stat now;
        if (has_changed(&watch->files[i], &now)) {
            watch->files[i].status = now;
            watch->changed = watch->files[i].path;
            is_any = true;
        }
    }
    return is_any;
}

static void add(struct watch *watch, const char *path) {
    for (int i = 0; i < watch->count; i++)
        if (strcmp(watch->files[i].path, path) == 0)
            return;
    watch->files =
        memory_room(&format_memory, watch->files, watch->count, &watch->room, sizeof *watch->files);
    struct watched_file *file = &watch->files[watch->count++];
    *file = (struct watched_file){.path = format_text("%s", path)};
    if (stat(path, &file->status) != 0)
        file->status = (struct stat){.st_size = 0};
}

/* ---- The files of the model, from the child ---- */

static void report(int out, const char *path) {
    if (path && write(out, path, strlen(path) + 1) < 0)
        close(out); /* nobody watches any longer */
}

/* Also reports the places of errors, since the list of files is unknown if the model cannot be run. */
static void report_files(const struct options *options, const char *model, int out) {
    const struct read_request request = {
        .file = model, .settings = options->settings, .setting_count = options->setting_count};
    struct generation generation;
    gen_read(&generation, &request, -1);
    const struct sources *sources = generation.model.sources;
    for (int i = 0; sources && i < sources->count; i++)
        report(out, sources->list[i].path);
    for (int i = 0; i < generation.messages.count; i++)
        report(out, generation.messages.list[i].place.file);
    gen_release(&generation);
}

/* Takes the complete paths out of those received. */
static void take_paths(struct watch *watch) {
    size_t begin = 0;
    for (size_t i = 0; i < watch->length; i++)
        if (watch->paths[i] == '\0') {
            add(watch, watch->paths + begin);
            begin = i + 1;
        }
    watch->length -= begin;
    memmove(watch->paths, watch->paths + begin, watch->length);
}

static void receive(struct watch *watch) {
    ssize_t count = 1;
    while (watch->reports >= 0 && count > 0) {
        if (watch->path_room < watch->length + PIPE_BLOCK) {
            watch->path_room = 2 * (watch->length + PIPE_BLOCK);
            watch->paths = memory_grow(&format_memory, watch->paths, watch->length, watch->path_room);
        }
        count = read(watch->reports, watch->paths + watch->length, PIPE_BLOCK);
        if (count > 0)
            watch->length += (size_t)count;
    }
    if (watch->reports >= 0 && (count == 0 || errno != EAGAIN)) {
        close(watch->reports);
        watch->reports = -1;
    }
    take_paths(watch);
}

/* ---- Repetitions ---- */

/* A signal handler may call it. The child keeps the rows that it has written, as after any signal. */
static void end_child(void *what) {
    struct watch *watch = what;
    if (watch->child > 0) {
        kill(watch->child, SIGTERM);
        while (waitpid(watch->child, NULL, 0) < 0 && errno == EINTR)
            continue;
    }
    watch->child = 0;
}

/* In its own group, so that a signal from the terminal reaches this program alone, which passes it on. */
static void repeat_here(const struct watch *watch, int out,
                        enum status (*run)(const struct options *options)) {
    setpgid(0, 0);
    if (watch->model)
        report_files(watch->options, watch->model, out);
    close(out);
    const enum status status = run(watch->options);
    fflush(NULL);
    system_interrupt_finish();
    _exit((int)status);
}

static bool start(struct watch *watch, enum status (*run)(const struct options *options)) {
    int ends[2];
    if (pipe(ends) != 0)
        return false;
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    for (int i = 0; i < 2; i++)
        fcntl(ends[i], F_SETFD, FD_CLOEXEC);
    const pid_t child = system_process_fork();
    if (child == 0) {
        close(ends[0]);
        repeat_here(watch, ends[1], run);
    }
    close(ends[1]);
    watch->reports = ends[0];
    watch->child = child > 0 ? child : 0;
    return child > 0;
}

/* Waits until the repetition has ended or a file has changed. Returns its exit status, or 128 and
 * the signal that has ended it; -1 after a change. */
static int wait_for_end(struct watch *watch) {
    int status = 0;
    for (;;) {
        const pid_t pid = waitpid(watch->child, &status, WNOHANG);
        receive(watch);
        if (pid != 0) {
            watch->child = 0;
            return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        }
        if (look(watch)) {
            end_child(watch);
            receive(watch);
            return -1;
        }
        nanosleep(&look_pause, NULL);
    }
}

static void print_watched(const struct watch *watch) {
    format_complain("refdyn: watching %s", watch->files[0].path);
    if (watch->count > 1)
        fprintf(stderr, " and %d more file%s", watch->count - 1, watch->count > 2 ? "s" : "");
    fputs("; Ctrl-C ends\n", stderr);
}

/* Separates the messages of two repetitions. */
static void print_change(const struct watch *watch) {
    char clock[sizeof "23:59:59"];
    const time_t now = time(NULL);
    strftime(clock, sizeof clock, "%H:%M:%S", localtime(&now));
    fprintf(stderr, "\nrefdyn: %s: %s has changed\n", clock, watch->changed);
}

static void wait_for_change(struct watch *watch) {
    while (!look(watch))
        nanosleep(&look_pause, NULL);
}

enum status scene_watch(const struct options *options, const char *model, const char *const *files, int count,
                        enum status (*run)(const struct options *options)) {
    struct watch watch = {.options = options, .model = model};
    if (!options_text(options, "output"))
        return options_usage_error(options->command, "--watch needs -o");
    if (model)
        add(&watch, model);
    for (int i = 0; i < count; i++)
        add(&watch, files[i]);
    system_undo_add(&watch.undo, end_child, &watch);
    for (bool is_first = true; start(&watch, run); is_first = false) {
        const int status = wait_for_end(&watch);
        if (is_first && status == STATUS_USAGE)
            return STATUS_USAGE;
        if (is_first)
            print_watched(&watch);
        if (status >= 0)
            wait_for_change(&watch);
        print_change(&watch);
    }
    fprintf(stderr, "refdyn: no process could be started: %s\n", strerror(errno));
    return STATUS_FAULT;
}
