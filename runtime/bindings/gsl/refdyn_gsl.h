/*
 * Motions by two integrators of the GNU Scientific Library: its multistep BDF method and its extrapolation
 * method, both implicit, with the exact Jacobian.
 *
 * Takes an integrator of refdyn.h whose steps GSL then takes; gives the states at the times asked for, as it
 * does. A program that is linked with this falls under GSL's licence, GPL-3; the core needs none of it.
 *
 * Memory: GSL allocates at init alone, and the release frees it. GSL's error handler is one for the process
 * and ends it: a program that wants statuses instead calls gsl_set_error_handler_off() first.
 */
#ifndef REFDYN_GSL_H
#define REFDYN_GSL_H

#include <gsl/gsl_odeiv2.h>

#include "refdyn.h"

#ifdef __cplusplus
extern "C" {
#endif

enum refdyn_gsl_method {
    REFDYN_MSBDF, /* BDF of orders 1 to 5 in Nordsieck form, Newton's method */
    REFDYN_BSIMP, /* extrapolated semi-implicit midpoint rule (Bader and Deuflhard, Numer. Math. 41:373-398,
                     1983) */
    REFDYN_GSL_METHOD_COUNT
};

/* "msbdf", "bsimp"; NULL outside the range. */
const char *refdyn_gsl_method_name(int method);
/* The method of that name, -1 when there is none. */
int refdyn_gsl_method_find(const char *name);

/* Stays where it is from init to release: GSL points into it. */
struct refdyn_gsl {
    struct refdyn_integrator *integrator;
    enum refdyn_gsl_method method;
    gsl_odeiv2_system system;
    gsl_odeiv2_driver *driver;
    double step; /* proposed [s] */
    int cause;   /* status of the last evaluation that failed in a step */
};

/*
 * Steps of the integrator by GSL. It was initialised with one of the methods that need the `tangent`, for
 * its room, and with tol > 0. The error of a step is at most tol in each position, in units of 1 rad and
 * options.length, and in each velocity, in these units a second. step, step_max, balance and step_limit
 * apply.
 *
 * Staying on the programme: REFDYN_NONE and REFDYN_BAUMGARTE as in the core. REFDYN_PROJECT after each step,
 * with bsimp alone: a projection would make msbdf, which goes on from earlier states, start again with order
 * 1 after each step. Gains by options.gain_share are those of the first step,
 * options.step or sqrt(tol).
 *
 * options.singular: as in the core; the step through such a state may end beyond t_out, though not beyond
 * refdyn_integrator_limit and refdyn_integrator_until, and the method starts anew behind it. A step that is
 * long beside the curvature of the motion may go over one without noticing.
 *
 * Errors: BAD_OPTION, BAD_MEMORY (GSL got none). refdyn_gsl_release in any case.
 */
int refdyn_gsl_init(struct refdyn_gsl *gsl, struct refdyn_integrator *integrator,
                    enum refdyn_gsl_method method);
/*
 * As refdyn_integrator_step and refdyn_integrator_to, after refdyn_integrator_start and, where the caller
 * changed something, refdyn_integrator_refresh: after these the method starts anew, as it does behind each
 * break of the model. Steps end at t_out, nothing else is interpolated: refdyn_integrator_until and _limit
 * are not needed, refdyn_integrator_look not for these.
 */
int refdyn_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps);
int refdyn_gsl_to(struct refdyn_gsl *gsl, double t_out);
void refdyn_gsl_release(struct refdyn_gsl *gsl);

#ifdef __cplusplus
}
#endif

#endif
