/*
 * The columns of a motion, by name, and the motion as CSV: one header line, one line an output. Columns as
 * the README of this folder tells.
 */
#ifndef REFDYN_TOOL_TABLE_H
#define REFDYN_TOOL_TABLE_H

#include "refdyn.h"

#include <stdio.h>

struct table {
    struct refdyn_drive *drive;
    char **names;   /* (count) */
    double *values; /* (count) of the last table_fill */
    int count, filled;
    double *room; /* for points, their columns and the programme force */
};

void table_start(struct table *table, struct refdyn_drive *drive);
/* The values of the drive's state. */
void table_fill(struct table *table);
void table_header(const struct table *table, FILE *out);
/* table_fill and a line of it. */
void table_row(struct table *table, FILE *out);
void table_release(struct table *table);

#endif
