/*
 * Signals that end the program: SIGHUP, SIGINT, SIGPIPE, SIGTERM, SIGXCPU, SIGXFSZ.
 *
 * Each ends the program at once, after what was begun is undone. While signals are deferred, as in a motion
 * whose rows are worth keeping, the first one is only noted; interrupt_finish ends the program by it. A
 * second one acts at once. Signals that the caller had ignored stay ignored, but for SIGCHLD, without
 * which compilers and converters would end unseen.
 */
#ifndef REFDYN_TOOL_INTERRUPT_H
#define REFDYN_TOOL_INTERRUPT_H

#include <signal.h>
#include <stdbool.h>

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

#endif
