/* Characters of UTF-8 (RFC 3629, sect. 4). */
#ifndef REFDYN_GEN_UTF8_H
#define REFDYN_GEN_UTF8_H

#include <stddef.h>

/* Bytes of the character at the beginning of a text of `length` bytes, and its code point; 0: none begins
 * there. `length` is at least 1. */
int utf8_decode(const char *text, size_t length, unsigned *code);

#endif
