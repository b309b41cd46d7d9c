/*
 * A finished motion as `sim` wrote it: what its columns are, and so many of its rows as a figure can show.
 */
#ifndef REFDYN_TOOL_RECORDED_MOTION_H
#define REFDYN_TOOL_RECORDED_MOTION_H

#include "simulate/motion_file.h"
#include "text/csv.h"

#include <stdbool.h>

enum {
    RUN_ROWS_MOST = 4000 /* of those that are kept: more cannot be seen */,
    RUN_ROWS_LEAST = 100,
    RUN_NUMBERS_MOST = 1 << 22 /* in them, where there are many columns */
};

struct run {
    const char *path;
    const char *name;              /* without folders */
    struct csv csv;                /* of a CSV file */
    struct motion_reader *motion;  /* of a file of HDF5; NULL: it is CSV */
    char **columns;                /* names, of one of these */
    double *kept;                  /* (kept_count x column_count) rows at equal distances, and the last one */
    long kept_count, stride, room; /* every stride-th row is kept */
    double *largest;               /* absolute value in each column */
    int column_count;
    long rows;

    /* Columns, counted from 0; -1 or 0 where there are none. */
    int coordinates, coordinate_count; /* first one and how many */
    int *points;                       /* the x of each point; y z xd yd ... follow */
    int point_count;
    int energy;
    int forces, force_count;
    int inputs, input_count;
};

/* Whether a file's name says that it is one of HDF5. */
bool run_is_hdf5(const char *path);
/* Complains on stderr with FILE:LINE and returns false when it is no such file. */
bool run_read(struct run *run, const char *path);

#endif
