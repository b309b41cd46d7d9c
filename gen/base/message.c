/*
 * Messages about a model: made safe to show, collected, sorted by line; and the known name nearest to a
 * misspelled one, by edit distance with transpositions. A message is one line, regardless of what the
 * author's texts and file names contain; the text of a warning starts with `warning: `.
 */
#include "gen/base/base.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LONGEST_NAME = 40, LONGEST_TEXT = 2000 };

/* ---- texts of authors ---- */

/* C0, DEL and C1, and the separators of lines and paragraphs (Unicode). */
static bool is_control(unsigned code) {
    return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
}

/* Marks, embeddings, overrides and isolates of the bidirectional algorithm: UAX 9. */
bool utf8_turns_direction(unsigned code) {
    return code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
           (code >= 0x2066 && code <= 0x2069);
}

/* Number of bytes at the start of a text that may appear in a line. */
static size_t fit_length(const char *text, size_t length) {
    unsigned code;
    size_t at = 0;
    while (at < length) {
        const int count = utf8_decode(text + at, length - at, &code);
        if (count == 0 || is_control(code) || utf8_turns_direction(code))
            break;
        at += (size_t)count;
    }
    return at;
}

/* Adds the character at `text`, which may not appear in a line, as an escape; returns its number of bytes. */
static size_t add_escaped(struct text *safe, const char *text, size_t length) {
    unsigned code;
    const int count = utf8_decode(text, length, &code);
    if (count > 1)
        text_add(safe, "\\u{%X}", code);
    else if (*text == '\n')
        text_add(safe, "\\n");
    else
        text_add(safe, "\\x%02X", (unsigned)(unsigned char)*text);
    return count > 1 ? (size_t)count : 1;
}

const char *message_safe_text(struct memory *memory, const char *text, size_t length) {
    struct text safe = {.memory = memory};
    const size_t shown = length < LONGEST_TEXT ? length : LONGEST_TEXT;
    if (fit_length(text, shown) == length)
        return memory_format(memory, "%.*s", (int)length, text);
    for (size_t at = 0; at < shown;) {
        const size_t fit = fit_length(text + at, shown - at);
        text_add(&safe, "%.*s", (int)fit, text + at);
        at += fit;
        if (at < shown)
            at += add_escaped(&safe, text + at, length - at);
    }
    if (shown < length)
        text_add(&safe, " ...");
    return safe.data;
}

static void refuse_character(struct messages *messages, struct place place, const char *what,
                             const char *text, size_t length) {
    unsigned code;
    if (utf8_decode(text, length, &code) == 0)
        message_error(messages, place, "%s: contains byte %d, which is not UTF-8; save the file as UTF-8",
                      what, (unsigned char)*text);
    else if (is_control(code))
        message_error(messages, place, "%s: contains control character %d; remove it", what, (int)code);
    else
        message_error(messages, place, "%s: contains U+%04X, which turns the direction of reading; remove it",
                      what, code);
}

bool message_is_one_line(struct messages *messages, struct place place, const char *what, const char *text,
                         size_t length) {
    const size_t at = fit_length(text, length);
    if (at < length)
        refuse_character(messages, place, what, text + at, length - at);
    return at == length;
}

const char *message_beyond_ascii(struct memory *memory, const char *text, size_t length,
                                 const char **instead) {
    unsigned code;
    size_t at = 0;
    while (at < length && (unsigned char)text[at] < 0x80)
        at++;
    if (at == length)
        return NULL;
    *instead = "save the file as UTF-8";
    if (utf8_decode(text + at, length - at, &code) == 0)
        return memory_format(memory, "byte %d (not UTF-8)", (unsigned char)text[at]);
    const struct look_alike meant = utf8_look_alike(code);
    *instead = memory_format(memory, "write %s", meant.instead);
    return memory_format(memory, "U+%04X (%s)", code, meant.name);
}

/* The text with a decimal point in place of a decimal comma, or NULL. */
static const char *with_point(struct memory *memory, const char *text) {
    double value;
    const char *comma = strchr(text, ',');
    if (!comma)
        return NULL;
    const char *changed = memory_format(memory, "%.*s.%s", (int)(comma - text), text, comma + 1);
    return text_to_number(changed, &value) ? changed : NULL;
}

