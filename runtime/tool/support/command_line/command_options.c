/* The command line of `refdyn`: see command_line.h. A table of options; each command names those it knows. */
#include "runtime/tool/support/command_line/command_line.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"
#include "refdyn.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* A list has names or numbers between commas, each once; one that frees may be empty. */
enum kind {
    KIND_FLAG,
    KIND_TEXT,
    KIND_LIST,
    KIND_FREEING_LIST,
    KIND_POSITIVE,
    KIND_COUNT,
    KIND_NUMBER, /* a whole number from 0 */
    KIND_SETTING,
    KIND_STOP,
    KIND_HELP
};

struct rule {
    const char *name, *argument;
    enum kind kind;
    size_t offset;    /* of the field in struct options */
    const char *help; /* NULL: the methods */
};

#define FIELD(name) offsetof(struct options, name)

static const struct rule rules[] = {
    {"output", "FILE", KIND_TEXT, FIELD(output), "where results go"},
    {"emit", "M,h,...", KIND_LIST, FIELD(emit),
     "these quantities only; all: every one but derivatives; implicit: the tangent of implicit steps; step: "
     "fixed steps with derivatives, step.p: by the parameters, too"},
    {"for-lanes", NULL, KIND_FLAG, FIELD(for_lanes),
     "the same functions for 2, 4 or 8 motions side by side, too; gen writes them as NAME_lanes.c"},
    {"for-casadi", NULL, KIND_FLAG, FIELD(for_casadi),
     "the same functions and their derivatives for CasADi, too: NAME_casadi.c, compiled alone into a shared "
     "library"},
    {"depfile", "FILE.d", KIND_TEXT, FIELD(depfile),
     "a rule of make: what is emitted depends on the model and what it requires"},
    {"explain", "PASS", KIND_TEXT, FIELD(explain),
     "without -o: print what the generator holds behind a pass: expand, roll, derive, sums or plan"},
    {"state", "STATE.json", KIND_TEXT, FIELD(state),
     "t, q, qd, inputs, parameters; what is left out is the model's"},
    {"until", "T", KIND_POSITIVE, FIELD(until), "end of the motion [s]"},
    {"method", "NAME", KIND_TEXT, FIELD(method), NULL},
    {"step", "H", KIND_POSITIVE, FIELD(step), "fixed steps of this size [s]"},
    {"tol", "TOL", KIND_POSITIVE, FIELD(tolerance),
     "steps are found: error of each, as a part of 1 rad and the model's length, 1 m where it states none "
     "(default 1e-6)"},
    {"step-max", "H", KIND_POSITIVE, FIELD(step_max), "largest step that is found [s] (default: no bound)"},
    {"accuracy", "ERROR", KIND_POSITIVE, FIELD(accuracy),
     "the error of the whole motion [m, rad]: the tolerance is found"},
    {"verify", NULL, KIND_FLAG, FIELD(verify), "estimate the error of the whole motion by a finer one"},
    {"inputs", "FILE.csv", KIND_TEXT, FIELD(inputs), "samples of inputs over t, each held until the next"},
    {"stop", "NAME<VALUE", KIND_STOP, 0,
     "end where a column of the CSV falls below a value, or with > exceeds it (repeatable)"},
    {"every", "DT", KIND_POSITIVE, FIELD(every), "time between outputs [s] (default T/200)"},
    {"from", "WHERE", KIND_TEXT, FIELD(from), "initial (default), statics, or a STATE.json"},
    {"at", "WHERE", KIND_TEXT, FIELD(at), "statics (default), initial, or a STATE.json; rates are 0"},
    {"modes", "K", KIND_COUNT, FIELD(modes), "the K slowest modes only"},
    {"stabilise", "HOW", KIND_TEXT, FIELD(stabilise),
     "none, baumgarte (default with rk4), baumgarte-auto (gains from the step) or project (default with the "
     "others)"},
    {"singular", "HOW", KIND_TEXT, FIELD(singular),
     "where the constraint rows lose rank: stop (default), or pass where a branch can be followed"},
    {"start", "HOW", KIND_TEXT, FIELD(start), "as-is (default) or project: moved onto the programme first"},
    {"hold", "a,b", KIND_FREEING_LIST, FIELD(hold),
     "coordinates held in statics and modes, instead of the model's ('' frees all)"},
    {"release", "a,b", KIND_LIST, FIELD(release), "constraint rows that do not hold in statics"},
    {"way", "HOW", KIND_TEXT, FIELD(way),
     "how statics finds its equilibrium: load (default) raises the load and jumps where it cannot grow on, "
     "path "
     "passes limit points step by step, downhill leads to a stable one"},
    {"summary", "FILE.json", KIND_TEXT, FIELD(summary), "the summary as JSON"},
    {"panel", "a,b", KIND_LIST, FIELD(panel),
     "these panels only: angles, slides, bending-psi, bending-theta, torsion, others, path, side, height, "
     "velocity, "
     "forces, torques, inputs, phi, psi, energy"},
    {"units", "FILE.json", KIND_TEXT, FIELD(units), "units of columns, from the summary of refdyn sim"},
    {"model", "MODEL.lua", KIND_TEXT, FIELD(model), "of the runs that are CSV; files of HDF5 have theirs"},
    {"draw", "FILE.svg", KIND_TEXT, FIELD(draw),
     "draw the tree of links, with rows and drives, as SVG, PNG or PDF by the suffix of FILE"},
    {"methods", "a,b,c", KIND_LIST, FIELD(methods), "methods to compare (default: all)"},
    {"tols", "a,b,c", KIND_LIST, FIELD(tols),
     "tolerances of the methods that find their steps (default: each power of ten from 1e-2 to 1e-12)"},
    {"steps", "a,b,c", KIND_LIST, FIELD(steps),
     "steps of those with fixed ones [s] (default: from the largest stable one downward)"},
    {"seconds", "S", KIND_POSITIVE, FIELD(seconds), "time for all runs together [s] (default 60)"},
    {"vary", "OPTION=V1,V2", KIND_TEXT, FIELD(vary),
     "repeat the study for these values of a structural option"},
    {"table", "CASES.csv", KIND_TEXT, FIELD(table),
     "instead of SWEEP.lua: a row for each case, a column for each name that varies"},
    {"threads", "N", KIND_COUNT, FIELD(threads), "threads that compute cases (default: the processors)"},
    {"lanes", "N", KIND_COUNT, FIELD(lanes),
     "steps of 1, 2, 4 or 8 cases side by side (default: by the vectors, the model and the number of cases)"},
    {"cases", "A:B", KIND_TEXT, FIELD(cases), "the cases from A to B - 1 only"},
    {"of", "RUNS.h5", KIND_TEXT, FIELD(of), "instead of MODEL.lua: a case of this file of runs once more"},
    {"case", "K", KIND_NUMBER, FIELD(case_number), "which case of --of"},
    {"resume", NULL, KIND_FLAG, FIELD(resume), "go on with a batch that was interrupted"},
    {"dry-run", NULL, KIND_FLAG, FIELD(dry_run),
     "check, compile and try a few cases, and tell how many there are, and time and size of all"},
    {"slurm", NULL, KIND_FLAG, FIELD(slurm),
     "compute the cases by jobs of Slurm, on as many machines as it gives"},
    {"chunks", "N", KIND_COUNT, FIELD(chunks),
     "with --slurm: how many jobs share the cases (default: one for each 16 cases, at most 100)"},
    {"slurm-options", "TEXT", KIND_TEXT, FIELD(slurm_options),
     "with --slurm: options of sbatch, '--partition=long --time=1:00:00'"},
    {"flexible", "a,b", KIND_LIST, FIELD(flexible), "links that become beams, from their origin to --tip"},
    {"section", "SHAPE", KIND_TEXT, FIELD(section),
     "of these: round:DIAMETER, tube:OUTER:INNER or rectangle:WIDTH_Y:HEIGHT_Z [m]"},
    {"tip", "x,y,z", KIND_TEXT, FIELD(tip),
     "where they end, in the link's frame (default: where what the link carries begins) [m]"},
    {"E", "E", KIND_POSITIVE, FIELD(E), "Young's modulus [Pa]"},
    {"nu", "NU", KIND_TEXT, FIELD(nu), "Poisson's ratio (default 0.3)"},
    {"eta", "ETA", KIND_TEXT, FIELD(eta), "damping over stiffness (default 0) [s]"},
    {"rho", "RHO", KIND_POSITIVE, FIELD(rho),
     "density (default: as much of the link's mass as a body that can exist spares) [kg/m^3]"},
    {"rfe", "N", KIND_COUNT, FIELD(rfe), "rigid finite elements of a beam (default 4)"},
    {"friction-width", "RATE", KIND_POSITIVE, FIELD(friction_width),
     "take dry friction, smooth over this rate [rad/s, m/s] (default: it is left out)"},
    {"right-angles", "TOL", KIND_POSITIVE, FIELD(right_angles),
     "take angles of frames that are as near to right ones as these [rad]"},
    {"drives", NULL, KIND_FLAG, FIELD(drives),
     "each joint has an input, which acts up to the joint's effort (default: nothing drives the joints)"},
    {"floating", NULL, KIND_FLAG, FIELD(floating),
     "the root moves freely (default: it stands on the ground)"},
    {"fmu", "VERSION", KIND_TEXT, FIELD(fmu), "version of FMI: 2.0 or 3.0"},
    {"platform", "a,b", KIND_LIST, FIELD(platform),
     "libraries in the FMU: linux64 (default), win64, which takes gcc-mingw-w64"},
    {"set", "NAME=VALUE", KIND_SETTING, 0, "set an option or a parameter of the model (repeatable)"},
    {"loops", "WHEN", KIND_TEXT, FIELD(loops),
     "auto (default), always or never: loops over equal elements instead of code for each"},
    {"accelerations", "HOW", KIND_TEXT, FIELD(accelerations),
     "auto (default), recursive or dense: how the C solves M qdd = f"},
    {"fold", NULL, KIND_FLAG, FIELD(fold), "turn parameters into numbers in the C"},
    {"help", NULL, KIND_HELP, 0, "this text"},
};

