/*
 * gnuplot's SVG finished: texts put in for their placeholders, and what it repeats in every group left out.
 *
 * Coordinates of curves become relative: the SVG is then less than half as long, and the picture stays the
 * same to a tenth of a pixel.
 */
#ifndef REFDYN_TOOL_SVG_H
#define REFDYN_TOOL_SVG_H

#include <stdio.h>

/* Texts of one drawing. What stands for a text takes as much room as it; texts beyond some thousand are left
 * out. */
struct svg_texts {
    char **list;
    int count, room;
};

void svg_put_placeholders(FILE *out, struct svg_texts *texts, const char *text);
/* Writes the SVG `text` with the texts in it. */
void svg_finish(const char *text, const struct svg_texts *texts, FILE *out);
void svg_texts_release(struct svg_texts *texts);

#endif
