/*
 * Motions: the caller owns the loop, a drive takes the steps.
 *
 * Takes a workspace, options and a start; gives accepted states, landing exactly on the times asked for.
 * Fixed step: t = from + i h, so that the time gathers no error. Adaptive: step from the error of positions
 * by a PI controller (Gustafsson, ACM TOMS 17:533-554, 1991; constants of Hairer, Norsett and Wanner, Solving
 * ODEs I, IV.2), which keeps explicit methods from bouncing at their stability limit.
 */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "core.h"
#include "room.h"
#include "runge_kutta.h"

static const double step_default = 1e-3; /* [s], the step of the chapter's rigid manipulator */
static const double tol_default = 1e-6;  /* [rad]: a micrometre at 1 m */
static const double length_default = 1;  /* [m] */
static const double safety = 0.9;        /* aims below the tolerance, so that few steps are refused */
/* an estimate that is near 0 by chance says nothing about the next step */
static const double growth_most = 5;
static const double growth_least = 0.2;
static const double shrink_failed = 0.25;   /* no estimate, so a guess */
static const double error_share = 0.7;      /* exponents times the order: of this error, */
static const double error_last_share = 0.4; /* and of the one before */
static const double error_least = 1e-4;     /* of the one before, lest a lucky step blows up the next */
static const double first_share = 0.1; /* of the change tol^(1/order), which a step of that order may make */

struct refdyn_options refdyn_options_default(enum refdyn_method method) {
    const int is_fixed = method == REFDYN_RK4;
    return (struct refdyn_options){
        .method = method,
        .step = is_fixed ? step_default : 0,
        .tol = tol_default,
        .length = length_default,
        .stabilise = is_fixed ? REFDYN_BAUMGARTE : REFDYN_PROJECT,
    };
}

static int is_not_negative(double x) {
    return isfinite(x) && x >= 0;
}

static const char *wrong_option(const struct refdyn_options *options) {
    if ((int)options->method < 0 || (int)options->method >= REFDYN_METHOD_COUNT)
        return "method is unknown";
    const int is_fixed = refdyn_tableau_of(options->method)->order_error == 0;
    if (!is_not_negative(options->step) || (is_fixed && options->step == 0))
        return is_fixed ? "step must be positive" : "step must be positive, or 0 to be found";
    if (!is_not_negative(options->step_max))
        return "step_max must be positive, or 0 for none";
    if (!is_fixed && !(options->tol >= DBL_EPSILON && options->tol < 1))
        return "tol must lie between the rounding of doubles and 1";
    if (!(isfinite(options->length) && options->length > 0))
        return "length must be positive";
    if ((int)options->stabilise < REFDYN_NONE || (int)options->stabilise > REFDYN_PROJECT)
        return "stabilise must be none, baumgarte or project";
    if (options->step_limit < 0)
        return "step_limit must be positive, or 0 for none";
    return NULL;
}

int refdyn_options_validate(const struct refdyn_options *options, const char **fact) {
    const char *wrong = wrong_option(options);
    if (fact)
        *fact = wrong;
    return wrong ? REFDYN_BAD_OPTION : REFDYN_OK;
}

double refdyn_coordinate_unit(const struct refdyn_model *model, int j, double length) {
    const char *unit = model->coordinates[j].unit;
    return unit && strcmp(unit, "m") == 0 ? length : 1;
}

/* The one list of what a drive holds; returns its bytes. */
static size_t lay_out(struct refdyn_drive *drive, const struct refdyn_model *model, int stages, char *base) {
    struct room room = {base, 0};
    const int n = model->n;
    drive->state = room_doubles(&room, 2 * n + 1);
    drive->state_new = room_doubles(&room, 2 * n + 1);
    drive->stage = room_doubles(&room, 2 * n + 1);
    drive->slopes = room_doubles(&room, stages * (2 * n + 1));
    drive->error = room_doubles(&room, 2 * n);
    drive->breaks = room_doubles(&room, model->break_count);
    return room.used;
}

size_t refdyn_drive_size(const struct refdyn_model *model, const struct refdyn_options *options) {
    struct refdyn_drive drive;
    return lay_out(&drive, model, refdyn_tableau_of(options->method)->stages, NULL);
}

