/*
 * Answers that the gate for HDF5 files sends to the program (hdf5_gate.h has the order), and its limits of
 * time, memory and texts.
 *
 * The program receives each answer whole. If the gate cannot answer, it sends a fact instead and ends.
 */
#ifndef REFDYN_TOOL_HDF5_ANSWERS_H
#define REFDYN_TOOL_HDF5_ANSWERS_H

#include "hdf5/hdf5_file.h"
#include "hdf5/hdf5_gate.h"

#include <stdio.h>

struct answers {
    FILE *out;    /* to the program */
    FILE *stream; /* the answer in the making, into `text` */
    char *text;
    size_t length;
    double bytes;     /* size of the file that is read */
    double text_left; /* bytes of texts that the present request may still take */
};

/* Answers go through the socket and concern the file `path`. Limits memory, and the work until the first
 * request. */
void answers_start(struct answers *answers, const char *path, int socket);
/* Limits the work of the next request. */
void answers_bound_work(struct answers *answers);

void answers_begin(struct answers *answers, enum gate_answer answer);
void answers_put_whole(struct answers *answers, int64_t number);
void answers_put_bytes(struct answers *answers, const char *text, size_t length);
void answers_end(struct answers *answers);

/* Sends the fact and ends the process. */
_Noreturn void answers_refuse(struct answers *answers, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Returns `result` of a function of HDF5. If that is an error, refuses with it as a fact about the object. */
hid_t answers_good(struct answers *answers, const char *path, hid_t result);

#endif
