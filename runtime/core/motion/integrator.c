/*
 * Motions: the caller owns the loop, an integrator takes the steps.
 *
 * In: a workspace, options and a start. Out: states at the times asked for. Where a step reaches beyond them
 * they are interpolated and then brought onto the programme. Their accelerations are computed as in the
 * steps; at the end of a step they are those of the step. At the start the index partition is chosen, and
 * provides them. accepted_step.c takes a step.
 */
#include "runtime/core/base/core.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"
#include "runtime/core/methods/methods.h"
#include "runtime/core/motion/motion.h"

/* A start that is moved farther onto the programme is reported [rad, length]: rows bend along such a way, so
 * that another state may be nearer. */
static const double far_moved = 0.1;

/* ---- Memory ---- */

/* May a motion with these options take steps of this method? */
static int may_use(const struct refdyn_options *options, enum refdyn_method method) {
    return options->method == REFDYN_AUTO || options->method == method ||
           (options->singular == REFDYN_PASS && method == REFDYN_RK8);
}

/* The most that any usable method needs: doubles of its memory, complex matrices. */
struct needs {
    int memory, complexes;
};

static struct needs find_needs(const struct refdyn_model *model, const struct refdyn_options *options) {
    struct needs most = {0, 0};
    for (int number = REFDYN_AUTO + 1; number < REFDYN_METHOD_COUNT; number++) {
        const struct refdyn_method_definition *method = refdyn_method_definition((enum refdyn_method)number);
        if (!may_use(options, (enum refdyn_method)number))
            continue;
        const int memory = method->kind->memory_size(method, model);
        most.memory = memory > most.memory ? memory : most.memory;
        most.complexes = method->kind->complexes > most.complexes ? method->kind->complexes : most.complexes;
    }
    const int fading = refdyn_fading_memory_size(model);
    most.memory = fading > most.memory ? fading : most.memory;
    return most;
}

static struct refdyn_motion *lay_out_motion(struct layout *layout) {
    const size_t size = sizeof(double);
    return (struct refdyn_motion *)(void *)layout_doubles(
        layout, (int)((sizeof(struct refdyn_motion) + size - 1) / size));
}

/* All memory of an integrator; returns its bytes. */
static size_t lay_out(struct refdyn_integrator *integrator, const struct refdyn_model *model,
                      const struct refdyn_options *options, char *base) {
    struct layout layout = {base, 0};
    struct refdyn_motion counted, *motion = lay_out_motion(&layout);
    const struct needs needs = find_needs(model, options);
    const int has_tangent = refdyn_method_is_implicit(options->method) && refdyn_has_tangent(model);
    motion = motion ? motion : &counted;
    integrator->motion = motion;
    integrator->qdd = layout_doubles(&layout, model->n);
    integrator->lambda = layout_doubles(&layout, model->m);
    integrator->q = layout_doubles(&layout, 2 * model->n + 1);
    integrator->start_moved = layout_doubles(&layout, model->n);
    refdyn_step_lay_out(&motion->step, model, needs.memory, &layout);
    refdyn_parameters_lay_out(&motion->parameters, model, &layout);
    refdyn_programme_lay_out(&motion->programme, model, &layout);
    refdyn_crossing_lay_out(&motion->crossing, model, &layout);
    refdyn_rows_lay_out(&motion->before, model, &layout);
    refdyn_time_events_lay_out(&motion->time_events, model, &layout);
    refdyn_state_events_lay_out(&motion->state_events, model, &layout);
    refdyn_kinks_lay_out(&motion->kink_guard, model, &layout);
    refdyn_after_lay_out(&motion->after, model, &layout);
    refdyn_repetition_lay_out(&motion->repetition, model, &layout);
    refdyn_linear_lay_out(&motion->linear, model, has_tangent, has_tangent ? needs.complexes : 0, &layout);
    return layout.used;
}

size_t refdyn_integrator_size(const struct refdyn_model *model, const struct refdyn_options *options) {
    struct refdyn_integrator integrator;
    if (refdyn_model_status(model) || refdyn_options_validate(options, NULL))
        return 0;
    return lay_out(&integrator, model, options, NULL);
}

