/*
 * The parameters of a motion: the caller's, with the gains of the step in the places that the model names.
 *
 * While an integrator works, the workspace evaluates with these; the caller's own are written by events
 * alone.
 */
#ifndef REFDYN_PARAMETERS_H
#define REFDYN_PARAMETERS_H

#include "base/layout.h"
#include "refdyn.h"

struct refdyn_parameters {
    double *own;     /* as work->p */
    double *callers; /* work->p while `own` are in use */
};

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout);
/* From here to _leave the workspace evaluates with the motion's parameters. */
void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work);
/* Inside: sets the caller's parameter at a place of p, and takes the caller's values anew. */
void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value);
/* Inside: takes the caller's values anew. */
void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_model *model);
/* The gains that the options ask for, for a step of h; INFINITY: none. */
void refdyn_parameters_set_gains(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                                 const struct refdyn_options *options, double h);

#endif
