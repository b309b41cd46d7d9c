/* Findings of a study: its reference in sentences; order, stability and CPU time of each method as cells of a
 * table. */
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* Errors at which methods are compared. */
static const double levels[LEVEL_COUNT] = {1e-3, 1e-6, 1e-9};

enum { SLOPE_RUNS = 3 };                /* any two points are on a line */
static const double clear_of_floor = 3; /* errors above this multiple of the floor belong to the method, */
static const double clear_of_rounding =
    30; /* as do errors above this multiple of the least error of a series that has reached rounding */
static const double gain_least =
    0.7; /* ratio to the error at the setting before; it is 0.5 for order 1 and half the step */
static const double plateau_slope = 0.05; /* log steps over log 1/tol: below half of the 1/8 of order 8 */

const char *report_study_unit(const struct study *study) {
    return study->has_points ? "m" : "m or rad";
}

const char *report_series_name(const struct study *study, const struct series *series) {
    int same = 0;
    for (int i = 0; i < study->series_count; i++)
        same += study->series[i].method == series->method;
    return format_text("%s%s%s", refdyn_method_name((int)series->method), same > 1 ? ", " : "",
                       same > 1 ? simulate_stabilise_names[series->stabilise] : "");
}

const char *report_trial_setting(const struct method_run *trial) {
    return trial->tol > 0 ? format_text("tolerance %.3g", trial->tol)
                          : format_text("step %.3g s", trial->step);
}

const char *report_trial_outcome(const struct method_run *trial) {
    if (report_is_done(trial))
        return "done";
    if (trial->result == MOTION_TOO_SLOW)
        return format_text("stopped: too slow, about %.2g s expected but only %.2g s left", trial->cpu_s,
                           trial->cpu_limit_s);
    const bool has_cause = trial->cause > 0 && trial->cause != trial->result;
    return format_text("stopped at t = %.6g s: %s%s%s", trial->stopped_t, refdyn_status_text(trial->result),
                       has_cause ? ", after: " : "", has_cause ? refdyn_status_text(trial->cause) : "");
}

static double setting_of(const struct method_run *trial) {
    return trial->tol > 0 ? trial->tol : trial->step;
}

/* ---- The reference */

static const char *kind_of(enum refdyn_method method) {
    if (!refdyn_method_is_implicit(method))
        return "explicit";
    return method == REFDYN_GAUSS12 || method == REFDYN_RADAU9 ? "collocation" : "Rosenbrock";
}

const char *report_findings_reference(const struct study *study) {
    const struct method_run *a = &study->references[0], *b = &study->references[1];
    const char *kind = kind_of(a->method), *unit = report_study_unit(study);
    const bool is_found = report_has_reference(study);
    struct text text = {.memory = &format_memory};
    text_add(&text, "%s %s at tolerance %g and %s at tolerance %g ",
             is_found ? "Reference:" : "No reference:", refdyn_method_name((int)a->method), a->tol,
             refdyn_method_name((int)b->method), b->tol);
    if (is_found)
        text_add(&text, "agree to %.2g %s at %ld times; ", study->floor, unit, study->outputs);
    else
        text_add(&text, "differ by %.2g %s on a way of %.2g; ", study->floor, unit, study->way);
    text_add(&text, "errors are distances from the first, and errors below %.2g %s are not claimed.\n",
             study->floor, unit);
    if (strcmp(kind, kind_of(b->method)) == 0)
        text_add(
            &text,
            "Both methods of the reference are %s methods, which makes it weaker: no method of another kind "
            "completed the motion.\n",
            kind);
    return text.data;
}

/* ---- The order that errors show */

static double least_error(const struct study *study, const struct series *series) {
    double least = INFINITY;
    for (int i = 0; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i]))
            least = fmin(least, series->trials[i].error);
    return least;
}

/* Errors above this floor are errors of the formula: larger than what the reference can resolve, and than
 * rounding. A series has reached rounding if a smaller step or tolerance gained nothing near its least error.
 */
static double floor_of(const struct study *study, const struct series *series) {
    const double rounding = clear_of_rounding * least_error(study, series);
    double before = INFINITY;
    bool is_met = false;
    for (int i = 0; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i])) {
            is_met = is_met || (before < rounding && series->trials[i].error > gain_least * before);
            before = series->trials[i].error;
        }
    return fmax(clear_of_floor * study->floor, is_met ? rounding : 0);
}

/* Least-squares slope of log error over log setting, above the floor. */
static const char *tell_slope(const struct study *study, const struct series *series) {
    const double floor = floor_of(study, series);
    double x = 0, y = 0, xx = 0, xy = 0;
    int n = 0;
    for (int i = 0; i < series->count; i++) {
        const struct method_run *trial = &series->trials[i];
        if (!report_is_settled(study, trial) || !(trial->error > floor))
            continue;
        const double u = log(setting_of(trial)), v = log(trial->error);
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
        n++;
    }
    if (n < SLOPE_RUNS)
        return "-";
    return format_text("%s^%.2f (%d runs)", series->is_fixed ? "step" : "tolerance",
                       (n * xy - x * y) / (n * xx - x * x), n);
}

