/*
 * A motion as CSV: one header line, one line an output. Columns as the README of this folder tells.
 */
#ifndef REFDYN_TOOL_TABLE_H
#define REFDYN_TOOL_TABLE_H

#include "refdyn.h"

#include <stdio.h>

struct table {
    FILE *out;
    const struct refdyn_drive *drive;
    double *room; /* for points, their columns and the programme force */
};

void table_start(struct table *table, FILE *out, const struct refdyn_drive *drive);
void table_row(struct table *table);
void table_release(struct table *table);

#endif
