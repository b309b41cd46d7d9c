/*
 * The cases of a batch: what varies from one to the next, and its value in each.
 *
 * A sweep file (sweep.h) or a table makes them; both fix their order. A column is a name of the model: a
 * parameter, an input, a coordinate's start value (NAME) or start rate (NAME_d), an option, whose values are
 * texts and may change the structure, or `inputs`, the files with the samples of inputs of each case.
 */
#ifndef REFDYN_TOOL_CASES_H
#define REFDYN_TOOL_CASES_H

#include <stdbool.h>

enum varied_kind {
    VARIED_PARAMETER,
    VARIED_INPUT,
    VARIED_COORDINATE,
    VARIED_RATE,
    VARIED_OPTION,
    VARIED_SAMPLES
};

struct varied {
    const char *name;   /* of the column, /cases/NAME */
    const char *target; /* of the parameter, input, coordinate or option; "inputs" of samples */
    const char *unit;   /* "" where there is none */
    enum varied_kind kind;
    double *values;     /* (count) the number in each case; of texts, which of them */
    const char **texts; /* (text_count) the different texts of an option or of files; NULL: numbers */
    int text_count;
};

struct cases {
    long count;
    int width;
    struct varied *columns; /* (width) */
};

#endif
