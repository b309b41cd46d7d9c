/* Equilibria: messages about them, and their results as entries. */
#include "runtime/record/record.h"

#include <math.h>
#include <string.h>

const char *record_stability_text(const struct refdyn_statics_result *result,
                                  char text[static RECORD_STABILITY_LENGTH]) {
    const int count = result->unstable ? result->unstable : result->neutral;
    if (count == 0)
        return "stable";
    snprintf(text, RECORD_STABILITY_LENGTH, "%s in %d direction%s", result->unstable ? "unstable" : "neutral",
             count, count > 1 ? "s" : "");
    return text;
}

/* How stability was determined. */
static const char *const criterion_words[] = {[REFDYN_BY_POTENTIAL] = "potential",
                                              [REFDYN_BY_LINEAR_MOTION] = "linear motion",
                                              [REFDYN_BY_SYMMETRIC_PART] = "symmetric part"};

/* Why the potential did not decide. */
static const char *criterion_note(const struct refdyn_statics_result *result) {
    if (result->criterion == REFDYN_BY_SYMMETRIC_PART)
        return "its forces have no potential and the motion no finite tangent, so the symmetric part of the "
               "stiffness was used";
    return result->has_potential ? "dampers or states can add energy there, so the growing modes were "
                                   "counted; refdyn modes shows them"
                                 : "its forces have no potential, so the growing modes were counted; refdyn "
                                   "modes shows them";
}

/* Prints how stability was determined if the potential did not decide. */
static void print_criterion(const struct refdyn_statics_result *result, FILE *out) {
    char text[RECORD_STABILITY_LENGTH];
    if (result->criterion != REFDYN_BY_POTENTIAL)
        fprintf(out, "refdyn: the equilibrium is %s; %s\n", record_stability_text(result, text),
                criterion_note(result));
}

static void warn_of_instability(const struct record_equilibrium *equilibrium, FILE *out) {
    char text[RECORD_STABILITY_LENGTH];
    const struct refdyn_statics_result *result = equilibrium->result;
    fprintf(out, "refdyn: warning: this equilibrium is %s", record_stability_text(result, text));
    if (result->unstable_coordinate >= 0)
        fprintf(out, ", %s moves most",
                equilibrium->work->model->coordinates[result->unstable_coordinate].name);
    if (result->criterion != REFDYN_BY_POTENTIAL)
        fprintf(out, "; %s", criterion_note(result));
    else if (equilibrium->options->way != REFDYN_DOWNHILL)
        fputs("; --way downhill finds a stable one", out);
    fputc('\n', out);
}

void record_print_equilibrium(const struct record_equilibrium *equilibrium, FILE *out) {
    if (!equilibrium->result->is_followed)
        fputs("refdyn: warning: this equilibrium is beyond a limit point; the growing load does not lead to "
              "it\n",
              out);
    if (equilibrium->result->unstable)
        warn_of_instability(equilibrium, out);
}

static const char *unit_of_force(const struct refdyn_model *model, int coordinate) {
    if (coordinate >= refdyn_joint_count(model))
        return ""; /* the rate of a state */
    return strcmp(model->coordinates[coordinate].unit, "rad") == 0 ? "N m" : "N";
}

/* Prints the largest force that no spring, row or hold balances. */
static void print_imbalance(const struct record_equilibrium *equilibrium, FILE *out) {
    const struct refdyn_model *model = equilibrium->work->model;
    const double *force = equilibrium->result->force;
    int largest = -1;
    char text[RECORD_NUMBER_LENGTH];
    for (int i = 0; i < model->n && force; i++)
        if (!equilibrium->held[i] && (largest < 0 || fabs(force[i]) > fabs(force[largest])))
            largest = i;
    if (largest >= 0)
        fprintf(out, "refdyn: the largest imbalance there is at %s: %s %s\n",
                model->coordinates[largest].name, record_number(force[largest], text),
                unit_of_force(model, largest));
}

/* Prints which rows have no part in statics although they are not released, and why. */
static void print_rows_without_part(const struct record_equilibrium *equilibrium, FILE *out) {
    const struct refdyn_statics_options *statics = equilibrium->options;
    const struct refdyn_model *model = equilibrium->work->model;
    int next = 0;
    for (int i = 0; i < model->m; i++) {
        const struct refdyn_row *row = &model->rows[i];
        if (next < statics->row_count && statics->rows[next] == i)
            next++;
        else if (row->level != REFDYN_POSITION)
            fprintf(out,
                    "refdyn: the row %s is not a row of positions and has no part in statics or stability\n",
                    row->name);
        else if (equilibrium->starts[i])
            fprintf(
                out,
                "refdyn: the row %s begins where the motion does and has no part in statics; --set %s=VALUE "
                "includes it\n",
                row->name, equilibrium->starts[i]);
    }
}

