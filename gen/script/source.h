/*
 * Shared by the files of this folder: files and tokens of Lua, mistakes in a source, the work of Lua, and the
 * words for kinds of files.
 */
#ifndef REFDYN_GEN_SOURCE_H
#define REFDYN_GEN_SOURCE_H

#include "gen/language/language.h"
#include "gen/script/script.h"

/* ---- lua_source.c: files, tokens, lines of tables ---- */

/* The name of a file in Lua's messages, followed by its number. */
#define SOURCE_CHUNK "model"
/* Reads one more regular file (others may have no end, or wait). NULL, or the reason of a failure. */
const char *source_file_add(struct memory *memory, struct sources *sources, const char *path);
/* The path of NAME.lua in the folder of the file `neighbour`. */
const char *source_file_path(struct memory *memory, const char *neighbour, const char *name);
/* Splits "model0:LINE: text" into the place and the text, `rest`. For other texts, returns false and leaves
 * `place` unchanged. */
bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest);

struct token {
    enum { TOKEN_END, TOKEN_NAME, TOKEN_WORD, TOKEN_STRING, TOKEN_NUMBER, TOKEN_SYMBOL } kind;
    const char *start, *end;
    int line;
};

struct scanner {
    const char *next, *end;
    int line;
};

struct scanner scanner_start(const char *source, size_t length);
struct token scanner_next(struct scanner *scanner);
bool scanner_token_is(const struct token *token, const char *text);
/* Names of locals, functions and their arguments, in the order of the source, at most `room`. */
int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room);

/* A source whose table constructors are marked with numbers, and the lines of these tables and entries. */
struct source_lines {
    struct table_source *tables; /* private to lua_source.c */
    int count, capacity;
    char *text; /* the rewritten source */
    size_t length;
};

/* The numbers follow those of earlier sources. Reports entries that are given twice in one constructor, of
 * which Lua would use the last. */
void source_lines_mark_tables(struct memory *memory, struct messages *messages, const char *file,
                              const char *source, size_t length, struct source_lines *lines);
struct place source_lines_of_table(const struct source_lines *lines, int table);
/* Line of entry `name` (if NULL: of list item `index`) in table number `table`; 0 if unknown. */
int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index);

/* ---- lint.c: mistakes in a source ---- */

/* Warns of mistakes that Lua accepts without an error. */
void lint_source(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length);
/* Reports characters outside ASCII in code, and texts that end with a typographic quotation mark, at most one
 * error a line. Lua would show these characters byte by byte. True if there are none. */
bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length);
/* Advice to follow Lua's message `text` that the source ends too early: the bracket that is open; "" if there
 * is none. */
const char *lint_open_bracket(struct memory *memory, const char *text, const char *source, size_t length);
/* Advice to follow Lua's message `text` about syntax of other languages; "" if there is none. */
const char *lint_advice(const char *text);

/* ---- work_limits.c: memory and work of Lua ---- */

/* Work that a model's Lua has done so far. */
struct work {
    double steps;
    int millions;        /* of steps that are allowed */
    size_t longest_text; /* bytes */
    bool has_remainders; /* a source contains the operator % */
    bool has_zeros;      /* a text may contain bytes 0: Lua compares such texts piece by piece */
};
enum { WORK_MILLIONS = 100 }; /* of steps while a file is read */

void work_add(struct work *work, double steps);
void work_add_steps(struct work *work, int count);
/* A call of a function, or its return, with `count` arguments or results. */
void work_add_call(struct work *work, int count);
void work_add_memory(struct work *work, size_t bytes);
void work_add_text(struct work *work, size_t length);
/* A text that a library function has returned. */
void work_note_zeros(struct work *work, const char *text, size_t length);
/* The work of compiling a source. */
void work_add_source(struct work *work, const char *source, size_t length);
bool work_is_over(const struct work *work);
/* Steps that the search of a pattern, or of a plain text, in a text of `length` bytes may take. */
double work_pattern_steps(size_t length, const char *pattern, size_t pattern_length);
double work_search_steps(size_t length, size_t searched);

/* Memory for Lua from the generator's arena. Freed pieces are kept by size and used again, and all are
 * released with the arena, so that a jump out of the generator leaves nothing allocated. */
enum { POOL_CLASSES = 96 };
struct pool {
    struct memory *memory;
    struct pool_piece *free[POOL_CLASSES];
};
/* Lua's allocator: `old` bytes at `data` become `size` bytes. NULL if memory is short or size is 0. */
void *pool_resize(struct pool *pool, void *data, size_t old, size_t size);

/* ---- script_kinds.c: kinds of files ---- */

/* The word for a kind of file in messages: "model", "sweep", "fit" or "plan". */
const char *script_kind_noun(enum file_kind kind);
/* Name of the function that makes the result of such a file; NULL for models. */
const char *script_kind_tag(enum file_kind kind);

#endif
