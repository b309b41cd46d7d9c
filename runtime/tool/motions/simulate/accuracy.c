/*
 * Finds the tolerance at which a motion has the requested accuracy.
 *
 * Each run is compared with the one before it. Errors fall with the tolerance, so two runs predict the
 * tolerance of the next one. Each run costs about half as much again as the one before, so that the total
 * cost is bounded.
 */
#include "runtime/tool/motions/simulate/simulate.h"

#include <math.h>
#include <stdlib.h>

static const double first_tol =
    10; /* first tolerance over the requested error, of which a motion's error is often a part; */
static const double first_most = 1e-4;   /* its upper bound, so that the motion is resolved */
static const double tol_least = 1e-14;   /* below it rounding is larger */
static const double fall_least = 0.1;    /* largest factor of the tolerance from run to run */
static const double fall_most = 1e-4;    /* smallest factor, since an extrapolation may be wrong */
static const double fall_unknown = 0.01; /* factor if the runs predict nothing */
/* Growth of the cost from run to run. The series is geometric, so all runs cost at most three times the last.
 */
static const double cost_growth = 1.5;
static const double allowed_part = 0.8; /* of the requested error: the estimate may be too small */
static const double aimed_part = 0.2;   /* of it: the next run shall do */

/* Bounds of the exponent by which errors fall with the tolerance; about 1 by construction. */
static const double exponent_most = 0.75, exponent_least = 0.2;
static const double worth = 2.7; /* largest ratio of the steps of all runs to those of the chosen run */

enum { FAILURES_MOST = 3 };

static void release(struct candidate *candidate) {
    simulate_trial_release(&candidate->trial);
    simulate_estimate_release(&candidate->estimate);
    if (candidate->rows)
        fclose(candidate->rows);
    *candidate = (struct candidate){.rows = NULL};
}

static void estimate(struct candidate *judged, const struct candidate *other, double share) {
    simulate_estimate_release(&judged->estimate);
    simulate_estimate_make(&judged->estimate, &judged->trial.track, &other->trial.track, share);
    judged->has_estimate = true;
}

static double error_of(const struct candidate *candidate) {
    return candidate->estimate.largest.error;
}

static bool is_good(const struct candidate *candidate, double allowed) {
    return candidate->estimate.is_trusted && error_of(candidate) <= allowed;
}

/* The factor of the tolerance for the next run. */
static double find_fall(const struct candidate *now, double accuracy, int order) {
    const double cheap = fmin(fall_least, pow(cost_growth, -order));
    if (now->trial.result != REFDYN_OK || (now->has_estimate && !now->estimate.is_trusted))
        return fall_unknown;
    if (!now->has_estimate)
        return cheap;
    const double wanted = aimed_part * accuracy / error_of(now);
    return fmax(fall_most, fmin(cheap, wanted));
}

static double tolerance_of(const struct candidate *candidate) {
    return candidate->trial.motion.integrator.options.tol;
}

static long tries_of(const struct candidate *candidate) {
    const struct refdyn_statistics *statistics = &candidate->trial.motion.integrator.statistics;
    return statistics->steps + statistics->rejected;
}

/* The exponent by which errors fall with the tolerance, from the last two differences of runs, within safe
 * bounds. */
static double find_exponent(const struct search *search, double difference) {
    if (search->difference_before == 0 || difference == 0)
        return exponent_most;
    const double seen = log(difference / search->difference_before) / log(search->fall_before);
    return fmax(exponent_least, fmin(seen, exponent_most));
}

/* Compares the last two runs. Chooses the coarser one if it is accurate enough and the total cost is
 * acceptable for it, otherwise the finer one. Returns whether one of them is accurate enough. */
static bool judge(struct search *search, struct candidate *before, struct candidate *now, double accuracy) {
    const double fall = tolerance_of(now) / tolerance_of(before);
    estimate(before, now, pow(fall, exponent_most));
    const double difference = before->estimate.difference;
    const double exponent = find_exponent(search, difference);
    estimate(before, now, pow(fall, exponent));
    estimate(now, before, pow(fall, -exponent));
    search->is_exhausted = search->difference_before > 0 && difference > search->difference_before;
    search->difference_before = difference;
    search->fall_before = fall;
    const bool is_before_good = is_good(before, allowed_part * accuracy);
    search->taken =
        is_before_good && (double)search->tries <= worth * (double)tries_of(before) ? before : now;
    search->is_reached = is_before_good || is_good(now, allowed_part * accuracy);
    return search->is_reached;
}

static void run(struct search *search, struct candidate *candidate, const struct task *task,
                const struct refdyn_options *integration) {
    *candidate = (struct candidate){.rows = tmpfile()};
    if (!candidate->rows)
        perror("refdyn: a temporary file");
    else {
        struct row_sink rows = simulate_row_sink_numbers(candidate->rows);
        simulate_trial_run(&candidate->trial, task, integration, &rows);
    }
    search->cpu_total_s += candidate->trial.motion.cpu_s;
    search->tries += tries_of(candidate);
}

/* Sets the next run: `fall` times the tolerance, and a bound on the step that shrinks with it, in case
 * something else limits the steps. Returns false at the smallest tolerance. */
static bool tighten(struct refdyn_options *integration, const struct candidate *now, double fall, int order) {
    const double tol = fmax(integration->tol * fall, tol_least);
    if (!(tol < integration->tol * fall_least * 2))
        return false;
    if (now->trial.result == REFDYN_OK)
        integration->step_max =
            now->trial.motion.integrator.statistics.step_largest * pow(tol / integration->tol, 1.0 / order);
    integration->tol = tol;
    return true;
}

enum status simulate_search_run(struct search *search, const struct task *task,
                                const struct refdyn_options *integration) {
    struct refdyn_options options = *integration;
    struct task each = *task;
    const double accuracy = options_number(task->options, "accuracy");
    const int order = refdyn_method_order(options.method);
    int failures = 0, place = 0;
    *search = (struct search){.taken = NULL};
    const double smallest_unit = fmin(
        1, task->scene->model->length); /* the tolerance applies to 1 rad and to the model's length [m] */
    options.tol = fmax(fmin(first_tol * accuracy / smallest_unit, first_most), tol_least / fall_least);
    for (struct candidate *before = NULL;;) {
        struct candidate *now = &search->candidates[place];
        run(search, now, &each, &options);
        each.on_start = NULL; /* reported once for all runs */
        if (!now->rows || now->trial.usage != STATUS_DONE)
            return now->rows ? now->trial.usage : STATUS_FAULT;
        search->last = now;
        const bool is_run = now->trial.result == REFDYN_OK;
        if (now->trial.result == MOTION_INTERRUPTED || (!is_run && ++failures == FAILURES_MOST)) {
            search->taken = NULL;
            return STATUS_NUMBERS;
        }
        if (is_run && before && judge(search, before, now, accuracy))
            return STATUS_DONE;
        if (search->is_exhausted || !tighten(&options, now, find_fall(now, accuracy, order), order))
            return STATUS_NUMBERS;
        before = is_run ? now : NULL;
        place = is_run ? 1 - place : place;
        search->taken = before;
        release(&search->candidates[place]);
    }
}

void simulate_search_release(struct search *search) {
    release(&search->candidates[0]);
    release(&search->candidates[1]);
    search->taken = NULL;
}