enum { RULE_OUTPUT, RULE_COUNT = sizeof rules / sizeof rules[0] };

/* What getopt_long answers for the first rule: beyond all letters, and its '?' and ':'. */
enum { FIRST_ANSWER = 256 };

/* Does the command know the option, and does it need it? */
enum standing { UNKNOWN, KNOWN, NEEDED };

static enum standing standing_of(const struct command *command, const struct rule *rule) {
    const size_t length = strlen(rule->name);
    if (rule->kind == KIND_HELP)
        return KNOWN;
    for (const char *at = command->options; (at = strstr(at, rule->name)); at += length) {
        const bool starts = at == command->options || at[-1] == ' ';
        if (starts && strchr(" !", at[length])) /* the end of the text counts as a blank */
            return at[length] == '!' ? NEEDED : KNOWN;
    }
    return UNKNOWN;
}

static const char *shown_name(const struct rule *rule) {
    return rule == &rules[RULE_OUTPUT] ? "-o" : text_format("--%s", rule->name);
}

/* What it takes, as the usage line says; "": nothing. */
static const char *argument_of(const struct command *command, const struct rule *rule) {
    if (rule == &rules[RULE_OUTPUT])
        return command->output;
    return rule->argument ? rule->argument : "";
}

static void print_usage(const struct command *command, FILE *out) {
    fprintf(out, "usage: refdyn %s %s", command->name, command->operands);
    for (int i = 0; i < RULE_COUNT; i++) {
        const enum standing standing = standing_of(command, &rules[i]);
        const char *argument = argument_of(command, &rules[i]);
        if (standing != UNKNOWN && rules[i].kind != KIND_HELP)
            fprintf(out, standing == NEEDED ? " %s%s%s" : " [%s%s%s]", shown_name(&rules[i]),
                    *argument ? " " : "", argument);
    }
    fputc('\n', out);
}