int refdyn_drive_init(struct refdyn_drive *drive, struct refdyn_workspace *work,
                      const struct refdyn_options *options, void *memory, size_t size) {
    *drive = (struct refdyn_drive){.work = work, .options = *options};
    if (wrong_option(options))
        return REFDYN_BAD_OPTION;
    const size_t needed = refdyn_drive_size(work->model, options);
    if (!room_fits(memory, size, needed))
        return REFDYN_BAD_MEMORY;
    memset(memory, 0, needed);
    lay_out(drive, work->model, refdyn_tableau_of(options->method)->stages, memory);
    drive->q = drive->state;
    drive->qd = drive->state + work->n;
    drive->qdd = drive->slopes + work->n;
    return REFDYN_OK;
}

/* What an accepted state adds to the statistics. */
static void record_state(struct refdyn_drive *drive) {
    struct refdyn_statistics *statistics = &drive->statistics;
    const struct refdyn_workspace *work = drive->work;
    const struct refdyn_residual now = refdyn_residuals(work);
    if (now.phi_row >= 0 && (statistics->phi_row < 0 || now.phi > statistics->phi_max)) {
        statistics->phi_max = now.phi;
        statistics->phi_row = now.phi_row;
    }
    if (now.psi_row >= 0 && (statistics->psi_row < 0 || now.psi > statistics->psi_max)) {
        statistics->psi_max = now.psi;
        statistics->psi_row = now.psi_row;
    }
}

/* Counters that others keep. */
static void collect_counts(struct refdyn_drive *drive) {
    const struct refdyn_partition *partition = &drive->work->partition;
    drive->statistics.evaluations = drive->work->evaluations - drive->evaluations_before;
    drive->statistics.partition_changes = partition->changes;
    drive->statistics.pivot_min = partition->pivot_min;
    drive->statistics.condition_max = partition->condition_max;
}

static int fail(struct refdyn_drive *drive, int cause, double t) {
    drive->cause = cause;
    drive->failed_t = t;
    return cause;
}

/* Evaluates the given state, notes how far it is off, and moves it onto the programme when that is asked for.
 */
static int meet_programme(struct refdyn_drive *drive) {
    struct refdyn_workspace *work = drive->work;
    const int status = refdyn_equations(work, drive->t, drive->q, drive->qd);
    if (status)
        return status;
    drive->start = refdyn_residuals(work);
    drive->start_is_off = !refdyn_is_consistent(work, sqrt(DBL_EPSILON), drive->q, drive->qd);
    return drive->options.project_start ? refdyn_project_evaluated(work, drive->t, drive->q, drive->qd)
                                        : REFDYN_OK;
}

/* The breaks in ascending order. */
static void find_breaks(struct refdyn_drive *drive) {
    const struct refdyn_workspace *work = drive->work;
    drive->break_next = 0;
    drive->t_limit = INFINITY;
    if (!work->model->breaks)
        return;
    work->model->breaks(work->p, work->x, drive->t, drive->q, drive->qd, drive->breaks);
    for (int i = 1; i < work->model->break_count; i++) {
        const double moved = drive->breaks[i];
        int place = i;
        for (; place > 0 && drive->breaks[place - 1] > moved; place--)
            drive->breaks[place] = drive->breaks[place - 1];
        drive->breaks[place] = moved;
    }
}

int refdyn_drive_start(struct refdyn_drive *drive, double t, const double *q, const double *qd) {
    struct refdyn_workspace *work = drive->work;
    const size_t bytes = (size_t)work->n * sizeof(double);
    memcpy(drive->q, q, bytes);
    memcpy(drive->qd, qd, bytes);
    drive->state[2 * work->n] = drive->work_done = 0;
    drive->t = drive->from = drive->to = t;
    drive->interval_steps = drive->interval_done = 0;
    drive->step_next = drive->options.step;
    drive->error_last = 1;
    drive->cause = REFDYN_OK;
    drive->statistics = (struct refdyn_statistics){.phi_row = -1, .psi_row = -1};
    drive->evaluations_before = work->evaluations;
    find_breaks(drive);
    refdyn_partition_reset(work);
    int status = meet_programme(drive);
    if (!status)
        status = refdyn_slope_evaluated(drive, t, drive->state, drive->slopes);
    collect_counts(drive);
    if (status)
        return fail(drive, status, t);
    record_state(drive);
    return REFDYN_OK;
}

int refdyn_drive_refresh(struct refdyn_drive *drive) {
    drive->state[2 * drive->work->n] = drive->work_done;
    const int status = refdyn_slope(drive, drive->t, drive->state, drive->slopes);
    collect_counts(drive);
    return status ? fail(drive, status, drive->t) : REFDYN_OK;
}

