/*
 * Energy balance of a motion (theory, sect. 8.8).
 *
 * Takes a drive at its outputs; gives the largest |change of (kinetic + potential) - work| over the largest
 * change of kinetic energy, potential energy or work. Work is that of all non-conservative and programme
 * forces, integrated with the motion (options.balance).
 */
#include "base/arithmetic.h"

#include "refdyn.h"

#include <math.h>

int refdyn_energies(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                    double *energy) {
    if (!work->model->energy)
        return REFDYN_FUNCTION_MISSING;
    work->model->energy(work->p, work->x, t, q, qd, energy);
    return REFDYN_OK;
}

static int at_drive(const struct refdyn_drive *drive, double *energy) {
    return refdyn_energies(drive->work, drive->t_right, drive->q, drive->qd, energy);
}

int refdyn_energy_start(struct refdyn_energy *energy, const struct refdyn_drive *drive) {
    double now[2] = {0, 0};
    const int status = at_drive(drive, now);
    *energy = (struct refdyn_energy){
        .kinetic = now[0],
        .potential = now[1],
        .kinetic_start = now[0],
        .potential_start = now[1],
        .work_start = drive->work_done,
    };
    return status;
}

int refdyn_energy_add(struct refdyn_energy *energy, const struct refdyn_drive *drive) {
    double now[2];
    const int status = at_drive(drive, now);
    if (status)
        return status;
    energy->kinetic = now[0];
    energy->potential = now[1];
    const double kinetic = now[0] - energy->kinetic_start, potential = now[1] - energy->potential_start;
    const double work = drive->work_done - energy->work_start;
    const double change = fmax(fmax(fabs(kinetic), fabs(potential)), fabs(work));
    energy->largest_change = fmax(energy->largest_change, change);
    energy->largest_error = fmax(energy->largest_error, fabs(kinetic + potential - work));
    return REFDYN_OK;
}

double refdyn_energy_error(const struct refdyn_energy *energy) {
    return energy->largest_change > 0 ? energy->largest_error / energy->largest_change : 0;
}
