/* Runs: computes the cases of a batch and writes their file of runs. Parts: journal; numbers that are kept;
 * setup and identity; computation; a file that already has the name of the result; commands. */
#ifndef REFDYN_TOOL_RUNS_H
#define REFDYN_TOOL_RUNS_H

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>

#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/* Journal: NAME.journal next to the result NAME has what each case returned, on disk as soon as the case
 * ends. It is locked while a batch writes to it. A head identifies the batch. */

/* A batch can be resumed while the hashes of these parts are equal. The names are words for messages. */
enum { JOURNAL_PARTS = 4, JOURNAL_HASH = 65 };
extern const char *const runs_journal_parts[JOURNAL_PARTS];

struct journal_key {
    char hash[JOURNAL_PARTS][JOURNAL_HASH];
};

struct journal {
    char *path;
    int file;         /* -1: not open */
    int width;        /* numbers of a case */
    long count;       /* records */
    bool has_reasons; /* at least one record has a reason */
    int64_t *offsets; /* (case_count) position of the record of each case, 0 if it has none */
    long case_count;  /* of the whole batch */
    int64_t end;      /* position after the last record */
    char *room;       /* scratch for one record */
    size_t room_size;
    double *values; /* (width) that runs_journal_get returns */
};

/* Opens the journal of the result `result` for a batch of `case_count` cases that keep `width` numbers each.
 * An existing journal is resumed if `resume` is set and its key is equal, and refused otherwise. One without
 * a record is overwritten unless `resume` is set. Returns false and reports the error on stderr; call
 * runs_journal_close in any case. */
bool runs_journal_open(struct journal *journal, const char *result, const struct journal_key *key,
                       long case_count, int width, bool resume);
/* Returns whether all its cases are within [first, end); otherwise reports the error, as the result would
 * lack a case. */
bool runs_journal_is_within(const struct journal *journal, long first, long end);
/* Adds a record; only one thread at a time may call it. Returns false and reports the error if it cannot
 * write. */
bool runs_journal_put(struct journal *journal, const struct case_record *record);
/* Reads the record of a case, valid until the next call. Returns false if there is none, or reports the error
 * if it is damaged. */
bool runs_journal_get(struct journal *journal, long number, struct case_record *record);
/* Removes the journal of a complete result. */
void runs_journal_remove(struct journal *journal);
void runs_journal_close(struct journal *journal);

/* Numbers that are kept: their layout follows from what the sweep keeps and from the models of all
 * structures. It has the items of a file of runs, and the times at which states are recorded. */

/* Times at which states are recorded, from the start to the end. */
struct seen_times {
    int count;
    const double *t;   /* (count) [s] */
    const int *output; /* (count) number of the output, -1 if it is no output */
    const int *at;     /* (count) index in keep.at, -1 if it is not there */
    int output_count;
};

enum kept_kind {
    KEPT_FINAL,
    KEPT_AT,
    KEPT_EXTREMES,
    KEPT_NORM,
    KEPT_HISTORY,
    KEPT_DERIVATIVE,
    KEPT_LIMIT,
    KEPT_REALISE
};
enum { RUNS_LIMIT_SIZE = 6 }; /* numbers of a limit: as for extremes, first time beyond, time beyond */

/* What each item of a layout is. */
struct kept {
    struct seen_times times;
    enum kept_kind *kinds;               /* (layout.item_count) */
    const char **columns;                /* (layout.item_count) names in the table of a motion */
    const struct name_list *derivatives; /* by which the final state is differentiated */
};

/* Derivatives of the final states of one structure's cases (case_derivatives.c). */
struct case_derivatives;

/* Recorders (case_recorder.c). */

/* The last outputs of a value with bounds. */
struct limit_track {
    double t[2], value[2]; /* the last but one, the last */
    int count;             /* of outputs so far, at most 2 */
};

/* Fills the numbers that a batch keeps of one case from the states of its motion. A recorder belongs to one
 * thread and one structure, and records one case after another. */
