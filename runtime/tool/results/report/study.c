/* Runs a study: finds its reference, then runs each method over its tolerances or steps. */
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

enum { REPEATS_MAX = 10 };

/* The two chosen methods are of different kinds, because the first three are, unless only one of these
 * completes the motion. An explicit method does not if damping is stiff. */
static const enum refdyn_method witnesses[] = {REFDYN_RK8,  REFDYN_GAUSS12, REFDYN_RODAS6P,
                                               REFDYN_RK54, REFDYN_RADAU9,  REFDYN_RODAS5P};
/* Tolerances to try; the first with which the motion is completed is used. */
static const double witness_tols[] = {1e-14, 1e-12, 1e-10, 1e-8};
/* Part of all time for each method, so that some time remains even if all fail. */
static const double witness_share = 1.0 / 8;

/* Runs whose distance is within this part of the way (report.h) are the same motion. */
static const double settled_part = 0.05;
/* Short runs are repeated for this CPU time [s]. */
static const double repeat_seconds = 0.2;
/* Part of the remaining time for one run; and the limit of a run when no time remains [s]. */
static const double run_share = 0.2, limit_least = 1e-3;

struct runs {
    struct study *study;
    const struct study_plan *plan;
    struct scene *scene;
    struct progress progress;
    struct track track, reference; /* positions of the last run and of the reference */
};

bool report_is_done(const struct method_run *trial) {
    return trial->result == REFDYN_OK;
}

bool report_has_reference(const struct study *study) {
    return study->floor <= settled_part * study->way;
}

bool report_is_settled(const struct study *study, const struct method_run *trial) {
    return report_is_done(trial) && trial->error <= settled_part * study->way;
}

/* ---- One run */

static void keep_facts(struct method_run *trial, const struct motion *motion) {
    const struct refdyn_statistics *s = &motion->integrator.statistics;
    const double fraction = simulate_fraction(motion);
    trial->cpu_s = motion->cpu_s;
    if (trial->result == RECORD_TOO_SLOW)
        trial->cpu_s /= fraction;
    trial->cause = motion->integrator.cause;
    trial->stopped_t = motion->integrator.t;
    trial->steps = s->steps;
    trial->rejected = s->rejected;
    trial->evaluations = s->evaluations;
    trial->tangents = s->tangents;
    trial->phi_max = s->phi_max;
    trial->psi_max = s->psi_max;
    trial->energy_error =
        refdyn_energy_changes(&motion->record.energy) ? refdyn_energy_error(&motion->record.energy) : NAN;
}

/* An infinite or NaN position has no distance 0 from itself. */
static bool is_finite(const struct track *track) {
    for (long i = 0; i < track->count; i++)
        if (simulate_track_distance(track, i, track, i) != 0)
            return false;
    return true;
}

/* Runs one motion like `refdyn sim`, from a start on the programme and with the energy balance. */
static void run_once(struct runs *runs, struct method_run *trial) {
    struct refdyn_options integration = refdyn_options_default(trial->method);
    struct motion motion;
    integration.tol = trial->tol;
    integration.step = trial->step;
    integration.stabilise = trial->stabilise;
    integration.project_start = 1;
    integration.balance = 1;
    trial->result = simulate_start(&motion, runs->scene, &integration, runs->plan->until, runs->plan->every);
    motion.cpu_limit = trial->cpu_limit_s;
    runs->study->outputs = motion.record.outputs;
    simulate_track_release(&runs->track);
    simulate_track_start(&runs->track, runs->scene->model, motion.record.outputs);
    for (long i = 0; i < motion.record.outputs && trial->result == REFDYN_OK; i++) {
        if (i > 0)
            trial->result = simulate_to(&motion, i, &runs->progress);
        simulate_track_add(&runs->track, &motion.integrator);
    }
    if (report_is_done(trial) && !is_finite(&runs->track))
        trial->result = REFDYN_NOT_FINITE;
    if (report_is_done(trial))
        refdyn_energy_scale(&motion.record.energy, &motion.integrator);
    keep_facts(trial, &motion);
    simulate_release(&motion);
}

