/* `refdyn sim`: one motion, written as it goes, with a summary. */
#include "motion.h"
#include "output.h"
#include "table.h"

#include <string.h>

static const char *level_name(enum refdyn_row_level level) {
    static const char *const names[] = {"position", "velocity", "acceleration"};
    return names[level];
}

static void print_remedies(const struct options *options, enum refdyn_stabilise stabilise) {
    static const char *const what[] = {
        [REFDYN_NONE] = "with --stabilise none it stays off, --stabilise baumgarte would pull it in",
        [REFDYN_BAUMGARTE] = "the stabilisation (baumgarte) pulls it in",
        [REFDYN_PROJECT] = "the first projection moves it onto the programme, baumgarte would pull it in"};
    fprintf(stderr,
            "  Two remedies: solve for a consistent start with --start project,\n"
            "  or start off the programme: %s.\n  This motion runs from the start as it is%s.\n",
            what[stabilise], options->start ? ", as asked" : "");
}

/* A start off the programme: the residual of each row, and what can be done. */
static void print_start(const struct options *options, const struct refdyn_drive *drive) {
    const struct refdyn_workspace *work = drive->work;
    char text[2][NUMBER_LENGTH];
    if (!drive->start_is_off)
        return;
    if (drive->options.project_start) {
        fprintf(stderr,
                "refdyn: the start was off the programme (largest |phi| %.4g, |psi| %.4g) and was projected "
                "onto it\n",
                drive->start.phi, drive->start.psi);
        return;
    }
    fprintf(stderr, "refdyn: warning: the start is off the programme:\n");
    for (int i = 0; i < work->m; i++) {
        enum refdyn_row_level level = work->model->rows[i].level;
        if (level == REFDYN_ACCELERATION)
            continue;
        fprintf(stderr, "  %s (%s): ", work->model->rows[i].name, level_name(level));
        if (level == REFDYN_POSITION)
            fprintf(stderr, "phi = %s, ", exact_text(work->phi[i], text[0]));
        fprintf(stderr, "psi = %s\n", exact_text(work->psi[i], text[1]));
    }
    print_remedies(options, drive->options.stabilise);
}

static void print_summary(const struct motion *motion) {
    const struct refdyn_statistics *s = &motion->drive.statistics;
    const struct refdyn_options *o = &motion->drive.options;
    char text[NUMBER_LENGTH];
    fprintf(stderr, "method       %s, %s %s, stabilised by %s\n", refdyn_method_name((int)o->method),
            o->tol > 0 ? "tolerance" : "step [s]", exact_text(o->tol > 0 ? o->tol : o->step, text),
            stabilise_names[o->stabilise]);
    fprintf(stderr, "steps        %ld taken, %ld rejected, from %.3g to %.3g s\n", s->steps, s->rejected,
            s->step_smallest, s->step_largest);
    fprintf(stderr, "evaluations  %ld\n", s->evaluations);
    if (motion->scene->model->m > 0)
        fprintf(stderr,
                "residuals    largest |phi| %.3g, |psi| %.3g; dependent coordinates changed %d times\n",
                s->phi_max, s->psi_max, s->partition_changes);
    fprintf(stderr, "energy       balance error %.3g of the largest change\n",
            refdyn_energy_error(&motion->energy));
    fprintf(stderr, "time         %.3g s CPU for the integration, %.3g s wall\n", motion->cpu_s,
            motion->wall_s);
}

static bool write_summary(const struct motion *motion, const char *path) {
    const struct refdyn_statistics *s = &motion->drive.statistics;
    struct output output;
    if (!output_open(&output, path))
        return false;
    struct document document = {.out = output.file};
    put_open(&document, NULL, '{');
    put_text(&document, "method", refdyn_method_name((int)motion->drive.options.method));
    put_whole(&document, "steps", s->steps);
    put_whole(&document, "rejected", s->rejected);
    put_whole(&document, "evaluations", s->evaluations);
    put_number(&document, "phi_max", s->phi_max);
    put_number(&document, "psi_max", s->psi_max);
    put_number(&document, "energy_error", refdyn_energy_error(&motion->energy));
    put_number(&document, "cpu_s", motion->cpu_s);
    put_number(&document, "wall_s", motion->wall_s);
    put_close(&document, '}');
    return output_close(&output);
}

