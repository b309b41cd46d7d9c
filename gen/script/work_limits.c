/*
 * Memory for Lua, and the count of its work. Work is counted in steps of Lua and not in seconds, so that each
 * machine reads or refuses the same models. The costs are such that a step takes 2 to 50 ns for any model;
 * measured with gcc 12 and Lua 5.4 on a machine of 2023.
 *
 * A step may compare, convert or hash a text as long as the longest so far, which is slow if texts contain
 * bytes 0. It may also compute a remainder, which is slow for distant numbers. Each step is counted at the
 * cost that it may have. Library functions that make more than one pass over their arguments count the most
 * that they may do.
 */
#include "gen/script/source.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

/* ---- work ---- */

/* Additional cost of a step. It is one for each TEXT_PER_STEP bytes of the longest text beyond SHORT_TEXT, or
 * for each ZEROS_PER_STEP bytes if texts may contain bytes 0. The cost of a remainder is added if a source
 * contains %. */
enum { SHORT_TEXT = 512, TEXT_PER_STEP = 64, ZEROS_PER_STEP = 4, STEPS_OF_REMAINDER = 48 };
enum { STEPS_OF_CALL = 6, STEPS_OF_PIECE = 4, BYTES_PER_STEP = 16 };

/* The work of a library function may be computed as negative or NaN from strange arguments. */
void work_add(struct work *work, double steps) {
    work->steps += steps > 0 ? steps : 0;
}

static size_t steps_of_text(const struct work *work) {
    if (work->has_zeros)
        return work->longest_text / ZEROS_PER_STEP;
    return work->longest_text > SHORT_TEXT ? (work->longest_text - SHORT_TEXT) / TEXT_PER_STEP : 0;
}

void work_add_steps(struct work *work, int count) {
    const double remainder = work->has_remainders ? STEPS_OF_REMAINDER : 0;
    work->steps += count * (1 + remainder + (double)steps_of_text(work));
}

void work_add_call(struct work *work, int count) {
    work_add_steps(work, 1);
    work->steps += STEPS_OF_CALL + 4 * (double)count;
}

void work_add_memory(struct work *work, size_t bytes) {
    work->steps += STEPS_OF_PIECE + (double)(bytes / BYTES_PER_STEP);
}

void work_add_text(struct work *work, size_t length) {
    work->longest_text = length > work->longest_text ? length : work->longest_text;
}

void work_note_zeros(struct work *work, const char *text, size_t length) {
    work->has_zeros = work->has_zeros || memchr(text, 0, length);
}

/* Whether a text contains a byte 0 or an escape sequence that may be one: \0, \x00, \u{0}. */
static bool may_hold_zeros(const struct token *token) {
    for (const char *c = token->start; c < token->end; c++) {
        const bool is_escape = *c == '\\' && token->end - c > 3;
        if (!*c ||
            (is_escape && (c[1] == '0' || strncmp(c + 1, "x00", 3) == 0 || strncmp(c + 1, "u{0", 3) == 0)))
            return true;
    }
    return false;
}

/* Blocks that are open while a source is scanned, to count functions within functions. Lua allows at most 200
 * of them. */
enum { BLOCKS = 200, STEPS_OF_OUTER = 30 };

struct blocks {
    bool is_function[BLOCKS];
    int depth, functions;
};

static void follow_blocks(struct blocks *blocks, const struct token *token) {
    const bool is_function = scanner_token_is(token, "function");
    if ((is_function || scanner_token_is(token, "do") || scanner_token_is(token, "if")) &&
        blocks->depth < BLOCKS) {
        blocks->is_function[blocks->depth++] = is_function;
        blocks->functions += is_function;
    } else if (scanner_token_is(token, "end") && blocks->depth > 0) {
        blocks->functions -= blocks->is_function[--blocks->depth];
    }
}

