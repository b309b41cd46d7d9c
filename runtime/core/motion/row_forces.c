/*
 * Forces of rows at the state that the caller sees: multipliers, the force on each coordinate, contacts.
 *
 * In: an integrator at an output, with u of that state in the workspace. Out: forces; NAN where rows depend
 * on each other so that the motion does not determine them. Next to a state where rows lose rank, multipliers
 * may grow beyond all bounds while the forces of drives are smooth: these are continued by a cubic through
 * other times of the step.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

enum { NODES = 4 };
/* Times of the cubic relative to the present one, as parts of the step, outside the part in which rows do not
 * determine accelerations; and the weights of their values at the present time. */
static const double nodes[NODES] = {-0.165, -0.099, -0.033, 0.033},
                    weights[NODES] = {0.0625, -0.3125, 0.9375, 0.3125};

/* Writes multipliers (m) or forces (n) of a state at which the rows determine the accelerations. */
typedef void find_function(struct refdyn_integrator *integrator, double *out);

/* Does the motion determine all multipliers? Those of free contacts, whose rows are 0, are 0. */
static int are_determined(const struct refdyn_integrator *integrator) {
    int acting = integrator->work->m;
    for (int k = 0; k < integrator->contact_count; k++)
        acting -= integrator->contact_mode[k] != REFDYN_CONTACT_RESTING;
    return integrator->work->partition.rank >= acting;
}

static void find_multipliers(struct refdyn_integrator *integrator, double *lambda) {
    struct refdyn_workspace *work = integrator->work;
    struct refdyn_dependence dependence;
    const int first = work->m - integrator->contact_count;
    for (int a = 0; a < work->m; a++) /* a contact pulls by errors of the interpolated state alone */
        lambda[a] = a < first ? integrator->lambda[a] : fmax(integrator->lambda[a], 0);
    if (are_determined(integrator))
        return;
    refdyn_programme_force(work, integrator->lambda, work->change);
    refdyn_dependence_find(&dependence, work, work->change);
    for (int a = 0; a < work->m; a++)
        lambda[a] = refdyn_dependence_multiplier(&dependence, a);
}

static void find_forces(struct refdyn_integrator *integrator, double *force) {
    struct refdyn_workspace *work = integrator->work;
    const int n = work->n, is_known = are_determined(integrator);
    struct refdyn_dependence dependence;
    refdyn_programme_force(work, integrator->lambda, force);
    if (!is_known)
        refdyn_dependence_find(&dependence, work, force);
    for (int a = 0; a < work->m; a++)
        if (work->model->rows[a].driven)
            force[work->model->rows[a].driven - 1] = 0;
    for (int a = 0; a < work->m; a++) {
        const int j = work->model->rows[a].driven - 1;
        if (j >= 0 && is_known)
            force[j] += integrator->lambda[a] * work->u[a * n + j];
        else if (j >= 0)
            force[j] = refdyn_dependence_drive(&dependence, j);
    }
}

/* out (count) := what `find` writes, or its continuation where rows do not determine the accelerations. */
static void find_or_continue(struct refdyn_integrator *integrator, find_function *find, int count,
                             double *out) {
    const struct refdyn_step *step = &integrator->motion->step;
    const double t = integrator->t, h = step->t_end - step->t_begin;
    double *at = integrator->work->away;
    if (!integrator->is_undetermined) {
        find(integrator, out);
        return;
    }
    for (int i = 0; i < count; i++)
        out[i] = refdyn_crossing_is_near(integrator->motion, t) ? 0 : NAN;
    for (int k = 0; k < NODES; k++) {
        const int is_seen =
            !refdyn_integrator_show(integrator, t + nodes[k] * h) && !integrator->is_undetermined;
        if (is_seen)
            find(integrator, at);
        for (int i = 0; i < count; i++)
            out[i] = is_seen ? out[i] + weights[k] * at[i] : NAN;
    }
    refdyn_integrator_show(integrator, t);
}

int refdyn_integrator_multipliers(struct refdyn_integrator *integrator, double *lambda) {
    if (refdyn_integrator_status(integrator))
        return REFDYN_NOT_STARTED;
    if (!lambda && integrator->work->m > 0)
        return REFDYN_BAD_MEMORY;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_row *rows = work->model->rows;
    find_or_continue(integrator, find_multipliers, work->m, lambda);
    for (int a = 0; a < work->m && integrator->is_undetermined; a++)
        if (!rows[a].driven)
            lambda[a] = NAN;
    return REFDYN_OK;
}

int refdyn_integrator_force(struct refdyn_integrator *integrator, double *force) {
    if (refdyn_integrator_status(integrator))
        return REFDYN_NOT_STARTED;
    if (!force)
        return REFDYN_BAD_MEMORY;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_row *rows = work->model->rows;
    const int n = work->n;
    int *is_driven = work->mark;
    find_or_continue(integrator, find_forces, n, force);
    if (!integrator->is_undetermined)
        return REFDYN_OK;
    memset(is_driven, 0, (size_t)n * sizeof *is_driven);
    for (int a = 0; a < work->m; a++)
        if (rows[a].driven)
            is_driven[rows[a].driven - 1] = 1;
    for (int i = 0; i < n; i++)
        if (!is_driven[i])
            force[i] = dense_dot(work->M + i * n, integrator->qdd, n) - work->f[i];
    return REFDYN_OK;
}

int refdyn_integrator_contact_forces(struct refdyn_integrator *integrator, double *forces) {
    if (refdyn_integrator_status(integrator))
        return REFDYN_NOT_STARTED;
    if (!forces && integrator->contact_count > 0)
        return REFDYN_BAD_MEMORY;
    const struct refdyn_workspace *work = integrator->work;
    struct refdyn_state_events *events = &integrator->motion->state_events;
    struct refdyn_contacts *contacts = &events->contacts;
    for (int k = 0; k < contacts->count; k++) /* a remaining pull is an error of the interpolated state */
        forces[k] = fmax(integrator->lambda[contacts->first_row + k], 0);
    if (contacts->are_unique)
        return REFDYN_OK;
    work->model->event_terms(work->p, work->x, integrator->t_right, integrator->q, integrator->qd,
                             events->terms);
    refdyn_contacts_spread(contacts, work->model, events->terms, forces);
    return REFDYN_OK;
}
