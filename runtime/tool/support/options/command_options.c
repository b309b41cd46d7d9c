/* Reads the command line by the tables of options, and checks that it is complete; prints usage lines, --help
 * and the messages of wrong usage from the same tables. */
#include <assert.h>
#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "gen/base/base.h"
#include "refdyn.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"

/* ---- The options of a command ---- */

enum { OPTIONS_MOST = 40 };

/* An option that a command knows. */
struct known_option {
    const struct option_rule *rule;
    bool is_needed;
};

static const struct option_rule common_rules[] = {
    {"output", "FILE", OPTION_TEXT, "where results go", NULL, NULL},
    {"help", NULL, OPTION_HELP, "this text", NULL, NULL},
    {.name = NULL}};

static const struct option_rule *find_in(const struct option_rule *table, const char *name, size_t length) {
    for (; table && table->name; table++)
        if (strlen(table->name) == length && strncmp(table->name, name, length) == 0)
            return table;
    return NULL;
}

/* The rule of this name in the tables of the command, or NULL. */
static const struct option_rule *option_find(const struct command *command, const char *name, size_t length) {
    const struct option_rule *rule = find_in(common_rules, name, length);
    for (int i = 0; i < OPTION_TABLES && !rule; i++)
        rule = find_in(command->tables[i], name, length);
    return rule;
}

/* In the order of the help, --help last. Returns how many. */
static int command_options(const struct command *command, struct known_option list[static OPTIONS_MOST]) {
    int count = 0;
    for (const char *at = command->options; *at; at += strspn(at, " ")) {
        const size_t length = strcspn(at, " !");
        list[count].rule = option_find(command, at, length);
        assert(list[count].rule && count < OPTIONS_MOST - 2);
        at += length;
        list[count].is_needed = *at == '!';
        at += list[count++].is_needed;
    }
    list[count++] = (struct known_option){&common_rules[1], false};
    return count;
}

static bool option_is_output(const struct option_rule *rule) {
    return rule == &common_rules[0];
}

static bool option_may_repeat(const struct option_rule *rule) {
    return rule->kind == OPTION_SETTING || rule->kind == OPTION_TEXTS;
}

/* "-o" or "--NAME". */
static const char *option_shown(const struct option_rule *rule) {
    return option_is_output(rule) ? "-o" : format_text("--%s", rule->name);
}

/* ---- Usage and help ---- */

static const char *argument_of(const struct command *command, const struct option_rule *rule) {
    if (option_is_output(rule))
        return command->output;
    return rule->argument ? rule->argument : "";
}

/* The help; a list takes the place of its "%s". */
static const char *help_of(const struct command *command, const struct option_rule *rule) {
    const char *mark = rule->list ? strstr(rule->help, "%s") : NULL;
    return mark ? format_text("%.*s%s%s", (int)(mark - rule->help), rule->help, rule->list(command), mark + 2)
                : rule->help;
}

static const char *words_of(const struct command *command, const struct option_rule *rule) {
    struct text text = {.memory = &format_memory};
    for (int i = 0; rule->words && rule->words[i]; i++)
        text_add(&text, "%s%s", i ? " " : "", rule->words[i]);
    for (const char *at = rule->list ? rule->list(command) : ""; *at; at++)
        if (*at != ',')
            text_add(&text, "%c", *at);
    return text.length ? text.data : "";
}

bool options_describe(const struct command *command, int number, struct option_text *text) {
    struct known_option known[OPTIONS_MOST];
    if (number >= command_options(command, known))
        return false;
    const struct option_rule *rule = known[number].rule;
    *text = (struct option_text){.name = rule->name,
                                 .argument = argument_of(command, rule),
                                 .help = help_of(command, rule),
                                 .words = words_of(command, rule),
                                 .is_output = option_is_output(rule),
                                 .is_needed = known[number].is_needed,
                                 .may_repeat = option_may_repeat(rule),
                                 .is_list = rule->kind == OPTION_LIST || rule->kind == OPTION_FREEING_LIST};
    return true;
}