/* Repeats a short run and keeps the shortest time, since disturbances only make runs longer. */
static void repeat_short(struct runs *runs, struct method_run *trial) {
    double spent = trial->cpu_s, least = trial->cpu_s;
    for (int i = 1; i < REPEATS_MAX && spent < repeat_seconds && report_is_done(trial) && !system_interrupted;
         i++) {
        struct method_run again = *trial;
        again.cpu_limit_s = 0;
        run_once(runs, &again);
        spent += again.cpu_s;
        least = report_is_done(&again) ? fmin(least, again.cpu_s) : least;
    }
    trial->cpu_s = least;
}

/* The largest distance of the last run from the reference; NaN if any of them is. */
static double distance_from_reference(const struct runs *runs) {
    double largest = 0;
    for (long i = 0; i < runs->track.count; i++) {
        const double apart = simulate_track_distance(&runs->track, i, &runs->reference, i);
        if (isnan(apart))
            return NAN;
        largest = fmax(largest, apart);
    }
    return largest;
}

/* ---- The reference */

/* Runs the method at the tightest tolerance at which it completes the motion within `seconds`. */
static bool run_witness(struct runs *runs, struct method_run *trial, enum refdyn_method method,
                        double seconds) {
    const double end = system_wall_seconds() + seconds;
    const int count = sizeof witness_tols / sizeof witness_tols[0];
    for (int i = 0; i < count && system_wall_seconds() < end && !system_interrupted; i++) {
        *trial = (struct method_run){.method = method,
                                     .stabilise = runs->scene->model->m > 0 ? REFDYN_PROJECT : REFDYN_NONE,
                                     .tol = witness_tols[i],
                                     .cpu_limit_s = end - system_wall_seconds()};
        run_once(runs, trial);
        if (report_is_done(trial))
            return true;
    }
    return false;
}

static enum status find_reference(struct runs *runs, double seconds) {
    struct study *study = runs->study;
    const int count = sizeof witnesses / sizeof witnesses[0];
    int found = 0;
    for (int i = 0; i < count && found < REFERENCES && !system_interrupted; i++) {
        struct method_run *trial = &study->references[found];
        if (!run_witness(runs, trial, witnesses[i], seconds * witness_share))
            continue;
        if (found++ > 0)
            trial->error = distance_from_reference(runs);
        else {
            runs->reference = runs->track;
            runs->track = (struct track){.count = 0};
        }
    }
    study->reference_count = found;
    study->floor = study->references[REFERENCES - 1].error;
    study->way = simulate_track_way(&runs->reference, runs->reference.count);
    if (found < REFERENCES && !system_interrupted)
        fprintf(stderr,
                "refdyn report: %s: no reference: fewer than two methods completed the motion at tight "
                "tolerances; give them more time with --seconds\n",
                study->name);
    return found == REFERENCES ? STATUS_DONE : STATUS_NUMBERS;
}

/* ---- Series */

static const struct settings *settings_of(const struct runs *runs, const struct series *series) {
    return series->is_fixed ? &runs->plan->steps : &runs->plan->tols;
}

/* Expected CPU time of the next run: it grows as much as between the last two runs. */
static double expected_time(const struct series *series) {
    if (series->count == 0)
        return 0;
    const struct method_run *last = &series->trials[series->count - 1];
    const bool has_growth = series->count > 1 && report_is_done(last) && report_is_done(last - 1);
    return last->cpu_s * (has_growth ? fmax(1, last->cpu_s / last[-1].cpu_s) : 1);
}

/* Of the steps that are too large for the motion, keeps only the last, which is next to the limit of
 * stability. */
static void forget_before_edge(const struct study *study, struct series *series) {
    struct method_run *now = &series->trials[series->count - 1];
    if (series->count > 1 && !report_is_settled(study, now) && !report_is_settled(study, now - 1)) {
        now[-1] = *now;
        series->count--;
    }
}

