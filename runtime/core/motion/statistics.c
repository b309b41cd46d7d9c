/*
 * What is told of a motion: see motion.h.
 *
 * Takes accepted and rejected steps as they come; gives counts and extremes.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>

void refdyn_statistics_residuals(struct refdyn_statistics *statistics, const struct refdyn_workspace *work) {
    const struct refdyn_residual now = refdyn_residuals(work);
    if (now.phi_row >= 0 && (statistics->phi_row < 0 || now.phi > statistics->phi_max)) {
        statistics->phi_max = now.phi;
        statistics->phi_row = now.phi_row;
    }
    if (now.psi_row >= 0 && (statistics->psi_row < 0 || now.psi > statistics->psi_max)) {
        statistics->psi_max = now.psi;
        statistics->psi_row = now.psi_row;
    }
}

void refdyn_statistics_step(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                            double h) {
    statistics->step_smallest = statistics->steps ? fmin(statistics->step_smallest, h) : h;
    statistics->step_largest = fmax(statistics->step_largest, h);
    statistics->steps++;
    refdyn_statistics_residuals(statistics, work);
}

void refdyn_statistics_method(struct refdyn_statistics *statistics, enum refdyn_method method) {
    statistics->steps_by[method]++;
}

void refdyn_statistics_rejected(struct refdyn_statistics *statistics, long count) {
    statistics->rejected += count;
}

void refdyn_statistics_crossing(struct refdyn_statistics *statistics, struct refdyn_crossing crossing) {
    if (statistics->crossings < REFDYN_CROSSINGS_KEPT)
        statistics->crossing[statistics->crossings] = crossing;
    statistics->crossings++;
    statistics->crossing_error = fmax(statistics->crossing_error, crossing.error);
}

void refdyn_statistics_collect(struct refdyn_statistics *statistics, const struct refdyn_workspace *work,
                               const struct refdyn_linear_counts *counts, long evaluations) {
    statistics->evaluations = evaluations;
    statistics->tangents = counts->tangents;
    statistics->factorisations = counts->factorisations;
    statistics->solutions = counts->solutions;
    statistics->partition_changes = work->partition.changes;
    statistics->pivot_min = work->partition.pivot_min;
    statistics->condition_max = work->partition.condition_max;
}
