/*
 * Motions: the caller owns the loop, a drive takes the steps.
 *
 * Takes a workspace, options and a start; gives states at the times asked for, interpolated where a step
 * reaches beyond them and then brought onto the programme, with accelerations as the steps take them; the
 * start has those of the index partition, which is chosen there.
 */
#include "base/arithmetic.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/layout.h"
#include "base/model_check.h"
#include "private/advance.h"
#include "private/choose.h"
#include "private/collocation.h"
#include "private/kinks.h"
#include "constraints/constraints.h"
#include "linear/dense.h"
#include "private/linearise.h"
#include "private/pass.h"
#include "private/slope.h"
#include "private/step.h"

double refdyn_largest_change(const struct refdyn_drive *drive, const double *x, const double *y) {
    double largest = 0;
    for (int j = 0; j < drive->work->n; j++) {
        const double size = fabs(y ? x[j] - y[j] : x[j]) / drive->units[j];
        if (!(size <= largest))
            largest = size;
        if (isnan(size))
            break;
    }
    return largest;
}

static int larger(int a, int b) {
    return a > b ? a : b;
}

/* Doubles that the stages of a method need; of the automatic choice the most that any needs. */
static int stage_room(enum refdyn_method method, const struct refdyn_model *model) {
    const struct refdyn_method_facts facts = refdyn_method_facts(method);
    int most = 0;
    if (facts.tableau)
        return refdyn_runge_kutta_room(facts.tableau, model);
    if (facts.rosenbrock)
        return refdyn_rosenbrock_room(facts.rosenbrock, model->n);
    if (facts.collocation)
        return refdyn_collocation_room(facts.collocation, model->n);
    for (int candidate = REFDYN_AUTO + 1; candidate < REFDYN_METHOD_COUNT; candidate++)
        most = larger(most, stage_room((enum refdyn_method)candidate, model));
    return most;
}

enum { COMPLEXES = 3 }; /* of each collocation method */

/* The one list of what a drive holds; returns its bytes. */
static size_t lay_out(struct refdyn_drive *drive, const struct refdyn_model *model,
                      const struct refdyn_options *options, char *base) {
    struct room room = {base, 0};
    const int n = model->n, size = 2 * n + 1, slope = refdyn_slope_size(model);
    const int is_auto = options->method == REFDYN_AUTO;
    const struct refdyn_method_facts facts = refdyn_method_facts(options->method);
    const int has_tangent = refdyn_method_is_implicit(options->method) && refdyn_has_tangent(model);
    const int is_passing = options->singular == REFDYN_PASS, stages = stage_room(options->method, model);
    const int complexes = is_auto || facts.collocation ? COMPLEXES : 0;
    drive->qdd = room_doubles(&room, n);
    drive->lambda = room_doubles(&room, model->m);
    drive->seen = room_doubles(&room, size);
    drive->state = room_doubles(&room, size);
    drive->slope = room_doubles(&room, slope);
    drive->state_new = room_doubles(&room, size);
    drive->slope_new = room_doubles(&room, slope);
    drive->stage = room_doubles(&room, size);
    drive->side = room_doubles(&room, slope);
    drive->error = room_doubles(&room, 2 * n);
    drive->aligned = room_doubles(&room, n);
    drive->units = room_doubles(&room, n);
    drive->unpassed = room_doubles(&room, is_passing ? size + slope : 0);
    drive->breaks = room_doubles(&room, model->break_count);
    drive->switches = room_doubles(&room, 2 * model->switch_count);
    drive->stages = room_doubles(&room, is_passing ? larger(stages, stage_room(REFDYN_RK8, model)) : stages);
    refdyn_linear_lay_out(&drive->linear, model, has_tangent, has_tangent ? complexes : 0, &room);
    return room.used;
}

size_t refdyn_drive_size(const struct refdyn_model *model, const struct refdyn_options *options) {
    struct refdyn_drive drive;
    if (refdyn_model_status(model) || refdyn_options_validate(options, NULL))
        return 0;
    return lay_out(&drive, model, options, NULL);
}

