/*
 * Energy balance of a motion, and the work of its forces (theory, sect. 8.8).
 *
 * In: an integrator at its outputs. Out: the largest |change of (kinetic + potential) - work| at the ends of
 * steps over the largest change of kinetic energy, potential energy or work. The work of all non-conservative
 * and programme forces is integrated with the motion (options.balance), or by quadrature for methods that
 * leave it out. Jumps of the energy at impulses, and where events set values, count as work.
 *
 * The error of the state alone bounds the steps. Where a programme determines the state exactly, a step may
 * be far too long for the integral of its power. If energy and work of such a step differ, a quadrature of
 * the power is refined until it settles. It replaces the work of the step if it explains the difference.
 *
 * Inside a step the work is only as accurate as the interpolant of the method. Energy and work are therefore
 * compared at the ends of steps, and inside a step only if it does no work.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>
#include <string.h>

/* Rounding of an energy after a motion of many steps, relative to it. */
static const double rounding = 1e-12;

int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy) {
    if (!refdyn_is_laid_out(work) || !q || !qd || !energy)
        return refdyn_missing_status(work);
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
    if (!energy)
        return REFDYN_BAD_MEMORY;
    *energy = (struct refdyn_energy){0};
    const int status = at_state(integrator, now);
    if (status == REFDYN_NOT_STARTED)
        return status;
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

/* Adds the error |change of energy (2) - work|. */
static void add_error(struct refdyn_energy *energy, const double *at, double work_done) {
    const double kinetic = at[0] - energy->kinetic_start, potential = at[1] - energy->potential_start;
    const double error = fabs(kinetic + potential - (work_done - energy->work_start));
    energy->largest_error = fmax(energy->largest_error, error);
}

/* Adds the changes of the energy (2) of a shown state, and of the work. */
static void add_changes(struct refdyn_energy *energy, const double *shown, double work_done) {
    const double kinetic = shown[0] - energy->kinetic_start, potential = shown[1] - energy->potential_start;
    const double work = work_done - energy->work_start;
    const double change = fmax(fmax(fabs(kinetic), fabs(potential)), fabs(work));
    energy->kinetic = shown[0];
    energy->potential = shown[1];
    energy->largest_change = fmax(energy->largest_change, change);
    energy->largest_kinetic = fmax(energy->largest_kinetic, shown[0]);
    energy->largest = fmax(energy->largest, fabs(shown[0]) + fabs(shown[1]) + fabs(work));
}

int refdyn_energy_add(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    double shown[2], last[2];
    int status = energy ? at_state(integrator, shown) : REFDYN_BAD_MEMORY;
    if (status)
        return status;
    const struct refdyn_motion *motion = integrator->motion;
    const struct refdyn_step *step = &motion->step;
    const int n = step->n, is_inside = integrator->t < step->t_end;
    const double begin = step->state[2 * n], *end = step->state_new;
    const double work_done = is_inside ? end[2 * n] : integrator->work_done;
    add_changes(energy, shown, work_done);
    if (!is_inside || (integrator->work_done == begin && work_done == begin)) /* the step does no work */
        add_error(energy, shown, work_done);
    if (is_inside)
        status = refdyn_energies(motion->work, refdyn_rows_side_of(motion, step->t_end), end, end + n, last);
    if (is_inside && !status)
        add_error(energy, last, work_done);
    return status;
}

int refdyn_energy_scale(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    if (!energy)
        return REFDYN_BAD_MEMORY;
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
    return energy && energy->largest_change > 0 ? energy->largest_error / energy->largest_change : 0;
}

int refdyn_energy_changes(const struct refdyn_energy *energy) {
    return energy && energy->largest_change > rounding * (energy->largest + energy->unit);
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

/* ---- Work by quadrature on the interpolant of a step ---- */

/* step->stage := the state at theta of the step; with is_met, moved onto the programme. */
static int state_at(struct refdyn_step *step, double theta, double t, int is_met) {
    if (theta == 1) {
        memcpy(step->stage, step->state_new, (size_t)(2 * step->n) * sizeof(double));
        return REFDYN_OK;
    }
    const int status = step->method->kind->interpolate(step, theta, step->stage);
    return status || !is_met
               ? status
               : refdyn_project(step->evaluation.work, t, step->stage, step->stage + step->n, NULL);
}

/* Power at theta of the step; at a time event, on its left side. */
static int power_at(struct refdyn_step *step, double theta, int is_met, double *power) {
    const double h = step->t_end - step->t_begin;
    const double t = refdyn_step_inside(step, step->t_begin + theta * h);
    int status = state_at(step, theta, t, is_met);
    if (!status && theta == 1 && step->t_end < step->t_limit)
        memcpy(step->side, step->rates_new, (size_t)(2 * step->n + 1) * sizeof(double));
    else if (!status)
        status = refdyn_rates(&step->evaluation, t, step->stage, step->side);
    *power = step->side[2 * step->n];
    return status;
}

/* Work from the beginning of the step to theta, by Lobatto's formula of order 6 (Hairer and Wanner, Solving
 * ODEs II, IV.5) in equal parts; *size: the same integral of |power|. */
static int integrate_power(struct refdyn_step *step, double theta, int parts, int is_met, double *work,
                           double *size) {
    const double off = sqrt(0.05), part = theta / parts, h = part * (step->t_end - step->t_begin);
    const double places[3] = {0.5 - off, 0.5 + off, 1}, weights[3] = {5.0 / 12, 5.0 / 12, 1.0 / 12};
    double power = step->rates[2 * step->n], sum = power / 12, sum_of_sizes = fabs(power) / 12;
    for (int i = 0; i < parts; i++)
        for (int k = 0; k < 3; k++) {
            const double weight = k == 2 && i + 1 < parts ? 2 * weights[k] : weights[k];
            const int status = power_at(step, part * (i + places[k]), is_met, &power);
            if (status)
                return status;
            sum += weight * power;
            sum_of_sizes += weight * fabs(power);
        }
    *work = h * sum;
    *size = h * sum_of_sizes;
    return REFDYN_OK;
}

int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done) {
    double work, size;
    const int status = integrate_power(step, theta, 1, 0, &work, &size);
    if (!status)
        *work_done = step->state[2 * step->n] + work;
    return status;
}

/* ---- Steps that are too long for their work ---- */

/* Up to this error, in tolerances, the state of a step is exact: its error does not bound the step. */
static const double exact = 1e-3;
/* Energy and work of a step differ if they do so by more than this part of the larger of its kinetic energy
 * and its work, and by more than rounding. */
static const double differing = 1e-4;
/* The quadrature has settled when the work changes by at most this part of the integral of |power|. Its error
 * is then 1/64 of this, and near a kink of the power still far below `differing`. */
static const double settled = 1e-6;

enum {
    PARTS_MOST = 64 /* of a step in the refined quadrature */
};

/* *work := the work of the step by ever finer quadrature; *size: the integral of |power|. Returns whether the
 * quadrature has settled. Its evaluations do not count, because the automatic choice of the method compares
 * the cost of steps. */
static int refine_work(struct refdyn_motion *motion, double *work, double *size) {
    const int is_met = motion->work->m > 0 && motion->options.stabilise == REFDYN_PROJECT;
    const long evaluations = motion->work->evaluations;
    double change = INFINITY;
    *work = *size = 0;
    for (int parts = 1; parts <= PARTS_MOST && !(change <= settled * *size); parts *= 2) {
        const double before = *work;
        if (integrate_power(&motion->step, 1, parts, is_met, work, size))
            break;
        change = parts > 1 ? fabs(*work - before) : INFINITY;
    }
    motion->work->evaluations = evaluations;
    return change <= settled * *size;
}

/* Is the state at the end of the step exact? Where rows determine all coordinates, projection removes its
 * error. */
static int is_exact(const struct refdyn_motion *motion, double error) {
    return error <= exact ||
           (motion->options.stabilise == REFDYN_PROJECT && motion->work->partition.rank == motion->work->n);
}

void refdyn_resolve_work(struct refdyn_motion *motion, double error) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_workspace *work = motion->work;
    const double *begin = step->state, *end = step->state_new;
    const int n = step->n;
    double first[2], last[2], found, size;
    if (!motion->options.balance || !is_exact(motion, error) ||
        refdyn_energies(work, step->t_begin, begin, begin + n, first) ||
        refdyn_energies(work, refdyn_rows_side_of(motion, step->t_end), end, end + n, last))
        return;
    const double change = last[0] - first[0] + (last[1] - first[1]), done = end[2 * n] - begin[2 * n];
    const double scale = fmax(fmax(first[0], last[0]), fabs(done));
    const double least = differing * scale + rounding * (fabs(first[1]) + fabs(last[1]));
    if (fabs(change - done) > least && refine_work(motion, &found, &size) &&
        fabs(change - found) <= differing * fmax(scale, size))
        step->state_new[2 * n] = begin[2 * n] + found;
}
