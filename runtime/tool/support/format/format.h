/* What this folder offers. */
#ifndef REFDYN_TOOL_FORMAT_H
#define REFDYN_TOOL_FORMAT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

#include "gen/base/base.h"

/*
 * CSV files of users, line by line: one header line of names, then one line of numbers for each sample.
 * Fields are parted by commas, without quotes; blanks around them, a byte order mark, CR before LF and empty
 * lines are passed over.
 *
 * All complaints go to stderr as FILE:LINE: WHAT: fact.
 */

struct csv {
    const char *path, *what; /* what the file is for */
    FILE *file;
    char *text; /* the present line, cut into fields */
    int size;
    long line;
    bool is_cut;  /* the present line is the last one and has no end */
    char *header; /* the names lie in it */
    char **names;
    char **fields; /* (count) of the present line */
    int count;
};

/* Opens a user's file to read: a regular file, or an unnamed pipe such as a shell's `<(...)`. Files that
 * would wait for a writer, such as a named pipe or a terminal, are refused. NULL: *fault says why. */
FILE *input_open(const char *path, const char **fault);
/* Opens the file and reads its names, each there once. False with a complaint; csv_close in any case. */
bool csv_open(struct csv *csv, const char *path, const char *what);
/* The next line's fields, as many as there are names: 1; 0 at the end of the file; -1 with a complaint. */
int csv_next(struct csv *csv);
/* Column of that name, -1: none. */
int csv_column(const struct csv *csv, const char *name);
/* Field number i of the present line as a finite decimal number. */
bool csv_number(const struct csv *csv, int i, double *value);
bool csv_complain(const struct csv *csv, const char *format, ...) __attribute__((format(printf, 2, 3)));
void csv_close(struct csv *csv);

/* PATH:LINE: text on stderr, without the control characters that a file may have; line 0: none is named. */
void complain_line(const char *path, long line, const char *text);
/* All of a text file; NULL with a complaint. `what` it is for. */
char *read_text(const char *path, const char *what);

/*
 * Texts of users inside the languages of other programs: one function for each language, used for every text
 * that is not the program's own. All of them take any bytes; what is no UTF-8, and characters that the
 * language has not, come out as U+FFFD, the replacement character.
 */

/* The code point at *at, which then stands behind it; U+FFFD for a byte that begins none. Not at the end. */
unsigned long utf8_next(const char **at);
void put_utf8(FILE *out, unsigned long point);

/* A JSON string with its quotes. */
void put_json_text(FILE *out, const char *text);
/* The content of an element or of an attribute of XML or HTML. */
void put_xml_text(FILE *out, const char *text);
/* A field of a CSV file (RFC 4180), in quotes where it needs them. */
void put_csv_text(FILE *out, const char *text);
/* One word of a shell, to the byte: a path stays the same file. */
void put_shell_text(FILE *out, const char *text);
/* A text for a terminal: control characters, which would act there, as \xNN. */
void put_plain_text(FILE *out, const char *text);

/*
 * Text that goes out: numbers that read back exactly, a small JSON writer, texts in memory.
 */

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
/* An arena (base.h) for what ends before the program does, and is large. */
struct memory arena_start(void);
/* The same in heap memory, to be freed: what each of many motions takes, and texts that are long. */
void *allocate_large(size_t count, size_t size);
/* A stream whose text is in *text once it is closed. */
FILE *text_stream(char **text, size_t *size);

#endif
