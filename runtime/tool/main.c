/* The program `refdyn`: the table of its commands, and the two that need nothing compiled. */
#include "commands.h"
#include "interrupt.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

static const struct command commands[] = {
    {.name = "gen",
     .run = run_gen,
     .operands = "MODEL.lua",
     .options = "output! emit explain accelerations loops set fold",
     .output = "DIR",
     .purpose = "write the C code of a model",
     .help = "Writes NAME.h and NAME.c (more .c files when long) into the folder of -o, and prints what was "
             "emitted.\n\n"
             "  refdyn gen models/manipulator.lua -o out\n"
             "  refdyn gen models/manipulator.lua --set n_rfe=8 --emit qdd -o out\n"
             "  refdyn gen models/manipulator.lua --emit M --explain plan\n"},
    {.name = "check",
     .run = run_check,
     .operands = "MODEL.lua",
     .options = "set fold",
     .output = "FILE",
     .purpose = "read and check a model, and show it",
     .help = "Prints the tree of links, the coordinates, constraints and parameters.\n\n"
             "  refdyn check models/manipulator.lua --set n_rfe=1\n"},
    {.name = "eval",
     .run = run_eval,
     .operands = "MODEL.lua",
     .options = "state output accelerations loops set fold",
     .output = "FILE",
     .purpose = "all quantities of the equations at one state",
     .help = "Prints one JSON object: M h Q, the rows u v phi psi k, points, accelerations, programme force, "
             "energy.\n"
             "Without --state the model's initial state is taken.\n\n"
             "  refdyn eval models/manipulator.lua --state state.json\n"},
    {.name = "statics",
     .run = run_statics,
     .operands = "MODEL.lua",
     .options = "hold output set fold",
     .output = "FILE",
     .purpose = "equilibrium",
     .help = "Prints JSON: coordinates, q, points, hold_force of the held coordinates, residual.\n\n"
             "  refdyn statics models/manipulator.lua\n"
             "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi,effector_z\n"},
    {.name = "modes",
     .run = run_modes,
     .operands = "MODEL.lua",
     .options = "at modes hold output set fold",
     .output = "FILE",
     .purpose = "frequencies, damping ratios and shapes about an equilibrium",
     .help =
         "Prints JSON: coordinates, at, t, q, points, held, phi, residual, unstable, modes; a table goes to "
         "stderr.\n"
         "Held coordinates keep their value, constraint rows act; stabilisation does not enter. Of a mode "
         "e^(lambda t):\n"
         "eigenvalue [re, im] [1/s], omega |lambda| [rad/s], frequency im/(2 pi) [Hz], damping "
         "-re/|lambda|, shape and\n"
         "displacements of the points, as re and im; the largest entry of a shape is 1. A decay without "
         "oscillation has\n"
         "frequency 0 and damping 1, a growth -1, a motion that nothing brings back omega 0 and damping "
         "0.\n\n"
         "  refdyn modes models/pendulum.lua --modes 4\n"
         "  refdyn modes models/fourbar.lua --at state.json\n"},
    {.name = "sim",
     .run = run_sim,
     .operands = "MODEL.lua",
     .options = "until! from method step tol step-max accuracy verify inputs stop every stabilise singular "
                "start hold "
                "output summary set fold",
     .output = "RUN.csv",
     .purpose = "one motion, as CSV",
     .help =
         "Columns: t, coordinates, rates, points, residuals, energy, programme forces, inputs. A summary "
         "goes to stderr.\n\n"
         "  refdyn sim models/manipulator.lua --set n_rfe=1 --until 10 --step 1e-3 -o rigid.csv\n"
         "  refdyn sim models/manipulator.lua --from statics --until 10 --tol 1e-8 -o flexible.csv\n"
         "  refdyn sim models/manipulator.lua --from statics --until 10 --accuracy 1e-6 --stop 'E_z<2' -o "
         "flexible.csv\n"},
    {.name = "plot",
     .run = run_plot,
     .operands = "RUN.csv...",
     .options = "output! panel units",
     .output = "FILE.svg",
     .purpose = "figures of motions, as one SVG, PNG or PDF by the suffix of FILE",
     .help =
         "Coordinates, paths, heights and vertical velocities of points, forces, inputs, courses, residuals "
         "and energy.\n"
         "Colours tell quantities apart, lines the runs, which lie over each other. PNG and PDF are made by "
         "rsvg-convert.\n\n"
         "  refdyn plot rigid.csv flexible.csv -o motion.svg\n"
         "  refdyn plot rigid.csv --panel path,energy --units rigid.json -o path.pdf\n"},
    {.name = "bench",
     .run = run_bench,
     .operands = "MODEL.lua",
     .options = "output emit accelerations loops set fold",
     .output = "FILE",
     .purpose = "time and operations of each emitted quantity",
     .help = "One JSON object a line; the last one tells what generating and compiling took.\n\n"
             "  refdyn bench models/manipulator.lua --set n_rfe=4\n"
             "  refdyn bench models/manipulator.lua --emit qdd,tangent,d_qdd\n"},
    {.name = "report",
     .run = run_report,
     .operands = "MODEL.lua",
     .options = "until! output! from methods tols steps seconds every vary hold set fold",
     .output = "DIR",
     .purpose = "error against run time of all methods, as CSV, SVG and HTML",
     .help =
         "Every method over a range of tolerances, or of steps with each stabilisation, from a start on the "
         "programme,\n"
         "against a reference that two methods of different kinds agree on, at fifty times unless --every "
         "tells others.\n"
         "Writes NAME.csv, NAME.svg and NAME.html into the folder of -o, and prints what the runs say.\n"
         "Runs that --seconds does not suffice for are stopped and listed; times, and which runs these are, "
         "differ from\n"
         "call to call, all else does not.\n\n"
         "  refdyn report models/manipulator.lua --from statics --until 2 -o out\n"
         "  refdyn report models/manipulator.lua --until 1 --vary n_rfe=1,2,4 --methods rk8,rodas5p -o "
         "out\n"},
    {.name = NULL},
};

