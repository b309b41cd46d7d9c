/*
 * Texts of users inside the languages of other programs: one function for each language, used for every text
 * that is not the program's own. All of them take any bytes; what is no UTF-8, and characters that the
 * language has not, come out as U+FFFD, the replacement character.
 */
#ifndef REFDYN_TOOL_ESCAPE_H
#define REFDYN_TOOL_ESCAPE_H

#include <stdio.h>

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

#endif
