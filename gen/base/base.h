/*
 * Foundations of the generator. Parts, in reading order: memory; messages about a model; texts, numbers and
 * UTF-8.
 */
#ifndef REFDYN_GEN_BASE_H
#define REFDYN_GEN_BASE_H

#include <stdbool.h>
#include <stddef.h>

/* Memory of the generator: one arena a run, which memory_release frees, and a stack of scratch, all zeroed.
 * If a request cannot be met, `fail` is called, so that no caller checks for NULL. */
struct memory {
    struct memory_block *blocks, *scratch;
    size_t taken, bound;         /* bytes of all blocks, and their bound; 0: no bound */
    bool is_over_bound;          /* a request was refused because of the bound */
    double work, work_bound;     /* operations so far, and their bound; 0: no bound */
    bool is_over_work;           /* `fail` was called because of that bound */
    long allowance;              /* blocks that may still be taken from malloc; negative: no limit */
    void (*fail)(void *context); /* called when memory is short; does not return */
    void *context;
};

void *memory_get(struct memory *memory, size_t size);
/* The same, but returns NULL if memory is short, as Lua's allocator must. */
void *memory_try(struct memory *memory, size_t size);
/* Counts work. The unit is the work of building one expression. */
void memory_work(struct memory *memory, double amount);
/* Zeroed scratch for one step. At its end the step returns, by memory_back, all scratch since its mark. The
 * bytes count as work, since the step goes through them. */
void *memory_scratch(struct memory *memory, size_t size);
struct memory_mark {
    struct memory_block *block;
    size_t used;
};
struct memory_mark memory_mark(const struct memory *memory);
void memory_back(struct memory *memory, struct memory_mark mark);
/* A larger copy of `old`, which itself stays until memory_release. */
void *memory_grow(struct memory *memory, const void *old, size_t old_size, size_t new_size);
/* Makes space for one more entry after the `count` entries of `size` bytes of a list. Returns the list or a
 * larger copy. */
void *memory_room(struct memory *memory, void *list, int count, int *capacity, size_t size);
char *memory_text(struct memory *memory, const char *text);
char *memory_format(struct memory *memory, const char *format, ...) __attribute__((format(printf, 2, 3)));
void memory_release(struct memory *memory);

/*
 * Messages about a model, collected so that one run reports them all. Each is one line that can be shown,
 * `FILE:LINE: subject: fact; what to do`, or `FILE: subject ...` if it concerns no line. After MESSAGES_BOUND
 * messages no more are kept. While a file is read, an error then ends the reading by memory.fail.
 */
enum { MESSAGES_BOUND = 1000 };

/* A line of a model file. Line 0 means the file as a whole. */
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
    const char **mentioned; /* unknown names that have been reported */
    int mentioned_count, mentioned_capacity;
    bool ends_reading; /* memory.fail may be called, because the function that reads the file has set its jump
                        */
    bool are_too_many;
    int unknown; /* names of a list that were unknown */
};

void message_error(struct messages *messages, struct place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void message_warning(struct messages *messages, struct place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Counts an unknown name of a list. Returns whether its message is to be written: only those about the first
 * few names are, and message_count_unknown says how many more there are. */
bool message_shows_unknown(struct messages *messages);
void message_count_unknown(struct messages *messages);
/* Whether the author's text is a line that files and comments can contain as it is: UTF-8 without control
 * characters, and without characters that turn the direction of reading and so hide what the text says.
 * Reports an error if it is not. */
bool message_is_one_line(struct messages *messages, struct place place, const char *what, const char *text,
                         size_t length);
/* The text with escapes of Lua for all other characters, and shortened if it is very long. */
const char *message_safe_text(struct memory *memory, const char *text, size_t length);
/* The name of the first character that is not ASCII, and what to write instead. NULL if all are ASCII. */
const char *message_beyond_ascii(struct memory *memory, const char *text, size_t length,
                                 const char **instead);
/* Advice for a text that is not a number, such as "; write 0.5" for "0,5"; "" if there is none. */
const char *message_number_advice(struct memory *memory, const char *text);
/* Whether this is the first message about an unknown name, which is reported once however often it is used.
 * `kind`: "link", "coordinate" ... */
bool message_is_first_mention(struct messages *messages, const char *kind, const char *name);
/* Sorts by line. Messages of one line stay in their order. */
void message_sort(struct messages *messages);
/* The entry of `known` (count names) nearest to `name` in edit distance, or NULL if none is near. */
const char *message_nearest_name(const char *name, const char *const *known, int count);
/* What to do about an unknown name: "; did you mean "mass"?" or, if none is near, "; use one of x, y". */
const char *message_advice_on_name(struct memory *memory, const char *name, const char *const *known,
                                   int count);
/* The names with commas between them. */
const char *message_names(struct memory *memory, const char *const *names, int count);

/* A growing text in the generator's arena. */
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
/* The same, always with a point or an exponent, so that C reads a double. */
const char *text_of_number(double value, char buffer[static NUMBER_LENGTH]);
/* What messages call a value that is not finite: "nan", "inf" or "-inf". */
const char *text_not_finite(double value);
/* Reads a finite number in decimal digits such as "-1.5e3". If the text is anything else, returns false and
 * leaves `value` unchanged. */
bool text_to_number(const char *text, double *value);
bool text_ends_with(const char *text, const char *ending);
/* Index of a text among `count` of them; -1 if it is not there. */
int text_index(const char *text, const char *const *list, int count);
/* An author's text as a literal of C with its quotes. It has the same bytes, for any text. */
const char *text_literal(struct memory *memory, const char *text);
/* The same for a comment of C: on one line, and without marks that end a comment or begin one. */
const char *text_comment(struct memory *memory, const char *text);

/* Number of bytes of the UTF-8 character (RFC 3629, sect. 4) at the beginning of a text of `length` >= 1
 * bytes, and its code point. 0 if no character begins there. */
int utf8_decode(const char *text, size_t length, unsigned *code);
/* Whether this character turns the direction of reading, so that a line shows another text. */
bool utf8_turns_direction(unsigned code);

/* A character that is not ASCII: its name and what to write instead, both for messages. */
struct look_alike {
    const char *name;
    char instead[32];
};
struct look_alike utf8_look_alike(unsigned code);

#endif
