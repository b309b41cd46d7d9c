/*
 * A file of many motions, RUNS.h5: its layout, and its rows, one a case.
 *
 * Knows nothing of models: a layout lists what varied, what was kept of each case and under which names, and
 * texts about the whole. `refdyn batch` writes it, `merge`, `plot` and `sim --case` read it. Without HDF5 the
 * functions complain that this refdyn is built without it.
 *
 *   /case              (cases) numbers of the cases, ascending: the dimension scale of all first axes
 *   /cases/NAME        (cases) what varied: numbers, or texts
 *   /status /reason    (cases) 0 done, 3 the numbers failed, 1 the case is at fault; why, in words
 *   /steps /cpu_s      (cases)
 *   /GROUP/NAME        (cases) or (cases x size), by the item
 */
#ifndef REFDYN_TOOL_RUNS_FILE_H
#define REFDYN_TOOL_RUNS_FILE_H

#include "batch/cases.h"

#include <stddef.h>

struct memory;

/* What one case keeps under one name: `size` of its numbers, from `offset` on. */
struct kept_item {
    const char *group, *name, *unit; /* "final", "E_x", "m"; unit NULL: none is known */
    int size, offset;
    const char *axis; /* of the second axis, a name of an axis below; NULL where size is 1 */
};

/* Values along a second axis: the dataset /GROUP/NAME and dimension scale, "history/t" [s]; without values
 * its entries have names: "extremes/which". */
struct kept_axis {
    const char *path, *unit;
    int count;
    const double *values;     /* (count) or NULL */
    const char *const *names; /* (count) or NULL */
};

struct attribute {
    const char *name, *text;
};

struct runs_layout {
    struct cases cases; /* columns as they vary; values are those of all cases of the batch, by number */
    int item_count, axis_count, attribute_count;
    struct kept_item *items;
    struct kept_axis *axes;
    struct attribute *attributes; /* of the whole file */
    int width;                    /* numbers that a case keeps */
};

struct case_record {
    long number;
    int status;
    long steps;
    double cpu_s;
    const char *reason;   /* "" where there is none */
    const double *values; /* (width) NaN: the case does not have it */
};

/* ---- Writing ---- */

struct runs_writer;

/* Of `count` cases into the file `path`, which is written anew and may be a target's part: the caller gives
 * it its name once it is closed. The layout lives until then. NULL, with a complaint on stderr. Writes in
 * blocks of rows: memory does not grow with `count`. */
struct runs_writer *runs_create(const char *path, const struct runs_layout *layout, long count);
/* The next case; numbers ascend. False, with a complaint, when it cannot be written. */
bool runs_put(struct runs_writer *writer, const struct case_record *record);
/* Adds processor time that all cases have caused together, in equal shares, to their cpu_s; after the last
 * one. */
bool runs_share_time(struct runs_writer *writer, double seconds);
/* All in the file and on the disk. False, with a complaint, also where fewer than `count` cases were put; in
 * any case the writer is released. */
bool runs_finish(struct runs_writer *writer);
/* Releases the writer of a file that is given up. */
void runs_drop(struct runs_writer *writer);

/* ---- Reading ---- */

struct runs_reader;

/* NULL, with a complaint that names the file: it cannot be read, is no file of runs, is cut off. */
struct runs_reader *runs_open(const char *path);
/* The layout; columns' values are those of the cases in the file, by row. */
const struct runs_layout *runs_layout(const struct runs_reader *reader);
long runs_count(const struct runs_reader *reader);
/* Cases of the whole batch, of which the file may have a part: the layout's cases.count as it was written. */
long runs_batch_count(const struct runs_reader *reader);
/* (runs_count) numbers of the cases. */
const long *runs_numbers(const struct runs_reader *reader);
/* Row `row`; the record is valid until the next call. False, with a complaint. */
bool runs_get(struct runs_reader *reader, long row, struct case_record *record);
/* The text of an attribute, NULL: there is none. */
const char *runs_attribute(const struct runs_reader *reader, const char *name);
void runs_close(struct runs_reader *reader);

#endif
