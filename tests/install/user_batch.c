/* A user's program with batches: the motion of user.c twice on two threads, and its derivative by a start
 * value. */
#include "manipulator_rigid.h"
#include <refdyn_batch.h>

#include <stdio.h>
#include <stdlib.h>

int main(void) {
    const struct refdyn_model *model = &manipulator_rigid_model;
    const size_t width = 2 * (size_t)model->n;
    const double times[] = {0.1};
    double *states = calloc(2 * width, sizeof *states), *slopes = calloc(3 * width, sizeof *slopes);
    struct refdyn_batch batch = {.model = model,
                                 .options = refdyn_options_default(REFDYN_RK4),
                                 .times = times,
                                 .time_count = 1,
                                 .count = 2,
                                 .threads = 2,
                                 .states = states};
    const struct refdyn_variable variable = {REFDYN_VARIED_COORDINATE, 0};
    struct refdyn_underivable underivable;
    struct refdyn_derivatives derivatives = {.batch = &batch,
                                             .count = 1,
                                             .variables = &variable,
                                             .width = (int)width,
                                             .derivatives = slopes,
                                             .underivable = &underivable};
    int status = refdyn_batch_run(&batch, NULL);
    if (status == 0)
        status = refdyn_derivatives_run(&derivatives);
    if (status == 0 && (states[0] != states[width] || derivatives.outputs != 2))
        status = 1;
    printf("%.17g %.17g\n", times[0], states[0]);
    free(states);
    free(slopes);
    return status != 0;
}
