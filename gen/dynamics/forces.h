/*
 * Applied forces: springs and dampers on coordinates, and what the author names (forces on coordinates, loads
 * at points, energies).
 *
 * Takes the model's forces in symbols, gives generalized forces Q_j, their potential, their power and their
 * tangent (theory, sect. 4.9). A load F at a point gives Q = C^T F, a torque acts on the turns of its body,
 * an energy V gives Q = -dV/dq, which is a force -dV/dq_j on each coordinate and a load -dV/dr at each point.
 */
#ifndef REFDYN_GEN_FORCES_H
#define REFDYN_GEN_FORCES_H

#include "dynamics/kinematics.h"

/* All forces, loads and energies of the model as forces on coordinates and loads at points, in symbols. */
struct named_forces {
    struct force *forces; /* `coordinate` is the frame */
    struct load *loads;
    int force_count, load_count;
    int own_forces, own_loads; /* the first ones are the author's own, the others come from energies */
};

struct named_forces forces_collect(const struct kinematics *k);

struct applied {
    expression *conservative; /* n: springs and energies */
    expression *others;       /* n: dampers, forces and loads that the author names */
    expression *strained;     /* n: the sum of both where springs act on strains, 0 elsewhere: J^T once */
};

struct applied forces_generalized(const struct kinematics *k);
/* Energy of springs, 1/2 s (q - rest)^2 or that of strains, and of the author's potentials. */
expression forces_energy(const struct kinematics *k);
/* dQ_i/dq_j of all of these at qd = 0 (n x n). */
expression *forces_tangent(const struct kinematics *k);
/* sum_j qd_j dQ_j/dqd_i: the printed form's extra term. */
expression *forces_printed_rates(const struct kinematics *k);

#endif
