/* The names that a Lua source declares: see local_variables.h. */
#include "read/local_variables.h"
#include "read/scanner.h"

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
