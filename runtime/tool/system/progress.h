/*
 * A progress bar on stderr, when that is a terminal and the work takes over a second.
 */
#ifndef REFDYN_TOOL_PROGRESS_H
#define REFDYN_TOOL_PROGRESS_H

#include <stdbool.h>

struct progress {
    const char *what;
    double started, drawn; /* wall seconds */
    bool is_terminal, is_shown;
};

void progress_start(struct progress *progress, const char *what);
/* Would it be drawn now? Then what stands before the bar is worth being written. */
bool progress_is_due(const struct progress *progress);
/* Draws it where it is due. fraction: 0 to 1 */
void progress_show(struct progress *progress, double fraction);
void progress_end(struct progress *progress);

#endif