static const char *tell_least_error(const struct study *study, const struct series *series) {
    const double least = least_error(study, series);
    return least <= study->floor ? "floor" : isfinite(least) ? format_text("%.1e", least) : "-";
}

/* ---- What rules the step */

/* The first run near the motion after a larger step that failed or left it; 0 if there is none. */
static int edge_of_steps(const struct study *study, const struct series *series) {
    for (int i = 1; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i]) && !report_is_settled(study, &series->trials[i - 1]))
            return i;
    return 0;
}

/* While a tighter tolerance hardly needs more steps, stability limits them instead of the error. Returns the
 * last such run, 0 if there is none. */
static int end_of_plateau(const struct series *series) {
    int last = 0;
    for (int i = 1; i < series->count && last == i - 1; i++) {
        const struct method_run *now = &series->trials[i], *before = now - 1;
        const double more = log((double)now->steps / (double)before->steps);
        if (report_is_done(now) && report_is_done(before) &&
            more < plateau_slope * log(before->tol / now->tol))
            last = i;
    }
    return last;
}

static double mean_step(const struct study *study, const struct method_run *trial) {
    return (study->references[0].stopped_t - study->from) / (double)trial->steps;
}

/* For fixed steps the largest stable one. For tolerances those at which stability limits the steps, which
 * does not happen with the automatic choice and implicit methods. */
static const char *tell_stability(const struct study *study, const struct series *series) {
    const int edge = series->is_fixed ? edge_of_steps(study, series) : 0;
    if (edge > 0)
        return format_text("step %.3g s, not %.3g s", series->trials[edge].step,
                           series->trials[edge - 1].step);
    const bool has_limit =
        !series->is_fixed && series->method != REFDYN_AUTO && !refdyn_method_is_implicit(series->method);
    const int last = has_limit ? end_of_plateau(series) : 0;
    if (last > 0)
        return format_text("step %.2g s at tolerances from %g to %g", mean_step(study, &series->trials[last]),
                           series->trials[0].tol, series->trials[last].tol);
    return "-";
}

/* ---- What ended early */

/* Adds the first run from `first` on that ended early, for lack of time if is_slow, otherwise for another
 * reason, and how many further runs did. */
static void put_stops(struct text *text, const struct series *series, int first, bool is_slow) {
    const struct method_run *stopped = NULL;
    int more = -1;
    for (int i = first; i < series->count; i++) {
        const struct method_run *trial = &series->trials[i];
        if (report_is_done(trial) || (trial->result == MOTION_TOO_SLOW) != is_slow)
            continue;
        stopped = stopped ? stopped : trial;
        more++;
    }
    if (!stopped)
        return;
    text_add(text, "%s%s: %s", text->length > 0 ? "; " : "", report_trial_setting(stopped),
             is_slow ? "too slow" : report_trial_outcome(stopped));
    if (more > 0)
        text_add(text, "; and %d more", more);
}

/* The column of stability already has the steps beyond its limit. */
static const char *tell_stops(const struct study *study, const struct series *series) {
    struct text text = {.memory = &format_memory};
    put_stops(&text, series, series->is_fixed ? edge_of_steps(study, series) : 0, false);
    put_stops(&text, series, 0, true);
    return text.data ? text.data : "";
}

/* ---- CPU times */

/* CPU time of the quickest run with at most this error, INFINITY if there is none. */
static double quickest(const struct series *series, double level) {
    double cpu_s = INFINITY;
    for (int i = 0; i < series->count; i++)
        if (report_is_done(&series->trials[i]) && series->trials[i].error <= level)
            cpu_s = fmin(cpu_s, series->trials[i].cpu_s);
    return cpu_s;
}

/* CPU time, and in brackets its ratio to the quickest method except auto. */
static const char *tell_time(const struct study *study, const struct series *series, double level) {
    const double cpu_s = level >= study->floor ? quickest(series, level) : INFINITY;
    double best = INFINITY;
    for (int i = 0; i < study->series_count; i++)
        if (study->series[i].method != REFDYN_AUTO)
            best = fmin(best, quickest(&study->series[i], level));
    if (!isfinite(cpu_s))
        return "-";
    return isfinite(best) ? format_text("%.3g (%.2f)", cpu_s, cpu_s / best) : format_text("%.3g", cpu_s);
}

/* ---- The table */

const char report_findings_note[] =
    "CPU times are for the integration on one core, the shortest of repeated runs; brackets "
    "compare with the quickest method except auto. They differ from call to call. All else is the same on "
    "every machine, for the runs that there was time for.";

const char *report_findings_cell(const struct study *study, const struct series *series, int column) {
    static const struct {
        const char *head;
        const char *(*tell)(const struct study *study, const struct series *series);
    } told[] = {{"method", report_series_name},
                {"error proportional to", tell_slope},
                {"least error", tell_least_error},
                {"limit of stability", tell_stability},
                {"ended early", tell_stops}};
    const int level = column - 1, place = column == 0 ? 0 : column - LEVEL_COUNT;
    if (level < 0 || level >= LEVEL_COUNT)
        return series ? told[place].tell(study, series) : told[place].head;
    return series ? tell_time(study, series, levels[level])
                  : format_text("CPU s for %g %s", levels[level], report_study_unit(study));
}
