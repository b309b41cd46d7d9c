/* What this folder offers. */
#ifndef REFDYN_TOOL_COMMAND_LINE_H
#define REFDYN_TOOL_COMMAND_LINE_H

#include <stdbool.h>

#include "gen/read/read.h"

/*
 * The command line of `refdyn`: what a command is, and the options of one call.
 *
 * Takes the table of commands and argv; gives a filled struct options, or a complaint and the usage line on
 * stderr.
 */

/* Exit statuses of the program. */
enum status { STATUS_DONE, STATUS_FAULT, STATUS_USAGE, STATUS_NUMBERS };

/* Was the program built with the methods of GSL? */
#ifdef REFDYN_HAS_GSL
enum { HAS_METHODS_OF_GSL = 1 };
#else
enum { HAS_METHODS_OF_GSL = 0 };
#endif

/* Was it built with files of HDF5? */
#ifdef REFDYN_HAS_HDF5
enum { HAS_HDF5 = 1 };
#else
enum { HAS_HDF5 = 0 };
#endif

/* An option that a file gives, under a name of the file's own. */
struct told_option {
    const char *option, *field;
    const char *place; /* "FILE:LINE" */
};

struct options {
    const struct command *commands; /* the table of all, which ends with an entry whose name is NULL */
    const struct command *command;
    const struct told_option *told; /* (told_count) those that are not of the command line */
    int told_count;
    char **arguments; /* the whole command line */
    int argument_count;
    const char **operands; /* model or run files */
    int operand_count;
    struct setting *settings; /* each name once; where commands add to them, later ones win */
    int setting_count;
    const char **stops; /* --stop NAME<VALUE */
    int stop_count;
    bool fold, verify, resume, dry_run, slurm, for_lanes, for_casadi, floating, drives;
    /* NULL: not given */
    const char *output, *emit, *explain, *state, *from, *at, *method, *stabilise, *singular, *start, *hold,
        *release, *way, *summary, *vary, *steps, *tols, *methods, *inputs, *accelerations, *loops, *panel,
        *units, *model, *draw, *depfile, *table, *cases, *of, *slurm_options, *flexible, *section, *tip, *nu,
        *eta, *fmu, *platform;
    /* 0: not given */
    double until, step, step_max, tolerance, accuracy, every, modes, seconds, threads, chunks, lanes, E, rho,
        rfe, friction_width, right_angles;
    double case_number; /* -1: not given */
};

struct command {
    const char *name;
    enum status (*run)(const struct options *options);
    const char *operands; /* as in the usage line: "MODEL.lua" or "RUN..." */
    const char *options;  /* long names that it knows, in the order of the help, blanks between; '!' behind a
                             needed one */
    bool takes_gsl;       /* are methods of GSL among its methods */
    const char *output;   /* what -o names: "FILE" or "DIR" */
    const char *purpose;  /* one line */
    const char *help;     /* what more a user should know, with examples */
};

/* One option of a command, as the help tells it. */
struct option_text {
    const char *name;     /* long, without its dashes */
    const char *argument; /* what it takes, as in the usage line; "": nothing */
    const char *help;
    bool is_output, is_needed, may_repeat, is_list; /* is_output: -o, too; is_list: with commas between */
};
/* By number from 0 in the order of the help; false: the command has not so many. */
bool options_describe(const struct command *command, int number, struct option_text *text);

/* Of `commands`, a table that ends with an entry whose name is NULL. True when the command is to run;
 * otherwise *status is the exit status (help and version were printed). */
bool options_read(const struct command *commands, int argc, char **argv, struct options *options,
                  enum status *status);
/* Gives each option that was given, in the order of the help: its long name, and its value as text that reads
 * back as the same, NULL for one that takes none. */
void options_give(const struct options *options,
                  void take(void *context, const char *name, const char *value), void *context);
/* A list "a,b" of option `name` has no empty item, and none twice. */
enum status check_list(const struct command *command, const char *name, const char *list);
/* The items of such a list, behind the last one NULL; of list NULL none. */
const char **options_list(const char *list);
/* The place of `word` among `names`, which end with NULL; otherwise a complaint as of option_error. */
enum status options_choose(const struct options *options, const char *option, const char *word,
                           const char *const *names, int *place);
/* "rk4, rk54, ...": all methods, or those that need no tangent. */
const char *options_methods(bool is_explicit);
/* Of the words of --from and --at: NULL unless it names a STATE.json. */
const char *options_state_path(const char *place);
/* What is wrong with the value of an option, in words that go on behind its name, ": '7' is none of ..." or
 * " must be ...": as usage_error, or where a file gave it behind FILE:LINE, STATUS_FAULT. */
enum status option_error(const struct options *options, const char *option, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Complains on stderr as `refdyn COMMAND: ...` with the usage line; returns STATUS_USAGE. */
enum status usage_error(const struct command *command, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/*
 * The commands of `refdyn`.
 */

enum status run_gen(const struct options *options);
enum status run_check(const struct options *options);
enum status run_compile(const struct options *options);
enum status run_eval(const struct options *options);
enum status run_statics(const struct options *options);
enum status run_modes(const struct options *options);
enum status run_sim(const struct options *options);
/* `sim` of a case of a batch. */
enum status run_case_again(const struct options *options);
enum status run_batch(const struct options *options);
/* With --slurm gives the batch to Slurm, and is run_batch without. */
enum status run_batch_anywhere(const struct options *options);
enum status run_plot(const struct options *options);
enum status run_view(const struct options *options);
enum status run_merge(const struct options *options);
enum status run_import(const struct options *options);
enum status run_export(const struct options *options);
enum status run_new(const struct options *options);
enum status run_completion(const struct options *options);
enum status run_bench(const struct options *options);
enum status run_report(const struct options *options);

#endif