const char *options_methods(bool is_explicit) {
    struct text text = {.memory = &program_memory};
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (!is_explicit || !refdyn_method_is_implicit((enum refdyn_method)method))
            text_add(&text, "%s%s", text.length ? ", " : "", refdyn_method_name(method));
    return text.data;
}

static const char *help_of(const struct command *command, const struct rule *rule) {
    return rule->help ? rule->help
                      : text_format("%s%s (default: rk4 with --step, auto without)", options_methods(false),
                                    command->takes_gsl && HAS_METHODS_OF_GSL ? ", msbdf, bsimp" : "");
}

static bool may_repeat(const struct rule *rule) {
    return rule->kind == KIND_SETTING || rule->kind == KIND_STOP;
}

bool options_describe(const struct command *command, int number, struct option_text *text) {
    for (int i = 0; i < RULE_COUNT; i++) {
        const struct rule *rule = &rules[i];
        const enum standing standing = standing_of(command, rule);
        if (standing == UNKNOWN || number-- > 0)
            continue;
        *text = (struct option_text){.name = rule->name,
                                     .argument = argument_of(command, rule),
                                     .help = help_of(command, rule),
                                     .is_output = i == RULE_OUTPUT,
                                     .is_needed = standing == NEEDED,
                                     .may_repeat = may_repeat(rule),
                                     .is_list = rule->kind == KIND_LIST || rule->kind == KIND_FREEING_LIST};
        return true;
    }
    return false;
}

