/*
 * Looks in a Lua source for what Lua decides at once and no error can catch: `==` between an expression and a
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
 * Looks for characters beyond ASCII outside texts and comments, and for texts that a typographic quotation
 * mark was to end. Lua would show them byte by byte. One error a line; are there none?
 */
bool lint_characters(struct memory *memory, struct messages *messages, const char *file, const char *source,
                     size_t length);

#endif