/* Sets what does not change from motion to motion. */
static void connect(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    const struct refdyn_options *options = &integrator->options;
    integrator->qd = integrator->q + work->n;
    integrator->solves_by_joints = motion->linear.is_chain;
    motion->work = work;
    motion->options = *options;
    integrator->contact_count = motion->state_events.contacts.count;
    integrator->contact_mode = motion->state_events.contacts.mode;
    integrator->contact_since = motion->state_events.contacts.since;
    integrator->contact_left = motion->state_events.contacts.left;
    motion->step.linear = &motion->linear;
    motion->step.tolerance = options->tol;
    motion->step.evaluation = (struct refdyn_evaluation){work, options->stabilise, options->balance, 0, 0};
    for (int j = 0; j < work->n; j++)
        motion->step.units[j] = refdyn_coordinate_unit(work->model, j, options->length);
}

int refdyn_integrator_init(struct refdyn_integrator *integrator, struct refdyn_workspace *work,
                           const struct refdyn_options *options, void *memory, size_t size) {
    if (!integrator)
        return REFDYN_BAD_MEMORY;
    *integrator = (struct refdyn_integrator){.seal = REFDYN_SEAL, .work = work};
    int status = refdyn_workspace_status(work);
    if (!status)
        status = refdyn_options_validate(options, NULL);
    if (status)
        return status;
    integrator->options = *options;
    if (!refdyn_can_run(work->model, options->method))
        return REFDYN_FUNCTION_MISSING;
    const size_t needed = refdyn_integrator_size(work->model, options);
    status = layout_status(memory, size, needed);
    if (status)
        return status;
    memset(memory, 0, needed);
    lay_out(integrator, work->model, options, memory);
    connect(integrator);
    return REFDYN_OK;
}

/* ---- What the caller reads ---- */

/* Begins a call: from here to `leave` the workspace has the motion's parameters. */
static struct refdyn_motion *enter(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    refdyn_parameters_enter(&motion->parameters, motion->work);
    return motion;
}

/* Ends a call, with this status at t: copies what the caller reads. */
static int leave(struct refdyn_integrator *integrator, int status, double t) {
    struct refdyn_motion *motion = integrator->motion;
    refdyn_parameters_leave(&motion->parameters, motion->work);
    if (status)
        refdyn_motion_failed(motion, status, t);
    refdyn_statistics_collect(&motion->statistics, motion->work, &motion->linear.counts,
                              motion->work->evaluations - motion->evaluations_before);
    integrator->statistics = motion->statistics;
    integrator->forces_are_unique = motion->state_events.contacts.are_unique;
    integrator->method = motion->step.number;
    integrator->choice = motion->automatic.found;
    integrator->refused = motion->crossing.refused;
    integrator->cause = motion->failure.cause;
    integrator->failed_t = motion->failure.t;
    integrator->t_begin = motion->step.t_from;
    integrator->t_end = refdyn_step_seen_end(&motion->step);
    return status;
}

/* ---- Start ---- */

/* Returns NOT_FINITE, with the coordinate, if a value that the caller has set is infinite or NaN. */
static int check_state(const struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    for (int j = 0; j < work->n; j++)
        if (!isfinite(integrator->q[j]) || !isfinite(integrator->qd[j])) {
            work->fault = (struct refdyn_fault){.row = -1, .coordinate = j};
            return REFDYN_NOT_FINITE;
        }
    return REFDYN_OK;
}

/* Evaluates the given state, records how far it is off, and moves it onto the programme if the options ask
 * for it. */
static int meet_start(struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    const double t = integrator->t_right;
    const int status = refdyn_equations(work, t, integrator->q, integrator->qd);
    if (status)
        return status;
    integrator->start = refdyn_residuals(work);
    integrator->start_is_off = !refdyn_is_consistent(work, sqrt(DBL_EPSILON), integrator->q, integrator->qd);
    return integrator->options.project_start ? refdyn_project_start(work, t, integrator->q, integrator->qd)
                                             : REFDYN_OK;
}

