/*
 * Growing text in the generator's arena, numbers with the fewest digits that read back exactly, numbers that
 * users write, and authors' texts as C takes them.
 */
#ifndef REFDYN_GEN_TEXT_H
#define REFDYN_GEN_TEXT_H

#include <stdbool.h>
#include <stddef.h>

struct memory;

struct text {
    struct memory *memory;
    char *data; /* always ends with 0 */
    size_t length, capacity;
    size_t line_start; /* where the last line begins */
};

void text_add(struct text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
size_t text_column(const struct text *text);

enum { NUMBER_LENGTH = 32 };

/* The value with the fewest of 15, 16 or 17 digits that read back exactly. Returns text. */
const char *exact_text(double value, char text[static NUMBER_LENGTH]);
/* The same with a point or an exponent always, so that C reads a double. */
const char *text_of_number(double value, char buffer[static NUMBER_LENGTH]);

/* What messages call a number that is none: "nan", "inf" or "-inf". */
const char *text_not_finite(double value);

/* A finite number in decimal digits, as "-1.5e3", and nothing beside; `value` stays as it is when the text is
 * none. */
bool text_to_number(const char *text, double *value);

bool text_ends_with(const char *text, const char *ending);

/* Place of a text among `count` of them, -1: it is none of them. */
int text_index(const char *text, const char *const *list, int count);

/* An author's text as a literal of C, quotes included: the same bytes, whatever they are. */
const char *text_literal(struct memory *memory, const char *text);
/* The same within a comment of C: on one line, and it neither ends the comment nor begins another. */
const char *text_comment(struct memory *memory, const char *text);

#endif
