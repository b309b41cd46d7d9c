/*
 * A figure in the form that a file's name asks for: SVG as it is, PNG and PDF by rsvg-convert, which takes
 * the SVG alone, so that no text of a user reaches another language.
 */
#ifndef REFDYN_TOOL_PICTURE_H
#define REFDYN_TOOL_PICTURE_H

#include <stdbool.h>
#include <stdio.h>

struct picture_format;

/* By the suffix of the name; NULL: another one. */
const struct picture_format *picture_format_of(const char *path);
/* Whether it can be written; complains on stderr when a program for it is missing. */
bool picture_can_write(const struct picture_format *format);
/* Complains on stderr, with what the program said, when it fails. */
bool picture_write(const struct picture_format *format, const char *svg, FILE *out);

#endif
