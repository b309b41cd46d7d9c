/*
 * One drawing by gnuplot. Its script has commands and numbers alone: texts never pass through it. Each is a
 * row of placeholders there, as long as the text, for which svg.c puts the text into gnuplot's SVG.
 */
#ifndef REFDYN_TOOL_GNUPLOT_H
#define REFDYN_TOOL_GNUPLOT_H

#include "folder.h"
#include "svg.h"

#include <stdbool.h>
#include <stdio.h>

struct gnuplot {
    FILE *script; /* the caller prints commands and numbers here */
    struct scratch scratch;
    char *script_path, *svg_path, *log_path;
    struct svg_texts texts;
};

enum { COLOUR_COUNT = 8, DASH_COUNT = 5 };

/* Distinct for the colour-blind too (Okabe and Ito). */
extern const char *const plot_colours[COLOUR_COUNT];
/* gnuplot's dash types: solid, dashed, dotted ... */
extern const char *const plot_dashes[DASH_COUNT];

/* Whether gnuplot is there; complains on stderr when it is not. */
bool gnuplot_is_there(void);
/* Opens the script and puts down the terminal, `width` x `height` pixels. Complains on stderr when it fails.
 */
bool gnuplot_open(struct gnuplot *gnuplot, int width, int height);
/* Draws: the SVG's text goes to `out`. Complains on stderr, with what gnuplot said, when it fails. */
bool gnuplot_draw(struct gnuplot *gnuplot, FILE *out);
/* A text of the drawing, whatever is in it. */
void gnuplot_text(struct gnuplot *gnuplot, const char *text);

#endif