/* With all options, or with those that are needed. */
static const char *usage_of(const struct command *command, bool is_whole) {
    struct known_option known[OPTIONS_MOST];
    const int count = command_options(command, known) - 1; /* without --help */
    struct text text = {.memory = &format_memory};
    text_add(&text, "usage: refdyn %s %s", command->name, command->operands);
    for (int i = 0; i < count; i++) {
        const char *argument = argument_of(command, known[i].rule);
        if (is_whole || known[i].is_needed)
            text_add(&text, known[i].is_needed ? " %s%s%s" : " [%s%s%s]", option_shown(known[i].rule),
                     *argument ? " " : "", argument);
    }
    return text.data;
}

static void print_option(const struct option_text *option, FILE *out) {
    enum { WIDTH = 28 };
    const int width =
        fprintf(out, "  %s--%s %s", option->is_output ? "-o, " : "", option->name, option->argument);
    fprintf(out, "%*s%s\n", width < WIDTH ? WIDTH - width : 1, "", option->help);
}

static void print_command_help(const struct command *command) {
    struct option_text option;
    printf("%s\n\n%s\n\n%s\noptions:\n", usage_of(command, true), command->purpose, command->help);
    for (int i = 0; options_describe(command, i, &option); i++)
        print_option(&option, stdout);
    puts("\nexit status: 0 done; 1 error in the model, the state or a file; 2 wrong usage; 3 the numbers "
         "failed");
}

static void print_help(const struct command *const *commands) {
    puts("usage: refdyn COMMAND ARGUMENTS\n\n"
         "Refdyn turns a Lua model of a robot with flexible links into C code of its dynamics,\n"
         "and computes its equilibria, frequencies and programme-constrained motions.\n\ncommands:");
    for (; *commands; commands++)
        printf("  %-11s%s\n", (*commands)->name, (*commands)->purpose);
    puts("\nrefdyn COMMAND --help explains a command; --version prints the version.");
}

/* ---- Wrong usage ---- */

/* Prints the line of the option with which a message begins, then the usage line: short, so that it does not
 * hide the message. */
static enum status end_usage_error(const struct command *command, const char *message) {
    enum { SHORT = 100 };
    struct option_text option;
    for (int i = 0; strncmp(message, "--", 2) == 0 && options_describe(command, i, &option); i++) {
        const size_t length = strlen(option.name);
        if (strncmp(message + 2, option.name, length) == 0 && strchr(": ", message[2 + length]))
            print_option(&option, stderr);
    }
    const char *whole = usage_of(command, true);
    if (strlen(whole) <= SHORT)
        fprintf(stderr, "%s\n", whole);
    else
        fprintf(stderr, "%s [OPTIONS]; refdyn %s --help lists them\n", usage_of(command, false),
                command->name);
    return STATUS_USAGE;
}

enum status options_usage_error(const struct command *command, const char *format, ...) {
    char lead[64]; /* holds the name of any option */
    va_list list;
    va_start(list, format);
    vsnprintf(lead, sizeof lead, format, list);
    va_end(list);
    fprintf(stderr, "refdyn %s: ", command->name);
    va_start(list, format);
    format_vcomplain(format, list);
    va_end(list);
    fputc('\n', stderr);
    return end_usage_error(command, lead);
}

static const struct option_origin *find_origin(const struct options *options, const char *option) {
    for (int i = 0; i < options->origin_count; i++)
        if (strcmp(options->origins[i].option, option) == 0)
            return &options->origins[i];
    return NULL;
}

enum status options_error(const struct options *options, const char *option, const char *format, ...) {
    const struct option_origin *origin = find_origin(options, option);
    va_list list;
    if (origin)
        format_complain("%s: %s", origin->place, origin->field);
    else
        fprintf(stderr, "refdyn %s: --%s", options->command->name, option);
    va_start(list, format);
    format_vcomplain(format, list);
    va_end(list);
    fputc('\n', stderr);
    return origin ? STATUS_FAULT : end_usage_error(options->command, format_text("--%s:", option));
}

/* The command that differs from `name` only by its end, such as "sim" for "simulate", or by capitals. */
static const char *meant_command(const struct command *const *commands, const char *name) {
    for (; *commands; commands++) {
        const size_t own = strlen((*commands)->name), given = strlen(name);
        if (given > 1 && strncasecmp((*commands)->name, name, own < given ? own : given) == 0)
            return (*commands)->name;
    }
    return NULL;
}