static void print_command_help(const struct command *command) {
    enum { WIDTH = 28 };
    struct option_text option;
    print_usage(command, stdout);
    printf("\n%s\n\n%s\noptions:\n", command->purpose, command->help);
    for (int i = 0; options_describe(command, i, &option); i++) {
        const int width = printf("  %s--%s %s", option.is_output ? "-o, " : "", option.name, option.argument);
        printf("%*s%s\n", width < WIDTH ? WIDTH - width : 1, "", option.help);
    }
    puts("\nexit status: 0 done; 1 model, state or file at fault; 2 wrong usage; 3 the numbers failed");
}

static void print_help(const struct command *commands) {
    puts("usage: refdyn COMMAND ARGUMENTS\n\n"
         "Refdyn turns a Lua model of a robot with flexible links into C code of its dynamics,\n"
         "and computes its equilibria, frequencies and programme-constrained motions.\n\ncommands:");
    for (const struct command *command = commands; command->name; command++)
        printf("  %-11s%s\n", command->name, command->purpose);
    puts("\nrefdyn COMMAND --help tells more; --version prints the version.");
}

enum status usage_error(const struct command *command, const char *format, ...) {
    va_list list;
    va_start(list, format);
    fprintf(stderr, "refdyn %s: ", command->name);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    print_usage(command, stderr);
    return STATUS_USAGE;
}

static const struct told_option *told_option(const struct options *options, const char *option) {
    for (int i = 0; i < options->told_count; i++)
        if (strcmp(options->told[i].option, option) == 0)
            return &options->told[i];
    return NULL;
}

enum status option_error(const struct options *options, const char *option, const char *format, ...) {
    const struct told_option *told = told_option(options, option);
    va_list list;
    if (told)
        fprintf(stderr, "%s: %s", told->place, told->field);
    else
        fprintf(stderr, "refdyn %s: --%s", options->command->name, option);
    va_start(list, format);
    vfprintf(stderr, format, list);
    va_end(list);
    fputc('\n', stderr);
    if (told)
        return STATUS_FAULT;
    print_usage(options->command, stderr);
    return STATUS_USAGE;
}

/* The command that differs by its end only, such as "sim" for "simulate", in any capitals; or NULL. */
static const char *meant_command(const struct command *commands, const char *name) {
    for (const struct command *command = commands; command->name; command++) {
        const size_t own = strlen(command->name), given = strlen(name);
        if (given > 1 && strncasecmp(command->name, name, own < given ? own : given) == 0)
            return command->name;
    }
    return NULL;
}

static enum status unknown_command(const struct command *commands, const char *name) {
    const char *meant = meant_command(commands, name), *dot = strrchr(name, '.');
    fprintf(stderr, "refdyn: unknown command '%s', the commands are", name);
    for (const struct command *command = commands; command->name; command++)
        fprintf(stderr, "%s %s", command == commands ? "" : ",", command->name);
    if (dot && strcmp(dot, ".lua") == 0)
        fprintf(stderr, "; a command comes first: refdyn check %s", name);
    else if (meant)
        fprintf(stderr, "; write refdyn %s", meant);
    fputs("\nusage: refdyn COMMAND ARGUMENTS\n", stderr);
    return STATUS_USAGE;
}

static const struct command *find_command(const struct command *commands, const char *name) {
    for (const struct command *command = commands; command->name; command++)
        if (strcmp(command->name, name) == 0)
            return command;
    return NULL;
}

/* getopt_long's tables: the long options of this command; each option's value is its place in `rules`, plus
 * FIRST_ANSWER. */
static void option_table(const struct command *command, struct option *table) {
    for (int i = 0; i < RULE_COUNT; i++)
        if (standing_of(command, &rules[i]) != UNKNOWN)
            *table++ = (struct option){.name = rules[i].name,
                                       .has_arg = rules[i].argument ? required_argument : no_argument,
                                       .val = i + FIRST_ANSWER};
    *table = (struct option){.name = NULL};
}