struct recorder {
    const struct kept *kept;
    const struct runs_layout *layout;
    struct record_table *table;
    int *places;                 /* (item_count) columns of the table, -1 if this structure has none */
    struct record_bound *bounds; /* (item_count) of limits */
    struct limit_track *tracks;  /* (item_count) the last outputs of limits */
    double *values;              /* (layout->width) of the case */
    double *before;              /* (item_count) squares at the previous output, for norms */
    double t_before;
    bool keeps_ends_alone;
    struct case_derivatives *derivatives; /* NULL: none are kept */
};

/* Starts a recorder of the states of `table`, which computes only what is kept. */
void runs_recorder_start(struct recorder *recorder, const struct kept *kept, const struct runs_layout *layout,
                         struct record_table *table, const struct model *read);
/* Begins a case: all its values are unknown (NaN). */
void runs_recorder_clear(struct recorder *recorder);
/* Records the values that the table has, at the time `number` of seen_times. */
void runs_recorder_take(struct recorder *recorder, int number);
/* Fills the table with the integrator's state and records it. */
void runs_recorder_see(struct recorder *recorder, int number);
/* Records the end of a case that an event has ended at t, and completes extremes and norms. */
void runs_recorder_end(struct recorder *recorder, double t);
/* Marks the values of the end and of the whole motion as unknown (NaN) for a case that failed at t. */
void runs_recorder_fail(struct recorder *recorder, double t);

/* d_COLUMN_by_NAME, the item of a derivative. */
const char *runs_derivative_name(const char *column, const char *by);
/* Prepares derivatives for one thread. Only one thread at a time may call it. NULL: none are kept. */
struct case_derivatives *runs_derivatives_start(const struct kept *kept, const struct runs_layout *layout,
                                                const struct refdyn_batch *batch,
                                                struct refdyn_integrator *integrator);
/* Computes the derivatives of a case that has ended and writes them into values (layout.width). If some do
 * not exist and reason (size) is empty, writes why into it. */
void runs_derive(struct case_derivatives *derivatives, long number, double *values, char *reason,
                 size_t size);
void runs_derivatives_release(struct case_derivatives *derivatives);

/* The outputs at multiples of `every` from t to `until`, and the times of keep->at. Without `every`, outputs
 * that something is kept of are a 200th of the motion apart. */
struct seen_times runs_seen_times_make(struct memory *memory, const struct keep *keep, double t, double until,
                                       double every);

/* Adds items and axes for these models, as emitted and as read, to the layout. Returns false and reports the
 * error if a name of `keep` is a column of no model. */
bool runs_kept_lay_out(struct memory *memory, const struct keep *keep,
                       const struct refdyn_model *const *models, const struct model *const *read,
                       int model_count, struct kept *kept, struct runs_layout *layout);

/* Returns whether HDF5 allows all names of `keep` in that layout; reports the first one that it does not
 * allow. */
bool runs_kept_fits_hdf5(const struct keep *keep, const struct runs_layout *layout);

/* Setup: cases, compiled structures, the layout of what is kept, and the identity of the batch. */

struct batch_setup {
    struct memory memory;   /* of all other members */
    struct options options; /* of the command line; those it leaves open come from the sweep */
    struct refdyn_options integration;
    struct scene base; /* the model with the settings of the command line only; not compiled */
    struct sweep sweep;
    long first, end; /* cases that this call computes */
    int threads, lanes;
    struct structures structures;
    struct kept kept;
    struct runs_layout layout;
    struct journal_key key;
};

/* Reads, checks and compiles. Reports errors on stderr; call runs_setup_close in any case. */
enum status runs_setup_open(struct batch_setup *setup, const struct options *options);
/* The same for a setup that already has its options and cases. */
enum status runs_setup_complete(struct batch_setup *setup);
void runs_setup_close(struct batch_setup *setup);