/* Reports a name that is no command. */
static enum status command_error(const struct command *const *commands, const char *name) {
    const char *meant = meant_command(commands, name), *dot = strrchr(name, '.');
    format_complain("refdyn: unknown command '%s'; use one of", name);
    for (int i = 0; commands[i]; i++)
        fprintf(stderr, "%s %s", i ? "," : "", commands[i]->name);
    if (dot && strcmp(dot, ".lua") == 0)
        format_complain("; a command comes first: refdyn check %s", name);
    else if (meant)
        fprintf(stderr, "; write refdyn %s", meant);
    fputs("\nusage: refdyn COMMAND ARGUMENTS\n", stderr);
    return STATUS_USAGE;
}

/* ---- Lists and choices ---- */

static bool is_number(const struct option_rule *rule) {
    return rule->kind == OPTION_POSITIVE || rule->kind == OPTION_COUNT || rule->kind == OPTION_INDEX;
}

void options_give(const struct options *options,
                  void take(void *context, const char *name, const char *value), void *context) {
    struct known_option known[OPTIONS_MOST];
    const int count = command_options(options->command, known);
    for (int i = 0; i < count; i++) {
        char number[NUMBER_LENGTH];
        for (int k = 0; k < options->value_count; k++)
            if (strcmp(options->values[k].name, known[i].rule->name) == 0)
                take(context, known[i].rule->name,
                     is_number(known[i].rule) ? exact_text(options->values[k].number, number)
                                              : options->values[k].text);
    }
    for (int i = 0; i < options->setting_count; i++)
        take(context, "set", format_text("%s=%s", options->settings[i].name, options->settings[i].value));
}

const char **options_list(const char *list) {
    char *rest = list ? format_text("%s", list) : NULL;
    const char **items = format_allocate(list ? strlen(list) + 2 : 1, sizeof *items);
    for (int i = 0; rest; i++)
        items[i] = strsep(&rest, ",");
    return items;
}

enum status options_choose(const struct options *options, const char *name, int *place) {
    struct text known = {.memory = &format_memory};
    const char *word = options_text(options, name);
    const char *meant = NULL; /* the same word in other capitals */
    *place = 0;
    if (!word)
        return STATUS_DONE;
    const char *const *words = option_find(options->command, name, strlen(name))->words;
    for (; words[*place]; ++*place) {
        if (strcmp(word, words[*place]) == 0)
            return STATUS_DONE;
        if (strcasecmp(word, words[*place]) == 0)
            meant = words[*place];
        text_add(&known, "%s%s", *place ? ", " : "", words[*place]);
    }
    return options_error(options, name, ": '%s' is not one of %s%s%s", word, known.data,
                         meant ? "; write " : "", meant ? meant : "");
}

const char *const options_places[] = {"initial", "statics", NULL};

const char *options_state_path(const char *place) {
    return place && strcmp(place, "initial") != 0 && strcmp(place, "statics") != 0 ? place : NULL;
}

/* ---- Reading one option ---- */

/* The number that getopt_long returns for the first option of this call. It is beyond all letters. */
enum { FIRST_ANSWER = 256 };

struct reading {
    struct options *options;
    struct known_option known[OPTIONS_MOST];
    int known_count;
    struct option
        table[OPTIONS_MOST + 1]; /* getopt_long's: the value of each is its place plus FIRST_ANSWER */
};

static void make_table(struct reading *reading) {
    for (int i = 0; i < reading->known_count; i++) {
        const struct option_rule *rule = reading->known[i].rule;
        reading->table[i] = (struct option){.name = rule->name,
                                            .has_arg = rule->argument ? required_argument : no_argument,
                                            .val = i + FIRST_ANSWER};
    }
    reading->table[reading->known_count] = (struct option){.name = NULL};
}

/* Names of options in Python and in other programs. */
static const char *const other_names[][2] = {
    {"dt", "step"}, {"rtol", "tol"}, {"t-end", "until"}, {"t_end", "until"}};

static const char *nearest_option(const struct reading *reading, const char *given) {
    for (size_t i = 0; i < sizeof other_names / sizeof *other_names; i++)
        for (int k = 0; strcmp(given, other_names[i][0]) == 0 && k < reading->known_count; k++)
            if (strcmp(reading->known[k].rule->name, other_names[i][1]) == 0)
                return other_names[i][1];
    const char *names[OPTIONS_MOST];
    for (int i = 0; i < reading->known_count; i++)
        names[i] = reading->known[i].rule->name;
    return message_nearest_name(given, names, reading->known_count);
}

