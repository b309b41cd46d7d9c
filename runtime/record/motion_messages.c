/* Messages about one motion: its start, its failure, rows that are not satisfied and energy that does not
 * balance. */
#include "runtime/record/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const record_stabilise_names[] = {
    [REFDYN_NONE] = "none", [REFDYN_BAUMGARTE] = "baumgarte", [REFDYN_PROJECT] = "project"};

/* With larger gains the stages of a step disturb each other. */
const double record_gain_share = 0.05;

bool record_gains_follow_step(const struct refdyn_options *options) {
    return options->stabilise == REFDYN_BAUMGARTE && options->gain_share > 0;
}

/* ---- The start ---- */

enum { MOVES_SHOWN = 8 };

static void print_remedies(const struct refdyn_options *chosen, bool is_as_requested, FILE *out) {
    static const char *const what[] = {
        [REFDYN_NONE] = "with --stabilise none it stays off; --stabilise baumgarte would pull it in",
        [REFDYN_BAUMGARTE] = "the stabilisation (baumgarte) pulls it in",
        [REFDYN_PROJECT] =
            "with projections the motion continues from the nearest state on the programme, and "
            "only its first row is off; baumgarte would pull it in"};
    fprintf(out,
            "  Two remedies: solve for a consistent start with --start project,\n"
            "  or start off the programme: %s.\n  This motion runs from the start as it is%s.\n",
            chosen->gain_share > 0 && chosen->tol > 0
                ? "gains from the step (baumgarte-auto) allow no step with a local error there; gains of "
                  "the rows (baumgarte), or --step, pull it in"
                : what[chosen->stabilise],
            is_as_requested ? ", as requested" : "");
}

static double farthest_move(const double *moved, int n, int *most) {
    for (int j = 0; j < n; j++)
        *most = fabs(moved[j]) > fabs(moved[*most]) ? j : *most;
    return fabs(moved[*most]);
}

/* Prints the coordinates that a projection has moved most, the farthest first. */
static void print_moves(const struct refdyn_integrator *integrator, const double *q, FILE *out) {
    const struct refdyn_model *model = integrator->work->model;
    double *left = malloc((size_t)model->n * sizeof *left);
    int most = 0;
    if (!left)
        return;
    memcpy(left, integrator->start_moved, (size_t)model->n * sizeof *left);
    fprintf(out, "refdyn: warning: the start is far from the programme. The projection moves");
    for (int i = 0; i < MOVES_SHOWN && farthest_move(left, model->n, &most) > 0; i++) {
        fprintf(out, "%s %s by %.4g %s to %.6g", i ? "," : "", model->coordinates[most].name,
                integrator->start_moved[most], model->coordinates[most].unit,
                q[most] + integrator->start_moved[most]);
        left[most] = 0;
    }
    fputs("; choose a nearer start if another assembly is meant\n", out);
    free(left);
}

/* Reports a start off the programme: the residual of each row, and the remedies. */
static void print_off(const struct record_motion *motion, bool is_as_requested, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    static const char *const levels[] = {"position", "velocity", "acceleration"};
    const struct refdyn_workspace *work = integrator->work;
    char text[2][RECORD_NUMBER_LENGTH];
    if (!integrator->start_is_off)
        return;
    if (integrator->start_is_far)
        print_moves(integrator, motion->q, out);
    if (integrator->options.project_start) {
        fprintf(out,
                "refdyn: the start was off the programme (largest |phi| %.4g, |psi| %.4g) and was projected "
                "onto it\n",
                integrator->start.phi, integrator->start.psi);
        return;
    }
    fprintf(out, "refdyn: warning: the start is off the programme:\n");
    for (int i = 0; i < work->m; i++) {
        enum refdyn_row_level level = work->model->rows[i].level;
        if (level == REFDYN_ACCELERATION)
            continue;
        fprintf(out, "  %s (%s): ", work->model->rows[i].name, levels[level]);
        if (level == REFDYN_POSITION)
            fprintf(out, "phi = %s, ", record_number(work->phi[i], text[0]));
        fprintf(out, "psi = %s\n", record_number(work->psi[i], text[1]));
    }
    print_remedies(&integrator->options, is_as_requested, out);
}

