/*
 * Mistakes in the source of a model: formulas that Lua decides while the model is read, characters outside
 * ASCII, and advice on syntax errors. Reads tokens of the source or Lua's message; returns warnings, errors
 * or advice.
 *
 * The formulas are `==` between an expression and a number (always false), an expression as a condition
 * (always true), and a decimal comma (a value that is dropped). Four things count as expressions: fields of
 * the argument of `forces`, `constraints` and `events`; fields of rd.parameters; results of rd.parameter and
 * rd.input; and names that are set to one of these.
 */
#include "gen/script/source.h"

#include <stdint.h>
#include <string.h>

/* A name whose value is an expression or a group of expressions. */
struct known {
    const struct token *name;
    bool is_group;
};

struct search {
    struct memory *memory;
    struct messages *messages;
    const char *file;
    struct token *tokens; /* the last is TOKEN_END */
    int count, capacity;
    struct known *known; /* a hash table of twice as many entries as tokens; an empty entry has no name */
    size_t known_size;
};

static bool is(const struct search *search, int index, const char *text) {
    return index >= 0 && index < search->count && scanner_token_is(&search->tokens[index], text);
}

static bool is_name(const struct search *search, int index) {
    return index >= 0 && index < search->count && search->tokens[index].kind == TOKEN_NAME;
}

static bool same_text(const struct token *a, const struct token *b) {
    size_t length = (size_t)(a->end - a->start);
    return length == (size_t)(b->end - b->start) && memcmp(a->start, b->start, length) == 0;
}

/* The entry of the hash table that has the name, or the one to which it would be added. */
static struct known *place_of(const struct search *search, const struct token *name) {
    uint32_t hash = 2166136261u; /* FNV-1a */
    for (const char *c = name->start; c < name->end; c++)
        hash = (hash ^ (unsigned char)*c) * 16777619u;
    size_t place = hash % search->known_size;
    while (search->known[place].name && !same_text(search->known[place].name, name))
        place = (place + 1) % search->known_size;
    return &search->known[place];
}

static const struct known *find_known(const struct search *search, int index) {
    const struct known *known = is_name(search, index) ? place_of(search, &search->tokens[index]) : NULL;
    return known && known->name ? known : NULL;
}

static void add_known(struct search *search, int index, bool is_group) {
    if (!is_name(search, index) || find_known(search, index))
        return;
    *place_of(search, &search->tokens[index]) =
        (struct known){.name = &search->tokens[index], .is_group = is_group};
}

/* Last token of the chain a.b.c that begins at `index`. */
static int chain_end(const struct search *search, int index) {
    while (is(search, index + 1, ".") && is_name(search, index + 2))
        index += 2;
    return index;
}

static int chain_start(const struct search *search, int index) {
    while (is(search, index - 1, ".") && is_name(search, index - 2))
        index -= 2;
    return index;
}

/* Whether the chain from `first` to `last` alone is an expression. */
static bool is_expression(const struct search *search, int first, int last) {
    const struct known *known = find_known(search, first);
    bool is_called = is(search, last + 1, "(") || is(search, last + 1, "[");
    return known && !is_called && (last > first || !known->is_group);
}

/* Learns names from `name = ...` and `forces = function(name)` at token `index`. */
static void learn(struct search *search, int index) {
    if (!is_name(search, index) || !is(search, index + 1, "="))
        return;
    bool is_author =
        is(search, index, "forces") || is(search, index, "constraints") || is(search, index, "events");
    if (is_author && is(search, index + 2, "function") && is(search, index + 3, "("))
        add_known(search, index + 4, true);
    bool is_module = is(search, index + 2, "rd") && is(search, index + 3, ".");
    if (is_module && is(search, index + 4, "parameters"))
        add_known(search, index, true);
    else if (is_module && (is(search, index + 4, "parameter") || is(search, index + 4, "input")))
        add_known(search, index, false);
    else if (find_known(search, index + 2) && is(search, index + 3, "."))
        add_known(search, index, true);
}

static const char *chain_text(const struct search *search, int first, int last) {
    return memory_format(search->memory, "%.*s",
                         (int)(search->tokens[last].end - search->tokens[first].start),
                         search->tokens[first].start);
}

static void check_comparison(const struct search *search, int index) {
    bool is_equal = is(search, index, "==");
    if (!is_equal && !is(search, index, "~="))
        return;
    int left = chain_start(search, index - 1), right_end = chain_end(search, index + 1);
    bool is_left = is_expression(search, left, index - 1);
    bool is_right = is_expression(search, index + 1, right_end);
    if (is_left == is_right) /* the comparison of two expressions is an error in script_metatable.c */
        return;
    message_warning(search->messages,
                    (struct place){.file = search->file, .line = search->tokens[index].line},
                    "%s: `%s` compares while the model is read and is always %s; use rd.where to choose "
                    "during the motion",
                    is_left ? chain_text(search, left, index - 1) : chain_text(search, index + 1, right_end),
                    is_equal ? "==" : "~=", is_equal ? "false" : "true");
}

