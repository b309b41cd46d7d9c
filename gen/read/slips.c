/*
 * Advice on syntax that Lua does not know: see reader.h. The first entry that fits counts. Lua's messages
 * begin with what it expected and end with the token that it found.
 */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <string.h>

/* Forms of other languages that Lua writes differently: the token that ends Lua's message, and advice. */
static const struct {
    const char *lead, *end, *hint;
} slips[] = {
    {"'then' expected", "near '!'", "; a ~= b compares, not a negates"},
    {"'then' expected", "near '='", "; == compares"},
    {"unexpected symbol", "near '!'", "; a ~= b compares, not a negates"},
    {"unexpected symbol", "near '&'", "; write and"},
    {"unexpected symbol", "near '|'", "; write or"},
    {"unexpected symbol", "near '*'", "; a power is a^b, and a comment begins with --"},
    {"unexpected symbol", "near '#'", "; a comment begins with --"},
    {"unexpected symbol", "near '['", "; a list stands in braces, { 1, 2 }"},
    {"unexpected symbol", "near '?'", "; rd.where(c, x, y) chooses during the motion"},
    {"unexpected symbol", "near '=='", "; = sets a value"},
    {"unexpected symbol", "near ':'", "; = sets a value"},
    {"unexpected symbol", "near 'until'", "; until is a word of Lua and no name, end, in and repeat as well"},
    {"unexpected symbol", "near 'end'", "; end is a word of Lua, which ends a function, if or for"},
    {"unexpected symbol", "near '`'", "; texts stand in \"\""},
    {"unexpected symbol", "near '{'",
     "; a file begins with local rd = require \"refdyn\", a function's body needs no brace"},
    {"syntax error", "near '+'", "; write a = a + b"},
    {"syntax error", "near '-'", "; write a = a - b, and -- before a comment"},
    {"syntax error", "near <eof>", ""},
    {"syntax error", "", "; a statement is local a = 1, a = 1 or a call"},
    {"<name> expected", "", "; names begin with a letter, and = sets a field: { mass = 1 }"},
    {"function arguments expected", "", "; = sets a field, { mass = 1 }, and a dot takes one, s.t"},
    {"malformed number", "", "; units are left out, and * multiplies"},
    {"')' expected", "near '='", "; names and their values stand in braces, rd.model { name = \"arm\" }"},
    {"'}' expected", "near <eof>", ""},
    {"'}' expected", "near '='",
     "; a name and its value are { name = value }, a row is the expression that is to be zero"},
    {"'}' expected", "", "; a comma may be missing before it"},
    {"'do' expected", "", "; a loop is for i = 1, 3 do ... end"},
    {"'end' expected (to close 'if'", "", "; elseif is one word"},
    {"attempt to add a 'string'", "", "; .. joins texts"},
};

const char *slips_advice(const char *text) {
    for (size_t i = 0; i < sizeof slips / sizeof *slips; i++)
        if (strncmp(text, slips[i].lead, strlen(slips[i].lead)) == 0 && text_ends_with(text, slips[i].end))
            return slips[i].hint;
    return "";
}
