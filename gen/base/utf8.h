/* Characters of UTF-8 (RFC 3629, sect. 4), and those that stand in for characters of ASCII by mistake. */
#ifndef REFDYN_GEN_UTF8_H
#define REFDYN_GEN_UTF8_H

#include <stddef.h>

/* Bytes of the character at the beginning of a text of `length` bytes, and its code point; 0: none begins
 * there. `length` is at least 1. */
int utf8_decode(const char *text, size_t length, unsigned *code);

/* A character where ASCII is needed: its name, and what to write instead, both for people. */
struct look_alike {
    const char *name;
    char instead[32];
};

struct look_alike utf8_look_alike(unsigned code);

#endif
