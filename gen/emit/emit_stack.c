/*
 * An upper bound of the stack of each emitted function, for callers with a small one. Input: the C text of a
 * function, in which each declaration is on a separate line: `double NAME[COUNT], ...;`. Values that one
 * piece of a long function passes to the next are members of a local struct and look the same.
 *
 * The frame of a function has its local arrays, and the values that are alive at one place and for which
 * there is no register. Named values, and values read from arguments or arrays, are alive from their first to
 * their last use. If a loop begins in between, they are alive to its end. The line with most of them counts.
 * Each value takes the places that emit_real.c states, because compilers move computations and keep pairs as
 * vectors. A call adds the deepest of the called functions. tests/test_stack.py compares the bound with what
 * gcc reports; clang exceeds it in few functions, by less than a tenth.
 */
#include "gen/emit/emit.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum {
    BASE_BYTES = 256,   /* saved registers, alignment, and what small functions need */
    SINCOS_BYTES = 500, /* of the pass over angles, which has three arrays of FEWEST_ANGLES */
    ANGLE_BYTES = 36,   /* of each angle where the pass becomes a part of the function */
    MOST_ANGLES = 7     /* for which compilers do so */
};

/* ---- Values of the text ---- */

/* A value by its text: `t12`, `p->derived.half_m`, `q[3]`. */
struct sighting {
    const char *text;
    int length, first, last; /* first and last: lines */
};

/* The values of the current function in the order of their first use. */
struct reader {
    struct sighting *values;
    int *places;   /* a hash table: number of the value, from 1; 0: empty */
    size_t size;   /* of the table */
    int *begins;   /* lines at which the open loops begin */
    long *changes; /* by line: values that begin to be alive, minus those that end */
    int count, depth, line;
};

static size_t length_of_name(const char *text) {
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '_' || text[length] == '.' ||
           (text[length] == '-' && text[length + 1] == '>') || (length && text[length] == '>'))
        length++;
    return length;
}

/* Length of the value at the beginning of a text, with its index. */
static size_t length_of_value(const char *text) {
    const size_t length = length_of_name(text);
    return text[length] == '[' ? length + strcspn(text + length, "]\n") + 1 : length;
}

static void see(struct reader *r, const char *text, size_t length) {
    size_t h = 5381;
    for (size_t i = 0; i < length; i++)
        h = h * 33 + (unsigned char)text[i];
    for (h &= r->size - 1; r->places[h]; h = (h + 1) & (r->size - 1)) {
        struct sighting *value = &r->values[r->places[h] - 1];
        if (value->length == (int)length && !memcmp(value->text, text, length)) {
            value->last = r->line;
            return;
        }
    }
    r->values[r->count++] = (struct sighting){text, (int)length, r->line, r->line};
    r->places[h] = r->count;
}

static void read_line(struct reader *r, const char *at, const char *end) {
    while (at < end) {
        const bool is_number = isdigit((unsigned char)*at);
        const size_t length = is_number ? length_of_name(at) : length_of_value(at);
        if (length && !is_number)
            see(r, at, length);
        at += length ? length : 1;
    }
}

/* A value from before a loop that is used in it stays alive to its end. */
static void close_loop(struct reader *r) {
    const int begin = r->begins[--r->depth];
    for (int i = 0; i < r->count; i++)
        if (r->values[i].first < begin && r->values[i].last >= begin)
            r->values[i].last = r->line;
}

/* Forgets the values of a function and returns how many of them are alive at the line with most. */
static long close_function(struct reader *r, int begin) {
    long alive = 0, most = 0;
    memset(r->changes + begin, 0, ((size_t)(r->line - begin) + 1) * sizeof *r->changes);
    for (int i = 0; i < r->count; i++) {
        r->changes[r->values[i].first]++;
        r->changes[r->values[i].last]--;
    }
    for (int line = begin; line <= r->line; line++) {
        alive += r->changes[line];
        most = alive > most ? alive : most;
    }
    memset(r->places, 0, r->size * sizeof *r->places);
    r->count = 0;
    return most;
}

