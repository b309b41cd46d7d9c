/*
 * Rows of an HDF5 file. A row is one number or several, or a text, in each dataset. Rows are written in
 * blocks, so that memory does not grow with their count.
 */
#ifndef REFDYN_TOOL_HDF5_ROWS_H
#define REFDYN_TOOL_HDF5_ROWS_H

#include "hdf5/hdf5_file.h"

/* A dataset and what it has of a row. */
struct hdf5_column {
    hid_t dataset;
    int place; /* of its first number among the numbers of a row, or of its text among the texts */
    int size;  /* numbers, 0: one in a dataset with one axis */
    bool is_text;
    bool grows;
};

struct hdf5_rows {
    struct hdf5_file *file;
    struct hdf5_column *columns;
    int column_count, column_room;
    int width, text_width; /* numbers and texts of a row */
    long first, count;     /* the rows that are held; first counts from the start of the file */
    long room;
    double *values; /* (room x width) */
    char **texts;   /* (room x text_width) in heap memory */
};

/* How many rows with so many numbers and texts a block holds. */
long hdf5_rows_in_block(int width, int text_width);

/* Columns are added before the first row; hdf5_rows_release in any case. */
void hdf5_rows_start(struct hdf5_rows *rows, struct hdf5_file *file);
/* The dataset belongs to the rows from now on. False: it is none. */
bool hdf5_rows_add(struct hdf5_rows *rows, struct hdf5_column column);
/* Room for `width` numbers and `text_width` texts a row; rows that are held are forgotten. */
void hdf5_rows_make_room(struct hdf5_rows *rows, int width, int text_width);

/* The next row, copied. */
bool hdf5_rows_put(struct hdf5_rows *rows, const double *values, const char *const *texts);
/* What is held goes into the file. */
bool hdf5_rows_flush(struct hdf5_rows *rows);
void hdf5_rows_release(struct hdf5_rows *rows);

#endif
