/* The summary of a motion as entries. */
#include "runtime/record/record.h"

static const char *row_name(const struct refdyn_model *model, int row) {
    return row < 0 ? "none" : model->rows[row].name;
}

static void put_rows(const struct record_writer *writer, const struct refdyn_model *model,
                     const struct refdyn_statistics *s) {
    if (s->phi_row >= 0)
        writer->text(writer->context, "phi_row", row_name(model, s->phi_row));
    if (s->psi_row >= 0)
        writer->text(writer->context, "psi_row", row_name(model, s->psi_row));
    writer->number(writer->context, "pivot_min", s->pivot_min);
    writer->number(writer->context, "condition_max", s->condition_max);
    writer->whole(writer->context, "partition_changes", s->partition_changes);
}

static void put_passages(const struct record_writer *writer, const struct refdyn_statistics *s) {
    double t[REFDYN_CROSSINGS_KEPT], stretch[REFDYN_CROSSINGS_KEPT], error[REFDYN_CROSSINGS_KEPT];
    const int kept = s->crossings < REFDYN_CROSSINGS_KEPT ? s->crossings : REFDYN_CROSSINGS_KEPT;
    for (int i = 0; i < kept; i++) {
        t[i] = s->crossing[i].t;
        stretch[i] = s->crossing[i].t_end - s->crossing[i].t_begin;
        error[i] = s->crossing[i].error;
    }
    writer->open(writer->context, "passed", '{');
    writer->whole(writer->context, "count", s->crossings);
    record_put_array(writer, "t", t, kept);
    record_put_array(writer, "stretch", stretch, kept);
    record_put_array(writer, "error", error, kept);
    writer->number(writer->context, "error_max", s->crossing_error);
    writer->close(writer->context, '}');
}

static void put_method(const struct record_writer *writer, const struct record_summary *summary) {
    const struct record_motion *motion = summary->motion;
    const struct refdyn_options *options = &motion->integrator->options;
    writer->text(writer->context, "method", summary->method);
    if (options->method == REFDYN_AUTO) {
        writer->open(writer->context, "chosen", '{');
        for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
            if (motion->integrator->statistics.steps_by[method] > 0)
                writer->whole(writer->context, refdyn_method_name(method),
                              motion->integrator->statistics.steps_by[method]);
        writer->close(writer->context, '}');
    }
    writer->text(writer->context, "stabilise",
                 record_gains_follow_step(options) ? "baumgarte-auto"
                                                   : record_stabilise_names[options->stabilise]);
    writer->number(writer->context, options->tol > 0 ? "tol" : "step",
                   options->tol > 0 ? options->tol : options->step);
    if (options->tol_rates > 0)
        writer->number(writer->context, "tol_rates", options->tol_rates);
    if (options->step_max > 0)
        writer->number(writer->context, "step_max", options->step_max);
}

static void put_stop(const struct record_writer *writer, const struct record_motion *motion) {
    writer->open(writer->context, "stop", '{');
    writer->text(writer->context, "condition", motion->stops->reached);
    writer->number(writer->context, "t", motion->stops->t);
    writer->close(writer->context, '}');
}

/* How far the projection has moved each coordinate of a start far from the programme. */
static void put_moves(const struct record_writer *writer, const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    writer->open(writer->context, "start_moved", '{');
    for (int j = 0; j < refdyn_joint_count(model); j++)
        writer->number(writer->context, model->coordinates[j].name, integrator->start_moved[j]);
    writer->close(writer->context, '}');
}

void record_put_summary(const struct record_summary *summary, const struct record_writer *writer) {
    const struct record_motion *motion = summary->motion;
    char text[RECORD_STABILITY_LENGTH];
    const struct refdyn_statistics *s = &motion->integrator->statistics;
    put_method(writer, summary);
    if (summary->equilibrium)
        writer->text(writer->context, "equilibrium", record_stability_text(summary->equilibrium, text));
    if (motion->integrator->start_is_far)
        put_moves(writer, motion->integrator);
    writer->whole(writer->context, "steps", s->steps);
    writer->whole(writer->context, "rejected", s->rejected);
    writer->number(writer->context, "step_smallest", s->step_smallest);
    writer->number(writer->context, "step_largest", s->step_largest);
    writer->whole(writer->context, "evaluations", s->evaluations);
    writer->whole(writer->context, "tangents", s->tangents);
    writer->number(writer->context, "phi_max", s->phi_max);
    writer->number(writer->context, "psi_max", s->psi_max);
    if (motion->work->model->m > 0)
        put_rows(writer, motion->work->model, s);
    if (motion->integrator->options.singular == REFDYN_PASS)
        put_passages(writer, s);
    if (refdyn_energy_changes(&motion->energy))
        writer->number(writer->context, "energy_error", refdyn_energy_error(&motion->energy));
    else
        writer->null(writer->context, "energy_error");
    writer->number(writer->context, "cpu_s", summary->cpu_s);
    writer->number(writer->context, "wall_s", summary->wall_s);
    record_events_put(&motion->events, motion->work->model, writer);
    record_limits_put(summary->limits, writer);
    if (motion->stops && motion->stops->reached)
        put_stop(writer, motion);
}
