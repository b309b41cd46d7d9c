/*
 * Transitions of one-sided contacts: impacts, rest and new modes.
 *
 * In: a state at which contacts are closed. Out: rates after the impacts, and the new modes. g are the gaps;
 * n are their gradients in the metric of the mass matrix, without the parts that the rows of the programme
 * hold; e are the coefficients of restitution.
 *
 * Impact: the smallest change of rates with g'+ >= -e g'- where g'- < 0, and g'+ >= 0 where a contact rests.
 * Its impulses are >= 0, and it loses energy (Pfeiffer and Glocker, Multibody Dynamics with Unilateral
 * Contacts, 1996, ch. 8). Contacts that open take no part, since they could gain energy.
 *
 * Rest: a contact rests where its next rebound is lower than a hundredth of the tolerance, or than rounding.
 * All remaining rebounds would take T = 2 g'+ / (|g''| (1 - e)); the contact must stay pressed until then.
 *
 * Forces: the smallest change of accelerations with g'' >= 0 for the contacts at rest (Gauss's principle of
 * least constraint). A contact whose force is 0 there opens, or touches where g'' = 0. This is judged shortly
 * after the transition, since forces that are just passing zero have a sign there.
 *
 * A hundredth of the tolerance leaves errors of 1e-4 tolerances in a stack of two balls; one tolerance would
 * leave 42.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

/* Bound on the impacts at one time. Between bodies in a row they decay as a geometric series. */
enum { IMPACTS_MOST = 5000 };
/* Bound on the rounds of impacts and of contacts that come to rest, at one time; and for each contact. */
enum { ROUNDS_FREE = 20, ROUNDS_EACH = 20 };
/* Rebounds lower than this part of the tolerance are ignored. */
static const double rebound_part = 0.01;
/* Rounding of a gap or its rate, relative to the sum of its |terms|; and of its acceleration, which follows
 * from a linear system. */
static const double rounding_digits = 64 * DBL_EPSILON, bias_digits = 1e-10;
/* A contact is still pressed if this part of its closing acceleration remains. */
static const double pressed_part = 0.5;
/* Forces that pass zero are judged later by this part of the longest step, when they have a sign. */
static const double later_part = 1e-6;

/* ---- The state of the contacts ---- */

enum acting { NONE_ACT, RESTING_ACT, ALL_ACT };

/* Sets the parameters that switch the rows of contacts on and off. */
static void let_act(struct refdyn_motion *motion, enum acting which) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    struct refdyn_workspace *work = motion->work;
    refdyn_parameters_leave(&motion->parameters, work);
    for (int k = 0; k < contacts->count; k++)
        work->p[refdyn_contact_mode_place(work->model, contacts->event[k])] =
            which == ALL_ACT || (which == RESTING_ACT && contacts->mode[k] == REFDYN_CONTACT_RESTING);
    refdyn_prepare(work);
    refdyn_parameters_enter(&motion->parameters, work);
    refdyn_parameters_take(&motion->parameters, work);
}

/* Accelerations with the rows of the programme alone, then the rows of all contacts and the factor of M. */
static int evaluate(struct refdyn_motion *motion, double t, const double *state) {
    struct refdyn_workspace *work = motion->work;
    const double *q = state, *qd = q + work->n;
    let_act(motion, NONE_ACT);
    int status = refdyn_equations(work, t, q, qd);
    if (!status)
        status = refdyn_partition_renew(work);
    if (!status)
        status = refdyn_solve(work, REFDYN_NONE, motion->state_events.contacts.qdd);
    let_act(motion, ALL_ACT);
    if (!status)
        status = refdyn_row_terms(work, t, q, qd);
    return status ? status : refdyn_factor_metric(work);
}