/* Calls `call` for each file that the motions read: the state and the samples of inputs. Stops and returns
 * false when a call returns false. */
bool runs_for_each_file(const struct batch_setup *setup, bool call(void *context, const char *path),
                        void *context);

/* Reads settings and options of the motions from the attribute `options` of a file of runs; their texts live
 * as long as `from`. */
void runs_read_options(const json_t *from, struct options *options);
/* Returns whether the attributes model, sweep, options and files of a file of runs match their hashes;
 * reports the first one that does not. */
bool runs_check_texts(const struct runs_reader *runs, const char *path);
/* The hash of a file's content. Returns false and reports the error if the file cannot be read. */
bool runs_hash_file(const char *path, char hash[static JOURNAL_HASH]);

/* Cases that a warning concerns: how many, and the lowest number. */
struct noted_cases {
    long count, first;
};

/* Bytes of the reason of a case, with the final 0. */
enum { REASON_LENGTH = 512 };

struct batch_count {
    long cases; /* that ended in this call */
    struct noted_cases failed;
    char reason[REASON_LENGTH]; /* why the first of these failed */
    /* that started from an equilibrium which is unstable, or which is beyond a limit point of the load */
    struct noted_cases unstable, beyond;
    struct noted_cases far;           /* whose start the projection has moved far */
    double cases_cpu_s;               /* sum of the shares of these cases */
    double cpu_started, wall_started; /* clocks when the first case began */
    double cpu_s, wall_s;             /* since then, for threads, journal and file; set by runs_time_passed */
    long steps, steps_alone;          /* all steps; those taken one motion at a time, outside lanes */
};

/* Receives records, and knows which cases already have one. */
struct batch_sink {
    void *context;
    bool (*has)(void *context, long number);
    /* Called for one case at a time. Returns false and reports the error if it cannot store the record. */
    bool (*take)(void *context, const struct case_record *record);
};

/* Computes all cases of the setup that the sink does not have, passes their records to it, and shows
 * progress. Returns STATUS_FAULT if a record cannot be stored, STATUS_NUMBERS after a signal. */
enum status runs_compute(struct batch_setup *setup, const struct batch_sink *sink, struct batch_count *count);

/* Computes the cases `numbers` (count) of a structure whose programmes drives perform, several at a time,
 * each in a separate process; passes their records to `take`, until it returns false or a signal arrives
 * (realised_cases.c). */
void runs_realise_cases(struct batch_setup *setup, struct structure *structure, const long *numbers,
                        long count, bool (*take)(void *context, const struct case_record *record),
                        void *context);
/* Computes one of them in this process, and passes the motion to `rows`, whose times it sets. Reports errors
 * on stderr. */
struct realise_work;
struct realise_rows;
enum status runs_realise_case(struct batch_setup *setup, struct structure *structure, long number,
                              struct realise_work *work, struct realise_rows *rows);

/* Sets the times in `count` to those passed until now. */
void runs_time_passed(struct batch_count *count);

/* The runtime's description of a batch of one structure, without cases, threads and callbacks. */
struct refdyn_batch runs_describe(const struct batch_setup *setup, const struct structure *structure);

/* A resumed batch does not compute again what is complete, and does not replace another batch's file. */
enum runs_present_result {
    PRESENT_NONE,     /* no file, or a file of this batch without some of the cases */
    PRESENT_COMPLETE, /* all cases [first, end) of this batch, possibly more */
    PRESENT_OTHER     /* unreadable or of another batch; reported on stderr */
};

/* Examines the attributes and case numbers of the file of runs `path`. */
enum runs_present_result runs_present_result(const struct batch_setup *setup, const char *path, long first,
                                             long end);

extern const struct command sim_command, merge_command;
/* The options of batches. */
extern const struct option_rule runs_batch_rules[];
/* `refdyn batch` without Slurm, and `sim` of a case of a batch. */
enum status runs_batch(const struct options *options);
enum status runs_case_again(const struct options *options);

#endif
