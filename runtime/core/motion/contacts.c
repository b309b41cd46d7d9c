/*
 * One-sided contacts: their modes and values.
 *
 * In: a state. Out: the values whose zeros are events of contacts, and the forces of contacts.
 *
 * A contact has one of three modes:
 * - free: its value is the gap;
 * - resting: its row keeps the gap closed, and its value is the force of that row, its multiplier:
 *   M qdd - h - Q = u^T lambda, u the gradient of the gap;
 * - touching: other contacts keep the gap closed, or nothing presses it, so that there is no force.
 *
 * To the gap of a contact that touches, and for a short time of one that has just opened, the value adds an
 * allowance for errors and rounding. Each value falls through zero where the mode changes.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* Rounding of a force, relative to the largest force. */
static const double force_digits = 64 * DBL_EPSILON;
/* Time difference for the rate of a force, relative to the longest step. */
static const double difference_part = 1e-4;
/* A column of which less than this part is orthogonal to the others depends on them. */
static const double dependent = 1e-9;
/* A force that pulls counts as rounding up to this part of the largest force so far. At outputs, errors of
 * the interpolated state may make it as large as the second part, or as the tolerance. */
static const double pull_digits = 1e-12, pull_seen = 1e-6;
/* Replaces the longest step before the first one [s]. */
static const double first_step = 1e-3;

void refdyn_contacts_lay_out(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                             struct layout *layout) {
    const int n = model->n, m = model->m, first = refdyn_programme_rows(model), count = m - first;
    contacts->count = count;
    contacts->first_row = first;
    contacts->event = layout_ints(layout, count);
    contacts->mode = layout_ints(layout, count);
    contacts->since = layout_doubles(layout, count);
    contacts->left = layout_doubles(layout, count);
    contacts->rest = layout_doubles(layout, count);
    contacts->reach = layout_doubles(layout, count);
    contacts->depth = layout_doubles(layout, count);
    contacts->allowance = layout_doubles(layout, count);
    contacts->allowed_until = layout_doubles(layout, count);
    contacts->inside = layout_doubles(layout, count);
    contacts->rates = layout_doubles(layout, count > 0 ? 2 * n + 1 + m : 0);
    contacts->state = layout_doubles(layout, count > 0 ? 2 * n + 1 : 0);
    contacts->force_rates = layout_doubles(layout, count);
    contacts->is_closed = layout_ints(layout, count);
    contacts->is_at_rest = layout_ints(layout, count);
    contacts->gap = layout_doubles(layout, count);
    contacts->rate = layout_doubles(layout, count);
    contacts->bias = layout_doubles(layout, count);
    contacts->scale = layout_doubles(layout, count);
    contacts->rounding = layout_doubles(layout, count);
    contacts->rate_rounding = layout_doubles(layout, count);
    contacts->bias_rounding = layout_doubles(layout, count);
    contacts->restitution = layout_doubles(layout, count);
    contacts->qdd = layout_doubles(layout, count > 0 ? n : 0);
    refdyn_one_sided_lay_out(&contacts->problem, count, count > 0 ? n : 0, layout);
}

void refdyn_contacts_clear(struct refdyn_contacts *contacts, struct refdyn_workspace *work,
                           double tolerance) {
    const struct refdyn_model *model = work->model;
    contacts->resting = 0;
    contacts->are_unique = 1;
    contacts->longest = contacts->late = contacts->force_size = 0;
    contacts->tolerance = tolerance;
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact > 0)
            contacts->event[model->events[i].contact - 1 - contacts->first_row] = i;
    for (int k = 0; k < contacts->count; k++) {
        contacts->mode[k] = REFDYN_CONTACT_FREE;
        contacts->since[k] = contacts->left[k] = NAN;
        contacts->inside[k] = contacts->allowance[k] = 0;
        contacts->allowed_until[k] = -INFINITY;
        work->p[refdyn_contact_mode_place(model, contacts->event[k])] = 0;
    }
    if (contacts->count > 0)
        refdyn_prepare(work);
}

double refdyn_contacts_pace(const struct refdyn_contacts *contacts) {
    return contacts->longest > 0 ? contacts->longest : first_step;
}

int refdyn_contact_of(const struct refdyn_contacts *contacts, int event) {
    for (int k = 0; k < contacts->count; k++)
        if (contacts->event[k] == event)
            return k;
    return -1;
}

/* The forces of a state: the multipliers of the contacts' rows, in `rates`. */
static double *find_forces(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                           const double *state, int *status) {
    *status = refdyn_rates(&step->evaluation, t, state, contacts->rates);
    return contacts->rates + 2 * step->n + 1 + contacts->first_row;
}

/* The force of contact k among the multipliers (m); 0 unless it rests. */
static double force_of(const struct refdyn_contacts *contacts, const double *multipliers, int k) {
    return contacts->mode[k] == REFDYN_CONTACT_RESTING ? multipliers[contacts->first_row + k] : 0;
}

