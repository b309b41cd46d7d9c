/*
 * Error over run time as a drawing: a chart for each study, one line a method and stabilisation.
 */
#ifndef REFDYN_TOOL_DIAGRAM_H
#define REFDYN_TOOL_DIAGRAM_H

#include "report/study.h"

/* The text of the SVG goes to `out`. */
void diagram_draw(FILE *out, const char *title, const struct study *studies, int count);

#endif
