/* Prepares a batch: reads and checks options and cases, chooses threads and lanes, compiles, and lays out
 * what is kept. */
#define _GNU_SOURCE /* processors that the process may use */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <errno.h>
#include <math.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

enum { OUTPUTS_MAX = 1000000, THREADS_MAX = 1024, PROCESSORS_MAX = 1 << 20 };

/* Processors that this process may use. The set must be at least as large as the system's. */
static int count_processors(void) {
    int found = 0;
    for (int most = 1024; most <= PROCESSORS_MAX && found == 0; most *= 2) {
        cpu_set_t *set = CPU_ALLOC((size_t)most);
        const size_t size = CPU_ALLOC_SIZE((size_t)most);
        const bool is_known = set && sched_getaffinity(0, size, set) == 0;
        found = is_known ? CPU_COUNT_S(size, set) : set && errno == EINVAL ? 0 : 1;
        CPU_FREE(set);
    }
    return found > 0 ? found : 1;
}

static enum status choose_threads(struct batch_setup *setup) {
    const double asked = options_number(&setup->options, "threads");
    if (asked > THREADS_MAX)
        return usage_error(setup->options.command, "--threads: %.0f; must be at most %d", asked, THREADS_MAX);
    setup->threads = asked > 0 ? (int)asked : count_processors();
    if (setup->threads > THREADS_MAX)
        setup->threads = THREADS_MAX;
    return STATUS_DONE;
}

/* Fixed steps, and steps with gains that depend on their length, are computed one motion at a time. */
static bool may_use_lanes(const struct refdyn_options *integration) {
    return integration->tol > 0 && integration->gain_share == 0;
}

/* By default each lane has at least two cases, since a step in lanes takes as long for one case as for all.
 * Only the sweep decides the number of lanes, not the cases or threads of this call, because one lane rounds
 * differently. */
static int suitable_lanes(const struct batch_setup *setup) {
    const long cases = setup->sweep.cases.count / setup->structures.count;
    int lanes = refdyn_batch_widest();
    while (lanes > 1 && cases < 2 * lanes)
        lanes /= 2;
    return lanes;
}

static enum status check_lanes(const struct options *options) {
    const double asked = options_number(options, "lanes");
    if (asked > 0 && asked != 1 && asked != 2 && asked != 4 && asked != 8)
        return usage_error(options->command, "--lanes: %.0f is not a lane width; use 1, 2, 4 or 8", asked);
    return STATUS_DONE;
}

/* Call it after the structures are sorted. */
static void choose_lanes(struct batch_setup *setup) {
    const double asked = options_number(&setup->options, "lanes");
    setup->lanes = !may_use_lanes(&setup->integration) ? 1 : asked > 0 ? (int)asked : suitable_lanes(setup);
    options_set_number(&setup->options, "lanes", setup->lanes);
    for (int i = 0; i < setup->structures.count; i++)
        options_set_number(&setup->structures.list[i].options, "lanes", setup->lanes);
}

/* Reads "A:B", the cases A to B - 1; either number may be omitted. */
static enum status choose_range(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const long count = setup->sweep.cases.count;
    const char *text = options_text(options, "cases");
    char *rest;
    setup->first = 0;
    setup->end = count;
    if (!text)
        return STATUS_DONE;
    if (*text != ':')
        setup->first = strtol(text, &rest, 10);
    else
        rest = (char *)text;
    const bool has_colon = *rest == ':';
    if (has_colon && rest[1])
        setup->end = strtol(rest + 1, &rest, 10);
    else if (has_colon)
        rest++;
    if (!has_colon || *rest || rest == text || text[0] == ' ')
        return usage_error(options->command, "--cases: '%s' is not of the form A:B, the cases A to B - 1",
                           text);
    if (setup->first >= 0 && setup->first < setup->end && setup->end <= count)
        return STATUS_DONE;
    return usage_error(options->command,
                       "--cases %s: the batch has the cases 0 to %ld; choose a range of these", text,
                       count - 1);
}

static enum status read_cases(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const char *table = options_text(options, "table");
    struct generation *generation = &setup->base.generation;
    if (options->operand_count == 1 && !table)
        return usage_error(options->command, "no cases; add SWEEP.lua or --table CASES.csv");
    if (options->operand_count > 1 && table)
        return usage_error(options->command, "--table replaces the sweep; remove '%s'", options->operands[1]);
    return table ? sweeps_read_table(&setup->sweep, &setup->memory, table, generation, options)
                 : sweeps_read(&setup->sweep, &setup->memory, options->operands[1], generation,
                               &setup->options);
}