/* Lua searches a label among all labels before it, and a name among the locals of all functions around it. */
void work_add_source(struct work *work, const char *source, size_t length) {
    struct scanner scanner = scanner_start(source, length);
    struct blocks blocks = {.depth = 0};
    double labels = 0;
    for (struct token token = scanner_next(&scanner); token.kind != TOKEN_END;
         token = scanner_next(&scanner)) {
        const bool is_symbol = token.kind == TOKEN_SYMBOL;
        labels += is_symbol && scanner_token_is(&token, "::");
        work->has_remainders = work->has_remainders || (is_symbol && scanner_token_is(&token, "%"));
        work->has_zeros = work->has_zeros || (token.kind == TOKEN_STRING && may_hold_zeros(&token));
        if (token.kind == TOKEN_NAME)
            work->steps += STEPS_OF_OUTER * blocks.functions;
        else if (token.kind == TOKEN_WORD)
            follow_blocks(&blocks, &token);
    }
    work->steps += (double)length + labels * labels / 10;
}

bool work_is_over(const struct work *work) {
    return work->steps > work->millions * 1e6;
}

/* Number of parts of a pattern that may match any number of letters. Lua tries each with every number. */
static int repetitions(const char *pattern, size_t length) {
    int count = 0;
    for (size_t i = 0; i < length; i++) {
        const bool is_escaped = pattern[i] == '%' && i + 1 < length;
        if (is_escaped && (pattern[i + 1] == 'b' || isdigit((unsigned char)pattern[i + 1])))
            count++;
        else if (!is_escaped && strchr("*+?-", pattern[i]) && pattern[i])
            count++;
        i += is_escaped;
    }
    return count;
}

static bool has_frontier(const char *pattern, size_t length) {
    for (size_t i = 0; i + 1 < length; i++)
        if (pattern[i] == '%' && pattern[i + 1] == 'f')
            return true;
    return false;
}

/* At each place Lua may read a set of letters to its end, and %f reads it twice. */
double work_pattern_steps(size_t length, const char *pattern, size_t pattern_length) {
    const double places = (double)length + 1;
    const double letters = (has_frontier(pattern, pattern_length) ? 2 : 1) * (8 + (double)pattern_length);
    return letters * (pow(places, 1 + repetitions(pattern, pattern_length)) / 80 + places / 8);
}

double work_search_steps(size_t length, size_t searched) {
    return ((double)length + 1) * ((double)searched + 1) / BYTES_PER_STEP;
}

/* ---- memory: freed pieces by size class, in steps of 16 bytes up to 512, then in powers of two ---- */

enum { STEP = 16, SMALL_CLASSES = 32 };

struct pool_piece {
    struct pool_piece *next;
};

static int class_of(size_t size) {
    if (size <= (size_t)STEP * SMALL_CLASSES)
        return (int)((size + STEP - 1) / STEP) - 1;
    int index = SMALL_CLASSES;
    for (size_t room = (size_t)2 * STEP * SMALL_CLASSES; room < size; room *= 2)
        index++;
    return index;
}

static size_t class_size(int index) {
    if (index < SMALL_CLASSES)
        return (size_t)(index + 1) * STEP;
    return ((size_t)STEP * SMALL_CLASSES) << (index - SMALL_CLASSES + 1);
}

static void *take(struct pool *pool, size_t size) {
    int index = class_of(size);
    struct pool_piece *piece = pool->free[index];
    if (piece)
        pool->free[index] = piece->next;
    else
        piece = memory_try(pool->memory, class_size(index));
    return piece;
}

static void put_back(struct pool *pool, void *data, size_t size) {
    struct pool_piece *piece = data;
    piece->next = pool->free[class_of(size)];
    pool->free[class_of(size)] = piece;
}

void *pool_resize(struct pool *pool, void *data, size_t old, size_t size) {
    if (!data)
        return size > 0 ? take(pool, size) : NULL;
    if (size > 0 && class_of(old) == class_of(size))
        return data;
    void *moved = size > 0 ? take(pool, size) : NULL;
    if (size > 0 && !moved)
        return size > old ? NULL : data; /* Lua requires that shrinking succeeds: the piece stays */
    if (moved)
        memcpy(moved, data, old < size ? old : size);
    put_back(pool, data, old);
    return moved;
}