/* Default settings end when the error reaches the floor; steps also when rounding makes the error grow. */
static bool is_exhausted(const struct runs *runs, const struct series *series) {
    const struct study *study = runs->study;
    const struct method_run *now = &series->trials[series->count - 1];
    if (settings_of(runs, series)->are_given)
        return false;
    return series->count == SETTINGS_MAX ||
           (report_is_settled(study, now) &&
            (now->error <= study->floor ||
             (series->is_fixed && series->count > 1 && report_is_settled(study, now - 1) &&
              now->error >= now[-1].error)));
}

/* Adds the next run to the series. If it is expected to exceed the limit, it is listed without being run. */
static void run_next(struct runs *runs, struct series *series, double limit) {
    const struct settings *settings = settings_of(runs, series);
    const double setting = settings->list[series->next++], expected = expected_time(series);
    struct method_run *trial = &series->trials[series->count++];
    *trial = (struct method_run){.method = series->method,
                                 .stabilise = series->stabilise,
                                 .tol = series->is_fixed ? 0 : setting,
                                 .step = series->is_fixed ? setting : 0,
                                 .cpu_limit_s = limit,
                                 .cpu_s = expected,
                                 .stopped_t = runs->study->from,
                                 .result = RECORD_TOO_SLOW,
                                 .error = NAN};
    if (expected <= limit)
        run_once(runs, trial);
    if (report_is_done(trial))
        trial->error = distance_from_reference(runs);
    if (trial->result == RECORD_INTERRUPTED) {
        series->count--; /* an interrupted run says nothing about the method */
        return;
    }
    repeat_short(runs, trial);
    if (series->is_fixed && !settings->are_given)
        forget_before_edge(runs->study, series);
    series->is_over = series->trials[series->count - 1].result == RECORD_TOO_SLOW ||
                      series->next == settings->count || is_exhausted(runs, series);
}

/* Fixed steps are run with each stabilisation, since their stability limits differ; other methods with
 * projection. */
static void list_series(struct study *study, const struct study_plan *plan,
                        const struct refdyn_model *model) {
    const bool has_rows = model->m > 0;
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++) {
        const bool is_fixed = refdyn_options_default((enum refdyn_method)method).tol == 0;
        for (int i = 0; i < RECORD_STABILISE_COUNT && plan->methods[method] &&
                        refdyn_can_run(model, (enum refdyn_method)method);
             i++) {
            const enum refdyn_stabilise stabilise = (enum refdyn_stabilise)(RECORD_STABILISE_COUNT - 1 - i);
            if (has_rows ? is_fixed || stabilise == REFDYN_PROJECT : stabilise == REFDYN_NONE)
                study->series[study->series_count++] = (struct series){
                    .method = (enum refdyn_method)method, .stabilise = stabilise, .is_fixed = is_fixed};
        }
    }
}

/* The series whose next run is expected to be the quickest, so that a slow one does not use up the time. */
static struct series *next_series(struct study *study) {
    struct series *next = NULL;
    for (int i = 0; i < study->series_count; i++) {
        struct series *series = &study->series[i];
        if (!series->is_over && (!next || expected_time(series) < expected_time(next)))
            next = series;
    }
    return next;
}

static void run_all_series(struct runs *runs, double end) {
    struct series *series;
    while (!system_interrupted && (series = next_series(runs->study))) {
        const double left = fmax(end - system_wall_seconds(), limit_least);
        run_next(runs, series, left * run_share);
    }
}

enum status report_study_run(struct study *study, const struct study_plan *plan, struct scene *scene,
                             double seconds) {
    const struct refdyn_model *model = scene->model;
    const double end = system_wall_seconds() + seconds;
    struct runs runs = {.study = study, .plan = plan, .scene = scene};
    study->from = scene->state.t;
    study->has_points = model->point_count > 0;
    list_series(study, plan, model);
    if (!refdyn_has_tangent(model))
        fprintf(stderr,
                "refdyn report: %s: the model has no exact tangent, so implicit methods are omitted\n",
                study->name);
    system_progress_start(&runs.progress, study->name);
    enum status status = find_reference(&runs, seconds);
    if (status == STATUS_DONE)
        run_all_series(&runs, end);
    system_progress_end(&runs.progress);
    simulate_track_release(&runs.track);
    simulate_track_release(&runs.reference);
    return status;
}