/* Warns of impacts whose value is beyond zero at the start: a body that has already passed its stop does not
 * hit it. */
static void print_beyond(const struct record_motion *motion, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    char text[RECORD_NUMBER_LENGTH];
    if (model->event_count == 0)
        return;
    double *values = malloc(((size_t)model->event_count + (size_t)model->kink_count) * sizeof *values);
    if (!values)
        return;
    model->event(work->p, work->x, integrator->t, integrator->q, integrator->qd, values);
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].is_impact && model->events[i].direction * values[i] > 0)
            fprintf(out,
                    "refdyn: warning: the start is beyond the event %s, whose value is %s; an impact occurs "
                    "only when "
                    "the value reaches zero from the other side\n",
                    model->events[i].name, record_number(values[i], text));
    free(values);
}

/* Warns of contacts whose state says that they rest although they do not. */
static void print_free_contacts(const struct record_motion *motion, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    const struct refdyn_model *model = integrator->work->model;
    for (int i = 0; i < model->event_count; i++) {
        const struct refdyn_event *event = &model->events[i];
        const int k = event->contact - 1 - refdyn_programme_rows(model);
        const int place = k >= 0 ? model->changes[event->first_change].place : -1;
        if (place >= 0 && motion->values[place] != 0 && integrator->contact_mode[k] == REFDYN_CONTACT_FREE)
            fprintf(out, "refdyn: warning: %s is set, but the contact does not rest at the start\n",
                    model->parameters[place].name);
    }
}

/* Names the multipliers that redundant rows share in any proportion, and with them forces of drives. */
static void print_open(const struct record_motion *motion, FILE *out) {
    struct refdyn_integrator *integrator = motion->integrator;
    const struct refdyn_model *model = integrator->work->model;
    double *values = malloc(((size_t)model->n + (size_t)model->m + 1) * sizeof *values);
    const bool has_forces = values && refdyn_integrator_multipliers(integrator, values) == REFDYN_OK &&
                            refdyn_integrator_force(integrator, values + model->m) == REFDYN_OK;
    int open = 0;
    for (int i = 0; has_forces && i < model->m + refdyn_joint_count(model); i++)
        if (isnan(values[i])) {
            fputs(open++ ? ", " : "refdyn: warning: these forces are not unique and are nan in the results: ",
                  out);
            if (i < model->m)
                fprintf(out, "the multiplier of %s", model->rows[i].name);
            else
                fprintf(out, "force_%s", model->coordinates[i - model->m].name);
        }
    if (open)
        fputc('\n', out);
    free(values);
}

void record_print_start(const struct record_motion *motion, bool is_as_requested, FILE *out) {
    print_off(motion, is_as_requested, out);
    print_beyond(motion, out);
    print_free_contacts(motion, out);
    const struct refdyn_integrator *integrator = motion->integrator;
    record_print_redundant_rows(motion->work, integrator->t, integrator->q, integrator->qd, out);
    print_open(motion, out);
}

/* Returns whether a row has gains, or could have gains that the runtime computes from the step. */
static bool has_gains(const struct refdyn_workspace *work, bool are_set_by_step) {
    const struct refdyn_model *model = work->model;
    for (int i = 0; model->gains && i < 2 * model->m; i++)
        if (model->gains[i] >= 0 && (are_set_by_step || work->p[model->gains[i]] != 0))
            return true;
    return false;
}

void record_print_gains(const struct refdyn_workspace *work, const struct refdyn_options *integration,
                        FILE *out) {
    if (integration->stabilise == REFDYN_BAUMGARTE && work->model->m > 0 &&
        !has_gains(work, integration->gain_share > 0))
        fputs("refdyn: warning: no row has gains (alpha, beta), so that residuals drift under baumgarte; "
              "--stabilise project keeps them small\n",
              out);
}

/* ---- Failures ---- */