/* Projects the new state where that is asked for, and finds its slope; the last stage's room takes it. */
static int finish_step(struct refdyn_drive *drive, double t_new) {
    struct refdyn_workspace *work = drive->work;
    const struct refdyn_tableau *tableau = refdyn_tableau_of(drive->options.method);
    const int n = work->n;
    double *q = drive->state_new, *qd = drive->state_new + n;
    double *slope = drive->slopes + (tableau->stages - 1) * (2 * n + 1);
    const int is_known = tableau->is_last_new && t_new < drive->t_limit;
    int status = is_known ? REFDYN_OK : refdyn_equations(work, t_new, q, qd);
    const long evaluations = work->evaluations;
    if (!status && drive->options.stabilise == REFDYN_PROJECT)
        status = refdyn_project_evaluated(work, t_new, q, qd);
    if (!status && !(is_known && work->evaluations == evaluations))
        status = refdyn_slope_evaluated(drive, t_new, drive->state_new, slope);
    if (status)
        drive->failed_t = t_new;
    return status;
}

static void accept(struct refdyn_drive *drive, double t_new, double h) {
    const int size = 2 * drive->work->n + 1;
    const int last = refdyn_tableau_of(drive->options.method)->stages - 1;
    struct refdyn_statistics *statistics = &drive->statistics;
    memcpy(drive->state, drive->state_new, (size_t)size * sizeof(double));
    memcpy(drive->slopes, drive->slopes + last * size, (size_t)size * sizeof(double));
    drive->work_done = drive->state[size - 1];
    drive->t = t_new;
    statistics->step_smallest = statistics->steps ? fmin(statistics->step_smallest, h) : h;
    statistics->step_largest = fmax(statistics->step_largest, h);
    statistics->steps++;
    record_state(drive);
}

/* One step tried, from drive->t to t_new. */
static int try_step(struct refdyn_drive *drive, double h, double t_new) {
    const int status = refdyn_runge_kutta_step(drive, h);
    return status ? status : finish_step(drive, t_new);
}

static int limit_reached(const struct refdyn_drive *drive) {
    const struct refdyn_statistics *statistics = &drive->statistics;
    return drive->options.step_limit > 0 &&
           statistics->steps + statistics->rejected >= drive->options.step_limit;
}

/* Smallest step that still moves the time by a few units in its last place. */
static double step_least(const struct refdyn_drive *drive, double t_out) {
    return 4 * DBL_EPSILON * fmax(fabs(drive->t), fabs(t_out));
}

/* Cuts [t, t_out] into equal steps; a part of 1e-8 of a step more than asked for does not make one more. */
static int plan_interval(struct refdyn_drive *drive, double t_out) {
    const double count = ceil((t_out - drive->t) / drive->options.step * (1 - sqrt(DBL_EPSILON)));
    if (!(count < (double)LONG_MAX) || drive->options.step < step_least(drive, t_out))
        return REFDYN_STEP_TOO_SMALL;
    drive->from = drive->t;
    drive->to = t_out;
    drive->interval_steps = count > 1 ? (long)count : 1;
    drive->interval_done = 0;
    return REFDYN_OK;
}

static int step_fixed(struct refdyn_drive *drive, double t_out) {
    if (drive->interval_done == drive->interval_steps || drive->to != t_out) {
        const int status = plan_interval(drive, t_out);
        if (status)
            return fail(drive, status, drive->t);
    }
    const double h = (drive->to - drive->from) / (double)drive->interval_steps;
    const long next = drive->interval_done + 1;
    const double t_new = next == drive->interval_steps ? drive->to : drive->from + (double)next * h;
    const int status = try_step(drive, h, t_new);
    if (status)
        return fail(drive, status, drive->failed_t);
    drive->interval_done = next;
    accept(drive, t_new, h);
    return REFDYN_OK;
}

/* Largest error of a position, and of a velocity times h, over tol: max(|e_q|, h |e_v|) / (unit tol). */
static double error_norm(const struct refdyn_drive *drive, double h) {
    const int n = drive->work->n;
    double largest = 0;
    for (int j = 0; j < n; j++) {
        const double unit = refdyn_coordinate_unit(drive->work->model, j, drive->options.length);
        const double off = fmax(fabs(drive->error[j]), h * fabs(drive->error[n + j])) / unit;
        if (!(off <= largest))
            largest = off;
    }
    return largest / drive->options.tol;
}

/* First step: velocities and accelerations move no coordinate by more than a small part of tol^(1/order). */
static double find_first_step(const struct refdyn_drive *drive, double interval) {
    const int n = drive->work->n, order = refdyn_tableau_of(drive->options.method)->order;
    const double change = first_share * pow(drive->options.tol, 1.0 / order);
    double h = interval;
    for (int j = 0; j < n; j++) {
        const double unit = refdyn_coordinate_unit(drive->work->model, j, drive->options.length);
        const double speed = fabs(drive->qd[j]) / unit, acceleration = fabs(drive->qdd[j]) / unit;
        if (h * speed > change)
            h = change / speed;
        if (h * h / 2 * acceleration > change)
            h = sqrt(2 * change / acceleration);
    }
    return h;
}

