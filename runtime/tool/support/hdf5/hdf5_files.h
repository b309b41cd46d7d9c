/* What this folder offers. */
#ifndef REFDYN_TOOL_HDF5_FILES_H
#define REFDYN_TOOL_HDF5_FILES_H

#include <stdbool.h>
#include <stddef.h>

/*
 * The cases of a batch: what varies from one to the next, and its value in each.
 *
 * A sweep file (sweeps.h) or a table makes them; both fix their order. A column is a name of the model: a
 * parameter, an input, a coordinate's start value (NAME) or start rate (NAME_d), an option, whose values are
 * texts and may change the structure, or `inputs`, the files with the samples of inputs of each case.
 */

enum varied_kind {
    VARIED_PARAMETER,
    VARIED_INPUT,
    VARIED_COORDINATE,
    VARIED_RATE,
    VARIED_OPTION,
    VARIED_SAMPLES
};

struct varied {
    const char *name;   /* of the column, /cases/NAME */
    const char *target; /* of the parameter, input, coordinate or option; "inputs" of samples */
    const char *unit;   /* "" where there is none */
    enum varied_kind kind;
    double *values;     /* (count) the number in each case; of texts, which of them */
    const char **texts; /* (text_count) the different texts of an option or of files; NULL: numbers */
    int text_count;
};

struct cases {
    long count;
    int width;
    struct varied *columns; /* (width) */
};

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

/*
 * A file of one motion, RUN.h5: its layout, and its rows, one an output. Knows nothing of models.
 *
 * Each dataset has the attribute `columns`, the names that its numbers have in a CSV of the same motion.
 *
 * Without HDF5 the functions complain that this refdyn is built without it.
 */

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
