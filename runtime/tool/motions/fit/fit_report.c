/*
 * What the data say about the values: standard errors and correlations, values and combinations that the data
 * do not determine, residuals by column; FIT.json and a summary on stderr.
 *
 * The covariance is that of the linear model at the solution, (J^T J)^-1 for residuals of unit variance. With
 * a logarithm as unknown the standard error of a value is the value times that of its logarithm.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lapacke.h>

#include "runtime/tool/motions/fit/fit.h"

/* Columns of J, scaled to length 1, depend on each other if a singular value is smaller. Derivatives have
 * errors of about 1e-6. */
static const double dependent_most = 1e-4;
/* Nothing depends on a value if a factor of e, or one unit, changes all residuals together by less than this
 * part of the noise. Its derivatives are then rounding errors. */
static const double inert_most = 1e-5;
/* The data do not determine a direction whose standard error exceeds 1: a factor of e, or one unit. */
static const double determined_least = 1;
/* Entries of a direction that count, relative to its largest one. */
static const double entry_least = 0.2;

/* ---- Certainty ---- */

/* The triangular factor R (count x count, columns first) of J. */
static void factor(const struct fit_solution *solution, int count, double *R) {
    const int rows = solution->rows;
    const size_t size = (size_t)rows * (size_t)count;
    double *A = format_allocate_large(size + 1, sizeof *A),
           *tau = format_allocate((size_t)count, sizeof *tau);
    memcpy(A, solution->J, size * sizeof *A);
    LAPACKE_dgeqrf(LAPACK_COL_MAJOR, rows, count, A, rows, tau);
    for (int k = 0; k < count; k++)
        for (int i = 0; i <= k; i++)
            R[k * count + i] = A[(size_t)k * (size_t)rows + (size_t)i];
    free(A);
}

/* Singular values of R, descending, and directions (rows) of its unknowns. */
static void decompose(const double *R, int count, double *singular, double *directions) {
    const size_t size = (size_t)count * (size_t)count;
    double *A = format_allocate(size, sizeof *A), *U = format_allocate(size, sizeof *U),
           *V = format_allocate(size, sizeof *V), *rest = format_allocate((size_t)count, sizeof *rest);
    memcpy(A, R, size * sizeof *A);
    LAPACKE_dgesvd(LAPACK_COL_MAJOR, 'A', 'A', count, count, A, count, singular, U, count, V, count, rest);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++)
            directions[i * count + k] = V[k * count + i];
}

static void set_covariance(const struct fit *fit, const struct fit_solution *solution,
                           const double *directions, struct fit_certainty *certainty) {
    const int count = certainty->count;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++) {
            const struct fit_value *va = &fit->values[a], *vb = &fit->values[b];
            const double da = va->is_log ? fit_value_of(va, solution->u[a]) : va->unit,
                         db = vb->is_log ? fit_value_of(vb, solution->u[b]) : vb->unit;
            double sum = 0;
            for (int i = 0; i < count; i++)
                sum += directions[i * count + a] * directions[i * count + b] /
                       (certainty->singular[i] * certainty->singular[i]);
            certainty->covariance[a * count + b] = da * db * sum;
        }
}

/* Adds the names whose entries in a direction count, unless one of them is in a group already. */
static void add_group(const struct fit *fit, const double *direction, struct fit_certainty *certainty,
                      bool *is_named) {
    const int count = certainty->count;
    const char **names = format_allocate((size_t)count + 1, sizeof *names);
    double largest = 0;
    int length = 0;
    bool is_new = true;
    for (int k = 0; k < count; k++)
        largest = fmax(largest, fabs(direction[k]));
    for (int k = 0; k < count; k++)
        if (fabs(direction[k]) >= entry_least * largest) {
            names[length++] = fit->values[k].name;
            is_new = is_new && !is_named[k];
        }
    for (int k = 0; k < count && is_new; k++)
        is_named[k] = is_named[k] || fabs(direction[k]) >= entry_least * largest;
    if (is_new)
        certainty->groups[certainty->group_count++] = names;
}

