/* Texts inside the languages of other programs: see escape.h. */
#include "escape.h"

#include <stdbool.h>
#include <string.h>

static const unsigned long replacement = 0xFFFD;

/* How many bytes follow a first byte, and the bits of it that count; -1: it begins no code point. */
static int count_followers(unsigned char first, unsigned long *bits) {
    static const struct {
        unsigned char mask, lead;
    } kinds[] = {{0x80, 0x00}, {0xE0, 0xC0}, {0xF0, 0xE0}, {0xF8, 0xF0}};
    for (int i = 0; i < 4; i++)
        if ((first & kinds[i].mask) == kinds[i].lead) {
            *bits = (unsigned char)(first & ~kinds[i].mask);
            return i;
        }
    return -1;
}

/* Not longer than it has to be, no half of a UTF-16 pair, not beyond the last one. */
static bool is_code_point(unsigned long point, int followers) {
    static const unsigned long least[] = {0, 0x80, 0x800, 0x10000};
    return point >= least[followers] && point <= 0x10FFFF && (point < 0xD800 || point > 0xDFFF);
}

unsigned long utf8_next(const char **at) {
    const unsigned char *byte = (const unsigned char *)*at;
    unsigned long point = 0;
    const int followers = count_followers(*byte, &point);
    ++*at;
    for (int i = 1; i <= followers; i++) {
        if ((byte[i] & 0xC0) != 0x80)
            return replacement;
        point = point << 6 | (byte[i] & 0x3Fu);
    }
    if (followers < 0 || !is_code_point(point, followers))
        return replacement;
    *at += followers;
    return point;
}

void put_utf8(FILE *out, unsigned long point) {
    const int followers = point < 0x80 ? 0 : point < 0x800 ? 1 : point < 0x10000 ? 2 : 3;
    static const int leads[] = {0, 0xC0, 0xE0, 0xF0};
    fputc(leads[followers] | (int)(point >> 6 * followers), out);
    for (int i = followers - 1; i >= 0; i--)
        fputc(0x80 | (int)(point >> 6 * i & 0x3F), out);
}

/* C0, DEL and C1, which no text needs. */
static bool is_control(unsigned long point) {
    return point < 0x20 || (point >= 0x7F && point < 0xA0);
}

void put_json_text(FILE *out, const char *text) {
    fputc('"', out);
    while (*text) {
        const unsigned long point = utf8_next(&text);
        if (point == '"' || point == '\\')
            fprintf(out, "\\%c", (int)point);
        else if (is_control(point))
            fprintf(out, "\\u%04lx", point);
        else
            put_utf8(out, point);
    }
    fputc('"', out);
}

/* What stands for a character that is a sign of XML, NULL: it stands for itself. */
static const char *xml_name(unsigned long point) {
    switch (point) {
    case '&':
        return "&amp;";
    case '<':
        return "&lt;";
    case '>':
        return "&gt;";
    case '"':
        return "&quot;";
    case '\'':
        return "&#39;";
    default:
        return NULL;
    }
}

void put_xml_text(FILE *out, const char *text) {
    while (*text) {
        const unsigned long point = utf8_next(&text);
        const bool is_space = point == '\t' || point == '\n';
        const char *name = xml_name(point);
        if (name)
            fputs(name, out);
        else if ((is_control(point) && !is_space) || point == 0xFFFE || point == 0xFFFF)
            put_utf8(out, replacement);
        else
            put_utf8(out, point);
    }
}

void put_csv_text(FILE *out, const char *text) {
    const bool is_quoted = text[strcspn(text, ",\"\r\n")] != '\0';
    if (is_quoted)
        fputc('"', out);
    for (; *text; text++) {
        if (*text == '"')
            fputc('"', out); /* doubled */
        fputc(*text, out);
    }
    if (is_quoted)
        fputc('"', out);
}

void put_plain_text(FILE *out, const char *text) {
    while (*text) {
        const char *begin = text;
        const unsigned long point = utf8_next(&text);
        if (is_control(point) || (point == replacement && text == begin + 1))
            fprintf(out, "\\x%02x", (unsigned char)*begin);
        else
            put_utf8(out, point);
    }
}