/* Gap, rate and acceleration of contact k, and the rounding of each. */
static void assess(struct refdyn_motion *motion, int k, double t, const double *state) {
    const struct refdyn_state_events *events = &motion->state_events;
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_model *model = work->model;
    const int n = work->n, row = contacts->first_row + k;
    const double *u = work->u + row * n;
    const double *restitution = events->terms + events->count * (1 + 2 * n);
    const double *sizes = restitution + model->event_count + model->change_count;
    double value_size = 0, rate_size = 0, bias_size = fabs(work->v[row]), scale = 0;
    double of_time = work->psi[row];
    for (int j = 0; j < n; j++) {
        value_size += fabs(u[j] * state[j]);
        rate_size += fabs(u[j] * state[n + j]);
        bias_size += fabs(u[j] * contacts->qdd[j]);
        of_time -= u[j] * state[n + j];
        scale = fmax(scale, fabs(u[j]) * motion->step.units[j]);
    }
    value_size = fmax(value_size, sizes[contacts->event[k]]) + fabs(of_time * t);
    contacts->gap[k] = work->phi[row];
    contacts->rate[k] = work->psi[row];
    contacts->bias[k] = work->v[row] + dense_dot(u, contacts->qdd, n);
    contacts->scale[k] = scale;
    contacts->restitution[k] = restitution[contacts->event[k]];
    contacts->rounding[k] = rounding_digits * value_size;
    contacts->rate_rounding[k] =
        fmax(contacts->rate_rounding[k], rounding_digits * (rate_size + fabs(of_time)));
    contacts->bias_rounding[k] = bias_digits * bias_size;
}

static int look(struct refdyn_motion *motion, double t, const double *state) {
    const struct refdyn_model *model = motion->work->model;
    const int status = evaluate(motion, t, state);
    if (status)
        return status;
    model->event_terms(motion->work->p, motion->work->x, t, state, state + model->n,
                       motion->state_events.terms);
    for (int k = 0; k < motion->state_events.contacts.count; k++)
        assess(motion, k, t, state);
    return REFDYN_OK;
}

/* Error that the gap may have at the beginning of the step. */
static void find_reach(struct refdyn_contacts *contacts) {
    for (int k = 0; k < contacts->count; k++)
        contacts->reach[k] = fmax(contacts->tolerance * contacts->scale[k], contacts->rounding[k]);
}

/* Gradients of the gaps in the metric of M, without their parts along rows of the programme up to that level.
 */
static void find_normals(struct refdyn_motion *motion, enum refdyn_row_level last) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    struct refdyn_workspace *work = motion->work;
    const int n = work->n, count = refdyn_spread_programme(work, last);
    for (int k = 0; k < contacts->count; k++) {
        double *normal = contacts->problem.normals + k * n;
        memcpy(normal, work->u + (contacts->first_row + k) * n, (size_t)n * sizeof *normal);
        refdyn_factor_half_forward(work->reduced, n, n, normal);
        if (!(refdyn_leave_rest(work, count, normal) > work->rank_tol))
            memset(normal, 0, (size_t)n * sizeof *normal);
    }
}

/* Change of the rate or acceleration of gap k by x of the problem. */
static double change_of(const struct refdyn_contacts *contacts, int k) {
    const struct refdyn_one_sided *problem = &contacts->problem;
    return dense_dot(problem->normals + k * problem->n, problem->x, problem->n);
}

/* y (n) += L^-T x, which is x of the problem in coordinates. */
static void add_solution(struct refdyn_motion *motion, double *y) {
    const struct refdyn_workspace *work = motion->work;
    double *room = motion->state_events.room;
    memcpy(room, motion->state_events.contacts.problem.x, (size_t)work->n * sizeof *room);
    refdyn_factor_half_backward(work->reduced, work->n, work->n, room);
    dense_add(y, 1, room, work->n);
}

/* No x meets the conditions: the programme closes a contact, or the contacts contradict each other. */
static int fail(struct refdyn_motion *motion) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_one_sided *problem = &contacts->problem;
    int status = REFDYN_CONTACTS_UNMET, contact = -1;
    for (int k = 0; k < contacts->count; k++) {
        const double *normal = problem->normals + k * problem->n;
        if (!problem->takes_part[k])
            continue;
        const int is_driven =
            problem->bounds[k] > problem->slack[k] && dense_dot(normal, normal, problem->n) == 0;
        if (contact < 0 || is_driven)
            contact = k;
        if (is_driven)
            status = REFDYN_CONTACT_DRIVEN;
    }
    motion->work->fault = (struct refdyn_fault){.row = contacts->first_row + contact, .coordinate = -1};
    return status;
}

/* ---- Impacts ---- */

