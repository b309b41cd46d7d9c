/*
 * What a batch keeps of each motion, as the sweep asks for it: names of columns as in the CSV of `sim`.
 */
#ifndef REFDYN_TOOL_KEEP_H
#define REFDYN_TOOL_KEEP_H

#include <stdbool.h>

struct name_list {
    const char **names;
    const char *const *places; /* (count) "FILE:LINE", where each is asked for */
    int count;
};

struct keep {
    bool final;                /* the state at the end: t, coordinates, rates, points */
    struct name_list extremes; /* smallest and largest value over the outputs, with their times */
    struct name_list norms;    /* root mean square over time */
    struct name_list history;  /* the value at each output */
    const double *at; /* (at_count) ascending times at which all that `final` keeps is kept, too [s] */
    int at_count;
};

#endif
