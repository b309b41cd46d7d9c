/*
 * `refdyn sim --realise`. In: a model, and the options. Out: the motion and the drive forces of its
 * programme, the report, and the state from which the forces are played back.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/system/system.h"

const struct option_rule realise_rules[] = {
    {"realise", NULL, OPTION_FLAG,
     "let the model's drives perform the programme, instead of ideal forces; --from may also be held: the "
     "equilibrium on the programme that the drives hold",
     NULL, NULL},
    {"before", "T1", OPTION_POSITIVE,
     "with --realise: time before the start from which the drives act [s] (default: from the growth of "
     "modes)",
     NULL, NULL},
    {"after", "T2", OPTION_POSITIVE,
     "with --realise: time after the end for which they act [s] (default: from the growth of modes)", NULL,
     NULL},
    {"mesh", "H", OPTION_POSITIVE,
     "with --realise: largest step of the mesh [s] (default: 0.05; at most T/20)", NULL, NULL},
    {"play", "RUN", OPTION_TEXT,
     "apply the drive forces of a --realise run, CSV or HDF5, with the programme's rows released", NULL,
     NULL},
    {.name = NULL}};

/* A playback error above this part of the model's length causes a warning. */
static const double missed_part = 0.02;

/* ---- Output ---- */

/* The files of the command. */
struct output {
    struct row_sink rows;
    struct record_limits limits;
    struct record_table *table;
};

static int begin(void *context, struct record_table *table) {
    struct output *output = context;
    output->table = format_allocate(1, sizeof *output->table);
    *output->table = *table;
    return simulate_row_sink_begin(&output->rows, table) ? REFDYN_OK : RECORD_NOT_WRITTEN;
}

static int put(void *context, struct record_table *table, int number) {
    (void)number;
    return simulate_row_sink_put(&((struct output *)context)->rows, table) ? REFDYN_OK : RECORD_NOT_WRITTEN;
}

/* Rows are at the beginning of each cell, and at the end of the last. */
static enum status write_motion(struct realise_work *work, struct output *output) {
    const struct realise_motion *motion = &work->solution.motion;
    double *times = format_allocate_matrix(work->cells + 1, 1);
    const struct realise_rows rows = {
        .times = times, .count = work->cells + 1, .context = output, .begin = begin, .put = put};
    for (int i = 0; i <= work->cells; i++)
        times[i] = fmin(motion->t[0] + i * work->every, motion->t[motion->count]);
    const enum status status = realise_show(work, &rows, &output->limits);
    return simulate_row_sink_end(&output->rows) || status != STATUS_DONE ? status : STATUS_FAULT;
}

static void print_summary(const struct realise_work *work, const struct output *output) {
    const struct realise_modes *modes = &work->modes;
    const double length = work->scene->model->length;
    fprintf(stderr, "method       collocation at %d Gauss points, %d intervals from t = %.6g to %.6g s\n",
            REALISE_STAGES, work->solution.motion.count, work->solution.motion.t[0],
            work->solution.motion.t[work->solution.motion.count]);
    fprintf(stderr, "iterations   %d of Newton's method, last correction %.2g\n", work->iterations,
            work->solution.correction);
    fputs("cosines      ", stderr);
    for (int i = 0; i < modes->cosine_count; i++)
        fprintf(stderr, "%s%.3g", i ? ", " : "", modes->cosines[i]);
    fputs(" between rows and drives\n", stderr);
    fprintf(stderr, "modes        %d growing, %d centre, %d decaying", modes->growing, modes->centre,
            modes->decaying);
    if (modes->growing)
        fprintf(stderr, "; growth %.4g to %.4g 1/s", modes->slowest, modes->fastest);
    fputc('\n', stderr);
    for (int d = 0; d < work->problem.drives; d++)
        fprintf(stderr, "drive        %s: largest %.6g %s\n", realise_model(work)->drives[d].name,
                work->peak[d], realise_model(work)->inputs[realise_model(work)->drives[d].input].unit);
    fprintf(stderr, "mesh         forces change by %.2g of their peak from another mesh\n",
            work->mesh_change);
    fprintf(stderr, "playback     from rest, error at most %.3g\n", work->playback);
    fprintf(stderr, "time         %.3g s CPU\n", work->cpu_s);
    if (work->playback > missed_part * (length > 0 ? length : 1))
        fprintf(stderr,
                "refdyn: warning: played back from rest, these forces miss the motion by up to %.3g; shorten "
                "--every, over which they are constant; an unstable motion needs feedback\n",
                work->playback);
    record_limits_print(&output->limits, stderr);
}

