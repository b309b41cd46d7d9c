/*
 * An SVG file as gnuplot writes it, made small: less than half of it, and the picture stays the same to a
 * tenth of a pixel.
 */
#ifndef REFDYN_TOOL_SVG_H
#define REFDYN_TOOL_SVG_H

#include <stdio.h>

/* Copies text without empty groups and repeated styles; paths with relative coordinates. */
void svg_shrink(const char *text, FILE *out);

#endif
