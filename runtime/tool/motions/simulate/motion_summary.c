/* Summary of a motion that `sim` prints on stderr and writes as JSON. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"

#include <math.h>

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
    fprintf(stderr, ", stabilised by %s%s\n", record_stabilise_names[o->stabilise],
            record_gains_follow_step(o) ? ", gains from the step" : "");
    if (o->method == REFDYN_AUTO && integrator->statistics.steps > 0)
        print_choice(integrator);
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

/* A change up to this multiple of the balance error is taken for the error itself. */
static const double energy_alike = 1.5;

/* If energy changes only by errors, the ratio of both means nothing. The end of a failed motion is unknown.
 */
static void print_energy(const struct motion *motion, bool has_failed) {
    const struct refdyn_energy *energy = &motion->record.energy;
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
    record_print_balance_warning(&motion->record, stderr);
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
        record_print_rows_warning(&motion->integrator, stderr);
    }
    print_passages(s);
    record_events_print(&motion->record.events, motion->scene->model, stderr);
    record_print_between(&motion->record, stderr);
    print_energy(motion, summary->trial->result != REFDYN_OK);
    fprintf(stderr, "time         %.3g s CPU for the integration, %.3g s wall\n", motion->cpu_s,
            motion->wall_s);
    if (summary->estimate)
        fprintf(stderr, "all runs     %.3g s CPU\n", summary->cpu_total_s);
    if (motion->record.stops && motion->record.stops->reached)
        fprintf(stderr, "stopped      %s at t = %s s\n", motion->record.stops->reached,
                exact_text(motion->record.stops->t, text));
    if (summary->estimate)
        simulate_estimate_print(summary->estimate);
    record_limits_print(&summary->trial->limits, stderr);
}

static void put_summary(struct document *document, const struct summary *summary) {
    const struct motion *motion = &summary->trial->motion;
    const struct record_writer writer = scene_writer(document);
    const struct record_summary record = {.motion = &motion->record,
                                          .method = motion->method,
                                          .equilibrium = motion->scene->equilibrium,
                                          .cpu_s = motion->cpu_s,
                                          .wall_s = motion->wall_s,
                                          .limits = &summary->trial->limits};
    record_put_summary(&record, &writer);
    if (summary->derivatives && summary->derivatives->count > 0)
        simulate_derivatives_put(summary->derivatives, document);
    if (summary->accuracy > 0)
        format_put_number(document, "accuracy", summary->accuracy);
    if (summary->estimate) {
        format_put_number(document, "cpu_total_s", summary->cpu_total_s);
        simulate_estimate_put(summary->estimate, document);
    }
}

enum status simulate_summary_write(const struct summary *summary, struct target *target) {
    struct document document;
    scene_document_open(&document);
    put_summary(&document, summary);
    const struct scene *scene = summary->trial->motion.scene;
    const struct record_writer writer = scene_writer(&document);
    struct record_table table;
    simulate_table_start(&table, summary->trial->motion.record.integrator, scene->compiled.spatial);
    record_table_put_units(&table, &writer);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file))
        return STATUS_NUMBERS;
    return system_target_finish(target) ? STATUS_DONE : STATUS_FAULT;
}