static void find_groups(const struct fit *fit, const double *directions, struct fit_certainty *certainty) {
    const int count = certainty->count;
    bool *is_named = format_allocate((size_t)count, sizeof *is_named);
    certainty->groups = format_allocate(2 * (size_t)count + 1, sizeof *certainty->groups);
    for (int i = 0; i < count; i++)
        if (certainty->relative[i] < dependent_most) {
            certainty->is_dependent = true;
            add_group(fit, certainty->directions + i * count, certainty, is_named);
        }
    for (int i = 0; i < count; i++)
        if (certainty->singular[i] < determined_least)
            add_group(fit, directions + i * count, certainty, is_named);
}

void fit_certainty_find(const struct fit *fit, const struct fit_solution *solution,
                        struct fit_certainty *certainty) {
    const int count = fit->count;
    double *R = format_allocate_matrix(count, count), *directions = format_allocate_matrix(count, count);
    *certainty = (struct fit_certainty){.count = count};
    certainty->covariance = format_allocate_matrix(count, count);
    certainty->directions = format_allocate_matrix(count, count);
    certainty->singular = format_allocate_matrix(count, 1);
    certainty->relative = format_allocate_matrix(count, 1);
    factor(solution, count, R);
    decompose(R, count, certainty->singular, directions);
    set_covariance(fit, solution, directions, certainty);
    for (int k = 0; k < count; k++) {
        double norm = 0;
        for (int i = 0; i <= k; i++)
            norm = hypot(norm, R[k * count + i]);
        for (int i = 0; i <= k; i++)
            R[k * count + i] = norm > inert_most ? R[k * count + i] / norm : 0;
    }
    decompose(R, count, certainty->relative, certainty->directions);
    find_groups(fit, directions, certainty);
}

const char *fit_group_text(const char *const *names) {
    const char *text = names[0];
    for (int i = 1; names[i]; i++)
        text = format_text("%s%s%s", text, names[i + 1] ? ", " : " and ", names[i]);
    return text;
}

/* ---- Residuals by column ---- */

struct spread {
    long count;
    double sum, squares, largest; /* in the unit of the column */
};

static struct spread spread_of(const struct fit *fit, bool is_held_out, int signal, const double *r) {
    struct spread spread = {.count = 0};
    for (int i = 0; i < fit->data_count; i++)
        for (int row = 0; row < fit->data[i].rows && fit->data[i].is_held_out == is_held_out; row++)
            for (int k = 0; k < fit->signal_count; k++) {
                if (isnan(fit->data[i].y[(size_t)row * (size_t)fit->signal_count + (size_t)k]))
                    continue;
                const double residual = *r++ * fit->signals[k].noise / sqrt(fit->data[i].weight);
                if (k != signal)
                    continue;
                spread.count++;
                spread.sum += residual;
                spread.squares += residual * residual;
                spread.largest = fmax(spread.largest, fabs(residual));
            }
    return spread;
}

static void put_residuals(struct document *document, const struct fit *fit, bool is_held_out,
                          const double *r) {
    format_put_open(document, "residuals", '{');
    for (int k = 0; k < fit->signal_count; k++) {
        const struct spread spread = spread_of(fit, is_held_out, k, r);
        if (spread.count == 0)
            continue;
        format_put_open(document, fit->signals[k].name, '{');
        format_put_whole(document, "count", spread.count);
        format_put_number(document, "rms", sqrt(spread.squares / (double)spread.count));
        format_put_number(document, "mean", spread.sum / (double)spread.count);
        format_put_number(document, "largest", spread.largest);
        format_put_number(document, "noise", fit->signals[k].noise);
        format_put_close(document, '}');
    }
    format_put_close(document, '}');
}

static double square_sum(const double *r, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += r[i] * r[i];
    return sum;
}

