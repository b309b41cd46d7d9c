/*
 * The gate: a separate process that reads HDF5 files for the program.
 *
 * The library crashes on some damaged files, and follows links to other files. The gate therefore checks
 * every object before it reads any of its data. If it crashes, the program reports a damaged file. The
 * program itself calls no function of HDF5 to read; hdf5_input.c checks what the gate sends.
 *
 * The gate refuses:
 * - links to other files and names, and two names of one object;
 * - data in other files (external, virtual), and filters that are not HDF5's own;
 * - data that are missing or cannot fit into the file;
 * - names that are not UTF-8, and scales along which a dataset is missing.
 *
 * Through the socket go numbers of 8 bytes, in the byte order of the machine, and texts as length and bytes:
 * first all objects, then one answer for each request. An answer begins with an enum gate_answer.
 */
#ifndef REFDYN_TOOL_HDF5_GATE_H
#define REFDYN_TOOL_HDF5_GATE_H

#include <stdint.h>

enum gate_answer {
    GATE_FACT,   /* a text: why the file is refused; nothing follows */
    GATE_OBJECT, /* one more: its group, kind, rank, two sizes, path, axis or "", attributes: each its kind,
                    name, count, values */
    GATE_END,    /* there are no more objects */
    GATE_ROWS    /* all numbers of the rows, or all texts */
};

/* Kinds of objects and attributes. */
enum hdf5_kind { HDF5_GROUP, HDF5_TEXTS, HDF5_WHOLES, HDF5_NUMBERS, HDF5_OTHER, HDF5_KIND_COUNT };

/* Rows [first, first + count) of the dataset that is object number `object`. */
struct gate_request {
    int64_t object, first, count;
};

enum {
    GATE_SECONDS = 1,                /* CPU time that a request may take [s], */
    GATE_BYTES_PER_SECOND = 1000000, /* and 1 s more for so many bytes of the file */
    GATE_SINGLE = -1,                /* count of an attribute that is not a list */
    GATE_NO_MORE = -1                /* instead of a kind: the object has no more attributes */
};

/* Serves the file until the other end of the socket is closed. Does not return. */
_Noreturn void gate_serve(const char *path, int socket);

#endif
