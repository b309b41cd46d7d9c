/* Summary of a motion that `sim` prints on stderr and writes as JSON. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"

#include <math.h>

static bool is_automatic(const struct refdyn_options *options) {
    return options->stabilise == REFDYN_BAUMGARTE && options->gain_share > 0;
}

static const char *row_name(const struct refdyn_model *model, int row) {
    return row < 0 ? "none" : model->rows[row].name;
}

/* Prints which methods `auto` has chosen, and why. */
static void print_choice(const struct refdyn_integrator *integrator) {
    const struct refdyn_choice *choice = &integrator->choice;
    const char *before = "";
    fputs("chosen       ", stderr);
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (integrator->statistics.steps_by[method] > 0) {
            fprintf(stderr, "%s%s for %ld steps", before, refdyn_method_name(method),
                    integrator->statistics.steps_by[method]);
            before = ", ";
        }
    if (choice->rate > 0)
        fprintf(stderr, "; fastest mode %.3g rad/s, damping ratio %.2g", choice->rate, choice->damping);
    before = "; motion an operation [s]: ";
    for (int i = 0; i < REFDYN_CANDIDATES; i++)
        if (choice->progress[i] > 0) {
            fprintf(stderr, "%s%s %.2g", before, refdyn_method_name((int)choice->candidates[i]),
                    choice->progress[i]);
            before = ", ";
        }
    fputc('\n', stderr);
}

static void print_method(const struct motion *motion) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const struct refdyn_options *o = &integrator->options;
    const double length = motion->scene->model->length;
    char text[NUMBER_LENGTH];
    fprintf(stderr, "method       %s, %s %s", motion->method, o->tol > 0 ? "tolerance" : "step [s]",
            exact_text(o->tol > 0 ? o->tol : o->step, text));
    if (o->tol > 0 && length > 0 && length != 1)
        fprintf(stderr, " of 1 rad and %s m", exact_text(length, text));
    fprintf(stderr, ", stabilised by %s%s\n", simulate_stabilise_names[o->stabilise],
            is_automatic(o) ? ", gains from the step" : "");
    if (o->method == REFDYN_AUTO && integrator->statistics.steps > 0)
        print_choice(integrator);
}

/* A row with a larger residual is not satisfied [m, rad, m/s, rad/s]. */
static const double off_most = 0.01;

/* The start has its own warning, and with a projection all rows are satisfied. */
static void warn_of_rows(const struct refdyn_integrator *integrator) {
    const struct refdyn_statistics *s = &integrator->statistics;
    const int by_rate = !(s->phi_max > off_most), row = by_rate ? s->psi_row : s->phi_row;
    if (integrator->options.stabilise == REFDYN_PROJECT || integrator->start_is_off || row < 0 ||
        !((by_rate ? s->psi_max : s->phi_max) > off_most))
        return;
    fprintf(
        stderr,
        "refdyn: warning: %s is not satisfied: its %s is up to %.3g; --stabilise project keeps it small\n",
        row_name(integrator->work->model, row), by_rate ? "psi" : "phi", by_rate ? s->psi_max : s->phi_max);
}

static void print_rows(const struct refdyn_model *model, const struct refdyn_statistics *s) {
    fprintf(stderr, "residuals    largest |phi| %.3g (%s), |psi| %.3g (%s)\n", s->phi_max,
            row_name(model, s->phi_row), s->psi_max, row_name(model, s->psi_row));
    fprintf(
        stderr,
        "rows         smallest pivot %.3g, largest condition %.3g; dependent coordinates changed %d times\n",
        s->pivot_min, s->condition_max, s->partition_changes);
}

/* Prints the singular positions that were crossed, with the step across each. */
static void print_passages(const struct refdyn_statistics *s) {
    const int kept = s->crossings < REFDYN_CROSSINGS_KEPT ? s->crossings : REFDYN_CROSSINGS_KEPT;
    if (s->crossings == 0)
        return;
    fprintf(stderr, "passed       %d state%s where the rows lose rank, error of each step at most %.2g;",
            s->crossings, s->crossings > 1 ? "s" : "", s->crossing_error);
    for (int i = 0; i < kept; i++)
        fprintf(stderr, "%s t = %.9g s by %.3g s", i ? "," : "", s->crossing[i].t,
                s->crossing[i].t_end - s->crossing[i].t_begin);
    fputs(s->crossings > kept ? ", ...\n" : "\n", stderr);
}

/* Smaller errors of energy are not reported: balance_part of the largest change or kinetic energy,
 * energy_part of all energy. The same holds for errors that position errors within the tolerance explain;
 * fixed steps use tol_fixed instead. */