static int is_closing(const struct refdyn_contacts *contacts, int k) {
    return contacts->is_closed[k] && contacts->rate[k] < -contacts->rate_rounding[k];
}

/* One round: closing contacts rebound, those at rest stay closed. Counts the closing ones. */
static int pose_impact(struct refdyn_contacts *contacts) {
    struct refdyn_one_sided *problem = &contacts->problem;
    int count = 0;
    for (int k = 0; k < contacts->count; k++) {
        const double share = is_closing(contacts, k) ? contacts->restitution[k] : 0;
        problem->takes_part[k] = contacts->is_closed[k] && contacts->rate[k] <= contacts->rate_rounding[k];
        problem->bounds[k] = -(1 + share) * contacts->rate[k];
        problem->slack[k] = contacts->rate_rounding[k];
        count += is_closing(contacts, k);
    }
    return count;
}

/* The rounding of the changes counts as rounding of the rates, since the terms of the rates may all be 0. */
static void add_rates(struct refdyn_motion *motion, double *qd) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_one_sided *problem = &contacts->problem;
    const int n = problem->n;
    const double square = dense_dot(problem->x, problem->x, n);
    add_solution(motion, qd);
    for (int k = 0; k < contacts->count; k++) {
        const double *normal = problem->normals + k * n;
        contacts->rate[k] += change_of(contacts, k);
        contacts->rate_rounding[k] =
            fmax(contacts->rate_rounding[k], rounding_digits * sqrt(square * dense_dot(normal, normal, n)));
    }
}

/* Rounds of impacts until no contact closes any more. */
static int meet_impacts(struct refdyn_motion *motion, double *qd, int *has_rates) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    find_normals(motion, REFDYN_VELOCITY);
    for (int round = 0; round < IMPACTS_MOST; round++) {
        if (pose_impact(contacts) == 0)
            return REFDYN_OK;
        if (!refdyn_one_sided_solve(&contacts->problem))
            return fail(motion);
        add_rates(motion, qd);
        *has_rates = 1;
    }
    return REFDYN_EVENTS_ACCUMULATE;
}

/* ---- Rest ---- */

/* Gauss's principle for the contacts at rest; qdd (n): accelerations with them. */
static int accelerate(struct refdyn_motion *motion, double *qdd) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    struct refdyn_one_sided *problem = &contacts->problem;
    find_normals(motion, REFDYN_ACCELERATION);
    for (int k = 0; k < contacts->count; k++) {
        problem->takes_part[k] = contacts->is_at_rest[k];
        problem->bounds[k] = -contacts->bias[k];
        problem->slack[k] = contacts->bias_rounding[k];
    }
    if (!refdyn_one_sided_solve(problem))
        return fail(motion);
    memcpy(qdd, contacts->qdd, (size_t)motion->work->n * sizeof *qdd);
    add_solution(motion, qdd);
    return REFDYN_OK;
}

static double acceleration_of(const struct refdyn_contacts *contacts, int k) {
    return contacts->bias[k] + change_of(contacts, k);
}

/* contacts->state := the state after h with constant accelerations. */
static const double *predict(struct refdyn_motion *motion, const double *qdd, double h) {
    const struct refdyn_step *step = &motion->step;
    const int n = step->n;
    double *state = motion->state_events.contacts.state;
    memcpy(state, step->state, refdyn_state_bytes(step));
    for (int j = 0; j < n; j++) {
        state[j] += h * (step->state[n + j] + h / 2 * qdd[j]);
        state[n + j] += h * qdd[j];
    }
    return state;
}

/* Would contact k, whose gap opens, close again so soon that it counts as at rest? *T: time until its last
 * rebound would end; 0 with e = 1, where rebounds have no end. */
static int hardly_rebounds(const struct refdyn_contacts *contacts, int k, double *T) {
    const double rate = contacts->rate[k], pull = -acceleration_of(contacts, k);
    const double most = fmax(rebound_part * contacts->tolerance * contacts->scale[k], contacts->rounding[k]);
    const double loss = 1 - contacts->restitution[k];
    const int is_low = rate * rate <= 2 * pull * most || rate <= pull * contacts->late;
    if (!contacts->is_closed[k] || contacts->is_at_rest[k] || !(pull > contacts->bias_rounding[k]) || !is_low)
        return 0;
    *T = loss > 0 ? 2 * rate / (pull * loss) : 0;
    return 1;
}