/* ---- Local arrays ---- */

static const char type[] = "double ", constant_type[] = "const double ";

static bool begins_with(const char *text, const char *beginning) {
    return !strncmp(text, beginning, strlen(beginning));
}

/* Numbers declared by a line "name[count], name;". */
static long declared_numbers(const char *line, const char *end) {
    long numbers = 0;
    while (line < end) {
        const size_t length = strcspn(line, ",;[");
        numbers += line[length] == '[' ? strtol(line + length + 1, NULL, 10) : 1;
        line += strcspn(line, ",;") + 1;
    }
    return numbers;
}

/* ---- Functions ---- */

static bool is_of_name(char c) {
    return isalnum((unsigned char)c) || c == '_';
}

static struct reader open_reader(struct memory *memory, const char *text) {
    struct reader r = {.size = 64};
    size_t lines = 1, words = 0;
    for (const char *c = text; *c; c++) {
        lines += *c == '\n';
        words += is_of_name(c[0]) && !is_of_name(c[1]);
    }
    while (r.size < 2 * words)
        r.size *= 2;
    r.values = memory_scratch(memory, (words + 1) * sizeof *r.values);
    r.places = memory_scratch(memory, r.size * sizeof *r.places);
    r.begins = memory_scratch(memory, lines * sizeof *r.begins);
    r.changes = memory_scratch(memory, (lines + 1) * sizeof *r.changes);
    return r;
}

static long bytes_of_angles(int count) {
    return count ? SINCOS_BYTES + ANGLE_BYTES * (count < MOST_ANGLES ? count : MOST_ANGLES) : 0;
}

/* A long function calls its pieces one after the other. Each has a frame in addition to the function's. */
long emit_own_stack(const struct emission *x, const char *text) {
    struct memory *memory = x->plan->memory;
    const struct memory_mark mark = memory_mark(memory);
    struct reader r = open_reader(memory, text);
    long arrays = 0, most = 0;
    int begin = 0, frames = 0;
    for (const char *end; (end = strchr(text, '\n')); text = end + 1, r.line++) {
        const char *line = text + strspn(text, " ");
        if (*line == '}' && r.depth)
            close_loop(&r);
        if (*text == '}') {
            const long alive = close_function(&r, begin);
            most = alive > most ? alive : most;
            begin = r.line + 1;
            frames++;
        }
        if (begins_with(line, type) && end[-1] == ';' && !memchr(line, '=', (size_t)(end - line)))
            arrays += declared_numbers(line + strlen(type), end);
        else if (!begins_with(line, "/*"))
            read_line(&r, line + (begins_with(line, constant_type) ? strlen(constant_type) : 0), end);
        if (end[-1] == '{')
            r.begins[r.depth++] = r.line;
    }
    memory_back(memory, mark);
    return (arrays + emit_places_of_values(x->plan, most)) * emit_real_bytes(x->plan) +
           bytes_of_angles(x->function->angle_count) + (frames > 1 ? BASE_BYTES : 0);
}

/* Called functions run one after the other. A result from which a part is copied is a local array, too. */
static long stack_with_calls(const struct emission *x, const struct function *function) {
    long own = x->own_stack[function - x->plan->functions], deepest = 0;
    for (int i = 0; i < function->part_count; i++) {
        const struct function *from = function->parts[i].from;
        if (i > 0 && function->parts[i - 1].from == from)
            continue;
        const long bytes = stack_with_calls(x, from);
        deepest = bytes > deepest ? bytes : deepest;
        if (plan_is_struct_result(from))
            own += from->out_count * emit_real_bytes(x->plan);
    }
    return own + deepest;
}

long emit_stack(const struct emission *x, const struct function *function) {
    return BASE_BYTES + stack_with_calls(x, function);
}
