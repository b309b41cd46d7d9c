/* Clocks and processors, and what the user sees on stderr while the program works: notices and a progress
 * bar. */
#define _GNU_SOURCE /* processors that the process may use */
#include "runtime/tool/support/system/system.h"

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 40, PROCESSORS_MAX = 1 << 20 };

static const double notice_seconds = 0.5;  /* a shorter wait is not noticed */
static const double silent_seconds = 1;    /* shorter work shows no bar */
static const double refresh_seconds = 0.1; /* ten drawings a second look smooth and cost nothing */

/* The set must be at least as large as the system's. */
int system_processors(void) {
    int found = 0;
    for (int most = 1024; most <= PROCESSORS_MAX && found == 0; most *= 2) {
        cpu_set_t *set = CPU_ALLOC((size_t)most);
        const size_t size = CPU_ALLOC_SIZE((size_t)most);
        const bool is_known = set && sched_getaffinity(0, size, set) == 0;
        found = is_known ? CPU_COUNT_S(size, set) : set && errno == EINVAL ? 0 : 1;
        CPU_FREE(set);
    }
    return found > 0 ? found : 1;
}

static double seconds_of(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double system_wall_seconds(void) {
    return seconds_of(CLOCK_MONOTONIC);
}

double system_process_cpu_seconds(void) {
    return seconds_of(CLOCK_PROCESS_CPUTIME_ID);
}

double system_cpu_seconds(void) {
    return seconds_of(CLOCK_THREAD_CPUTIME_ID);
}

/* ---- Notices ---- */

void system_notice_start(struct notice *notice, const char *what) {
    *notice = (struct notice){
        .what = what, .started = system_wall_seconds(), .is_terminal = isatty(STDERR_FILENO) == 1};
}

/* Returns whether the environment has the value 1 for a program that reads stderr. */
static bool is_wanted(const char *variable) {
    const char *text = getenv(variable);
    return text && strcmp(text, "1") == 0;
}

void system_notice_show(struct notice *notice) {
    if (notice->is_shown || system_wall_seconds() - notice->started < notice_seconds)
        return;
    notice->is_shown = true;
    if (notice->is_terminal)
        fprintf(stderr, "refdyn: %s ...", notice->what);
    else if (is_wanted("REFDYN_NOTICES"))
        fprintf(stderr, "refdyn: %s ...\n", notice->what);
    fflush(stderr);
}

void system_notice_end(struct notice *notice) {
    if (notice->is_shown && notice->is_terminal)
        fputs("\r\033[K", stderr);
    notice->is_shown = false;
}

/* ---- Progress ---- */

void system_progress_start(struct progress *progress, const char *what) {
    *progress = (struct progress){.what = what,
                                  .started = system_wall_seconds(),
                                  .is_drawn = is_wanted("REFDYN_PROGRESS") || isatty(STDERR_FILENO) == 1};
}

static bool is_due_at(const struct progress *progress, double now) {
    return now - progress->started >= silent_seconds && now - progress->drawn >= refresh_seconds;
}

bool system_progress_is_due(const struct progress *progress) {
    return progress->is_drawn && is_due_at(progress, system_wall_seconds());
}

void system_progress_show(struct progress *progress, double fraction) {
    if (!progress->is_drawn)
        return;
    double now = system_wall_seconds(), elapsed = now - progress->started;
    if (!is_due_at(progress, now))
        return;
    char bar[BAR_WIDTH + 1] = "";
    int filled = (int)(fraction * BAR_WIDTH);
    filled = filled < 0 ? 0 : filled > BAR_WIDTH ? BAR_WIDTH : filled;
    memset(bar, '#', (size_t)filled);
    double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
    fprintf(stderr, "\r%s [%-*s] %3.0f %%, %.0f s left \033[K", progress->what, BAR_WIDTH, bar,
            100 * fraction, left);
    fflush(stderr);
    progress->drawn = now;
    progress->is_shown = true;
}

void system_progress_end(struct progress *progress) {
    if (progress->is_shown)
        fputs("\r\033[K", stderr);
    progress->is_shown = false;
}