static void put_summary(const struct realise_work *work, struct document *document) {
    const struct realise_modes *modes = &work->modes;
    format_put_open(document, "realise", '{');
    format_put_array(document, "cosines", modes->cosines, modes->cosine_count);
    format_put_whole(document, "growing", modes->growing);
    format_put_whole(document, "centre", modes->centre);
    format_put_whole(document, "decaying", modes->decaying);
    format_put_number(document, "growth_slowest", modes->slowest);
    format_put_number(document, "growth_fastest", modes->fastest);
    format_put_open(document, "peak", '{');
    for (int d = 0; d < work->problem.drives; d++)
        format_put_number(document, realise_model(work)->drives[d].name, work->peak[d]);
    format_put_close(document, '}');
    format_put_number(document, "effort", realise_effort(&work->solution.motion));
    format_put_number(document, "mesh_change", work->mesh_change);
    format_put_whole(document, "newton_iterations", work->iterations);
    format_put_number(document, "playback_error", work->playback);
    format_put_close(document, '}');
    format_put_number(document, "cpu_s", work->cpu_s);
}

static enum status write_summary(const struct realise_work *work, const struct output *output,
                                 struct target *target) {
    struct document document;
    const struct record_writer writer = scene_writer(&document);
    scene_document_open(&document);
    put_summary(work, &document);
    record_limits_put(&output->limits, &writer);
    record_table_put_units(output->table, &writer);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file))
        return STATUS_NUMBERS;
    return system_target_finish(target) ? STATUS_DONE : STATUS_FAULT;
}

/* RUN.csv or RUN.h5 becomes RUN.start.json; there is none (NULL) if the motion does not go to a file. */
static enum status open_start(struct scene *scene, struct target **start) {
    *start = NULL;
    if (!scene->result->path)
        return STATUS_DONE;
    const char *output = scene->result->name, *dot = strrchr(output, '.'), *slash = strrchr(output, '/');
    const int length = dot && (!slash || dot > slash) ? (int)(dot - output) : (int)strlen(output);
    *start = system_target_open(&scene->targets, format_text("%.*s.start.json", length, output));
    return *start ? STATUS_DONE : STATUS_FAULT;
}

static enum status write_start(struct realise_work *work, struct target *target) {
    struct scene *scene = work->scene;
    struct document document;
    scene->state.t = work->solution.motion.t[0];
    scene_document_open(&document);
    scene_put_state(&document, scene);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file) || !system_target_finish(target))
        return STATUS_FAULT;
    format_complain("start        %s\n", target->name);
    return STATUS_DONE;
}

/* ---- The command ---- */

static enum status finish(struct realise_work *work, struct target *start) {
    struct scene *scene = work->scene;
    const struct task task = {.scene = scene, .options = work->options, .until = work->until};
    const char *path = options_text(work->options, "output");
    const bool is_hdf5 = path && format_names_hdf5(path);
    struct output output = {.rows = is_hdf5 ? simulate_row_sink_hdf5(scene->result->part, &task)
                                            : simulate_row_sink_csv(scene->result->file)};
    enum status status = write_motion(work, &output);
    realise_problem_end(&work->problem);
    if (status == STATUS_DONE)
        status = system_target_finish(scene->result) ? STATUS_DONE : STATUS_FAULT;
    if (status != STATUS_DONE)
        return status;
    print_summary(work, &output);
    if (start)
        status = write_start(work, start);
    if (status == STATUS_DONE && scene->summary)
        status = write_summary(work, &output, scene->summary);
    return status;
}

/* The first of some options that is given, NULL if none is. */
static const char *first_given(const struct options *options, const char *const *names) {
    while (*names && !options_has(options, *names))
        names++;
    return *names;
}

enum status realise_check_options(const struct options *options) {
    static const char *const of_realise[] = {"before", "after", "mesh", NULL};
    static const char *const not_realise[] = {"play",   "inputs", "accuracy", "derivatives",
                                              "verify", "stop",   "step",     NULL};
    const bool is_realised = options_has(options, "realise");
    const char *wrong = first_given(options, is_realised ? not_realise : of_realise);
    if (is_realised && options_number(options, "lanes") > 1)
        wrong = "lanes";
    if (wrong && is_realised)
        return options_usage_error(options->command, "--realise excludes --%s", wrong);
    if (wrong)
        return options_error(options, wrong, " needs --realise");
    return STATUS_DONE;
}

enum status realise_run(const struct options *options) {
    struct refdyn_options integration;
    struct scene scene;
    struct realise_work work;
    struct target *start;
    enum status status = simulate_options(options, &integration);
    if (status != STATUS_DONE)
        return status;
    status = scene_open(&scene, options, NEEDS_RESULT | simulate_needs(options) | REALISE_NEEDS,
                        realise_state_path(options));
    if (status == STATUS_DONE)
        status = open_start(&scene, &start);
    if (status == STATUS_DONE)
        status = realise_find(&work, &scene, NULL, options, &integration);
    if (status == STATUS_DONE)
        status = finish(&work, start);
    scene_close(&scene);
    return status;
}
