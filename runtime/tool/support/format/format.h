/* Texts that the program reads and writes: CSV files of users; texts inside other languages; numbers, JSON
 * and texts in memory; the memory of the program. */
#ifndef REFDYN_TOOL_FORMAT_H
#define REFDYN_TOOL_FORMAT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"

/* CSV files of users, line by line: one header line of names, then one line of numbers for each sample.
 * Commas separate the fields; there are no quotes. Errors go to stderr as FILE:LINE: WHAT: fact. */

struct csv {
    const char *path, *what; /* the purpose of the file, for messages */
    FILE *file;
    char *text; /* the present line, cut into fields */
    int size;
    long line;
    bool is_cut;  /* the present line is the last one and has no line end */
    char *header; /* memory of the names */
    char **names;
    char **fields; /* (count) fields of the present line */
    int count;
};

/* Opens a user's file for reading: a regular file, or an unnamed pipe such as a shell's `<(...)`. Refuses
 * files that would wait for a writer, such as a named pipe or a terminal. Returns NULL and sets *fault to the
 * reason if it cannot. */
FILE *format_open_input(const char *path, const char **fault);
/* Opens the file and reads its names, each of which must be unique. Returns false and reports the error if it
 * cannot. Call format_csv_close in any case. */
bool format_csv_open(struct csv *csv, const char *path, const char *what);
/* Reads the next line, which must have as many fields as there are names. Returns 1, 0 at the end of the
 * file, or -1 after a reported error. */
int format_csv_next(struct csv *csv);
/* The column of a name; -1 if there is none. */
int format_csv_column(const struct csv *csv, const char *name);
/* Reads field i of the present line as a finite decimal number. */
bool format_csv_number(const struct csv *csv, int i, double *value);
bool format_csv_complain(const struct csv *csv, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void format_csv_close(struct csv *csv);

/* Prints PATH:LINE: text on stderr, without the control characters of the file. Line 0 names no line. */
void format_complain_line(const char *path, long line, const char *text);
/* Prints the messages from number `first` on, sorted by line. */
void format_complain_messages(struct messages *messages, int first);
/* Reads a whole text file; returns NULL and reports the error if it cannot. `what` names its purpose. */
char *format_read_file(const char *path, const char *what);

/* Texts of users inside other languages. Each language has one function, which every text that is not the
 * program's own passes through. All accept any bytes. Bytes that are not UTF-8, and characters that the
 * language does not have, become U+FFFD, the replacement character. */

/* Reads the code point at *at and advances *at; U+FFFD for a byte that begins none. Do not call it at the
 * end. */
unsigned long format_utf8_next(const char **at);

/* A JSON string with its quotes. */
void format_json_text(FILE *out, const char *text);
/* The content of an element or of an attribute of XML or HTML. */
void format_xml_text(FILE *out, const char *text);
/* A field of a CSV file (RFC 4180), in quotes where it needs them. */
void format_csv_text(FILE *out, const char *text);
/* One word of a shell, byte by byte, so that a path stays the same file. */
void format_shell_text(FILE *out, const char *text);
/* A text for a terminal: control characters, which would act there, appear as \xNN. */
void format_plain_text(FILE *out, const char *text);
/* Prints a message, or a part of it, on stderr. The same holds for its control characters, except for the
 * line end after it: texts of users cannot act on the terminal or begin a line. */
void format_complain(const char *format, ...) __attribute__((format(printf, 1, 2)));
void format_vcomplain(const char *format, va_list list) __attribute__((format(printf, 1, 0)));

/* Output: numbers that read back exactly, a small JSON writer, texts in memory. */

/* Prints with the digits of exact_text. */
void format_number(FILE *out, double value);
/* The number within 1e-15 of the value that has the fewest digits, 15 to 17: "0.94" for 0.9400000000000001.
 */
const char *format_near_number(double value, char text[static NUMBER_LENGTH]);

/* Compares two numbers for qsort, so that they ascend. */
int format_ascending(const void *a, const void *b);

/* A JSON document. At the outermost level each entry has its own line; deeper entries stay on that line. The
 * document grows in memory and is written when it is complete. */
struct document {
    FILE *out; /* into text */
    char *text;
    size_t size;
    int depth;
    bool has_entry; /* at the present level */
    bool one_line;
    char section[64]; /* the key at the outermost level */
    char *unfit;      /* the section of the first number that was not finite; NULL if all are finite */
};

/* key is NULL in an array and at the top. */
void format_put_open(struct document *document, const char *key, char bracket);
void format_put_close(struct document *document, char bracket);
/* Writes null if the number is not finite; the document can then not be written. */
void format_put_number(struct document *document, const char *key, double value);
void format_put_whole(struct document *document, const char *key, long value);
void format_put_text(struct document *document, const char *key, const char *text);
void format_put_truth(struct document *document, const char *key, bool value);
void format_put_null(struct document *document, const char *key);
void format_put_array(struct document *document, const char *key, const double *values, int count);
void format_put_matrix(struct document *document, const char *key, const double *values, int rows,
                       int columns);
void format_document_open(struct document *document);
/* Writes the document to `file` and ends it. If one of its numbers is not finite, reports that on stderr
 * instead. Returns whether it was written. */
bool format_document_close(struct document *document, FILE *file);

/* Returns whether this is the name of an HDF5 file. */
bool format_names_hdf5(const char *path);
/* Why an HDF5 file cannot contain an object of that name, in words; NULL if it can. */
const char *format_unfit_for_hdf5(const char *name);

/* Memory that lives until the program ends, mainly texts, so that no function has to free it. If memory is
 * short, the program ends with a message. */
extern struct memory format_memory;
/* Zeroed memory. */
void *format_allocate(size_t count, size_t size);
double *format_allocate_matrix(int rows, int columns);
char *format_text(const char *format, ...) __attribute__((format(printf, 1, 2)));
char *format_vtext(const char *format, va_list list) __attribute__((format(printf, 1, 0)));
/* An arena (base.h) for data that are large and end before the program does. */
struct memory format_arena_start(void);
/* The same in heap memory, which the caller frees: data of each of many motions, and long texts. */
void *format_allocate_large(size_t count, size_t size);
/* A stream; *text has its text once it is closed. */
FILE *format_stream(char **text, size_t *size);

#endif
