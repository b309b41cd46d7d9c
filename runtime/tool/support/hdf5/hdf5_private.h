/* The parts of files of HDF5 that only this folder uses: files that are written; the gate process and its
 * answers; files that are read; rows that are written. */
#ifndef REFDYN_TOOL_HDF5_PRIVATE_H
#define REFDYN_TOOL_HDF5_PRIVATE_H

#include <hdf5.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/types.h>

#include "gen/base/base.h"

/* Files that are written: creation, attributes, datasets, closing, and the messages of errors. All functions
 * report one error for a file, on stderr, as FILE: fact; after that they do nothing and return false. */

/* Attributes of a file: its content, and the version of its layout. */
#define HDF5_CONTENT "content"
#define HDF5_VERSION "layout_version"

struct hdf5_file {
    hid_t id;
    char *path;      /* the name in messages */
    hid_t text;      /* the HDF5 type of texts */
    bool has_failed; /* and the error was reported */
};

enum { HDF5_MOST_ROOM = 1 << 22 /* size of the rows that are held in memory */ };

/* Creates a file, replacing an existing one. Call hdf5_release in any case. `content` and `version` say what
 * is in it: "refdyn runs", 1. */
bool hdf5_create(struct hdf5_file *file, const char *path, const char *content, int version);
/* Writes the remaining data to the disk. */
bool hdf5_finish(struct hdf5_file *file);
void hdf5_release(struct hdf5_file *file);

/* Why the last call of HDF5 failed, in words. */
const char *hdf5_cause(void);
/* Reports `fact` and the cause that HDF5 has, unless the file has failed before. HDF5 forgets the cause at
 * its next call. Returns false. */