void record_print_no_equilibrium(const struct record_equilibrium *equilibrium, int answer, FILE *out) {
    const struct refdyn_statics_result *result = equilibrium->result;
    struct refdyn_workspace *work = equilibrium->work;
    const double t = equilibrium->options->t;
    record_print_failed(work, answer, t, equilibrium->q, NULL, out);
    record_print_value_advice(answer, out);
    if (!result->force && work->fault.row >= 0) {
        record_print_residuals(work, t, equilibrium->q, equilibrium->qd, "the start", out);
        record_print_start_advice(out);
        return;
    }
    if (answer != REFDYN_NOT_FINITE)
        print_imbalance(equilibrium, out);
    if (equilibrium->options->way == REFDYN_DOWNHILL)
        fputs("refdyn: the forces lead to no equilibrium\n", out);
    else
        fprintf(out, "refdyn: equilibrium reached only up to %.3g of the load\n", result->load);
    if (answer == REFDYN_TANGENT_SINGULAR) {
        fputs("refdyn: --hold keeps free coordinates at their start\n", out);
        print_rows_without_part(equilibrium, out);
    }
    if (equilibrium->options->way == REFDYN_ALONG_LOAD)
        fputs("refdyn: --way path passes limit points of the load; --way downhill follows the forces\n", out);
}

/* Prints explanations of the result that are no warnings. */
void record_print_notes(const struct record_equilibrium *equilibrium, FILE *out) {
    const struct refdyn_statics_result *result = equilibrium->result;
    if (result->limit_points)
        fprintf(out, "refdyn: %d limit point%s of the load passed\n", result->limit_points,
                result->limit_points > 1 ? "s" : "");
    if (!result->unstable)
        print_criterion(result, out);
    if (result->is_indeterminate)
        fputs("refdyn: the forces of the contacts are not unique; the smallest ones are printed\n", out);
    print_rows_without_part(equilibrium, out);
}

/* Writes gaps and forces of the contacts, which begin at row `from` of the options. */
static void put_contacts(const struct record_writer *writer, const struct record_equilibrium *equilibrium,
                         int from) {
    const struct refdyn_statics_options *options = equilibrium->options;
    const struct refdyn_statics_result *result = equilibrium->result;
    const int first = refdyn_programme_rows(equilibrium->work->model);
    writer->open(writer->context, "contacts", '[');
    for (int i = from; i < options->row_count; i++) {
        writer->open(writer->context, NULL, '{');
        writer->text(writer->context, "name", equilibrium->work->model->rows[options->rows[i]].name);
        writer->number(writer->context, "gap", result->contact_gap[options->rows[i] - first]);
        writer->number(writer->context, "force", result->lambda[i]);
        writer->close(writer->context, '}');
    }
    writer->close(writer->context, ']');
}

static void put_rows(const struct record_writer *writer, const struct record_equilibrium *equilibrium) {
    const struct refdyn_statics_options *options = equilibrium->options;
    const int first = refdyn_programme_rows(equilibrium->work->model);
    int count = 0;
    writer->open(writer->context, "rows", '[');
    for (; count < options->row_count && options->rows[count] < first; count++)
        writer->text(writer->context, NULL, equilibrium->work->model->rows[options->rows[count]].name);
    writer->close(writer->context, ']');
    record_put_array(writer, "lambda", equilibrium->result->lambda, count);
    writer->number(writer->context, "phi", equilibrium->result->phi);
    if (equilibrium->work->model->m > first)
        put_contacts(writer, equilibrium, count);
}

static void put_stability(const struct record_writer *writer, const struct refdyn_statics_result *result) {
    char text[RECORD_STABILITY_LENGTH];
    writer->text(writer->context, "stability", record_stability_text(result, text));
    writer->whole(writer->context, "unstable", result->unstable);
    writer->whole(writer->context, "neutral", result->neutral);
    writer->truth(writer->context, "potential", result->has_potential);
    writer->text(writer->context, "criterion", criterion_words[result->criterion]);
}

void record_put_equilibrium(const struct record_equilibrium *equilibrium,
                            const struct record_writer *writer) {
    writer->open(writer->context, "hold_force", '[');
    for (int i = 0; i < equilibrium->work->n; i++)
        if (equilibrium->held[i])
            writer->number(writer->context, NULL, equilibrium->hold_force[i]);
    writer->close(writer->context, ']');
    writer->number(writer->context, "residual", equilibrium->result->residual);
    put_rows(writer, equilibrium);
    put_stability(writer, equilibrium->result);
}
