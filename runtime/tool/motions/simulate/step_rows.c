/* The attempted steps of a motion as CSV: `sim --steps`. */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

enum status simulate_steps_check(const struct options *options) {
    const char *path = options_text(options, "steps"), *method = options_text(options, "method");
    if (!path)
        return STATUS_DONE;
    const char *name = strrchr(path, '/'), *suffix = strrchr(name ? name : path, '.');
    if (suffix && strcmp(suffix, ".csv") != 0)
        return options_error(options, "steps", " %s: attempts are written as CSV only; use a name .csv",
                             path);
    if (options_number(options, "accuracy") > 0)
        return options_usage_error(options->command,
                                   "--steps excludes --accuracy, which computes several motions; use --tol");
    if (simulate_gsl_has(method))
        return options_error(options, "steps", ": %s does not report its attempts; use one of %s", method,
                             simulate_methods(false));
    return STATUS_DONE;
}

/* A value that is not known leaves its field empty. */
static void put_number(FILE *out, double value) {
    if (isfinite(value))
        format_number(out, value);
    fputc(',', out);
}

static void put_text(FILE *out, const char *text) {
    format_csv_text(out, text);
    fputc(',', out);
}

static void put_row(void *context, const struct refdyn_tried *tried) {
    const struct step_rows *rows = context;
    FILE *out = rows->file;
    put_number(out, tried->t);
    put_number(out, tried->h);
    put_text(out, refdyn_method_name((int)tried->method));
    put_text(out, refdyn_step_kind_name((int)tried->kind));
    put_number(out, tried->error);
    put_number(out, tried->order);
    put_text(out, refdyn_verdict_name((int)tried->verdict));
    put_text(out, tried->cause ? refdyn_status_text(tried->cause) : "");
    put_text(out, refdyn_obstacle_name((int)tried->obstacle));
    put_text(out, tried->event >= 0 ? rows->model->events[tried->event].name : "");
    if (tried->iterations >= 0)
        fprintf(out, "%d", tried->iterations);
    fprintf(out, ",%d\n", tried->rank);
}

void simulate_steps_start(struct step_rows *rows, FILE *file, struct refdyn_integrator *integrator) {
    *rows = (struct step_rows){file, integrator->work->model};
    fputs("t,h,method,kind,error,order,verdict,cause,obstacle,event,iterations,rank\n", file);
    refdyn_integrator_watch(integrator, put_row, rows);
}
