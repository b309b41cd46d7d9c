/* Motions by methods of GSL, in a program that is built with it; in another one none can be opened. */
#ifndef REFDYN_TOOL_GSL_MOTION_H
#define REFDYN_TOOL_GSL_MOTION_H

#include "refdyn.h"

#include <stdbool.h>

struct refdyn_gsl;

/* Is it one of GSL's methods? NULL is none. */
bool by_gsl_has(const char *method);
/* How such a method stays on the programme unless it is told otherwise. */
enum refdyn_stabilise by_gsl_stabilise(const char *method);

/* From now on GSL takes the integration's steps. Returns a status of the runtime; by_gsl_close in any case.
 */
int by_gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method);
/* As refdyn_integrator_step. */
int by_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps);
void by_gsl_close(struct refdyn_gsl *gsl);

#endif