/* getopt_long answered `answer`, '?' or ':'; optopt is a letter, 0, or from FIRST_ANSWER on for a long
 * option. */
static enum status wrong_option(const struct reading *reading, char **argv, int answer) {
    const struct command *command = reading->options->command;
    char letter[] = {'-', (char)optopt, '\0'};
    const bool is_letter = optopt > 0 && optopt < FIRST_ANSWER;
    const char *given = is_letter ? letter : argv[optind - 1];
    const char *word = is_letter && argv[optind] ? argv[optind] : ""; /* its other letters are still ahead */
    for (int i = 0; i < reading->known_count; i++)
        if (*word == '-' && strcmp(reading->known[i].rule->name, word + 1) == 0)
            return options_usage_error(command, "unknown option %s; write --%s", word, word + 1);
    if (answer == ':')
        return options_usage_error(command, "%s needs a value", given);
    const char *near = is_letter || optopt ? NULL : nearest_option(reading, given + 2);
    if (near)
        return options_usage_error(command, "unknown option %s; the nearest is --%s", given, near);
    return options_usage_error(
        command, optopt && !is_letter ? "%s: this option takes no value" : "unknown option %s", given);
}

static enum status read_number(struct options *options, const struct option_rule *rule, const char *text) {
    enum { LARGEST = 1000000 };
    double value;
    const bool is_number = text_to_number(text, &value);
    const char *advice = message_number_advice(&format_memory, text);
    if (rule->kind == OPTION_INDEX && !(is_number && value >= 0 && value == floor(value)))
        return options_usage_error(options->command, "--%s: '%s' is not a whole number of at least 0%s",
                                   rule->name, text, advice);
    if (rule->kind != OPTION_INDEX && !(is_number && value > 0))
        return options_usage_error(options->command, "--%s: '%s' is not a positive number%s", rule->name,
                                   text, advice);
    if (rule->kind == OPTION_COUNT && (value > LARGEST || value != floor(value)))
        return options_usage_error(options->command, "--%s: %s is not a whole number up to %d", rule->name,
                                   text, LARGEST);
    options_set_number(options, rule->name, value);
    return STATUS_DONE;
}

enum status options_check_list(const struct command *command, const char *name, const char *list) {
    const char **items = options_list(list);
    for (int i = 0; items[i]; i++) {
        if (!*items[i])
            return options_usage_error(command, "--%s: '%s' has an empty item", name, list);
        if (*items[i] == ' ' || items[i][strlen(items[i]) - 1] == ' ')
            return options_usage_error(
                command, "--%s: '%s' has a blank next to a comma or at an end; remove it", name, list);
        if (text_index(items[i], items, i) >= 0)
            return options_usage_error(command, "--%s: '%s' is given twice; give it once", name, items[i]);
    }
    return STATUS_DONE;
}

static enum status read_words(struct options *options, const struct option_rule *rule, const char *text) {
    options_set_text(options, rule->name, text);
    if (rule->kind == OPTION_TEXT)
        return *text ? STATUS_DONE
                     : options_usage_error(options->command, "--%s: the value is empty", rule->name);
    return rule->kind == OPTION_FREEING_LIST && !*text
               ? STATUS_DONE
               : options_check_list(options->command, rule->name, text);
}

static enum status add_setting(struct options *options, char *text) {
    char *equals = strchr(text, '=');
    if (!equals || equals == text)
        return options_usage_error(options->command, "--set: '%s' is not of the form NAME=VALUE", text);
    *equals = '\0'; /* argv may be changed; the name ends here */
    for (int i = 0; i < options->setting_count; i++)
        if (strcmp(options->settings[i].name, text) == 0)
            return options_usage_error(options->command, "--set %s: given twice, as '%s' and as '%s'", text,
                                       options->settings[i].value, equals + 1);
    options->settings[options->setting_count++] = (struct setting){.name = text, .value = equals + 1};
    return STATUS_DONE;
}

static enum status add_text(struct options *options, const struct option_rule *rule, const char *text) {
    const char *other;
    for (int i = 0; (other = options_repeated(options, rule->name, i)); i++)
        if (strcmp(other, text) == 0)
            return options_usage_error(options->command, "--%s: '%s' is given twice; give it once",
                                       rule->name, text);
    options_add_text(options, rule->name, text);
    return STATUS_DONE;
}

