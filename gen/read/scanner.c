/* A scanner of Lua's tokens: see reader.h. */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <ctype.h>
#include <string.h>

struct scanner scanner_start(const char *source, size_t length) {
    return (struct scanner){.next = source, .end = source + length, .line = 1};
}

bool scanner_token_is(const struct token *token, const char *text) {
    size_t length = strlen(text);
    return (size_t)(token->end - token->start) == length && memcmp(token->start, text, length) == 0;
}

static void step(struct scanner *scanner) {
    char c = *scanner->next++;
    if (c != '\n' && c != '\r')
        return;
    scanner->line++;
    bool is_pair = scanner->next < scanner->end && (*scanner->next == '\n' || *scanner->next == '\r');
    if (is_pair && *scanner->next != c)
        scanner->next++;
}

static bool looking_at(const struct scanner *scanner, const char *text) {
    size_t length = strlen(text);
    return (size_t)(scanner->end - scanner->next) >= length && memcmp(scanner->next, text, length) == 0;
}

/* Number of '=' when a long bracket opens at p, -1 otherwise. */
static int long_bracket(const struct scanner *scanner, const char *p) {
    if (p >= scanner->end || *p != '[')
        return -1;
    int level = 0;
    for (p++; p < scanner->end && *p == '='; p++)
        level++;
    return p < scanner->end && *p == '[' ? level : -1;
}

static bool closes(const struct scanner *scanner, int level) {
    const char *p = scanner->next;
    if (*p++ != ']')
        return false;
    for (; level > 0 && p < scanner->end && *p == '='; p++)
        level--;
    return level == 0 && p < scanner->end && *p == ']';
}

static void skip_long_bracket(struct scanner *scanner, int level) {
    while (scanner->next < scanner->end && !closes(scanner, level))
        step(scanner);
    for (int i = 0; i < level + 2 && scanner->next < scanner->end; i++)
        step(scanner);
}

static void skip_blank(struct scanner *scanner) {
    while (scanner->next < scanner->end) {
        if (isspace((unsigned char)*scanner->next)) {
            step(scanner);
        } else if (looking_at(scanner, "--")) {
            int level = long_bracket(scanner, scanner->next + 2);
            if (level >= 0)
                skip_long_bracket(scanner, level);
            while (level < 0 && scanner->next < scanner->end && *scanner->next != '\n' &&
                   *scanner->next != '\r')
                scanner->next++;
        } else {
            return;
        }
    }
}

static void skip_string(struct scanner *scanner) {
    char quote = *scanner->next++;
    while (scanner->next < scanner->end && *scanner->next != quote) {
        if (*scanner->next == '\\' && scanner->next + 1 < scanner->end)
            scanner->next++;
        step(scanner);
    }
    if (scanner->next < scanner->end)
        scanner->next++;
}

static bool is_name_letter(char c) {
    return isalnum((unsigned char)c) || c == '_';
}

static void skip_number(struct scanner *scanner) {
    while (scanner->next < scanner->end) {
        char c = *scanner->next;
        bool is_sign = (c == '+' || c == '-') && strchr("eEpP", scanner->next[-1]);
        if (!is_name_letter(c) && c != '.' && !is_sign)
            return;
        scanner->next++;
    }
}

static bool is_keyword(const struct token *token) {
    static const char *const keywords[] = {
        "and", "break", "do",  "else", "elseif", "end",    "false",  "for",  "function", "goto",  "if",
        "in",  "local", "nil", "not",  "or",     "repeat", "return", "then", "true",     "until", "while"};
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (scanner_token_is(token, keywords[i]))
            return true;
    return false;
}

static void skip_symbol(struct scanner *scanner) {
    static const char *const pairs[] = {"==", "~=", "<=", ">=", "//", "::", "..", "<<", ">>"};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        if (looking_at(scanner, pairs[i])) {
            scanner->next += 2;
            return;
        }
    }
    scanner->next++;
}

struct token scanner_next(struct scanner *scanner) {
    skip_blank(scanner);
    struct token token = {.start = scanner->next, .line = scanner->line};
    int level = long_bracket(scanner, scanner->next);
    if (scanner->next >= scanner->end) {
        token.kind = TOKEN_END;
    } else if (level >= 0) {
        token.kind = TOKEN_STRING;
        skip_long_bracket(scanner, level);
    } else if (*scanner->next == '"' || *scanner->next == '\'') {
        token.kind = TOKEN_STRING;
        skip_string(scanner);
    } else if (isdigit((unsigned char)*scanner->next)) {
        token.kind = TOKEN_NUMBER;
        skip_number(scanner);
    } else if (is_name_letter(*scanner->next)) {
        while (scanner->next < scanner->end && is_name_letter(*scanner->next))
            scanner->next++;
        token.end = scanner->next;
        token.kind = is_keyword(&token) ? TOKEN_WORD : TOKEN_NAME;
    } else {
        token.kind = TOKEN_SYMBOL;
        skip_symbol(scanner);
    }
    token.end = scanner->next;
    return token;
}

/* ---- the names that a source declares ---- */

/* Is `token` the next name behind `local`, `local function`, `function`, or a comma of such a list? */
static bool declares(const struct token *token, bool *is_list) {
    if (token->kind == TOKEN_WORD) {
        *is_list = scanner_token_is(token, "local") || scanner_token_is(token, "function");
        return false;
    }
    if (token->kind == TOKEN_NAME)
        return *is_list;
    *is_list = *is_list && token->kind == TOKEN_SYMBOL &&
               (scanner_token_is(token, ",") || scanner_token_is(token, "("));
    return false;
}

int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room) {
    struct scanner scanner = scanner_start(source, length);
    bool is_list = false;
    int count = 0;
    for (struct token token = scanner_next(&scanner); token.kind != TOKEN_END && count < room;
         token = scanner_next(&scanner))
        if (declares(&token, &is_list))
            names[count++] = memory_format(memory, "%.*s", (int)(token.end - token.start), token.start);
    return count;
}
