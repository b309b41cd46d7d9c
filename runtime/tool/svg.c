/* An SVG file finished: see svg.h. */
#include "svg.h"
#include "escape.h"
#include "output.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Where the pen stands, in tenths of a pixel as written, so that rounding does not add up. */
struct pen {
    long x, y;
    char command; /* last one written; 'm' and 'l' go on without being repeated */
};

static void put_tenths(FILE *out, long value, bool is_first) {
    if (!is_first && value >= 0)
        fputc(' ', out); /* a minus sign parts numbers as well */
    if (value < 0)
        fputc('-', out);
    value = labs(value);
    if (value % 10 == 0)
        fprintf(out, "%ld", value / 10);
    else
        fprintf(out, "%ld.%ld", value / 10, value % 10);
}

/* To x, y with or without drawing. */
static void put_move(FILE *out, struct pen *pen, bool is_line, double x, double y) {
    long new_x = lround(10 * x), new_y = lround(10 * y);
    bool goes_on = is_line && pen->command == 'l';
    if (!goes_on)
        fputc(is_line ? 'l' : 'M', out);
    pen->command = is_line ? 'l' : 'M';
    put_tenths(out, is_line ? new_x - pen->x : new_x, !goes_on);
    put_tenths(out, is_line ? new_y - pen->y : new_y, false);
    pen->x = new_x;
    pen->y = new_y;
}

/* Commands M and L with absolute `x,y` up to the closing quote; returns where that stands. */
static const char *put_path(const char *at, FILE *out) {
    struct pen pen = {.command = 0};
    bool is_line = false;
    while (*at && *at != '\'') {
        char *end;
        if (*at == 'M' || *at == 'L')
            is_line = *at == 'L';
        double x = strtod(at, &end);
        if (end == at) {
            if (!strchr("ML \t\n", *at))
                fputc(*at, out); /* Z and what else there may be */
            at++;
            continue;
        }
        double y = strtod(end + (*end == ','), &end);
        put_move(out, &pen, is_line, x, y);
        at = end;
    }
    return at;
}

/* Length of a group without content at `at`, 0: none. */
static size_t empty_group(const char *at) {
    static const char start[] = "<g fill=", end[] = ">\n</g>\n";
    if (strncmp(at, start, sizeof start - 1) != 0)
        return 0;
    const char *close = strchr(at, '>');
    return close && strncmp(close, end, sizeof end - 1) == 0 ? (size_t)(close - at) + sizeof end - 1 : 0;
}

/* What gnuplot repeats in every group; here it stands once, at the top. */
static const char line_style[] = " stroke-linecap=\"round\" stroke-linejoin=\"round\"";

/* Length of what can go at `at`, 0: nothing. */
static size_t superfluous(const char *at) {
    if (strncmp(at, line_style, sizeof line_style - 1) == 0)
        return sizeof line_style - 1;
    return empty_group(at);
}

/* ---- Texts ---- */

/* A placeholder is this control character, which no other text has, its number in two digits, and fillers. */
static const char lead = '\001', filler = '\002';
static const char digits[] = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz+-";

enum {
    BASE = sizeof digits - 1,
    TEXTS_MOST = BASE * BASE,
    PLACEHOLDER_LENGTH = 3,
    SHOWN_MOST = 100 /* characters of a text */
};

static char *shorten(const char *text, int *length) {
    char *shown;
    size_t size;
    FILE *out = text_stream(&shown, &size);
    for (*length = 0; *text && *length < SHOWN_MOST; ++*length)
        put_utf8(out, utf8_next(&text));
    if (*text)
        fputs("...", out);
    fclose(out);
    return shown;
}

static void keep(struct svg_texts *texts, char *text) {
    if (texts->count == texts->room) {
        texts->room = 2 * texts->room + 16;
        char **list = allocate((size_t)texts->room, sizeof *list);
        if (texts->count)
            memcpy(list, texts->list, (size_t)texts->count * sizeof *list);
        free(texts->list);
        texts->list = list;
    }
    texts->list[texts->count++] = text;
}

void svg_put_placeholders(FILE *out, struct svg_texts *texts, const char *text) {
    int length;
    if (texts->count == TEXTS_MOST || !*text)
        return;
    fprintf(out, "%c%c%c", lead, digits[texts->count / BASE], digits[texts->count % BASE]);
    keep(texts, shorten(text, &length));
    for (; length > PLACEHOLDER_LENGTH; length--)
        fputc(filler, out);
}

/* The text of a placeholder at *at, which then stands behind it; false: there is none. */
static bool put_own_text(const char **at, const struct svg_texts *texts, FILE *out) {
    if (**at == filler)
        return ++*at;
    if (**at != lead || !(*at)[1] || !(*at)[2])
        return false;
    const char *high = strchr(digits, (*at)[1]), *low = strchr(digits, (*at)[2]);
    const long number = high && low ? (high - digits) * BASE + (low - digits) : -1;
    if (number < 0 || number >= texts->count)
        return false;
    put_xml_text(out, texts->list[number]);
    *at += PLACEHOLDER_LENGTH;
    return true;
}

void svg_texts_release(struct svg_texts *texts) {
    for (int i = 0; i < texts->count; i++)
        free(texts->list[i]);
    free(texts->list);
    *texts = (struct svg_texts){.count = 0};
}

void svg_finish(const char *text, const struct svg_texts *texts, FILE *out) {
    static const char top[] = "<svg", shapes_end[] = "</defs>", path[] = " d='";
    const char *body = strstr(text, shapes_end); /* shapes of marks before it are scaled, and stay exact */
    while (*text) {
        size_t skip = superfluous(text);
        if (skip > 0)
            text += skip;
        else if (text >= body && strncmp(text, path, sizeof path - 1) == 0) {
            fputs(path, out);
            text = put_path(text + sizeof path - 1, out);
        } else if (strncmp(text, top, sizeof top - 1) == 0) {
            fprintf(out, "%s%s", top, line_style);
            text += sizeof top - 1;
        } else if (!put_own_text(&text, texts, out))
            fputc(*text++, out);
    }
}