/* Contact k closes again with the acceleration `pull`: is it still pressed when its last rebound ends? */
static int stays_pressed(struct refdyn_motion *motion, int k, const double *qdd, double T, double pull,
                         int *is_pressed) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const double t = refdyn_step_inside(&motion->step, motion->step.t_begin + T);
    double *later = motion->step.side; /* (n) accelerations there */
    int status = look(motion, t, predict(motion, qdd, T));
    if (!status)
        status = accelerate(motion, later);
    *is_pressed = !status && -acceleration_of(contacts, k) > pressed_part * pull;
    return status;
}

/* Finds the contacts that come to rest at the beginning of the step. */
static int find_resting(struct refdyn_motion *motion, const double *qdd, int *found) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_step *step = &motion->step;
    int status = REFDYN_OK;
    *found = 0;
    for (int k = 0; k < contacts->count && !status; k++) {
        double T;
        int is_pressed = 0;
        if (!hardly_rebounds(contacts, k, &T))
            continue;
        status = stays_pressed(motion, k, qdd, T, -acceleration_of(contacts, k), &is_pressed);
        if (!status)
            status = look(motion, step->t_begin, step->state);
        if (!status)
            status = accelerate(motion, motion->step.stage);
        if (!is_pressed)
            continue;
        contacts->is_at_rest[k] = 1;
        contacts->rest[k] = step->t_begin + T;
        (*found)++;
    }
    return status;
}

static void stop_rates(struct refdyn_motion *motion, double *qd) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    struct refdyn_one_sided *problem = &contacts->problem;
    find_normals(motion, REFDYN_VELOCITY);
    for (int k = 0; k < contacts->count; k++) {
        problem->takes_part[k] = contacts->is_at_rest[k];
        problem->bounds[k] = -contacts->rate[k];
    }
    refdyn_one_sided_meet(problem);
    add_rates(motion, qd);
    for (int k = 0; k < contacts->count; k++)
        if (contacts->is_at_rest[k])
            contacts->rate_rounding[k] = fmax(contacts->rate_rounding[k], 2 * fabs(contacts->rate[k]));
}

/* Closed contacts whose rate is rounding are at rest. */
static void mark_at_rest(struct refdyn_contacts *contacts, double t) {
    for (int k = 0; k < contacts->count; k++) {
        const int was = contacts->is_at_rest[k];
        contacts->is_at_rest[k] =
            contacts->is_closed[k] && fabs(contacts->rate[k]) <= contacts->rate_rounding[k];
        if (contacts->is_at_rest[k] && !was && contacts->mode[k] == REFDYN_CONTACT_FREE)
            contacts->rest[k] = t;
    }
}

/* Alternates impacts and coming to rest until neither changes anything. qdd (n): accelerations after it. */
static int settle(struct refdyn_motion *motion, double *qdd, int *has_rates) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    double *qd = motion->step.state + motion->step.n;
    const int rounds = ROUNDS_FREE + ROUNDS_EACH * contacts->count;
    for (int k = 0; k < contacts->count; k++) {
        contacts->is_at_rest[k] = 0;
        contacts->rest[k] = NAN;
    }
    for (int round = 0; round < rounds; round++) {
        int found = 0, status = meet_impacts(motion, qd, has_rates);
        if (!status && *has_rates) /* which accelerations depend on */
            status = look(motion, motion->step.t_begin, motion->step.state);
        if (status)
            return status;
        mark_at_rest(contacts, motion->step.t_begin);
        status = accelerate(motion, qdd);
        if (!status)
            status = find_resting(motion, qdd, &found);
        if (status || found == 0)
            return status;
        stop_rates(motion, qd);
        *has_rates = 1;
    }
    return REFDYN_EVENTS_ACCUMULATE;
}

/* ---- Modes ---- */