/* Is this word an option of the command, which getopt_long took as the value of the option before it? Such a
 * value is written after an equals sign: --NAME=VALUE. */
static bool is_option(const struct reading *reading, const char *word) {
    if (strcmp(word, "-o") == 0 || strcmp(word, "-h") == 0)
        return true;
    for (int i = 0; i < reading->known_count && strncmp(word, "--", 2) == 0; i++) {
        const char *known = reading->known[i].rule->name;
        const size_t length = strlen(known);
        if (strncmp(word + 2, known, length) == 0 && strchr("=", word[2 + length]))
            return true;
    }
    return false;
}

static enum status read_option(struct options *options, const struct option_rule *rule) {
    if (!option_may_repeat(rule) && options_has(options, rule->name))
        return options_usage_error(options->command, "%s is given twice", option_shown(rule));
    switch (rule->kind) {
    case OPTION_FLAG:
        options_set_flag(options, rule->name);
        return STATUS_DONE;
    case OPTION_TEXTS:
        return add_text(options, rule, optarg);
    case OPTION_SETTING:
        return add_setting(options, optarg);
    default:
        return is_number(rule) ? read_number(options, rule, optarg) : read_words(options, rule, optarg);
    }
}

/* ---- Checking the whole ---- */

/* Motions are written as tables or shown by pages; the ending of another kind of file would promise other
 * contents. */
static enum status check_ending(const struct options *options) {
    static const char *const others[][2] = {{".svg", "; refdyn plot draws it"},
                                            {".png", "; refdyn plot draws it"},
                                            {".pdf", "; refdyn plot draws it"},
                                            {".html", "; refdyn view shows it"},
                                            {".xlsx", ""},
                                            {".mat", ""},
                                            {".json", ""}};
    const char *shown = options->command->output, *output = options_text(options, "output"),
               *dot = output ? strrchr(output, '.') : NULL;
    const bool is_table = shown && strncmp(shown, "RUN", 3) == 0;
    for (size_t i = 0; is_table && dot && i < sizeof others / sizeof *others; i++)
        if (strcmp(dot, others[i][0]) == 0)
            return options_usage_error(options->command, "-o: '%s' must be a table, FILE.csv or FILE.h5%s",
                                       output, others[i][1]);
    if (shown && strcmp(shown, "PAGE.html") == 0 && dot && !strchr(dot, '/') &&
        strcasecmp(dot, ".html") != 0 && strcasecmp(dot, ".htm") != 0)
        return options_usage_error(options->command, "-o: '%s' must end in .html or .htm", output);
    return STATUS_DONE;
}

/* An option as word processors and web pages write it. */
static bool begins_with_dash(const char *operand) {
    unsigned code;
    return utf8_decode(operand, strlen(operand), &code) > 1 && *utf8_look_alike(code).instead == '-';
}

/* Is one of these options given, blanks between their names? */
static bool has_any(const struct options *options, const char *names) {
    for (int i = 0; names && i < options->value_count; i++) {
        const char *name = options->values[i].name, *at = strstr(names, name);
        if (at && (at == names || at[-1] == ' ') && strchr(" ", at[strlen(name)]))
            return true;
    }
    return false;
}

static enum status check_operands(const struct options *options) {
    const struct command *command = options->command;
    const bool many = strstr(command->operands, "...") != NULL;
    const int most = 1 + (strchr(command->operands, ' ') != NULL);
    if (options->operand_count == 0 && !has_any(options, command->replaces_operands))
        return options_usage_error(command, "%s is missing", command->operands);
    for (int i = 0; i < options->operand_count; i++)
        if (!*options->operands[i])
            return options_usage_error(command, "%s is an empty text", command->operands);
    for (int i = 0; i < options->operand_count; i++)
        if (begins_with_dash(options->operands[i]))
            return options_usage_error(command,
                                       "'%s' begins with a typographic dash; an option begins with --",
                                       options->operands[i]);
    if (options->operand_count > most && !many)
        return options_usage_error(command, "unexpected operand '%s'; give only %s", options->operands[most],
                                   command->operands);
    return STATUS_DONE;
}

