/* What this folder offers. */
#ifndef REFDYN_TOOL_RUNS_H
#define REFDYN_TOOL_RUNS_H

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>

#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/*
 * The journal of a batch: what each case gave, written as it ends, so that a kill loses the cases in flight
 * and no other.
 *
 * A file beside the result, NAME.journal, locked while a batch writes to it: a head that tells of what batch
 * it is, then a record for each case, in the order in which they ended. Each has a checksum; what stands
 * behind the last good record was being written when the program was killed, and is written anew.
 */

/* What must be the same for a batch to go on: hashes of its parts, which are named here in words. */
enum { JOURNAL_PARTS = 4, JOURNAL_HASH = 65 };
extern const char *const journal_parts[JOURNAL_PARTS];

struct journal_key {
    char hash[JOURNAL_PARTS][JOURNAL_HASH];
};

struct journal {
    char *path;
    int file;         /* -1: not open */
    int width;        /* numbers of a case */
    long count;       /* records */
    bool has_reasons; /* one of them has a reason */
    int64_t *offsets; /* (case_count) by number of the case, where its record is; 0: it has none */
    long case_count;  /* of the whole batch */
    int64_t end;      /* behind the last record */
    char *room;       /* for one record */
    size_t room_size;
    double *values; /* (width) of journal_get */
};

/*
 * Opens the journal of the result `result` for a batch of `case_count` cases that keep `width` numbers each.
 * One that is there is gone on with when `resume` is set and its key is the same, and refused otherwise; one
 * without a record is written anew unless `resume` is set.
 * False, with a complaint on stderr; journal_close in any case.
 */
bool journal_open(struct journal *journal, const char *result, const struct journal_key *key, long case_count,
                  int width, bool resume);
/* Are all its cases among `first` to `end` - 1? False, with a complaint: the result would be without some. */
bool journal_is_within(const struct journal *journal, long first, long end);
/* Adds a record. Not to be called by two threads at once. False, with a complaint, when it is not written. */
bool journal_put(struct journal *journal, const struct case_record *record);
/* The record of a case, valid until the next call; false: it has none, or, with a complaint, it is damaged.
 */
bool journal_get(struct journal *journal, long number, struct case_record *record);
/* The result is complete: the journal is removed. */
void journal_remove(struct journal *journal);
void journal_close(struct journal *journal);

/*
 * What a batch keeps of its motions: the layout of the numbers of a case, and the recorder that fills them.
 *
 * Takes what the sweep wants to be kept and the models of all structures; gives the items of a runs file and
 * the times at which states are looked at. A recorder belongs to one thread and one structure: it takes the
 * states of a case one after the other.
 */

/* Times at which states are seen: number 0 is the start, the last the end. */
struct seen_times {
    int count;         /* with the start */
    const double *t;   /* (count) [s] */
    const int *output; /* (count) which output it is, -1: none */
    const int *at;     /* (count) which of keep.at, -1: none */
    int output_count;
};

enum kept_kind { KEPT_FINAL, KEPT_AT, KEPT_EXTREMES, KEPT_NORM, KEPT_HISTORY };

/* Items of a layout, and what each of them is. */
struct kept {
    struct seen_times times;
    enum kept_kind *kinds; /* (layout.item_count) */
    const char **columns;  /* (layout.item_count) names in the table of a motion */
};

/* The outputs of `every` from t to `until`, those of a 200th of the motion where it is 0 and something is
 * kept of them, and the times of keep->at. */
struct seen_times seen_times_make(struct memory *memory, const struct keep *keep, double t, double until,
                                  double every);

/* Adds items and axes for these models to the layout. False, with a complaint: a name of `keep` is no column
 * of any of them. */
bool kept_lay_out(struct memory *memory, const struct keep *keep, const struct refdyn_model *const *models,
                  int model_count, struct kept *kept, struct runs_layout *layout);

/* Can an HDF5 file have all names of `keep` in that layout? Complains about the first one that it cannot
 * have. */
bool kept_fits_hdf5(const struct keep *keep, const struct runs_layout *layout);

struct recorder {
    const struct kept *kept;
    const struct runs_layout *layout;
    struct table table;
    int *places;    /* (item_count) columns of the table, -1: this structure has none */
    double *values; /* (layout->width) of the case */
    double *before; /* (item_count) squares at the output before, of norms */
    double t_before;
    bool keeps_ends_alone;
};

void recorder_start(struct recorder *recorder, const struct kept *kept, const struct runs_layout *layout,
                    struct refdyn_integrator *integrator);
/* A case begins: nothing is known of it. */
void recorder_clear(struct recorder *recorder);
/* The state number `number` of seen times, as the integrator has it. */
void recorder_see(struct recorder *recorder, int number);
/* An event has ended the case at t: what is kept of its end, and of its whole way. */
void recorder_end(struct recorder *recorder, double t);
/* The case failed: what would be of its end or of its whole way is not known. */
void recorder_fail(struct recorder *recorder, double t);

/*
 * All that a batch needs before its first case: cases, compiled structures, the layout of what is kept, and
 * what tells this batch from others.
 */