/* A contact at rest: does it carry force, open, or touch without force? */
static enum refdyn_contact_mode mode_of(const struct refdyn_contacts *contacts, int k, double least_force) {
    if (!contacts->is_at_rest[k])
        return REFDYN_CONTACT_FREE;
    if (contacts->problem.multipliers[k] > least_force)
        return REFDYN_CONTACT_RESTING;
    return acceleration_of(contacts, k) > contacts->bias_rounding[k] ? REFDYN_CONTACT_FREE
                                                                     : REFDYN_CONTACT_TOUCHING;
}

/* Do the gaps of the contacts that are closed change independently? Then their forces are unique. */
static int are_independent(struct refdyn_contacts *contacts) {
    int count = 0;
    for (int k = 0; k < contacts->count; k++) {
        contacts->problem.takes_part[k] = contacts->mode[k] != REFDYN_CONTACT_FREE;
        count += contacts->problem.takes_part[k];
    }
    return refdyn_one_sided_meet(&contacts->problem) == count;
}

/* At first the height of a rebound is within rounding. A contact that lets go, or hardly moves, opens within
 * the errors of steps. */
static int opens_slowly(const struct refdyn_contacts *contacts, int k) {
    return contacts->is_at_rest[k] ||
           contacts->rate[k] * refdyn_contacts_pace(contacts) <= rebound_part * contacts->reach[k];
}

/* Sets the allowance that contact k needs from t on, until it has opened by twice as much: at its rate, or by
 * an acceleration that has grown from 0 within h. */
static void allow(struct refdyn_contacts *contacts, int k, double t, double h) {
    const double most = opens_slowly(contacts, k) ? contacts->reach[k] : contacts->rounding[k];
    const double rate = contacts->rate[k], acceleration = acceleration_of(contacts, k);
    double last = INFINITY;
    if (rate > contacts->rate_rounding[k])
        last = 2 * most / rate;
    if (acceleration > contacts->bias_rounding[k])
        last = fmin(last, cbrt(12 * most * h / acceleration));
    contacts->allowance[k] = most;
    contacts->allowed_until[k] = contacts->mode[k] == REFDYN_CONTACT_FREE ? t + last : INFINITY;
}

/* Contact k changes its mode at t. */
static void change_mode(struct refdyn_contacts *contacts, int k, enum refdyn_contact_mode mode, double t) {
    if (mode == REFDYN_CONTACT_FREE && contacts->mode[k] != REFDYN_CONTACT_FREE)
        contacts->left[k] = t;
    else if (mode != REFDYN_CONTACT_FREE && !isnan(contacts->rest[k]))
        contacts->since[k] = contacts->rest[k];
    contacts->mode[k] = mode;
    contacts->resting += mode == REFDYN_CONTACT_RESTING;
}

/* New modes, from the forces a little later. */
static int find_modes(struct refdyn_motion *motion, const double *qdd) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const struct refdyn_step *step = &motion->step;
    const double h = later_part * refdyn_contacts_pace(contacts);
    int status = look(motion, refdyn_step_inside(step, step->t_begin + h), predict(motion, qdd, h));
    if (!status)
        status = accelerate(motion, motion->step.side);
    if (status)
        return status;
    const double least =
        rounding_digits * refdyn_largest(contacts->problem.multipliers, contacts->count, NULL);
    contacts->resting = 0;
    for (int k = 0; k < contacts->count; k++) {
        change_mode(contacts, k, mode_of(contacts, k, least), step->t_begin);
        if (contacts->is_closed[k])
            allow(contacts, k, step->t_begin, h);
    }
    contacts->are_unique = are_independent(contacts);
    return REFDYN_OK;
}

/* From now on the rows of contacts that rest act, with the gains of the next step. */
static int take_modes(struct refdyn_motion *motion) {
    struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    const double next = motion->control.next;
    let_act(motion, RESTING_ACT);
    refdyn_parameters_set_gains(&motion->parameters, work->model, &motion->options,
                                next > 0 ? next : INFINITY);
    const int status = refdyn_equations(work, step->t_begin, step->state, step->state + step->n);
    return status ? status : refdyn_partition_renew(work);
}

/* ---- Transitions ---- */

/* Error of the gap of contact k that the error in its time of closing causes. */
static double moved_by(const struct refdyn_motion *motion, int k) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    return fabs(contacts->rate[k]) * fmax(refdyn_state_events_blur(motion->step.t_begin), contacts->late);
}

