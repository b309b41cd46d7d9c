/* Growing text: see base.h. */
#include "gen/base/base.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Digits that a double keeps in decimal, and that always bring it back (C11 5.2.4.2.2: DBL_DIG and
 * DBL_DECIMAL_DIG). */
enum { FEWEST_DIGITS = 15, MOST_DIGITS = 17 };

static void reserve(struct text *text, size_t more) {
    const size_t needed = text->length + more + 1;
    if (needed <= text->capacity)
        return;
    size_t capacity = text->capacity ? 2 * text->capacity : 4096;
    while (capacity < needed)
        capacity *= 2;
    text->data = memory_grow(text->memory, text->data, text->length, capacity);
    text->capacity = capacity;
}

void text_add(struct text *text, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const int length = vsnprintf(NULL, 0, format, list);
    va_end(list);
    reserve(text, (size_t)length);
    va_start(list, format);
    vsnprintf(text->data + text->length, (size_t)length + 1, format, list);
    va_end(list);
    for (size_t i = text->length; i < text->length + (size_t)length; i++)
        if (text->data[i] == '\n')
            text->line_start = i + 1;
    text->length += (size_t)length;
}

size_t text_column(const struct text *text) {
    return text->length - text->line_start;
}

const char *exact_text(double value, char text[static NUMBER_LENGTH]) {
    for (int digits = FEWEST_DIGITS; digits <= MOST_DIGITS; digits++) {
        snprintf(text, NUMBER_LENGTH, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}

const char *text_of_number(double value, char buffer[static NUMBER_LENGTH]) {
    if (!isfinite(value))
        return isnan(value) ? "NAN" : value > 0 ? "INFINITY" : "(-INFINITY)";
    exact_text(value, buffer);
    if (!strpbrk(buffer, ".en"))
        strcat(buffer, ".0");
    return buffer;
}

const char *text_not_finite(double value) {
    return isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

/* strtod takes blanks, hexadecimal digits, inf and nan as well. */
bool text_to_number(const char *text, double *value) {
    char *end;
    const double parsed = strtod(text, &end);
    if (end == text || *end || text[strspn(text, "+-.0123456789eE")] || !isfinite(parsed))
        return false;
    *value = parsed;
    return true;
}

bool text_ends_with(const char *text, const char *ending) {
    const size_t length = strlen(text), most = strlen(ending);
    return length >= most && strcmp(text + length - most, ending) == 0;
}

int text_index(const char *text, const char *const *list, int count) {
    for (int i = 0; i < count; i++)
        if (strcmp(list[i], text) == 0)
            return i;
    return -1;
}

static bool is_plain(char c) {
    return c >= ' ' && c <= '~';
}

/* Three octal digits end by themselves, other than those of \x; \? so that "??" makes no trigraph. */
const char *text_literal(struct memory *memory, const char *text) {
    struct text literal = {.memory = memory};
    text_add(&literal, "\"");
    for (; *text; text++) {
        if (!is_plain(*text))
            text_add(&literal, "\\%03o", (unsigned)(unsigned char)*text);
        else
            text_add(&literal, strchr("\"\\?", *text) ? "\\%c" : "%c", *text);
    }
    text_add(&literal, "\"");
    return literal.data;
}

const char *text_comment(struct memory *memory, const char *text) {
    char *comment = memory_get(memory, 2 * strlen(text) + 1), *to = comment;
    for (; *text; text++) {
        const bool is_mark = (text[0] == '*' && text[1] == '/') || (text[0] == '/' && text[1] == '*');
        *to++ = iscntrl((unsigned char)*text) ? ' ' : *text;
        if (is_mark)
            *to++ = ' ';
    }
    *to = 0;
    return comment;
}
