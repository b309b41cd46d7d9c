/*
 * The columns of a motion, by name, and the motion as CSV: one header line, one line an output. Columns as
 * the README of this folder tells. A name that a column before has gets the kind of its column before it:
 * point_, input_, course_ ...
 */
#ifndef REFDYN_TOOL_MOTION_TABLE_H
#define REFDYN_TOOL_MOTION_TABLE_H

#include "base/memory.h"
#include "text/output.h"
#include "refdyn.h"
#include "simulate/motion_file.h"

#include <stdio.h>

enum { TABLE_BLOCKS = 10 }; /* of columns that are computed together: the state, points, residuals ... */

struct table {
    struct refdyn_integrator *integrator;
    const struct refdyn_spatial *spatial; /* NULL: no point has angular columns */
    const char **names;                   /* (count) */
    const char **units;                   /* (count) NULL: the model does not say */
    int ends[TABLE_BLOCKS];
    bool is_wanted[TABLE_BLOCKS];
    struct motion_part *parts; /* what belongs together, as a file of HDF5 has it */
    int part_count;
    double *values; /* (count) of the last table_fill */
    int count, filled;
    double *room; /* for points, their columns and the programme force */
};

extern const char table_input_lead[]; /* before the name of an input whose name is taken */
/* Before the names of accelerations where one of them is taken, and behind them. */
extern const char table_acceleration_lead[], table_acceleration_ending[];

/* spatial: of points whose angular velocities and accelerations have columns; NULL: of none. */
void table_start(struct table *table, struct refdyn_integrator *integrator,
                 const struct refdyn_spatial *spatial);
/* From now on only the blocks with a wanted column are filled: wanted (count). */
void table_want(struct table *table, const bool *wanted);
/* The values of the integrator's state. */
void table_fill(struct table *table);
void table_header(const struct table *table, FILE *out);
/* The first column that is infinite or NaN after table_fill, NULL: none. */
const char *table_not_finite(const struct table *table);
/* The units of the columns, as object "units"; those that the model does not say are not there. */
void table_put_units(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                     struct document *document);
/* A line of the values. */
void table_row(const struct table *table, FILE *out);

#endif
