/*
 * Energy by which a state jumps: see motion.h.
 *
 * Takes the state at the begin of a step before and behind a jump; adds the difference to the work done, so
 * that the balance of a motion (energy.c) holds across impulses, and values that an event sets.
 */
#include "runtime/core/motion/motion.h"

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