static enum status check_motion(struct batch_setup *setup) {
    struct options *options = &setup->options;
    const char *method = options_text(options, "method");
    if (!(options_number(options, "until") > 0))
        return usage_error(options->command, "--until is missing; add the end of the motions");
    if (method && simulate_gsl_has(method))
        return option_error(options, "method", ": %s computes single motions (refdyn sim), not batches",
                            method);
    if (options_text(options, "hold") && !options_is(options, "from", "statics"))
        return option_error(options, "hold", ": needs --from statics");
    const enum status status = simulate_options(options, &setup->integration);
    setup->integration.balance = 0; /* no result has it, and it needs the power at each stage */
    return status;
}

/* ---- Times and items ---- */

static enum status check_times(const struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const double until = options_number(options, "until");
    const struct scene *scene = &setup->structures.list[0].scene;
    const struct keep *keep = &setup->sweep.keep;
    const double t = scene->state.t, every = options_number(options, "every");
    const enum status status = simulate_check_times(scene, options);
    if (status != STATUS_DONE)
        return status;
    if (every > 0 && (until - t) / every > OUTPUTS_MAX)
        return option_error(options, "every", " %g: %.3g outputs; a batch allows at most %d", every,
                            (until - t) / every, OUTPUTS_MAX);
    if (every > (until - t) * (1 + 1e-9))
        return option_error(options, "every",
                            " %g: longer than the motions, which last %g s; must not be longer", every,
                            until - t);
    for (int i = 0; i < keep->at_count; i++)
        if (!(keep->at[i] >= t && keep->at[i] <= until))
            return option_error(options, "keep", ": time %g is outside the motions, from %g to %g",
                                keep->at[i], t, until);
    return STATUS_DONE;
}

static enum status lay_out(struct batch_setup *setup) {
    const double t = setup->structures.list[0].scene.state.t,
                 every = options_number(&setup->options, "every");
    const int count = setup->structures.count;
    const enum status status = check_times(setup);
    if (status != STATUS_DONE)
        return status;
    setup->kept.times = runs_seen_times_make(&setup->memory, &setup->sweep.keep, t,
                                             options_number(&setup->options, "until"), every);
    const struct refdyn_model **models = memory_get(&setup->memory, (size_t)count * sizeof *models);
    for (int i = 0; i < count; i++)
        models[i] = setup->structures.list[i].scene.model;
    setup->layout.cases = setup->sweep.cases;
    return runs_kept_lay_out(&setup->memory, &setup->sweep.keep, models, count, &setup->kept, &setup->layout)
               ? STATUS_DONE
               : STATUS_FAULT;
}

/* ---- All of it ---- */

enum status runs_setup_complete(struct batch_setup *setup) {
    enum status status = check_motion(setup);
    if (status == STATUS_DONE)
        status = choose_threads(setup);
    if (status == STATUS_DONE)
        status = check_lanes(&setup->options);
    if (status == STATUS_DONE)
        status = choose_range(setup);
    if (status != STATUS_DONE)
        return status;
    status = sweeps_structures_sort(&setup->structures, &setup->memory, &setup->sweep.cases, setup->first,
                                    setup->end, &setup->options);
    if (status != STATUS_DONE)
        return status;
    choose_lanes(setup);
    status = sweeps_structures_open(&setup->structures, &setup->memory, &setup->sweep.cases,
                                    &setup->integration, setup->threads);
    return status == STATUS_DONE ? lay_out(setup) : status;
}

enum status runs_setup_open(struct batch_setup *setup, const struct options *options) {
    *setup = (struct batch_setup){.memory = format_arena_start(), .options = *options};
    enum status status = scene_read(&setup->base, options, true);
    if (status == STATUS_DONE)
        status = read_cases(setup);
    if (status == STATUS_DONE)
        status = runs_setup_complete(setup);
    if (status == STATUS_DONE)
        batch_identify(setup);
    return status;
}

void runs_setup_close(struct batch_setup *setup) {
    sweeps_structures_close(&setup->structures);
    scene_close(&setup->base);
    memory_release(&setup->memory);
}
