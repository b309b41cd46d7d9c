/* One run of a motion: see trial.h. */
#include "trial.h"

static void add_output(struct trial *trial, struct table *table, FILE *rows) {
    if (rows)
        table_row(table, rows);
    track_add(&trial->track, &trial->motion.drive);
}

/* From the start to the end, output by output. */
static void go(struct trial *trial, struct table *table, FILE *rows) {
    struct motion *motion = &trial->motion;
    struct progress progress;
    if (motion->stops)
        stops_hold(motion->stops);
    if (rows)
        table_header(table, rows);
    add_output(trial, table, rows);
    progress_start(&progress, "motion");
    for (long i = 1; i < motion->outputs && trial->result == REFDYN_OK && !motion_is_stopped(motion); i++) {
        trial->result = motion_to(motion, i, &progress);
        if (trial->result == REFDYN_OK)
            add_output(trial, table, rows);
    }
    progress_end(&progress);
}

void trial_run(struct trial *trial, const struct task *task, const struct refdyn_options *drive, FILE *rows) {
    struct motion *motion = &trial->motion;
    struct table table;
    *trial = (struct trial){.usage = STATUS_DONE};
    trial->result = motion_start(motion, task->scene, drive, task->until, task->options->every);
    if (trial->result == REFDYN_OK && by_gsl_has(task->options->method))
        trial->result = motion_by_gsl(motion, task->options->method);
    trial->is_started = trial->result == REFDYN_OK;
    if (!trial->is_started)
        return;
    if (task->has_stops) {
        trial->usage = stops_read(&trial->stops, task->options, &motion->drive);
        motion->stops = &trial->stops;
    }
    if (trial->usage != STATUS_DONE)
        return;
    if (task->on_start)
        task->on_start(task, motion);
    table_start(&table, &motion->drive);
    track_start(&trial->track, task->scene->model, motion->outputs);
    go(trial, &table, rows);
    table_release(&table);
}

void trial_release(struct trial *trial) {
    track_release(&trial->track);
    stops_release(&trial->stops);
    motion_release(&trial->motion);
}
