/* Keeping a motion on its programme: projections along directions that fit the method. */
#ifndef REFDYN_PROGRAMME_H
#define REFDYN_PROGRAMME_H

#include "base/layout.h"
#include "methods/step.h"

/* For which matrix the directions of the linearisation were found. */
struct refdyn_programme {
    double *q;     /* (n) in the metric of M at this position, */
    int choice;    /* with partition.choices then, -1: not of M; */
    long factored; /* of a step's matrix, linear->factored then, -1: not of one */
    long aligned;  /* how often directions in the metric of M were found */
};

void refdyn_programme_lay_out(struct refdyn_programme *programme, const struct refdyn_model *model,
                              struct layout *layout);
/* The directions are to be found anew. */
void refdyn_programme_forget(struct refdyn_programme *programme);
/* Moves a state (2 n) at t onto the programme. The row terms of the state are in the workspace, at the end
 * those of the new one. Errors: those of refdyn_project. */
int refdyn_programme_meet(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                          double *state);
/* Its part for methods that do not project by their matrix: finds directions that suit the state, unless
 * those that there are do. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_programme_align(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                           const double *state);
/* Directions of a step's matrix that somebody else has factored go where this points (m x n, of all rows in
 * their order). */
double *refdyn_programme_take_directions(struct refdyn_programme *programme, struct refdyn_linear *linear);
/* Does a projection change velocities by a part of the largest that no error of a step is, and, over a time
 * h, by more than positions may? Where the rows lose rank it says nothing about velocities. Both states (2
 * n). */
int refdyn_programme_moves_velocities(const struct refdyn_step *step, const double *before,
                                      const double *after, double h);
/* The largest change of a position by a projection that is no sign of a step that went wrong. */
double refdyn_programme_moved_most(const struct refdyn_step *step);

#endif
