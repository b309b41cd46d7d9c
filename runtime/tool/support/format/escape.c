/* Texts of users inside other languages: UTF-8, JSON, XML, CSV, shell words, terminals. */
#include "runtime/tool/support/format/format.h"
#include "gen/base/base.h"

#include <stdbool.h>
#include <string.h>

static const unsigned long replacement = 0xFFFD;

unsigned long format_utf8_next(const char **at) {
    enum { LONGEST = 4 };
    unsigned code;
    const int count = utf8_decode(*at, strnlen(*at, LONGEST), &code);
    *at += count > 0 ? count : 1;
    return count > 0 ? code : replacement;
}

static void put_utf8(FILE *out, unsigned long point) {
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

void format_json_text(FILE *out, const char *text) {
    fputc('"', out);
    while (*text) {
        const unsigned long point = format_utf8_next(&text);
        if (point == '"' || point == '\\')
            fprintf(out, "\\%c", (int)point);
        else if (is_control(point))
            fprintf(out, "\\u%04lx", point);
        else
            put_utf8(out, point);
    }
    fputc('"', out);
}

/* Replaces a character that is a sign of XML; NULL if it can stay. */
static const char *xml_name(unsigned long point) {
    static const char signs[] = "&<>\"'";
    static const char *const names[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
    const char *sign = point < 0x80 ? strchr(signs, (int)point) : NULL;
    return sign ? names[sign - signs] : NULL;
}

void format_xml_text(FILE *out, const char *text) {
    while (*text) {
        const unsigned long point = format_utf8_next(&text);
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

void format_csv_text(FILE *out, const char *text) {
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

void format_shell_text(FILE *out, const char *text) {
    fputc('\'', out);
    for (; *text; text++)
        if (*text == '\'')
            fputs("'\\''", out);
        else
            fputc(*text, out);
    fputc('\'', out);
}

void format_plain_text(FILE *out, const char *text) {
    while (*text) {
        const char *begin = text;
        const unsigned long point = format_utf8_next(&text);
        if (is_control(point) || (point == replacement && text == begin + 1))
            fprintf(out, "\\x%02x", (unsigned char)*begin);
        else if (utf8_turns_direction((unsigned)point))
            fprintf(out, "\\u{%lX}", point);
        else
            put_utf8(out, point);
    }
}
