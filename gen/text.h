/*
 * Growing text in the generator's arena, and numbers with the fewest digits that read back exactly.
 */
#ifndef REFDYN_GEN_TEXT_H
#define REFDYN_GEN_TEXT_H

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

/* 15, 16 or 17 digits; always with a point or an exponent, so that C reads a double. buffer: 32 bytes. */
const char *number_text(double value, char buffer[32]);

#endif