/* Reports attempts to cross a singular position, where the rows lose rank. */
static void print_refused(const struct refdyn_refused_crossing *refused, FILE *out) {
    char text[RECORD_NUMBER_LENGTH];
    if (refused->tries == 0)
        return;
    fprintf(out, "refdyn: crossing the singular position was attempted %d time%s, last through t = %s s",
            refused->tries, refused->tries > 1 ? "s" : "", record_number(refused->t, text));
    if (isfinite(refused->stretch))
        fprintf(out, " by a step of %.3g s", refused->stretch);
    fprintf(out, ": %s\n", refdyn_refusal_text(refused->why));
}

/* Prints the residuals at the start, and where its projection has ended. */
static void print_start_residuals(const struct record_motion *motion, int status, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    struct refdyn_workspace *work = integrator->work;
    if (status != REFDYN_NO_CONVERGENCE && status != REFDYN_ROWS_INCONSISTENT)
        return;
    record_print_residuals(work, motion->from, motion->q, motion->qd, "the start", out);
    if (memcmp(motion->q, integrator->q, (size_t)work->n * sizeof *integrator->q) != 0)
        record_print_residuals(work, motion->from, integrator->q, integrator->qd,
                               "where the projection ended", out);
    record_print_start_advice(out);
}

static void print_reason(const struct record_motion *motion, int status, const char *unfit, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    char text[RECORD_NUMBER_LENGTH];
    if (integrator->cause > 0 && integrator->cause != status)
        fprintf(out, "refdyn: at t = %s s: %s\n", record_number(integrator->failed_t, text),
                refdyn_status_text(integrator->cause));
    record_print_failed(integrator->work, status, integrator->t, integrator->q, integrator->qd, out);
    record_print_value_advice(status, out);
    record_events_print_failed(integrator, out);
    if (record_print_condition(integrator->work, integrator->t, integrator->q, integrator->qd, out) &&
        integrator->options.singular == REFDYN_STOP)
        fputs("refdyn: --singular pass crosses it if a branch can be followed\n", out);
    print_refused(&integrator->refused, out);
    record_print_advice(motion, status, unfit, out);
}

void record_print_failure(const struct record_motion *motion, int status, bool is_started, const char *unfit,
                          const char *refused, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    char text[RECORD_NUMBER_LENGTH];
    if (unfit)
        fprintf(out, "refdyn: column %s is infinite or not a number\n", unfit);
    if (!is_started) {
        record_print_failed(integrator->work, status, motion->from, motion->q, motion->qd, out);
        record_print_value_advice(status, out);
        print_start_residuals(motion, status, out);
    } else if (status == RECORD_INTERRUPTED || status == RECORD_NOT_WRITTEN)
        fprintf(out, "refdyn: %s at t = %s s\n",
                status == RECORD_INTERRUPTED ? "interrupted" : "the rows could no longer be written",
                record_number(integrator->t, text));
    else if (status == REFDYN_REFUSED)
        record_events_print_refused(integrator, refused, out);
    else
        print_reason(motion, status, unfit, out);
}

/* ---- Warnings after the motion ---- */

/* A row with a larger residual is not satisfied [m, rad, m/s, rad/s]. */
static const double off_most = 0.01;

/* The start has its own warning, and with a projection all rows are satisfied. */
void record_print_rows_warning(const struct refdyn_integrator *integrator, FILE *out) {
    const struct refdyn_statistics *s = &integrator->statistics;
    const int by_rate = !(s->phi_max > off_most), row = by_rate ? s->psi_row : s->phi_row;
    if (integrator->options.stabilise == REFDYN_PROJECT || integrator->start_is_off || row < 0 ||
        !((by_rate ? s->psi_max : s->phi_max) > off_most))
        return;
    fprintf(
        out,
        "refdyn: warning: %s is not satisfied: its %s is up to %.3g; --stabilise project keeps it small\n",
        integrator->work->model->rows[row].name, by_rate ? "psi" : "phi", by_rate ? s->psi_max : s->phi_max);
}

/* Smaller errors of energy are not reported: balance_part of the largest change or kinetic energy,
 * energy_part of all energy. The same holds for errors that position errors within the tolerance explain;
 * fixed steps use tol_fixed instead. */