/* Accelerations and multipliers of the state that the caller sees, whose equations are in the workspace.
 * Chooses the partition. */
static int solve_seen(struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    const int status = refdyn_solve(work, integrator->options.stabilise, integrator->qdd);
    if (status)
        return status;
    integrator->motion->step.evaluation.has_no_inverse =
        !refdyn_refine(work, integrator->t_right, integrator->q, integrator->qd,
                       integrator->options.stabilise, integrator->qdd);
    refdyn_multipliers(work, integrator->qdd, integrator->lambda);
    return REFDYN_OK;
}

/* If the caller has made rows jump, the rates jump with them. With projections, steps begin on the programme,
 * even if the state that the caller sees is off it. */
static int place_step(struct refdyn_integrator *integrator) {
    struct refdyn_step *step = &integrator->motion->step;
    const double t = integrator->t_right;
    integrator->q[2 * step->n] = integrator->work_done;
    refdyn_step_place(step, integrator->t, t, integrator->q);
    int status = refdyn_rows_meet_seen(integrator->motion);
    if (!status && integrator->options.stabilise == REFDYN_PROJECT)
        status = refdyn_project_start(integrator->work, t, step->state, step->state + step->n);
    memcpy(step->state_new, step->state, refdyn_state_bytes(step));
    if (status || !(refdyn_step_largest_change(step, step->state, integrator->q) > far_moved))
        return status;
    return refdyn_partition_renew(integrator->work); /* off the programme, dependent rows look independent */
}

/* Steps begin at the state that the caller sees, whose rates are those of both ends. If they begin off it,
 * the workspace has its row terms again afterwards, and its accelerations stay as they are. */
static int begin_here(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    struct refdyn_step *step = &motion->step;
    refdyn_rows_change_at_end(motion, 0);
    refdyn_special_step_end(motion);
    refdyn_motion_break_off(motion, 0);
    refdyn_partition_bound_rank(work, work->partition.rank);
    int status = place_step(integrator);
    if (!status)
        status = refdyn_rates(&step->evaluation, integrator->t_right, step->state, step->rates);
    memcpy(step->rates_new, step->rates, refdyn_rates_bytes(step));
    refdyn_partition_bound_rank(work, work->partition.rank);
    if (!status && memcmp(step->state, integrator->q, refdyn_state_bytes(step)) != 0)
        status = refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
    return status;
}

/* Copies the caller's parameters, with the gains of the proposed step, and computes the time events for them.
 */
static void take_parameters(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    const double next = motion->control.next;
    refdyn_parameters_take(&motion->parameters, motion->work);
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options,
                                next > 0 ? next : INFINITY);
    refdyn_time_events_take(&motion->time_events, motion->work, integrator->t, integrator->q, integrator->qd);
    refdyn_step_limit(&motion->step, INFINITY);
    integrator->t_right = refdyn_time_events_right_of(&motion->time_events, integrator->t);
}

/* A motion begins, and forgets the one before it. */
static void clear(struct refdyn_motion *motion, const struct refdyn_options *options) {
    motion->options = *options;
    const enum refdyn_method method = motion->options.method;
    refdyn_repetition_clear(motion);
    refdyn_kinks_clear(motion);
    refdyn_after_clear(&motion->after);
    motion->step.settled = refdyn_settled_tolerance(motion->options.tol);
    motion->state_events.looks = motion->options.event_looks > 0 ? motion->options.event_looks : 1;
    motion->t_most = motion->t_final = INFINITY;
    motion->evaluations_before = motion->work->evaluations;
    refdyn_statistics_start(&motion->statistics);
    refdyn_rows_forget_seen(motion);
    refdyn_motion_failed(motion, REFDYN_OK, motion->failure.t);
    refdyn_linear_reset(&motion->linear);
    refdyn_control_begin(&motion->control, motion->options.step);
    refdyn_obstacles_start(motion);
    refdyn_idle_start(motion);
    refdyn_step_guide(&motion->step, NULL);
    refdyn_method_use(method == REFDYN_AUTO ? REFDYN_RK8 : method, &motion->step);
    refdyn_partition_reset(motion->work);
}