static const char *nearest_option(const struct option *table, const char *given) {
    const char *names[RULE_COUNT];
    int count = 0;
    for (; table->name; table++)
        names[count++] = table->name;
    return message_nearest_name(given, names, count);
}

/* getopt_long answered `answer`, '?' or ':'; optopt is a letter, 0, or from FIRST_ANSWER on for a long
 * option. */
static enum status wrong_option(const struct command *command, const struct option *table, char **argv,
                                int answer) {
    char letter[] = {'-', (char)optopt, '\0'};
    bool is_letter = optopt > 0 && optopt < FIRST_ANSWER;
    const char *given = is_letter ? letter : argv[optind - 1];
    const char *word = is_letter && argv[optind] ? argv[optind] : ""; /* of several letters: not done with */
    for (const struct option *option = table; option->name; option++)
        if (*word == '-' && strcmp(option->name, word + 1) == 0)
            return usage_error(command, "unknown option %s; write --%s", word, word + 1);
    if (answer == ':')
        return usage_error(command, "%s needs a value", given);
    const char *near = is_letter || optopt ? NULL : nearest_option(table, given + 2);
    if (near)
        return usage_error(command, "unknown option %s, the nearest is --%s", given, near);
    return usage_error(command, optopt && !is_letter ? "%s: this option takes no value" : "unknown option %s",
                       given);
}

static enum status read_number(const struct command *command, const struct rule *rule, const char *text,
                               double *value) {
    enum { LARGEST = 1000000 };
    if (rule->kind == KIND_NUMBER && text_to_number(text, value) && *value >= 0 && *value == floor(*value))
        return STATUS_DONE;
    if (rule->kind == KIND_NUMBER)
        return usage_error(command, "--%s: '%s' is no whole number from 0 on%s", rule->name, text,
                           message_number_advice(&program_memory, text));
    if (!text_to_number(text, value) || *value <= 0)
        return usage_error(command, "--%s: '%s' is no positive number%s", rule->name, text,
                           message_number_advice(&program_memory, text));
    if (rule->kind == KIND_COUNT && (*value > LARGEST || *value != floor(*value)))
        return usage_error(command, "--%s: %s is no whole number up to %d", rule->name, text, LARGEST);
    return STATUS_DONE;
}

const char **options_list(const char *list) {
    char *rest = list ? text_format("%s", list) : NULL;
    const char **items = allocate(list ? strlen(list) + 2 : 1, sizeof *items);
    for (int i = 0; rest; i++)
        items[i] = strsep(&rest, ",");
    return items;
}

enum status check_list(const struct command *command, const char *name, const char *list) {
    const char **items = options_list(list);
    for (int i = 0; items[i]; i++) {
        if (!*items[i])
            return usage_error(command, "--%s: '%s' has an empty item", name, list);
        if (text_index(items[i], items, i) >= 0)
            return usage_error(command, "--%s: '%s' is there twice, once is enough", name, items[i]);
    }
    return STATUS_DONE;
}

enum status options_choose(const struct options *options, const char *option, const char *word,
                           const char *const *names, int *place) {
    struct text known = {.memory = &program_memory};
    const char *meant = NULL; /* but for capitals */
    for (*place = 0; names[*place]; ++*place) {
        if (strcmp(word, names[*place]) == 0)
            return STATUS_DONE;
        if (strcasecmp(word, names[*place]) == 0)
            meant = names[*place];
        text_add(&known, "%s%s", *place ? ", " : "", names[*place]);
    }
    return option_error(options, option, ": '%s' is none of %s%s%s", word, known.data,
                        meant ? "; write " : "", meant ? meant : "");
}

static enum status check_text(const struct command *command, const struct rule *rule, const char *text) {
    if (rule->kind == KIND_TEXT)
        return *text ? STATUS_DONE : usage_error(command, "--%s: the value is empty", rule->name);
    return rule->kind == KIND_FREEING_LIST && !*text ? STATUS_DONE : check_list(command, rule->name, text);
}

const char *options_state_path(const char *place) {
    return place && strcmp(place, "initial") != 0 && strcmp(place, "statics") != 0 ? place : NULL;
}

static enum status add_setting(struct options *options, char *text) {
    char *equals = strchr(text, '=');
    if (!equals || equals == text)
        return usage_error(options->command, "--set: '%s' is not of the form NAME=VALUE", text);
    *equals = '\0'; /* argv may be changed; the name ends here */
    for (int i = 0; i < options->setting_count; i++)
        if (strcmp(options->settings[i].name, text) == 0)
            return usage_error(options->command, "--set %s: given twice, as '%s' and as '%s'", text,
                               options->settings[i].value, equals + 1);
    options->settings[options->setting_count++] = (struct setting){.name = text, .value = equals + 1};
    return STATUS_DONE;
}