/* The step to try: the proposed one, shortened so that it lands on t_out or leaves more than half of itself.
 */
static double clip_step(const struct refdyn_drive *drive, double t_out) {
    const double left = t_out - drive->t, h = drive->step_next;
    if (h >= left * (1 - sqrt(DBL_EPSILON)))
        return left;
    return 2 * h > left ? left / 2 : h;
}

static double bounded(double x, double least, double most) {
    return x < least ? least : x > most ? most : x;
}

static void propose_after_accepted(struct refdyn_drive *drive, double h, double error) {
    const double order = refdyn_tableau_of(drive->options.method)->order;
    const double factor = safety * pow(fmax(error, DBL_MIN), -error_share / order) *
                          pow(drive->error_last, error_last_share / order);
    const double proposed = h * bounded(factor, growth_least, growth_most);
    /* a step that was cut short to land says nothing against the longer one */
    drive->step_next = h < drive->step_next ? fmax(proposed, drive->step_next) : proposed;
    if (drive->options.step_max > 0)
        drive->step_next = fmin(drive->step_next, drive->options.step_max);
    drive->error_last = fmax(error, error_least);
}

static double factor_after_refused(const struct refdyn_drive *drive, double error) {
    const double order = refdyn_tableau_of(drive->options.method)->order;
    return isfinite(error) ? bounded(safety * pow(error, -1 / order), growth_least, safety) : shrink_failed;
}

/* Tries one step; 1: accepted, 0: refused and step_next is smaller. */
static int try_adaptive(struct refdyn_drive *drive, double h, double t_new) {
    double error = INFINITY;
    int status = refdyn_runge_kutta_step(drive, h);
    if (!status) {
        error = error_norm(drive, h);
        if (error <= 1)
            status = finish_step(drive, t_new);
    }
    if (status) {
        drive->cause = status;
        error = INFINITY;
    }
    if (error <= 1) {
        propose_after_accepted(drive, h, error);
        accept(drive, t_new, h);
        drive->cause = REFDYN_OK;
        return 1;
    }
    drive->statistics.rejected++;
    drive->step_next = h * factor_after_refused(drive, error);
    return 0;
}

static int step_adaptive(struct refdyn_drive *drive, double t_out) {
    if (drive->step_next <= 0)
        drive->step_next = find_first_step(drive, t_out - drive->t);
    for (;;) {
        if (limit_reached(drive))
            return REFDYN_TOO_MANY_STEPS;
        if (!(drive->step_next >= step_least(drive, t_out)))
            return REFDYN_STEP_TOO_SMALL;
        const double h = clip_step(drive, t_out);
        const double t_new = h == t_out - drive->t ? t_out : drive->t + h;
        if (try_adaptive(drive, h, t_new))
            return REFDYN_OK;
    }
}

/* Where the next steps have to end: at t_out, or at a break before it. */
static double next_stop(struct refdyn_drive *drive, double t_out) {
    const double least = step_least(drive, t_out);
    const int count = drive->work->model->break_count;
    while (drive->break_next < count && !(drive->breaks[drive->break_next] > drive->t + least))
        drive->break_next++;
    const double ahead = drive->break_next < count ? drive->breaks[drive->break_next] : INFINITY;
    drive->t_limit = isfinite(ahead) ? nextafter(ahead, drive->t) : INFINITY;
    return ahead < t_out - least ? ahead : t_out;
}

int refdyn_drive_step(struct refdyn_drive *drive, double t_out) {
    if (!(isfinite(t_out) && t_out >= drive->t))
        return REFDYN_BAD_OPTION;
    if (t_out == drive->t)
        return REFDYN_OK;
    if (limit_reached(drive))
        return REFDYN_TOO_MANY_STEPS;
    const int is_fixed = refdyn_tableau_of(drive->options.method)->order_error == 0;
    const double stop = next_stop(drive, t_out);
    const int status = is_fixed ? step_fixed(drive, stop) : step_adaptive(drive, stop);
    collect_counts(drive);
    return status;
}

int refdyn_drive_to(struct refdyn_drive *drive, double t_out) {
    int status;
    do
        status = refdyn_drive_step(drive, t_out);
    while (!status && drive->t < t_out);
    return status;
}
