/* What the runs of a study say: see findings.h. */
#include "findings.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const double finding_levels[LEVEL_COUNT] = {1e-3, 1e-6, 1e-9};

enum { SLOPE_RUNS = 3 };                  /* two points lie on a line whatever they are */
static const double clear_of_floor = 3;   /* errors so many floors large are the method's own */
static const double plateau_slope = 0.05; /* log steps over log 1/tol: below half of 1/8, that of order 8 */

const char *study_unit(const struct study *study) {
    return study->stride == 3 ? "m" : "m or rad";
}

char *series_name(const struct study *study, const struct series *series) {
    int same = 0;
    for (int i = 0; i < study->series_count; i++)
        same += study->series[i].method == series->method;
    return text_format("%s%s%s", refdyn_method_name((int)series->method), same > 1 ? ", " : "",
                       same > 1 ? stabilise_names[series->stabilise] : "");
}

char *trial_setting(const struct trial *trial) {
    return trial->tol > 0 ? text_format("tolerance %.3g", trial->tol)
                          : text_format("step %.3g s", trial->step);
}

char *trial_outcome(const struct trial *trial) {
    if (is_done(trial))
        return text_format("done");
    if (trial->result == MOTION_TOO_SLOW)
        return text_format("stopped: too slow, some %.2g s were expected and %.2g s were left for it",
                           trial->cpu_s, trial->cpu_limit_s);
    const bool has_cause = trial->cause > 0 && trial->cause != trial->result;
    return text_format("stopped at t = %.6g s: %s%s%s", trial->stopped_t, refdyn_status_text(trial->result),
                       has_cause ? ", after: " : "", has_cause ? refdyn_status_text(trial->cause) : "");
}

static double setting_of(const struct trial *trial) {
    return trial->tol > 0 ? trial->tol : trial->step;
}

double series_slope(const struct study *study, const struct series *series, int *count) {
    double x = 0, y = 0, xx = 0, xy = 0;
    *count = 0;
    for (int i = 0; i < series->count; i++) {
        const struct trial *trial = &series->trials[i];
        if (!is_settled(study, trial) || !(trial->error > clear_of_floor * study->floor))
            continue;
        const double u = log(setting_of(trial)), v = log(trial->error);
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
        ++*count;
    }
    const double n = *count;
    return *count >= SLOPE_RUNS ? (n * xy - x * y) / (n * xx - x * x) : NAN;
}

const struct trial *series_quickest(const struct study *study, const struct series *series, double level) {
    const struct trial *quickest = NULL;
    for (int i = 0; i < series->count && level >= study->floor; i++) {
        const struct trial *trial = &series->trials[i];
        if (is_done(trial) && trial->error <= level && (!quickest || trial->cpu_s < quickest->cpu_s))
            quickest = trial;
    }
    return quickest;
}

/* ---- What is the same on every machine */

static const char *kind_of(enum refdyn_method method) {
    if (!refdyn_method_is_implicit(method))
        return "explicit";
    return method == REFDYN_GAUSS12 || method == REFDYN_RADAU9 ? "collocation" : "Rosenbrock";
}

static void put_reference(FILE *out, const struct study *study) {
    const struct trial *a = &study->references[0], *b = &study->references[1];
    const char *kind = kind_of(a->method);
    const char *unit = study_unit(study);
    if (has_reference(study))
        fprintf(out, "Reference: %s at tolerance %g and %s at tolerance %g agree to %.2g %s at %ld times; ",
                refdyn_method_name((int)a->method), a->tol, refdyn_method_name((int)b->method), b->tol,
                study->floor, unit, study->outputs);
    else
        fprintf(
            out,
            "There is no reference: %s at tolerance %g and %s at tolerance %g are %.2g %s apart, on a way of "
            "%.2g; ",
            refdyn_method_name((int)a->method), a->tol, refdyn_method_name((int)b->method), b->tol,
            study->floor, unit, study->way);
    fprintf(out, "errors are distances from the first, and none below %.2g %s is claimed.\n", study->floor,
            unit);
    if (strcmp(kind, kind_of(b->method)) == 0)
        fprintf(out,
                "Both methods of the reference are %s methods, which makes it weaker: none of another kind "
                "came to the end.\n",
                kind);
}

static void put_slope(FILE *out, const struct study *study, const struct series *series, const char *name) {
    int count;
    const double slope = series_slope(study, series, &count);
    const char *what = series->is_fixed ? "step" : "tolerance";
    if (count >= SLOPE_RUNS && isfinite(slope))
        fprintf(out, "%s: error goes with %s^%.2f (least squares over %d runs).\n", name, what, slope, count);
    else
        fprintf(out,
                "%s: no slope of error over %s, fewer than three runs are near the motion and clear of the "
                "floor.\n",
                name, what);
}

/* The first run near the motion whose larger step failed or left it; 0: none. */
static int edge_of_steps(const struct study *study, const struct series *series) {
    for (int i = 1; i < series->count; i++)
        if (is_settled(study, &series->trials[i]) && !is_settled(study, &series->trials[i - 1]))
            return i;
    return 0;
}

