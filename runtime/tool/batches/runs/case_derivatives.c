/*
 * Derivatives of the final states of a batch: keep = { derivatives = { NAME, ... } }.
 *
 * In: a case that has ended. Out: d_COLUMN_by_NAME for each column of its final state. The thread of the case
 * computes it once more, with copies that repeat its steps.
 */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct case_derivatives {
    const struct kept *kept;
    const struct runs_layout *layout;
    struct refdyn_batch batch;
    struct record_table *tables; /* by room */
    const char **names;          /* (count) that this structure has */
    struct refdyn_variable *variables;
    struct refdyn_underivable *underivable;
    int count, rows, width;
    int *from;      /* (item_count) place in a row of results, variable by variable; -1: none */
    double *values; /* (count x rows x width) */
};

const char *runs_derivative_name(const char *column, const char *by) {
    return format_text("d_%s_by_%s", column, by);
}

static void write_columns(void *context, const struct refdyn_batch_case *one, double *values) {
    struct record_table *table = &((struct case_derivatives *)context)->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill_row(table);
    memcpy(values, table->values, (size_t)table->count * sizeof *values);
}

static void find_variables(struct case_derivatives *derivatives) {
    const struct name_list *list = derivatives->kept->derivatives;
    const size_t most = (size_t)list->count;
    derivatives->names = format_allocate(most, sizeof *derivatives->names);
    derivatives->variables = format_allocate(most, sizeof *derivatives->variables);
    derivatives->underivable = format_allocate(most, sizeof *derivatives->underivable);
    for (int i = 0; i < list->count; i++) {
        derivatives->names[derivatives->count] = list->names[i];
        derivatives->count += simulate_derivatives_find(derivatives->batch.model, list->names[i],
                                                        &derivatives->variables[derivatives->count]) == 1;
    }
}

/* Finds the place of each item of the layout in the results. */
static void find_items(struct case_derivatives *derivatives) {
    const struct runs_layout *layout = derivatives->layout;
    const struct record_table *table = &derivatives->tables[0];
    derivatives->from = format_allocate((size_t)layout->item_count, sizeof *derivatives->from);
    for (int i = 0; i < layout->item_count; i++)
        derivatives->from[i] = -1;
    for (int k = 0; k < derivatives->count; k++)
        for (int column = 0; column < table->count; column++) {
            const char *name = runs_derivative_name(table->names[column], derivatives->names[k]);
            for (int i = 0; i < layout->item_count; i++)
                if (derivatives->kept->kinds[i] == KEPT_DERIVATIVE &&
                    strcmp(layout->items[i].name, name) == 0)
                    derivatives->from[i] = k * table->count + column;
        }
}

struct case_derivatives *runs_derivatives_start(const struct kept *kept, const struct runs_layout *layout,
                                                const struct refdyn_batch *batch,
                                                struct refdyn_integrator *integrator) {
    if (kept->derivatives->count == 0)
        return NULL;
    struct case_derivatives *derivatives = format_allocate(1, sizeof *derivatives);
    const int rooms = batch->lanes ? batch->lanes->width : 1;
    *derivatives = (struct case_derivatives){.kept = kept, .layout = layout, .batch = *batch};
    derivatives->batch.threads = 1;
    derivatives->tables = format_allocate((size_t)rooms, sizeof *derivatives->tables);
    for (int i = 0; i < rooms; i++)
        simulate_table_start(&derivatives->tables[i], integrator, NULL);
    derivatives->width = derivatives->tables[0].count;
    derivatives->rows = batch->time_count + 2;
    find_variables(derivatives);
    find_items(derivatives);
    derivatives->values = format_allocate_large(
        (size_t)derivatives->count * (size_t)derivatives->rows * (size_t)derivatives->width + 1,
        sizeof *derivatives->values);
    return derivatives;
}

/* Writes into an empty reason why there is no derivative by variable k. */
static void describe_missing(const struct case_derivatives *derivatives, int k, char *reason, size_t size) {
    const struct refdyn_underivable *why = &derivatives->underivable[k];
    const char *name = derivatives->names[k];
    if (why->status == REFDYN_NO_DERIVATIVE && why->event >= 0)
        snprintf(
            reason, size,
            "no derivative by %s: at t = %.9g s the event %s happens in another order, or on one side only",
            name, why->t, derivatives->batch.model->events[why->event].name);
    else if (why->status)
        snprintf(reason, size, "no derivative by %s: from t = %.9g s on %s", name, why->t,
                 refdyn_status_text(why->status));
    else if (why->jumps > 0)
        snprintf(reason, size, "no derivative by %s: values jump at the end, where an event happens", name);
    else
        snprintf(reason, size,
                 "no derivative by %s: it has different slopes above and below this %s, as at a kink or jump "
                 "of a formula or a contact that just touches",
                 name, name);
}

void runs_derive(struct case_derivatives *derivatives, long number, double *values, char *reason,
                 size_t size) {
    struct refdyn_derivatives given = {.batch = &derivatives->batch,
                                       .number = number,
                                       .count = derivatives->count,
                                       .variables = derivatives->variables,
                                       .width = derivatives->width,
                                       .values = write_columns,
                                       .context = derivatives,
                                       .derivatives = derivatives->values,
                                       .underivable = derivatives->underivable};
    const int status = refdyn_derivatives_run(&given);
    if (status && !*reason)
        snprintf(reason, size, "derivatives: %s", refdyn_status_text(status));
    for (int i = 0; i < derivatives->layout->item_count && !status; i++) {
        const int from = derivatives->from[i];
        if (from < 0)
            continue;
        const size_t variable = (size_t)(from / derivatives->width),
                     column = (size_t)(from % derivatives->width);
        const double value =
            derivatives->values[(variable * (size_t)derivatives->rows + (size_t)given.outputs - 1) *
                                    (size_t)derivatives->width +
                                column];
        values[derivatives->layout->items[i].offset] = value;
        if (isnan(value) && !*reason)
            describe_missing(derivatives, (int)variable, reason, size);
    }
}

void runs_derivatives_release(struct case_derivatives *derivatives) {
    if (derivatives)
        free(derivatives->values);
}
