/* Files of HDF5: the cases of a batch; files of many motions; files of one motion. A build without HDF5
 * reports that it cannot read or write them. */
#ifndef REFDYN_TOOL_HDF5_FILES_H
#define REFDYN_TOOL_HDF5_FILES_H

#include <stdbool.h>
#include <stddef.h>

/*
 * The cases of a batch: what varies between them, and its value in each. A column has a name of the model: a
 * parameter, an input, the start value (NAME) or start rate (NAME_d) of a coordinate, or an option, whose
 * values are texts and may change the structure. The column `inputs` has the files with the input samples of
 * each case.
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
    const char *target; /* of the parameter, input, coordinate or option; "inputs" for samples */
    const char *unit;   /* "" if there is none */
    enum varied_kind kind;
    double *values;     /* (count) the number in each case; for texts, the index of the text */
    const char **texts; /* (text_count) the different texts of an option or of files; NULL for numbers */
    int text_count;
};

struct cases {
    long count;
    int width;
    struct varied *columns; /* (width) */
};

/*
 * A file of many motions, RUNS.h5: its layout, and its rows, one for each case.
 *
 * The file knows nothing of models. A layout lists what varies, what is kept of each case and under which
 * names, and texts about the whole.
 *
 *   /case              (cases) numbers of the cases, ascending: the dimension scale of all first axes
 *   /cases/NAME        (cases) what varies: numbers, or texts
 *   /status /reason    (cases) 0 done, 3 the numbers failed, 1 the case has an error; the reason in words
 *   /steps /cpu_s      (cases)
 *   /GROUP/NAME        (cases) or (cases x size), by the item
 */

struct memory;

/* One item that a case keeps: `size` of its numbers, from `offset` on. */
struct kept_item {
    const char *group, *name, *unit; /* "final", "E_x", "m"; unit NULL if it is unknown */
    int size, offset;
    const char *axis; /* name of the axis below that is the second axis; NULL if size is 1 */
};

/* Values along a second axis: the dataset and dimension scale /GROUP/NAME, "history/t" [s]. Without values
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
    struct cases cases; /* the columns that vary, with the values of all cases of the batch, by number */
    int item_count, axis_count, attribute_count;
    struct kept_item *items;
    struct kept_axis *axes;
    struct attribute *attributes; /* of the whole file */
    int width;                    /* how many numbers a case keeps */
};

struct case_record {
    long number;
    int status;
    long steps;
    double cpu_s;
    const char *reason;   /* "" if there is none */
    const double *values; /* (width) NaN if the case does not have the number */
};

/* Creates the file `path` for `count` cases. It replaces an existing file and may be the part of a target,
 * which the caller gives its name after closing. The layout must live until then. Returns NULL and reports on
 * stderr if it fails. */
struct runs_writer *hdf5_runs_create(const char *path, const struct runs_layout *layout, long count);
/* Writes the next case; numbers ascend. Returns false and reports the error if it cannot. */
bool hdf5_runs_put(struct runs_writer *writer, const struct case_record *record);
/* Adds processor time that all cases have caused together, in equal shares, to their cpu_s. Call it after the
 * last case. */
bool hdf5_runs_share_time(struct runs_writer *writer, double seconds);
/* Writes the remaining data to the disk. Returns false and reports the error if it cannot, or if fewer than
 * `count` cases were written. Releases the writer in any case. */
bool hdf5_runs_finish(struct runs_writer *writer);
/* Releases the writer of a file that is given up. */
void hdf5_runs_drop(struct runs_writer *writer);

/* Returns NULL and reports the reason, with the name of the file, if it cannot be read, is no file of runs,
 * or is truncated. */
struct runs_reader *hdf5_runs_open(const char *path);
/* The layout; the values of its columns are those of the cases in the file, by row. */
const struct runs_layout *hdf5_runs_layout(const struct runs_reader *reader);
long hdf5_runs_count(const struct runs_reader *reader);
/* Number of cases of the whole batch; the file may have a part of them. It is cases.count of the layout as
 * written. */
long hdf5_runs_batch_count(const struct runs_reader *reader);
/* (hdf5_runs_count) numbers of the cases. */
const long *hdf5_runs_numbers(const struct runs_reader *reader);
/* Reads row `row`; the record is valid until the next call. Returns false and reports the error if it cannot.
 */
bool hdf5_runs_get(struct runs_reader *reader, long row, struct case_record *record);
/* The text of an attribute; NULL if there is none. */
const char *hdf5_runs_attribute(const struct runs_reader *reader, const char *name);
void hdf5_runs_close(struct runs_reader *reader);

/* A file of one motion, RUN.h5: its layout, and its rows, one for each output. The attribute `columns` of a
 * dataset has the names that its numbers have in a CSV of the same motion. */

struct record_part; /* the columns of one dataset: runtime/record/record.h */

/* An attribute of the group `object`, "/" or "/parameters", which is made if needed: a text or a number. */
struct motion_fact {
    const char *object, *name, *text; /* NULL for a number */
    double number;
};

struct motion_layout {
    const struct record_part *parts;
    const struct motion_fact *facts;
    const char *const *names; /* (width) of the numbers of a row */
    const char *const *units; /* (width) of the numbers of a row; NULL if unknown */
    int part_count, fact_count, width;
};

/* Creates the file `path`, replacing an existing one. Returns NULL and reports on stderr if it fails. */
struct motion_writer *hdf5_motion_create(const char *path, const struct motion_layout *layout);
/* Writes the next row. Returns false and reports the error if it cannot. */
bool hdf5_motion_put(struct motion_writer *writer, const double *values);
/* Writes the remaining data to the disk. Returns false and reports the error if it cannot. Releases the
 * writer in any case. */
bool hdf5_motion_finish(struct motion_writer *writer);

/* Returns whether the file is of this kind; reports nothing. */
bool hdf5_motion_is_in(const char *path);
/* Returns NULL and reports on stderr if it fails. */
struct motion_reader *hdf5_motion_open(const char *path);
/* Names of the columns, in the order of the CSV, and their number. */
const char *const *hdf5_motion_names(const struct motion_reader *reader, int *count);
/* Reads the next row, (count) finite numbers. Returns 1, 0 after the last row, or -1 after a reported error.
 */
int hdf5_motion_next(struct motion_reader *reader, double *values);
/* Calls `take` with the attributes of a group such as "/parameters", in the order of their names. The text of
 * a number is NULL. A missing group has no attributes. */
void hdf5_motion_give_facts(const struct motion_reader *reader, const char *group,
                            void take(void *context, const struct motion_fact *fact), void *context);
/* Does nothing for NULL. */
void hdf5_motion_close(struct motion_reader *reader);

#endif
