/*
 * Single precision. All C is printed for doubles; with `--real float`, this pass turns each complete file
 * into C for floats: the type, decimal constants, and the functions of libm. So no constant that another file
 * of this folder prints can stay a double by mistake, which would promote whole expressions. Input: the text
 * of one file. Output: the same for the real type, or a constant that it cannot represent.
 *
 * Everything computed by the generator is a double, and is rounded here once.
 */
#include "gen/emit/emit.h"
#include "gen/graph/graph.h"

#include <ctype.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The real type of the emitted C, other than double. */
static const struct real {
    const char *type, *suffix, *function_suffix; /* float, 1.5f, sinf */
    double smallest, largest;                    /* of normal numbers */
    int fewest_digits, most_digits;              /* of constants */
} single = {"float", "f", "f", FLT_MIN, FLT_MAX, 6, 9};

/* What compilers keep in registers, and the places of each further value, in vectors of two doubles: of the
 * first values and, because compilers keep copies of values where many are alive, of those beyond. All are
 * measured: see tests/stack.py. */
static const struct places {
    long kept, first;
    double of_first, of_others;
} places_of_double = {12, 60, 2.0, 3.1}, places_of_single = {16, 60, 1.75, 2.15};

long emit_places_of_values(const struct plan *plan, long alive) {
    const struct places *places = plan->is_single ? &places_of_single : &places_of_double;
    if (alive <= places->kept)
        return 0;
    const long beyond = alive > places->first ? alive - places->first : 0;
    return (long)(places->of_first * (double)(alive - places->kept - beyond) +
                  places->of_others * (double)beyond);
}

int emit_real_bytes(const struct plan *plan) {
    return plan->is_single ? (int)sizeof(float) : (int)sizeof(double);
}

/* The shortest digits that read back as the same float. */
static const char *digits_of_single(double value, char digits[static 32]) {
    const float rounded = (float)value;
    for (int count = single.fewest_digits; count <= single.most_digits; count++) {
        snprintf(digits, 32, "%.*g", count, (double)rounded);
        if (strtof(digits, NULL) == rounded)
            break;
    }
    return digits;
}

static bool is_representable(double value) {
    return value == 0.0 || (value >= single.smallest && value <= single.largest);
}

/* Length of the number at the beginning of a text, as the preprocessor reads it: with the sign of its
 * exponent. */
static size_t number_length(const char *text) {
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '.' ||
           ((text[length] == '-' || text[length] == '+') && text[length - 1] == 'e'))
        length++;
    return length;
}

/* A number with a point or an exponent is a constant of the real type; others are integers. */
static void put_number(struct text *out, const char *number, size_t length, const char **outside) {
    const char *word = memory_format(out->memory, "%.*s", (int)length, number);
    char digits[32];
    if (!strpbrk(word, ".e")) {
        text_add(out, "%s", word);
        return;
    }
    const double value = strtod(word, NULL);
    if (!is_representable(value) && !*outside)
        *outside = word;
    digits_of_single(value, digits);
    text_add(out, "%s%s%s", digits, strpbrk(digits, ".e") ? "" : ".0", single.suffix);
}

static bool is_libm(const char *word, size_t length) {
    for (int i = 0; i < OP_COUNT; i++) {
        const char *function = operation_text((enum operation)i);
        if (operation_cost((enum operation)i) == COST_FUNCTION && strlen(function) == length &&
            !memcmp(function, word, length))
            return true;
    }
    return false;
}

static size_t word_length(const char *text) {
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '_')
        length++;
    return length;
}

static bool is_word(const char *text, size_t length, const char *word) {
    return strlen(word) == length && !memcmp(text, word, length);
}

static void put_word(struct text *out, const char *word, size_t length, bool is_code) {
    if (is_word(word, length, "double"))
        text_add(out, "%s", single.type);
    else if (!is_code && is_word(word, length, "doubles"))
        text_add(out, "%ss", single.type);
    else
        text_add(out, "%.*s%s", (int)length, word,
                 is_code && word[length] == '(' && is_libm(word, length) ? single.function_suffix : "");
}

/* Copies a comment; only the name of the type changes in it. */
static const char *put_comment(struct text *out, const char *at) {
    const char *end = strstr(at + 2, "*/") + 2;
    while (at < end) {
        const size_t word = word_length(at);
        if (word)
            put_word(out, at, word, false);
        else
            text_add(out, "%c", *at);
        at += word ? word : 1;
    }
    return at;
}

/* Copies a literal text. */
static const char *put_quoted(struct text *out, const char *at) {
    const char *end = at + 1;
    while (*end != '"')
        end += *end == '\\' ? 2 : 1;
    text_add(out, "%.*s", (int)(end + 1 - at), at);
    return end + 1;
}

struct text emit_as_single(struct memory *memory, const char *text, const char **outside) {
    struct text out = {.memory = memory};
    while (*text) {
        const size_t number = isdigit((unsigned char)*text) ? number_length(text) : 0;
        const size_t word = number ? 0 : word_length(text);
        if (number)
            put_number(&out, text, number, outside);
        else if (word)
            put_word(&out, text, word, true);
        else if (text[0] == '/' && text[1] == '*')
            text = put_comment(&out, text);
        else if (*text == '"')
            text = put_quoted(&out, text);
        else
            text_add(&out, "%c", *text++);
        text += number + word;
    }
    return out;
}