/* Rows of contacts that rest from the start act in the values that the caller sees there. */
static int meet_contacts(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    int is_changed;
    refdyn_step_place(&motion->step, integrator->t, integrator->t_right, integrator->q);
    int status = refdyn_contact_transitions_start(motion, &is_changed);
    if (!status && is_changed)
        take_parameters(integrator);
    if (!status && motion->state_events.contacts.count > 0)
        status = refdyn_equations(integrator->work, integrator->t_right, integrator->q, integrator->qd);
    return status;
}

/* start_moved: the given positions; then what projections have added to them. */
static void note_moves(struct refdyn_integrator *integrator, int has_failed) {
    const struct refdyn_step *step = &integrator->motion->step;
    double *moved = integrator->start_moved;
    integrator->start_is_far = 0;
    for (int j = 0; j < step->n; j++) {
        moved[j] = has_failed ? 0 : step->state[j] - moved[j];
        integrator->start_is_far |= fabs(moved[j]) > far_moved * step->units[j];
    }
}

/* Moves a start on a jump to one side of it. The workspace keeps the equations of the state that the caller
 * sees. */
static int meet_jumps(struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    const long before = work->evaluations;
    const int status = refdyn_sliding_start(integrator->motion);
    return status || work->evaluations == before
               ? status
               : refdyn_equations(work, integrator->t_right, integrator->q, integrator->qd);
}

static int start(struct refdyn_integrator *integrator) {
    int status = check_state(integrator);
    if (!status)
        status = refdyn_check_parameters(integrator->work);
    if (!status)
        status = meet_start(integrator);
    if (!status)
        status = meet_contacts(integrator);
    if (!status)
        status = solve_seen(integrator);
    if (!status)
        refdyn_statistics_residuals(&integrator->motion->statistics, integrator->work);
    if (!status)
        status = begin_here(integrator);
    if (!status)
        status = refdyn_state_events_start(&integrator->motion->state_events, &integrator->motion->step,
                                           integrator->t);
    if (!status)
        status = meet_jumps(integrator);
    refdyn_automatic_start(integrator->motion);
    if (!status)
        refdyn_rate_errors_start(integrator->motion);
    return status;
}

int refdyn_integrator_start(struct refdyn_integrator *integrator, double t, const double *q,
                            const double *qd) {
    if (!refdyn_integrator_is_laid_out(integrator))
        return REFDYN_NOT_STARTED;
    integrator->motion->is_started = 0;
    if (!q || !qd)
        return REFDYN_BAD_MEMORY;
    if (!isfinite(t))
        return REFDYN_BAD_TIME;
    const size_t bytes = (size_t)integrator->work->n * sizeof *q;
    memcpy(integrator->q, q, bytes);
    memcpy(integrator->qd, qd, bytes);
    integrator->work_done = 0;
    integrator->t = t;
    integrator->is_undetermined = 0;
    integrator->start_is_off = 0;
    integrator->event_count = 0;
    refdyn_contacts_clear(&integrator->motion->state_events.contacts, integrator->work,
                          integrator->options.tol > 0 ? integrator->options.tol : sqrt(DBL_EPSILON));
    refdyn_prepare(integrator->work);
    memcpy(integrator->start_moved, q, bytes);
    clear(enter(integrator), &integrator->options);
    take_parameters(integrator);
    const int status = start(integrator);
    note_moves(integrator, status != REFDYN_OK);
    integrator->motion->is_started = status == REFDYN_OK;
    return leave(integrator, status, t);
}

