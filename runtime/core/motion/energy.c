/*
 * Energy balance of a motion, and the work of its forces (theory, sect. 8.8).
 *
 * In: an integrator at its outputs. Out: the largest |change of (kinetic + potential) - work| over the
 * largest change of kinetic energy, potential energy or work. The work of all non-conservative and programme
 * forces is integrated with the motion (options.balance), or by quadrature for methods that leave it out.
 * Jumps of the energy at impulses, and where events set values, count as work.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

/* Rounding of an energy after a motion of many steps, relative to it. */
static const double rounding = 1e-12;

int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy) {
    if (!work->model->energy)
        return REFDYN_FUNCTION_MISSING;
    work->model->energy(work->p, work->x, t, q, qd, energy);
    return REFDYN_OK;
}

static int at_state(const struct refdyn_integrator *integrator, double *energy) {
    const int status = refdyn_integrator_status(integrator);
    return status ? status
                  : refdyn_energies(integrator->work, integrator->t_right, integrator->q, integrator->qd,
                                    energy);
}

int refdyn_energy_start(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    double now[2] = {0, 0};
    const int status = at_state(integrator, now);
    *energy = (struct refdyn_energy){
        .t_start = integrator->t,
        .kinetic = now[0],
        .potential = now[1],
        .kinetic_start = now[0],
        .potential_start = now[1],
        .work_start = integrator->work_done,
        .largest_kinetic = now[0],
        .largest = fabs(now[0]) + fabs(now[1]),
    };
    return status;
}

int refdyn_energy_add(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    double now[2];
    const int status = at_state(integrator, now);
    if (status)
        return status;
    energy->kinetic = now[0];
    energy->potential = now[1];
    const double kinetic = now[0] - energy->kinetic_start, potential = now[1] - energy->potential_start;
    const double work = integrator->work_done - energy->work_start;
    const double change = fmax(fmax(fabs(kinetic), fabs(potential)), fabs(work));
    energy->largest_change = fmax(energy->largest_change, change);
    energy->largest_error = fmax(energy->largest_error, fabs(kinetic + potential - work));
    energy->largest_kinetic = fmax(energy->largest_kinetic, now[0]);
    energy->largest = fmax(energy->largest, fabs(now[0]) + fabs(now[1]) + fabs(work));
    return REFDYN_OK;
}

int refdyn_energy_scale(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    int status = refdyn_integrator_status(integrator);
    energy->unit = 0;
    if (status)
        return status;
    struct refdyn_workspace *work = integrator->work;
    const double duration = integrator->t - energy->t_start;
    const int n = work->n, joints = refdyn_joint_count(work->model);
    status = refdyn_equations(work, integrator->t_right, integrator->q, integrator->qd);
    for (int j = 0; !status && j < joints; j++) {
        const double way = refdyn_coordinate_unit(work->model, j, integrator->options.length);
        const double rate = duration > 0 ? way / duration : 0;
        energy->unit += fabs(work->f[j]) * way + work->M[j * n + j] / 2 * rate * rate;
    }
    return status;
}

double refdyn_energy_error(const struct refdyn_energy *energy) {
    return energy->largest_change > 0 ? energy->largest_error / energy->largest_change : 0;
}

int refdyn_energy_changes(const struct refdyn_energy *energy) {
    return energy->largest_change > rounding * (energy->largest + energy->unit);
}

/* ---- Energy by which a state jumps ---- */

double refdyn_energy_at_begin(const struct refdyn_motion *motion) {
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_step *step = &motion->step;
    double energy[2] = {0, 0};
    if (motion->options.balance)
        refdyn_energies(work, step->t_begin, step->state, step->state + step->n, energy);
    return energy[0] + energy[1];
}

void refdyn_energy_has_jumped(struct refdyn_motion *motion, double before) {
    struct refdyn_step *step = &motion->step;
    step->state[2 * step->n] += refdyn_energy_at_begin(motion) - before;
}

/* ---- Work on a motion whose method does not integrate it ---- */

/* step->side := the rates at theta of the step; at a time event, on its left side. */
static int rates_at(struct refdyn_step *step, double theta) {
    const double h = step->t_end - step->t_begin;
    const double t = refdyn_step_inside(step, step->t_begin + theta * h);
    int status = REFDYN_OK;
    if (theta == 1)
        memcpy(step->stage, step->state_new, (size_t)(2 * step->n) * sizeof(double));
    else
        status = step->method->kind->interpolate(step, theta, step->stage);
    if (!status && theta == 1 && step->t_end < step->t_limit)
        memcpy(step->side, step->rates_new, (size_t)(2 * step->n + 1) * sizeof(double));
    else if (!status)
        status = refdyn_rates(&step->evaluation, t, step->stage, step->side);
    return status;
}

/* By Lobatto's formula of order 6 (Hairer and Wanner, Solving ODEs II, IV.5) on the interpolant of the step.
 */
int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done) {
    const double off = sqrt(0.05), h = step->t_end - step->t_begin;
    const double places[3] = {0.5 - off, 0.5 + off, 1}, weights[3] = {5.0 / 12, 5.0 / 12, 1.0 / 12};
    const int n = step->n;
    double sum = step->rates[2 * n] / 12;
    for (int k = 0; k < 3; k++) {
        const int status = rates_at(step, theta * places[k]);
        if (status)
            return status;
        sum += weights[k] * step->side[2 * n];
    }
    *work_done = step->state[2 * n] + theta * h * sum;
    return REFDYN_OK;
}
