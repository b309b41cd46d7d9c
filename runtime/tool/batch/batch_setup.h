/*
 * All that a batch needs before its first case: cases, compiled structures, the layout of what is kept, and
 * what tells this batch from others.
 */
#ifndef REFDYN_TOOL_BATCH_SETUP_H
#define REFDYN_TOOL_BATCH_SETUP_H

#include "batch/journal.h"
#include "batch/recorder.h"
#include "batch/structures.h"
#include "batch/sweep.h"

#include <jansson.h>

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

#endif
