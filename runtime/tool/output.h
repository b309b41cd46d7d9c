/*
 * Text that goes out: numbers that read back exactly, a small JSON writer, and files that appear complete or
 * not at all.
 */
#ifndef REFDYN_TOOL_OUTPUT_H
#define REFDYN_TOOL_OUTPUT_H

#include <stdbool.h>
#include <stdio.h>

enum { NUMBER_LENGTH = 32 };

/* The value with the fewest of 15, 16 or 17 digits that read back exactly. Returns text. */
const char *exact_text(double value, char text[static NUMBER_LENGTH]);
void print_number(FILE *out, double value);

/* A JSON document being written: one entry a line at the outermost level, all else in line. */
struct document {
    FILE *out;
    int depth;
    bool has_entry; /* at the present level */
    bool one_line;
};

void put_open(struct document *document, const char *key,
              char bracket); /* key NULL: in an array or at the top */
void put_close(struct document *document, char bracket);
void put_number(struct document *document, const char *key, double value); /* null when not finite */
void put_whole(struct document *document, const char *key, long value);
void put_text(struct document *document, const char *key, const char *text);
void put_truth(struct document *document, const char *key, bool value);
void put_null(struct document *document, const char *key);
void put_array(struct document *document, const char *key, const double *values, int count);
void put_matrix(struct document *document, const char *key, const double *values, int rows, int columns);

/* An output file: written as PATH.part and renamed by output_close, what is no plain file (/dev/null) written
 * itself; path NULL is stdout. */
struct output {
    FILE *file;
    const char *path;
    char *part;
};

/* Complains on stderr and returns false when it cannot be opened, or not all was written. */
bool output_open(struct output *output, const char *path);
bool output_close(struct output *output);
/* Closes and leaves PATH.part as it is; output->part tells its name until output_release. */
bool output_keep_part(struct output *output);
void output_release(struct output *output);

/* A copy of text in heap memory made like printf; ends the program with a message when memory is short. */
char *text_format(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* All of a text file in heap memory; NULL with a complaint when it is empty or cannot be read. */
char *file_text(const char *path);
/* A stream whose text is in *text (heap memory) once it is closed; ends the program when memory is short. */
FILE *text_stream(char **text, size_t *size);
/* Zeroed heap memory; ends the program with a message when memory is short. */
void *allocate(size_t count, size_t size);

#endif
