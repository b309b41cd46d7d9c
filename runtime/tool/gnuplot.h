/*
 * One drawing by gnuplot: its script is written to a temporary file, the SVG appears complete or not at all.
 */
#ifndef REFDYN_TOOL_GNUPLOT_H
#define REFDYN_TOOL_GNUPLOT_H

#include <stdbool.h>
#include <stdio.h>

struct gnuplot {
    FILE *script; /* the caller prints commands here */
    char *folder, *script_path, *svg_path, *log_path;
};

enum { COLOUR_COUNT = 8, DASH_COUNT = 5 };

/* Distinct for the colour-blind too (Okabe and Ito). */
extern const char *const plot_colours[COLOUR_COUNT];
/* gnuplot's dash types: solid, dashed, dotted ... */
extern const char *const plot_dashes[DASH_COUNT];

/* Opens the script and puts down the terminal, `width` x `height` pixels. Complains on stderr when it fails.
 */
bool gnuplot_open(struct gnuplot *gnuplot, int width, int height);
/* Draws into `path`. Complains on stderr, with what gnuplot said, when it fails. */
bool gnuplot_draw(struct gnuplot *gnuplot, const char *path);
/* Text in gnuplot's single quotes. */
void gnuplot_quote(FILE *script, const char *text);
/* A file's name in quotes; never taken for a pipe or an option. */
void gnuplot_quote_file(FILE *script, const char *path);

#endif
