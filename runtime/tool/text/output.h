/*
 * Text that goes out: numbers that read back exactly, a small JSON writer, texts in memory.
 */
#ifndef REFDYN_TOOL_OUTPUT_H
#define REFDYN_TOOL_OUTPUT_H

#include "base/memory.h"
#include "base/text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

/* With exact_text's digits. */
void print_number(FILE *out, double value);

/* The value with the fewest digits, of 15 to 17, that are within 1e-15 of it, for people: "0.94" of
 * 0.9400000000000001. */
const char *near_text(double value, char text[static NUMBER_LENGTH]);

/* A JSON document: one entry a line at the outermost level, all else in line. It grows in memory, and is
 * written when it is complete. */
struct document {
    FILE *out; /* into text */
    char *text;
    size_t size;
    int depth;
    bool has_entry; /* at the present level */
    bool one_line;
    char section[64]; /* the key at the outermost level */
    char *unfit;      /* the section of the first number that was not finite; NULL: none */
};

/* key NULL: in an array or at the top */
void put_open(struct document *document, const char *key, char bracket);
void put_close(struct document *document, char bracket);
void put_number(struct document *document, const char *key,
                double value); /* null when not finite, which makes the document unfit */
void put_whole(struct document *document, const char *key, long value);
void put_text(struct document *document, const char *key, const char *text);
void put_truth(struct document *document, const char *key, bool value);
void put_null(struct document *document, const char *key);
void put_array(struct document *document, const char *key, const double *values, int count);
void put_matrix(struct document *document, const char *key, const double *values, int rows, int columns);
void document_open(struct document *document);
/* Writes it to `file`, unless one of its numbers is not finite: then it is no result, which is told on
 * stderr. Returns whether it was written; the document ends here in any case. */
bool document_close(struct document *document, FILE *file);

/* Is it the name of a file of HDF5? */
bool text_names_hdf5(const char *path);
/* Why an HDF5 file cannot have anything of that name, in words; NULL: it can. */
const char *text_unfit_for_hdf5(const char *name);

/* What the program takes lives until its end, texts above all: nobody has to know who frees one. The program
 * ends with a message when memory is short. */
extern struct memory program_memory;
/* Zeroed. */
void *allocate(size_t count, size_t size);
double *allocate_matrix(int rows, int columns);
char *text_format(const char *format, ...) __attribute__((format(printf, 1, 2)));
char *text_vformat(const char *format, va_list list) __attribute__((format(printf, 1, 0)));
/* An arena (memory.h) for what ends before the program does, and is large. */
struct memory arena_start(void);
/* The same in heap memory, to be freed: what each of many motions takes, and texts that are long. */
void *allocate_large(size_t count, size_t size);
/* A stream whose text is in *text once it is closed. */
FILE *text_stream(char **text, size_t *size);

#endif
