/* A user's program: the emitted rigid manipulator and the installed runtime, a tenth of a second of motion.
 */
#include "manipulator_rigid.h"
#include <refdyn.h>

#include <stdio.h>
#include <stdlib.h>

int main(void) {
    const struct refdyn_model *model = &manipulator_rigid_model;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    size_t work_size = refdyn_workspace_size(model), drive_size = refdyn_drive_size(model, &options);
    void *work_memory = malloc(work_size), *drive_memory = malloc(drive_size);
    struct refdyn_workspace work;
    struct refdyn_drive drive;
    double *state = calloc(2 * (size_t)model->n, sizeof *state);
    int status = refdyn_workspace_init(&work, model, work_memory, work_size);
    if (status == 0)
        status = refdyn_drive_init(&drive, &work, &options, drive_memory, drive_size);
    if (status == 0) {
        refdyn_prepare(&work);
        refdyn_initial_state(&work, state, state + model->n);
        refdyn_anchor(&work, 0, state, state + model->n, NULL);
        status = refdyn_drive_start(&drive, 0, state, state + model->n);
    }
    if (status == 0)
        status = refdyn_drive_to(&drive, 0.1);
    printf("%.17g %.17g\n", drive.t, drive.q[0]);
    free(state);
    free(drive_memory);
    free(work_memory);
    return status != 0;
}
