/*
 * The journal of a batch: writes a record for each case, and reads those that an interrupted batch has left.
 *
 * After the head follows a record for each case, in the order in which the cases ended. A kill therefore
 * loses only the cases in progress. Each record has a checksum: bytes after the last good record were being
 * written when the program was killed, and are overwritten.
 */
#define _GNU_SOURCE
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const runs_journal_parts[JOURNAL_PARTS] = {"model files", "cases", "options",
                                                       "files of inputs or of the state"};

enum { LEAD_LENGTH = 16, REASON_MOST = 4096 };

static const char lead[LEAD_LENGTH] = "refdyn batch 2\n";

struct head {
    char lead[LEAD_LENGTH];
    struct journal_key key;
    int64_t case_count, width;
    uint64_t check;
};

/* A record begins with this; `width` numbers and the reason follow. */
struct mark {
    int64_t number, steps;
    double cpu_s;
    int32_t status, reason_length;
    uint64_t check; /* of the whole record, with 0 in this member */
};

/* FNV-1a (Fowler, Noll and Vo, 1991) over words of 64 bits. It distinguishes records from what a kill or a
 * disk error leaves. */
static uint64_t checksum(uint64_t hash, const void *data, size_t length) {
    const char *bytes = data;
    for (size_t i = 0; i < length; i += sizeof hash) {
        uint64_t word = 0;
        memcpy(&word, bytes + i, length - i < sizeof word ? length - i : sizeof word);
        hash = (hash ^ word) * 0x100000001b3;
    }
    return hash;
}

static const uint64_t checksum_start = 0xcbf29ce484222325;

static bool complain(const struct journal *journal, const char *fact) {
    format_complain("refdyn: %s: %s\n", journal->path, fact);
    return false;
}

/* ---- Reading and writing at a place ---- */

static bool write_at(struct journal *journal, const void *data, size_t length, int64_t offset) {
    const char *from = data;
    while (length > 0) {
        const ssize_t done = pwrite(journal->file, from, length, (off_t)offset);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return complain(journal, done < 0 ? strerror(errno) : "nothing could be written");
        from += done;
        offset += done;
        length -= (size_t)done;
    }
    return true;
}

/* Returns false if the file is too short. */
static bool read_at(const struct journal *journal, void *data, size_t length, int64_t offset) {
    char *to = data;
    while (length > 0) {
        const ssize_t done = pread(journal->file, to, length, (off_t)offset);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return false;
        to += done;
        offset += done;
        length -= (size_t)done;
    }
    return true;
}

/* ---- Records ---- */

static size_t record_length(const struct journal *journal, const struct mark *mark) {
    return sizeof *mark + (size_t)journal->width * sizeof(double) + (size_t)mark->reason_length;
}

static uint64_t record_check(const char *record, size_t length) {
    struct mark mark;
    memcpy(&mark, record, sizeof mark);
    mark.check = 0;
    return checksum(checksum(checksum_start, &mark, sizeof mark), record + sizeof mark, length - sizeof mark);
}

static char *room_for(struct journal *journal, size_t length) {
    if (length > journal->room_size) {
        free(journal->room);
        journal->room = format_allocate_large(1, length);
        journal->room_size = length;
    }
    return journal->room;
}

static bool may_begin_record(const struct journal *journal, const struct mark *mark) {
    return mark->reason_length >= 0 && mark->reason_length <= REASON_MOST && mark->number >= 0 &&
           mark->number < journal->case_count;
}

/* Loads the record at `offset` into the journal's scratch; returns NULL if there is no good record. */
static const struct mark *load_record(struct journal *journal, int64_t offset, size_t *length) {
    struct mark mark;
    if (!read_at(journal, &mark, sizeof mark, offset) || !may_begin_record(journal, &mark))
        return NULL;
    *length = record_length(journal, &mark);
    char *record = room_for(journal, *length);
    if (!read_at(journal, record, *length, offset) || record_check(record, *length) != mark.check)
        return NULL;
    return (const struct mark *)(const void *)record;
}

/* The position of the next good record that begins in a piece of the file from `offset` on; -1 if there is
 * none. */