bool hdf5_fail(struct hdf5_file *file, const char *fact);
/* The same without a cause of HDF5: the content of the file is wrong. */
bool hdf5_refuse(struct hdf5_file *file, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Attributes of the group or dataset `object`. */
bool hdf5_put_text(struct hdf5_file *file, const char *object, const char *name, const char *text);
bool hdf5_put_texts(struct hdf5_file *file, const char *object, const char *name, const char *const *texts,
                    int count);
bool hdf5_put_whole(struct hdf5_file *file, const char *object, const char *name, long value);
bool hdf5_put_number(struct hdf5_file *file, const char *object, const char *name, double value);

/* Makes the group and the groups on its path that are missing. */
bool hdf5_make_group(struct hdf5_file *file, const char *path);

/* A dataset of `rows` x `size` numbers, or of `rows` numbers if `size` is 0. A growing one gets its rows
 * later. */
struct hdf5_shape {
    hsize_t rows, size;
    bool grows;
};

/* The new dataset; its groups are made. Negative if it could not be made. */
hid_t hdf5_make_dataset(struct hdf5_file *file, const char *path, hid_t type, struct hdf5_shape shape);
/* A dimension scale of `count` numbers or texts; `values` have the memory type `type`. The unit may be NULL.
 */
bool hdf5_make_scale(struct hdf5_file *file, const char *path, hid_t stored, hid_t type, long count,
                     const void *values, const char *unit);
/* Attaches a scale to axis number `axis` of a dataset. */
bool hdf5_attach_scale(struct hdf5_file *file, hid_t dataset, const char *scale, unsigned axis);

/*
 * The gate: a separate process that reads HDF5 files for the program, and checks every object before it reads
 * any of its data. hdf5_gate.c says what it refuses. The program itself calls no function of HDF5 to read;
 * hdf5_input.c checks what the gate sends.
 *
 * Through the socket go numbers of 8 bytes, in the byte order of the machine, and texts as length and bytes:
 * first all objects, then one answer for each request. An answer begins with an enum gate_answer.
 */

enum gate_answer {
    GATE_FACT,   /* a text: why the file is refused; the gate ends */
    GATE_OBJECT, /* one more object: its group, kind, rank, two sizes, path, axis or "", attributes: each its
                    kind, name, count, values */
    GATE_END,    /* there are no more objects */
    GATE_ROWS    /* all numbers of the rows, or all texts */
};

/* Kinds of objects and attributes. */
enum hdf5_kind { HDF5_GROUP, HDF5_TEXTS, HDF5_WHOLES, HDF5_NUMBERS, HDF5_OTHER, HDF5_KIND_COUNT };

/* Requests rows [first, first + count) of the dataset that is object number `object`. */
struct gate_request {
    int64_t object, first, count;
};

enum {
    GATE_SINGLE = -1, /* count of an attribute that is not a list */
    GATE_NO_MORE = -1 /* instead of a kind: the object has no more attributes */
};

/* Serves the file until the other end of the socket is closed. Does not return. */
_Noreturn void hdf5_gate_serve(const char *path, int socket);

/* An HDF5 file that is read: all its objects with their attributes, and rows of its datasets. Rows are read
 * in blocks, so that memory does not grow with their number. Errors are reported as above. */

struct hdf5_attribute {
    const char *name;
    enum hdf5_kind kind;
    bool is_list;
    int count;          /* values */
    const char **texts; /* (count) or NULL */
    double *numbers;    /* (count) or NULL */
};

struct hdf5_object {
    const char *path; /* "/q"; "/" for the file */
    const char *name; /* the last part of the path */
    const char *axis; /* path of the scale along the second axis; NULL if there is none */
    int group;        /* number of its group; -1: the file itself */
    enum hdf5_kind kind;
    int rank;     /* of a dataset, otherwise 0 */
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
    int count, room; /* in the order of creation; the content of a group follows the group */

    struct hdf5_taken *taken;
    int taken_count, taken_room;
    int width, text_width;     /* how many numbers and texts a row has */
    long first, held, block;   /* rows in memory, and how many fit */
    double *values;            /* (block x width) */
    char **texts;              /* (block x text_width) in heap memory */
    double bytes;              /* of the file */
    pid_t gate;                /* 0 if it does not run */
    int socket;                /* to the gate */
    FILE *answers;             /* from the gate */
    bool is_quiet, has_failed; /* never reports errors; has failed, which was reported unless it is quiet */
};

/* Opens a file, which must have the attribute "content" and this version; `what` names it in words: "file of
 * runs". Call hdf5_input_close in any case. */
bool hdf5_input_open(struct hdf5_input *input, const char *path, const char *content, int version,
                     const char *what);
/* Returns whether the file has that content; reports nothing. */
bool hdf5_input_is(const char *path, const char *content);
void hdf5_input_close(struct hdf5_input *input);
/* Reports that the content of the file is wrong. Returns false. */
bool hdf5_input_refuse(struct hdf5_input *input, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Returns NULL if the file or the object has no such attribute. */
const struct hdf5_object *hdf5_input_find(const struct hdf5_input *input, const char *path);
const struct hdf5_attribute *hdf5_object_attribute(const struct hdf5_object *object, const char *name);
/* A single text, which lives as long as the input; NULL if there is none. */
const char *hdf5_object_text(const struct hdf5_object *object, const char *name);
/* Reads a single whole number. Returns false if there is none. */
bool hdf5_object_whole(const struct hdf5_object *object, const char *name, long *value);

/* All values of a dataset with one axis, in the input's memory; NULL after a reported error. */
double *hdf5_input_numbers(struct hdf5_input *input, const struct hdf5_object *object);
const char **hdf5_input_texts(struct hdf5_input *input, const struct hdf5_object *object);

/* Adds the numbers, or the text, of this dataset to the rows, from `place` on. */
void hdf5_input_take(struct hdf5_input *input, const struct hdf5_object *object, int place);
/* Allocates memory for `width` numbers and `text_width` texts a row. Call it after all datasets are added. */
void hdf5_input_make_room(struct hdf5_input *input, int width, int text_width);
/* Reads one row of `total`: its numbers and texts, which are valid until the next call. */
bool hdf5_input_row(struct hdf5_input *input, long row, long total, const double **values, char ***texts);

/* Rows of an HDF5 file that is written. A row has one or several numbers, or a text, for each dataset. Rows
 * are written in blocks, so that memory does not grow with their number. */

/* A dataset and its part of a row. */
struct hdf5_column {
    hid_t dataset;
    int place; /* of its first number among the numbers of a row, or of its text among the texts */
    int size;  /* how many numbers; 0 for a dataset with one axis */
    bool is_text;
    bool grows;
};

struct hdf5_rows {
    struct hdf5_file *file;
    struct hdf5_column *columns;
    int column_count, column_room;
    int width, text_width; /* how many numbers and texts a row has */
    long first, count;     /* the rows that are held; first counts from the start of the file */
    long room;
    double *values; /* (room x width) */
    char **texts;   /* (room x text_width) in heap memory */
};

/* The number of rows in a block, for rows of this many numbers and texts. */
long hdf5_rows_in_block(int width, int text_width);

/* Add columns before the first row. Call hdf5_rows_release in any case. */
void hdf5_rows_start(struct hdf5_rows *rows, struct hdf5_file *file);
/* Adds a dataset, which the rows own from now on. Returns false for an invalid dataset. */
bool hdf5_rows_add(struct hdf5_rows *rows, struct hdf5_column column);
/* Allocates memory for `width` numbers and `text_width` texts a row. Forgets rows that are held. */
void hdf5_rows_make_room(struct hdf5_rows *rows, int width, int text_width);

/* Copies the next row. */
bool hdf5_rows_put(struct hdf5_rows *rows, const double *values, const char *const *texts);
/* Writes the rows that are held to the file. */
bool hdf5_rows_flush(struct hdf5_rows *rows);
void hdf5_rows_release(struct hdf5_rows *rows);

#endif
