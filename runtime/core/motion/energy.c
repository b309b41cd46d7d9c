/*
 * Energy balance of a motion (theory, sect. 8.8).
 *
 * Takes an integrator at its outputs; gives the largest |change of (kinetic + potential) - work| over the
 * largest change of kinetic energy, potential energy or work. Work is that of all non-conservative and
 * programme forces, integrated with the motion (options.balance).
 */
#include "runtime/core/base/core.h"

#include "refdyn.h"

#include <math.h>

/* Of an energy: what its rounding makes of it in a motion of many steps. */
static const double rounding = 1e-12;

int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy) {
    if (!work->model->energy)
        return REFDYN_FUNCTION_MISSING;
    work->model->energy(work->p, work->x, t, q, qd, energy);
    return REFDYN_OK;
}

static int at_state(const struct refdyn_integrator *integrator, double *energy) {
    return refdyn_energies(integrator->work, integrator->t_right, integrator->q, integrator->qd, energy);
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

void refdyn_energy_scale(struct refdyn_energy *energy, const struct refdyn_integrator *integrator) {
    struct refdyn_workspace *work = integrator->work;
    const double duration = integrator->t - energy->t_start;
    const int n = work->n,
              status = refdyn_equations(work, integrator->t_right, integrator->q, integrator->qd);
    energy->unit = 0;
    for (int j = 0; !status && j < n; j++) {
        const double way = refdyn_coordinate_unit(work->model, j, integrator->options.length);
        const double rate = duration > 0 ? way / duration : 0;
        energy->unit += fabs(work->f[j]) * way + work->M[j * n + j] / 2 * rate * rate;
    }
}

double refdyn_energy_error(const struct refdyn_energy *energy) {
    return energy->largest_change > 0 ? energy->largest_error / energy->largest_change : 0;
}

int refdyn_energy_changes(const struct refdyn_energy *energy) {
    return energy->largest_change > rounding * (energy->largest + energy->unit);
}
