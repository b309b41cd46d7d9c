/** @file
 * Motions by two integrators of the GNU Scientific Library: its multistep BDF method and its extrapolation
 * method, both implicit, with the exact Jacobian.
 *
 * GSL takes the steps of an integrator of refdyn.h; states at the requested times are then those of the
 * integrator. A program that is linked with this library falls under GSL's licence, GPL-3; the core does not
 * need it.
 *
 * Memory: GSL allocates in refdyn_gsl_init only, and refdyn_gsl_release frees it. The error handler of GSL
 * belongs to the process and ends it: to get statuses instead, call gsl_set_error_handler_off() first.
 */
#ifndef REFDYN_GSL_H
#define REFDYN_GSL_H

#include <gsl/gsl_odeiv2.h>

#include "refdyn.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The methods. */
enum refdyn_gsl_method {
    REFDYN_MSBDF, /**< BDF of orders 1 to 5 in Nordsieck form, Newton's method */
    REFDYN_BSIMP, /**< extrapolated semi-implicit midpoint rule (Bader and Deuflhard, Numer. Math. 41:373-398,
                       1983) */
    REFDYN_GSL_METHOD_COUNT /**< number of methods */
};

/** "msbdf" or "bsimp"; NULL outside the range. */
const char *refdyn_gsl_method_name(int method);
/** The method with this name, -1 if there is none. */
int refdyn_gsl_method_find(const char *name);

/** A motion by GSL. It must not move between init and release, because GSL points into it. */
struct refdyn_gsl {
    unsigned long long seal;              /**< private: says whether refdyn_gsl_init has seen this struct */
    struct refdyn_integrator *integrator; /**< the motion; its state is the result */
    enum refdyn_gsl_method method;        /**< the method */
    gsl_odeiv2_system system;             /**< the first-order system that GSL integrates */
    gsl_odeiv2_driver *driver;            /**< of GSL */
    double step;                          /**< proposed next step [s] */
    int cause;                            /**< status of the last evaluation that failed in a step */
};

/**
 * Prepares steps of the integrator by GSL. The integrator was initialised with tol > 0 and with a method that
 * needs the `tangent`, for its memory. The error of a step is at most tol in each position, in units of 1 rad
 * and options.length, and in each velocity, in these units per second. step, step_max, balance and step_limit
 * apply.
 *
 * Staying on the programme: REFDYN_NONE and REFDYN_BAUMGARTE as in the core. REFDYN_PROJECT projects after
 * each step, with REFDYN_BSIMP only: REFDYN_MSBDF continues from earlier states, so a projection would make
 * it restart with order 1 after each step. Gains by options.gain_share are those of the first step,
 * options.step or sqrt(tol).
 *
 * options.singular acts as in the core. The step through a singular state may end after t_out, but not after
 * refdyn_integrator_limit and refdyn_integrator_until; the method restarts after it. A step that is long
 * compared with the curvature of the motion may cross such a state unnoticed.
 *
 * Errors: BAD_OPTION; BAD_MEMORY (GSL got none); NOT_STARTED if refdyn_integrator_init has failed. Call
 * refdyn_gsl_release in any case.
 */
int refdyn_gsl_init(struct refdyn_gsl *gsl, struct refdyn_integrator *integrator,
                    enum refdyn_gsl_method method);
/**
 * Advances like refdyn_integrator_step, after refdyn_integrator_start and, if the caller changed the state,
 * refdyn_integrator_refresh. After these calls, changed values, and each time event, the method restarts.
 * Steps end at t_out and nothing is interpolated: refdyn_integrator_until and _limit are not needed, and
 * refdyn_integrator_look does not apply to these steps. Errors as in refdyn_integrator_step.
 */
int refdyn_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps);
/** Advances like refdyn_integrator_to, with the same conditions. */
int refdyn_gsl_to(struct refdyn_gsl *gsl, double t_out);
/** Frees GSL's memory. */
void refdyn_gsl_release(struct refdyn_gsl *gsl);

#ifdef __cplusplus
}
#endif

#endif
