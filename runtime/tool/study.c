/* Error against run time: see study.h. */
#include "study.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    HALVINGS_MAX = 20, /* of the time between outputs: down to a millionth of it */
    AUTOMATIC_STEPS = 12,
    SMALLER_STEPS = 4,  /* beyond those, for a stabilisation that needs them */
    REPORT_OUTPUTS = 50 /* times at which positions are compared */
};

/* Two runs this near, as a part of the way, are one motion; this near, as a part of their size, one up to
 * rounding. */
static const double settled_part = 0.05, exhausted_part = 1e-12;

/* Runs at all steps h, h/2 ... c cost less than twice the last one each, and the reference two of the last.
 */
static const double study_cost = 2 * STABILISE_COUNT + 2;

static void put_track(const struct motion *motion, const struct study *study, double *track) {
    const struct refdyn_drive *drive = &motion->drive;
    const struct refdyn_workspace *work = drive->work;
    if (study->stride == 3)
        work->model->r(work->p, work->x, drive->t, drive->q, drive->qd, track);
    else
        memcpy(track, drive->q, (size_t)study->tracked * sizeof *track);
}

static void keep_facts(struct trial *trial, const struct motion *motion) {
    const struct refdyn_statistics *s = &motion->drive.statistics;
    trial->cpu_s = motion->cpu_s;
    trial->steps = s->steps;
    trial->evaluations = s->evaluations;
    trial->phi_max = s->phi_max;
    trial->psi_max = s->psi_max;
    trial->energy_error = refdyn_energy_error(&motion->energy);
    trial->stopped_t = motion->drive.t;
}

static double output_interval(const struct scene *scene, const struct options *options) {
    return options->every > 0 ? options->every : (options->until - scene->state.t) / REPORT_OUTPUTS;
}

/* One motion at trial->step and trial->stabilise, from a start on the programme. */
static void run_trial(struct trial *trial, struct study *study, struct scene *scene,
                      const struct options *options, struct progress *progress) {
    struct refdyn_options drive = refdyn_options_default(REFDYN_RK4);
    struct motion motion;
    drive.step = trial->step;
    drive.stabilise = trial->stabilise;
    drive.project_start = 1;
    drive.balance = 1;
    refdyn_partition_reset(&scene->work); /* every trial chooses its own, whatever ran before */
    trial->result = motion_start(&motion, scene, &drive, options->until, output_interval(scene, options));
    study->outputs = motion.outputs;
    trial->track = allocate((size_t)(motion.outputs * study->tracked), sizeof *trial->track);
    for (long i = 0; i < motion.outputs && trial->result == REFDYN_OK; i++) {
        if (i > 0)
            trial->result = motion_to(&motion, i, progress);
        put_track(&motion, study, trial->track + i * study->tracked);
    }
    keep_facts(trial, &motion);
    motion_release(&motion);
    if (trial->result != REFDYN_OK) {
        free(trial->track);
        trial->track = NULL;
    }
}

static struct trial *add_trial(struct study *study, double step, enum refdyn_stabilise stabilise) {
    struct trial *trial = &study->trials[study->count++];
    *trial = (struct trial){.step = step, .stabilise = stabilise};
    return trial;
}

static double distance(const double *a, const double *b, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum);
}

/* How far two runs are apart, and how far the second gets from its start and from the origin. */
struct comparison {
    double apart, way, size;
};

static struct comparison compare(const struct study *study, const double *a, const double *b) {
    static const double origin[3] = {0, 0, 0};
    struct comparison c = {0, 0, 0};
    for (long i = 0; i < study->outputs * study->tracked; i += study->stride) {
        double apart = distance(a + i, b + i, study->stride);
        c.apart = apart <= c.apart ? c.apart : apart; /* NaN counts as larger */
        c.way = fmax(c.way, distance(b + i, b + i % study->tracked, study->stride));
        c.size = fmax(c.size, distance(b + i, origin, study->stride));
    }
    return c;
}

/* The last trial takes the place of the one before it. */
static void replace_previous(struct study *study) {
    struct trial *previous = &study->trials[study->count - 2];
    free(previous->track);
    *previous = study->trials[--study->count];
}

/* Compares the last two trials. Before the motion settles the later one takes the place of the earlier,
 * unless they stand on the two sides of the edge of stability. Returns whether a smaller step is of use. */
static bool sort_last(struct study *study, bool *is_settled) {
    const struct trial *now = &study->trials[study->count - 1], *previous = now - 1;
    bool is_of_use = true;
    if (study->count > 1 && previous->track && now->track) {
        struct comparison c = compare(study, previous->track, now->track);
        *is_settled = *is_settled || c.apart <= settled_part * c.way;
        is_of_use = c.apart > exhausted_part * c.size;
    }
    if (study->count > 1 && !*is_settled && (previous->track || !now->track))
        replace_previous(study);
    return is_of_use;
}

/*
 * Steps halved from the largest with which the projected motion settles, that is agrees with the motion at
 * half that step, until rounding is reached or time runs out; the one before the first is listed too, when it
 * failed. The projected trials are then done. Returns how many steps.
 */