/* Is contact k closed at the beginning of the step? It is if it is due, or if its gap is 0 within rounding.
 */
static int is_closed(const struct refdyn_motion *motion, int k) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const double moved = moved_by(motion, k);
    if (contacts->mode[k] == REFDYN_CONTACT_RESTING ||
        refdyn_state_events_is_due(&motion->state_events, contacts->event[k]))
        return 1;
    return contacts->gap[k] <= (contacts->mode[k] == REFDYN_CONTACT_TOUCHING
                                    ? contacts->reach[k]
                                    : fmax(contacts->rounding[k], moved));
}

/* Is a gap negative by more than its error? Then the motion missed the contact on the way there. */
static int find_inside(struct refdyn_motion *motion) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    for (int k = 0; k < contacts->count; k++) {
        if (contacts->gap[k] >= -2 * fmax(fmax(contacts->reach[k], contacts->inside[k]), moved_by(motion, k)))
            continue;
        motion->work->fault = (struct refdyn_fault){.row = contacts->first_row + k, .coordinate = -1};
        return REFDYN_CONTACT_INSIDE;
    }
    return REFDYN_OK;
}

/* The rate that contact k may have by errors alone: if it rests, the residual of its row before the events. A
 * resting contact that seems to open would take no part in the impact of another one. */
static double rate_error(const struct refdyn_motion *motion, int k) {
    const struct refdyn_contacts *contacts = &motion->state_events.contacts;
    const double residual = fabs(motion->before.psi[contacts->first_row + k]);
    const double least = DBL_MIN; /* below it, products lose their digits */
    return contacts->mode[k] == REFDYN_CONTACT_RESTING ? fmax(least, 2 * residual) : least;
}

/* The gaps at the beginning of the step. */
static int begin(struct refdyn_motion *motion) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    for (int k = 0; k < contacts->count; k++)
        contacts->rate_rounding[k] = rate_error(motion, k);
    if (motion->step.t_limit <= motion->step.t_begin) /* the limit of a time event that has passed */
        refdyn_step_limit(&motion->step, INFINITY);
    const int status = look(motion, motion->step.t_begin, motion->step.state);
    if (status)
        return status;
    find_reach(contacts);
    for (int k = 0; k < contacts->count; k++)
        contacts->is_closed[k] = is_closed(motion, k);
    return find_inside(motion);
}

/* The transition up to the new modes; if it fails, the rows of contacts stay as they were. */
static int go_through(struct refdyn_motion *motion, int *has_rates) {
    double *qdd = motion->step.error; /* (n) */
    int status = settle(motion, qdd, has_rates);
    return status ? status : find_modes(motion, qdd);
}

void refdyn_contact_transitions_release(struct refdyn_motion *motion) {
    let_act(motion, NONE_ACT);
}

int refdyn_contact_transitions_take(struct refdyn_motion *motion, int *has_rates) {
    int status = begin(motion);
    if (!status)
        status = go_through(motion, has_rates);
    const int taken = take_modes(motion);
    return status ? status : taken;
}

/* Contacts that close at the start, and those at rest there, are due. */
static void keep_due(struct refdyn_contacts *contacts, int moves) {
    for (int k = 0; k < contacts->count; k++)
        contacts->is_closed[k] =
            contacts->is_closed[k] && moves && contacts->rate[k] <= contacts->rate_rounding[k];
}

int refdyn_contact_transitions_start(struct refdyn_motion *motion, int *is_changed) {
    struct refdyn_contacts *contacts = &motion->state_events.contacts;
    int is_closed = 0, moves = 0, has_rates = 0;
    *is_changed = 0;
    if (contacts->count == 0)
        return REFDYN_OK;
    int status = begin(motion);
    for (int k = 0; k < contacts->count && !status; k++) {
        is_closed |= contacts->is_closed[k];
        moves |= contacts->is_closed[k] && fabs(contacts->rate[k]) > contacts->rate_rounding[k];
    }
    if (!status && is_closed && !moves)
        status = go_through(motion, &has_rates);
    keep_due(contacts, moves);
    *is_changed = contacts->resting > 0;
    const int taken = take_modes(motion);
    return status ? status : taken;
}