/* Returns the state that the caller saw before it changed the values. */
static const double *find_seen(struct refdyn_motion *motion, double t) {
    struct refdyn_step *step = &motion->step;
    double *state = motion->state_events.room;
    if (!refdyn_step_is_inside(step, t))
        return step->state_new;
    if (motion->before.are_seen)
        return motion->before.state;
    return step->method->kind->interpolate(step, refdyn_step_theta(step, t), state) ? step->state_new : state;
}

/* The caller has changed values at the state that it sees, and the last step counts only until there. The
 * values of events at this state are computed with the inputs and parameters before the change. */
static void stop_here(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    double *changed = work->x;
    refdyn_idle_start(motion);
    if (refdyn_step_is_inside(&motion->step, integrator->t)) /* the next step becomes no longer than it */
        refdyn_control_bound(&motion->control, motion->control.last);
    if (motion->state_events.count == 0)
        return;
    work->x = refdyn_parameters_inputs(&motion->parameters, work->model);
    refdyn_state_events_stop(&motion->state_events, &motion->step, integrator->t,
                             find_seen(motion, integrator->t));
    work->x = changed;
}

/* Events that are due at the state that the caller sees stay due if the change permits it. The workspace has
 * the row terms of that state again afterwards. */
static int keep_due(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = integrator->work;
    const long before = work->row_evaluations;
    refdyn_state_events_go_on(&motion->state_events, &motion->step);
    return work->row_evaluations == before
               ? REFDYN_OK
               : refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
}

/* Where the caller has changed the load, contacts open at once. */
static int open_contacts(struct refdyn_integrator *integrator) {
    struct refdyn_step *step = &integrator->motion->step;
    const int resting = integrator->motion->state_events.contacts.resting;
    int status = refdyn_event_actions_open_contacts(integrator->motion);
    if (status || integrator->motion->state_events.contacts.resting == resting)
        return status;
    memcpy(integrator->q, step->state, refdyn_state_bytes(step));
    status = refdyn_equations(integrator->work, integrator->t_right, integrator->q, integrator->qd);
    return status ? status : solve_seen(integrator);
}

int refdyn_integrator_refresh(struct refdyn_integrator *integrator) {
    int status = refdyn_integrator_status(integrator);
    if (status)
        return status;
    enter(integrator);
    stop_here(integrator);
    refdyn_partition_bound_rank(integrator->work, integrator->work->m);
    take_parameters(integrator);
    status = check_state(integrator);
    if (!status)
        status = refdyn_check_parameters(integrator->work);
    if (!status)
        status = refdyn_equations(integrator->work, integrator->t_right, integrator->q, integrator->qd);
    if (!status)
        status = solve_seen(integrator);
    if (!status)
        status = begin_here(integrator);
    if (!status)
        status = keep_due(integrator);
    if (!status)
        status = open_contacts(integrator);
    return leave(integrator, status, integrator->t);
}

int refdyn_integrator_notice(struct refdyn_integrator *integrator) {
    return refdyn_parameters_have_changed(&integrator->motion->parameters, integrator->work)
               ? refdyn_integrator_refresh(integrator)
               : REFDYN_OK;
}

int refdyn_integrator_exchange_model(struct refdyn_integrator *integrator, const struct refdyn_model *model) {
    const int status = refdyn_integrator_is_laid_out(integrator)
                           ? refdyn_exchange_model(integrator->work, model)
                           : REFDYN_NOT_STARTED;
    if (!status)
        integrator->motion->linear.chain.model = model;
    return status;
}

int refdyn_integrator_until(struct refdyn_integrator *integrator, double t) {
    const int status = isnan(t) ? REFDYN_BAD_TIME : REFDYN_OK;
    if (refdyn_integrator_status(integrator))
        return REFDYN_NOT_STARTED;
    if (!status)
        integrator->motion->t_final = t;
    return status;
}

int refdyn_integrator_limit(struct refdyn_integrator *integrator, double t) {
    const int status = isnan(t) ? REFDYN_BAD_TIME : REFDYN_OK;
    if (refdyn_integrator_status(integrator))
        return REFDYN_NOT_STARTED;
    if (!status)
        integrator->motion->t_most = t;
    return status;
}