static int64_t find_in_piece(struct journal *journal, const char *piece, int64_t length, int64_t offset) {
    struct mark mark;
    size_t record;
    for (int64_t i = 0; i + (int64_t)sizeof mark <= length; i++) {
        memcpy(&mark, piece + i, sizeof mark);
        if (may_begin_record(journal, &mark) && load_record(journal, offset + i, &record))
            return offset + i;
    }
    return -1;
}

/* The same from `offset` to the end of the file at `size`; `size` if there is none. */
static int64_t find_record(struct journal *journal, int64_t offset, int64_t size) {
    enum { PIECE = 1 << 16 };
    const int64_t step = PIECE - (int64_t)sizeof(struct mark) + 1;
    char *piece = format_allocate_large(1, PIECE);
    int64_t found = -1;
    for (; found < 0 && offset < size; offset += step) {
        const int64_t length = size - offset < PIECE ? size - offset : PIECE;
        if (!read_at(journal, piece, (size_t)length, offset))
            break;
        found = find_in_piece(journal, piece, length, offset);
    }
    free(piece);
    return found < 0 ? size : found;
}

static void warn_of_damage(const struct journal *journal, int64_t bytes) {
    fprintf(stderr,
            "refdyn: %s: warning: %lld bytes are damaged or incomplete; cases that were there are computed "
            "again\n",
            journal->path, (long long)bytes);
}

/* Reads all good records of a file of `size` bytes, and truncates the file after the last one. */
static bool read_records(struct journal *journal, int64_t size) {
    const struct mark *mark;
    size_t length;
    int64_t damaged = 0;
    for (int64_t at = journal->end; at < size;) {
        if (!(mark = load_record(journal, at, &length))) {
            const int64_t next = find_record(journal, at + 1, size);
            damaged += next - at;
            at = next;
            continue;
        }
        journal->count += journal->offsets[mark->number] == 0;
        journal->has_reasons |= mark->reason_length > 0;
        journal->offsets[mark->number] = at;
        journal->end = at += (int64_t)length;
    }
    if (damaged > 0)
        warn_of_damage(journal, damaged);
    return ftruncate(journal->file, (off_t)journal->end) == 0 || complain(journal, strerror(errno));
}

bool runs_journal_put(struct journal *journal, const struct case_record *record) {
    const size_t reason_length = strlen(record->reason);
    struct mark mark = {.number = record->number,
                        .steps = record->steps,
                        .cpu_s = record->cpu_s,
                        .status = record->status,
                        .reason_length =
                            (int32_t)(reason_length < REASON_MOST ? reason_length : REASON_MOST)};
    const size_t length = record_length(journal, &mark), values = (size_t)journal->width * sizeof(double);
    char *room = room_for(journal, length);
    memcpy(room, &mark, sizeof mark);
    memcpy(room + sizeof mark, record->values, values);
    memcpy(room + sizeof mark + values, record->reason, (size_t)mark.reason_length);
    mark.check = record_check(room, length);
    memcpy(room, &mark, sizeof mark);
    if (!write_at(journal, room, length, journal->end))
        return false;
    journal->offsets[record->number] = journal->end;
    journal->end += (int64_t)length;
    journal->count++;
    journal->has_reasons |= mark.reason_length > 0;
    return true;
}

bool runs_journal_get(struct journal *journal, long number, struct case_record *record) {
    static char reason[REASON_MOST + 1];
    size_t length;
    const int64_t offset = journal->offsets[number];
    if (offset == 0)
        return false;
    const struct mark *mark = load_record(journal, offset, &length);
    if (!mark)
        return complain(journal, "a record has changed since it was written");
    const char *values = (const char *)mark + sizeof *mark;
    const size_t size = (size_t)journal->width * sizeof(double);
    memcpy(journal->values, values, size);
    memcpy(reason, values + size, (size_t)mark->reason_length);
    reason[mark->reason_length] = '\0';
    *record = (struct case_record){.number = number,
                                   .status = mark->status,
                                   .steps = (long)mark->steps,
                                   .cpu_s = mark->cpu_s,
                                   .reason = reason,
                                   .values = journal->values};
    return true;
}

