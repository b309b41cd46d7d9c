/*
 * The motion of a plan: as a reference for controllers in CSV, and its limits over time for PLAN.json; and
 * the result of an earlier plan, from which --resume continues.
 *
 * The motion has the values of the plan. What differs between cases of for_all has the values of the model.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* ---- The motion ---- */

/* Columns of the motion at its outputs. */
struct rows {
    int *columns; /* (count) of the table */
    int count;
    double *values; /* (outputs x count) */
    long outputs;
};

static void rows_start(const struct plan *plan, struct rows *rows) {
    *rows = (struct rows){.columns = format_allocate((size_t)plan->table.count, sizeof *rows->columns)};
}

static void add_column(const struct plan *plan, struct rows *rows, const char *name) {
    const int found = record_table_find(&plan->table, name, strlen(name));
    for (int i = 0; i < rows->count; i++)
        if (rows->columns[i] == found)
            return;
    if (found >= 0)
        rows->columns[rows->count++] = found;
}

/* Sets the scene to the start of the motion. Returns a status of the runtime. */
static int place(struct plan *plan, const struct plan_point *point, double *end) {
    struct motions motions;
    plan_describe(plan, point->x, 1, &motions);
    for (int k = 0; k < plan->file->varied_count; k++) { /* the columns after those of the plan's values */
        const int column = plan->count + k, at = motions.columns[column].place;
        const enum refdyn_varied what = motions.columns[column].what;
        if (what == REFDYN_VARIED_PARAMETER || what == REFDYN_VARIED_INPUT)
            motions.values[column * plan->case_count] =
                (what == REFDYN_VARIED_PARAMETER ? plan->batch.p : plan->batch.x)[at];
    }
    const int status = plan_place(plan, &motions, 0);
    *end = plan_end(plan);
    return status;
}

/* Fills the rows. Returns a status of the runtime. */
static int run(struct plan *plan, const struct plan_point *point, double every, struct rows *rows) {
    struct record_table *table = &plan->table;
    struct motion motion;
    double end;
    int status = place(plan, point, &end);
    if (status == REFDYN_OK && every > 0 && (end - plan->batch.t) / every > RECORD_KEPT_MAX)
        status = REFDYN_BAD_OPTION; /* of an end that follows from the values of the plan */
    if (status != REFDYN_OK)
        return status;
    status = simulate_start(&motion, plan->scene, &plan->integration, end, every);
    rows->outputs = motion.record.outputs;
    rows->values = format_allocate_large((size_t)(rows->outputs * rows->count) + 1, sizeof *rows->values);
    table->integrator = &motion.integrator;
    for (long i = 0; i < rows->outputs && status == REFDYN_OK; i++) {
        status = i > 0 ? simulate_to(&motion, i, NULL) : REFDYN_OK;
        record_table_fill_row(table);
        for (int k = 0; k < rows->count; k++)
            rows->values[i * rows->count + k] = table->values[rows->columns[k]];
    }
    simulate_release(&motion);
    return status;
}

/* ---- The reference ---- */

enum status plan_reference_open(struct plan *plan) {
    const char *path = options_text(plan->options, "reference");
    if (!path)
        return options_has(plan->options, "every")
                   ? options_usage_error(plan->options->command, "--every: applies to --reference; add it")
                   : STATUS_DONE;
    const double every = options_number(plan->options, "every");
    const enum status status =
        every > 0 ? simulate_check_count(plan->options, "every", (plan_longest(plan) - plan->batch.t) / every,
                                         "outputs", RECORD_KEPT_MAX)
                  : STATUS_DONE;
    if (status != STATUS_DONE)
        return status;
    plan->reference = system_target_open(&plan->scene->targets, path);
    return plan->reference ? STATUS_DONE : STATUS_FAULT;
}

/* The time, coordinates, rates, accelerations, and programme forces. */
static void list_reference(const struct plan *plan, struct rows *rows) {
    static const char *const leads[] = {"", "", "", record_force_lead}, *const endings[] = {"", "_d", "_dd",
                                                                                            ""};
    const struct refdyn_model *model = plan->scene->model;
    rows_start(plan, rows);
    add_column(plan, rows, "t");
    for (int form = 0; form < 4; form++)
        for (int i = 0; i < model->n; i++)
            add_column(plan, rows,
                       format_text("%s%s%s", leads[form], model->coordinates[i].name, endings[form]));
}

enum status plan_write_reference(struct plan *plan, const struct plan_point *point) {
    struct rows rows;
    if (!plan->reference)
        return STATUS_DONE;
    list_reference(plan, &rows);
    const int status = run(plan, point, options_number(plan->options, "every"), &rows);
    FILE *out = plan->reference->file;
    for (int k = 0; k < rows.count; k++)
        fprintf(out, "%s%s", k ? "," : "", plan->table.names[rows.columns[k]]);
    for (long i = 0; i < rows.outputs * rows.count && status == REFDYN_OK; i++) {
        fputc(i % rows.count ? ',' : '\n', out);
        format_number(out, rows.values[i]);
    }
    fputc('\n', out);
    free(rows.values);
    if (status != REFDYN_OK)
        return scene_numbers_failed(plan->scene, status, plan->scene->state.t, plan->scene->q,
                                    plan->scene->qd);
    return system_target_finish(plan->reference) ? STATUS_DONE : STATUS_FAULT;
}

/* ---- Limits over time ---- */

void plan_put_motion(struct plan *plan, const struct plan_point *point, struct document *document) {
    struct rows rows;
    rows_start(plan, &rows);
    add_column(plan, &rows, "t");
    for (int i = 0; i < plan->limit_count; i++)
        add_column(plan, &rows, plan->limits[i].column);
    const bool is_done = run(plan, point, 0, &rows) == REFDYN_OK;
    double *values = format_allocate((size_t)rows.outputs + 1, sizeof *values);
    format_put_open(document, "motion", '{');
    for (int k = 0; k < rows.count && is_done; k++) {
        for (long i = 0; i < rows.outputs; i++)
            values[i] = rows.values[i * rows.count + k];
        format_put_array(document, plan->table.names[rows.columns[k]], values, (int)rows.outputs);
    }
    format_put_close(document, '}');
    free(rows.values);
}

/* ---- An earlier result ---- */

enum status plan_resume(struct plan *plan) {
    const char *path = options_text(plan->options, "output");
    struct state found = {.found_count = 0};
    if (access(path, F_OK) != 0) {
        format_complain("resume       no %s yet\n", path);
        return STATUS_DONE;
    }
    if (!scene_found_read(&found, path, &plan->scene->generation))
        return STATUS_FAULT;
    plan->resumed = format_allocate((size_t)plan->count, sizeof *plan->resumed);
    for (int k = 0; k < plan->count; k++) {
        const struct plan_value *value = &plan->values[k];
        double now = NAN;
        for (int i = 0; i < found.found_count; i++)
            if (strcmp(found.found[i].name, value->name) == 0)
                now = found.found[i].value;
        if (!(now >= value->from && now <= value->to)) {
            format_complain_line(
                path, 1,
                isnan(now)
                    ? format_text("parameters: no %s, which the plan varies; omit --resume", value->name)
                    : format_text("parameters: %s = %.15g is outside its range from %.15g to %.15g; omit "
                                  "--resume",
                                  value->name, now, value->from, value->to));
            return STATUS_FAULT;
        }
        plan->resumed[k] = (now - value->from) / (value->to - value->from);
    }
    return STATUS_DONE;
}
