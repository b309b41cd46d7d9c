/* Options of a motion that repeats another one more accurately, so that their difference estimates its error.
 */
#include "runtime/record/record.h"

#include <math.h>

/* Factor of the tolerance. Errors scatter about the tolerance by a factor of ten, mostly those of
 * collocation, so a tenth of it would sometimes have the same error. */
static const double part = 0.01;
/* Below this tolerance rounding exceeds the error of the steps. */
static const double least = 1e-14;
const double record_finer_most = 0.1;
/* Tolerance of rates in the finer motion, unless the motion has a smaller one itself, and its least value. */
static const double rates = 1e-7, rates_least = 1e-9;
const int record_finer_looks = 8;

/* The largest step shrinks as well, since something else may limit the steps. If iterations use another
 * tolerance, the factor applies to that one. */
struct refdyn_options record_finer_options(const struct refdyn_integrator *integrator, double *share) {
    struct refdyn_options options = integrator->options;
    options.event_looks = record_finer_looks;
    const int order = refdyn_method_order(integrator->method);
    if (options.tol > 0) {
        const long *steps_by = integrator->statistics.steps_by;
        if (steps_by[REFDYN_RADAU9] > 0 || steps_by[REFDYN_GAUSS12] > 0)
            options.tol = refdyn_settled_tolerance(options.tol);
        *share = fmin(fmax(part, least / options.tol), record_finer_most);
        options.tol *= *share;
        options.step_max = integrator->statistics.step_largest * pow(*share, 1.0 / order);
        if (integrator->work->model->saturates && refdyn_has_tangent(integrator->work->model))
            options.method = REFDYN_RADAU9; /* another method may miss the same events in both runs */
    } else {
        options.step /= 2;
        *share = pow(0.5, order);
    }
    return options;
}

/* Without it, errors of accelerations do not follow the tolerance of positions. */
double record_finer_rates(const struct refdyn_options *options) {
    if (options->tol == 0)
        return 0;
    return options->tol_rates > 0 ? fmax(fmin(rates, part * options->tol_rates), rates_least) : rates;
}
