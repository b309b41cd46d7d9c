/*
 * What the gate for files of HDF5 sends to the program (hdf5_gate.h has the order), and the bounds on what it
 * may take: time, memory, texts.
 *
 * The program gets each answer whole, or a fact in its place, with which the gate ends.
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
    double bytes;     /* of the file that is read */
    double text_left; /* bytes of texts that the present request may still take */
};

/* Through the socket, about the file `path`; bounds memory, and the work until the first request. */
void answers_start(struct answers *answers, const char *path, int socket);
/* Bounds the work of the next request. */
void answers_bound_work(struct answers *answers);

void answers_begin(struct answers *answers, enum gate_answer answer);
void answers_put_whole(struct answers *answers, int64_t number);
void answers_put_bytes(struct answers *answers, const char *text, size_t length);
void answers_end(struct answers *answers);

/* The fact; ends the process. */
_Noreturn void answers_refuse(struct answers *answers, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Returns `result` of a function of HDF5, unless that is an error, which is a fact about the object. */
hid_t answers_good(struct answers *answers, const char *path, hid_t result);

#endif
