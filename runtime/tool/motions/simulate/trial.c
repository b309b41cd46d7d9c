/* Runs a motion once: writes its rows, and records positions and joint limits at the outputs. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

/* Writes a row if all its values are finite; otherwise the motion ends there. */
static void add_output(struct trial *trial, struct table *table, struct row_sink *rows) {
    struct refdyn_integrator *integrator = &trial->motion.integrator;
    if (rows) {
        table_fill(table);
        const char *unfit = table_not_finite(table);
        if (unfit) {
            trial->unfit = unfit;
            trial->result = REFDYN_NOT_FINITE;
            integrator->work->fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
            return;
        }
        if (!row_sink_put(rows, table))
            trial->result = MOTION_NOT_WRITTEN;
        limits_add(&trial->limits, integrator);
    }
    track_add(&trial->track, integrator);
}

/* Adds the last state of a motion that ended early as one more row. Restores the description of the failure.
 */
static void add_last(struct trial *trial, struct table *table, struct row_sink *rows) {
    struct refdyn_integrator *integrator = &trial->motion.integrator;
    const struct refdyn_fault fault = integrator->work->fault;
    const int cause = integrator->cause;
    const double failed_t = integrator->failed_t;
    if (trial->track.count == 0 || integrator->t > trial->track.t[trial->track.count - 1]) {
        const bool is_seen = refdyn_integrator_refresh(integrator) == REFDYN_OK;
        if (is_seen)
            table_fill(table);
        if (is_seen && !table_not_finite(table)) {
            row_sink_put(rows, table);
            limits_add(&trial->limits, integrator);
        }
    }
    integrator->work->fault = fault;
    integrator->cause = cause;
    integrator->failed_t = failed_t;
}

static void go(struct trial *trial, struct table *table, struct row_sink *rows) {
    struct motion *motion = &trial->motion;
    struct progress progress;
    if (motion->stops)
        stops_hold(motion->stops);
    if (rows && !row_sink_begin(rows, table))
        trial->result = MOTION_NOT_WRITTEN;
    else
        add_output(trial, table, rows);
    progress_start(&progress, "motion");
    for (long i = 1; i < motion->outputs && trial->result == REFDYN_OK && !motion_is_stopped(motion); i++) {
        trial->result = motion_to(motion, i, &progress);
        if (trial->result == REFDYN_OK && motion->integrator.t > trial->track.t[trial->track.count - 1])
            add_output(trial, table, rows);
    }
    progress_end(&progress);
    if (trial->result == REFDYN_OK)
        refdyn_energy_scale(&motion->energy, &motion->integrator);
    if (rows && trial->result != REFDYN_OK && trial->result != MOTION_NOT_WRITTEN && !trial->unfit)
        add_last(trial, table, rows);
    if (rows && !row_sink_end(rows) && trial->result == REFDYN_OK)
        trial->result = MOTION_NOT_WRITTEN;
}

void trial_run(struct trial *trial, const struct task *task, const struct refdyn_options *integration,
               struct row_sink *rows) {
    const char *method = options_text(task->options, "method");
    struct motion *motion = &trial->motion;
    struct table table;
    *trial = (struct trial){.usage = STATUS_DONE};
    trial->result =
        motion_start(motion, task->scene, integration, task->until, options_number(task->options, "every"));
    if (trial->result == REFDYN_OK && by_gsl_has(method))
        trial->result = motion_by_gsl(motion, method);
    trial->is_started = trial->result == REFDYN_OK;
    if (!trial->is_started)
        return;
    if (task->has_stops) {
        trial->usage =
            stops_read(&trial->stops, task->options, &motion->integrator, task->scene->compiled.spatial);
        motion->stops = &trial->stops;
    }
    if (trial->usage != STATUS_DONE)
        return;
    if (task->on_start)
        task->on_start(task, motion);
    table_start(&table, &motion->integrator, task->scene->compiled.spatial);
    limits_start(&trial->limits, task->scene);
    track_start(&trial->track, task->scene->model, motion->outputs);
    go(trial, &table, rows);
    motion_restore(motion);
}

void trial_release(struct trial *trial) {
    track_release(&trial->track);
    limits_release(&trial->limits);
    motion_release(&trial->motion);
}