int refdyn_drive_init(struct refdyn_drive *drive, struct refdyn_workspace *work,
                      const struct refdyn_options *options, void *memory, size_t size) {
    *drive = (struct refdyn_drive){.work = work, .options = *options, .method = options->method};
    const int status = refdyn_workspace_status(work);
    if (status)
        return status;
    if (refdyn_options_validate(options, NULL))
        return REFDYN_BAD_OPTION;
    if (!refdyn_can_run(work->model, options->method))
        return REFDYN_FUNCTION_MISSING;
    const size_t needed = refdyn_drive_size(work->model, options);
    if (!room_fits(memory, size, needed))
        return REFDYN_BAD_MEMORY;
    memset(memory, 0, needed);
    lay_out(drive, work->model, options, memory);
    for (int j = 0; j < work->n; j++)
        drive->units[j] = refdyn_coordinate_unit(work->model, j, options->length);
    drive->q = drive->seen;
    drive->qd = drive->seen + work->n;
    return REFDYN_OK;
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
static int meet_start(struct refdyn_drive *drive) {
    struct refdyn_workspace *work = drive->work;
    const int status = refdyn_equations(work, drive->t_right, drive->q, drive->qd);
    if (status)
        return status;
    drive->start = refdyn_residuals(work);
    drive->start_is_off = !refdyn_is_consistent(work, sqrt(DBL_EPSILON), drive->q, drive->qd);
    return drive->options.project_start ? refdyn_project_evaluated(work, drive->t_right, drive->q, drive->qd)
                                        : REFDYN_OK;
}

/* Accelerations and multipliers of the state that is seen, whose equations are in the workspace; chooses the
 * partition. */
static int solve_seen(struct refdyn_drive *drive) {
    const int status = refdyn_solve(drive->work, drive->options.stabilise, drive->qdd);
    if (!status)
        refdyn_multipliers(drive->work, drive->qdd, drive->lambda);
    return status;
}

/* The same of a state of the motion, whose row terms are in the workspace. */
static int accelerate_seen(struct refdyn_drive *drive) {
    const int n = drive->work->n;
    const int status = refdyn_slope(drive, drive->t_right, drive->seen, drive->side);
    memcpy(drive->qdd, drive->side + n, (size_t)n * sizeof(double));
    memcpy(drive->lambda, drive->side + 2 * n + 1, (size_t)drive->work->m * sizeof(double));
    return status;
}

/* Where rows do not tell them: accelerations as the step's rates change, and no multipliers; the equations
 * for the force. */
static int continue_seen(struct refdyn_drive *drive) {
    const double theta = (drive->t - drive->t_begin) / (drive->t_end - drive->t_begin);
    refdyn_runge_kutta_accelerations(drive, theta, drive->qdd);
    memset(drive->lambda, 0, (size_t)drive->work->m * sizeof(double));
    return refdyn_equations(drive->work, drive->t_right, drive->q, drive->qd);
}

/* With projections, steps begin on the programme, also where the state that is seen is off it. */
static int step_onto_programme(struct refdyn_drive *drive) {
    if (drive->options.stabilise != REFDYN_PROJECT)
        return REFDYN_OK;
    return refdyn_project_evaluated(drive->work, drive->t_right, drive->state, drive->state + drive->work->n);
}

/* Steps begin at the state that is seen: slopes of both ends are its own. Where they begin beside it, its row
 * terms are in the workspace again at the end, and its accelerations stay as they are. */
static int begin_here(struct refdyn_drive *drive) {
    struct refdyn_workspace *work = drive->work;
    const size_t bytes = (size_t)(2 * work->n + 1) * sizeof(double);
    refdyn_pass_leave(drive);
    drive->t_begin = drive->t_end = drive->t_right;
    drive->is_aligned = drive->has_tangent = 0;
    drive->last_h = drive->factored_h = 0;
    drive->tried_t = INFINITY;
    drive->interval_steps = drive->interval_done = 0;
    drive->seen[2 * work->n] = drive->work_done;
    work->partition.rank_most = work->partition.rank;
    memcpy(drive->state, drive->seen, bytes);
    int status = step_onto_programme(drive);
    memcpy(drive->state_new, drive->state, bytes);
    if (!status)
        status = refdyn_slope(drive, drive->t_right, drive->state, drive->slope);
    memcpy(drive->slope_new, drive->slope, refdyn_slope_bytes(drive));
    work->partition.rank_most = work->partition.rank;
    if (!status && memcmp(drive->state, drive->seen, bytes) != 0)
        status = refdyn_row_terms(work, drive->t_right, drive->q, drive->qd);
    return status;
}

/* Gains for the step that is proposed, before it is taken. */
static void set_gains_ahead(struct refdyn_drive *drive) {
    refdyn_set_gains(drive, drive->step_next > 0 ? drive->step_next : INFINITY);
}

/* The automatic choice begins with its explicit candidate. */
static enum refdyn_method options_method(const struct refdyn_drive *drive) {
    return drive->options.method == REFDYN_AUTO ? REFDYN_RK8 : drive->options.method;
}

int refdyn_drive_start(struct refdyn_drive *drive, double t, const double *q, const double *qd) {
    struct refdyn_workspace *work = drive->work;
    const size_t bytes = (size_t)work->n * sizeof(double);
    memcpy(drive->q, q, bytes);
    memcpy(drive->qd, qd, bytes);
    drive->work_done = 0;
    drive->t = drive->from = drive->to = t;
    drive->t_most = drive->t_final = INFINITY;
    drive->step_next = drive->options.step;
    drive->error_last = 1;
    drive->step_last = drive->refused_h = 0;
    drive->step_cap = INFINITY;
    drive->cap_growth = 1;
    drive->rate = 0;
    drive->method = options_method(drive);
    drive->is_passing = 0;
    drive->singular_t = -INFINITY;
    drive->refused = (struct refdyn_refused_passage){.tries = 0};
    drive->cause = REFDYN_OK;
    drive->statistics = (struct refdyn_statistics){.phi_row = -1, .psi_row = -1};
    drive->evaluations_before = work->evaluations;
    refdyn_prepare(work);
    set_gains_ahead(drive);
    refdyn_find_breaks(drive);
    drive->t_right = refdyn_right_of(drive, t);
    refdyn_partition_reset(work);
    int status = meet_start(drive);
    if (!status)
        status = solve_seen(drive);
    if (!status)
        refdyn_record_residuals(drive);
    if (!status)
        status = begin_here(drive);
    refdyn_choose_start(drive);
    collect_counts(drive);
    return status ? fail(drive, status, t) : REFDYN_OK;
}

int refdyn_drive_refresh(struct refdyn_drive *drive) {
    drive->work->partition.rank_most = drive->work->m;
    set_gains_ahead(drive);
    refdyn_find_breaks(drive);
    drive->t_right = refdyn_right_of(drive, drive->t);
    int status = refdyn_equations(drive->work, drive->t_right, drive->q, drive->qd);
    if (!status)
        status = solve_seen(drive);
    refdyn_choose_go_back(drive, drive->t_end - drive->t);
    if (!status)
        status = begin_here(drive);
    collect_counts(drive);
    return status ? fail(drive, status, drive->t) : REFDYN_OK;
}

void refdyn_drive_until(struct refdyn_drive *drive, double t) {
    drive->t_final = t;
}

void refdyn_drive_limit(struct refdyn_drive *drive, double t) {
    drive->t_most = t;
}

/* Onto the programme, where that says something about rates. */
static int meet_programme_seen(struct refdyn_drive *drive, double t) {
    memcpy(drive->side, drive->seen, (size_t)(2 * drive->work->n) * sizeof(double));
    const int status = refdyn_meet_programme(drive, t, drive->seen);
    if (status || !refdyn_rates_are_moved(drive, drive->side, drive->seen, 0))
        return status;
    drive->work->fault =
        (struct refdyn_fault){.row = refdyn_residuals(drive->work).psi_row, .coordinate = -1};
    return REFDYN_NO_CONVERGENCE;
}

/* The state at t, at most that of the last step's end, into `seen`. */
static int look_at(struct refdyn_drive *drive, double t) {
    struct refdyn_workspace *work = drive->work;
    const int n = work->n, is_rosenbrock = refdyn_method_facts(drive->method).rosenbrock != NULL;
    drive->t = t;
    drive->t_right = refdyn_right_of(drive, t);
    drive->is_undetermined = refdyn_pass_is_near(drive, t);
    if (t >= drive->t_end) {
        memcpy(drive->seen, drive->state_new, (size_t)(2 * n + 1) * sizeof(double));
        return REFDYN_OK;
    }
    const double theta = (t - drive->t_begin) / (drive->t_end - drive->t_begin);
    int status = refdyn_method_facts(drive->method).collocation
                     ? refdyn_collocation_interpolate(drive, theta, drive->seen)
                 : is_rosenbrock ? refdyn_rosenbrock_interpolate(drive, theta, drive->seen)
                                 : refdyn_runge_kutta_interpolate(drive, theta, drive->seen);
    if (!status && is_rosenbrock && drive->options.balance)
        status = refdyn_find_work(drive, theta, &drive->seen[2 * n]);
    if (!status && work->m > 0 && drive->options.stabilise == REFDYN_PROJECT && !drive->is_undetermined) {
        status = refdyn_row_terms(work, drive->t_right, drive->q, drive->qd);
        if (!status)
            status = meet_programme_seen(drive, drive->t_right);
    }
    return status;
}

/* The state at t with its accelerations. */
static int show(struct refdyn_drive *drive, double t) {
    int status = look_at(drive, t);
    drive->work_done = drive->seen[2 * drive->work->n];
    if (!status)
        status = refdyn_row_terms(drive->work, drive->t_right, drive->q, drive->qd);
    if (!status)
        refdyn_record_residuals(drive);
    if (!status)
        status = drive->is_undetermined ? continue_seen(drive) : accelerate_seen(drive);
    return status;
}

/* After a step that failed for good, the last accepted state is the end. */
static void go_back(struct refdyn_drive *drive) {
    const size_t bytes = (size_t)(2 * drive->work->n + 1) * sizeof(double);
    memcpy(drive->state_new, drive->state, bytes);
    memcpy(drive->slope_new, drive->slope, refdyn_slope_bytes(drive));
    drive->t_end = drive->t_begin;
}

int refdyn_drive_step(struct refdyn_drive *drive, double t_out, long steps) {
    int status = REFDYN_OK;
    if (!(isfinite(t_out) && t_out >= drive->t))
        return REFDYN_BAD_OPTION;
    for (; steps > 0 && drive->t_end < t_out && !status; steps--)
        status = refdyn_advance(drive, t_out);
    if (status) {
        if (status > 0)
            drive->cause = status;
        go_back(drive);
    }
    if (t_out == drive->t && !status)
        return REFDYN_OK;
    const int seen = show(drive, fmin(t_out, drive->t_end));
    collect_counts(drive);
    if (!status && seen)
        return fail(drive, seen, drive->t);
    return status;
}

int refdyn_drive_look(struct refdyn_drive *drive, double t) {
    if (!(refdyn_right_of(drive, t) >= drive->t_begin && t <= drive->t_end))
        return REFDYN_BAD_OPTION;
    const int status = show(drive, t);
    collect_counts(drive);
    return status ? fail(drive, status, t) : REFDYN_OK;
}

void refdyn_drive_force(struct refdyn_drive *drive, double *force) {
    const int n = drive->work->n;
    if (!drive->is_undetermined) {
        refdyn_programme_force(drive->work, drive->lambda, force);
        return;
    }
    for (int i = 0; i < n; i++)
        force[i] = dense_dot(drive->work->M + i * n, drive->qdd, n) - drive->work->f[i];
}

int refdyn_drive_to(struct refdyn_drive *drive, double t_out) {
    return refdyn_drive_step(drive, t_out, LONG_MAX);
}