void refdyn_contacts_note_forces(struct refdyn_contacts *contacts, const double *multipliers) {
    for (int k = 0; k < contacts->count && contacts->resting > 0; k++)
        contacts->force_size = fmax(contacts->force_size, fabs(force_of(contacts, multipliers, k)));
}

int refdyn_contacts_pulls(const struct refdyn_contacts *contacts, const double *multipliers, int k,
                          int is_seen) {
    const double part = is_seen ? fmax(pull_seen, contacts->tolerance) : pull_digits;
    return force_of(contacts, multipliers, k) < -part * contacts->force_size;
}

int refdyn_contacts_values(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                           const double *state, double *values) {
    const double *forces = NULL;
    int status = REFDYN_OK;
    if (contacts->resting > 0)
        forces = find_forces(contacts, step, t, state, &status);
    for (int k = 0; k < contacts->count && !status; k++)
        if (contacts->mode[k] == REFDYN_CONTACT_RESTING)
            values[contacts->event[k]] = forces[k];
        else
            values[contacts->event[k]] += t < contacts->allowed_until[k] ? contacts->allowance[k] : 0;
    return status;
}

void refdyn_contacts_end_allowances(struct refdyn_contacts *contacts, double t, double *values) {
    for (int k = 0; k < contacts->count; k++) {
        double *value = &values[contacts->event[k]];
        if (contacts->mode[k] != REFDYN_CONTACT_FREE || !(t < contacts->allowed_until[k]) ||
            *value - contacts->allowance[k] <= contacts->reach[k])
            continue;
        *value -= contacts->allowance[k];
        contacts->allowed_until[k] = -INFINITY;
    }
}

int refdyn_contacts_force_rates(struct refdyn_contacts *contacts, const struct refdyn_step *step, double t,
                                const double *state) {
    const int n = step->n, count = contacts->count;
    const double ahead = difference_part * refdyn_contacts_pace(contacts);
    double *next = contacts->state, largest = 0;
    int status;
    if (contacts->resting == 0)
        return REFDYN_OK;
    const double *forces = find_forces(contacts, step, t, state, &status);
    memcpy(contacts->force_rates, forces, (size_t)count * sizeof *forces);
    for (int j = 0; j < 2 * n + 1; j++)
        next[j] = state[j] + ahead * contacts->rates[j];
    if (!status)
        forces = find_forces(contacts, step, refdyn_step_inside(step, t + ahead), next, &status);
    for (int k = 0; k < count; k++) {
        largest = fmax(largest, fabs(contacts->force_rates[k]));
        contacts->force_rates[k] = (forces[k] - contacts->force_rates[k]) / ahead;
    }
    contacts->force_noise = force_digits * largest;
    contacts->force_rate_noise = 4 * contacts->force_noise / ahead;
    return status;
}

/* Column j of the closed contacts' gradients (count). */
static void take_column(const struct refdyn_contacts *contacts, const struct refdyn_model *model,
                        const double *terms, int j, double *column) {
    const double *by_q = terms + model->event_count + model->kink_count;
    for (int k = 0; k < contacts->count; k++)
        column[k] = contacts->mode[k] == REFDYN_CONTACT_FREE ? 0 : by_q[contacts->event[k] * model->n + j];
}

/* Removes from x its parts along `size` orthonormal vectors (count); a second pass reduces rounding. */
static void leave_rest(const double *basis, int size, int count, double *x) {
    for (int pass = 0; pass < 2; pass++)
        for (int b = 0; b < size; b++)
            dense_add(x, -dense_dot(basis + b * count, x, count), basis + b * count, count);
}

/* The forces are projected onto the range of u; u^T maps the part orthogonal to it to 0. */
void refdyn_contacts_spread(struct refdyn_contacts *contacts, const struct refdyn_model *model,
                            const double *terms, double *forces) {
    const int count = contacts->count;
    double *basis = contacts->problem.triangle, *rest = contacts->problem.share;
    int size = 0;
    for (int j = 0; j < model->n && size < count; j++) {
        double *column = basis + size * count;
        take_column(contacts, model, terms, j, column);
        const double before = dense_dot(column, column, count);
        leave_rest(basis, size, count, column);
        const double square = dense_dot(column, column, count);
        for (int k = 0; k < count && square > 0; k++)
            column[k] /= sqrt(square);
        size += square > dependent * dependent * before;
    }
    memcpy(rest, forces, (size_t)count * sizeof *rest);
    leave_rest(basis, size, count, rest);
    const double most = force_digits * refdyn_largest(forces, count, NULL);
    for (int k = 0; k < count; k++)
        if (forces[k] - rest[k] < -most)
            return;
    dense_add(forces, -1, rest, count);
}
