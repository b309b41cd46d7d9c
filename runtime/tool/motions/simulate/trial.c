/* Runs a motion once: writes its rows, and records positions and joint limits at the outputs. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

/* Writes a row if all its values are finite; otherwise the motion ends there. */
static void add_output(struct trial *trial, struct table *table, struct row_sink *rows) {
    struct refdyn_integrator *integrator = &trial->motion.integrator;
    if (rows) {
        simulate_table_fill(table);
        const char *unfit = simulate_table_not_finite(table);
        if (unfit) {
            trial->unfit = unfit;
            trial->result = REFDYN_NOT_FINITE;
            integrator->work->fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
            return;
        }
        if (!simulate_row_sink_put(rows, table))
            trial->result = MOTION_NOT_WRITTEN;
        simulate_limits_add(&trial->limits, integrator);
    }
    simulate_track_add(&trial->track, integrator);
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
            simulate_table_fill(table);
        if (is_seen && !simulate_table_not_finite(table)) {
            simulate_row_sink_put(rows, table);
            simulate_limits_add(&trial->limits, integrator);
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
        simulate_stops_hold(motion->stops);
    if (rows && !simulate_row_sink_begin(rows, table))
        trial->result = MOTION_NOT_WRITTEN;
    else
        add_output(trial, table, rows);
    system_progress_start(&progress, "motion");
    for (long i = 1; i < motion->outputs && trial->result == REFDYN_OK && !simulate_is_stopped(motion); i++) {
        trial->result = simulate_to(motion, i, &progress);
        if (trial->result == REFDYN_OK && motion->integrator.t > trial->track.t[trial->track.count - 1])
            add_output(trial, table, rows);
    }
    system_progress_end(&progress);
    if (trial->result == REFDYN_OK)
        refdyn_energy_scale(&motion->energy, &motion->integrator);
    if (rows && trial->result != REFDYN_OK && trial->result != MOTION_NOT_WRITTEN && !trial->unfit)
        add_last(trial, table, rows);
    if (rows && !simulate_row_sink_end(rows) && trial->result == REFDYN_OK)
        trial->result = MOTION_NOT_WRITTEN;
}

void simulate_trial_run(struct trial *trial, const struct task *task,
                        const struct refdyn_options *integration, struct row_sink *rows) {
    const char *method = options_text(task->options, "method");
    struct motion *motion = &trial->motion;
    struct table table;
    *trial = (struct trial){.usage = STATUS_DONE};
    trial->result =
        simulate_start(motion, task->scene, integration, task->until, options_number(task->options, "every"));
    if (trial->result == REFDYN_OK && simulate_gsl_has(method))
        trial->result = simulate_by_gsl(motion, method);
    trial->is_started = trial->result == REFDYN_OK;
    if (!trial->is_started)
        return;
    if (task->has_stops) {
        trial->usage = simulate_stops_read(&trial->stops, task->options, &motion->integrator,
                                           task->scene->compiled.spatial);
        motion->stops = &trial->stops;
    }
    if (trial->usage != STATUS_DONE)
        return;
    if (task->on_start)
        task->on_start(task, motion);
    simulate_table_start(&table, &motion->integrator, task->scene->compiled.spatial);
    simulate_limits_start(&trial->limits, task->scene);
    simulate_track_start(&trial->track, task->scene->model, motion->outputs);
    go(trial, &table, rows);
    simulate_restore(motion);
}

void simulate_trial_release(struct trial *trial) {
    simulate_track_release(&trial->track);
    simulate_limits_release(&trial->limits);
    simulate_release(&trial->motion);
}
