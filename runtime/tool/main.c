/* The program `refdyn`: the table of its commands, and what happens before and after one. */
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/support/system/system.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

/* `sim` of a model, or of a case of a batch. */
static enum status run_motion(const struct options *options) {
    return options->of ? run_case_again(options) : run_sim(options);
}

static const struct command commands[] = {
    {.name = "gen",
     .run = run_gen,
     .operands = "MODEL.lua",
     .options = "output! emit for-lanes for-casadi depfile explain accelerations loops set fold",
     .output = "DIR",
     .purpose = "write the C code of a model",
     .help = "Writes NAME.h and NAME.c (more .c files when long) into the folder of -o, and prints what was "
             "emitted.\n\n"
             "  refdyn gen models/manipulator.lua -o out\n"
             "  refdyn gen models/manipulator.lua --set n_rfe=8 --emit qdd -o out\n"
             "  refdyn gen models/manipulator.lua --emit qdd_free,constrained --for-lanes -o out\n"
             "  refdyn gen models/manipulator.lua --emit M --explain plan\n"},
    {.name = "check",
     .run = run_check,
     .operands = "MODEL.lua",
     .options = "draw set fold",
     .output = "FILE",
     .purpose = "read and check a model, and show it",
     .help = "Prints the tree of links, the coordinates, constraints and parameters.\n\n"
             "  refdyn check models/manipulator.lua --draw manipulator.svg\n"
             "  refdyn check models/manipulator.lua --set n_rfe=1\n"},
    {.name = "compile",
     .run = run_compile,
     .operands = "MODEL.lua",
     .options = "output emit for-lanes accelerations loops set fold",
     .output = "FILE",
     .purpose = "compile a model for other programs to load",
     .help =
         "Leaves a shared library in the cache and prints JSON: its path, lanes, the model's names, units "
         "and values,\n"
         "its start, and of each emitted function the parts of its result. The library has NAME_model "
         "(refdyn_model.h),\n"
         "and with --for-lanes NAME_lanes_W (refdyn_lanes.h), W motions side by side, as many as the "
         "processor takes.\n\n"
         "  refdyn compile models/manipulator.lua --set n_rfe=8\n"
         "  refdyn compile models/manipulator.lua --emit qdd,d_qdd --for-lanes\n"},
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
     .options = "state hold release way output set fold",
     .output = "FILE",
     .purpose = "equilibrium",
     .help = "Prints JSON: coordinates, q, points, hold_force of the held coordinates, residual, rows that "
             "hold, their\n"
             "multipliers, phi, stability. Rows of positions hold at t = 0, but those of a programme that "
             "begins where\n"
             "the motion does: with --set NAME=VALUE of what it takes from there, it holds, too.\n\n"
             "  refdyn statics models/manipulator.lua\n"
             "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi,effector_z\n"
             "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi --set xc=0.54\n"
             "  refdyn statics models/slidercrank.lua --release 'guide y'\n"},
    {.name = "modes",
     .run = run_modes,
     .operands = "MODEL.lua",
     .options = "at modes hold release way output set fold",
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
     .run = run_motion,
     .operands = "MODEL.lua",
     .options = "until! from method step tol step-max accuracy verify inputs stop every stabilise singular "
                "start hold release way "
                "output summary set fold case of",
     .takes_gsl = true,
     .output = "RUN.csv",
     .purpose = "one motion, as CSV or HDF5",
     .help =
         "Columns: t, coordinates, rates, points, residuals, energy, programme forces, inputs. A summary "
         "goes to stderr.\n"
         "RUN.h5 has the same as HDF5, with units, options and parameters.\n\n"
         "  refdyn sim models/manipulator.lua --set n_rfe=1 --until 10 --step 1e-3 -o rigid.csv\n"
         "  refdyn sim models/manipulator.lua --from statics --until 10 --tol 1e-8 -o flexible.csv\n"
         "  refdyn sim models/manipulator.lua --from statics --until 10 --accuracy 1e-6 --stop 'E_z<2' -o "
         "flexible.csv\n"
         "  refdyn sim --case 12 --of runs.h5 -o case12.csv\n"},
    {.name = "batch",
     .run = run_batch_anywhere,
     .operands = "MODEL.lua [SWEEP.lua]",
     .options = "output table until from method step tol step-max every stabilise singular start hold "
                "release way cases threads lanes resume dry-run slurm chunks slurm-options summary set",
     .output = "RUNS.h5",
     .purpose = "many motions of a model, into one file",
     .help = "The cases are those of SWEEP.lua, or the rows of a table. RUNS.h5 has what varied, status and "
             "reason of each\n"
             "case, and what was kept of it; RUNS.csv one row a case. While it runs, what is done is in "
             "RUNS.h5.journal.\n"
             "With --slurm jobs of Slurm compute the cases; their scripts and messages are in "
             "RUNS.h5.slurm. Given again,\n"
             "it computes what is missing.\n\n"
             "  refdyn batch models/manipulator.lua sweep.lua -o runs.h5\n"
             "  refdyn batch models/manipulator.lua --table cases.csv --until 1 -o runs.csv\n"
             "  refdyn batch models/manipulator.lua sweep.lua --slurm --slurm-options '--partition=long' -o "
             "runs.h5\n"},
    {.name = "plot",
     .run = run_plot,
     .operands = "RUN...",
     .options = "output! panel units",
     .output = "FILE.svg",
     .purpose = "figures of motions, as one SVG, PNG or PDF by the suffix of FILE",
     .help =
         "Coordinates, paths, heights and vertical velocities of points, forces, inputs, courses, residuals "
         "and energy.\n"
         "Colours tell quantities apart, lines the runs, which lie over each other. PNG and PDF are made by "
         "rsvg-convert.\n"
         "Of RUNS.h5, a file of runs: results over what varied, percentiles over time, the worst cases; "
         "--panel "
         "names what\n"
         "the file has, as extremes/E_x.\n\n"
         "  refdyn plot rigid.csv flexible.csv -o motion.svg\n"
         "  refdyn plot rigid.csv --panel path,energy --units rigid.json -o path.pdf\n"
         "  refdyn plot runs.h5 --panel extremes/E_x,history/E_x -o runs.svg\n"},
    {.name = "view",
     .run = run_view,
     .operands = "RUN...",
     .options = "output! model set",
     .output = "PAGE.html",
     .purpose = "motions as one HTML page, to look at from all sides",
     .help =
         "Bodies and beams in their places over time, paths of points, programme forces, and figures that "
         "follow the\n"
         "time. The page needs no network and no other file; several runs lie over each other.\n\n"
         "  refdyn sim models/manipulator.lua --from statics --until 10 -o flexible.h5\n"
         "  refdyn view flexible.h5 -o flexible.html\n"
         "  refdyn view rigid.csv --model models/manipulator.lua --set n_rfe=1 -o rigid.html\n"},
    {.name = "merge",
     .run = run_merge,
     .operands = "RUNS.h5...",
     .options = "output!",
     .output = "FILE.h5",
     .purpose = "join files of runs of the same batch",
     .help = "Cases come in the order of their numbers. Files of another batch, and cases that two files "
             "have, are "
             "refused;\n"
             "cases that none has are told, and listed in the attribute 'missing'.\n\n"
             "  refdyn merge part_1.h5 part_2.h5 -o runs.h5\n"},
    {.name = "import",
     .run = run_import,
     .operands = "FILE.urdf",
     .options = "output flexible section tip E nu eta rho rfe friction-width right-angles floating drives",
     .output = "MODEL.lua",
     .purpose = "write a robot's URDF file as a Lua model",
     .help =
         "Links, joints and inertias; what is left out is told on stderr. Links of --flexible become beams "
         "that "
         "keep, with\n"
         "a rest that is fixed to them, the link's mass, centre and inertia.\n\n"
         "  refdyn import robot.urdf -o robot.lua\n"
         "  refdyn import robot.urdf --flexible forearm --section tube:0.08:0.076 --E 7e10 -o robot.lua\n"},
    {.name = "export",
     .run = run_export,
     .operands = "MODEL.lua",
     .options = "fmu! output! platform until from method tol step step-max stabilise singular hold release "
                "way set fold",
     .output = "FILE.fmu",
     .purpose = "a model as an FMU, for other simulators",
     .help = "Model Exchange and Co-Simulation in one file, with libraries and all sources. Variables have "
             "the names of\n"
             "the columns of sim. Co-Simulation steps as sim does, by the method and the tolerance that are "
             "given here.\n\n"
             "  refdyn export models/manipulator.lua --set n_rfe=1 --fmu 2.0 -o manipulator.fmu\n"
             "  refdyn export models/fourbar.lua --fmu 2.0 --platform linux64,win64 -o fourbar.fmu\n"},
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
    {.name = "new",
     .run = run_new,
     .operands = "NAME",
     .options = "",
     .purpose = "write a model to begin from",
     .help = "Writes NAME.lua, a small arm with a flexible link, a programme, an input and parameters, whose "
             "comments say\n"
             "what to try, and .luarc.json, by which editors with the Lua language server know the model "
             "language.\n\n"
             "  refdyn new arm\n"
             "  refdyn check arm.lua\n"},
    {.name = "completion",
     .run = run_completion,
     .operands = "bash|zsh|fish|man",
     .options = "output",
     .output = "FILE",
     .purpose = "completion for a shell, or the manual page",
     .help = "Prints the script by which a shell completes commands, options, their values and files, or "
             "the page of man.\n"
             "An installation has them in its share/.\n\n"
             "  eval \"$(refdyn completion bash)\"\n"
             "  refdyn completion man -o refdyn.1\n"},
    {.name = NULL},
};

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
    status = finish_stdout(status);
    interrupt_finish();
    return (int)status;
}
