/* Tokens of a Lua source: Lua 5.4 manual, sect. 3.1. The source must be free of syntax errors. */
#ifndef REFDYN_GEN_SCANNER_H
#define REFDYN_GEN_SCANNER_H

#include <stdbool.h>
#include <stddef.h>

struct memory;

enum token_kind { TOKEN_END, TOKEN_NAME, TOKEN_WORD, TOKEN_STRING, TOKEN_NUMBER, TOKEN_SYMBOL };

struct token {
    enum token_kind kind;
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
/* Names of locals, functions and their arguments, in the order of the source; at most `room`. */
int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room);

#endif
