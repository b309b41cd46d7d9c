/*
 * The journal of a batch: what each case gave, written as it ends, so that a kill loses the cases in flight
 * and no other.
 *
 * A file beside the result, NAME.journal, locked while a batch writes to it: a head that tells of what batch
 * it is, then a record for each case, in the order in which they ended. Each has a checksum; what stands
 * behind the last good record was being written when the program was killed, and is written anew.
 */
#ifndef REFDYN_TOOL_JOURNAL_H
#define REFDYN_TOOL_JOURNAL_H

#include "batch/runs_file.h"

#include <stdint.h>

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

#endif