/* The residuals of the held-out files; returns their number, 0 if there are none or their motion failed. */
static int validate(struct fit *fit, double *u, double **r) {
    const int count = fit_residual_count(fit, true, INFINITY);
    *r = format_allocate_large((size_t)count + 1, sizeof **r);
    return count > 0 && fit_validate(fit, u, *r) == FIT_DONE ? count : 0;
}

/* ---- FIT.json ---- */

/* Puts the values of kinds `first` to `last`, if there are any. */
static void put_kinds(struct document *document, const struct fit *fit, const double *u, const char *key,
                      enum fit_kind first, enum fit_kind last) {
    int count = 0;
    for (int j = 0; j < fit->all_count; j++) {
        const struct fit_value *value = &fit->values[j];
        if (value->kind < first || value->kind > last)
            continue;
        if (count++ == 0)
            format_put_open(document, key, '{');
        format_put_number(document, value->name, fit_value_of(value, u[j]));
    }
    if (count > 0)
        format_put_close(document, '}');
}

void fit_put_errors(struct document *document, const struct fit *fit, const struct fit_certainty *certainty) {
    const int count = fit->count;
    double *correlations = format_allocate_matrix(count, count);
    if (certainty->is_dependent)
        return;
    format_put_open(document, "standard_errors", '{');
    for (int k = 0; k < count; k++)
        format_put_number(document, fit->values[k].name, sqrt(certainty->covariance[k * count + k]));
    format_put_close(document, '}');
    format_put_matrix(document, "covariance", certainty->covariance, count, count);
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++)
            correlations[a * count + b] =
                a == b ? 1
                       : certainty->covariance[a * count + b] / (sqrt(certainty->covariance[a * count + a]) *
                                                                 sqrt(certainty->covariance[b * count + b]));
    format_put_matrix(document, "correlations", correlations, count, count);
}

void fit_put_groups(struct document *document, const struct fit_certainty *certainty) {
    format_put_array(document, "singular_values", certainty->singular, certainty->count);
    format_put_open(document, "not_identifiable", '[');
    for (int i = 0; i < certainty->group_count; i++) {
        format_put_open(document, NULL, '[');
        for (int k = 0; certainty->groups[i][k]; k++)
            format_put_text(document, NULL, certainty->groups[i][k]);
        format_put_close(document, ']');
    }
    format_put_close(document, ']');
}

static bool is_at_bound(const struct fit_value *value, double unknown) {
    const double number = fit_value_of(value, unknown), near = 1e-9 * fabs(number);
    return fabs(number - value->lower) <= near || fabs(number - value->upper) <= near;
}

static void put_rough(struct document *document, const struct fit *fit) {
    format_put_open(document, "rough_errors", '[');
    for (int k = 0; k < fit->count; k++)
        if (fit->values[k].is_rough)
            format_put_text(document, NULL, fit->values[k].name);
    format_put_close(document, ']');
}

static void put_bounds(struct document *document, const struct fit *fit,
                       const struct fit_solution *solution) {
    format_put_open(document, "at_bounds", '[');
    for (int k = 0; k < fit->count; k++)
        if (is_at_bound(&fit->values[k], solution->u[k]))
            format_put_text(document, NULL, fit->values[k].name);
    format_put_close(document, ']');
}

static void put_validation(struct document *document, const struct fit *fit, const double *r, int count) {
    if (count == 0)
        return;
    format_put_open(document, "validation", '{');
    format_put_number(document, "chi2_dof", square_sum(r, count) / count);
    put_residuals(document, fit, true, r);
    format_put_close(document, '}');
}

/* The unknowns of all values; those of held-out files are at their start. */
static double *all_unknowns(const struct fit *fit, const struct fit_solution *solution) {
    double *u = format_allocate((size_t)fit->all_count, sizeof *u);
    for (int j = 0; j < fit->all_count; j++)
        u[j] = j < fit->count ? solution->u[j] : fit_unknown_of(&fit->values[j], fit->values[j].start);
    return u;
}