/* The partial file stays, under its own name. */
static enum status stop(const struct motion *motion, struct output *output, int result) {
    const struct refdyn_drive *drive = &motion->drive;
    char text[NUMBER_LENGTH];
    bool is_kept = output_keep_part(output);
    if (result == MOTION_INTERRUPTED)
        fprintf(stderr, "refdyn: interrupted at t = %s s\n", exact_text(drive->t, text));
    else if (drive->cause > 0 && drive->cause != result)
        fprintf(stderr, "refdyn: at t = %s s: %s\n", exact_text(drive->failed_t, text),
                refdyn_status_text(drive->cause));
    if (result != MOTION_INTERRUPTED)
        numbers_failed(motion->scene, result, drive->t, drive->q, drive->qd);
    if (result > REFDYN_OK && result != MOTION_INTERRUPTED)
        fputs("refdyn: a smaller --step or --tol may help\n", stderr);
    if (output->part && is_kept)
        fprintf(stderr, "refdyn: what was computed until then is in %s\n", output->part);
    output_release(output);
    return STATUS_NUMBERS;
}

/* From the start to the end; the summary and the complete file at the end. */
static enum status go(struct motion *motion, const struct options *options, struct output *output) {
    struct table table;
    struct progress progress;
    int result = REFDYN_OK;
    table_start(&table, output->file, &motion->drive);
    table_row(&table);
    progress_start(&progress, "motion");
    for (long i = 1; i < motion->outputs && result == REFDYN_OK; i++) {
        result = motion_to(motion, i, &progress);
        if (result == REFDYN_OK)
            table_row(&table);
    }
    progress_end(&progress);
    table_release(&table);
    print_summary(motion);
    if (result != REFDYN_OK)
        return stop(motion, output, result);
    bool is_written = output_close(output);
    if (options->summary)
        is_written = write_summary(motion, options->summary) && is_written;
    return is_written ? STATUS_DONE : STATUS_FAULT;
}

static enum status simulate(struct scene *scene, const struct options *options,
                            const struct refdyn_options *drive) {
    struct motion motion;
    struct output output;
    if (options->until <= scene->state.t)
        return usage_error(options->command, "--until %g: the motion starts at t = %g", options->until,
                           scene->state.t);
    if (!output_open(&output, options->output))
        return STATUS_FAULT;
    int result = motion_start(&motion, scene, drive, options->until, options->every);
    enum status status;
    if (result == REFDYN_OK) {
        print_start(options, &motion.drive);
        print_redundant_rows(&scene->work);
        status = go(&motion, options, &output);
    } else {
        status = numbers_failed(scene, result, scene->state.t, scene->q, scene->qd);
        output_keep_part(&output);
        if (output.part)
            remove(output.part); /* empty */
        output_release(&output);
    }
    motion_release(&motion);
    return status;
}

static bool has_ending(const char *path, const char *ending) {
    size_t length = strlen(path), end = strlen(ending);
    return length >= end && strcmp(path + length - end, ending) == 0;
}

enum status run_sim(const struct options *options) {
    struct refdyn_options drive;
    struct scene scene;
    if (options->output && (has_ending(options->output, ".h5") || has_ending(options->output, ".hdf5")))
        return usage_error(options->command, "-o %s: this version writes CSV, name a .csv file",
                           options->output);
    enum status status = motion_options(options, &drive);
    if (status != STATUS_DONE)
        return status;
    unsigned needs = NEEDS_MOTION | NEEDS_POINTS | NEEDS_POINT_RATES;
    if (options->from && strcmp(options->from, "statics") == 0)
        needs |= NEEDS_STATICS;
    if (refdyn_method_is_implicit(drive.method))
        needs |= NEEDS_TANGENT;
    motion_catch_interrupt();
    status = scene_open(&scene, options, needs, motion_state_path(options));
    if (status == STATUS_DONE)
        status = motion_fit(&scene, options, &drive);
    if (status == STATUS_DONE)
        status = motion_place(&scene, options);
    if (status == STATUS_DONE)
        status = simulate(&scene, options, &drive);
    scene_close(&scene);
    return status;
}
