/* The program `refdyn`: the list of its commands, and what happens before and after one. */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/commands/generate/generate.h"
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/fit/fit.h"
#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/results/live/live.h"
#include "runtime/tool/support/system/system.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

static const struct command *const commands[] = {&gen_command,
                                                 &check_command,
                                                 &compile_command,
                                                 &eval_command,
                                                 &statics_command,
                                                 &modes_command,
                                                 &linearise_command,
                                                 &sim_command,
                                                 &fit_command,
                                                 &plan_command,
                                                 &batch_command,
                                                 &plot_command,
                                                 &view_command,
                                                 &merge_command,
                                                 &import_command,
                                                 &export_command,
                                                 &bench_command,
                                                 &report_command,
                                                 &new_command,
                                                 &completion_command,
                                                 NULL};

/* A closed standard descriptor would become the descriptor of the next file, and messages would go into that
 * file. This function occupies it, in a mode in which its use still fails. */
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
    system_interrupt_catch();
    if (options_read(commands, argc, argv, &options, &status))
        status = options.command->run(&options);
    status = finish_stdout(status);
    system_interrupt_finish();
    return (int)status;
}