static void check_condition(const struct search *search, int index) {
    static const char *const leads[] = {"if", "elseif", "while", "until", "not"};
    static const char *const ends[] = {"then", "do", "and", "or"};
    bool leads_in = false, ends_it = is(search, index, "until");
    for (int i = 0; i < 5; i++)
        leads_in = leads_in || is(search, index, leads[i]);
    int last = chain_end(search, index + 1);
    for (int i = 0; i < 4; i++)
        ends_it = ends_it || is(search, last + 1, ends[i]);
    if (leads_in && ends_it && is_expression(search, index + 1, last))
        message_warning(
            search->messages, (struct place){.file = search->file, .line = search->tokens[index].line},
            "%s: a condition while the model is read, always true; use rd.where to choose during the motion",
            chain_text(search, index + 1, last));
}

/* `local a = 1,5`: Lua drops the second value. */
static void check_decimal_comma(const struct search *search, int index) {
    const struct token *first = &search->tokens[index];
    if (first->kind != TOKEN_NUMBER || !is(search, index - 1, "=") || !is_name(search, index - 2) ||
        !is(search, index - 3, "local") || !is(search, index + 1, ",") ||
        search->tokens[index + 2].kind != TOKEN_NUMBER)
        return;
    const struct token *second = &search->tokens[index + 2];
    message_warning(search->messages, (struct place){.file = search->file, .line = first->line},
                    "%.*s,%.*s: two values for one name; write the number with a point, %.*s.%.*s",
                    (int)(first->end - first->start), first->start, (int)(second->end - second->start),
                    second->start, (int)(first->end - first->start), first->start,
                    (int)(second->end - second->start), second->start);
}

void lint_source(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length) {
    const struct memory_mark mark = memory_mark(memory);
    struct search search = {.memory = memory, .messages = messages, .file = file};
    struct scanner scanner = scanner_start(source, length);
    do {
        search.tokens =
            memory_room(memory, search.tokens, search.count, &search.capacity, sizeof *search.tokens);
        search.tokens[search.count] = scanner_next(&scanner);
    } while (search.tokens[search.count++].kind != TOKEN_END);
    search.known_size = 2 * (size_t)search.count;
    search.known = memory_scratch(memory, search.known_size * sizeof *search.known);
    for (int i = 0; i < search.count; i++) {
        learn(&search, i);
        check_comparison(&search, i);
        check_condition(&search, i);
        check_decimal_comma(&search, i);
    }
    memory_back(memory, mark);
}

/* ---- characters ---- */

/* Bytes of the first line of a text in quotation marks that does not end on this line; else 0. */
static size_t unfinished_length(const struct token *token) {
    const size_t length = (size_t)(token->end - token->start);
    const char *line_end = memchr(token->start, '\n', length);
    const bool is_short = token->kind == TOKEN_STRING && *token->start != '[';
    const bool is_ended = length > 1 && token->end[-1] == *token->start;
    if (!is_short || (line_end ? line_end[-1] == '\\' : is_ended))
        return 0;
    return line_end ? (size_t)(line_end - token->start) : length;
}

/* The first typographic quotation mark from `text` to `end`, or NULL. */
static const char *find_typographic_quote(const char *text, const char *end) {
    unsigned code;
    while (text < end) {
        const int count = utf8_decode(text, (size_t)(end - text), &code);
        if (count > 1 && strchr("\"'", *utf8_look_alike(code).instead))
            return text;
        text += count > 0 ? count : 1;
    }
    return NULL;
}

/* The place in a token of a character that was meant as a character of Lua, or NULL. */
static const char *find_wrong_character(const struct token *token) {
    if (token->kind == TOKEN_SYMBOL)
        return (unsigned char)*token->start >= 0x80 ? token->start : NULL;
    return find_typographic_quote(token->start, token->start + unfinished_length(token));
}

bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length) {
    struct scanner scanner = scanner_start(source, length);
    const char *instead = "";
    int reported = 0; /* line of the last error */
    for (struct token token = scanner_next(&scanner); token.kind != TOKEN_END;
         token = scanner_next(&scanner)) {
        const char *wrong = token.line > reported ? find_wrong_character(&token) : NULL;
        if (!wrong)
            continue;
        const char *fact = message_beyond_ascii(memory, wrong, (size_t)(source + length - wrong), &instead);
        message_error(messages, (struct place){.file = file, .line = token.line}, "%s outside a text; %s",
                      fact, instead);
        reported = token.line;
    }
    return reported == 0;
}

/* ---- brackets ---- */

/* An opening bracket, and the column at which its line begins. */
struct bracket {
    char is;
    int line, indent;
};

/* The column of the first character of a line that is not blank. */
static int indent_of(const char *source, const char *at) {
    const char *line = at;
    while (line > source && line[-1] != '\n')
        line--;
    return (int)strspn(line, " \t");
}

static bool is_first_of_line(const char *source, const struct token *token) {
    const char *at = token->start;
    while (at > source && (at[-1] == ' ' || at[-1] == '\t'))
        at--;
    return at == source || at[-1] == '\n';
}

