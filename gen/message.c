/* Complaints about a model: see message.h. The nearest name is by edit distance with transpositions. */
#include "message.h"
#include "memory.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LONGEST_NAME = 63 };

static void keep(struct messages *messages, struct place place, int is_error, const char *format,
                 va_list list) {
    va_list again;
    va_copy(again, list);
    const char *lead = is_error ? "" : "warning: ";
    size_t lead_length = strlen(lead);
    size_t length = lead_length + (size_t)vsnprintf(NULL, 0, format, list);
    char *text = memory_get(messages->memory, length + 1);
    memcpy(text, lead, lead_length);
    vsnprintf(text + lead_length, length - lead_length + 1, format, again);
    va_end(again);
    messages->list = memory_room(messages->memory, messages->list, messages->count, &messages->capacity,
                                 sizeof *messages->list);
    messages->list[messages->count++] = (struct message){.place = place, .text = text, .is_error = is_error};
    messages->errors += is_error;
}

void complain(struct messages *messages, struct place place, const char *format, ...) {
    va_list list;
    va_start(list, format);
    keep(messages, place, 1, format, list);
    va_end(list);
}

void warn(struct messages *messages, struct place place, const char *format, ...) {
    va_list list;
    va_start(list, format);
    keep(messages, place, 0, format, list);
    va_end(list);
}

bool check_line(struct messages *messages, struct place place, const char *what, const char *text) {
    while (*text && !iscntrl((unsigned char)*text))
        text++;
    if (*text)
        complain(messages, place, "%s: contains control character %d, a line of text is needed", what, *text);
    return !*text;
}

bool is_first_mention(struct messages *messages, const char *kind, const char *name) {
    const char *key = memory_format(messages->memory, "%s %s", kind, name);
    for (int i = 0; i < messages->mentioned_count; i++)
        if (strcmp(messages->mentioned[i], key) == 0)
            return false;
    messages->mentioned = memory_room(messages->memory, messages->mentioned, messages->mentioned_count,
                                      &messages->mentioned_capacity, sizeof *messages->mentioned);
    messages->mentioned[messages->mentioned_count++] = key;
    return true;
}

void sort_messages(struct messages *messages) {
    for (int i = 1; i < messages->count; i++) {
        struct message message = messages->list[i];
        int at = i;
        for (; at > 0 && messages->list[at - 1].place.line > message.place.line; at--)
            messages->list[at] = messages->list[at - 1];
        messages->list[at] = message;
    }
}

static int smaller(int a, int b) {
    return a < b ? a : b;
}

/* Least number of letters put in, left out, replaced or swapped with their neighbour that leads from a to b.
 */
static int edit_distance(const char *a, const char *b) {
    int length_a = (int)strlen(a), length_b = (int)strlen(b);
    int rows[3][LONGEST_NAME + 1]; /* before the last, last and current row of the table of distances */
    int *before = rows[0], *last = rows[1], *now = rows[2];
    for (int j = 0; j <= length_b; j++)
        last[j] = j;
    for (int i = 1; i <= length_a; i++) {
        now[0] = i;
        for (int j = 1; j <= length_b; j++) {
            now[j] = smaller(smaller(last[j], now[j - 1]) + 1, last[j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = smaller(now[j], before[j - 2] + 1);
        }
        int *oldest = before;
        before = last;
        last = now;
        now = oldest;
    }
    return last[length_b];
}

const char *nearest_name(const char *name, const char *const *known, int count) {
    size_t length = strlen(name);
    if (length > LONGEST_NAME)
        return NULL;
    const char *nearest = NULL;
    int least = (int)length / 3 + 2; /* farther than a third of the letters and one is no slip of the pen */
    for (int i = 0; i < count; i++)
        if (strcasecmp(name, known[i]) == 0)
            return known[i];
    for (int i = 0; i < count; i++) {
        int distance = strlen(known[i]) > LONGEST_NAME ? least : edit_distance(name, known[i]);
        if (distance < least) {
            least = distance;
            nearest = known[i];
        }
    }
    return nearest;
}
