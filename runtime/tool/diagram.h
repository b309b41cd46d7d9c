/*
 * Error over run time as a drawing, one line a method and stabilisation.
 */
#ifndef REFDYN_TOOL_DIAGRAM_H
#define REFDYN_TOOL_DIAGRAM_H

#include "study.h"

/* The text of the SVG goes to `out`. Complains on stderr when it fails. */
bool diagram_draw(FILE *out, const char *title, const struct study *studies, int count);

#endif
