/*
 * `fit --check`: identifiability before data exist.
 *
 * In: the values, and the columns to be measured, each with its noise. Out: the standard errors to expect
 * from data of the motion of the start, what these data would not determine, and the further column that
 * would help most: it raises the smallest singular value of J most. The assumed noise of a further column is
 * a hundredth of its range.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"

static const double noise_of_range = 0.01;

/* Marks the columns that a sensor could measure: coordinates, points and courses with their rates. */
static bool *find_measurable(const struct record_table *table) {
    static const char *const paths[] = {"/q", "/points/", "/courses/"};
    bool *is_measurable = format_allocate((size_t)table->count, sizeof *is_measurable);
    for (int i = 0; i < table->part_count; i++)
        for (int k = 0; k < 3; k++)
            if (strncmp(table->parts[i].path, paths[k], strlen(paths[k])) == 0)
                for (int j = 0; j < table->parts[i].count; j++)
                    is_measurable[table->parts[i].first + j] = true;
    return is_measurable;
}

void fit_check_add_columns(struct fit *fit) {
    const struct record_table *table = &fit->table;
    const bool *is_measurable = find_measurable(table);
    struct fit_signal *signals = format_allocate((size_t)(fit->asked + table->count), sizeof *signals);
    memcpy(signals, fit->signals, (size_t)fit->asked * sizeof *signals);
    for (int i = 1; i < table->count; i++) {
        bool is_further = is_measurable[i];
        for (int k = 0; k < fit->asked; k++)
            is_further = is_further && signals[k].column != i;
        if (is_further)
            signals[fit->signal_count++] =
                (struct fit_signal){table->names[i], 1, i, {[FIT_GAIN] = 1}, {-1, -1, -1}};
    }
    fit->signals = signals;
}

/* Sets the noise of further columns; 0 for those that do not move. */
static void set_noise(struct fit *fit, const double *values) {
    const int width = fit->signal_count;
    for (int k = fit->asked; k < width; k++) {
        double least = INFINITY, most = -INFINITY;
        for (int i = 0; i < fit->data[0].rows; i++) {
            least = fmin(least, values[i * width + k]);
            most = fmax(most, values[i * width + k]);
        }
        fit->signals[k].noise = noise_of_range * (most - least);
    }
}

/* The derivatives of the asked columns, and of one further column (-1: none). */
static void select_rows(const struct fit *fit, const struct fit_solution *all, int further,
                        struct fit_solution *selected) {
    const int width = fit->signal_count;
    *selected = *all;
    selected->rows = 0;
    for (int i = 0; i < all->rows; i++)
        selected->rows += i % width < fit->asked || i % width == further;
    selected->J = format_allocate_large((size_t)selected->rows * (size_t)fit->count, sizeof *selected->J);
    double *to = selected->J;
    for (int j = 0; j < fit->count; j++)
        for (int i = 0; i < all->rows; i++)
            if (i % width < fit->asked || i % width == further)
                *to++ = all->J[(size_t)j * (size_t)all->rows + (size_t)i];
}

static void judge(const struct fit *fit, const struct fit_solution *all, int further,
                  struct fit_certainty *certainty) {
    struct fit_solution selected;
    select_rows(fit, all, further, &selected);
    fit_certainty_find(fit, &selected, certainty);
    free(selected.J);
}

/* The further column that helps most; -1 if none helps. */
static int find_best(const struct fit *fit, const struct fit_solution *all, const struct fit_certainty *asked,
                     struct fit_certainty *best) {
    double largest = asked->singular[fit->count - 1];
    int found = -1;
    for (int k = fit->asked; k < fit->signal_count; k++) {
        struct fit_certainty certainty;
        if (fit->signals[k].noise == 0)
            continue;
        judge(fit, all, k, &certainty);
        if (certainty.singular[fit->count - 1] > largest) {
            largest = certainty.singular[fit->count - 1];
            found = k;
            *best = certainty;
        }
    }
    return found;
}

static void print_check(const struct fit *fit, const double *from, const struct fit_certainty *asked,
                        int further, const struct fit_certainty *best) {
    for (int k = 0; k < fit->count; k++) {
        const int at = k * fit->count + k;
        fprintf(stderr, "%-12s %.6g", fit->values[k].name, fit_value_of(&fit->values[k], from[k]));
        if (!asked->is_dependent)
            fprintf(stderr, " +- %.2g", sqrt(asked->covariance[at]));
        if (further >= 0)
            fprintf(stderr, ", with %s +- %.2g", fit->signals[further].name, sqrt(best->covariance[at]));
        fputs("\n", stderr);
    }
    for (int i = 0; i < asked->group_count; i++)
        fprintf(stderr, "refdyn: warning: these columns do not determine %s\n",
                fit_group_text(asked->groups[i]));
    if (further < 0 && asked->group_count > 0)
        fputs("refdyn: warning: no single further column would help\n", stderr);
}

static enum status write_check(const struct fit *fit, const struct fit_certainty *asked, int further,
                               const struct fit_certainty *best) {
    struct document document;
    scene_document_open(&document);
    format_put_text(&document, "name", fit->scene->model->name);
    fit_put_errors(&document, fit, asked);
    fit_put_groups(&document, asked);
    if (further >= 0) {
        format_put_open(&document, "best_column", '{');
        format_put_text(&document, "name", fit->signals[further].name);
        format_put_number(&document, "noise", fit->signals[further].noise);
        fit_put_errors(&document, fit, best);
        fit_put_groups(&document, best);
        format_put_close(&document, '}');
    }
    format_put_close(&document, '}');
    return scene_finish(fit->scene, &document);
}

enum status fit_check(struct fit *fit, const double *from) {
    const struct fit_data *data = &fit->data[0];
    const size_t width = (size_t)fit->signal_count, rows = (size_t)data->rows * width;
    double *values = format_allocate_large(rows, sizeof *values);
    struct fit_solution all = {.rows = (int)rows};
    struct fit_certainty asked, best;
    enum fit_outcome outcome = fit_motion_values(fit, data, from, values);
    set_noise(fit, values);
    free(values);
    all.u = format_allocate((size_t)fit->count, sizeof *all.u);
    memcpy(all.u, from, (size_t)fit->count * sizeof *from);
    all.r = format_allocate_large(rows, sizeof *all.r);
    all.J = format_allocate_large(rows * (size_t)fit->count, sizeof *all.J);
    if (outcome == FIT_DONE)
        outcome = fit_residuals(fit, INFINITY, from, all.r, all.J, rows);
    if (outcome != FIT_DONE)
        return fit_report_outcome(fit, outcome);
    judge(fit, &all, -1, &asked);
    const int further = find_best(fit, &all, &asked, &best);
    print_check(fit, from, &asked, further, &best);
    free(all.r);
    free(all.J);
    return write_check(fit, &asked, further, &best);
}