/* ---- States at outputs ---- */

/* Does the caller see the end of the last step, whose rates are known? */
static int is_complete_end(const struct refdyn_integrator *integrator) {
    const struct refdyn_step *step = &integrator->motion->step;
    return integrator->t >= step->t_end && integrator->t_right == step->t_complete;
}

/* Row terms of the state that the caller sees, in the workspace. */
static int find_row_terms_seen(const struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    return is_complete_end(integrator) && integrator->motion->step.row_evaluations == work->row_evaluations
               ? REFDYN_OK
               : refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
}

/* Accelerations and multipliers of a state of the motion, whose row terms are in the workspace. is_known: the
 * state is the step's end, where they are known. */
static int accelerate_seen(struct refdyn_integrator *integrator, int is_known) {
    const struct refdyn_step *step = &integrator->motion->step;
    const int n = step->n;
    const double *rates = is_known ? step->rates_new : step->side;
    const int status = is_known
                           ? REFDYN_OK
                           : refdyn_rates(&step->evaluation, integrator->t_right, integrator->q, step->side);
    memcpy(integrator->qdd, rates + n, (size_t)n * sizeof(double));
    memcpy(integrator->lambda, rates + 2 * n + 1, (size_t)integrator->work->m * sizeof(double));
    return status;
}

/* Where rows do not determine accelerations: the derivative of the step's rates, without multipliers; the
 * equations are for the force. */
static int continue_seen(struct refdyn_integrator *integrator) {
    const struct refdyn_step *step = &integrator->motion->step;
    const double theta = refdyn_step_theta(step, integrator->t);
    if (refdyn_fading_is_on(integrator->motion))
        refdyn_collocation_accelerations(step, theta, integrator->qdd);
    else
        refdyn_explicit_accelerations(step, theta, integrator->qdd);
    memset(integrator->lambda, 0, (size_t)integrator->work->m * sizeof(double));
    return refdyn_equations(integrator->work, integrator->t_right, integrator->q, integrator->qd);
}

/* Brings the state onto the programme. Error: NO_CONVERGENCE where the rows say nothing about rates. */
static int meet_programme_seen(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_step *step = &motion->step;
    int status = refdyn_row_terms(motion->work, integrator->t_right, integrator->q, integrator->qd);
    if (status)
        return status;
    memcpy(step->side, integrator->q, (size_t)(2 * step->n) * sizeof(double));
    status = refdyn_programme_meet(&motion->programme, step, integrator->t_right, integrator->q);
    if (status ||
        !refdyn_programme_moves_velocities(step, step->side, integrator->q, motion->statistics.step_largest))
        return status;
    motion->work->fault =
        (struct refdyn_fault){.row = refdyn_residuals(motion->work).psi_row, .coordinate = -1};
    return REFDYN_NO_CONVERGENCE;
}

/* The state at integrator->t, inside the last step. */
static int interpolate_seen(struct refdyn_integrator *integrator) {
    struct refdyn_step *step = &integrator->motion->step;
    const struct refdyn_options *options = &integrator->options;
    const double theta = refdyn_step_theta(step, integrator->t);
    int status = step->method->kind->interpolate(step, theta, integrator->q);
    if (!status)
        refdyn_kinks_see_before(&integrator->motion->state_events, step, integrator->t, integrator->q, 0);
    if (!status && step->method->kind->leaves_out_work && options->balance)
        status = refdyn_find_work_done(step, theta, &integrator->q[2 * step->n]);
    if (!status && integrator->work->m > 0 && options->stabilise == REFDYN_PROJECT &&
        !integrator->is_undetermined)
        status = meet_programme_seen(integrator);
    return status;
}

