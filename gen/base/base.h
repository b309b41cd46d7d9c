/* What everything rests on: memory, messages, texts, UTF-8. */
#ifndef REFDYN_GEN_BASE_H
#define REFDYN_GEN_BASE_H

#include <stdbool.h>
#include <stddef.h>

/*
 * Memory of the generator: one arena a run.
 *
 * Takes sizes, gives zeroed memory that lives until memory_release, and scratch, a stack beside it.
 * A request that cannot be met calls `fail`, which must not return (it jumps back to gen_* or, while Lua
 * runs, raises a Lua error); no caller checks for NULL. `bound` is what all blocks together may take, so that
 * a model that wants more is refused at the same place on each machine, and `work_bound` the same for work,
 * which is counted, not timed. `allowance` counts allocations down and fails at zero, so that a test can fail
 * each one.
 */

struct memory_block;

struct memory {
    struct memory_block *blocks, *scratch;
    size_t taken, bound;         /* bytes of all blocks, and how many they may be; 0: no bound */
    bool is_over_bound;          /* a request was refused because of the bound */
    double work, work_bound;     /* operations so far, and how many they may be; 0: no bound */
    bool is_over_work;           /* `fail` was called because of that bound */
    long allowance;              /* blocks that may still be taken from malloc; negative: no limit */
    void (*fail)(void *context); /* called when memory is short; does not return */
    void *context;
};

void *memory_get(struct memory *memory, size_t size);
/* The same, but NULL when memory is short: for Lua, which wants to be told. */
void *memory_try(struct memory *memory, size_t size);
/* Counts work: 1 is as much as to make one expression. */
void memory_work(struct memory *memory, double amount);
/* Zeroed scratch: of one step, which gives back at its end what was taken since its mark. Its bytes count as
 * work, since the step goes through them. */
void *memory_scratch(struct memory *memory, size_t size);
struct memory_mark {
    struct memory_block *block;
    size_t used;
};
struct memory_mark memory_mark(const struct memory *memory);
void memory_back(struct memory *memory, struct memory_mark mark);
/* A larger copy of `old`; the old one stays until release. */
void *memory_grow(struct memory *memory, const void *old, size_t old_size, size_t new_size);
/* Room for one more entry behind the `count` of a list with entries of `size` bytes: the list, or a larger
 * copy. */
void *memory_room(struct memory *memory, void *list, int count, int *capacity, size_t size);
char *memory_text(struct memory *memory, const char *text);
char *memory_format(struct memory *memory, const char *format, ...) __attribute__((format(printf, 2, 3)));
void memory_release(struct memory *memory);

/*
 * Complaints about a model: collected, so that one run tells them all.
 *
 * Each is one line `FILE:LINE: what: fact, what is allowed`, `FILE: what ...` where it is about no line;
 * warnings start their text with `warning: `. Whatever an author's texts and file names hold, a message is a
 * line that can be shown. After MESSAGES_BOUND of them no more are kept, and an error ends the reading by
 * memory.fail.
 */

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

/*
 * Growing text in the generator's arena, numbers with the fewest digits that read back exactly, numbers that
 * users write, and authors' texts as C takes them.
 */

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

/* Characters of UTF-8 (RFC 3629, sect. 4), and those that stand in for characters of ASCII by mistake. */

/* Bytes of the character at the beginning of a text of `length` bytes, and its code point; 0: none begins
 * there. `length` is at least 1. */
int utf8_decode(const char *text, size_t length, unsigned *code);

/* A character where ASCII is needed: its name, and what to write instead, both for people. */
struct look_alike {
    const char *name;
    char instead[32];
};

struct look_alike utf8_look_alike(unsigned code);

#endif