static enum status check_complete(const struct reading *reading) {
    const struct options *options = reading->options;
    const enum status status = check_operands(options);
    if (status != STATUS_DONE || has_any(options, options->command->replaces_operands))
        return status;
    for (int i = 0; i < reading->known_count && !has_any(options, options->command->replaces_needed); i++)
        if (reading->known[i].is_needed && !options_has(options, reading->known[i].rule->name))
            return options_usage_error(options->command, "%s is missing",
                                       option_shown(reading->known[i].rule));
    return check_ending(options);
}

/* Reads what follows the command's name. Returns true if the command is to run. */
static bool read_command(int argc, char **argv, struct options *options, enum status *status) {
    struct reading reading = {.options = options};
    reading.known_count = command_options(options->command, reading.known);
    make_table(&reading);
    const bool has_output = option_is_output(reading.known[0].rule);
    *status = STATUS_DONE;
    opterr = 0;
    while (*status == STATUS_DONE) {
        int answer = getopt_long(argc, argv, has_output ? ":ho:" : ":h", reading.table, NULL);
        if (answer == -1)
            break;
        if (answer == 'o')
            answer = FIRST_ANSWER; /* -o is the first option of each command that has it */
        if (answer == '?' || answer == ':')
            *status = wrong_option(&reading, argv, answer);
        else if (answer == 'h' || reading.known[answer - FIRST_ANSWER].rule->kind == OPTION_HELP) {
            print_command_help(options->command);
            return false;
        } else if (optarg && optarg == argv[optind - 1] && is_option(&reading, optarg))
            *status = options_usage_error(options->command, "%s needs a value before '%s'",
                                          option_shown(reading.known[answer - FIRST_ANSWER].rule), optarg);
        else
            *status = read_option(options, reading.known[answer - FIRST_ANSWER].rule);
    }
    options->operands = (const char **)argv + optind;
    options->operand_count = argc - optind;
    if (*status == STATUS_DONE)
        *status = check_complete(&reading);
    return *status == STATUS_DONE;
}

/* ---- The command ---- */

static const struct command *find_command(const struct command *const *commands, const char *name) {
    for (; *commands; commands++)
        if (strcmp((*commands)->name, name) == 0)
            return *commands;
    return NULL;
}

static bool is_help(const char *word) {
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0;
}

/* Of all commands, or of the one that is named. */
static enum status help(const struct command *const *commands, const char *name) {
    const struct command *command = name ? find_command(commands, name) : NULL;
    if (name && !command)
        return command_error(commands, name);
    if (command)
        print_command_help(command);
    else
        print_help(commands);
    return STATUS_DONE;
}

/* Version, commit, and which optional parts the program has. */
static void print_version(void) {
    puts("refdyn " REFDYN_VERSION);
    if (*tool_commit)
        printf("commit %s\n", tool_commit);
    fputs("with LAPACK", stdout);
#ifdef REFDYN_HAS_GSL
    fputs(", GSL", stdout);
#endif
#ifdef REFDYN_HAS_HDF5
    fputs(", HDF5", stdout);
#endif
#ifdef REFDYN_HAS_EXPAT
    fputs(", URDF", stdout);
#endif
#ifdef REFDYN_HAS_MINIZIP
    fputs(", FMUs", stdout);
#endif
#ifdef REFDYN_HAS_NLOPT
    fputs(", NLopt", stdout);
#endif
    putchar('\n');
}

bool options_read(const struct command *const *commands, int argc, char **argv, struct options *options,
                  enum status *status) {
    *options = (struct options){.commands = commands, .arguments = argv, .argument_count = argc};
    *status = argc < 2 ? STATUS_USAGE : STATUS_DONE;
    if (argc < 2) {
        fputs("usage: refdyn COMMAND ARGUMENTS; refdyn --help lists the commands\n", stderr);
        return false;
    }
    if (is_help(argv[1])) {
        *status = help(commands, argv[2]);
        return false;
    }
    if (strcmp(argv[1], "--version") == 0) {
        print_version();
        return false;
    }
    options->command = find_command(commands, argv[1]);
    if (!options->command) {
        *status = command_error(commands, argv[1]);
        return false;
    }
    options->settings = format_allocate((size_t)argc, sizeof *options->settings);
    return read_command(argc - 1, argv + 1, options, status);
}