struct batch_setup {
    struct memory memory;   /* of all below */
    struct options options; /* of the command, and where it is silent those of the sweep */
    struct refdyn_options integration;
    struct scene base; /* the model with the settings of the command alone: not compiled */
    struct sweep sweep;
    long first, end; /* cases that this call computes */
    int threads, lanes;
    struct structures structures;
    struct kept kept;
    struct runs_layout layout;
    struct journal_key key;
};

/* Reads, checks, compiles. Complains on stderr; batch_setup_close in any case. */
enum status batch_setup_open(struct batch_setup *setup, const struct options *options);
/* The same where options and cases are there. */
enum status batch_setup_complete(struct batch_setup *setup);
void batch_setup_close(struct batch_setup *setup);

/* ---- batch_identity.c ---- */

/* Calls for each file that the motions read, which are the state and the samples of inputs, until one call is
 * false; false: one was. */
bool batch_for_each_file(const struct batch_setup *setup, bool call(void *context, const char *path),
                         void *context);

/* The key of the journal, and the attributes of the file: texts and hashes of model, sweep and options, and
 * hashes of the files that the motions read. */
void batch_identify(struct batch_setup *setup);
/* Settings and options of the motions, as the attribute `options` of a file has them; their texts live as
 * long as it. */
void batch_read_options(const json_t *from, struct options *options);
/* Are the texts of model, sweep, options and files in a file of runs those that were written into it?
 * Complains about the first one that is not. */
bool batch_check_texts(const struct runs_reader *runs, const char *path);
/* Of a file's content; false, with a complaint, when it cannot be read. */
bool batch_hash_file(const char *path, char hash[static JOURNAL_HASH]);

/*
 * The cases of a batch computed: what happens on its threads.
 */

/* Cases of which something is told, and the lowest of them. */
struct noted_cases {
    long count, first;
};

struct batch_count {
    long cases, failed; /* that ended in this call, well or not */
    /* that started from an equilibrium which is unstable, or which lies beyond a limit point of the load */
    struct noted_cases unstable, beyond;
    struct noted_cases far;           /* that a projection of the start has moved far */
    double cases_cpu_s;               /* of these cases: the sum of their shares */
    double cpu_started, wall_started; /* clocks when the first case began */
    double cpu_s, wall_s;             /* of all since then: threads, journal, file; by batch_time_passed */
    long steps, steps_alone;          /* all, and those that motions took themselves, outside lanes */
};

/* Where records go, and which cases have one already. */
struct batch_sink {
    void *context;
    bool (*has)(void *context, long number);
    /* Of one case at a time. False, with a complaint: it cannot be taken. */
    bool (*take)(void *context, const struct case_record *record);
};

/*
 * Computes all cases of the setup that the sink does not have, and gives it their records. Shows how far it
 * is. STATUS_FAULT when a record cannot be taken, STATUS_NUMBERS when a signal came.
 */
enum status batch_run(struct batch_setup *setup, const struct batch_sink *sink, struct batch_count *count);

/* Time of the program until now. */
void batch_time_passed(struct batch_count *count);

/* The batch of one structure without its cases, threads and callbacks. */
struct refdyn_batch batch_of_structure(const struct batch_setup *setup, const struct structure *structure);

/*
 * Files that a case of a batch reads, found again: samples of inputs and a STATE.json.
 */

/* Where the files may be. */
struct case_files {
    const json_t *hashes; /* by the path that the batch was given */
    const char *folder;   /* in which the batch was called; NULL: not known */
    const char *runs;     /* the file of runs */
};

/*
 * Replaces the paths in the setup's options and cases by those at which the files are now: as they are
 * written, seen from the folder of this call, from that of the batch, or from that of the file of runs. A
 * file counts when it has the content that the batch read. False, with a complaint: one is nowhere.
 */
bool runs_case_files_find(const struct case_files *files, struct batch_setup *setup);

/*
 * What has the name of a batch's result already: a batch that goes on with itself neither computes again what
 * is complete nor replaces what is another's.
 */

enum runs_present_result {
    PRESENT_NONE,     /* no file, or one of this batch that lacks some of the cases */
    PRESENT_COMPLETE, /* the cases [first, end) of this batch, maybe among others */
    PRESENT_OTHER     /* it cannot be read or is of another batch, as is told on stderr */
};

/* Of the file of runs `path`, by its attributes and its numbers of cases. */
enum runs_present_result runs_present_result(const struct batch_setup *setup, const char *path, long first,
                                             long end);

/*
 * The runs of a batch as CSV, where one row a case is enough: its number, what varied (a start value under
 * NAME_start), its status, what was kept of its end, of its extremes and norms. The reason is the last
 * column, only where one of the cases has a reason, so that other files have only numbers, except for texts
 * that vary.
 */

/* The name of the first item that a row has no place for, NULL: there is none. */
const char *runs_csv_unfit(const struct runs_layout *layout);
/* The first name that two columns would share; NULL: all names differ. */
const char *runs_csv_twice(const struct runs_layout *layout);
void runs_csv_header(const struct runs_layout *layout, bool has_reasons, FILE *out);
void runs_csv_row(const struct runs_layout *layout, bool has_reasons, const struct case_record *record,
                  FILE *out);

/*
 * Commands, and their options.
 */

extern const struct command sim_command, merge_command;
/* The options of batches. */
extern const struct option_rule batch_rules[];
enum status run_batch(const struct options *options);
/* `sim` of a case of a batch. */
enum status run_case_again(const struct options *options);

#endif
