/* The key `series` of FIT.json: data and model over time, by file and column, for figures. */
#include <math.h>
#include <stdlib.h>

#include "runtime/tool/motions/fit/fit.h"

/* Rows of a column that are written at most: more than a figure can show. */
enum { ROWS_MOST = 2000 };

static double datum_of(const struct fit *fit, const struct fit_data *data, int row, int signal) {
    return data->y[(size_t)row * (size_t)fit->signal_count + (size_t)signal];
}

static int count_of(const struct fit *fit, const struct fit_data *data, int signal) {
    int count = 0;
    for (int row = 0; row < data->rows; row++)
        count += !isnan(datum_of(fit, data, row, signal));
    return count;
}

/* The k of every k-th row: the same for all columns, so that figures compare them. */
static int choose_every(const struct fit *fit) {
    int most = 1;
    for (int i = 0; i < fit->data_count; i++)
        for (int k = 0; k < fit->signal_count; k++) {
            const int count = count_of(fit, &fit->data[i], k);
            most = count > most ? count : most;
        }
    return (most + ROWS_MOST - 1) / ROWS_MOST;
}

static void put_column(struct document *document, const struct fit *fit, const struct fit_data *data,
                       int signal, const double *model, int every) {
    double *columns = format_allocate_large(3 * ((size_t)data->rows + 1), sizeof *columns);
    double *t = columns, *y = t + data->rows, *shown = y + data->rows;
    int count = 0, number = 0;
    for (int row = 0; row < data->rows; row++) {
        const double datum = datum_of(fit, data, row, signal);
        if (isnan(datum) || number++ % every != 0)
            continue;
        t[count] = data->t[row];
        y[count] = datum;
        shown[count++] = model[(size_t)row * (size_t)fit->signal_count + (size_t)signal];
    }
    const char *unit = fit->table.units[fit->signals[signal].column];
    if (count > 0) {
        format_put_open(document, fit->signals[signal].name, '{');
        if (unit)
            format_put_text(document, "unit", unit);
        format_put_number(document, "noise", fit->signals[signal].noise);
        format_put_array(document, "t", t, count);
        format_put_array(document, "data", y, count);
        format_put_array(document, "model", shown, count);
        format_put_close(document, '}');
    }
    free(columns);
}

static void put_file(struct document *document, struct fit *fit, const struct fit_data *data, const double *u,
                     int every) {
    double *model = format_allocate_large((size_t)data->rows * (size_t)fit->signal_count, sizeof *model);
    if (fit_motion_values(fit, data, u, model) == FIT_DONE) {
        format_put_open(document, NULL, '{');
        format_put_text(document, "file", data->name);
        format_put_truth(document, "held_out", data->is_held_out);
        format_put_open(document, "columns", '{');
        for (int k = 0; k < fit->signal_count; k++)
            put_column(document, fit, data, k, model, every);
        format_put_close(document, '}');
        format_put_close(document, '}');
    }
    free(model);
}

void fit_put_series(struct document *document, struct fit *fit, const double *u) {
    const int every = choose_every(fit);
    format_put_open(document, "series", '{');
    format_put_whole(document, "every", every);
    format_put_open(document, "files", '[');
    for (int i = 0; i < fit->data_count; i++)
        put_file(document, fit, &fit->data[i], u, every);
    format_put_close(document, ']');
    format_put_close(document, '}');
}
