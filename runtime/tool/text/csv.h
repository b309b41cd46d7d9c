/*
 * CSV files of users, line by line: one header line of names, then one line of numbers for each sample.
 * Fields are parted by commas, without quotes; blanks around them, a byte order mark, CR before LF and empty
 * lines are passed over.
 *
 * All complaints go to stderr as FILE:LINE: WHAT: fact.
 */
#ifndef REFDYN_TOOL_CSV_H
#define REFDYN_TOOL_CSV_H

#include <stdbool.h>
#include <stdio.h>

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

#endif