static void put_edge_of_steps(FILE *out, const struct study *study, const struct series *series,
                              const char *name) {
    const int edge = edge_of_steps(study, series);
    if (edge == 0)
        return;
    const struct trial *now = &series->trials[edge], *before = now - 1;
    fprintf(out, "%s: stable with a step of %.3g s, not with %.3g s", name, now->step, before->step);
    if (is_done(before)) {
        fprintf(out, " (error %.2g %s).\n", before->error, study_unit(study));
        return;
    }
    char *outcome = trial_outcome(before);
    fprintf(out, " (%s).\n", outcome);
    free(outcome);
}

static double mean_step(const struct study *study, const struct trial *trial) {
    return (study->references[0].stopped_t - study->from) / (double)trial->steps;
}

/* As long as a tighter tolerance makes hardly more steps, stability rules them and not the error: the last
 * such run; 0: none. */
static int end_of_plateau(const struct series *series) {
    int last = 0;
    for (int i = 1; i < series->count && last == i - 1; i++) {
        const struct trial *now = &series->trials[i], *before = now - 1;
        const double more = log((double)now->steps / (double)before->steps);
        if (is_done(now) && is_done(before) && more < plateau_slope * log(before->tol / now->tol))
            last = i;
    }
    return last;
}

/* Of one method: what rules the steps of the automatic choice is that of the method it took. */
static void put_edge_of_tolerances(FILE *out, const struct study *study, const struct series *series,
                                   const char *name) {
    if (series->method == REFDYN_AUTO)
        return;
    const int last = refdyn_method_is_implicit(series->method) ? 0 : end_of_plateau(series);
    if (last > 0)
        fprintf(out,
                "%s: its stability limit rules the step at tolerances from %g to %g, %.2g s on average; a "
                "looser one gains nothing.\n",
                name, series->trials[0].tol, series->trials[last].tol,
                mean_step(study, &series->trials[last]));
    else if (series->count > 1)
        fprintf(out, "%s: no stability limit met at these tolerances.\n", name);
}

static void put_failures(FILE *out, const struct series *series, const char *name, int first, bool is_slow) {
    for (int i = first; i < series->count; i++) {
        const struct trial *trial = &series->trials[i];
        if (is_done(trial) || (trial->result == MOTION_TOO_SLOW) != is_slow)
            continue;
        char *setting = trial_setting(trial), *outcome = trial_outcome(trial);
        fprintf(out, "%s, %s: %s%s.\n", name, setting, outcome,
                is_slow ? "; tighter ones were not tried" : "");
        free(outcome);
        free(setting);
    }
}

char *findings_lasting(const struct study *study) {
    char *text;
    size_t size;
    FILE *out = text_stream(&text, &size);
    put_reference(out, study);
    for (int i = 0; i < study->series_count; i++) {
        const struct series *series = &study->series[i];
        char *name = series_name(study, series);
        put_slope(out, study, series, name);
        (series->is_fixed ? put_edge_of_steps : put_edge_of_tolerances)(out, study, series, name);
        put_failures(out, series, name, series->is_fixed ? edge_of_steps(study, series) : 0, false);
        free(name);
    }
    fclose(out);
    return text;
}

/* ---- What the clock said */

/* What the automatic choice took, beside the quickest of the methods that it chooses from. */
static void put_automatic(FILE *out, const struct trial *automatic, const struct trial *quickest) {
    char *setting = trial_setting(automatic);
    fprintf(out, "auto took %.3g s at %s, %.2f times as long.\n", automatic->cpu_s, setting,
            automatic->cpu_s / quickest->cpu_s);
    free(setting);
}

static void put_quickest(FILE *out, const struct study *study, double level) {
    const struct trial *quickest = NULL, *automatic = NULL;
    const struct series *of = NULL;
    for (int i = 0; i < study->series_count; i++) {
        const struct trial *trial = series_quickest(study, &study->series[i], level);
        if (trial && study->series[i].method == REFDYN_AUTO) {
            automatic = trial;
        } else if (trial && (!quickest || trial->cpu_s < quickest->cpu_s)) {
            quickest = trial;
            of = &study->series[i];
        }
    }
    fprintf(out, "An error of at most %g %s: ", level, study_unit(study));
    if (!quickest && automatic) {
        fprintf(out, "of those that were tried auto alone has it, in %.3g s of CPU time.\n",
                automatic->cpu_s);
        return;
    }
    if (!quickest) {
        fprintf(out, level < study->floor ? "the reference is not that good.\n" : "no run has it.\n");
        return;
    }
    char *name = series_name(study, of), *setting = trial_setting(quickest);
    fprintf(out, "%s is quickest, %.3g s of CPU time at %s%s", name, quickest->cpu_s, setting,
            automatic ? "; " : ".\n");
    free(setting);
    free(name);
    if (automatic)
        put_automatic(out, automatic, quickest);
}

char *findings_times(const struct study *study) {
    char *text;
    size_t size;
    FILE *out = text_stream(&text, &size);
    for (int i = 0; i < LEVEL_COUNT; i++)
        put_quickest(out, study, finding_levels[i]);
    for (int i = 0; i < study->series_count; i++) {
        char *name = series_name(study, &study->series[i]);
        put_failures(out, &study->series[i], name, 0, true);
        free(name);
    }
    fclose(out);
    return text;
}
