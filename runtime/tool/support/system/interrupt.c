/* Handlers of the signals that end the program: they undo what was begun, or note the signal. Signals that
 * the caller ignores stay ignored, except SIGCHLD. */
#include "runtime/tool/support/system/system.h"

#include <stddef.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

/* the message when the signal ends the program; NULL where the user knows the reason, or nobody listens */
static const struct {
    int number;
    bool is_repeated; /* the system repeats it while its cause lasts; the user does not send it */
    const char *text;
} signals[] = {
    {SIGHUP, false, "refdyn: ended by SIGHUP\n"},
    {SIGINT, false, NULL},
    {SIGQUIT, false, NULL},
    {SIGPIPE, true, NULL},
    {SIGTERM, false, "refdyn: ended by SIGTERM\n"},
    {SIGXCPU, true, "refdyn: ended by SIGXCPU: the limit on CPU time is reached\n"},
    {SIGXFSZ, true, "refdyn: ended by SIGXFSZ: the limit on the size of files is reached\n"},
};

enum { SIGNAL_COUNT = sizeof signals / sizeof signals[0] };

volatile sig_atomic_t system_interrupted;
static volatile sig_atomic_t is_deferring;
static bool is_accepted;
static struct undo *volatile undos;

static int place_of(int number) {
    int place = 0;
    while (place < SIGNAL_COUNT - 1 && signals[place].number != number)
        place++;
    return place;
}

/* The default action of the signal, without the core file that some signals leave. */
static void end_by(int number) {
    const struct rlimit none = {0, 0};
    const char *text = signals[place_of(number)].text;
    sigset_t only;
    if (text && write(STDERR_FILENO, text, strlen(text)) < 0)
        text = NULL; /* nobody reads it */
    setrlimit(RLIMIT_CORE, &none);
    signal(number, SIG_DFL);
    sigemptyset(&only);
    sigaddset(&only, number);
    raise(number);
    sigprocmask(SIG_UNBLOCK, &only, NULL);
    _exit(128 + number);
}

static void on_signal(int number) {
    if (is_deferring && !system_interrupted) {
        system_interrupted = number;
        if (signals[place_of(number)].is_repeated)
            signal(number, SIG_IGN);
        return;
    }
    for (struct undo *undo = undos; undo; undo = undo->next)
        undo->call(undo->what);
    end_by(number);
}

static void fill_set(sigset_t *set) {
    sigemptyset(set);
    for (int i = 0; i < SIGNAL_COUNT; i++)
        sigaddset(set, signals[i].number);
}

void system_interrupt_catch(void) {
    struct sigaction action = {.sa_handler = on_signal}, before;
    fill_set(&action.sa_mask);
    signal(SIGCHLD,
           SIG_DFL); /* an ignored SIGCHLD would hide the ends of other programs, also from compilers */
    for (int i = 0; i < SIGNAL_COUNT; i++)
        if (sigaction(signals[i].number, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            sigaction(signals[i].number, &action, NULL);
}

void system_interrupt_defer(bool is_deferred) {
    is_deferring = is_deferred;
}

bool system_interrupt_is_new(void) {
    return system_interrupted && !is_accepted;
}

void system_interrupt_accept(void) {
    is_accepted = true;
}

void system_interrupt_hold(sigset_t *before) {
    sigset_t all;
    fill_set(&all);
    sigprocmask(SIG_BLOCK, &all, before);
}

void system_interrupt_release(const sigset_t *before) {
    sigprocmask(SIG_SETMASK, before, NULL);
}

void system_undo_add(struct undo *undo, void (*call)(void *what), void *what) {
    *undo = (struct undo){.call = call, .what = what, .next = undos};
    undos = undo; /* the entry is complete when a signal handler sees it */
}

void system_undo_forget(struct undo *undo) {
    sigset_t before;
    system_interrupt_hold(&before);
    struct undo *volatile *place = &undos;
    while (*place && *place != undo)
        place = &(*place)->next;
    if (*place)
        *place = undo->next;
    system_interrupt_release(&before);
}

void system_undo_forget_all(void) {
    undos = NULL;
    system_interrupted = 0;
    is_deferring = is_accepted = false;
}

void system_interrupt_finish(void) {
    if (system_interrupted)
        end_by(system_interrupted);
}
