/*
 * Where the rows of a motion go: a CSV, a file of HDF5, or a temporary file of numbers, whose rows go on into
 * one of the others when the motion is the one that was looked for.
 */
#ifndef REFDYN_TOOL_ROW_SINK_H
#define REFDYN_TOOL_ROW_SINK_H

#include "simulate/motion_table.h"

struct motion_writer;
struct row_sink;
struct task;

/* What a form does with a motion. False: it cannot be written, which the form or the end of its file tells.
 */
struct row_form {
    bool (*begin)(struct row_sink *sink, const struct table *table);
    bool (*put)(struct row_sink *sink, const struct table *table);
    bool (*end)(struct row_sink *sink);
};

struct row_sink {
    const struct row_form *form;
    FILE *file;              /* of CSV and numbers */
    const char *path;        /* of HDF5 */
    const struct task *task; /* what a file of HDF5 tells of the motion */
    struct motion_writer *writer;
    bool is_lost; /* what was written until it failed cannot be read */
};

struct row_sink row_sink_csv(FILE *file);
struct row_sink row_sink_numbers(FILE *file);
/* In motion_hdf5.c. */
struct row_sink row_sink_hdf5(const char *path, const struct task *task);

/* Before the first row; the table's integrator is at the start of the motion. */
bool row_sink_begin(struct row_sink *sink, const struct table *table);
/* The values of the table. */
bool row_sink_put(struct row_sink *sink, const struct table *table);
/* Behind the last row, whether all could be written or not. */
bool row_sink_end(struct row_sink *sink);
/* All rows of a file of numbers into another sink, from its begin to its end; `table` has their columns. */
bool row_sink_copy(FILE *numbers, struct row_sink *to, struct table *table);

#endif