/* All files are written before the first one gets its name. */
static bool write_files(struct scene *scene, const char *folder) {
    const struct emitted_file *files = gen_files(&scene->generation);
    const int count = gen_file_count(&scene->generation);
    struct target **open = memory_get(&scene->memory, (size_t)count * sizeof *open);
    sigset_t before;
    bool is_good = true;
    for (int i = 0; i < count && is_good; i++) {
        open[i] = target_open(&scene->targets, memory_format(&scene->memory, "%s/%s", folder, files[i].name));
        is_good = open[i] && target_write(open[i], files[i].text, files[i].length);
    }
    interrupt_hold(&before); /* all or none */
    for (int i = 0; i < count && is_good; i++)
        is_good = target_finish(open[i]);
    interrupt_release(&before);
    return is_good;
}

/* Into the folder of -o, which is there. */
static enum status emit_into_folder(struct scene *scene, const struct options *options) {
    struct generation *generation = &scene->generation;
    const char *folder = options->output;
    const int seen = generation->messages.count;
    const enum status status =
        print_outcome(generation, *options->operands, seen, gen_check_folder(generation, folder));
    if (status != STATUS_DONE)
        return status;
    if (!write_files(scene, folder))
        return STATUS_FAULT;
    return print_outcome(generation, *options->operands, seen, gen_remove_stale_parts(generation, folder));
}

static enum status emit_scene(struct scene *scene, const struct options *options) {
    struct generation *generation = &scene->generation;
    const int seen = generation->messages.count;
    enum status status =
        print_outcome(generation, *options->operands, seen, gen_plan(generation, options->emit));
    if (status != STATUS_DONE)
        return status;
    scene_spare_sources(scene, &scene->targets);
    if (!targets_make_folder(&scene->targets, options->output))
        return STATUS_FAULT;
    status = emit_into_folder(scene, options);
    if (status == STATUS_DONE)
        gen_print_summary(generation, stdout);
    return status;
}

static enum status explain_pass(struct scene *scene, const struct options *options) {
    struct generation *generation = &scene->generation;
    const int seen = generation->messages.count;
    const char *wrong = gen_wrong_pass(generation, options->explain);
    if (wrong)
        return usage_error(options->command, "--explain: %s", wrong);
    if (options->output)
        return usage_error(options->command, "--explain prints and writes no files, -o is too much");
    return print_outcome(generation, *options->operands, seen,
                         gen_explain(generation, options->emit, options->explain, stdout));
}

enum status run_gen(const struct options *options) {
    struct scene scene;
    enum status status = scene_read(&scene, options);
    if (status == STATUS_DONE) {
        const char *wrong = options->emit ? gen_wrong_emit(&scene.generation, options->emit) : NULL;
        status = wrong              ? usage_error(options->command, "--emit: %s", wrong)
                 : options->explain ? explain_pass(&scene, options)
                                    : emit_scene(&scene, options);
    }
    scene_close(&scene);
    return status;
}

enum status run_check(const struct options *options) {
    struct scene scene;
    enum status status = scene_read(&scene, options);
    if (status == STATUS_DONE)
        gen_print_model(&scene.generation, stdout);
    scene_close(&scene);
    return status;
}

/* A standard descriptor that is closed would become that of the next file, into which messages then went. It
 * is opened so that it is taken and its use still fails. */
static void take_descriptors(void) {
    for (int i = STDIN_FILENO; i <= STDERR_FILENO; i++)
        if (fcntl(i, F_GETFD) < 0 && open("/dev/null", i == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0)
            _exit(STATUS_FAULT);
}

static enum status finish_stdout(enum status status) {
    const bool is_good = !ferror(stdout);
    if (fflush(stdout) == 0 && is_good)
        return status;
    perror("refdyn: stdout: output: not all could be written");
    return status == STATUS_DONE ? STATUS_FAULT : status;
}

int main(int argc, char **argv) {
    struct options options;
    enum status status;
    take_descriptors();
    interrupt_catch();
    if (options_read(commands, argc, argv, &options, &status))
        status = options.command->run(&options);
    options_release(&options);
    status = finish_stdout(status);
    interrupt_finish();
    return (int)status;
}
