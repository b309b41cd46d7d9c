/*
 * Looks in a Lua source for mistakes that Lua accepts without an error: `==` between an expression and a
 * number (always false), an expression as a condition (always true), and a decimal comma (a value that is
 * dropped).
 *
 * Knows as expressions: fields of what `forces` and `constraints` take, of rd.parameters, results of
 * rd.parameter and rd.input, and of names that are set to one of these. Gives warnings.
 */
#ifndef REFDYN_GEN_LINT_H
#define REFDYN_GEN_LINT_H

#include "base/memory.h"
#include "base/message.h"

void lint_source(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length);

/*
 * Looks for characters outside ASCII in code, and for texts that a typographic quotation mark should end. Lua
 * would show these characters byte by byte. Reports at most one error a line. True: no errors.
 */
bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length);

#endif
