/* Growing texts, numbers to and from text, texts of authors as C, and characters of UTF-8. */
#include "gen/base/base.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Decimal digits that a double always keeps, and that always read back as the same double (C11 5.2.4.2.2:
 * DBL_DIG and DBL_DECIMAL_DIG). */
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
    reserve(text, 0);
    const size_t room = text->capacity - text->length;
    va_start(list, format);
    const int length = vsnprintf(text->data + text->length, room, format, list);
    va_end(list);
    if ((size_t)length >= room) { /* it did not fit, which is rare */
        reserve(text, (size_t)length);
        va_start(list, format);
        vsnprintf(text->data + text->length, (size_t)length + 1, format, list);
        va_end(list);
    }
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

/* strtod also accepts leading blanks, hexadecimal digits, inf and nan, which are refused here. */
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

/* An octal escape has at most three digits, unlike \x, so that it cannot absorb a digit that follows it.
 * "\?" avoids trigraphs. */
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

/* ---- UTF-8 (RFC 3629) ---- */

int utf8_decode(const char *text, size_t length, unsigned *code) {
    const unsigned char *byte = (const unsigned char *)text;
    const int count = byte[0] < 0x80   ? 1
                      : byte[0] < 0xC2 ? 0
                      : byte[0] < 0xE0 ? 2
                      : byte[0] < 0xF0 ? 3
                      : byte[0] < 0xF5 ? 4
                                       : 0;
    static const unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
    *code = count == 1 ? byte[0] : byte[0] & (0x7Fu >> count);
    if (count == 0 || (size_t)count > length)
        return 0;
    for (int i = 1; i < count; i++) {
        if ((byte[i] & 0xC0) != 0x80)
            return 0;
        *code = *code << 6 | (byte[i] & 0x3Fu);
    }
    const bool is_surrogate = *code >= 0xD800 && *code <= 0xDFFF;
    return *code < least[count] || *code > 0x10FFFF || is_surrogate ? 0 : count;
}

/* ---- characters that editors, word processors and web pages put in place of ASCII ---- */

#define BLANK "a typographic blank", "a plain blank"
#define NOTHING "a character without width", "nothing in its place"
#define DOUBLE_QUOTE "a typographic quotation mark", "\""
#define SINGLE_QUOTE "a typographic quotation mark", "'"
#define DASH "a typographic dash or minus sign", "-"
#define TIMES "a multiplication sign", "*"
#define DIVIDES "a division sign", "/"
#define POWER "a typographic exponent", "a power such as x^2"

/* Ranges of code points. The first range that contains the code is used. */
static const struct {
    unsigned first, last;
    const char *name, *instead;
} look_alikes[] = {
    {0xA0, 0xA0, BLANK},
    {0xAB, 0xAB, DOUBLE_QUOTE},
    {0xAD, 0xAD, NOTHING},
    {0xB0, 0xB0, "a degree sign", "rd.pi / 180 times the angle"},
    {0xB2, 0xB3, POWER},
    {0xB4, 0xB4, SINGLE_QUOTE},
    {0xB5, 0xB5, "a micro sign", "1e-6 times the number"},
    {0xB7, 0xB7, TIMES},
    {0xB9, 0xB9, POWER},
    {0xBB, 0xBB, DOUBLE_QUOTE},
    {0xBC, 0xBE, "a typographic fraction", "a quotient such as 1/2"},
    {0xD7, 0xD7, TIMES},
    {0xF7, 0xF7, DIVIDES},
    {0x3C0, 0x3C0, "the letter pi", "rd.pi"},
    {0x370, 0x3FF, "a Greek letter", "its name in the letters a to z"},
    {0x400, 0x52F, "a Cyrillic letter", "one of the letters a to z"},
    {0x2000, 0x200A, BLANK},
    {0x200B, 0x200F, NOTHING},
    {0x2010, 0x2015, DASH},
    {0x2018, 0x201B, SINGLE_QUOTE},
    {0x201C, 0x201F, DOUBLE_QUOTE},
    {0x2026, 0x2026, "an ellipsis", "..."},
    {0x2028, 0x2029, "a line end of Unicode", "a plain line end"},
    {0x202A, 0x202E, "a character that turns the direction of reading", "nothing in its place"},
    {0x202F, 0x202F, BLANK},
    {0x2032, 0x2032, SINGLE_QUOTE},
    {0x2033, 0x2033, DOUBLE_QUOTE},
    {0x2044, 0x2044, DIVIDES},
    {0x205F, 0x205F, BLANK},
    {0x2060, 0x2060, NOTHING},
    {0x2070, 0x2079, POWER},
    {0x2212, 0x2212, DASH},
    {0x2215, 0x2215, DIVIDES},
    {0x2217, 0x2217, TIMES},
    {0x2219, 0x2219, TIMES},
    {0x221A, 0x221A, "a root sign", "rd.sqrt(x)"},
    {0x2260, 0x2260, "an inequality sign", "~="},
    {0x2264, 0x2264, "an inequality sign", "<="},
    {0x2265, 0x2265, "an inequality sign", ">="},
    {0x22C5, 0x22C5, TIMES},
    {0x3000, 0x3000, BLANK},
    {0xFEFF, 0xFEFF, NOTHING},
};

static struct look_alike with_words(const char *name, const char *instead) {
    struct look_alike meant = {.name = name};
    snprintf(meant.instead, sizeof meant.instead, "%s", instead);
    return meant;
}

struct look_alike utf8_look_alike(unsigned code) {
    const char ascii[] = {(char)(code - 0xFF01 + '!'), 0}; /* for the block U+FF01 to U+FF5E */
    if (code >= 0xFF01 && code <= 0xFF5E)
        return with_words("a full-width character", ascii);
    for (size_t i = 0; i < sizeof look_alikes / sizeof *look_alikes; i++)
        if (code >= look_alikes[i].first && code <= look_alikes[i].last)
            return with_words(look_alikes[i].name, look_alikes[i].instead);
    return with_words("a character beyond ASCII", "letters a to z, digits and _");
}