enum status fit_report_write(struct fit *fit, const struct fit_solution *solution,
                             const struct fit_certainty *certainty) {
    struct document document;
    const double freedom = fmax(solution->rows - fit->count, 1);
    double *u = all_unknowns(fit, solution), *r;
    const int held_out = validate(fit, u, &r);
    scene_document_open(&document);
    format_put_text(&document, "name", fit->scene->model->name);
    put_kinds(&document, fit, u, "values", FIT_OF_MODEL, FIT_OF_MODEL);
    put_kinds(&document, fit, u, "sensors", FIT_OFFSET, FIT_DELAY);
    put_kinds(&document, fit, u, "starts", FIT_START, FIT_START);
    fit_put_errors(&document, fit, certainty);
    format_put_number(&document, "chi2_dof", solution->chi2 / freedom);
    format_put_whole(&document, "degrees_of_freedom", (long)freedom);
    put_residuals(&document, fit, false, solution->r);
    fit_put_groups(&document, certainty);
    put_bounds(&document, fit, solution);
    put_rough(&document, fit);
    put_validation(&document, fit, r, held_out);
    format_put_whole(&document, "starts_tried", solution->starts);
    format_put_whole(&document, "evaluations", fit->motions);
    fit_put_series(&document, fit, u);
    format_put_close(&document, '}');
    free(r);
    return scene_finish(fit->scene, &document);
}

/* ---- Messages ---- */

enum status fit_report_outcome(const struct fit *fit, enum fit_outcome outcome) {
    if (outcome == FIT_STOPPED)
        fprintf(stderr, "refdyn: %s: interrupted\n", fit->scene->model->name);
    else
        fprintf(stderr,
                "refdyn: %s: the motion of the start fails at t = %.6g: %s; choose a start with --set\n",
                fit->scene->model->name, fit->end_t,
                fit->end_status ? refdyn_status_text(fit->end_status) : "it ends before the data");
    return STATUS_NUMBERS;
}

/* ---- The summary ---- */

/* With a larger chi^2 for each degree of freedom, the model does not explain the data. */
static const double unexplained_least = 1.5;

void fit_report_print(struct fit *fit, const struct fit_solution *solution,
                      const struct fit_certainty *certainty) {
    const int count = fit->count;
    const double freedom = fmax(solution->rows - count, 1);
    for (int k = 0; k < count; k++)
        fprintf(stderr, "%-12s %.6g +- %.2g%s\n", fit->values[k].name,
                fit_value_of(&fit->values[k], solution->u[k]), sqrt(certainty->covariance[k * count + k]),
                is_at_bound(&fit->values[k], solution->u[k]) ? ", at its bound" : "");
    fprintf(stderr,
            "chi2         %.4g for each of %.0f degrees of freedom; %ld motions, %d start%s, %.3g s\n",
            solution->chi2 / freedom, freedom, fit->motions, solution->starts,
            solution->starts > 1 ? "s" : "", system_wall_seconds() - fit->progress.started);
    if (solution->chi2 / freedom > unexplained_least)
        fprintf(
            stderr,
            "refdyn: warning: the residuals are %.3g times the noise: the model does not explain the data, "
            "or --noise is too small\n",
            sqrt(solution->chi2 / freedom));
    for (int i = 0; i < certainty->group_count; i++)
        fprintf(stderr, "refdyn: warning: the data do not determine %s\n",
                fit_group_text(certainty->groups[i]));
    for (int k = 0; k < count; k++)
        if (fit->values[k].is_rough)
            fprintf(stderr,
                    "refdyn: warning: a slight change of %s reorders events: its derivatives are differences "
                    "of separate motions, and its standard error is rough\n",
                    fit->values[k].name);
    if (fit->lost > 0)
        fprintf(stderr,
                "refdyn: warning: %d derivatives do not exist, since values jump at an output or changed "
                "motions fail; the standard errors omit them\n",
                fit->lost);
}