static enum status add_stop(struct options *options, const char *text) {
    for (int i = 0; i < options->stop_count; i++)
        if (strcmp(options->stops[i], text) == 0)
            return usage_error(options->command, "--stop: '%s' is there twice, once is enough", text);
    options->stops[options->stop_count++] = text;
    return STATUS_DONE;
}

static enum status take_value(struct options *options, const struct rule *rule) {
    char *field = (char *)options + rule->offset;
    switch (rule->kind) {
    case KIND_FLAG:
        *(bool *)field = true;
        return STATUS_DONE;
    case KIND_TEXT:
    case KIND_LIST:
    case KIND_FREEING_LIST:
        *(const char **)field = optarg;
        return check_text(options->command, rule, optarg);
    case KIND_POSITIVE:
    case KIND_COUNT:
    case KIND_NUMBER:
        return read_number(options->command, rule, optarg, (double *)field);
    case KIND_STOP:
        return add_stop(options, optarg);
    default:
        return add_setting(options, optarg);
    }
}

/* An option that is no list of its own counts once. */
static enum status take_option(struct options *options, const struct rule *rule, bool *is_taken) {
    if (*is_taken && !may_repeat(rule))
        return usage_error(options->command, "%s is given twice", shown_name(rule));
    *is_taken = true;
    return take_value(options, rule);
}

static bool is_given(const struct options *options, const struct rule *rule) {
    const char *field = (const char *)options + rule->offset;
    switch (rule->kind) {
    case KIND_FLAG:
        return *(const bool *)field;
    case KIND_POSITIVE:
    case KIND_COUNT:
        return *(const double *)field > 0;
    case KIND_NUMBER:
        return *(const double *)field >= 0;
    case KIND_SETTING:
    case KIND_STOP:
    case KIND_HELP:
        return false; /* not in a field of its own */
    default:
        return *(const char *const *)field != NULL;
    }
}

/* `number` has room for one. */
static const char *value_as_text(const struct options *options, const struct rule *rule,
                                 char number[static NUMBER_LENGTH]) {
    const char *field = (const char *)options + rule->offset;
    switch (rule->kind) {
    case KIND_FLAG:
        return NULL;
    case KIND_POSITIVE:
    case KIND_COUNT:
    case KIND_NUMBER:
        return exact_text(*(const double *)field, number);
    default:
        return *(const char *const *)field;
    }
}

void options_give(const struct options *options,
                  void take(void *context, const char *name, const char *value), void *context) {
    for (int i = 0; i < RULE_COUNT; i++) {
        char number[NUMBER_LENGTH];
        if (standing_of(options->command, &rules[i]) != UNKNOWN && is_given(options, &rules[i]))
            take(context, rules[i].name, value_as_text(options, &rules[i], number));
    }
    for (int i = 0; i < options->stop_count; i++)
        take(context, "stop", options->stops[i]);
    for (int i = 0; i < options->setting_count; i++)
        take(context, "set", text_format("%s=%s", options->settings[i].name, options->settings[i].value));
}

/* Of a case again the file tells all but where it goes. */
static enum status check_alone(const struct options *options, const bool is_taken[static RULE_COUNT]) {
    for (int i = 0; i < RULE_COUNT && options->of; i++)
        if (is_taken[i] && rules[i].offset != FIELD(output) && rules[i].offset != FIELD(of) &&
            rules[i].offset != FIELD(case_number))
            return usage_error(options->command, "%s: the case of --of has its own", shown_name(&rules[i]));
    return STATUS_DONE;
}

/* Motions are written as tables; the ending of another kind of file would promise other contents. */
static enum status check_ending(const struct options *options) {
    static const char *const others[][2] = {{".svg", "; refdyn plot draws it"},
                                            {".png", "; refdyn plot draws it"},
                                            {".pdf", "; refdyn plot draws it"},
                                            {".html", "; refdyn view shows it"},
                                            {".xlsx", ""},
                                            {".mat", ""},
                                            {".json", ""}};
    const char *shown = options->command->output,
               *dot = options->output ? strrchr(options->output, '.') : NULL;
    const bool is_table = shown && strncmp(shown, "RUN", 3) == 0;
    for (size_t i = 0; is_table && dot && i < sizeof others / sizeof *others; i++)
        if (strcmp(dot, others[i][0]) == 0)
            return usage_error(options->command, "-o: '%s' is to be a table, FILE.csv or FILE.h5%s",
                               options->output, others[i][1]);
    return STATUS_DONE;
}