/* Whether the text is a number followed by letters, such as those of a unit. */
static bool has_unit(struct memory *memory, const char *text) {
    double value;
    const size_t length = strspn(text, "+-.0123456789");
    const char *unit = text + length + strspn(text + length, " ");
    return *unit && !strchr("eE", *unit) &&
           text_to_number(memory_format(memory, "%.*s", (int)length, text), &value) &&
           !unit[strspn(unit, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ/*^ ")];
}

const char *message_number_advice(struct memory *memory, const char *text) {
    const char *instead, *strange = message_beyond_ascii(memory, text, strlen(text), &instead);
    if (strange)
        return memory_format(memory, "; it contains %s: %s", strange, instead);
    const char *number = with_point(memory, text);
    if (number)
        return memory_format(memory, "; write %s", number);
    return has_unit(memory, text) ? "; write the number alone, in SI units and radians" : "";
}

/* ---- messages ---- */

static void put(struct messages *messages, struct place place, const char *text, bool is_error) {
    place.file = message_safe_text(messages->memory, place.file, strlen(place.file));
    messages->list = memory_room(messages->memory, messages->list, messages->count, &messages->capacity,
                                 sizeof *messages->list);
    messages->list[messages->count++] = (struct message){.place = place, .text = text, .is_error = is_error};
}

/* Says that there are more messages. An error ends the reading: for a million errors, the search for the
 * nearest names alone would take minutes. */
static void leave_out(struct messages *messages, struct place place, bool is_error) {
    if (messages->are_too_many)
        return;
    if (is_error || messages->count == MESSAGES_BOUND)
        put(messages, (struct place){.file = place.file},
            memory_format(messages->memory, "%smore than %d messages; the others are left out",
                          is_error ? "" : "warning: ", MESSAGES_BOUND),
            is_error);
    messages->are_too_many = is_error;
    if (is_error && messages->ends_reading)
        messages->memory->fail(messages->memory->context);
}

static void keep(struct messages *messages, struct place place, bool is_error, const char *format,
                 va_list list) {
    char text[LONGEST_TEXT + 2];
    const char *lead = is_error ? "" : "warning: ";
    messages->errors += is_error;
    if (messages->count < MESSAGES_BOUND) {
        snprintf(text, sizeof text, "%s", lead);
        vsnprintf(text + strlen(lead), sizeof text - strlen(lead), format, list);
        put(messages, place, message_safe_text(messages->memory, text, strlen(text)), is_error);
    } else {
        leave_out(messages, place, is_error);
    }
}

void message_error(struct messages *messages, struct place place, const char *format, ...) {
    va_list list;
    va_start(list, format);
    keep(messages, place, 1, format, list);
    va_end(list);
}

void message_warning(struct messages *messages, struct place place, const char *format, ...) {
    va_list list;
    va_start(list, format);
    keep(messages, place, 0, format, list);
    va_end(list);
}

enum { UNKNOWN_SHOWN = 10 };

bool message_shows_unknown(struct messages *messages) {
    messages->errors += messages->unknown >= UNKNOWN_SHOWN;
    return messages->unknown++ < UNKNOWN_SHOWN;
}

void message_count_unknown(struct messages *messages) {
    const int more = messages->unknown - UNKNOWN_SHOWN;
    if (more > 0)
        message_error(messages, messages->list[messages->count - 1].place, "%d more name%s unknown", more,
                      more > 1 ? "s are" : " is");
    messages->unknown = 0;
}

bool message_is_first_mention(struct messages *messages, const char *kind, const char *name) {
    const char *key = memory_format(messages->memory, "%s %s", kind, name);
    for (int i = 0; i < messages->mentioned_count; i++)
        if (strcmp(messages->mentioned[i], key) == 0)
            return false;
    messages->mentioned = memory_room(messages->memory, messages->mentioned, messages->mentioned_count,
                                      &messages->mentioned_capacity, sizeof *messages->mentioned);
    messages->mentioned[messages->mentioned_count++] = key;
    return true;
}

void message_sort(struct messages *messages) {
    for (int i = 1; i < messages->count; i++) {
        struct message message = messages->list[i];
        int at = i;
        for (; at > 0 && messages->list[at - 1].place.line > message.place.line; at--)
            messages->list[at] = messages->list[at - 1];
        messages->list[at] = message;
    }
}

/* ---- names ---- */

static int smaller(int a, int b) {
    return a < b ? a : b;
}

/* Removes the letters that two names have in common at their beginning and end. */
static void strip(const char **a, int *length_a, const char **b, int *length_b) {
    while (*length_a > 0 && *length_b > 0 && **a == **b)
        ++*a, ++*b, --*length_a, --*length_b;
    while (*length_a > 0 && *length_b > 0 && (*a)[*length_a - 1] == (*b)[*length_b - 1])
        --*length_a, --*length_b;
}

/* The least number of insertions, deletions, replacements and swaps of neighbouring letters that lead from a
 * to b, and at most `limit`. */
static int edit_distance(const char *a, const char *b, int limit) {
    int length_a = (int)strlen(a), length_b = (int)strlen(b);
    strip(&a, &length_a, &b, &length_b);
    int rows[3][LONGEST_NAME + 1]; /* before the last, last and current row of the table of distances */
    int *before = rows[0], *last = rows[1], *now = rows[2];
    for (int j = 0; j <= length_b; j++)
        last[j] = j;
    for (int i = 1; i <= length_a; i++) {
        int least = now[0] = i;
        for (int j = 1; j <= length_b; j++) {
            now[j] = smaller(smaller(last[j], now[j - 1]) + 1, last[j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = smaller(now[j], before[j - 2] + 1);
            least = smaller(least, now[j]);
        }
        if (least > limit) /* a swap may take 1 from the row before */
            return limit;
        int *oldest = before;
        before = last;
        last = now;
        now = oldest;
    }
    return smaller(last[length_b], limit);
}

const char *message_nearest_name(const char *name, const char *const *known, int count) {
    size_t length = strlen(name);
    if (length > LONGEST_NAME)
        return NULL;
    const char *nearest = NULL;
    if (isdigit((unsigned char)name[0])) /* a number that differs is no typing error */
        return NULL;
    int least = (int)length / 3 + 2; /* a typing error changes at most a third of the letters and one more */
    for (int i = 0; i < count; i++)
        if (strcasecmp(name, known[i]) == 0)
            return known[i];
    for (int i = 0; i < count; i++) {
        const long apart = (long)strlen(known[i]) - (long)length;
        const bool is_far = strlen(known[i]) > LONGEST_NAME || apart > least || -apart > least;
        int distance = is_far ? least : edit_distance(name, known[i], least + 1);
        /* a known name with over half of its letters changed is another name, unless the name begins with it
         * and is at most twice as long */
        const bool is_beginning =
            strncmp(name, known[i], strlen(known[i])) == 0 && 2 * strlen(known[i]) >= length;
        const bool has_no_letter_in_common = distance >= (int)length && distance >= (int)strlen(known[i]);
        if (has_no_letter_in_common ||
            (distance > 1 && 2 * distance > (int)strlen(known[i]) && !is_beginning))
            distance = least + 1;
        if (distance < least) {
            least = distance;
            nearest = known[i];
        }
    }
    return nearest;
}

const char *message_nearest_advice(struct memory *memory, const char *name, const char *const *known,
                                   int count) {
    const char *nearest = message_nearest_name(name, known, count);
    return nearest ? memory_format(memory, "; did you mean \"%s\"?", nearest) : "";
}

const char *message_names(struct memory *memory, const char *const *names, int count) {
    const char *text = "";
    for (int i = 0; i < count; i++)
        text = memory_format(memory, "%s%s%s", text, i ? ", " : "", names[i]);
    return text;
}

enum { MOST_SHOWN = 40 };

/* Collects up to MOST_SHOWN + 1 different names; returns their number. */
static int different_names(const char *const *known, int count, const char *names[static MOST_SHOWN + 1]) {
    int found = 0;
    for (int i = 0; i < count && found <= MOST_SHOWN; i++)
        if (text_index(known[i], names, found) < 0)
            names[found++] = known[i];
    return found;
}

const char *message_advice_on_name(struct memory *memory, const char *name, const char *const *known,
                                   int count) {
    const char *names[MOST_SHOWN + 1], *near = message_nearest_advice(memory, name, known, count);
    if (*near)
        return near;
    const int found = different_names(known, count, names);
    const char *shown = message_names(memory, names, found < MOST_SHOWN ? found : MOST_SHOWN);
    if (found > 1)
        return memory_format(memory, "; use one of %s%s", shown, found > MOST_SHOWN ? " ..." : "");
    return found ? memory_format(memory, "; use %s", shown) : "; there are none";
}