/* ---- The head ---- */

static struct head head_of(const struct journal *journal, const struct journal_key *key) {
    struct head head;
    memset(&head, 0, sizeof head);
    memcpy(head.lead, lead, LEAD_LENGTH);
    head.key = *key;
    head.case_count = journal->case_count;
    head.width = journal->width;
    head.check = checksum(checksum_start, &head, sizeof head);
    return head;
}

static bool is_of_same_batch(const struct journal *journal, const struct head *found,
                             const struct head *asked) {
    for (int part = 0; part < JOURNAL_PARTS; part++)
        if (memcmp(found->key.hash[part], asked->key.hash[part], JOURNAL_HASH) != 0) {
            fprintf(stderr,
                    "refdyn: %s: the %s of this batch differ from the journal's; --resume continues only the "
                    "same batch, and "
                    "without the journal the batch starts again\n",
                    journal->path, runs_journal_parts[part]);
            return false;
        }
    return true;
}

static const char not_a_journal[] = "not a journal of a batch; use another name for the result";

/* Also true for the part of a head that a kill leaves. */
static bool begins_as_journal(const struct journal *journal, int64_t size) {
    char found[LEAD_LENGTH];
    const size_t length = size < LEAD_LENGTH ? (size_t)size : LEAD_LENGTH;
    return read_at(journal, found, length, 0) && memcmp(found, lead, length) == 0;
}

static bool go_on(struct journal *journal, const struct head *asked, bool resume, int64_t size) {
    struct head found;
    if (!read_at(journal, &found, sizeof found, 0) || memcmp(found.lead, lead, LEAD_LENGTH) != 0)
        return complain(journal, not_a_journal);
    if (!resume)
        return complain(
            journal,
            "an interrupted batch has left its cases here; resume it with --resume, or remove the file "
            "to start again");
    if (!is_of_same_batch(journal, &found, asked))
        return false;
    if (memcmp(&found, asked, sizeof found) != 0)
        return complain(journal, "the head of the journal is damaged; remove the file to start again");
    return read_records(journal, size);
}

static bool open_locked(struct journal *journal) {
    journal->file = open(journal->path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (journal->file < 0)
        return complain(journal, strerror(errno));
    if (flock(journal->file, LOCK_EX | LOCK_NB) == 0)
        return true;
    return complain(journal, errno == EWOULDBLOCK ? "another refdyn is writing it" : strerror(errno));
}

bool runs_journal_open(struct journal *journal, const char *result, const struct journal_key *key,
                       long case_count, int width, bool resume) {
    struct stat status;
    *journal = (struct journal){.file = -1, .width = width, .case_count = case_count};
    journal->path = format_text("%s.journal", result);
    if (!open_locked(journal))
        return false;
    journal->offsets = format_allocate_large((size_t)case_count + 1, sizeof *journal->offsets);
    journal->values = format_allocate_large((size_t)width + 1, sizeof *journal->values);
    journal->end = sizeof(struct head);
    if (fstat(journal->file, &status) != 0 || !S_ISREG(status.st_mode))
        return complain(journal, "not a regular file");
    const struct head head = head_of(journal, key);
    const off_t size = (off_t)sizeof head;
    if (status.st_size > size || (status.st_size == size && resume))
        return go_on(journal, &head, resume, status.st_size);
    if (!begins_as_journal(journal, status.st_size))
        return complain(journal, not_a_journal);
    return write_at(journal, &head, sizeof head, 0); /* no case has ended in it */
}

bool runs_journal_is_within(const struct journal *journal, long first, long end) {
    for (long number = 0; number < journal->case_count; number++)
        if (journal->offsets[number] != 0 && (number < first || number >= end))
            return complain(journal, format_text("case %ld is done here, but --cases excludes it; --resume "
                                                 "needs the same range or a wider one",
                                                 number));
    return true;
}

void runs_journal_remove(struct journal *journal) {
    unlink(journal->path);
}

void runs_journal_close(struct journal *journal) {
    if (journal->file >= 0)
        close(journal->file);
    free(journal->offsets);
    free(journal->room);
    free(journal->values);
    *journal = (struct journal){.file = -1};
}
