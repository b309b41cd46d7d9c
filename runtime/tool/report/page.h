/*
 * What a report draws and writes of its studies: error over run time as a figure, a chart for each study and
 * one line a method and stabilisation; facts, findings, figure and all runs as one HTML file that needs no
 * other.
 */
#ifndef REFDYN_TOOL_PAGE_H
#define REFDYN_TOOL_PAGE_H

#include "report/study.h"

/* What was computed: model, options, start, parameters; part of the page, in heap memory. */
char *page_facts(const struct scene *scene, const struct options *options, const struct study_plan *plan);
/* The text of the figure, an SVG file, goes to `out`. */
void diagram_draw(FILE *out, const char *title, const struct study *studies, int count);
/* The whole page; the figure is the text of an SVG file. */
void page_write(FILE *out, const char *title, const struct study *studies, int count, const char *figure);

#endif