/* The state at t, at most the end of the last step. */
static int show_state(struct refdyn_integrator *integrator, double t) {
    struct refdyn_motion *motion = integrator->motion;
    const struct refdyn_step *step = &motion->step;
    int status = REFDYN_OK;
    integrator->t = t;
    integrator->t_right = refdyn_rows_side_of(motion, t);
    integrator->is_undetermined = refdyn_crossing_is_near(motion, t) || refdyn_fading_is_near(motion, t);
    if (refdyn_step_is_inside(step, t))
        status = interpolate_seen(integrator);
    else
        memcpy(integrator->q, step->state_new, refdyn_state_bytes(step));
    integrator->work_done = integrator->q[2 * step->n];
    if (!status)
        status = find_row_terms_seen(integrator);
    if (!status)
        refdyn_statistics_residuals(&motion->statistics, integrator->work);
    refdyn_rows_note_seen(motion, integrator->q);
    return status;
}

/* Returns the row of a contact that pulls in the state that the caller sees; -1: none. is_end: the state is
 * the end of the step, and contacts that open there do not count. */
static int pulling_seen(const struct refdyn_integrator *integrator, int is_end) {
    const struct refdyn_state_events *events = &integrator->motion->state_events;
    const struct refdyn_contacts *contacts = &events->contacts;
    for (int k = 0; k < contacts->count; k++)
        if (refdyn_contacts_pulls(contacts, integrator->lambda, k, 1) &&
            !(is_end && refdyn_state_events_is_due(events, contacts->event[k])))
            return contacts->first_row + k;
    return -1;
}

/* If a contact opens at the end of the step, by a time event or a kink, the caller sees the state before it
 * opens. Error: CONTACT_PULLS if it pulls in that state, too. */
static int accelerate_before(struct refdyn_integrator *integrator) {
    struct refdyn_motion *motion = integrator->motion;
    const struct refdyn_step *step = &motion->step;
    const int is_end = integrator->t >= step->t_end;
    int status = REFDYN_OK;
    if (is_end) {
        integrator->t_right = refdyn_step_inside(step, integrator->t);
        refdyn_kinks_see_before(&motion->state_events, step, integrator->t, integrator->q, 1);
        status = refdyn_row_terms(motion->work, integrator->t_right, integrator->q, integrator->qd);
        if (!status)
            status = accelerate_seen(integrator, 0);
    }
    const int row = pulling_seen(integrator, is_end);
    if (status || row < 0)
        return status;
    motion->work->fault = (struct refdyn_fault){.row = row, .coordinate = -1};
    return REFDYN_CONTACT_PULLS;
}

/* The same with its accelerations. */
static int show(struct refdyn_integrator *integrator, double t) {
    int status = show_state(integrator, t);
    if (status)
        return status;
    if (integrator->is_undetermined)
        return continue_seen(integrator);
    status = accelerate_seen(integrator, is_complete_end(integrator));
    return status || pulling_seen(integrator, 0) < 0 ? status : accelerate_before(integrator);
}

/* ---- Steps ---- */

/* Does the last step end at t, or at a state event that is at t within rounding? Then the caller sees the
 * state before the event at t. No step is as short as the resolution of the time. */
static int ends_at(const struct refdyn_motion *motion, double t) {
    const double apart = motion->state_events.due_named > 0 ? refdyn_state_events_blur(t) : 0;
    return t - motion->step.t_end <= fmax(apart, refdyn_motion_resolution(motion, t));
}

/* The steps have reached t_out or an event, or failed: the caller sees the state there, or at the end of the
 * last one. */
static int arrive(struct refdyn_integrator *integrator, double t_out, int status) {
    struct refdyn_motion *motion = integrator->motion;
    int seen = REFDYN_OK;
    if (status > 0)
        refdyn_motion_failed(motion, status, motion->failure.t);
    if (status)
        refdyn_step_give_up(&motion->step);
    if (t_out != integrator->t || status)
        seen = show(integrator, ends_at(motion, t_out) ? t_out : refdyn_step_seen_end(&motion->step));
    const int failed = leave(integrator, status ? REFDYN_OK : seen, integrator->t);
    return status ? status : failed;
}

/* Are more steps needed to reach t_out or an event that the caller has to know of first? */
static int is_before(const struct refdyn_motion *motion, double t_out) {
    const struct refdyn_state_events *events = &motion->state_events;
    return !ends_at(motion, t_out) && (events->due_named == 0 || events->is_told);
}