/* A closing bracket at the beginning of a line stands below the line of its opening bracket. If it does not,
 * it closes another bracket than its author thought. */
const char *lint_open_bracket(struct memory *memory, const char *text, const char *source, size_t length) {
    struct bracket *open = memory_get(memory, (length + 1) * sizeof *open), wrong = {0};
    struct scanner scanner = scanner_start(source, length);
    int count = 0;
    for (struct token token = scanner_next(&scanner); token.kind != TOKEN_END;
         token = scanner_next(&scanner)) {
        const char is = token.kind == TOKEN_SYMBOL && token.end == token.start + 1 ? *token.start : ' ';
        if (strchr("{([", is))
            open[count++] = (struct bracket){is, token.line, indent_of(source, token.start)};
        else if (strchr("})]", is) && count > 0) {
            const struct bracket last = open[--count];
            if (!wrong.is && last.line < token.line && is_first_of_line(source, &token) &&
                indent_of(source, token.start) != last.indent)
                wrong = last;
        }
    }
    if (count == 0)
        return "";
    const struct bracket *meant = wrong.is ? &wrong : &open[count - 1];
    if (strstr(text, memory_format(memory, "at line %d)", meant->line)))
        return ""; /* Lua has named it */
    return memory_format(memory, "; the '%c' in line %d %s", meant->is, meant->line,
                         wrong.is ? "may lack its end" : "lacks its end");
}

/* ---- advice on syntax of other languages ---- */

/* What Lua expected, with which its message begins; the token that it found, with which it ends; and advice.
 * The first entry that fits is used. */
static const struct {
    const char *lead, *end, *hint;
} slips[] = {
    {"'then' expected", "near '!'", "; write a ~= b to compare, not a to negate"},
    {"'then' expected", "near '='", "; write == to compare"},
    {"unexpected symbol", "near '!'", "; write a ~= b to compare, not a to negate"},
    {"unexpected symbol", "near '&'", "; write and"},
    {"unexpected symbol", "near '|'", "; write or"},
    {"unexpected symbol", "near '*'", "; write a power as a^b, and -- before a comment"},
    {"unexpected symbol", "near '#'", "; write -- before a comment"},
    {"unexpected symbol", "near '['", "; write a list in braces, { 1, 2 }"},
    {"unexpected symbol", "near '?'", "; use rd.where(c, x, y) to choose during the motion"},
    {"unexpected symbol", "near '=='", "; write = to set a value"},
    {"unexpected symbol", "near ':'", "; write = to set a value"},
    {"unexpected symbol", "near 'until'",
     "; until is a keyword, as are end, in and repeat; use another name"},
    {"unexpected symbol", "near 'end'", "; end is a keyword, which ends a function, if or for"},
    {"unexpected symbol", "near '`'", "; write texts in \"\""},
    {"unexpected symbol", "near '{'",
     "; begin a file with local rd = require \"refdyn\", and a function's body without a brace"},
    {"syntax error", "near '+'", "; write a = a + b"},
    {"syntax error", "near '-'", "; write a = a - b, and -- before a comment"},
    {"syntax error", "near <eof>", ""},
    {"syntax error", "", "; write a statement as local a = 1, a = 1 or a call"},
    {"<name> expected", "", "; a name begins with a letter; write = to set a field: { mass = 1 }"},
    {"function arguments expected", "", "; write = to set a field, { mass = 1 }, and a dot to read one, s.t"},
    {"malformed number", "", "; leave out units, and write * to multiply"},
    {"')' expected", "near '='", "; write names and their values in braces, rd.model { name = \"arm\" }"},
    {"'}' expected", "near <eof>", ""},
    {"'}' expected", "near '='",
     "; write a name and its value as { name = value }, and a row as the expression that must be zero"},
    {"'}' expected", "near ')'", "; it closes no '('"},
    {"'}' expected", "near ']'", "; it closes no '['"},
    {"'}' expected", "", "; a comma or a quotation mark may be missing before it"},
    {"')' expected", "near '}'", "; a '(' before it lacks its end"},
    {"<eof> expected", "",
     "; a file ends with its return: a bracket or an end before this place may be one too many"},
    {"unexpected symbol", "near '}'", "; a value, or the end of a function, may be missing before it"},
    {"'end' expected", "near '}'", "; a function before it lacks its end"},
    {"'end' expected near", "near '='", "; write names and their values in braces, return { arm_psi = 1 }"},
    {"'do' expected", "", "; write a loop as for i = 1, 3 do ... end"},
    {"'end' expected (to close 'if'", "", "; write elseif as one word"},
    {"attempt to add a 'string'", "", "; write .. to join texts"},
};

const char *lint_advice(const char *text) {
    for (size_t i = 0; i < sizeof slips / sizeof *slips; i++)
        if (strncmp(text, slips[i].lead, strlen(slips[i].lead)) == 0 && text_ends_with(text, slips[i].end))
            return slips[i].hint;
    return "";
}
