/*
 * A file of one motion, RUN.h5: its layout, and its rows, one an output. Knows nothing of models.
 *
 * Each dataset has the attribute `columns`, the names that its numbers have in a CSV of the same motion.
 *
 * Without HDF5 the functions complain that this refdyn is built without it.
 */
#ifndef REFDYN_TOOL_MOTION_FILE_H
#define REFDYN_TOOL_MOTION_FILE_H

#include <stdbool.h>

/* One dataset: numbers `first` on of a row. The first dataset is the time, along which the others are. */
struct motion_part {
    const char *path;              /* "/points/E/r" */
    const char *axis;              /* of the second axis, "/axis"; NULL: one number a row */
    const char *const *axis_names; /* (count) its entries; parts on one axis have the same */
    int first, count;
};

/* Attributes of the group `object`, "/" or "/parameters", which is made; of a text, or of a number. */
struct motion_fact {
    const char *object, *name, *text; /* text NULL: a number */
    double number;
};

struct motion_layout {
    const struct motion_part *parts;
    const struct motion_fact *facts;
    const char *const *names; /* (width) of the numbers of a row */
    const char *const *units; /* (width) of the numbers of a row; NULL: not known */
    int part_count, fact_count, width;
};

struct motion_writer;

/* Into the file `path`, which is written anew. NULL, with a complaint on stderr. */
struct motion_writer *motion_create(const char *path, const struct motion_layout *layout);
/* The next row. False, with a complaint, when it cannot be written. */
bool motion_put(struct motion_writer *writer, const double *values);
/* All on the disk. False, with a complaint; in any case the writer is released. */
bool motion_finish(struct motion_writer *writer);

struct motion_reader;

/* Whether it is such a file; complains of nothing. */
bool motion_is_in(const char *path);
/* NULL, with a complaint on stderr. */
struct motion_reader *motion_open(const char *path);
/* Names of the columns, in the order of the CSV; *count tells how many. */
const char *const *motion_names(const struct motion_reader *reader, int *count);
/* The next row, (count), of finite numbers: 1; 0 after the last one; -1 with a complaint. */
int motion_next(struct motion_reader *reader, double *values);
/* Passes the attributes of a group, such as "/parameters", to `take`, in the order of their names: texts, and
 * numbers with the text NULL. A missing group has no attributes. */
void motion_give_facts(const struct motion_reader *reader, const char *group,
                       void take(void *context, const struct motion_fact *fact), void *context);
/* NULL: nothing. */
void motion_close(struct motion_reader *reader);

#endif