/* Reports the events at the state that the caller sees once; those that have ended the motion at each call.
 */
static int tell_events(struct refdyn_integrator *integrator) {
    struct refdyn_state_events *events = &integrator->motion->state_events;
    int ends = 0;
    if (events->due_named == 0 || refdyn_step_is_inside(&integrator->motion->step, integrator->t))
        return REFDYN_OK;
    for (int k = 0; k < events->due_named; k++)
        ends |= integrator->work->model->events[events->due[k]].ends;
    integrator->event_count = refdyn_state_events_report(events, ends);
    return ends ? REFDYN_EVENT_ENDS : REFDYN_OK;
}

/* As arrive; events at which the motion has failed are also reported. */
static int conclude(struct refdyn_integrator *integrator, double t_out, int failed) {
    const struct refdyn_state_events *events = &integrator->motion->state_events;
    const int status = arrive(integrator, t_out, failed);
    integrator->event = events->due;
    integrator->event_count = status ? events->due_named : 0;
    return status ? status : tell_events(integrator);
}

int refdyn_integrator_step(struct refdyn_integrator *integrator, double t_out, long steps) {
    int status = refdyn_integrator_status(integrator);
    if (status)
        return status;
    if (!(isfinite(t_out) && t_out >= integrator->t))
        return REFDYN_BAD_TIME;
    status = refdyn_integrator_notice(integrator);
    if (status)
        return status;
    struct refdyn_motion *motion = enter(integrator);
    struct refdyn_attempt attempt = {.is_over = 1};
    for (; steps > 0 && is_before(motion, t_out) && !status; steps--)
        status = refdyn_accept_step(motion, t_out, 0, &attempt);
    return conclude(integrator, t_out, status);
}

int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out, long steps,
                           struct refdyn_attempt *attempt) {
    struct refdyn_motion *motion = enter(integrator);
    int status = REFDYN_OK;
    for (; steps > 0 && !status && (!attempt->is_over || is_before(motion, t_out)); steps--)
        status = refdyn_accept_step(motion, t_out, 1, attempt);
    if (status == REFDYN_HALTED) {
        refdyn_parameters_leave(&motion->parameters, motion->work);
        return status;
    }
    attempt->is_over = 1;
    return conclude(integrator, t_out, status);
}

void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt,
                             int taken) {
    struct refdyn_motion *motion = enter(integrator);
    attempt->is_left = taken == REFDYN_LEFT_TO_MOTION;
    if (!attempt->is_left)
        refdyn_attempt_judge(motion, attempt, taken);
    if (!attempt->is_left && attempt->is_over)
        refdyn_step_over(motion, attempt);
    refdyn_parameters_leave(&motion->parameters, motion->work);
}

int refdyn_integrator_to(struct refdyn_integrator *integrator, double t_out) {
    int status;
    do
        status = refdyn_integrator_step(integrator, t_out, LONG_MAX);
    while (!status && integrator->t < t_out);
    return status;
}

int refdyn_integrator_show(struct refdyn_integrator *integrator, double t) {
    enter(integrator);
    return leave(integrator, show(integrator, t), t);
}

/* Looks at t by one of the functions above. */
static int look(struct refdyn_integrator *integrator, double t,
                int (*shows)(struct refdyn_integrator *integrator, double t)) {
    const int status = refdyn_integrator_status(integrator);
    if (status)
        return status;
    const struct refdyn_motion *motion = integrator->motion;
    if (!(t >= motion->step.t_from && (t <= integrator->t || ends_at(motion, t))))
        return REFDYN_BAD_TIME;
    enter(integrator);
    return leave(integrator, shows(integrator, t), t);
}

int refdyn_integrator_look(struct refdyn_integrator *integrator, double t) {
    return look(integrator, t, show);
}

int refdyn_integrator_look_at_state(struct refdyn_integrator *integrator, double t) {
    return look(integrator, t, show_state);
}
