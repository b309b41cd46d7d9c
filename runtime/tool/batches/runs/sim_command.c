/* `refdyn sim`: one motion of a model, or with --of a case of a batch once more. */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/scene/scene.h"

#include <string.h>

/* The file of runs has all options of its cases; only the place of the result is free. */
static enum status check_case(const struct options *options) {
    static const char *const free_options[] = {"output", "of", "case", "steps"};
    if (options->operand_count > 0 || !options_has(options, "of") || !options_has(options, "case"))
        return options_usage_error(options->command,
                                   "--case K --of RUNS.h5 stand together, and for MODEL.lua");
    const char *other = options->setting_count > 0 ? "set" : NULL;
    for (int i = 0; i < options->value_count && !other; i++)
        if (text_index(options->values[i].name, free_options, 4) < 0)
            other = options->values[i].name;
    return other ? options_usage_error(options->command, "--%s: the case of --of has its own", other)
                 : STATUS_DONE;
}

static enum status check_drives(const struct options *options) {
    const enum status status = realise_check_options(options);
    if (status != STATUS_DONE)
        return status;
    if (options_has(options, "play") && options_has(options, "inputs"))
        return options_usage_error(options->command, "--play excludes --inputs: it has the inputs");
    if (options_has(options, "play") && !options_state_path(options_text(options, "from")))
        return options_usage_error(options->command,
                                   "--play needs --from START.json, the state that --realise has written");
    return STATUS_DONE;
}

static enum status run_model(const struct options *options) {
    const enum status status = check_drives(options);
    if (status != STATUS_DONE)
        return status;
    return options_has(options, "realise") ? realise_run(options) : simulate_run(options);
}

/* Also watches the files of these options. */
static enum status watch_model(const struct options *options) {
    const char *const given[] = {options_text(options, "inputs"), options_text(options, "play"),
                                 options_text(options, "parameters"), realise_state_path(options)};
    enum { MOST = sizeof given / sizeof *given };
    const char *files[MOST];
    int count = 0;
    for (int i = 0; i < MOST; i++)
        if (given[i])
            files[count++] = given[i];
    return scene_watch(options, *options->operands, files, count, run_model);
}

static enum status run_motion(const struct options *options) {
    if (!options_has(options, "of") && !options_has(options, "case"))
        return options_has(options, "watch") ? watch_model(options) : run_model(options);
    const enum status status = check_case(options);
    return status == STATUS_DONE ? runs_case_again(options) : status;
}

static const struct option_rule case_rules[] = {
    {"of", "RUNS.h5", OPTION_TEXT, "replaces MODEL.lua: repeat a case of this file of runs", NULL, NULL},
    {"case", "K", OPTION_INDEX, "number of the case in --of", NULL, NULL},
    {.name = NULL}};

const struct command sim_command = {
    .name = "sim",
    .run = run_motion,
    .operands = "MODEL.lua",
    .options = "output until! method step tol tol-rates step-max accuracy derivatives lanes verify inputs "
               "stop steps every "
               "from stabilise singular start hold release way realise before after mesh play summary watch "
               "of case parameters set fold",
    .tables = {case_rules, simulate_sim_rules, realise_rules, simulate_rules, equilibria_rules, scene_rules},
    .has_gsl = true,
    .replaces_operands = "of case",
    .output = "RUN.csv",
    .purpose = "one motion, as CSV or HDF5",
    .help = "Columns: t, coordinates, rates, points, residuals, energy, programme forces, inputs. A summary "
            "goes to stderr.\n"
            "RUN.h5 has the same as HDF5, with units, options and parameters.\n\n"
            "  refdyn sim models/manipulator.lua --set n_rfe=1 --until 10 --step 1e-3 -o rigid.csv\n"
            "  refdyn sim models/manipulator.lua --from statics --until 10 --tol 1e-8 -o flexible.csv\n"
            "  refdyn sim models/manipulator.lua --from statics --until 10 --accuracy 1e-6 --stop 'E_z<2' -o "
            "flexible.csv\n"
            "  refdyn sim models/crane.lua --until 5 --watch -o crane.csv\n"
            "  refdyn sim models/fourbar.lua --until 1 -o fourbar.csv --steps steps.csv\n"
            "  refdyn sim --case 12 --of runs.h5 -o case12.csv\n"};