/* An option as word processors and web pages write it. */
static bool begins_with_dash(const char *operand) {
    unsigned code;
    return utf8_decode(operand, strlen(operand), &code) > 1 && *utf8_look_alike(code).instead == '-';
}

/* Operands and needed options; what explains a pass writes nothing. */
static enum status check_complete(const struct options *options) {
    const struct command *command = options->command;
    if (options->of && options->operand_count == 0 && options->case_number >= 0)
        return STATUS_DONE; /* the file tells all */
    if (options->of || options->case_number >= 0)
        return usage_error(command, "--case K --of RUNS.h5 stand together, and for MODEL.lua");
    const bool many = strstr(command->operands, "...") != NULL;
    const int most = 1 + (strchr(command->operands, ' ') != NULL);
    if (options->operand_count == 0)
        return usage_error(command, "%s is missing", command->operands);
    for (int i = 0; i < options->operand_count; i++)
        if (!*options->operands[i])
            return usage_error(command, "%s is an empty text", command->operands);
    for (int i = 0; i < options->operand_count; i++)
        if (begins_with_dash(options->operands[i]))
            return usage_error(command, "'%s' begins with a dash of print; an option begins with --",
                               options->operands[i]);
    if (options->operand_count > most && !many)
        return usage_error(command, "'%s' is too much, one %s is taken", options->operands[most],
                           command->operands);
    for (int i = 0; i < RULE_COUNT; i++)
        if (standing_of(command, &rules[i]) == NEEDED && !options->explain && !is_given(options, &rules[i]))
            return usage_error(command, "%s is missing", shown_name(&rules[i]));
    return check_ending(options);
}

/* Reads the options behind the command's name; true when the command is to run. */
static bool read_command(int argc, char **argv, struct options *options, enum status *status) {
    struct option table[RULE_COUNT + 1];
    bool is_taken[RULE_COUNT] = {false};
    option_table(options->command, table);
    const bool has_output = standing_of(options->command, &rules[RULE_OUTPUT]) != UNKNOWN;
    *status = STATUS_DONE;
    opterr = 0;
    while (*status == STATUS_DONE) {
        int answer = getopt_long(argc, argv, has_output ? ":ho:" : ":h", table, NULL);
        if (answer == -1)
            break;
        if (answer == 'o')
            answer = RULE_OUTPUT + FIRST_ANSWER;
        if (answer == '?' || answer == ':')
            *status = wrong_option(options->command, table, argv, answer);
        else if (answer == 'h' || rules[answer - FIRST_ANSWER].kind == KIND_HELP) {
            print_command_help(options->command);
            return false;
        } else
            *status = take_option(options, &rules[answer - FIRST_ANSWER], &is_taken[answer - FIRST_ANSWER]);
    }
    options->operands = (const char **)argv + optind;
    options->operand_count = argc - optind;
    if (*status == STATUS_DONE)
        *status = check_complete(options);
    if (*status == STATUS_DONE)
        *status = check_alone(options, is_taken);
    return *status == STATUS_DONE;
}

static bool is_help(const char *word) {
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0;
}

/* Of all commands, or of the one that is named. */
static enum status help(const struct command *commands, const char *name) {
    const struct command *command = name ? find_command(commands, name) : NULL;
    if (name && !command)
        return unknown_command(commands, name);
    if (command)
        print_command_help(command);
    else
        print_help(commands);
    return STATUS_DONE;
}

bool options_read(const struct command *commands, int argc, char **argv, struct options *options,
                  enum status *status) {
    *options =
        (struct options){.commands = commands, .arguments = argv, .argument_count = argc, .case_number = -1};
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
        puts("refdyn " REFDYN_VERSION);
        return false;
    }
    options->command = find_command(commands, argv[1]);
    if (!options->command) {
        *status = unknown_command(commands, argv[1]);
        return false;
    }
    options->settings = allocate((size_t)argc, sizeof *options->settings);
    options->stops = allocate((size_t)argc, sizeof *options->stops);
    return read_command(argc - 1, argv + 1, options, status);
}
