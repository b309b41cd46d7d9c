/* A user's program in which GSL takes the steps: the rigid manipulator, half a second, restarted half way. */
#include "manipulator_rigid.h"
#include <refdyn_gsl.h>

#include <gsl/gsl_errno.h>
#include <stdio.h>
#include <stdlib.h>

static int run(struct refdyn_integrator *integrator, struct refdyn_workspace *work,
               const struct refdyn_options *options, enum refdyn_gsl_method method) {
    const size_t size = refdyn_integrator_size(work->model, options);
    void *memory = malloc(size);
    double q[4], qd[4];
    struct refdyn_gsl gsl;
    int status = 0;
    *integrator = (struct refdyn_integrator){.work = work};
    if (refdyn_gsl_init(&gsl, integrator, method) != REFDYN_NOT_STARTED ||
        refdyn_gsl_to(&gsl, 0.25) != REFDYN_NOT_STARTED)
        status = -1000;
    if (!status)
        status = refdyn_integrator_init(integrator, work, options, memory, size);
    if (!status)
        status = refdyn_gsl_init(&gsl, integrator, method);
    if (!status && refdyn_gsl_to(&gsl, 0.25) != REFDYN_NOT_STARTED)
        status = -1000;
    if (!status) {
        refdyn_prepare(work);
        refdyn_initial_state(work, q, qd);
        refdyn_anchor(work, 0, q, qd, NULL);
        status = refdyn_integrator_start(integrator, 0, q, qd);
        if (!status)
            status = refdyn_gsl_to(&gsl, 0.25);
        if (!status)
            status = refdyn_integrator_refresh(integrator);
        if (!status)
            status = refdyn_gsl_to(&gsl, 0.5);
        if (!status && (integrator->t != 0.5 || refdyn_gsl_to(&gsl, 0.4) != REFDYN_BAD_TIME))
            status = -1000;
        printf("%s %.17g %.17g\n", refdyn_gsl_method_name((int)method), integrator->q[0], integrator->qd[0]);
        refdyn_gsl_release(&gsl);
    }
    free(memory);
    return status;
}

int main(void) {
    const struct refdyn_model *model = &manipulator_rigid_model;
    const size_t size = refdyn_workspace_size(model);
    void *memory = malloc(size);
    struct refdyn_options options = refdyn_options_default(REFDYN_RODAS5P);
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    gsl_set_error_handler_off();
    options.tol = 1e-9;
    int status = refdyn_workspace_init(&work, model, memory, size);
    if (!status &&
        run(&integrator, &work, &options, REFDYN_MSBDF) != REFDYN_BAD_OPTION) /* it cannot project */
        status = 1000;
    if (!status)
        status = run(&integrator, &work, &options, REFDYN_BSIMP);
    options.stabilise = REFDYN_BAUMGARTE;
    if (!status)
        status = run(&integrator, &work, &options, REFDYN_MSBDF);
    options.step_limit = 3;
    if (!status && run(&integrator, &work, &options, REFDYN_MSBDF) != REFDYN_TOO_MANY_STEPS)
        status = 1000;
    free(memory);
    return status != 0;
}
