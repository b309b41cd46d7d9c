/*
 * An axis of a chart: what it shows of the numbers, where its ticks stand, and what is written there.
 *
 * Numbers beside ticks are short: a power of ten, or a value that all of them have in common, stands once, as
 * a note at the end of the axis.
 */
#ifndef REFDYN_TOOL_SCALE_H
#define REFDYN_TOOL_SCALE_H

#include <stdbool.h>

struct scale {
    bool is_logarithmic;
    double low, high;   /* shown; of a logarithmic axis the decimal logarithms, as all that follows */
    double first, step; /* ticks */
    int count;
    double base;  /* the numbers are (value - base)/10^exponent */
    int exponent; /* a multiple of 3 */
    int decimals;
};

enum { SCALE_TEXT = 48 };

/* Linear, with at most `most` ticks. */
struct scale scale_linear(double low, double high, int most);
/* Whole decades that have `low` to `high`, which are positive. */
struct scale scale_logarithmic(double low, double high, int most);
/* The range with `part` of its width added at both ends; with ends where all values are the same. */
void scale_widen(double *low, double *high, double part);

/* Where the value lies between the ends, 0 to 1. */
double scale_place(const struct scale *scale, double value);
/* The same of a tick, counted from 0. */
double scale_tick(const struct scale *scale, int tick);
/* The number beside a tick, and the note, which may be empty. */
void scale_label(const struct scale *scale, int tick, char text[static SCALE_TEXT]);
void scale_note(const struct scale *scale, char text[static SCALE_TEXT]);

#endif
