/*
 * An HDF5 file that is read: all its objects with their attributes, and rows of its datasets. Rows are read
 * in blocks, so that memory does not grow with their count.
 *
 * A separate process reads the file (hdf5_gate.h says what is refused). The functions complain once about a
 * file, on stderr, as FILE: fact; after that they do nothing and return false.
 */
#ifndef REFDYN_TOOL_HDF5_INPUT_H
#define REFDYN_TOOL_HDF5_INPUT_H

#include "base/memory.h"
#include "hdf5/hdf5_gate.h"

#include <stdbool.h>
#include <stdio.h>
#include <sys/types.h>

struct hdf5_attribute {
    const char *name;
    enum hdf5_kind kind;
    bool is_list;
    int count;          /* values */
    const char **texts; /* (count) or NULL */
    double *numbers;    /* (count) or NULL */
};

struct hdf5_object {
    const char *path; /* "/q", of the file itself "/" */
    const char *name; /* the end of the path */
    const char *axis; /* path of the scale along the second axis; NULL: there is none */
    int group;        /* its number; -1: the file itself */
    enum hdf5_kind kind;
    int rank;     /* of a dataset, else 0 */
    long size[2]; /* of a dataset with one or two axes: rows, and numbers in a row, 0 if it has one axis */
    struct hdf5_attribute *attributes;
    int attribute_count, attribute_room;
};

/* A dataset and its place in a row. */
struct hdf5_taken {
    int object;
    int place; /* of its first number among the numbers of a row, or of its text among the texts */
};

struct hdf5_input {
    const char *path;
    struct memory memory; /* of the objects */
    struct hdf5_object *objects;
    int count, room; /* in the order in which they were made; the content of a group follows it */

    struct hdf5_taken *taken;
    int taken_count, taken_room;
    int width, text_width;     /* numbers and texts of a row */
    long first, held, block;   /* rows in memory, and how many there is room for */
    double *values;            /* (block x width) */
    char **texts;              /* (block x text_width) in heap memory */
    double bytes;              /* of the file */
    pid_t gate;                /* 0: it does not run */
    int socket;                /* to the gate */
    FILE *answers;             /* from the gate */
    bool is_quiet, has_failed; /* never complains; has failed, and complained unless it is quiet */
};

/* The file must have this attribute "content" and this version of it; `what` says it in words: "file of
 * runs". hdf5_input_close in any case. */
bool hdf5_input_open(struct hdf5_input *input, const char *path, const char *content, int version,
                     const char *what);
/* Whether the file has that content; never complains. */
bool hdf5_input_is(const char *path, const char *content);
void hdf5_input_close(struct hdf5_input *input);
/* Complains that the content of the file is wrong. Returns false. */
bool hdf5_input_refuse(struct hdf5_input *input, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* NULL: the file, or the object, has no such thing. */
const struct hdf5_object *hdf5_input_find(const struct hdf5_input *input, const char *path);
const struct hdf5_attribute *hdf5_object_attribute(const struct hdf5_object *object, const char *name);
/* A single text; NULL: there is none. It lives as long as the input. */
const char *hdf5_object_text(const struct hdf5_object *object, const char *name);
/* A single whole number. False: there is none. */
bool hdf5_object_whole(const struct hdf5_object *object, const char *name, long *value);

/* All values of a dataset with one axis, in the input's memory; NULL, with a complaint. */
double *hdf5_input_numbers(struct hdf5_input *input, const struct hdf5_object *object);
const char **hdf5_input_texts(struct hdf5_input *input, const struct hdf5_object *object);

/* Rows will have the numbers, or the text, of this dataset from `place` on. */
void hdf5_input_take(struct hdf5_input *input, const struct hdf5_object *object, int place);
/* Allocates room for `width` numbers and `text_width` texts a row, after all datasets are taken. */
void hdf5_input_make_room(struct hdf5_input *input, int width, int text_width);
/* One row of `total`: its numbers and texts, which stay where they are until the next call. */
bool hdf5_input_row(struct hdf5_input *input, long row, long total, const double **values, char ***texts);

#endif
