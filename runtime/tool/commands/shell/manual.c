/* The manual page refdyn(1), in the man macros of roff. */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"
#include "refdyn.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---- texts ---- */

enum { LINE_LENGTH = 80 };

/* The escape sequence of a character that roff would print as another one; NULL if there is none. */
static const char *escape(char c) {
    switch (c) {
    case '\\':
        return "\\e";
    case '-':
        return "\\-";
    case '\'':
        return "\\(aq";
    case '`':
        return "\\(ga";
    case '^':
        return "\\(ha";
    case '~':
        return "\\(ti";
    default:
        return NULL;
    }
}

/* `text` up to `length` bytes, in the syntax of roff. */
static const char *in_roff(const char *text, size_t length) {
    struct text result = {.memory = &format_memory};
    text_add(&result, "%s", *text == '.' ? "\\&" : ""); /* so that no macro begins here */
    for (size_t i = 0; i < length; i++)
        if (escape(text[i]))
            text_add(&result, "%s", escape(text[i]));
        else
            text_add(&result, "%c", text[i]);
    return result.data;
}

static void put_roff(FILE *out, const char *text) {
    fputs(in_roff(text, strlen(text)), out);
}

/* Text that roff fills; lines are as long as mandoc accepts. */
static void put_filled(FILE *out, const char *text) {
    for (size_t width = 0; *text; text += strspn(text, " ")) {
        const size_t length = strcspn(text, " ");
        const char *word = in_roff(text, length);
        const bool is_first = width == 0, is_full = width + 1 + strlen(word) > LINE_LENGTH;
        fprintf(out, "%s%s", is_first ? "" : is_full ? "\n" : " ", word);
        width = (is_first || is_full ? 0 : width + 1) + strlen(word);
        text += length;
    }
    fputc('\n', out);
}

/* Indented lines are examples and stay unchanged; an empty line separates paragraphs. */
static void put_paragraphs(FILE *out, const char *text) {
    bool is_example = false;
    while (*text) {
        const size_t length = strcspn(text, "\n");
        const bool was_example = is_example;
        is_example = *text == ' ';
        if (is_example && !was_example)
            fputs(".PP\n.nf\n.RS\n", out);
        else if (was_example && !is_example)
            fputs(".RE\n.fi\n.PP\n", out);
        if (is_example)
            fprintf(out, "%s\n", in_roff(text, length));
        else if (length > 0)
            put_filled(out, format_text("%.*s", (int)length, text));
        text += length + (text[length] == '\n');
    }
    if (is_example)
        fputs(".RE\n.fi\n", out);
}

/* ---- commands ---- */

/* A name in bold, and its value in italics. */
static void put_name(FILE *out, const char *name, const char *argument) {
    fputs("\\fB", out);
    put_roff(out, name);
    fputs("\\fR", out);
    if (!*argument)
        return;
    fputs(" \\fI", out);
    put_roff(out, argument);
    fputs("\\fR", out);
}

static void put_usage(FILE *out, const struct command *command) {
    struct option_text option;
    put_name(out, format_text("refdyn %s", command->name), command->operands);
    for (int i = 0; options_describe(command, i, &option); i++)
        if (option.is_needed) {
            fputc(' ', out);
            put_name(out, option.is_output ? "-o" : format_text("--%s", option.name), option.argument);
        }
    fputs(" [\\fIoptions\\fR]\n", out);
}

static void put_option(FILE *out, const struct option_text *option) {
    fputs(".TP\n", out);
    put_name(out, format_text(option->is_output ? "-o, --%s" : "--%s", option->name), option->argument);
    fputc('\n', out);
    put_filled(out, option->help);
}

static void put_command(FILE *out, const struct command *command) {
    struct option_text option;
    fprintf(out, ".SS %s\n", command->name);
    put_usage(out, command);
    fputs(".PP\n", out);
    put_filled(out, format_text("%c%s.", command->purpose[0] - 'a' + 'A', command->purpose + 1));
    put_paragraphs(out, command->help);
    fputs(".PP\nOptions:\n", out);
    for (int i = 0; options_describe(command, i, &option); i++)
        put_option(out, &option);
}

/* ---- the page ---- */

/* Today's date, or the date of SOURCE_DATE_EPOCH, so that builds can be repeated. */
static const char *day(void) {
    const char *epoch = getenv("SOURCE_DATE_EPOCH");
    const time_t now = epoch ? (time_t)strtoll(epoch, NULL, 10) : time(NULL);
    static char text[sizeof "2000-01-01"];
    struct tm parts;
    if (!gmtime_r(&now, &parts) || strftime(text, sizeof text, "%Y-%m-%d", &parts) == 0)
        return "";
    return text;
}

static const char ending[] =
    ".SH EXIT STATUS\n"
    ".TP\n0\nDone.\n"
    ".TP\n1\nAn error in the model, the state or a file, as\nFILE:LINE: what: fact; what to do.\n"
    ".TP\n2\nWrong usage.\n"
    ".TP\n3\nThe numbers failed: with the reason, the time and the state.\n"
    ".SH ENVIRONMENT\n"
    ".TP\nCC\nThe compiler of emitted code; cc where it is not set.\n"
    ".TP\nREFDYN_PROGRESS\n1 draws progress bars where stderr is not a terminal, too.\n"
    ".TP\nREFDYN_CACHE\nThe folder of compiled models;\nwhere it is not set, refdyn in the XDG cache "
    "folder.\n"
    ".SH FILES\n"
    "Beside the program, where it is installed: models to begin from in\n.IR share/refdyn/models ,\n"
    "with the reference of the model language, README.md,\nand the definitions for editors,\n"
    ".IR editor/refdyn.lua .\n";

void shell_put_manual_page(FILE *out, const struct command *const *commands) {
    fprintf(
        out,
        ".\\\" Written by `refdyn completion man`: do not edit.\n"
        ".TH REFDYN 1 %s \"refdyn " REFDYN_VERSION "\" \"User Commands\"\n"
        ".SH NAME\nrefdyn \\- multibody dynamics as C code, from Lua models\n"
        ".SH SYNOPSIS\n.B refdyn\n.I COMMAND\n.RI [ ARGUMENTS ]\n.br\n.B refdyn\n.I COMMAND\n.B \\-\\-help\n"
        ".br\n.B refdyn \\-\\-version\n.SH DESCRIPTION\n"
        "Refdyn turns a Lua model of a robot with flexible links into C code\nof its dynamics,\n"
        "and computes its equilibria, frequencies and programme-constrained motions.\n"
        "Results go to the standard output or to the file of\n.BR \\-o ,\nall else to the standard error.\n"
        ".PP\n.B refdyn new\n.I NAME\nwrites a model to begin from.\n"
        ".SH COMMANDS\n",
        day());
    for (int k = 0; commands[k]; k++)
        put_command(out, commands[k]);
    fputs(ending, out);
}
