/*
 * The figure of a file of runs: how results depend on what varied, how histories spread over time, and which
 * cases are the worst.
 */
#ifndef REFDYN_TOOL_RUNS_FIGURE_H
#define REFDYN_TOOL_RUNS_FIGURE_H

#include <stdbool.h>
#include <stdio.h>

/* Draws what `panels`, a list of names as "history/E_x", or NULL, names. Complains on stderr when the file
 * cannot be read or has none of a name. */
bool runs_figure_draw(const char *path, const char *panels, FILE *out);

#endif
