/*
 * Numbers that were computed from those of a file, as a person would write them: what is rounding beside a
 * scale becomes 0, and a last digit or two that are rounding go: within 1e-15 of its value each.
 */
#ifndef REFDYN_TOOL_TIDY_H
#define REFDYN_TOOL_TIDY_H

/* `scale` 0: no number becomes 0. */
void tidy(double *list, int count, double scale);

#endif