static const double balance_part = 0.02, energy_part = 1e-4, tol_fixed = 1e-6;
/* A change up to this multiple of the balance error is taken for the error itself. */
static const double energy_alike = 1.5;

/* Returns whether the motion began with a projection onto the programme, whose work is not counted. */
static bool has_jumped(const struct refdyn_integrator *integrator) {
    return integrator->start_is_off && integrator->options.stabilise == REFDYN_PROJECT &&
           !integrator->options.project_start;
}

/* The energy shows whether a stable motion is resolved. The change of energy alone is no measure if it is
 * zero, as for a rolling coin or a body at rest. */
static bool is_resolved(const struct motion *motion) {
    const struct refdyn_energy *energy = &motion->energy;
    const double asked = motion->integrator.options.tol, tol = asked > 0 ? asked : tol_fixed;
    const double change = fmax(energy->largest_change, energy->largest_kinetic);
    return energy->largest_error <=
           fmax(fmax(balance_part * change, energy_part * energy->largest), tol * energy->unit);
}

static void warn_of_balance(const struct motion *motion) {
    if (is_resolved(motion))
        return;
    fputs(has_jumped(&motion->integrator)
              ? "refdyn: warning: energy and work do not balance: the start is off the programme, and the "
                "work of the "
                "jump onto it is not counted; begin on it with --start project\n"
              : "refdyn: warning: energy and work do not balance: the motion is not resolved; try a smaller "
                "--tol or --step\n",
          stderr);
}

/* If energy changes only by errors, the ratio of both means nothing. The end of a failed motion is unknown.
 */
static void print_energy(const struct motion *motion, bool has_failed) {
    const struct refdyn_energy *energy = &motion->energy;
    const bool changes = refdyn_energy_changes(energy);
    if (!changes && has_failed)
        return;
    if (!changes)
        fprintf(stderr, "energy       changes only by rounding, %.2g J of %.3g J\n", energy->largest_change,
                energy->largest + energy->unit);
    else if (energy->largest_change <= energy_alike * energy->largest_error)
        fprintf(stderr, "energy       changes by no more than its balance error, %.3g J of %.3g J\n",
                energy->largest_error, energy->largest);
    else
        fprintf(stderr, "energy       balance error %.3g of the largest change\n",
                refdyn_energy_error(energy));
    warn_of_balance(motion);
}

void simulate_summary_print(const struct summary *summary) {
    const struct motion *motion = &summary->trial->motion;
    const struct refdyn_statistics *s = &motion->integrator.statistics;
    char text[NUMBER_LENGTH];
    print_method(motion);
    if (motion->scene->equilibrium)
        fprintf(stderr, "start        equilibrium, %s\n",
                equilibria_stability_text(motion->scene->equilibrium));
    fprintf(stderr, "steps        %ld taken, %ld rejected, from %.3g to %.3g s\n", s->steps, s->rejected,
            s->step_smallest, s->step_largest);
    fprintf(stderr, "evaluations  %ld, tangents %ld%s\n", s->evaluations, s->tangents,
            s->tangents && motion->integrator.solves_by_joints ? ", solved joint by joint" : "");
    if (motion->scene->model->m > 0) {
        print_rows(motion->scene->model, s);
        warn_of_rows(&motion->integrator);
    }
    print_passages(s);
    simulate_events_print(motion->events, motion->scene->model);
    print_energy(motion, summary->trial->result != REFDYN_OK);
    fprintf(stderr, "time         %.3g s CPU for the integration, %.3g s wall\n", motion->cpu_s,
            motion->wall_s);
    if (summary->estimate)
        fprintf(stderr, "all runs     %.3g s CPU\n", summary->cpu_total_s);
    if (motion->stops && motion->stops->reached)
        fprintf(stderr, "stopped      %s at t = %s s\n", motion->stops->reached,
                exact_text(motion->stops->t, text));
    if (summary->estimate)
        simulate_estimate_print(summary->estimate);
    simulate_limits_print(summary->trial->limits);
}

static void put_rows(struct document *document, const struct refdyn_model *model,
                     const struct refdyn_statistics *s) {
    if (s->phi_row >= 0)
        format_put_text(document, "phi_row", row_name(model, s->phi_row));
    if (s->psi_row >= 0)
        format_put_text(document, "psi_row", row_name(model, s->psi_row));
    format_put_number(document, "pivot_min", s->pivot_min);
    format_put_number(document, "condition_max", s->condition_max);
    format_put_whole(document, "partition_changes", s->partition_changes);
}