static const double balance_part = 0.02, energy_part = 1e-4, tol_fixed = 1e-6;
/* Returns whether the motion began with a projection onto the programme, whose work is not counted. */
static bool has_jumped(const struct refdyn_integrator *integrator) {
    return integrator->start_is_off && integrator->options.stabilise == REFDYN_PROJECT &&
           !integrator->options.project_start;
}

/* The energy shows whether a stable motion is resolved. The change of energy alone is no measure if it is
 * zero, as for a rolling coin or a body at rest. */
static bool is_resolved(const struct record_motion *motion) {
    const struct refdyn_energy *energy = &motion->energy;
    const double asked = motion->integrator->options.tol, tol = asked > 0 ? asked : tol_fixed;
    const double change = fmax(energy->largest_change, energy->largest_kinetic);
    return energy->largest_error <=
           fmax(fmax(balance_part * change, energy_part * energy->largest), tol * energy->unit);
}

void record_print_balance_warning(const struct record_motion *motion, FILE *out) {
    if (is_resolved(motion))
        return;
    fputs(has_jumped(motion->integrator)
              ? "refdyn: warning: energy and work do not balance: the start is off the programme, and the "
                "work of the "
                "jump onto it is not counted; begin on it with --start project\n"
              : "refdyn: warning: energy and work do not balance: the motion is not resolved; try a smaller "
                "--tol or --step\n",
          out);
}

/* ---- Derivatives ---- */

static void print_event(const struct refdyn_model *model, const struct refdyn_underivable *why, FILE *out) {
    if (why->event >= 0)
        fprintf(out, "the event %s", model->events[why->event].name);
    else
        fputs("a time event or a kink of the model's formulas", out);
    if (why->is_at_start)
        fputs(" at the start of the motion", out);
}

/* Values that jump where an event happens at an output. */
static void print_jumps(const char *name, const struct refdyn_underivable *why, FILE *out) {
    char t[RECORD_NUMBER_LENGTH];
    fprintf(
        out,
        "refdyn: warning: --derivatives %s: %ld value%s at an output at which an event happens, the first at "
        "t = %s s; %s nan there\n",
        name, why->jumps, why->jumps > 1 ? "s jump" : " jumps", record_number(why->t_jump, t),
        why->jumps > 1 ? "their derivatives are" : "its derivative is");
}

static void print_bends(const char *name, const char *column, const struct refdyn_underivable *why,
                        FILE *out) {
    char t[4][RECORD_NUMBER_LENGTH];
    fprintf(
        out,
        "refdyn: warning: --derivatives %s: nan from t = %s s on in columns that have different slopes above "
        "and below this %s, as at a kink or jump of a formula or a contact that just touches (%s at t = %s "
        "s: %s above, %s below); change %s slightly for one side\n",
        name, record_number(why->t_bend, t[0]), name, column, record_number(why->t_slopes, t[1]),
        record_number(why->above, t[2]), record_number(why->below, t[3]), name);
}

static void print_underivable(const struct refdyn_model *model, const char *name,
                              const struct refdyn_underivable *why, FILE *out) {
    char t[RECORD_NUMBER_LENGTH], change[RECORD_NUMBER_LENGTH];
    fprintf(out, "refdyn: warning: --derivatives %s: nan from t = %s s on: when %s changes by %s, ", name,
            record_number(why->t, t), name, record_number(why->change, change));
    if (why->status == REFDYN_NO_DERIVATIVE) {
        print_event(model, why, out);
        fputs(" happens in another order, or on one side only\n", out);
    } else
        fprintf(out, "the motion fails there: %s\n", refdyn_status_text(why->status));
}

void record_print_underivable(const struct refdyn_model *model, const char *const *names,
                              const char *const *columns, const struct refdyn_underivable *underivable,
                              int count, FILE *out) {
    for (int i = 0; i < count; i++) {
        if (underivable[i].jumps > 0)
            print_jumps(names[i], &underivable[i], out);
        if (underivable[i].bends > 0)
            print_bends(names[i], columns[underivable[i].column], &underivable[i], out);
        if (underivable[i].status)
            print_underivable(model, names[i], &underivable[i], out);
    }
}
