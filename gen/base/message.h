/*
 * Complaints about a model: collected, so that one run tells them all.
 *
 * Each is one line `FILE:LINE: what: fact, what is allowed`, `FILE: what ...` where it is about no line;
 * warnings start their text with `warning: `. Whatever an author's texts and file names hold, a message is a
 * line that can be shown. After MESSAGES_BOUND of them no more are kept, and an error ends the reading by
 * memory.fail.
 */
#ifndef REFDYN_GEN_MESSAGE_H
#define REFDYN_GEN_MESSAGE_H

#include <stdbool.h>
#include <stddef.h>

struct memory;

enum { MESSAGES_BOUND = 1000 };

/* Where something stands in a model file; line 0: the file as a whole. */
struct place {
    const char *file;
    int line;
};

struct message {
    struct place place;
    const char *text;
    int is_error;
};

struct messages {
    struct memory *memory;
    struct message *list;
    int count, capacity, errors;
    const char **mentioned; /* unknown names that have been complained about */
    int mentioned_count, mentioned_capacity;
    bool are_too_many;
};

void message_error(struct messages *messages, struct place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void message_warning(struct messages *messages, struct place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/*
 * Is the author's text a line, which files and comments take as it is: UTF-8 without control characters, and
 * without those that turn the direction of reading, so that it shows what it is? Complains when it is not.
 */
bool message_is_one_line(struct messages *messages, struct place place, const char *what, const char *text,
                         size_t length);
/* The text with all that is no part of such a line as an escape of Lua, and shortened when it is very long:
 * messages are such texts. */
const char *message_safe_text(struct memory *memory, const char *text, size_t length);

/* The name of the first character of a text that is not ASCII, and what to write instead; NULL: all are
 * ASCII. */
const char *message_beyond_ascii(struct memory *memory, const char *text, size_t length,
                                 const char **instead);

/* Advice for a text that is not a number: "; write 0.5" for "0,5", and the like; "": there is none. */
const char *message_number_advice(struct memory *memory, const char *text);

/* Is this the first complaint about an unknown name? What is missing once is told once, however often it is
 * named. `kind`: "link", "coordinate" ... */
bool message_is_first_mention(struct messages *messages, const char *kind, const char *name);

/* By line; those of one line stay in their order. */
void message_sort(struct messages *messages);

/* The entry of `known` (count names) nearest to `name` in edit distance, or NULL when none is near. */
const char *message_nearest_name(const char *name, const char *const *known, int count);

#endif