static void put_passages(struct document *document, const struct refdyn_statistics *s) {
    double t[REFDYN_CROSSINGS_KEPT], stretch[REFDYN_CROSSINGS_KEPT], error[REFDYN_CROSSINGS_KEPT];
    const int kept = s->crossings < REFDYN_CROSSINGS_KEPT ? s->crossings : REFDYN_CROSSINGS_KEPT;
    for (int i = 0; i < kept; i++) {
        t[i] = s->crossing[i].t;
        stretch[i] = s->crossing[i].t_end - s->crossing[i].t_begin;
        error[i] = s->crossing[i].error;
    }
    format_put_open(document, "passed", '{');
    format_put_whole(document, "count", s->crossings);
    format_put_array(document, "t", t, kept);
    format_put_array(document, "stretch", stretch, kept);
    format_put_array(document, "error", error, kept);
    format_put_number(document, "error_max", s->crossing_error);
    format_put_close(document, '}');
}

static void put_method(struct document *document, const struct motion *motion) {
    const struct refdyn_options *options = &motion->integrator.options;
    format_put_text(document, "method", motion->method);
    if (options->method == REFDYN_AUTO) {
        format_put_open(document, "chosen", '{');
        for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
            if (motion->integrator.statistics.steps_by[method] > 0)
                format_put_whole(document, refdyn_method_name(method),
                                 motion->integrator.statistics.steps_by[method]);
        format_put_close(document, '}');
    }
    format_put_text(document, "stabilise",
                    is_automatic(options) ? "baumgarte-auto" : simulate_stabilise_names[options->stabilise]);
    format_put_number(document, options->tol > 0 ? "tol" : "step",
                      options->tol > 0 ? options->tol : options->step);
    if (options->step_max > 0)
        format_put_number(document, "step_max", options->step_max);
}

static void put_stop(struct document *document, const struct motion *motion) {
    format_put_open(document, "stop", '{');
    format_put_text(document, "condition", motion->stops->reached);
    format_put_number(document, "t", motion->stops->t);
    format_put_close(document, '}');
}

/* How far the projection has moved each coordinate of a start far from the programme. */
static void put_moves(struct document *document, const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    format_put_open(document, "start_moved", '{');
    for (int j = 0; j < model->n; j++)
        format_put_number(document, model->coordinates[j].name, integrator->start_moved[j]);
    format_put_close(document, '}');
}

static void put_summary(struct document *document, const struct summary *summary) {
    const struct motion *motion = &summary->trial->motion;
    const struct refdyn_statistics *s = &motion->integrator.statistics;
    put_method(document, motion);
    if (motion->scene->equilibrium)
        format_put_text(document, "equilibrium", equilibria_stability_text(motion->scene->equilibrium));
    if (motion->integrator.start_is_far)
        put_moves(document, &motion->integrator);
    format_put_whole(document, "steps", s->steps);
    format_put_whole(document, "rejected", s->rejected);
    format_put_number(document, "step_smallest", s->step_smallest);
    format_put_number(document, "step_largest", s->step_largest);
    format_put_whole(document, "evaluations", s->evaluations);
    format_put_whole(document, "tangents", s->tangents);
    format_put_number(document, "phi_max", s->phi_max);
    format_put_number(document, "psi_max", s->psi_max);
    if (motion->scene->model->m > 0)
        put_rows(document, motion->scene->model, s);
    if (motion->integrator.options.singular == REFDYN_PASS)
        put_passages(document, s);
    if (refdyn_energy_changes(&motion->energy))
        format_put_number(document, "energy_error", refdyn_energy_error(&motion->energy));
    else
        format_put_null(document, "energy_error");
    format_put_number(document, "cpu_s", motion->cpu_s);
    format_put_number(document, "wall_s", motion->wall_s);
    simulate_events_put(motion->events, motion->scene->model, document);
    simulate_limits_put(summary->trial->limits, document);
    if (motion->stops && motion->stops->reached)
        put_stop(document, motion);
    if (summary->accuracy > 0)
        format_put_number(document, "accuracy", summary->accuracy);
    if (summary->estimate) {
        format_put_number(document, "cpu_total_s", summary->cpu_total_s);
        simulate_estimate_put(summary->estimate, document);
    }
}

enum status simulate_summary_write(const struct summary *summary, struct target *target) {
    struct document document;
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    put_summary(&document, summary);
    const struct scene *scene = summary->trial->motion.scene;
    simulate_table_put_units(scene->model, scene->compiled.spatial, &document);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file))
        return STATUS_NUMBERS;
    return system_target_finish(target) ? STATUS_DONE : STATUS_FAULT;
}
