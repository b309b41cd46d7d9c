/* A user's program: the emitted rigid manipulator and the installed runtime, a tenth of a second of motion.
 */
#include "manipulator_rigid.h"
#include <refdyn.h>

#include <stdio.h>
#include <stdlib.h>

int main(void) {
    const struct refdyn_model *model = &manipulator_rigid_model;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    size_t work_size = refdyn_workspace_size(model),
           integrator_size = refdyn_integrator_size(model, &options);
    void *work_memory = malloc(work_size), *integrator_memory = malloc(integrator_size);
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double *state = calloc(2 * (size_t)model->n, sizeof *state);
    int status = refdyn_workspace_init(&work, model, work_memory, work_size);
    if (status == 0)
        status = refdyn_integrator_init(&integrator, &work, &options, integrator_memory, integrator_size);
    if (status == 0) {
        refdyn_prepare(&work);
        refdyn_initial_state(&work, state, state + model->n);
        refdyn_anchor(&work, 0, state, state + model->n, NULL);
        status = refdyn_integrator_start(&integrator, 0, state, state + model->n);
    }
    if (status == 0)
        status = refdyn_integrator_to(&integrator, 0.1);
    printf("%.17g %.17g\n", integrator.t, integrator.q[0]);
    free(state);
    free(integrator_memory);
    free(work_memory);
    return status != 0;
}
