/*
 * The command line of `refdyn`: what a command is, and the options of one call.
 *
 * Each command is a struct command in its own file. It names its options, and the tables that declare them:
 * its own table, and those of the folders whose functions read the options. From these tables follow the
 * reading of argv, --help, the messages of wrong usage, the completion of shells and the manual page.
 */
#ifndef REFDYN_TOOL_OPTIONS_H
#define REFDYN_TOOL_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "gen/language/values.h"

/* Exit statuses of the program. */
enum status { STATUS_DONE, STATUS_FAULT, STATUS_USAGE, STATUS_NUMBERS };

/* Was the program built with the methods of GSL, and with files of HDF5? */
#ifdef REFDYN_HAS_GSL
enum { HAS_METHODS_OF_GSL = 1 };
#else
enum { HAS_METHODS_OF_GSL = 0 };
#endif
#ifdef REFDYN_HAS_HDF5
enum { HAS_HDF5 = 1 };
#else
enum { HAS_HDF5 = 0 };
#endif

/* Options and commands. */

enum option_kind {
    OPTION_FLAG, /* without a value */
    OPTION_TEXT,
    OPTION_TEXTS,        /* may be repeated, each time with another text */
    OPTION_LIST,         /* names or numbers between commas, each once */
    OPTION_FREEING_LIST, /* the same; it may be empty */
    OPTION_POSITIVE,     /* a positive number */
    OPTION_COUNT,        /* a whole number from 1 to 1000000 */
    OPTION_INDEX,        /* a whole number from 0 */
    OPTION_SETTING,      /* NAME=VALUE; may be repeated with other names */
    OPTION_HELP
};

struct command;

/* Declares one option. A table of rules ends with an entry whose name is NULL. */
struct option_rule {
    const char *name;     /* long, without its dashes */
    const char *argument; /* its value as in the usage line; NULL for a flag */
    enum option_kind kind;
    const char *help;         /* "%s" in it is replaced by the list */
    const char *const *words; /* its values, NULL at the end; NULL if they are no fixed set */
    const char *(*list)(
        const struct command *command); /* computes "a, b, c", the values, if it is not NULL */
};

struct options;

enum { OPTION_TABLES = 6 };

struct command {
    const char *name;
    enum status (*run)(const struct options *options);
    const char *operands; /* as in the usage line: "MODEL.lua" or "RUN..." */
    const char *options;  /* names in the order of the help, blanks between; "!" follows a needed one. -o is
                             "output", which needs no rule, and --help is added */
    const struct option_rule *tables[OPTION_TABLES]; /* that declare them; those not used are NULL */
    bool has_gsl;                                    /* the methods of GSL are among its methods */
    const char *replaces_needed;   /* an option that makes the needed ones superfluous; NULL: there is none */
    const char *replaces_operands; /* options that replace the operands and all needed options, blanks
                                      between; or NULL */
    const char *output;            /* what -o names: "FILE" or "DIR" */
    const char *purpose;           /* one line */
    const char *help;              /* what else a user should know, with examples */
};

/* One option of a command, as --help, completion and the manual page show it. */
struct option_text {
    const char *name;     /* long, without its dashes */
    const char *argument; /* as in the usage line; "" for a flag */
    const char *help;
    const char *words; /* its values, blanks between; "" if they are no fixed set */
    bool is_output, is_needed, may_repeat, is_list; /* is_output: it is -o, too; is_list: with commas */
};
/* By number from 0 in the order of the help. Returns false if the command has fewer options. */
bool options_describe(const struct command *command, int number, struct option_text *text);

/* Values of one call. */

/* The place in a file, such as SWEEP.lua, that has set an option under the file's own name. */
struct option_origin {
    const char *option, *field;
    const char *place; /* "FILE:LINE" */
};

struct option_value {
    const char *name;
    const char *text; /* NULL for flags and numbers */
    double number;
};

struct options {
    const struct command *const *commands; /* all commands, NULL at the end */
    const struct command *command;
    char **arguments; /* the whole command line */
    int argument_count;
    const char **operands; /* model or run files */
    int operand_count;
    struct setting *settings; /* of --set, each name once; where commands add to them, later ones win */
    int setting_count;
    const struct option_value *values; /* of the options that are given; read them by the functions below */
    int value_count;
    const struct option_origin *origins; /* (origin_count) of options that the command line does not have */
    int origin_count;
};

bool options_has(const struct options *options, const char *name);
/* These return NULL or 0 if the option is not given. */
const char *options_text(const struct options *options, const char *name);
double options_number(const struct options *options, const char *name);
/* The text number `place` of an option that may be repeated; NULL after the last one. */
const char *options_repeated(const struct options *options, const char *name, int place);
/* Returns whether the option is given and has this text. */
bool options_is(const struct options *options, const char *name, const char *text);
/* These set an option, or add a text to one that may be repeated; copies of the struct that were made before
 * keep their value. */
void options_set_flag(struct options *options, const char *name);
void options_set_text(struct options *options, const char *name, const char *text);
void options_add_text(struct options *options, const char *name, const char *text);
void options_set_number(struct options *options, const char *name, double number);

/* Calls `take` with each option that is given, in the order of the help: its long name, and its value as text
 * that reads back as the same value; NULL for a flag. */
void options_give(const struct options *options,
                  void take(void *context, const char *name, const char *value), void *context);
/* The items of a list "a,b", NULL after the last one; none for list NULL. */
const char **options_list(const char *list);
/* Sets *place to the place of the option's value among the words of its rule, 0 if it is not given. Reports
 * any other value as options_error does. */
enum status options_choose(const struct options *options, const char *name, int *place);
/* The words of --from and --at. */
extern const char *const options_places[];
/* The commit of the sources, or an empty text: written by runtime/tool/commit.cmake. */
extern const char tool_commit[];
/* Returns `place`, a value of --from or --at, if it names a STATE.json; otherwise NULL. */
const char *options_state_path(const char *place);

/* Reading argv. */

/* Returns true if the command is to run. Otherwise help or the version was printed, or wrong usage reported,
 * and *status is the exit status. */
bool options_read(const struct command *const *commands, int argc, char **argv, struct options *options,
                  enum status *status);
/* Reports an empty item of a list "a,b" of option `name`, or one that is given twice. */
enum status options_check_list(const struct command *command, const char *name, const char *list);

/* Messages. */

/* Reports a wrong value of an option. The format follows the option's name: ": '7' is ..." or " must be ...".
 * As options_usage_error; or, if a file has set the option, with FILE:LINE, and returns STATUS_FAULT. */
enum status options_error(const struct options *options, const char *option, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Reports "refdyn COMMAND: ..." and the usage line on stderr; returns STATUS_USAGE. */
enum status options_usage_error(const struct command *command, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
#endif