static int find_steps(struct study *study, struct scene *scene, const struct options *options, double seconds,
                      double steps[static STEPS_MAX], struct progress *progress) {
    double step = output_interval(scene, options);
    bool is_settled = false, is_of_use = true;
    for (int i = 0; i < HALVINGS_MAX && is_of_use && study->count < AUTOMATIC_STEPS && !motion_interrupted;
         i++) {
        run_trial(add_trial(study, step, REFDYN_PROJECT), study, scene, options, progress);
        is_of_use = sort_last(study, &is_settled);
        if (study->trials[study->count - 1].cpu_s * 2 * study_cost > seconds)
            is_of_use = false;
        step /= 2;
    }
    for (int i = 0; i < study->count; i++)
        steps[i] = study->trials[i].step;
    return study->count;
}

static const struct trial *last_stable(const struct study *study, enum refdyn_stabilise stabilise) {
    const struct trial *found = NULL;
    for (int i = 0; i < study->count; i++)
        if (study->trials[i].stabilise == stabilise && study->trials[i].track)
            found = &study->trials[i];
    return found;
}

/* Halves further where none of the steps was small enough for a stabilisation, until one is and the next is
 * done; a Baumgarte row needs 2 alpha h below 2.78 even where rounding is reached long before. Returns the
 * smallest step. */
static double add_smaller_steps(struct study *study, struct scene *scene, const struct options *options,
                                enum refdyn_stabilise stabilise, double step, double seconds,
                                struct progress *progress) {
    const struct trial *projected = last_stable(study, REFDYN_PROJECT);
    double cost = (projected ? projected->cpu_s : 0) * study_cost;
    bool is_missing = !last_stable(study, stabilise);
    for (int i = 0; i < SMALLER_STEPS && is_missing && !motion_interrupted && (cost *= 2) < seconds; i++) {
        is_missing = !last_stable(study, stabilise);
        run_trial(add_trial(study, step /= 2, stabilise), study, scene, options, progress);
    }
    return step;
}

static void judge(struct trial *trial, const struct study *study) {
    if (!trial->track)
        return;
    trial->error = 0;
    for (long i = 0; i < study->outputs * study->tracked; i += study->stride) {
        double error = distance(trial->track + i, study->reference.track + i, study->stride);
        if (!(error <= trial->error)) /* NaN counts as larger */
            trial->error = error;
    }
}

static double smallest(const double *steps, int count) {
    double least = steps[0];
    for (int i = 1; i < count; i++)
        if (steps[i] < least)
            least = steps[i];
    return least;
}

static enum status run_reference(struct study *study, struct scene *scene, const struct options *options,
                                 double step, struct progress *progress) {
    study->reference = (struct trial){.step = step, .stabilise = REFDYN_PROJECT};
    run_trial(&study->reference, study, scene, options, progress);
    if (study->reference.result == REFDYN_OK)
        return STATUS_DONE;
    if (study->reference.result != MOTION_INTERRUPTED)
        fprintf(stderr, "refdyn report: %s: the reference run with step %g s stopped at t = %g s: %s\n",
                study->name, step, study->reference.stopped_t, refdyn_status_text(study->reference.result));
    return STATUS_NUMBERS;
}

enum status study_run(struct study *study, struct scene *scene, const struct options *options,
                      const double *steps, int step_count, double seconds) {
    double found[STEPS_MAX] = {0};
    struct progress progress;
    const struct refdyn_model *model = scene->model;
    study->count = 0;
    study->stride = model->point_count ? 3 : 1;
    study->tracked = model->point_count ? 3 * model->point_count : model->n;
    progress_start(&progress, study->name);
    bool is_automatic = !steps;
    if (is_automatic) {
        step_count = find_steps(study, scene, options, seconds, found, &progress);
        steps = found;
    }
    double least = smallest(steps, step_count), least_tried = least;
    for (int i = 0; i < STABILISE_COUNT; i++) {
        enum refdyn_stabilise stabilise = (enum refdyn_stabilise)i;
        bool has_use = model->m > 0 || stabilise == REFDYN_NONE;
        for (int j = 0; j < step_count && !motion_interrupted && has_use; j++)
            if (!is_automatic || stabilise != REFDYN_PROJECT)
                run_trial(add_trial(study, steps[j], stabilise), study, scene, options, &progress);
        if (is_automatic && has_use)
            least_tried = fmin(
                least_tried, add_smaller_steps(study, scene, options, stabilise, least, seconds, &progress));
    }
    enum status status = run_reference(study, scene, options, least_tried / 2, &progress);
    for (int i = 0; i < study->count && status == STATUS_DONE; i++)
        judge(&study->trials[i], study);
    progress_end(&progress);
    return status;
}

void study_release(struct study *study) {
    for (int i = 0; i < study->count; i++)
        free(study->trials[i].track);
    free(study->reference.track);
    study->count = 0;
}
